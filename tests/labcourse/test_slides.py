"""The slides of `make slides`: each sentence is the lesson's own, and each deck fits an hour and a room."""

import re
import sys
from pathlib import Path

import nbformat
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs" / "slides"))
import deck  # noqa: E402  beside the templates that it fills

TOPICS = deck.topics()


def words(text: str) -> str:
    """Letters and digits of a text, all small."""
    return "".join(re.findall(r"\w", re.sub(r"<!--.*?-->|</?\w+>|\]\([^)]*\)", "", text, flags=re.DOTALL))).lower()


@pytest.mark.parametrize("topic", TOPICS)
def test_every_sentence_of_a_deck_stands_in_the_lessons(topic):
    lessons = {path: nbformat.read(path, as_version=4) for path in TOPICS[topic]}
    said = words(" ".join(cell.source for book in lessons.values() for cell in book.cells))
    shown = [cell for cell in deck.deck(topic, TOPICS[topic]).cells if cell.cell_type == "markdown"]
    for cell in shown:
        if cell.metadata.slideshow.slide_type != "notes":
            body = re.sub(
                r"^#+ (?:Question|Look|Formula|Answer)$|!\[[^]]*\]\([^)]*\)", "", cell.source, flags=re.MULTILINE
            )
            for line in body.splitlines():
                assert words(line) in said, line


@pytest.mark.parametrize("topic", TOPICS)
def test_a_deck_fits_an_hour_and_its_slides_the_back_of_a_room(topic):
    slides = [slide for lesson in TOPICS[topic] for slide in deck.slides_of(lesson)]
    assert 15 <= len(slides) <= 25
    assert {slide["kind"] for slide in slides} == set(deck.KINDS)
    assert sum(slide["minutes"] for slide in slides) <= 60
    for slide in slides:
        spoken = re.sub(
            r"\$\$.*?\$\$|\$.*?\$|!\[[^]]*\]\([^)]*\)", " x ", slide["text"] + " " + slide["then"], flags=re.DOTALL
        )
        assert len(spoken.split()) <= 75, slide["text"]
        assert slide["kind"] == "picture" or slide["words"], slide
        assert re.search(r"!\[|\$\$", slide["text"]) or slide["picture"] is not None or slide["words"]
    assert sum(bool(slide["ask"]) for slide in slides) >= 0.7 * len(slides)
    assert sum(bool(slide["wrong"]) for slide in slides) >= 3


@pytest.mark.parametrize("topic", TOPICS)
def test_the_core_of_a_deck_leaves_time_for_a_quiz_an_explorer_and_the_lab(topic):
    core = [slide for slide in deck.slides_of_topic(topic) if slide["core"]]
    assert len(core) >= 10 and 30 <= deck.minutes(core) <= 35
    book = deck.deck(topic, TOPICS[topic])
    kept = [c for c in book.cells if c.metadata.slideshow.slide_type == "slide" and "data" not in c.metadata.slideshow]
    assert len(kept) == len(core)
    assert f"Core: {deck.minutes(core)} min so far" in "".join(c.source for c in book.cells)
    # The hour gives explorers minutes of their own.
    for cell in (cell for lesson in TOPICS[topic] for cell in nbformat.read(lesson, as_version=4).cells):
        if any(out.get("data", {}).get("text/plain", "").startswith("an explorer") for out in cell.get("outputs", [])):
            assert not any(slide.get("core") for slide in cell.metadata.get("slides", ()))


STATEMENT = r"[.!]\W*$"
TYPESET = r"\\(?:mathbf|boldsymbol|text|mathrm|frac|cdot|dots|log|begin|end|star)|pmatrix"  # no symbols of their own


def symbols(text: str) -> set[str]:
    """Letters of the formulas, and names of variables in code, that a text has."""
    formulas = " ".join(a or b for a, b in re.findall(r"\$\$(.*?)\$\$|\$([^$]+)\$", text, re.DOTALL))
    code = {name for part in re.findall(r"`([^`]+)`", text) for name in re.findall(r"\b[A-Za-z_]\w*", part)}
    return set(re.findall(r"\\?[A-Za-z]+", re.sub(TYPESET, " ", formulas))) | code


def shown_on(slide: dict) -> str:
    """All that a slide shows: title, sentences, formulas, a drawing's alternative text, and the code of a picture."""
    return f"{slide['title']} {slide['text']} {slide['drawn'] and '`' + slide['drawn'] + '`'}"


@pytest.mark.parametrize("core", [False, True])
@pytest.mark.parametrize("topic", TOPICS)
def test_what_a_question_asks_about_is_on_its_slide_or_just_before(topic, core):
    """In the core alone as well: its symbols, and the things that it speaks of as known."""
    slides = [slide for slide in deck.slides_of_topic(topic) if slide["core"] or not core]
    asked = [number for number, slide in enumerate(slides) if slide["kind"] == "question"]
    assert len(asked) >= 3
    for number in asked:
        slide, seen = slides[number], deck.objects(slides, number)
        said = [sentence for sentence in slide["words"] if slide in seen and re.search(STATEMENT, sentence)]
        shown = " ".join([*(shown_on(other) for other in seen if other is not slide), *said])
        if slide["picture"] is not None:
            shown += f" `{slide['drawn']}`"
        for sentence in slide["words"]:
            own = set(re.findall(r"\ban? [a-z]+ \$\\?(\w+)\$", sentence))  # "a rotation $R$"
            assert symbols(sentence) - own <= symbols(shown), (sentence, symbols(sentence) - own - symbols(shown))
            for known in re.findall(r"\b(?:the two|both) (\w{3,}?)e?s?\b", sentence):
                assert known in shown.lower(), (sentence, known)
            if re.search(r"\bin the picture\b", sentence):
                assert any(other["picture"] is not None or "![" in other["text"] for other in seen), sentence
        assert not re.match(r"(?:\w+ ){0,2}(?:it|they|she|he)\b", slide["words"][0], re.IGNORECASE), slide["words"][0]


@pytest.mark.parametrize("topic", TOPICS)
def test_no_slide_begins_with_a_pronoun_or_names_a_toy_that_the_question_did_not_show(topic):
    slides = deck.slides_of_topic(topic)
    for before, slide in zip([None, *slides], slides, strict=False):
        first = (slide["words"] or [""])[0]
        assert not re.match(r"(?:It|They|She|He)\b", first), first
        if "the toy" in slide["text"]:
            assert "toy" in before["text"].lower(), first


def test_a_question_that_is_about_no_slide_near_it_is_refused():
    slides = [{"words": [f"Slide {n} is here."], "text": "", "about": []} for n in range(5)]
    slides[4]["about"] = ["Slide 1", "this"]
    assert deck.objects(slides, 4) == [slides[1], slides[4]]
    for begin in ("Slide 0", "Slide 4", "Slide"):  # too far back, not before it, several
        slides[4]["about"] = [begin]
        with pytest.raises(ValueError, match=rf"begin with '{begin}'"):
            deck.objects(slides, 4)


def test_a_slide_that_begins_with_a_sentence_of_the_cell_above_has_the_heading_of_that_sentence(tmp_path):
    cells = [nbformat.v4.new_markdown_cell(text) for text in ("# Masks\n\nA toy.", "Why?\n\n## Cups\n\nA cup.")]
    cells[1].metadata.slides = [
        {"kind": "question", "begin": ["A toy", "Why"], "minutes": 1, "about": ["this"]},
        {"kind": "answer", "begin": ["A cup"], "minutes": 1},
    ]
    nbformat.write(nbformat.v4.new_notebook(cells=cells), tmp_path / "04_iou.ipynb")
    assert [slide["title"] for slide in deck.slides_of(tmp_path / "04_iou.ipynb")] == ["Masks", "Cups"]


def test_a_beginning_that_no_sentence_has_is_named(tmp_path):
    book = nbformat.v4.new_notebook(
        cells=[nbformat.v4.new_markdown_cell("# Masks\n\nA mask is an image. A mask is not.")]
    )
    path = tmp_path / "04_iou.ipynb"
    for begin, many in (("A cup", 0), ("A mask is", 2)):
        book.cells[0].metadata.slides = [{"kind": "question", "begin": [begin], "minutes": 1, "about": ["this"]}]
        nbformat.write(book, path)
        with pytest.raises(ValueError, match=rf"cell 0: begin: .*{many} are '{begin}'"):
            deck.slides_of(path)
    book.cells[0].metadata.slides[0] |= {"begin": ["A mask is not"], "then": ["A mask is an"]}
    nbformat.write(book, path)
    found = deck.slides_of(path)[0]
    assert (found["text"], found["then"]) == ("A mask is not.", "A mask is an image.")
    book.cells[0].source += " It holds:"
    book.cells[0].metadata.slides[0]["then"] = ["It holds"]
    nbformat.write(book, path)
    with pytest.raises(ValueError, match="promises what the slide does not show"):
        deck.slides_of(path)
    del book.cells[0].metadata.slides[0]["about"]
    nbformat.write(book, path)
    with pytest.raises(ValueError, match="about: expected the slides"):
        deck.slides_of(path)


@pytest.mark.parametrize(("week", "topic"), [(int(topic[:2]), topic) for topic in TOPICS])
def test_the_week_by_week_names_slides_and_minutes_that_the_deck_has(week, topic):
    page = (ROOT / "docs" / "week_by_week.md").read_text(encoding="utf-8")
    slides = deck.slides_of_topic(topic)
    core = [slide for slide in slides if slide["core"]]
    row = f"| {week} | {len(core)}, {deck.minutes(core)} | {len(slides)}, {deck.minutes(slides)} | slide "
    assert row in page
    explorer = slides[int(re.search(re.escape(row) + r"(\d+)", page)[1]) - 1]
    assert not explorer["core"] and re.search(r"In JupyterLab|click|Turn the jaws", explorer["ask"])
    said = re.search(rf"^\*\*{week}, .*?(?=^\*\*|^## )", page, re.MULTILINE | re.DOTALL)[0]
    asked = re.findall(r"([^?:]+)\s\(slide\s(\d+),\s(\d+)\smin:\s[^?]+\)\?", said)
    assert len(asked) >= 2
    for question, number, minutes in asked:
        slide = slides[int(number) - 1]
        shown = f"{slide['title']} {slide['text']} {slide['ask']}".lower()
        assert slide["minutes"] == int(minutes), question
        assert [w for w in re.findall(r"[a-z]{4,}|\d/\d+", question.lower()) if w in shown], question


@pytest.mark.parametrize(("week", "topic"), [(int(topic[:2]), topic) for topic in TOPICS])
def test_a_weeks_minutes_add_up(week, topic):
    page = (ROOT / "docs" / "teaching.md").read_text(encoding="utf-8")
    row = re.search(rf"^\| {week} \| \[.*\| ([\d +]+) = (\d+) \|$", page, re.MULTILINE)
    assert row, f"docs/teaching.md: write a row for week {week} into the table of weeks"
    *lessons, _, hour = map(int, row[1].split("+"))
    solution = nbformat.read(ROOT / "solutions" / topic / f"{topic}.ipynb", as_version=4)
    stated = re.search(r"(\d+) minutes in all", "".join(cell.source for cell in solution.cells[:3]))
    assert (len(lessons), hour) == (len(TOPICS[topic]), 60)
    parts = [*lessons, int(stated[1]), hour]
    right = f"{' + '.join(map(str, parts))} = {sum(parts)}"
    assert f"{row[1]} = {row[2]}" == right, f"docs/teaching.md, week {week}: write {right}"


@pytest.mark.parametrize("topic", TOPICS)
def test_no_two_cells_of_a_deck_share_an_id(topic):
    ids = [cell.id for cell in deck.deck(topic, TOPICS[topic]).cells]
    assert len(set(ids)) == len(ids)
