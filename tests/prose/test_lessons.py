"""What makes a lesson readable and a lab worth doing: minutes, new steps, numbers in prose, endings, words."""

import ast
import re
import subprocess
import sys
from collections import Counter
from difflib import SequenceMatcher
from functools import cache
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from notebooks import LESSONS, ROOT, SOLUTIONS, code, notebook, prose

from labcli.marks import MARK, NUMBER, numbers, printed, shows
from labgrader.course import topics

MOST_MINUTES, MOST_LAB_MINUTES, WORDS_PER_MINUTE, NEW = 40, 105, 200, 0.6
# Readers took half as long again for these as their words say.
DENSE, MOST_DENSE_MINUTES = (
    {"02_crf_cut", "02_crf_lower_bounds", "03_gradient_network", "07_grasp_worth", "08_node_time"},
    30,
)


def holds(paths: list[Path], complaint) -> None:
    """Fail with what a rule has against each notebook; complaint: function of a path to words, empty if it holds."""
    wrong = [f"{path.relative_to(ROOT)}: {said}" for path in paths if (said := complaint(path))]
    assert not wrong, "\n".join(wrong)


def section(path: Path, title: str) -> str:
    """The text under a heading, up to the next heading."""
    found = re.search(rf"^##+ {title}\s*$(.*?)(?=^##+ |\Z)", prose(path), re.MULTILINE | re.DOTALL)
    return found[1] if found else ""


# ------------------------------------------------------------------------------------------------ minutes


def minutes(path: Path) -> float:
    """Minutes that a lesson takes: 200 words per minute, one minute per code cell, two per displayed equation.

    A formula is a word. Folded answers count. What to read next is a list to look things up in, and does not.
    """
    text = prose(path).replace(section(path, "Read next") or "\0", " ")
    equations = len(re.findall(r"\$\$.*?\$\$", text, flags=re.DOTALL))
    text = re.sub(r"\$\$.*?\$\$|\$[^$\n]+\$|```.*?```", " formula ", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->|<[^<>\n]+>|\]\([^)]*\)", " ", text, flags=re.DOTALL)
    words = re.findall(r"[^\W_]+(?:['.,-][^\W_]+)*", text)
    return len(words) / WORDS_PER_MINUTE + len(code(path)) + 2 * equations


def test_a_lesson_is_read_in_forty_minutes_a_dense_one_in_thirty_and_says_so():
    def complaint(path: Path) -> str:
        needed, first = minutes(path), "\n".join(cell.source for cell in notebook(path).cells[:3])
        said = [int(number) for number in re.findall(r"(\d+) minutes", first)]
        if needed > (MOST_DENSE_MINUTES if path.stem in DENSE else MOST_MINUTES):
            return f"takes {needed:.0f} minutes"
        return "" if said and abs(said[0] - needed) <= 5 else f"takes {needed:.0f} minutes, says {said[:1]}"

    holds(LESSONS, complaint)


def test_a_labs_minutes_are_the_sum_of_its_tasks():
    """Each task's heading says "(N minutes"; what the first cells say of the whole is their sum."""

    def complaint(path: Path) -> str:
        tasks = [int(n) for n in re.findall(r"^##+ .*\((\d+) minutes", prose(path), re.MULTILINE)]
        first = "\n".join(cell.source for cell in notebook(path).cells[:3] if cell.cell_type == "markdown")
        said = [int(n) for n in re.findall(r"(\d+) minutes in all", first)]
        if sum(tasks) > MOST_LAB_MINUTES or said != [sum(tasks)]:
            return f"tasks {tasks} add up to {sum(tasks)}, the beginning says {said} minutes in all"
        return ""

    holds([path for path in SOLUTIONS if answers(path)], complaint)  # without blanks it is a project of weeks


# ---------------------------------------------------------------------------------------------- new steps


def tokens(node: ast.AST) -> list[str]:
    """A piece of code as a sequence of its nodes' types; all names are alike, and so are all constants.

    Names of methods and of functions in modules stay (`.argmin`): they are the operations.
    """
    if isinstance(node, ast.expr_context):
        return []
    if isinstance(node, ast.Name | ast.arg):
        return ["name"]
    if isinstance(node, ast.Constant):
        return ["constant"]
    own = [] if isinstance(node, ast.Expr) else [type(node).__name__]
    own = [f".{node.attr}"] if isinstance(node, ast.Attribute) else own
    return own + [token for child in ast.iter_child_nodes(node) for token in tokens(child)]


def runs(source: str) -> set[tuple[str, ...]]:
    """All runs of statements of a cell: of its own, and of each body in it; docstrings are left out."""
    found = set()
    for node in ast.walk(ast.parse(re.sub(r"^[!%].*$", "pass", source, flags=re.MULTILINE))):
        body = node.body if isinstance(getattr(node, "body", None), list) else []
        lines = [tokens(s) for s in body if not (isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant))]
        found |= {tuple(chain(*lines[i:j])) for i in range(len(lines)) for j in range(i + 1, len(lines) + 1)}
    return found


@cache
def lesson_runs() -> frozenset[tuple[str, ...]]:
    """All runs of statements of all cells of all lessons."""
    cells = [cell.source for path in LESSONS for cell in notebook(path).cells if cell.cell_type == "code"]
    return frozenset().union(*map(runs, cells))


counted = cache(Counter)


def similarity(piece: tuple[str, ...], others: frozenset[tuple[str, ...]]) -> float:
    """How like a piece of code is to the likest of others: difflib's ratio of the sequences of nodes, at least 0.5.

    Sequences that share too few tokens in any order are left out first.
    """
    best, shared, count = 0.5, [], Counter(piece)
    for other in others:
        total = len(piece) + len(other)
        if 2 * min(len(piece), len(other)) > best * total:
            there = counted(other)
            common = sum(min(n, there[token]) for token, n in count.items())
            shared.append((2 * common / total, other))
    for bound, other in sorted(shared, reverse=True):
        if bound <= best:
            break
        best = max(best, SequenceMatcher(None, piece, other, autojunk=False).ratio())
    return best


def answers(path: Path) -> dict[str, str]:
    """The autograded answers of a solution: function -> source of its cell."""
    return {
        cell.metadata.nbgrader.grade_id: cell.source
        for cell in notebook(path).cells
        if cell.cell_type == "code" and cell.metadata.get("nbgrader", {}).get("solution")
    }


def likeness(function: str, source: str) -> float:
    """How like an answer is to the likest lines of a lesson."""
    (node,) = [n for n in ast.parse(source).body if isinstance(n, ast.FunctionDef) and n.name == function]
    return similarity(tuple(token for statement in node.body[1:] for token in tokens(statement)), lesson_runs())


def test_half_of_a_labs_points_ask_for_a_step_that_no_lesson_shows():
    """A blank is new if no run of statements of a lesson is as like as 0.6; its solution begins "# New step: ..."."""

    def complaint(path: Path) -> str:
        cells = notebook(path).cells
        points = {c.metadata.nbgrader.grade_id: c.metadata.nbgrader.points for c in cells
                  if c.metadata.get("nbgrader", {}).get("grade")}  # fmt: skip
        like = {name: likeness(name, source) for name, source in answers(path).items()}
        new = {name for name, source in answers(path).items() if re.search(r"# New step: .{20,}", source)}
        said = [
            f"{name} says that it is new and is {like[name]:.2f} like a lesson" for name in new if like[name] >= NEW
        ]
        got = sum(points[f"check_{name}"] for name in new)
        if like and 2 * got < sum(points.values()):
            said.append(f"{got} of {sum(points.values())} points are new steps; likeness "
                        + ", ".join(f"{name} {value:.2f}" for name, value in like.items()))  # fmt: skip
        return "; ".join(said)

    holds(SOLUTIONS, complaint)


# ---------------------------------------------------------------------------------------- numbers in prose


def marked_wrong(path: Path) -> list[str]:
    """Marked numbers of prose that their output does not show, and numbers of the last output that are not marked."""
    last, ids, found = "", {}, []
    for cell in notebook(path).cells:
        ids[cell.id] = printed(cell)
    for cell in notebook(path).cells:
        if cell.cell_type == "code":
            last = printed(cell) if re.search(r"\d", printed(cell)) else last
            continue
        for number, percent, identity, formula in MARK.findall(cell.source):
            of = last if not identity else "\n".join(text for name, text in ids.items() if name.startswith(identity))
            if not shows(of, number, bool(percent), formula):
                found.append(f"{number} {formula} is not in {of.strip()[:200]!r}")
        no_prose = r"\$\$.*?\$\$|\$[^$\n]+\$|```.*?```|`[^`\n]*`|\]\([^)]*\)|<summary>.*?</summary>"
        bare = re.sub(no_prose, " ", re.sub(r"<!--=[^>]*-->", "<!--=-->", cell.source), flags=re.DOTALL)
        unmarked = re.findall(rf"({NUMBER})(?![\w.,]*\d)(?!\s?%?[$*_)`\s]{{0,3}}<!--=)", bare)
        long = [n for n in unmarked if len(re.sub(r"\D", "", n).lstrip("0")) >= 3]
        found += [f"{n} is not marked" for n in long if n in numbers(last)]
    return found


def test_numbers_of_prose_are_those_of_the_outputs():
    """docs/style.md says how they are marked. Each lesson has some; of the last output those of three digits."""

    def complaint(path: Path) -> str:
        few = [] if len(MARK.findall(prose(path))) >= 3 else ["fewer than three marked numbers"]
        return "; ".join([*marked_wrong(path), *few])

    holds(LESSONS, complaint)


@pytest.mark.parametrize(
    "text, right",
    [
        ("IoU 0.62<!--=-->", True),
        ("IoU 0.63<!--=-->", False),
        ("$E = 0.616$<!--=-->", True),
        ("62 %<!--=-->", True),
        ("1,250<!--=--> pixels", True),
        ("twice **1.232<!--=: 2 * 0.616-->**", True),
        ("1.3<!--=: 2 * 0.65-->", False),
    ],
)
def test_a_mark_is_compared(text, right):
    ((number, percent, _, formula),) = MARK.findall(text)
    assert shows("IoU [0.616 0.9], of 1250 pixels", number, bool(percent), formula) == right


# -------------------------------------------------------------------------------------- endings, schematics


def test_a_lesson_ends_with_a_recap_questions_and_what_to_read():
    """Headings `## Recap` (a quoted box), `## Test yourself` (folded answers), `## Read next` (works by name)."""

    def ending(path: Path) -> tuple[int, int, int]:
        recap, test, read = (section(path, title) for title in ("Recap", "Test yourself", "Read next"))
        works = re.findall(r"^- .*(?:\*|\").*(?:19|20)\d\d", read, re.MULTILINE)
        return len(re.findall(r"^> \S", recap, re.MULTILINE)), test.count("<details"), len(works)

    def complaint(path: Path) -> str:
        lines, questions, works = ending(path)
        return (
            ""
            if lines >= 3 and questions >= 2 and works >= 1
            else f"{lines} lines, {questions} questions, {works} works"
        )

    holds(LESSONS, complaint)
    for topic in {path.name[:2] for path in LESSONS}:
        _, questions, works = np.sum([ending(path) for path in LESSONS if path.name.startswith(topic)], axis=0)
        assert questions >= 5 and works >= 3, f"lessons of topic {topic}: {questions} questions, {works} works"


def test_titles_have_one_style():
    """`# 02, cut: the best ...` and `# Lab 02: one answer ...`: number, part, colon, a small letter."""

    def complaint(path: Path) -> str:
        title = notebook(path).cells[0].source.splitlines()[0]
        return "" if re.fullmatch(r"# (Lab )?\d\d(, \w+)?: [^A-Z:][^:]*", title) else title

    holds([*LESSONS, *SOLUTIONS], complaint)


def test_each_topic_opens_with_a_schematic():
    def complaint(path: Path) -> str:
        first = "\n".join(cell.source for cell in notebook(path).cells[:8] if cell.cell_type == "markdown")
        shown = re.findall(r"!\[([^\]]{40,})\]\((schematics/\w+\.svg)\)", first)
        return "" if shown and all((path.parent / file).is_file() for _, file in shown) else "none, or not described"

    holds([path for path in LESSONS if path.stem in topics()], complaint)


def test_the_schematics_are_as_the_code_beside_them_draws_them():
    done = subprocess.run([sys.executable, "lessons/schematics", "--check"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    shown = {file for path in LESSONS for file in re.findall(r"\((schematics/\w+\.svg)\)", prose(path))}
    drawn = {path.relative_to(ROOT / "lessons").as_posix() for path in ROOT.glob("lessons/schematics/*.svg")}
    assert drawn == shown


# -------------------------------------------------------------------------------------------------- words

THINGS = "frames?|images?|scenes?|pixels?|points?|bytes?|times?|steps?|grasps?|lifts?|labels?|scores?|numbers?|costs?"
THINGS += "|weights?|bits?|metres|radians|minutes|seconds|ms|milliseconds|messages?|loss|nanosecond"
ONE = "second|minute|hour|frame|image|scene|pixel|class|object|question|topic|lesson|lab|case|student|row|cell|task"
ONE += "|pair|step|epoch|message|layer|channel"
REFUSED = {
    rf"\b(?:{THINGS}) an? (?:{ONE})\b": "per",
    r"(?:^|[.?!]\s+)Who (?:minimises|wants|reads|looks|sees)\b": "whoever",
    r"\bis no number\b": "is not a number",
    r"\bthe other way round than\b": "the opposite of",
    r"\bas is only\b": "only",
    r"\bnobody can \w+ for himself\b": "say who does what",
    r"\b[Oo]f course\b|\b[Ss]imply\b|\b[Oo]bviously\b|\b[Tt]rivially\b": "leave it out",
    r"\bthe text(?:'s| says| has| asks| writes)\b": "the formula itself",
    r"\) \d+ [-+=]|\) \d+\)": "the sign of the product, which Markdown may have eaten",
    r"\b[Uu]tili[sz]e|\b[Ii]n order to\b|w\.r\.t\.|\baka\b|\betc\.": "use, to, with respect to, also called, and so on",
}  # fmt: skip


def refused(text: str) -> list[str]:
    """The words of a text that docs/style.md refuses."""
    text = re.sub(r"```.*?```|`[^`\n]*`|\$\$.*?\$\$|\$[^$\n]*\$|<[^<>]*>|\]\([^)]*\)", " ", text, flags=re.DOTALL)
    return [f"{found[0].strip()!r}: {advice}" for rule, advice in REFUSED.items() for found in re.finditer(rule, text)]


def test_notebooks_and_pages_use_none_of_the_refused_words():
    holds([*LESSONS, *SOLUTIONS], lambda path: "; ".join(refused(prose(path))))
    pages = [ROOT / "README.md", *{*ROOT.glob("docs/*.md")} - {ROOT / "docs/style.md"}]
    assert not [f"{page.name}: {word}" for page in pages for word in refused(page.read_text())]
