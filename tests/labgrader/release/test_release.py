"""Releasing: the labs that students get, the same bytes each time, nothing volatile in them, all or nothing."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import nbformat
import pytest
from at_night import others_at_night
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

from labgrader.course import asked
from labgrader.course import course as course_here
from labgrader.release.bundle import bundle, topics_of_week
from labgrader.release.release import mistakes, read_notebook, release, tidy, to_bytes

ROOT = Path(__file__).parents[3]
SOLUTION = '''def double(x):
    """Twice x, an array."""
    ### BEGIN SOLUTION
    return 2 * x
    ### END SOLUTION'''


def graded(cell, grade_id, *, grade=False, solution=False, locked=False, points=None):
    """Mark a cell as nbgrader's formgrader would."""
    data = {"grade": grade, "solution": solution, "locked": locked, "task": False, "schema_version": 3}
    cell.metadata["nbgrader"] = data | {"grade_id": grade_id} | ({} if points is None else {"points": points})
    return cell


def solution_notebook(source=SOLUTION, function="double", points=2):
    """A solution with one answer, as authors leave it: run, with times, widgets and the version of Python."""
    run = {"execution": {"iopub.execute_input": "2026-01-01T00:00:00Z"}, "tags": ["nbval-ignore-output"]}
    view = {"application/vnd.jupyter.widget-view+json": {"model_id": "ab"}, "text/plain": "a slider"}
    outputs = [new_output("display_data", view, metadata={"isolated": True}), new_output("stream", text="6\n")]
    cells = [
        new_markdown_cell("# Double"),
        graded(new_code_cell("import numpy as np", execution_count=1), "setup", locked=True),
        graded(new_code_cell(source, execution_count=2), function, solution=True),
        graded(new_code_cell("print(6)"), f"check_{function}", grade=True, locked=True, points=points),
        new_code_cell("show()", execution_count=3, metadata=run, outputs=outputs),
        new_code_cell("show()", execution_count=4),
        graded(new_markdown_cell("Because it is."), "why", grade=True, solution=True, points=3),
    ]
    metadata = {"language_info": {"name": "python", "version": "3.11.2"}, "widgets": {"state": {}}}
    return new_notebook(cells=cells, metadata=metadata)


def lesson_notebook():
    """A lesson, which has no answers: no cell is graded."""
    lesson = solution_notebook(SOLUTION.replace("### BEGIN SOLUTION", "# Twice").replace("### END SOLUTION", "# that"))
    for cell in lesson.cells:
        cell.metadata.pop("nbgrader", None)
    return lesson


@pytest.fixture
def course(tmp_path):
    """A course of two labs and a lesson, none of the kit's topics."""
    for topic in ("90_one", "91_two"):
        folder = tmp_path / "solutions" / topic
        folder.mkdir(parents=True)
        nbformat.write(solution_notebook(), folder / f"{topic}.ipynb")
    (tmp_path / "solutions/90_one/table.csv").write_text("1,2\n")
    (tmp_path / "lessons").mkdir()
    nbformat.write(lesson_notebook(), tmp_path / "lessons/90_one.ipynb")
    return tmp_path


def snapshot(folder: Path) -> dict[str, bytes]:
    """All files of a folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def spoil(path: Path, old: str, new: str) -> None:
    """Change a file's text."""
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


# --------------------------------------------------------------------------------------------- the lab


def test_a_lab_has_blanks_that_raise_and_nothing_of_the_solution(course):
    release(course)
    lab = read_notebook(course / "labs/90_one/90_one.ipynb")
    by_id = {cell.metadata.nbgrader.grade_id: cell for cell in lab.cells if "nbgrader" in cell.metadata}
    blank = SOLUTION[: SOLUTION.index("### BEGIN")] + "# your lines\n    raise NotImplementedError"
    assert by_id["double"].source == blank
    assert by_id["why"].source == "*Your answer.*"
    assert "2 * x" not in str(lab) and "Because" not in str(lab)
    assert all(not cell.get("outputs") and cell.get("execution_count") is None for cell in lab.cells)
    assert (course / "labs/90_one/table.csv").read_text() == "1,2\n"
    solution = read_notebook(course / "solutions/90_one/90_one.ipynb")
    ids = [cell.id for cell in solution.cells]  # cells are found again by these
    assert [cell.id for cell in lab.cells] == ids and len(set(ids)) == len(ids)
    assert ids[1:4] == ["setup", "double", "check_double"] and ids[5] == f"{ids[4]}-2"


def test_a_lab_is_an_assignment_to_nbgrader(course):
    """Locked cells cannot be edited, none can be deleted, and the checksums are nbgrader's own."""
    from nbgrader.utils import compute_checksum
    from nbgrader.validator import Validator

    release(course)
    path = course / "labs/90_one/90_one.ipynb"
    lab = read_notebook(path)
    cells = {cell.metadata.nbgrader.grade_id: cell for cell in lab.cells if "nbgrader" in cell.metadata}
    assert {name for name, cell in cells.items() if cell.metadata.get("editable", True)} == {"double", "why"}
    assert not any(cell.metadata.get("deletable", True) for cell in cells.values())
    for cell in cells.values():
        assert cell.metadata.nbgrader.checksum == compute_checksum(cell)
    assert cells["check_double"].metadata.nbgrader.points == 2 and cells["why"].metadata.nbgrader.points == 3
    assert Validator()._get_changed_cells(lab) == []


# -------------------------------------------------------------------------------------------- the same


def test_the_same_bytes_every_time_whoever_ran_the_notebooks(course):
    first = release(course)
    names = [str(path.relative_to(course)) for path in first]
    assert names == [
        "lessons/90_one.ipynb",
        "solutions/90_one/90_one.ipynb",
        "solutions/91_two/91_two.ipynb",
        "labs/90_one/90_one.ipynb",
        "labs/90_one/table.csv",
        "labs/91_two/91_two.ipynb",
    ]
    before = snapshot(course)
    assert release(course) == [] and release(course, check=True) == []
    again = read_notebook(course / "solutions/90_one/90_one.ipynb")
    for number, cell in enumerate(again.cells):
        cell["id"] = f"random-{number}"
        cell.metadata["execution"] = {"iopub.status.busy": "2027-01-01T00:00:00Z"}
    again.metadata.language_info["version"] = "3.11.9"
    nbformat.write(again, course / "solutions/90_one/90_one.ipynb")
    assert release(course) == [course / "solutions/90_one/90_one.ipynb"]
    assert snapshot(course) == before


def test_tidying_keeps_outputs_tags_and_counts():
    notebook = solution_notebook()
    before, tidied = str(notebook), tidy(notebook)
    assert str(notebook) == before, "the argument is left alone"
    cell = tidied.cells[4]
    assert cell.outputs[0].data == {"text/plain": "a slider"} and cell.outputs[0].metadata == {}
    assert cell.outputs[1].text == "6\n" and cell.execution_count == 3
    assert cell.metadata == {"tags": ["nbval-ignore-output"]}
    assert tidied.metadata.language_info == {"name": "python"} and "widgets" not in tidied.metadata
    assert to_bytes(tidy(tidied)) == to_bytes(tidied)


@pytest.mark.parametrize(
    "path, old, new",
    [
        ("labs/90_one/90_one.ipynb", "raise NotImplementedError", "return 2 * x"),
        ("labs/90_one/table.csv", "1,2", "1,3"),
        ("solutions/91_two/91_two.ipynb", "2 * x", "x + x + 0"),
        ("lessons/90_one.ipynb", '"tags"', '"ExecuteTime": 3, "tags"'),
    ],
)
def test_drift_is_named_and_left_as_it_is_by_check(course, path, old, new, labkit, capsys):
    release(course)
    spoil(course / path, old, new)
    before = snapshot(course)
    status = labkit("release", "--check", "--course", course)
    drift = [line.split(":")[0] for line in capsys.readouterr().out.splitlines()]
    if path == "solutions/91_two/91_two.ipynb":
        assert status == 0  # another right solution gives the same lab
    else:
        assert status == 1 and drift == [str(course / path)]
    assert snapshot(course) == before


def test_what_belongs_to_no_solution_is_removed(course):
    release(course)
    (course / "labs/89_gone").mkdir()
    (course / "labs/89_gone/89_gone.ipynb").touch()
    (course / "labs/90_one/mine.txt").touch()
    gone = [course / "labs/90_one/mine.txt", course / "labs/89_gone/89_gone.ipynb"]
    assert release(course, check=True) == gone and release(course, ["91_two"]) == []
    assert release(course) == gone
    assert sorted(path.name for path in (course / "labs").iterdir()) == ["90_one", "91_two"]


def test_what_git_ignores_is_no_part_of_a_lab(course):
    """A table of attempts that running a solution, or a lab, leaves behind asks for no release and stays."""
    release(course)
    subprocess.run(["git", "-C", course, "init", "-q"], check=True)
    (course / ".gitignore").write_text("/*/*/*_attempts.json\n")
    ran, tried = course / "solutions/90_one/90_attempts.json", course / "labs/91_two/91_attempts.json"
    for path in (ran, tried, course / "solutions/91_two/notes.txt"):
        path.write_text("[]")
    assert release(course) == [course / "labs/91_two/notes.txt"] and release(course, check=True) == []
    assert tried.is_file() and not (course / "labs/90_one/90_attempts.json").exists()


def test_only_the_topics_that_are_asked_for(course):
    release(course, ["91_two"])
    assert [path.name for path in (course / "labs").iterdir()] == ["91_two"]
    with pytest.raises(ValueError, match=r"topics: expected some of 90_one, 91_two, got 92_three"):
        release(course, ["92_three"])
    with pytest.raises(ValueError, match="course: expected a folder with solutions"):
        release(course / "labs")


# --------------------------------------------------------------------------------------- all or nothing


@pytest.mark.parametrize(
    ("spoilt", "says"),
    [
        ("not a notebook", "91_two"),
        ('{"cells": []}', "91_two"),
        ("### BEGIN SOLUTION\nx = 1\n### END SOLUTION", r"nbgrader could not make the lab.*olution"),
    ],
)
def test_a_broken_solution_changes_nothing(course, spoilt, says):
    release(course)
    spoil(course / "solutions/90_one/90_one.ipynb", "Twice", "Two times")
    path = course / "solutions/91_two/91_two.ipynb"
    if spoilt.startswith("#"):
        notebook = read_notebook(path)
        notebook.cells.append(new_code_cell(spoilt))
        nbformat.write(notebook, path)
    else:
        path.write_text(spoilt)
    before = snapshot(course)
    with pytest.raises(ValueError, match=says):
        release(course)
    assert snapshot(course) == before


# ------------------------------------------------------------------------------- what an assignment must be


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"source": SOLUTION.replace("double", "twice")}, "cell double defines no function double"),
        ({"source": "def double(x:"}, "cell double defines no function double"),
        ({"source": "def double(x):\n    return 2 * x"}, "cell double marks no solution"),
        ({"function": "setup"}, "grade id setup occurs twice"),
    ],
)
def test_mistakes_of_answer_cells(changes, said):
    assert said in mistakes(solution_notebook(**changes), "90_one")


def test_mistakes_of_other_cells():
    notebook = solution_notebook()
    assert mistakes(notebook, "90_one") == []
    del notebook.cells[3], notebook.cells[1]
    assert mistakes(notebook, "90_one") == [
        "its first graded cell is not a locked `setup`",
        "double has no tests cell check_double",
    ]
    del notebook.cells[1]
    notebook.cells.insert(0, graded(new_code_cell("1"), "check_double", grade=True, locked=True, points=1))
    assert "check_double tests no answer" in mistakes(notebook, "90_one")


def test_a_topic_of_the_kit_answers_all_its_questions_for_their_points():
    questions = asked("04_iou")
    iou = questions["iou"]
    wrong_points = solution_notebook(SOLUTION.replace("double", "iou"), "iou", points=iou.points + 1)
    said = mistakes(wrong_points, "04_iou")
    assert f"check_iou has {iou.points + 1} points, its question {iou.points}" in said
    assert {f"no cell answers 04_iou.{name}" for name in questions if name != "iou"} <= set(said)
    assert "there is no question 04_iou.double" in mistakes(solution_notebook(), "04_iou")


def test_a_lab_that_checks_what_is_no_question_is_not_released(course):
    """Whether its topic is one of the kit's or not; its students would be told that there is no such question."""
    path = course / "solutions/91_two/91_two.ipynb"
    spoil(path, "print(6)", "double = check('91_two.double', double)")
    before = snapshot(course)
    with pytest.raises(ValueError, match=r"expected an assignment, but there is no question 91_two\.double$"):
        release(course)
    assert snapshot(course) == before


def test_the_command_runs_by_itself(course):
    done = subprocess.run([sys.executable, "-m", "labcli.cli", "release", "90_one"], cwd=course, capture_output=True)
    assert done.returncode == 0 and b"changed labs/90_one/90_one.ipynb" in done.stdout, done.stderr
    assert done.stderr == b""


# ------------------------------------------------------------------------------------- what students get


def test_the_bundle_holds_what_students_need_and_no_model_answer(tmp_path):
    """Of this course, whose labs are as its solutions make them: the whole kit, no solution, no test, no rest."""
    names, left_out, _ = bundle(ROOT, tmp_path / "course.zip")
    assert not [name for name in left_out if not name.endswith("_attempts.json")]  # of a run of the notebooks
    assert {name.split("/")[0] for name in names} >= {"lessons", "labs", *course_here().kit, "Makefile", "README.md"}
    command = ["git", "ls-files", *course_here().kit]
    kit = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    withheld = ("labcourse/exam/", "labcourse/templates/")
    assert len(kit) > 100 and {name for name in kit if not name.startswith(withheld)} <= set(names)
    with zipfile.ZipFile(tmp_path / "course.zip") as archive:
        start = archive.read("course/README.md").decode()
    assert start.startswith("# Start here")
    assert set(re.findall(r"\]\((?!https?:)([^)]+)\)", start)) <= {*names}
    kept = (
        "solutions",
        "tests",
        "docs/grading.md",
        "docs/exams",
        *withheld,
        "nbgrader_config.py",
        "grades",
        "submitted",
        "gradebook",
        ".git",
    )
    assert not [name for name in names if name.startswith(kept) or "__pycache__" in name or "checkpoint" in name]
    with zipfile.ZipFile(tmp_path / "course.zip") as archive:
        archive.extractall(tmp_path)
    course = tmp_path / "course"
    assert links_out_of(course) == []
    for path in ROOT.glob("solutions/*/*.ipynb"):
        for cell in read_notebook(path).cells:
            mark = cell.metadata.get("nbgrader", {})
            if mark.get("solution") and cell.cell_type == "markdown":
                lines = [line for line in cell.source.splitlines() if len(line) > 60]
                assert not [
                    name for name in names if name.endswith("ipynb") and lines[0] in (course / name).read_text()
                ]


def links_out_of(folder):
    """The links of a bundle's pages and cells that lead to no file of it, each with its page."""
    pages = {path: path.read_text(encoding="utf-8") for path in folder.rglob("*.md")}
    for path in folder.rglob("*.ipynb"):
        pages[path] = "\n".join(cell.source for cell in read_notebook(path).cells if cell.cell_type == "markdown")
    pages.pop(folder / "docs/site/landing.md", None)  # whose addresses are those of the site that is made with it
    links = [(path, link) for path, text in pages.items() for link in re.findall(r"\]\(([^)\s#]+)[^)\s]*\)", text)]
    assert len(links) > 30
    return [(path, link) for path, link in links if not re.match(r"\w+:", link) and not (path.parent / link).exists()]


@pytest.mark.nightly
def test_a_lab_in_the_bundle_runs(tmp_path):
    bundle(ROOT, tmp_path / "course.zip")
    with zipfile.ZipFile(tmp_path / "course.zip") as archive:
        archive.extractall(tmp_path)
    course = tmp_path / "course"
    lab = [sys.executable, "-m", "pytest", "-q", "-p", "nbval.plugin", "--nbval-lax", "--nbval-current-env"]
    environment = os.environ | {"PYTHONPATH": str(course)}
    done = subprocess.run([*lab, "labs/04_iou"], cwd=course, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_a_weeks_bundle_holds_its_labs_their_lessons_and_nothing_else_of_the_course(tmp_path):
    names = bundle(ROOT, tmp_path / "week.zip", ["01_labels", "04_iou"]).names
    asked_of = {name.split("/")[2][:3] for name in names if re.match(r"labcourse/questions/t\d", name)}
    assert asked_of == {"t01", "t02", "t03", "t04"} and not [
        name for name in names if name.startswith("labcourse/exam")
    ]
    material = [name for name in names if name.startswith(("lessons/", "labs/", "docs/"))]
    assert {re.search(r"\d\d_", name)[0] for name in material} == {"01_", "04_"}
    assert {"labs/04_iou/04_iou.ipynb", "lessons/04_iou_edges.ipynb", "lessons/schematics/04_counts.svg"} <= {*material}
    with zipfile.ZipFile(tmp_path / "week.zip") as archive:
        for page in ("README.md", "START.md"):
            text = archive.read(f"week/{page}").decode()
            links = re.findall(r"\]\((?!https?:)([^)]+)\)", text)
            assert len(links) == 5 and set(links) <= {*names} and "ROWS" not in text
        archive.extractall(tmp_path)
    assert links_out_of(tmp_path / "week") == []
    with pytest.raises(ValueError, match="topics: expected some of 01_labels"):
        bundle(ROOT, tmp_path / "x.zip", ["04_iuo"])


def test_a_week_has_the_topics_of_the_syllabus(monkeypatch):
    assert topics_of_week(4) == ("04_iou",)
    changed = replace(course_here(), weeks=(("01_labels",), ("03_gradient", "04_iou")))
    monkeypatch.setattr("labgrader.release.bundle.course_here", lambda: changed)
    assert topics_of_week(2) == ("03_gradient", "04_iou")
    with pytest.raises(ValueError, match="week: expected 1 to 2, got 3"):
        topics_of_week(3)


def test_the_same_course_gives_the_same_bundle(course, tmp_path):
    release(course)
    twice = [(bundle(course, tmp_path / "course.zip"), (tmp_path / "course.zip").read_bytes()) for _ in range(2)]
    assert twice[0] == twice[1] and "labs/90_one/90_one.ipynb" in twice[0][0].names and not twice[0][0].tracked


def test_a_bundle_takes_what_git_tracks_and_no_link_solution_or_key_and_says_so(course, tmp_path, labkit, capsys):
    """Links lead out of the tree, to what stays with the instructor, and to what is in the bundle anyway."""
    (course / "docs").mkdir()
    (course / "docs/guide.md").write_text("A guide.")
    (course / "docs/key.html").write_text("<h1>Key, seed 1</h1><p>9 points. Not for students.</p>")
    (course / "docs/notes.md").write_text("**Rubric (3 points).** one for the union")
    (course / "docs/hosts.md").symlink_to("/etc/hosts")
    (course / "docs/solved").symlink_to("../solutions/90_one", target_is_directory=True)
    (course / "docs/again.md").symlink_to("guide.md")
    (course / "data").mkdir()
    (course / "data/table.md").write_text("1")
    (course / "labkit").symlink_to("data", target_is_directory=True)
    (course / "labcli").mkdir()
    (course / "labcli/answers.py").write_text(SOLUTION)
    (course / "labcli/marks.py").write_text('BEGIN = "### BEGIN SOLUTION"')
    nbformat.write(solution_notebook(), course / "lessons/91_two.ipynb")
    shown = solution_notebook(SOLUTION.replace("### BEGIN SOLUTION", "").replace("### END SOLUTION", ""))
    nbformat.write(shown, course / "lessons/92_three.ipynb")
    nbformat.write(new_notebook(cells=[new_markdown_cell("# Read")]), course / "lessons/93_four.ipynb")
    (course / "lessons/90_one.ipynb").unlink()
    release(course)
    subprocess.run(["git", "init", "-q"], cwd=course, check=True)
    subprocess.run(["git", "add", "-A"], cwd=course, check=True)
    nbformat.write(new_notebook(cells=[new_markdown_cell("# A draft")]), course / "lessons/94_draft.ipynb")
    release(course)
    assert labkit("release", "--course", course, "--bundle", tmp_path / "x.zip") == 0
    lines = capsys.readouterr().out.splitlines()
    said = dict(line.removeprefix("left out ").split(": ") for line in lines if line.startswith("left out "))
    links = dict.fromkeys(("docs/again.md", "docs/hosts.md", "docs/solved", "labkit", "labkit/table.md"), "a link")
    assert {name: why for name, why in said.items() if why == "a link"} == links
    assert said["labcli/answers.py"] == "a solution, by its marks" and "labcli/marks.py" not in said
    assert said["docs/key.html"] == "a key, by its marks" and said["docs/notes.md"] == "a rubric, by its marks"
    assert said["lessons/91_two.ipynb"] == "a solution, by its marks"
    assert said["lessons/92_three.ipynb"] == "a notebook with solution cells"
    assert said["lessons/94_draft.ipynb"] == "git does not track it"
    with zipfile.ZipFile(tmp_path / "x.zip") as archive:
        names = {name.removeprefix("x/") for name in archive.namelist()}
        texts = [archive.read(name) for name in archive.namelist()]
    assert {"docs/guide.md", "lessons/93_four.ipynb", "labs/90_one/90_one.ipynb"} <= names and not names & said.keys()
    assert not [text for text in texts if b"2 * x" in text or b"localhost" in text]


def test_a_repository_that_git_does_not_read_is_no_folder_without_one(course, tmp_path, monkeypatch):
    """As where the clone is another account's: what is a draft is not known then."""
    release(course)
    subprocess.run(["git", "init", "-q"], cwd=course, check=True)
    monkeypatch.setenv("GIT_TEST_ASSUME_DIFFERENT_OWNER", "1")
    with pytest.raises(ValueError, match=r"course: expected what git tracks of .*dubious ownership"):
        bundle(course, tmp_path / "x.zip")
    monkeypatch.setenv("PATH", "")
    with pytest.raises(ValueError, match=r"course: expected what git tracks of .*: No such file"):
        bundle(course, tmp_path / "x.zip")
    shutil.rmtree(course / ".git")
    assert not bundle(course, tmp_path / "x.zip").tracked


@pytest.mark.parametrize("labs", others_at_night([["90_one"], []]))
def test_what_is_published_on_a_hub_is_what_git_tracks(course, tmp_path, labs):
    release(course)
    shutil.copytree(ROOT / "deploy", course / "deploy")
    nbformat.write(solution_notebook(), course / "lessons/91_two.ipynb")
    (course / "lessons/92_three.md").symlink_to("../solutions/90_one/90_one.ipynb")
    publish = partial(
        subprocess.run,
        env=os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"},
        capture_output=True,
        text=True,
    )
    subprocess.run("git init -q && git add -A", cwd=course, shell=True, check=True)
    nbformat.write(new_notebook(cells=[new_markdown_cell("# A draft")]), course / "lessons/94_draft.ipynb")
    (course / "labs/90_one/notes.md").write_text("double returns 2 * x")
    done = publish([course / "deploy/publish", tmp_path / "class", *labs])
    assert done.returncode == 0, done.stderr
    listed = publish(["git", "-C", tmp_path / "class", "ls-files"]).stdout.split()
    one = ["labs/90_one/90_one.ipynb", "labs/90_one/table.csv"]
    assert listed == [*one, *["labs/91_two/91_two.ipynb"] * (not labs), "lessons/90_one.ipynb"]
    left_out = sorted(line.split()[2].rstrip(":") for line in done.stderr.splitlines() if line.startswith("left out"))
    drafts = ["lessons/91_two.ipynb", "lessons/92_three.md", "lessons/94_draft.ipynb"]
    assert left_out == ["labs/90_one/notes.md", *drafts]
    refused = publish([course / "deploy/publish", tmp_path / "other", "90_noe"])
    assert refused.returncode and "got labs/90_noe" in refused.stderr and not (tmp_path / "other/.git").exists()


def test_a_published_course_releases_badges_which_its_bundle_does_not_have(course, tmp_path, monkeypatch):
    published = replace(course_here(), repository="https://github.com/owner/name", wheel="kit==1.0")
    for module in ("release", "bundle"):
        monkeypatch.setattr(f"labgrader.release.{module}.course_here", lambda: published)
    files = [course / "labs/90_one/90_one.ipynb", *course.glob("lessons/*.ipynb")]
    release(course)
    assert len(files) == 2 and all(b"Open in Colab" in path.read_bytes() for path in files)
    assert release(course) == []
    bundle(course, tmp_path / "course.zip")
    with zipfile.ZipFile(tmp_path / "course.zip") as archive:
        inside = [archive.read(f"course/{path.relative_to(course).as_posix()}") for path in files]
    assert not any(b"colab" in data for data in inside)
    monkeypatch.undo()
    assert set(files) < set(release(course)) and not any(b"colab" in path.read_bytes() for path in files)


def test_a_bundle_of_labs_that_drifted_is_not_written(course, tmp_path):
    release(course)
    spoil(course / "labs/90_one/90_one.ipynb", "raise NotImplementedError", "return 2 * x")
    with pytest.raises(ValueError, match=r"run `labkit release` first, .*90_one.ipynb"):
        bundle(course, tmp_path / "x.zip")
    assert not (tmp_path / "x.zip").exists()
