// Explorers: real sliders, lists and boxes that choose among the pictures which explorers.py drew, and say it in words.
document.addEventListener("DOMContentLoaded", () => document.querySelectorAll("figure.explorer").forEach(revive));

function element(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

function control({ label, kind, options, start }, id, moved) {
  if (kind === "list") {
    const list = element("select", { id }, ...options.map((text) => element("option", {}, text)));
    list.selectedIndex = start;
    list.addEventListener("change", () => moved(list.selectedIndex));
    return [element("label", { htmlFor: id }, label), list, element("span")];
  }
  if (kind === "box") {
    const box = element("input", { id, type: "checkbox", checked: start === 1 });
    box.addEventListener("change", () => moved(Number(box.checked)));
    return [element("label", { htmlFor: id }, label), box, element("span")];
  }
  const slider = element("input", { id, type: "range", min: 0, max: options.length - 1, value: start });
  const value = element("output", { htmlFor: id }, options[start]);
  slider.setAttribute("aria-valuetext", options[start]);
  slider.addEventListener("input", () => {
    value.textContent = options[slider.value];
    slider.setAttribute("aria-valuetext", options[slider.value]);
    moved(Number(slider.value));
  });
  return [element("label", { htmlFor: id }, label), slider, value];
}

function revive(explorer) {
  const { controls, words } = JSON.parse(explorer.querySelector("script").textContent);
  const picture = explorer.querySelector("img");
  const said = explorer.querySelector("figcaption p");
  const folder = picture.src.replace(/[^/]*$/, "");
  const at = controls.map((c) => c.start);
  const show = () => {
    const state = controls.reduce((sum, c, i) => sum * c.options.length + at[i], 0);
    picture.src = `${folder}${state}.webp`;
    said.textContent = words[state];
  };
  const rows = controls.map((c, i) => control(c, `${explorer.id}-${i}`, (option) => ((at[i] = option), show())));
  explorer.prepend(element("div", { className: "controls" }, ...rows.flat()));
  // Whoever touches one control will soon want the other pictures.
  const fetchAll = () => words.forEach((_, state) => (new Image().src = `${folder}${state}.webp`));
  explorer.addEventListener("focusin", fetchAll, { once: true });
  picture.addEventListener("click", () => picture.parentElement.classList.toggle("large")); // seen on a phone alone
}
