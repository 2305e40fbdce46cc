// Views in 3-D: plotly is loaded once, and only on a page that has a view; each is drawn when the reader comes near it.
const here = document.currentScript.src;
let plotly = null;
function load() {
  plotly ??= new Promise((done) => {
    const script = document.createElement("script");
    script.src = new URL("plotly.min.js", here);
    script.onload = done;
    document.head.append(script);
  });
  return plotly;
}
async function draw(view) {
  const { data, layout } = JSON.parse(view.querySelector("script").textContent);
  const camera = structuredClone(layout.scene.camera); // plotly changes the layout's own
  await load();
  await Plotly.newPlot(view, data, layout, { responsive: true });
  view.addEventListener("dblclick", () => Plotly.relayout(view, { "scene.camera": structuredClone(camera) }));
}
document.addEventListener("DOMContentLoaded", () => {
  const near = new IntersectionObserver((entries) => {
    for (const entry of entries.filter((entry) => entry.isIntersecting)) {
      near.unobserve(entry.target);
      draw(entry.target);
    }
  }, { rootMargin: "600px" });
  document.querySelectorAll("div.view").forEach((view) => near.observe(view));
  document.querySelectorAll("article table, article pre").forEach((wide) => (wide.tabIndex = 0)); // keys scroll them
  document.querySelectorAll("article img").forEach((image) => (image.loading = "lazy"));
});
