"""`labkit new`: what it writes works at once and says what is left to do; a name that does not fit writes nothing."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import alternatives
import nbformat
import pytest
from notebooks import SOLUTIONS

from labcourse import questions
from labgrader.file_check import check_file
from labgrader.grade_course import grade_course
from labgrader.release import release, scaffold
from tests.labcourse.questions import test_promises
from tests.labgrader.reply import test_questions

ROOT = Path(__file__).parents[3]
OF_LAB, OF_QUESTION = 9, 17  # TODOs that a new lab has, and a new question


def left_to_do(course: Path) -> list[str]:
    """List each TODO of questions, right answers, solutions and README: "FILE:LINE: what", or "FILE, cell ID: what"."""
    found = []
    for pattern in ("labcourse/questions/t*/*.py", "tests/alternatives/t*.py", "README.md"):
        for path in sorted(course.glob(pattern)):
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
                found += [f"{path.relative_to(course)}:{number}: {todo}" for todo in todos(line)]
    for path in sorted(course.glob("solutions/*/*.ipynb")):
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
            place = f"{path.relative_to(course)}, cell {cell['id']}"
            found += [f"{place}: {todo}" for line in "".join(cell["source"]).splitlines() for todo in todos(line)]
    return found


def todos(line: str) -> list[str]:
    """The TODOs of a line."""
    return [found.strip(' "|') for found in re.findall(r"\bTODO\b(?:(?!\bTODO\b|<).)*", line)]


@pytest.mark.parametrize("what", left_to_do(ROOT) or [""])
def test_nothing_is_left_to_do(what):
    assert not what


@pytest.fixture
def course(tmp_path):
    """What `labkit new` looks for in a checkout: README and topic 04."""
    for path in ("labcourse/questions/t04_iou", "solutions/04_iou", "tests/alternatives"):
        shutil.copytree(ROOT / path, tmp_path / path, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "README.md", tmp_path)
    return tmp_path


def snapshot(folder: Path) -> dict[Path, bytes]:
    """All files of a folder."""
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def tenth(course, monkeypatch):
    """A course with a tenth lab of one question, which the kit finds; returns the files written."""
    written = scaffold.new_lab(course, "10_pieces") + scaffold.new_question(course, "10_pieces.rows")
    for package, folder in ((questions, "labcourse/questions"), (alternatives, "tests/alternatives")):
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(course / folder)])
    yield [path.relative_to(course).as_posix() for path in written]
    for name in [name for name in sys.modules if "t10_pieces" in name]:
        del sys.modules[name]


def test_a_tenth_lab_is_released_checked_and_graded_as_it_is_written(course, tenth, capsys):
    assert tenth == [
        "labcourse/questions/t10_pieces/__init__.py",
        "solutions/10_pieces/10_pieces.ipynb",
        "README.md",
        "labcourse/questions/t10_pieces/rows.py",
        "tests/alternatives/t10_pieces.py",
        "solutions/10_pieces/10_pieces.ipynb",
    ]
    assert "| 10 pieces | | [lab](labs/10_pieces/10_pieces.ipynb) |" in (course / "README.md").read_text()
    assert len(left_to_do(course)) == OF_LAB + OF_QUESTION
    release.release(course, ["10_pieces"])
    lab, solution = (course / folder / "10_pieces/10_pieces.ipynb" for folder in ("labs", "solutions"))
    assert check_file(solution) and not check_file(lab)
    for student, how in (("right", "values.sum(axis=1)"), ("wrong", "values.sum(axis=0)")):
        handed_in = nbformat.read(lab, as_version=4)
        (cell,) = [cell for cell in handed_in.cells if cell.id == "rows"]
        cell.source = f"def rows(values):\n    return {how}\n"
        folder = course / "submitted" / student / "10_pieces"
        folder.mkdir(parents=True)
        nbformat.write(handed_in, folder / "10_pieces.ipynb")
    graded = grade_course("10_pieces", course, seed="a seed", workers=2, progress=False)
    assert [[result.points for result in record.results] for record in graded.records] == [[2], [0]]


@pytest.mark.bad_input  # as test_questions is
def test_a_question_as_it_is_written_fulfils_the_rules_for_questions(course, tenth, monkeypatch):
    name = "10_pieces.rows"
    monkeypatch.setattr(test_promises, "ROOT", course)
    test_promises.test_a_statement_says_what_its_kinds_are(name)
    test_promises.test_each_example_of_a_statement_is_a_case(name)
    test_promises.test_every_case_is_of_its_kinds_and_every_edge_is_in_a_case(name, 20)
    test_promises.test_no_simplification_of_an_argument_goes_unnoticed(name, 20)
    test_questions.test_a_topics_questions_have_its_name("10_pieces")
    test_questions.test_a_question_is_complete(name)
    test_questions.test_a_reference_is_short_and_complete_in_itself(name)
    test_questions.test_cases_are_the_seeds_and_hold_what_is_claimed(name)
    test_questions.test_right_answers_pass(name)
    test_questions.test_wrong_answers_lose(name)
    test_questions.test_misconceptions_earn_their_own_hints(name)


def test_what_is_written_is_free_of_lint(course, tenth):
    scaffold.new_question(course, "04_iou.not_yet")
    for command in (["check", "--ignore", "I"], ["format", "--check"]):
        ruff = [sys.executable, "-m", "ruff", *command, "--no-cache", "--config", str(ROOT / "pyproject.toml")]
        done = subprocess.run([*ruff, "."], cwd=course, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout


def test_a_question_for_a_lab_that_there_is_counts_and_says_what_is_left_to_do(course):
    scaffold.new_question(course, "04_iou.not_yet")
    notebook = nbformat.read(course / "solutions/04_iou/04_iou.ipynb", as_version=4)
    ids = [cell.metadata.get("nbgrader", {}).get("grade_id") for cell in notebook.cells]
    assert [name for name in ids if name][-3:] == ["not_yet", "check_not_yet", "accuracy_and_iou"]
    assert len(left_to_do(course)) == OF_QUESTION
    places = [todo.partition(": TODO")[0] for todo in left_to_do(course)]
    assert "labcourse/questions/t04_iou/not_yet.py:10" in places
    assert "solutions/04_iou/04_iou.ipynb, cell not_yet" in places


@pytest.mark.parametrize("path", SOLUTIONS, ids=lambda path: path.stem)
def test_a_new_task_comes_before_the_written_question_and_the_sources_and_tasks_are_numbered_anew(path):
    before, after = (nbformat.read(path, as_version=4) for _ in range(2))
    scaffold.add_task(after, path.stem, "not_yet", 2)
    was, text = ("\n\n".join(cell.source for cell in notebook.cells) for notebook in (before, after))
    added = re.search(r"## Task \d+: TODO.*?Hint 3</summary>TODO [^\n]*\n\n", text, re.DOTALL)
    above, below = text[: added.start()], text[added.end() :]
    assert "### BEGIN SOLUTION" not in below and not re.search("^## (Sources|Written|.* written)", above, re.MULTILINE)
    headings, rows = (
        [[int(n) for n in re.findall(rf"^{begin} (\d+)", t, re.MULTILINE)] for t in (was, text)]
        for begin in ("## Task", r"\|")
    )
    assert headings[1] == [*range(1, len(headings[0]) + 2)]
    minutes = [[int(n) for n in re.findall(r"(\d+) minutes in all", t)] for t in (was, text)]
    assert minutes[1] == [n + 10 for n in minutes[0]]
    assert rows[1] == ([*range(1, len(rows[0]) + 2)] if minutes[0] and rows[0] else rows[0])
    rest = re.sub(r"^\| \d+ \| `not_yet`: TODO.*\n", "", above, flags=re.MULTILINE) + below
    assert re.sub(r"\d+", "", rest) == re.sub(r"\d+", "", was)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("question 04_iou.iou", "name: expected a name that neither the questions of 04_iou nor the cells"),
        ("question 04_iou.parts", "name: expected a name that neither the questions of 04_iou nor the cells"),
        ("question 04_iou.setup", "name: expected a name that neither the questions of 04_iou nor the cells"),
        ("question 04_iou.2nd", "name: expected lower-case letters"),
        ("question 04_iou.lambda", "name: expected lower-case letters"),
        ("question 04_iou.iou__twice", "name: expected lower-case letters"),
        ("question 04_iou", "name: expected lower-case letters"),
        ("question 11_none.x", "`labkit new lab 11_none` begins a topic that is not there, got '11_none.x'"),
        ("question ../t04_iou.x", "name: expected a topic and a function"),
        ("lab 04_iou", "topic: expected a number that is free, not that of 04_iou, got '04_iou'"),
        ("lab 04_other", "topic: expected a number that is free, not that of 04_iou, got '04_other'"),
        ("lab pieces", "topic: expected two digits, _ and a name: 11_instances, got 'pieces'"),
        ("lab 10_a/b", "topic: expected two digits"),
    ],
)
def test_a_name_that_does_not_fit_is_refused_and_nothing_is_written(words, says, course, labkit, capsys):
    before = snapshot(course)
    assert labkit("new", *words.split(), "--course", course) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and says in said
    assert snapshot(course) == before


def test_a_failure_halfway_leaves_everything_as_it_was(course, monkeypatch):
    before, plain = snapshot(course), scaffold.write_atomically

    def disk_full(path, data):
        if path.suffix == ".ipynb":
            raise OSError(28, "No space left on device", str(path))
        plain(path, data)

    monkeypatch.setattr(scaffold, "write_atomically", disk_full)
    for begin, name in ((scaffold.new_question, "04_iou.not_yet"), (scaffold.new_lab, "10_pieces")):
        with pytest.raises(OSError, match="No space"):
            begin(course, name)
        assert snapshot(course) == before and not (course / "labcourse/questions/t10_pieces").exists()


def test_it_is_for_a_checkout_alone(tmp_path):
    with pytest.raises(ValueError, match=r"course: expected a checkout, with .* without labcourse/questions"):
        scaffold.new_lab(tmp_path, "10_pieces")
    assert not list(tmp_path.iterdir())
