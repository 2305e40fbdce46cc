// A lesson's lab in the reader's own JupyterLab or hub: in one click where its address is known, of the site or theirs.
document.addEventListener("DOMContentLoaded", () => document.querySelectorAll("div.lab").forEach(offer));

function offer(place) {
  const form = place.querySelector("form");
  const field = form.querySelector("input");
  const link = place.querySelector("p.open");
  const show = () => {
    const address = localStorage.getItem("jupyter") ?? place.dataset.address;
    // An address that names a folder is taken up to there; of any other, the server is enough.
    const folder = /^.*lab\/tree(\/(?!lessons|labs)[^/?#&]+)*/.exec(address)?.[0];
    const server = address.replace(/[?#].*/, "").replace(/\/(lab)?\/*$/, "");
    link.querySelector("a").href = `${folder ?? `${server}/lab/tree`}/${place.dataset.lab}`;
    field.value = address;
    link.hidden = !address;
    form.hidden = place.querySelector("p.how").hidden = Boolean(address);
  };
  form.addEventListener("submit", (event) => {
    event.preventDefault(); // the browser has looked whether it is a URL
    localStorage.setItem("jupyter", /^https?:/.test(field.value) ? field.value : "");
    show();
  });
  link.querySelector("button").addEventListener("click", () => {
    form.hidden = place.querySelector("p.how").hidden = false;
    field.focus();
  });
  show();
}
