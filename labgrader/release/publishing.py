"""Where a course is published, and its notebooks as they stand there: a badge, a first cell for Colab, absolute links.

    [project.urls]
    Repository = "https://github.com/OWNER/NAME"   # its branch main
    Documentation = "https://OWNER.github.io/NAME/"   # the site, if it is elsewhere than its own workflow puts it
    [tool.labgrader]
    wheel = "NAME==1.0"                            # what pip installs: name and version, or a wheel's address

Google Colab opens one notebook of a repository on GitHub, and has neither the files beside it nor the kit. Without both
settings a notebook stays as it is: `published` and `unpublished` take back what other settings made of it.
"""

import copy
import os
import re
from pathlib import Path

from labgrader.course import Course

TAG = "colab"  # of the cells that are written here
COLAB = "https://colab.research.google.com"
BADGES = ("<!-- badges -->", "<!-- end of badges -->")  # between these lines README has them
LINK = re.compile(r"(\]\(|\bsrc=\")(?!\w+:|#)([^)\s#\"]+)")
PICTURES = (".gif", ".jpg", ".png", ".svg")
ABSOLUTE = re.compile(
    r"(\]\(|\bsrc=\")https://(?:colab\.research\.google\.com/github|github\.com)/[\w.-]+/[\w.-]+/(?:blob|raw)/main/([^)\s#\"]+)"
)


def owner_and_name(site: Course) -> str:
    """OWNER/NAME of a repository on GitHub, "" of any other.

    >>> from dataclasses import replace
    >>> site = Course(Path(), Path(), "", (), "lab", repository="https://github.com/owner/name/")
    >>> owner_and_name(site), owner_and_name(replace(site, repository="https://elsewhere.org/owner/name"))
    ('owner/name', '')
    """
    found = re.fullmatch(r"https://github\.com/([\w.-]+/[\w.-]+?)(?:\.git)?/?", site.repository)
    return found[1] if found else ""


def on_colab(site: Course) -> bool:
    """Whether the course's notebooks can be opened on Colab: from GitHub, and with a wheel to install."""
    return bool(owner_and_name(site) and site.wheel)


def published(notebook: dict, name: str, root: Path, site: Course) -> dict:
    """A notebook as it is published: after its title a badge and the cell that installs the kit, links absolute.

    name: of its file, from the course's folder `root`. Links are changed if they lead to a file there. Returns a copy.
    """
    notebook = unpublished(notebook, name, root)
    if not on_colab(site):
        return notebook

    def absolute(match: re.Match) -> str:
        target = os.path.normpath(Path(name).parent / match[2]).replace(os.sep, "/")
        return match[1] + (address(target, site) if (root / target).is_file() else match[2])

    for cell in texts(notebook):
        cell["source"] = LINK.sub(absolute, cell["source"])
    badge = f"[![Open in Colab]({COLAB}/assets/colab-badge.svg)]({address(name, site)})"
    number = Path(name).stem[:2]
    extras = next((extra for topic, extra in site.extras.items() if topic[:2] == number), "")
    install = f'import sys\n\nif "google.colab" in sys.modules:\n    %pip install -q "{requirement(site, extras)}"'
    made = [
        {"cell_type": "markdown", "id": "colab-badge", "metadata": {"tags": [TAG]}, "source": badge},
        {"cell_type": "code", "id": "colab-install", "metadata": {"tags": [TAG]}, "source": install}
        | {"execution_count": None, "outputs": []},
    ]
    notebook["cells"][1:1] = [type(notebook)(cell) for cell in made]
    return notebook


def unpublished(notebook: dict, name: str, root: Path) -> dict:
    """A notebook as it is written: without what `published` adds, and with relative links. Returns a copy."""
    notebook = copy.deepcopy(notebook)
    notebook["cells"] = [cell for cell in notebook["cells"] if TAG not in cell.get("metadata", {}).get("tags", ())]

    def relative(match: re.Match) -> str:
        there = (root / match[2]).is_file()
        return match[1] + os.path.relpath(match[2], Path(name).parent).replace(os.sep, "/") if there else match[0]

    for cell in texts(notebook):
        cell["source"] = ABSOLUTE.sub(relative, cell["source"])
    return notebook


def texts(notebook: dict) -> list[dict]:
    """The cells of text, each with its source as one string."""
    found = [cell for cell in notebook["cells"] if cell["cell_type"] == "markdown"]
    for cell in found:
        cell["source"] = "".join(cell["source"])
    return found


def address(name: str, site: Course) -> str:
    """Where a file is published: a notebook on Colab, a picture as it is, any other file as a page."""
    if name.endswith(".ipynb"):
        return f"{COLAB}/github/{owner_and_name(site)}/blob/main/{name}"
    return f"https://github.com/{owner_and_name(site)}/{'raw' if name.endswith(PICTURES) else 'blob'}/main/{name}"


def requirement(site: Course, extras: str = "") -> str:
    """What pip installs of the course's wheel, with extras.

    >>> site = Course(Path(), Path(), "", (), "lab", project="lab-kit", wheel="lab-kit==1.0")
    >>> requirement(site), requirement(site, "stacks")
    ('lab-kit==1.0', 'lab-kit[stacks]==1.0')
    >>> requirement(Course(Path(), Path(), "", (), "lab", project="lab-kit", wheel="https://x.org/l.whl"), "stacks")
    'lab-kit[stacks] @ https://x.org/l.whl'
    """
    wanted = f"[{extras}]" if extras else ""
    if "://" in site.wheel:
        return f"{site.project}{wanted} @ {site.wheel}"
    return re.sub(r"^[\w.-]+", lambda name: name[0] + wanted, site.wheel)


def badges(root: Path, site: Course, first: str) -> list[str]:
    """The badges of the files that a course has, in Markdown; none if it has no repository on GitHub.

    first: the notebook that Colab opens.
    """
    place = owner_and_name(site)
    if not place:
        return []
    owner, _, name = place.partition("/")
    tests = f"https://github.com/{place}/actions/workflows/laptops.yml"
    pages = site.site or f"https://{owner}.github.io/{name}/"
    shield = "https://img.shields.io/badge"
    found = [
        ("tests", ".github/workflows/laptops.yml", f"{tests}/badge.svg", tests),
        ("site", "." if site.site else ".github/workflows/site.yml", f"{shield}/site-lessons-blue", pages),
        ("licence", "LICENSE", f"{shield}/licence-MIT-green", "LICENSE"),
        ("cite", "CITATION.cff", f"{shield}/cite-CITATION.cff-green", "CITATION.cff"),
        ("Open in Colab", first if site.wheel else "", f"{COLAB}/assets/colab-badge.svg", address(first, site)),
        ("Binder", "binder", "https://mybinder.org/badge_logo.svg", f"https://mybinder.org/v2/gh/{place}/main"),
        ("Codespaces", ".devcontainer", "https://github.com/codespaces/badge.svg", f"https://codespaces.new/{place}"),
    ]
    return [f"[![{words}]({image})]({link})" for words, file, image, link in found if file and (root / file).exists()]


def with_badges(text: str, badges: list[str]) -> str:
    """A page with these badges between the two lines that mark their place; a page without the lines as it is.

    >>> with_badges("# A\\n<!-- badges -->\\nold\\n<!-- end of badges -->\\nb", ["new"]).splitlines()
    ['# A', '<!-- badges -->', 'new', '<!-- end of badges -->', 'b']
    """
    first, last = BADGES
    if first not in text or last not in text:
        return text
    before, rest = text.split(first, 1)
    return "\n".join([before + first, *badges, last + rest.split(last, 1)[1]])
