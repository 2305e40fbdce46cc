// A lesson and its lab have the same file name, which is all that JupyterLab writes on a tab: here a word before it says
// which is which. A style sheet does it, because JupyterLab renames the file of a tab whose label a program changes.
// JupyterLab finds this folder by JUPYTER_PATH; a prebuilt extension is an object with `init` and `get`, and needs no build.
const rule = (kind) => `
  .lm-DockPanel-tabBar .lm-TabBar-tab:is([title*=": ${kind}s/"], [title*="/${kind}s/"]) .lm-TabBar-tabLabel::before {
    content: "${kind} ";
  }`;

const plugin = {
  id: "labkit-tabs:plugin",
  autoStart: true,
  activate: () => {
    const sheet = document.createElement("style");
    sheet.textContent = ["lesson", "lab", "solution"].map(rule).join("");
    document.head.append(sheet);
  },
};

window._JUPYTERLAB = window._JUPYTERLAB ?? {};
window._JUPYTERLAB["labkit-tabs"] = { init: () => {}, get: async () => () => ({ __esModule: true, default: plugin }) };
