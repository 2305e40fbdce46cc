"""How `make site` makes a static site of the repository: lessons, labs, guides, and reference pages from docstrings.

The pages are the repository's own files, where they lie; nothing is written twice. Hooks adapt them: links into the
code lead to its reference page, views in 3-D get one plotly for the whole site, explorers get pictures of their states
(`explorers.py`), docstrings and lessons are linked both ways by the topic's number, and `landing.md` stands in README's
place. Everything is bundled: the site needs no network. Links to edit a page
and to report a problem are there once `[project.urls] Repository` of pyproject.toml says where the kit is published.
With LABKIT_PDF in the environment, Chromium prints each lesson.
"""

import html
import importlib
import json
import os
import pkgutil
import re
import shutil
import sys
import tomllib
from collections import defaultdict
from pathlib import Path

import plotly

import labkit
import labros
import labtrain
from labcourse import stacks, views
from labgrader import course
from labgrader.release.publishing import unpublished
from labkit import losses  # noqa: F401  torch first: its threads must not meet those of other libraries half loaded

ROOT = Path(__file__).parents[2]
REFERENCE = ROOT / "reference"  # there while the site is built, since a page's place is its address
sys.path.insert(0, str(Path(__file__).parent))
import explorers  # noqa: E402  beside this file
import pdf  # noqa: E402

project, author, version = "labkit", "the labkit authors", labkit.__version__
project_copyright = "the labkit authors, MIT licence"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.viewcode", "sphinx-mathjax-offline"]
root_doc = "README"
include_patterns = [
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "BENCHMARKS.md",
    "labkit/weights/MODEL_CARD.md",
    "lessons/*.ipynb",
    "lessons/*.md",
    "labs/*/*.ipynb",
    "docs/*.md",
    "reference/*.rst",
]
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 4
nb_execution_mode = "off"
nb_ipywidgets_js = {}
autodoc_default_options = {"members": True, "show-inheritance": False, "member-order": "bysource"}
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True

DROPPED = course.course().dropped
exclude_patterns = [f"{folder}/{topic[:3]}*" for topic in DROPPED for folder in ("lessons", "labs")]

html_theme = "sphinx_book_theme"
html_title = "labkit"
html_favicon = "_static/favicon.svg"
html_static_path = ["_static"]
html_css_files = ["site.css"]
# Buttons to the repository, once pyproject.toml says where it is.
REPOSITORY = course.course().repository
html_theme_options = {
    **({"repository_url": REPOSITORY, "repository_branch": "main"} if REPOSITORY else {}),
    "use_repository_button": bool(REPOSITORY),
    "use_edit_page_button": bool(REPOSITORY),
    "use_issues_button": bool(REPOSITORY),
    "use_download_button": True,
    "use_fullscreen_button": False,
    "show_toc_level": 2,
    "home_page_in_toc": True,
    "navbar_persistent": [],
}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
myst_html_meta = {"description": PROJECT["description"]}
if REPOSITORY := PROJECT.get("urls", {}).get("Repository"):
    shown = dict.fromkeys(("use_repository_button", "use_issues_button", "use_edit_page_button"), True)
    html_theme_options |= shown | {"repository_url": REPOSITORY, "repository_branch": "main", "path_to_docs": ""}

GUIDES = {
    "Guides": [
        "docs/install",
        "docs/publish",
        "docs/teaching",
        "docs/week_by_week",
        "docs/grading",
        "docs/own_pictures",
        "docs/cameras",
        "docs/library",
        "docs/ros2",
        "docs/capstone",
        "docs/hub",
        "docs/scale",
        "CONTRIBUTING",
        "docs/style",
        "CHANGELOG",
    ],
    "How good it is": ["docs/scores", "labkit/weights/MODEL_CARD", "BENCHMARKS", "docs/evidence"],
}


PDF = bool(os.environ.get("LABKIT_PDF"))

# What no file can link to, as the first page's last line.
NAMES = "The library by topic: {doc}`reference </reference/index>`, or {ref}`all its names <genindex>`."

# ------------------------------------------------------------------------------------------- what stands where


def written(folder: str, end: str) -> list[str]:
    """Pages of a folder, as Sphinx names them."""
    return sorted(str(path.relative_to(ROOT).with_suffix("")) for path in (ROOT / folder).rglob(f"*{end}"))


def modules() -> list[str]:
    """Every module that says what it is and that a reader of the reference may want."""
    rooms = [labkit, labtrain, labros, stacks, views]
    found = [room.__name__ for room in rooms if room is not labkit]
    found += [
        info.name
        for room in rooms
        for info in pkgutil.walk_packages(getattr(room, "__path__", []), f"{room.__name__}.")
    ]
    return ["data_gen", *(name for name in sorted(found) if not re.search(r"_kernels$|\.ros2_types$|\._", name))]


def lesson_of(number: str) -> str | None:
    """The page of a topic's first lesson, given its two digits."""
    return next((page for page in LESSONS if f"/{number}_" in page), None)


LESSONS, LABS = (
    [page for page in written(of, ".ipynb") if course.is_taught(Path(page).name)] for of in ("lessons", "labs")
)
MODULES = modules()
EXPLORERS = explorers.build(LESSONS)  # lesson's page -> names of its explorers
TOPIC = re.compile(r"\b[Tt]opics? ((?:\d\d(?:_\w+)?(?:, | and )?)+)")
derived: dict[str, set[str]] = defaultdict(set)  # lesson's page -> modules whose docstrings cite its topic


def write_reference() -> None:
    """Write a page per module, and note which lesson derives what it holds."""
    shutil.rmtree(REFERENCE, ignore_errors=True)
    REFERENCE.mkdir()
    for name in MODULES:
        module = importlib.import_module(name)
        text = " ".join(
            [
                module.__doc__ or "",
                *(str(x.__doc__) for x in vars(module).values() if getattr(x, "__module__", "") == name),
            ]
        )
        for numbers in TOPIC.findall(text):
            for number in re.findall(r"\d\d", numbers):
                if page := lesson_of(number):
                    derived[page].add(name)
        title = f"``{name}``"
        text = f"{title}\n{'=' * len(title)}\n\n.. automodule:: {name}\n"
        if hasattr(module, "__path__"):  # its names are documented where they are written
            inside = [other for other in MODULES if other.rpartition(".")[0] == name]
            text += "   :no-members:\n\n" + "\n".join(f"* :doc:`{other}`" for other in inside) + "\n"
        (REFERENCE / f"{name}.rst").write_text(text)
    (REFERENCE / "index.rst").write_text(by_topic())


def by_topic() -> str:
    """The reference's first page: the modules of each topic, and those of none."""
    lines = [
        "Reference",
        "=========",
        "",
        "What the lessons derive, by topic. :ref:`All names, from A to Z <genindex>`.",
        "",
    ]
    topics = defaultdict(set)
    for page, names in derived.items():
        topics[Path(page).name[:2], page] |= names
    for (number, page), names in sorted(topics.items()):
        title = f"{number} {Path(page).name[3:].replace('_', ' ')}"
        lines += [title, "-" * len(title), "", f"Derived in :doc:`/{page}`.", "", *map(entry, sorted(names)), ""]
    rest = sorted(set(MODULES).difference(*topics.values()))
    lines += ["What every topic needs", "----------------------", "", *map(entry, rest), ""]
    return "\n".join([*lines, ".. toctree::", "   :hidden:", "", *(f"   {name}" for name in MODULES), ""])


def entry(name: str) -> str:
    """A module in a list: its name, and what its docstring says first."""
    first = (importlib.import_module(name).__doc__ or "").strip().partition("\n")[0]
    words = re.sub(r"\s*(\([Tt]opic[^)]*\)|Topics? [^.]*\.)", "", first).replace("|", "\\|").replace("*", "\\*")
    return f"* :doc:`{name}`: {words}".rstrip(": ")


def contents() -> str:
    """The site's table of contents, as the first page's last lines."""
    parts = {
        "Start": ["docs/ten_minutes"],
        "Lessons": [*LESSONS, "lessons/errata"],
        "Labs": LABS,
        **{name: [page for page in pages if (ROOT / f"{page}.md").exists()] for name, pages in GUIDES.items()},
        "Reference": ["reference/index", "genindex"],
    }
    trees = [
        "\n".join(["", "```{toctree}", ":hidden:", f":caption: {name}", *(f"/{page}" for page in pages), "```", ""])
        for name, pages in parts.items()
    ]
    return "\n".join(trees)


# ------------------------------------------------------------------------------------------- how a page is read

# Where a page has an explorer: a link to its lesson, of words or of the moving picture that the repository shows.
EXPLORER = re.compile(r"(?:\[!)?\[explorer: (\w+)[^]]*\]\([^)]*\)(?:\]\([^)]*\))?")
LINK = re.compile(r"(?<!!)\[([^\]\n]*)\]\((?!\w+:|#)([^)\s#]+)(#[^)\s]*)?\)")


def links_that_lead_somewhere(text: str, folder: Path) -> str:
    """Links to code lead to its reference page; the words of a link to a file that the site does not have stay."""

    def mend(match: re.Match) -> str:
        words, target, anchor = match.groups()
        path = Path(os.path.normpath(ROOT / folder / target))
        if not path.is_relative_to(ROOT):
            return words
        place = str(path.relative_to(ROOT))
        module = place.removesuffix(".py").removesuffix("/").replace("/", ".").removesuffix(".__init__")
        if module in MODULES:
            return f"[{words}](/reference/{module}.rst)"
        page = path.suffix in (".md", ".ipynb") and course.is_taught(path.name)
        shown = page and any(path.match(str(ROOT / p)) for p in include_patterns)
        return f"[{words}](/{place}{anchor or ''})" if shown and path.exists() else words

    return LINK.sub(mend, text)


def read_source(app, page: str, source: list[str]) -> None:
    """Adapt a page: see the module's docstring."""
    path = ROOT / page
    if (ROOT / f"{page}.md").exists():
        path = Path(__file__).parent / "landing.md" if page == root_doc else path.with_suffix(".md")
        text = source[0] if page != root_doc else path.read_text().replace("](../demo", "](docs/demo")
        text = re.sub(EXPLORER, lambda match: explorers.page(match[1], page), text)
        text = links_that_lead_somewhere(course.taught_rows(text), path.parent.relative_to(ROOT))
        source[0] = f"{text}\n\n{NAMES}\n\n{contents()}" if page == root_doc else text
        return
    if not (ROOT / f"{page}.ipynb").exists():
        return
    notebook = unpublished(json.loads(source[0]), f"{page}.ipynb", ROOT)  # here its links lead to the site's pages
    names = iter(EXPLORERS.get(page, ()))
    for cell in notebook["cells"]:
        text = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            cell["source"] = links_that_lead_somewhere(text, path.parent.relative_to(ROOT))
        if explorers.shows_explorer(cell):
            cell["outputs"] = cell["outputs"][:1]
            cell["outputs"][0]["data"] = {"text/html": explorers.page(next(names), page)}
        for output in cell.get("outputs", []):
            show_in_3d(output.get("data", {}))
        cell["metadata"]["mystnb"] = {"image": {"alt": what_is_shown(notebook["cells"], cell)}}
    if page in derived:
        links = ", ".join(f"[`{name}`](/reference/{name}.rst)" for name in sorted(derived[page]))
        last = {"cell_type": "markdown", "metadata": {}, "id": "reference", "source": f"**In the kit:** {links}"}
        notebook["cells"].append(last)
    if PDF and page in LESSONS:
        printed = f'<p class="note"><a href="{Path(page).name}.pdf">This lesson as a PDF</a></p>'
        notebook["cells"].insert(1, {"cell_type": "markdown", "metadata": {}, "id": "pdf", "source": printed})
    if labs := [lab for lab in LABS if Path(lab).name[:3] == Path(page).name[:3]]:
        notebook["cells"].insert(1, {"cell_type": "markdown", "metadata": {}, "id": "lab", "source": to_lab(labs[0])})
    source[0] = json.dumps(notebook)


def to_lab(lab: str) -> str:
    """Where a reader opens a lab: `_static/lab.js` makes a link of it once it knows the address of a JupyterLab.

    LABKIT_HUB in the environment is that of the site, up to the folder that holds labs/; readers may give their own.
    """
    name, address = Path(lab).name, html.escape(os.environ.get("LABKIT_HUB", ""))
    return (
        f'<div class="lab" data-lab="{lab}.ipynb" data-address="{address}">\n'
        f'<p class="open" hidden><a>Open lab {name} in your JupyterLab</a> '
        f'<button type="button">Elsewhere</button></p>\n'
        f'<p class="how">To work on lab {name}, type <code>make lab</code> (or <code>pip install -c constraints.txt '
        f'-e ".[course,stacks]"</code>, then <code>jupyter lab</code>) and open <code>{lab}.ipynb</code>.</p>\n'
        f'<form><label for="jupyter">With the address of your JupyterLab or hub, it is one click from then on:</label> '
        f'<input id="jupyter" type="url" placeholder="http://localhost:8888"> <button>Keep it</button></form></div>\n'
    )


def what_is_shown(cells: list[dict], cell: dict) -> str:
    """Alternative text of a cell's figures: the section that they stand in, and what the lesson says right after."""
    place = cells.index(cell)
    words = [("".join(c["source"]) if c["cell_type"] == "markdown" else "") for c in cells]
    titles = [line.strip("# ") for text in words[:place] for line in text.splitlines() if line.startswith("#")]
    after = next((text for text in words[place + 1 : place + 3] if text), "")
    after = re.sub(r"<details>.*?</details>", "", after, flags=re.DOTALL)
    plain = re.sub(r"<[^>]*>|[*`$#\[\]\\]|\([^)]*\.\w+\)", "", after)
    sentence = re.split(r"(?<=[.!?])\s", " ".join(plain.split()))[0]
    return f'Figure in "{titles[-1] if titles else "the lesson"}". {sentence}'


def show_in_3d(data: dict) -> None:
    """Turn a plotly figure into a place for one, which `_static/views.js` fills when the reader comes near."""
    figure = data.pop("application/vnd.plotly.v1+json", None)
    if figure is None:
        return
    text = json.dumps(figure).replace("</", "<\\/")
    height = figure.get("layout", {}).get("height", 460)
    data["text/html"] = (
        f'<div class="view" style="height:{height}px" role="img" aria-label="A view in 3-D">'
        f'<script type="application/json">{text}</script></div>'
        f'<p class="note">Drag to turn, scroll to come nearer, double-click to go back.</p>'
    )


def plain_words(app, what, name, thing, options, lines: list[str]) -> None:
    """Docstrings are plain English: "Topic 06" becomes a link to its lesson, `x`s and |x| stay what they are."""

    def link(match: re.Match) -> str:
        def one(number: re.Match) -> str:
            page = lesson_of(number[0][:2])
            return f":doc:`{number[0]} </{page}>`" if page else number[0]

        return re.sub(r"\d\d(?:_\w+)?", one, match[0])

    in_example = False
    for i, line in enumerate(lines):
        in_example = line.lstrip().startswith(">>>") or (in_example and line.strip() != "")
        if not in_example:
            line = re.sub(r"(`[^`]+`)(?=\w)", r"\1\\ ", line).replace("|", "\\|").replace("*", "\\*")
            line = re.sub(r"(?<=\w)_(?=\W|$)", r"\\_", line)
            lines[i] = TOPIC.sub(link, line)


def no_edit_of_what_is_made(app, page, template, context, doctree) -> None:
    """A page that was made, or stands in another's place, has no file of its name to edit."""
    has_file = (ROOT / f"{page}.md").exists() or (ROOT / f"{page}.ipynb").exists()
    if page == root_doc or not has_file:
        context["page_source_suffix"] = ""


def name_arrows(folder: Path) -> None:
    """Give the theme's arrows, which open a section of the contents, a name that is read out."""
    arrow = '<span class="toctree-toggle"'
    for page in folder.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        page.write_text(text.replace(f"<summary>{arrow}", f'<summary aria-label="its pages">{arrow}'), encoding="utf-8")


def finish(app, error) -> None:
    """The first page is index.html; plotly and the explorers' pictures stand beside the pages once."""
    shutil.rmtree(REFERENCE, ignore_errors=True)
    if error is None:
        name_arrows(Path(app.outdir))
        static = Path(app.outdir) / "_static"
        for folder in explorers.OUT.glob("*/*/"):
            shutil.copytree(folder, static / "explorers" / folder.name, dirs_exist_ok=True)
        shutil.copy(Path(app.outdir) / "README.html", Path(app.outdir) / "index.html")
        script = Path(plotly.__file__).parent / "package_data" / "plotly.min.js"
        shutil.copy(script, static / "plotly.min.js")
        if PDF:
            pdf.print_pages(Path(app.outdir), LESSONS)


write_reference()


def setup(app) -> None:
    """Tell Sphinx of the hooks."""
    app.add_js_file("views.js", defer="defer")
    app.add_js_file("explorers.js", defer="defer")
    app.add_js_file("lab.js", defer="defer")
    app.connect("source-read", read_source)
    app.connect("autodoc-process-docstring", plain_words)
    app.connect("html-page-context", no_edit_of_what_is_made, priority=400)  # before the theme looks
    app.connect("build-finished", finish)
