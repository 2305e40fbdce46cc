"""How `make slides` makes a deck per topic of the lessons' own cells: their sentences, formulas and pictures.

    python docs/slides/deck.py out/slides

A cell of a lesson that shows on slides says so in its metadata, and says no sentence again:

    "slides": [{"kind": "question", "begin": ["What appears at"], "minutes": 2, "ask": "...", "wrong": "..."}]

kind: question, picture, formula or answer. begin: the first words of each sentence that is shown, of this cell or of
the texts next to it. then: likewise, shown at a second step, so that a picture does not answer its own question.
formula: which displayed formula of the cell, from 0; it stands where the lesson has it. picture: which drawing or
image. about, of a question: where its object is seen, as the first words of a sentence (or of a drawing's alternative
text) of one of the three slides before it, or "this" for the slide itself; the core of a deck keeps to this as well.
The title is the heading that the cell stands under. ask, wrong, minutes: the speaker's notes. core: true if
the slide is of the part of a deck that fits an hour, which TOPIC.html?core shows alone. nbconvert writes reveal.js
pages; the same slides are a notebook with all code of the lessons, in which explorers move.
"""

import importlib.util
import re
import shutil
import sys
from pathlib import Path

import nbformat

ROOT = Path(__file__).parents[2]
HERE = Path(__file__).parent
KINDS = {"question": "Question", "picture": "Look", "formula": "Formula", "answer": "Answer"}
BEFORE = 3  # slides before a question among which its object is seen
REACH = 2  # texts below a cell in which its sentences may stand; the one above comes after them
# What begins with a small letter: a variable of one letter (an "a" only before a sign), or a function of a number.
SYMBOL = r"(?:[b-z]|a(?= *[=<>+/]))(?!\w)|(?:sin|cos|tan|atan|log|exp)(?= *[\d(])"
# Not shown.
LEAD = r"^(?:\*+[^*]{1,30}[.:]\*+:?|\*\*(?:Predict|Play|Task)[^*]*\*\*:?(?= [^a-z])|Predict first(?: \(\d\))?[.:]) +"


def topics() -> dict[str, list[Path]]:
    """Lessons of each topic, in the order in which they are read: the one named like its topic first."""
    from labgrader.course import topics as names

    return {t: found for t in names() if (found := sorted((ROOT / "lessons").glob(f"{t}*.ipynb"), key=in_order))}


def in_order(lesson: Path) -> tuple[int, int]:
    """Where a lesson comes in its topic: by the links "Now read" of the lessons before it."""
    number = lesson.stem[:2]
    texts = {p: p.read_text(encoding="utf-8") for p in sorted(lesson.parent.glob(f"{number}_*.ipynb"))}
    first = min(texts, key=lambda path: len(path.stem))
    found = [first]
    while match := re.search(rf"\*\*Now read \[[^]]*\]\(({number}_\w+\.ipynb)\)", texts[found[-1]]):
        found.append(lesson.parent / match[1])
    rest = [path for path in texts if path not in found]
    return ([*found, *rest].index(lesson), 0)


def sentences(source: str) -> list[str]:
    """Sentences of a Markdown text, folded answers included, displayed formulas and headings left out.

    >>> sentences("## A title" + chr(10) + "**Predict.** What is it? $x = 1.$ Yes.")
    ['**Predict.** What is it?', '$x = 1.$ Yes.']
    """
    text = re.sub(r"\s*<!--.*?-->", "", source, flags=re.DOTALL)
    text = re.sub(r"\$\$.*?\$\$|!\[[^]]*\]\([^)]*\)", "\n\n", text, flags=re.DOTALL)
    text = re.sub(r"</?(?:details|summary|b)>", "\n\n", text)
    text = re.sub(r"^\s*(?:#.*|[>*-]+(?= |$)|\d\.(?= ))", "\n", text, flags=re.MULTILINE)
    text = re.sub(r"<code>(.*?)</code>", r"`\1`", text)
    text = re.sub(r"\[([^\]]+)\]\([^)]+\)", r"\1", text)
    found = []
    for paragraph in re.split(r"\n\s*\n", text):
        line = " ".join(paragraph.split())
        found += re.sub(r"([.!?][)\"”]?\**)\s+(?=[A-Z`$*\[(])", r"\1\n", line).split("\n") if line else []
    return joined(found)


def joined(parts: list[str]) -> list[str]:
    """Put a bold or slanted beginning such as "**By hand.**" before the sentence that it belongs to."""
    found: list[str] = []
    for part in parts:
        if found and (found[-1].count("$") % 2 or re.fullmatch(r"\*+[^*]{1,40}\*+", found[-1])):
            found[-1] = f"{found[-1]} {part}"
        else:
            found.append(part)
    return [balanced(part) for part in found]


def balanced(sentence: str) -> str:
    """Drop the stars that a cut left without a partner.

    >>> balanced("*Copy, do not average")
    'Copy, do not average'
    >>> balanced("*Task:* find it.")
    '*Task:* find it.'
    >>> balanced("5 + 3 * 16")
    '5 + 3 * 16'
    """
    for star in (r"\*\*", r"(?<!\*)(?:\*(?=\w)|(?<=[\w.!?:])\*)(?!\*)"):
        if len(re.findall(star, sentence)) % 2:
            sentence = re.sub(star, "", sentence)
    return sentence


def plain(text: str) -> str:
    """What a beginning is compared with: words alone."""
    return re.sub(r"[*`$_\\\s]+", " ", text).strip()


def chosen(cells: list, place: int, begins: list[str]) -> list[str]:
    """The sentences of a slide; raises ValueError if a beginning is that of none, or of several."""
    own = cells[place]["cell_type"] == "markdown"
    below = [cell for cell in cells[place + 1 :] if cell["cell_type"] == "markdown"][:REACH]
    above = [cell for cell in cells[:place] if cell["cell_type"] == "markdown"][-1:]
    texts = [cells[place], *below, *above] if own else [*below, *above]
    found = []
    for begin in begins:
        for cell in texts:
            fits = list(dict.fromkeys(s for s in said(cell["source"]) if plain(s).startswith(plain(begin))))
            if fits:
                break
        if len(fits) != 1:
            raise ValueError(
                f"begin: expected the first words of one sentence of the lesson, {len(fits)} are {begin!r}"
            )
        found += [capital(s) for s in fits if capital(s) not in found]
    return found


def said(source: str) -> list[str]:
    """The sentences of a text without their leads."""
    return [re.sub(LEAD, "", sentence) for sentence in sentences(source)]


def capital(sentence: str) -> str:
    """A sentence that begins with a capital, which one has lost that had a lead or a formula before it.

    >>> capital("the rest"), capital("q = 2 is a ray."), capital("tan 45° = 1.")
    ('The rest', 'q = 2 is a ray.', 'tan 45° = 1.')
    """
    return sentence if re.match(SYMBOL, sentence) else sentence[0].upper() + sentence[1:]


def in_lines(formula: str) -> str:
    r"""A formula of several parts with a line for each, so that it can be large; the lesson has them in one line.

    >>> in_lines(r"a = 1, \qquad\text{and}\qquad b_\text{cam} \\ c")
    '\\begin{gathered} a = 1, \\\\ \\text{and} \\quad b_\\text{cam} \\\\ c \\end{gathered}'
    """
    parts = [part.strip() for part in re.split(r"(?:\\qquad\s*)+", formula)]
    whole = all(p.count("{") == p.count("}") and p.count(r"\begin") == p.count(r"\end") for p in parts)
    if len(parts) == 1 or not whole:
        return formula
    lines = []
    for part in parts:
        if lines and re.fullmatch(r"\\text\{[^{}]*\}", lines[-1]):
            lines[-1] += rf" \quad {part}"
        else:
            lines.append(part)
    return r"\begin{gathered} " + r" \\ ".join(lines) + r" \end{gathered}"


def title(cells: list, place: int) -> str:
    """The heading under which a cell's first slide stands."""
    for cell in reversed(cells[: place + 1]):
        if cell["cell_type"] == "markdown" and (headings := re.findall(r"^#+ (.+)$", cell["source"], re.MULTILINE)):
            return headings[0] if cell is cells[place] else headings[-1]
    return ""


def title_of(cells: list, place: int, words: list[str]) -> str:
    """The heading above the first sentence of a slide, in its own cell if there is one above it, else in one before."""
    source = cells[place]["source"] if cells[place]["cell_type"] == "markdown" else ""
    first = re.findall(r"\w+", words[0])[:5] if words else []
    found = re.search(r"\W+".join(map(re.escape, first)), source, re.IGNORECASE)
    headings = re.findall(r"^#+ (.+)$", source[: found.start()] if found else "", re.MULTILINE)
    return headings[-1] if headings else title(cells, place - 1) if place else title(cells, place)


def slides_of(lesson: Path) -> list[dict]:
    """The slides of a lesson, in order: kind, title, text (Markdown), place (of its cell), picture and notes.

    Raises ValueError that names lesson and cell where metadata do not fit.
    """
    cells, found = nbformat.read(lesson, as_version=4).cells, []
    for place, cell in enumerate(cells):
        for slide in cell.metadata.get("slides", ()):
            try:
                found.append(one_slide(cells, place, slide))
            except (ValueError, IndexError, KeyError) as error:
                raise ValueError(f"{lesson.name}, cell {place}: {error}") from error
    return found


def one_slide(cells: list, place: int, slide: dict) -> dict:
    """Put one slide together."""
    if slide["kind"] not in KINDS:
        raise ValueError(f"kind: expected one of {', '.join(KINDS)}, got {slide['kind']!r}")
    if slide["kind"] == "question" and not slide.get("about"):
        raise ValueError('about: expected the slides that show what a question asks about (or ["this"]), got none')
    words, then, parts = chosen(cells, place, slide.get("begin", [])), chosen(cells, place, slide.get("then", [])), []
    first = len(words)  # how many sentences come before the formula
    if "formula" in slide:
        source = cells[place]["source"]
        formula = list(re.finditer(r"\$\$(.*?)\$\$", source, re.DOTALL))[slide["formula"]]
        parts = [f"$${formula[1]}$$"]
        first = len(set(words) & {capital(sentence) for sentence in said(source[: formula.start()])})
    if "picture" in slide and cells[place]["cell_type"] == "markdown":
        parts = [re.findall(r"!\[[^]]*\]\([^)]*\)", cells[place]["source"])[slide["picture"]]]
    for number, sentence in enumerate([*words, *then], start=1):
        if sentence.endswith(":") and not ("formula" in slide and number == first):
            raise ValueError(f"begin: {sentence!r} promises what the slide does not show below it")
    texts = [*parts, *words] if slide["kind"] == "picture" else [*words[:first], *parts, *words[first:]]
    return {
        "kind": slide["kind"],
        "title": title_of(cells, place, words if slide["kind"] != "picture" else parts),
        "text": "\n\n".join(texts),
        "then": "\n\n".join(then),
        "words": [*words, *then],
        "place": place,
        "picture": slide.get("picture") if cells[place]["cell_type"] == "code" else None,
        "drawn": cells[place]["source"] if cells[place]["cell_type"] == "code" else "",
        "minutes": slide["minutes"],
        "ask": slide.get("ask", ""),
        "wrong": slide.get("wrong", ""),
        "core": slide.get("core", False),
        "about": slide.get("about", []),
    }


def slides_of_topic(topic: str) -> list[dict]:
    """All slides of a topic's deck, in order."""
    return [slide for lesson in topics()[topic] for slide in slides_of(lesson)]


def objects(slides: list[dict], number: int) -> list[dict]:
    """The slides that show what slide `number` of a deck, or of its core, asks about: itself, or up to three before it.

    Raises ValueError where an entry of `about` begins no such slide, or several.
    """
    found = []
    for begin in slides[number]["about"]:
        near = slides[number : number + 1] if begin == "this" else slides[max(0, number - BEFORE) : number]
        fits = [slide for slide in near if begin == "this" or begins(slide, begin)]
        if len(fits) != 1:
            raise ValueError(
                f"about: expected the first words of one of the {BEFORE} slides before {slides[number]['words'][0]!r} "
                f"(in its core, too), {len(fits)} begin with {begin!r}"
            )
        found += fits
    return found


def begins(slide: dict, begin: str) -> bool:
    """Whether a sentence of a slide, or its drawing's alternative text, begins so."""
    texts = [*slide["words"], *re.findall(r"!\[([^]]*)\]", slide["text"])]
    return any(plain(text).startswith(plain(begin)) for text in texts)


def minutes(slides: list[dict]) -> int:
    """How long some slides take."""
    return sum(slide["minutes"] for slide in slides)


def deck(topic: str, lessons: list[Path]) -> nbformat.NotebookNode:
    """The slides of a topic as a notebook: what shows is a slide, and the lessons' other code is there but skipped."""
    book = nbformat.v4.new_notebook(metadata=nbformat.read(lessons[0], as_version=4).metadata | {"title": topic})
    slides = [slide for lesson in lessons for slide in slides_of(lesson)]
    so_far = number = 0
    for lesson in lessons:
        cells = nbformat.read(lesson, as_version=4).cells
        made: dict[int, list[dict]] = {}
        for slide in slides_of(lesson):
            made.setdefault(slide["place"], []).append(slide)
        for place, cell in enumerate(cells):
            identity = f"{lessons.index(lesson)}-{cell.id}"  # lessons may share a cell, and so its id
            shown = made.get(place, [])
            with_picture = [slide for slide in shown if slide["picture"] is not None]
            for slide in shown:
                so_far += slide["minutes"] if slide["core"] else 0
                heading = f"# {slide['title']}\n\n## {KINDS[slide['kind']]}\n\n"
                if slide["picture"] is None:
                    book.cells.append(start := text(heading + slide["text"], "slide"))
                else:
                    identity += f"-{slide['picture']}"
                    picture = nbformat.from_dict({**cell, "id": identity, "metadata": {}})
                    images = [out for out in cell.outputs if "image/png" in out.get("data", {})]
                    picture.outputs = [images[slide["picture"]]]
                    picture.metadata.slideshow = {"slide_type": "-"}
                    book.cells += [start := text(heading, "slide"), picture, text(slide["text"], "-")]
                if not slide["core"]:
                    start.metadata.slideshow.data = {"more": "yes"}  # an attribute of the slide's section
                number += 1
                book.cells.append(notes(slide, so_far, objects(slides, number - 1)))
                if slide["then"]:
                    book.cells.append(text(slide["then"], "fragment"))
            if cell.cell_type == "code" and not with_picture:
                silent = {"id": identity, "metadata": {"slideshow": {"slide_type": "skip"}}, "outputs": []}
                book.cells.append(nbformat.from_dict({**cell, **silent}))
    return book


def text(source: str, kind: str) -> nbformat.NotebookNode:
    """A cell of text on a slide."""
    return nbformat.v4.new_markdown_cell(source, metadata={"slideshow": {"slide_type": kind}})


def notes(slide: dict, so_far: int, about: list[dict]) -> nbformat.NotebookNode:
    """What only the speaker sees; `so_far` are the minutes of the core up to the end of this slide.

    `about` are the slides that show what it asks about, to go back to.
    """
    lines = [f"**{slide['minutes']} min.** " + (f"Core: {so_far} min so far." if slide["core"] else "Not core.")]
    back = [f'"{other["title"]}" ({other["words"][0]})' for other in about if other is not slide and other["words"]]
    lines.append(" and ".join(back) and f"It asks about: {' and '.join(back)}")
    lines.append(slide["ask"] and f"Ask: {slide['ask']}")
    lines.append(slide["wrong"] and f"What goes wrong: {slide['wrong']}")
    return text("\n\n".join(line for line in lines if line), "notes")


def folder_of(package: str) -> Path:
    """Where an installed package lies, without importing it."""
    spec = importlib.util.find_spec(package)
    if spec is None or spec.origin is None:
        raise SystemExit(f"{package} is missing: `make slides` installs it")
    return Path(spec.origin).parent


def write(out: Path) -> list[Path]:
    """Write all decks and what they need, so that the folder works without a network; returns the pages."""
    from nbconvert import SlidesExporter

    out.mkdir(parents=True, exist_ok=True)
    reveal = folder_of("sphinx_revealjs") / "_static" / "revealjs"
    for part in ("dist", "plugin/notes"):
        shutil.copytree(reveal / part, out / "reveal" / part, dirs_exist_ok=True)
    shutil.copy(folder_of("sphinx-mathjax-offline") / "static" / "mathjax" / "tex-svg-full.js", out / "mathjax.js")
    shutil.copy(HERE / "deck.css", out)
    for path in (ROOT / "lessons").iterdir():
        if path.is_dir() and not path.name.startswith("."):
            shutil.copytree(path, out / path.name, dirs_exist_ok=True)
        elif path.suffix in (".csv", ".json", ".py"):
            shutil.copy(path, out)
    own = {"template_name": "deck", "extra_template_basedirs": [str(HERE / "templates")]}
    # The theme is deck.css, as nbconvert's page finds it from reveal/dist/theme/.
    exporter = SlidesExporter(**own, exclude_input=True, reveal_url_prefix="reveal", reveal_theme="../../../deck")
    pages = []
    for topic, lessons in topics().items():
        book = deck(topic, lessons)
        for cell in book.cells:
            if cell.cell_type == "markdown":
                cell.source = re.sub(r"(?<=\$\$)[^$]+(?=\$\$)", lambda formula: in_lines(formula[0]), cell.source)
        nbformat.write(book, out / f"{topic}.ipynb")
        page, _ = exporter.from_notebook_node(book)
        pages.append(out / f"{topic}.html")
        pages[-1].write_text(page, encoding="utf-8")
    links = ""
    for page in pages:
        slides = slides_of_topic(page.stem)
        core = [slide for slide in slides if slide["core"]]
        links += f'<li><a href="{page.name}">{page.stem}</a> ({len(slides)} slides, {minutes(slides)} min), <a href='
        links += f'"{page.name}?core">core</a> ({len(core)} slides, {minutes(core)} min)</li>'
    index = f'<!DOCTYPE html><meta charset="utf-8"><title>Slides</title><h1>Slides</h1><ul>{links}</ul>'
    (out / "index.html").write_text(index, encoding="utf-8")
    return pages


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    for written in write(Path(sys.argv[1])):
        print(f"wrote {written}")
