"""A folder of submissions: what is written, what is graded again, what a killed run leaves, the gradebook."""

import csv
import html
import json
import os
import re
import shutil
import signal
import stat
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import grading_course as kit
import numpy as np
import pytest
from typer.testing import CliRunner

from labcli.cli import app
from labgrader import grade_course as run
from labgrader.course import course as the_course
from labgrader.course import find, of_topic
from labgrader.grade import batch, gradebook
from labgrader.grade import grade as grading
from labgrader.grade.batch import read_record, record_path, secret_for
from labgrader.grade.grade import secret_cases
from labgrader.grade_course import grade_course
from labgrader.handin import reading
from labgrader.program.slice import Program
from labgrader.run.run import Run, packages_of, public_cases
from labgrader.sandbox import bwrap

TOPIC = "04_iou"
SECRET = "2718281828459045"
POINTS = {name: float(question.points) for name, question in kit.asked(TOPIC).items()}
TOTAL = sum(POINTS.values())
BUT_IOU = TOTAL - POINTS["iou"]
ROOT = Path(__file__).parents[3]


def misconceived() -> dict[str, str]:
    """Each question answered with the first of its misconceptions."""
    return {name: kit.as_cell(question.misconceptions[0].answer, name) for name, question in kit.asked(TOPIC).items()}


def write_class(folder: Path) -> None:
    """Three students: all right, all wrong, and one whose second answer crashes the worker."""
    right = kit.right_answers(TOPIC)
    kit.write_lab(folder, TOPIC)
    kit.submit(folder, "ada", TOPIC, right)
    kit.submit(folder, "ben", TOPIC, misconceived())
    kit.submit(folder, "eve", TOPIC, right | {"iou": "import os\ndef iou(n):\n    os._exit(1)\n"})


@pytest.fixture
def course(tmp_path):
    """The class before it is graded."""
    write_class(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def graded_once(tmp_path_factory):
    """The class of `course`, graded: its folder, and what came of it."""
    folder = tmp_path_factory.mktemp("graded")
    write_class(folder)
    return folder, grade(folder)


@pytest.fixture
def graded(graded_once, tmp_path):
    """A copy of that folder; to grade it again costs nothing but what a test changes."""
    return shutil.copytree(graded_once[0], tmp_path / "course")


def grade(course: Path, **how):
    return grade_course(TOPIC, course, **{"seed": SECRET, "progress": False} | how)


def files(folder: Path) -> dict[str, bytes]:
    """All files of a folder by their relative paths."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def for_students(course: Path) -> dict[str, bytes]:
    """What students get to see."""
    found = files(course / "grades" / TOPIC)
    return {name: data for name, data in found.items() if name.startswith(("feedback", "results"))}


# -------------------------------------------------------------------------------------------- what is written


def test_points_and_words_are_as_constructed(graded_once):
    course, graded = graded_once
    assert [record.student for record in graded.records] == ["ada", "ben", "eve"] and graded.graded_now == 3
    ada, ben, eve = graded.records
    assert {result.question: result.points for result in ada.results} == POINTS and not ada.needs_a_look
    assert ben.points == 0.0
    for result, question in zip(ben.results, kit.asked(TOPIC).values(), strict=True):
        assert result.hint == question.misconceptions[0].hint
    page = (course / "grades" / TOPIC / "feedback" / "ben.html").read_text()
    for result in ben.results:  # the call of a public case, and what came and was expected
        assert result.shown.startswith(f"{result.question}(") and "expected" in result.shown
        assert all(html.escape(line) in page for line in result.shown.splitlines())
    assert {result.question: result.points for result in eve.results} == POINTS | {"iou": 0.0} and eve.needs_a_look
    rows = list(csv.DictReader((course / "grades" / TOPIC / "grades.csv").open()))
    assert [(row["student"], row["question"], float(row["points"])) for row in rows] == [
        (record.student, result.question, result.points) for record in graded.records for result in record.results
    ]
    data = json.loads((course / "grades" / TOPIC / "results" / "eve" / "results.json").read_text())  # for Gradescope
    assert data["score"] == sum(test["score"] for test in data["tests"]) == BUT_IOU
    statuses = {test["name"]: test["status"] for test in data["tests"]}
    assert statuses == dict.fromkeys(POINTS, "passed") | {"iou": "failed"}
    assert sum(test["max_score"] for test in data["tests"]) == TOTAL


def test_students_learn_no_seed_and_no_expected_value(graded_once):
    course, _ = graded_once
    told = for_students(course)
    assert len(told) == 6

    questions = kit.asked(TOPIC).values()
    students = [folder.name for folder in (course / "submitted").iterdir()]

    def values_of(cases):
        return {f"{float(value):.4f}" for case in cases for value in kit.np.ravel(case.expected) if value % 1 > 0}

    values = values_of(case for q in questions for student in students for case in secret_cases(q, SECRET, student))
    values -= values_of(case for q in questions for case in public_cases(q))  # one such as 4/7 tells nothing
    assert len(values) > 20
    for name, data in told.items():
        text = data.decode()
        assert SECRET not in text, name
        assert not [value for value in values if value in text], name


def test_the_secret_is_kept_for_the_next_run_and_private(tmp_path):
    first = secret_for(tmp_path, None)
    assert len(first) == 32 and secret_for(tmp_path, None) == first == secret_for(tmp_path, first)
    with pytest.raises(ValueError, match=r"seed: expected that of the round.*--new-round"):
        secret_for(tmp_path, "mine")
    assert secret_for(tmp_path, "mine", new_round=True) == "mine" == secret_for(tmp_path, None)
    assert secret_for(tmp_path, None, new_round=True) not in ("mine", first)
    assert secret_for(tmp_path / "other", None) != first


def test_each_notebook_has_secret_cases_of_its_own_and_each_round_others():
    question = find("04_iou.iou")
    drawn = [secret_cases(question, *of) for of in (("one", "a"), ("one", "b"), ("two", "a"))]
    assert [len(cases) for cases in drawn] == [2 * question.random_cases] * 3
    seen = {case.args[0].tobytes() for cases in (*drawn, public_cases(question)) for case in cases}
    assert len(seen) == 6 * question.random_cases + len(public_cases(question))
    again = secret_cases(question, "one", "a")
    assert all(kit.np.array_equal(a.args[0], b.args[0]) for a, b in zip(drawn[0], again, strict=True))


def test_everybody_has_run_in_public_before_anybody_runs_in_secret(course, monkeypatch):
    """So nothing of a secret case can be in what a student reads, whatever an answer leaves on the machine."""
    order = []
    judge = Run.judge

    def noted(self, cases):
        order.append("public" if cases is public_cases(self.question) else "secret")
        return judge(self, cases)

    monkeypatch.setattr(Run, "judge", noted)
    grade(course, workers=2)
    public = 3 * len(POINTS)
    assert (
        order.count("public") == public
        and "public" not in order[public:]
        and len(order) == public + 2 * len(POINTS) - 1
    )


# ---------------------------------------------------------------------------------- again, killed, elsewhere


def test_again_grades_only_what_changed(graded_once, graded):
    _, first = graded_once
    course, before = graded, files(graded / "grades")
    again = grade(course)
    assert again.graded_now == 0 and files(course / "grades") == before
    assert [r.results for r in again.records] == [r.results for r in first.records]
    kit.submit(course, "ben", TOPIC, kit.right_answers(TOPIC))
    third = grade(course)
    assert third.graded_now == 1 and third.records[1].points == TOTAL
    path = record_path(course / "grades" / TOPIC, "ada")
    path.write_text('{"student": "ada"')  # a record that broke is made again
    assert read_record(path) is None and grade(course).graded_now == 1
    assert grade(course, force=True).graded_now == 3


def test_a_new_round_or_lab_grades_everything_again_and_late_work_joins_the_round(graded):
    course = graded
    assert grade(course, seed="another", new_round=True).graded_now == 3
    kit.submit(course, "late", TOPIC, kit.right_answers(TOPIC))
    assert grade(course, seed=None).graded_now == 1
    kit.write_lab(course, TOPIC, setup="import numpy as np  # and nothing else")
    assert grade(course, seed=None).graded_now == 4


@pytest.mark.parametrize(
    "settings", [{"packages": ("numpy",)}, {"kit": ()}, {"copied": ()}, {"ignored": 7}, {"language": "de"}], ids=str
)
def test_results_depend_on_the_settings_of_the_course(monkeypatch, settings):
    before = batch.code_digest()
    here = replace(the_course(), **settings)
    monkeypatch.setattr("labgrader.course.course_around", lambda folder: here)
    assert batch.code_digest() != before


def test_results_depend_on_the_hints_of_the_language_that_is_chosen(tmp_path, monkeypatch):
    (tmp_path / "questions_of_mine").mkdir()
    monkeypatch.syspath_prepend(tmp_path)
    here = replace(the_course(), questions="questions_of_mine")
    monkeypatch.setattr("labgrader.course.course_around", lambda folder: here)

    def digests() -> dict[str, str]:
        found = {}
        for language in ("de", "fr"):
            monkeypatch.setenv("LABGRADER_LANGUAGE", language)
            found[language] = batch.code_digest()
        return found

    before = digests()
    (tmp_path / "questions_of_mine" / "iou.de.toml").write_text("[hints]")
    after = digests()
    assert after["de"] not in before.values() and after["fr"] == before["fr"] != before["de"]


def test_what_appears_or_changes_while_a_run_grades_waits_for_the_next(graded, monkeypatch):
    """A new student and another notebook come after the folder was read: what is shown is what was graded."""
    grade_all = run.grade_batch

    course = graded

    def meanwhile(*arguments):
        kit.submit(course, "dan", TOPIC, kit.right_answers(TOPIC))
        kit.submit(course, "ben", TOPIC, kit.right_answers(TOPIC))
        return grade_all(*arguments)

    monkeypatch.setattr(run, "grade_batch", meanwhile)
    graded = grade(course)
    assert [record.student for record in graded.records] == ["ada", "ben", "eve"] and graded.records[1].points == 0.0
    shown = (course / "autograded" / "ben" / TOPIC / f"{TOPIC}.ipynb").read_text()
    assert json.dumps(misconceived()["iou"].splitlines()[-1])[1:-1] in shown
    monkeypatch.undo()
    again = grade(course)
    assert again.graded_now == 2 and [record.points for record in again.records] == [TOTAL, TOTAL, TOTAL, BUT_IOU]


def test_only_the_instructor_can_read_what_is_written(course):
    for student in ("ben", "eve"):
        shutil.rmtree(course / "submitted" / student)
    (course / "gradebook.db").chmod(0o644)
    (course / "grades").mkdir(mode=0o755)
    grade(course)
    for folder in ("grades", "autograded"):
        for path in (course / folder).rglob("*"):
            assert stat.S_IMODE(path.stat().st_mode) == (0o700 if path.is_dir() else 0o600), path
    assert stat.S_IMODE((course / "gradebook.db").stat().st_mode) == 0o600


@pytest.mark.parametrize("broken", ["write_scores", "copy_for_formgrader"])
def test_a_student_whom_the_gradebook_cannot_take_stops_nobody_else(graded, monkeypatch, broken):
    course = graded
    kit.submit(course, "ben", TOPIC, kit.right_answers(TOPIC))
    original = getattr(gradebook, broken)

    def fails_for_ben(*arguments):
        if any(getattr(argument, "student", "") == "ben" for argument in arguments):
            raise OverflowError("as if something of theirs were too odd")
        return original(*arguments)

    monkeypatch.setattr(gradebook, broken, fails_for_ben)
    graded = grade(course)
    assert graded.failures == {"ben": "not in the gradebook: OverflowError"} and graded.needs_a_look
    with gradebook.opened(course) as book:
        assert book.find_submission(TOPIC, "ada").score == TOTAL and book.find_submission(TOPIC, "eve").score == BUT_IOU
    monkeypatch.undo()
    assert grade(course).failures == {}
    with gradebook.opened(course) as book:
        assert book.find_submission(TOPIC, "ben").score == TOTAL


@pytest.mark.parametrize("cases", ["public", "secret"])
def test_an_error_of_the_grader_flags_one_answer_stops_nobody_and_is_tried_again(graded, monkeypatch, cases):
    course = graded
    right = kit.right_answers(TOPIC)["iou"]
    answer = "def iou(n):\n    return n / 7\n" if cases == "public" else f"{right}\n# mine\n"
    kit.submit(course, "fay", TOPIC, kit.right_answers(TOPIC) | {"iou": answer})
    name = "behaviour_of" if cases == "public" else "secret_cases"
    original = getattr(grading, name)

    def fails_for_fay(first, *rest):
        in_public = not rest and isinstance(first[0], kit.np.ndarray)
        if in_public or ("fay" in rest and first.function == "iou"):
            raise OverflowError(f"a stranger's words: {SECRET}")
        return original(first, *rest)

    monkeypatch.setattr(grading, name, fails_for_fay)
    graded = grade(course)
    assert [record.points for record in graded.records] == [TOTAL, 0.0, BUT_IOU, BUT_IOU]
    (flag,) = [result.flag for result in graded.records[3].results if result.flag]
    assert re.fullmatch(r"the grader failed: OverflowError in test_batch.py, line \d+; grade it again", flag)
    told = for_students(course)["feedback/fay.html"].decode()
    assert "The grader could not judge it" in told and "OverflowError" not in told and SECRET not in told
    assert grade(course).graded_now == 1
    monkeypatch.undo()
    assert grade(course).records[3].points == (BUT_IOU if cases == "public" else TOTAL)
    assert grade(course).graded_now == 0


def test_a_folder_that_cannot_be_entered_stops_nobody_else(graded, monkeypatch):
    """As an ordinary user would find it: a folder of mode 000."""
    course = graded
    ask = os.lstat

    def refuse(path, *rest, **more):
        if "eve/" in str(path):
            raise PermissionError(13, "Permission denied")
        return ask(path, *rest, **more)

    monkeypatch.setattr(reading.os, "lstat", refuse)
    graded = grade(course)
    assert [record.reason for record in graded.records] == ["", "", "it cannot be opened: Permission denied"]


def test_killed_in_the_middle_and_run_again(course):
    """SIGKILL while the last of three submissions runs in public: what was done is kept, the grades are the same."""
    slow = "import time\ndef iou(n):\n    time.sleep({})\n"
    waiting = kit.right_answers(TOPIC)
    waiting["iou"] = waiting["iou"] + slow.format(600)
    path = kit.submit(course, "eve", TOPIC, waiting)
    command = [sys.executable, "-m", "labcli.cli", "grade", TOPIC, "--course", str(course), "--seed", SECRET]
    process = subprocess.Popen([*command, "--workers", "1"], cwd=ROOT, stderr=subprocess.DEVNULL)
    done = record_path(course / "grades" / TOPIC, "ben")
    try:
        deadline = time.monotonic() + 120.0
        while not done.exists() and time.monotonic() < deadline:
            time.sleep(0.02)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert done.exists() and not (course / "grades" / TOPIC / "grades.csv").exists()
    path.write_text(json.dumps(kit.lab_notebook(TOPIC, kit.right_answers(TOPIC))))
    graded = grade(course)
    assert graded.graded_now == 3 and [r.points for r in graded.records] == [TOTAL, 0.0, TOTAL]
    kept = files(course / "grades")
    assert grade(course, force=True).graded_now == 3 and files(course / "grades") == kept


# --------------------------------------------------------------------------------------- without a sandbox


@pytest.mark.nightly
def test_without_a_sandbox_every_file_says_so(course):
    graded = grade(course, unsafe=True)
    assert [record.points for record in graded.records] == [TOTAL, 0.0, BUT_IOU]
    written = files(course / "grades" / TOPIC)
    shown = {name: data for name, data in written.items() if not name.startswith(("records", "secret"))}
    assert len(shown) == 11 and all(b"WITHOUT a sandbox" in data for data in shown.values())
    for copied in (course / "autograded").rglob("*.ipynb"):
        assert "WITHOUT a sandbox" in copied.read_text()
    assert grade(course).graded_now == 3
    assert not [name for name, data in for_students(course).items() if b"WITHOUT" in data]


def test_without_bubblewrap_nothing_is_graded(course, monkeypatch):
    monkeypatch.setattr(bwrap, "candidates", dict)
    monkeypatch.setattr(bwrap, "executable", bwrap.executable.__wrapped__)
    with pytest.raises(ValueError, match=r"bubblewrap.*not installed.*--unsafe-no-sandbox"):
        grade(course)
    assert not (course / "grades" / TOPIC / "grades.csv").exists()


# --------------------------------------------------------------------------------------------- the gradebook


def test_the_gradebook_has_the_scores_and_keeps_manual_ones(graded):
    course = graded
    with gradebook.opened(course) as book:
        assert [book.find_submission(TOPIC, s).score for s in ("ada", "ben", "eve")] == [TOTAL, 0.0, BUT_IOU]
        assert "Hint" in book.find_comment("iou", TOPIC, TOPIC, "ben").auto_comment
        written = book.find_grade("explain", TOPIC, TOPIC, "ada")
        assert written.needs_manual_grade and written.auto_score is None
        written.manual_score, written.needs_manual_grade = 3.0, False
        book.db.commit()
    grade(course)  # nothing changed: nothing is asked again
    with gradebook.opened(course) as book:
        written = book.find_grade("explain", TOPIC, TOPIC, "ada")
        assert (written.manual_score, written.needs_manual_grade) == (3.0, False)
        assert book.find_submission(TOPIC, "ada").score == TOTAL + 3.0
    notebook = kit.lab_notebook(TOPIC, kit.right_answers(TOPIC) | {"iou": "iou = None"})
    kit.submit(course, "ada", TOPIC, notebook)
    grade(course)
    with gradebook.opened(course) as book:
        written = book.find_grade("explain", TOPIC, TOPIC, "ada")
        assert (written.manual_score, written.needs_manual_grade) == (3.0, True)
        assert book.find_submission(TOPIC, "ada").score == BUT_IOU + 3.0


def test_an_answer_in_words_that_was_not_written_earns_nothing(graded):
    notebook = kit.lab_notebook(TOPIC, kit.right_answers(TOPIC))
    notebook["cells"][-1]["source"] = "*Your answer.*"
    kit.submit(graded, "ada", TOPIC, notebook)
    grade(graded)
    with gradebook.opened(graded) as book:
        written = book.find_grade("explain", TOPIC, TOPIC, "ada")
        assert (written.auto_score, written.needs_manual_grade) == (0.0, False)


def test_the_copy_for_formgrader_is_the_lab_with_the_answers(graded_once):
    course, _ = graded_once
    lab = json.loads((course / "labs" / TOPIC / f"{TOPIC}.ipynb").read_text())
    copied = json.loads((course / "autograded" / "eve" / TOPIC / f"{TOPIC}.ipynb").read_text())
    assert len(copied["cells"]) == len(lab["cells"])
    for ours, theirs in zip(lab["cells"], copied["cells"], strict=True):
        assert ours["metadata"] == theirs["metadata"]
        answer = ours["metadata"]["nbgrader"]["solution"]
        assert answer or ours["source"] == theirs["source"]
    outputs = {c["metadata"]["nbgrader"]["grade_id"]: c.get("outputs") for c in copied["cells"]}
    assert outputs["check_iou"][0]["text"].startswith("0 of 2 points") and outputs["iou"] == []


def test_what_can_not_be_read_any_more_loses_its_scores(graded):
    course = graded
    (course / "submitted" / "ada" / TOPIC / f"{TOPIC}.ipynb").write_text("{")
    graded = grade(course)
    assert graded.records[0].reason and graded.graded_now == 1
    with gradebook.opened(course) as book:
        assert book.find_submission(TOPIC, "ada").score == 0.0
        assert book.find_grade("check_iou", TOPIC, TOPIC, "ada").needs_manual_grade


def test_what_an_instructor_settled_of_an_unreadable_submission_is_not_asked_again(graded):
    folder = graded / "submitted" / "ada" / TOPIC
    (folder / "timestamp.txt").write_text("2026-03-01 12:00:00 UTC")
    grade(graded)
    (folder / f"{TOPIC}.ipynb").write_text("{")
    grade(graded)
    with gradebook.opened(graded) as book:
        assert book.find_submission(TOPIC, "ada").timestamp and book.find_submission(TOPIC, "ada").needs_manual_grade
        for score in book.find_submission_notebook(TOPIC, TOPIC, "ada").grades:
            score.needs_manual_grade = False
        book.db.commit()
    grade(graded)
    with gradebook.opened(graded) as book:
        assert not book.find_submission(TOPIC, "ada").needs_manual_grade


def test_a_time_of_submission_is_kept(graded):
    course = graded
    folder = course / "submitted" / "ada" / TOPIC
    (folder / "timestamp.txt").write_text("2026-03-01 12:00:00 UTC")
    (folder / "submission_secret.txt").write_text("5c0e")
    (course / "submitted" / "ben" / TOPIC / "timestamp.txt").write_text("yesterday")
    grade(course)
    copies = {path.name: path.read_text() for path in (course / "autograded" / "ada" / TOPIC).glob("*.txt")}
    assert copies == {"timestamp.txt": "2026-03-01 12:00:00 UTC", "submission_secret.txt": "5c0e"}
    with gradebook.opened(course) as book:
        assert book.find_submission(TOPIC, "ada").timestamp.isoformat() == "2026-03-01T12:00:00"
        assert book.find_submission(TOPIC, "ben").timestamp is None


# --------------------------------------------------------------------------------------------- the lab's side


def test_a_process_has_the_packages_that_its_program_names_and_the_question_allows():
    iou = find("04_iou.iou")

    def packages(text: str, question=iou) -> tuple[str, ...]:
        return packages_of(question, Program((("iou", text),)))

    assert packages("x = 1") == ("numpy",)
    assert packages("import torch") == ("numpy", "torch") and packages("from scipy import x") == ("numpy", "scipy")
    assert packages("import torch, scipy", replace(iou, forbidden=("torch.nn", "scipy"))) == ("numpy",)


def test_what_the_task_says_to_do_without_is_refused_in_the_words_of_the_check(course, monkeypatch):
    """Torch where the task says NumPy: neither the answer nor what it calls gets it."""
    forbidden = ("sklearn", "torch")
    questions = {name: replace(question, forbidden=forbidden) for name, question in kit.asked(TOPIC).items()}
    monkeypatch.setattr(grading, "of_topic", lambda topic: questions)
    with_torch = "import torch\ndef iou(n):\n    return torch.as_tensor(n).diag() / n.sum()\n"
    hidden = 'def iou(n):\n    return __import__("to" + "rch").as_tensor(n).diag()\n'
    for student, cell in (("ada", with_torch), ("ben", hidden)):
        kit.submit(course, student, TOPIC, kit.right_answers(TOPIC) | {"iou": cell})
    ada, ben, _ = (next(r for r in record.results if r.question == "iou") for record in grade(course).records)
    assert ada.points == ben.points == 0.0 and "the task is to do it without torch" in ada.says
    assert "there is no module torch" in ben.says


def test_an_answer_that_calls_a_wrong_one_gets_the_kits_in_its_place(graded):
    wrong = "def iou(n):\n    return np.zeros(len(n))\n"
    calling = "def mean_iou(n):\n    return np.nanmean(iou(n.sum(axis=0) if n.ndim == 3 else n))\n"
    kit.submit(graded, "ada", TOPIC, kit.right_answers(TOPIC) | {"iou": wrong, "mean_iou": calling})
    ada = grade(graded).records[0]
    assert {result.question: result.points for result in ada.results} == POINTS | {"iou": 0.0}
    assert not any(result.flag for result in ada.results)


OF_MEANS = """
def iou(n):
    found = []
    for c in range(len(n)):
        tp, fn, fp = n[c, c], n[c].sum() - n[c, c], n[:, c].sum() - n[c, c]
        alone = np.array([[[tp, fn], [fp, 0]]])  # the others together have the IoU 0
        found.append(2 * mean_iou(alone) if fn + fp else 1.0 if tp else np.nan)
    return np.array(found)
"""


def test_an_answer_out_of_the_kits_to_a_later_task_is_for_a_person_to_judge(graded):
    """Whoever leaves mean IoU wrong gets the kit's where it is called, and it tells each class's IoU."""
    right, wrong = kit.right_answers(TOPIC) | {"iou": OF_MEANS}, {"mean_iou": "def mean_iou(n):\n    return 0.0\n"}
    kit.submit(graded, "ada", TOPIC, right)
    kit.submit(graded, "ben", TOPIC, right | wrong)
    ada, ben, _ = (next(r for r in record.results if r.question == "iou") for record in grade(graded).records)
    assert ada.right and not ada.flag
    assert ben.right and ben.flag == "uses the kit's mean_iou, a later task, of which its own is wrong"


def table(name: str, otherwise: str) -> str:
    """An answer that knows the public cases, by shape and sum: their numbers would not fit into a notebook."""
    cases = [(case.args[0], np.asarray(case.expected).tolist()) for case in public_cases(of_topic(TOPIC)[name])]
    known = repr({(n.shape, int(n.sum())): expected for n, expected in cases}).replace("nan", "float('nan')")
    line = f"np.array({name}_known[key]) if key in {name}_known else {otherwise}"
    return f"{name}_known = {known}\ndef {name}(n):\n    key = n.shape, int(n.sum())\n    return {line}\n"


def test_a_later_task_that_is_wrong_in_secret_alone_is_for_a_person_to_judge_too(graded):
    """In public both are tables; in secret the table of mean IoU fails, and the kit's takes its place."""
    both = {"iou": OF_MEANS.replace("iou(n)", "by_means(n)", 1) + table("iou", "by_means(n)")}
    both |= {"mean_iou": table("mean_iou", "0.0")}
    kit.submit(graded, "ada", TOPIC, kit.right_answers(TOPIC) | both)
    results = {result.question: result for result in grade(graded).records[0].results}
    assert not results["mean_iou"].right and results["iou"].right
    assert results["iou"].flag == "uses the kit's mean_iou, a later task, of which its own is wrong"


def test_a_task_that_was_another_one_when_the_lab_was_released_is_named_and_not_graded(course):
    path = course / "labs" / TOPIC / f"{TOPIC}.ipynb"
    lab = json.loads(path.read_text())
    lab["metadata"]["labkit"] = {"version": "9.9", "tasks": dict.fromkeys(POINTS, "now")}
    path.write_text(json.dumps(lab))
    answers = kit.lab_notebook(TOPIC, kit.right_answers(TOPIC))
    for student, mark in (
        ("ada", {"version": "9.8", "tasks": dict.fromkeys(POINTS, "now") | {"iou": "before"}}),
        ("ben", {"version": "9.9", "tasks": dict.fromkeys(POINTS, "now")}),
        ("eve", {"version": ["<b>"], "tasks": 7}),
    ):
        answers["metadata"]["labkit"] = mark
        kit.submit(course, student, TOPIC, answers)
    ada, ben, eve = grade(course).records
    assert ben.points == eve.points == TOTAL and ada.points == BUT_IOU and ada.needs_a_look
    (says,) = [result.says for result in ada.results if result.question == "iou"]
    assert says == "this task was another one in the lab that labkit 9.8 released"


def test_a_comparison_that_fails_is_a_wrong_answer_and_not_the_end(course, monkeypatch):
    def broken(question, cases, outputs, altered):
        raise OverflowError("as if an output were too odd to compare")

    monkeypatch.setattr("labgrader.run.run.verdict", broken)
    graded = grade(course)
    assert [record.points for record in graded.records] == [0.0, 0.0, 0.0]
    assert "OverflowError" in graded.records[0].results[0].flag


@pytest.mark.bad_input
def test_wrong_labs_and_folders_are_said(course):
    with pytest.raises(ValueError, match="topic: expected one of"):
        grade_course("04_oiu", course)
    with pytest.raises(ValueError, match="released lab"):
        grade_course("03_gradient", course)
    with pytest.raises(ValueError, match="submissions: expected a folder"):
        grade(course, submissions=course / "nowhere")


def test_the_command_prints_a_table_and_says_by_its_status_what_to_look_at(course):
    runner = CliRunner()
    arguments = ["grade", TOPIC, "--course", str(course), "--seed", SECRET, "--workers", "2"]
    done = runner.invoke(app, arguments)
    lines = done.stdout.splitlines()
    assert done.exit_code == 1 and lines[0].split()[0] == "student"
    right, nothing = (["ada", *POINTS.values(), TOTAL], ["ben", *(0.0 for _ in POINTS), 0.0])
    for line, (student, *points) in zip(lines[1:3], (right, nothing), strict=True):
        name, *shown = line.split()[: len(points) + 1]
        assert name == student and list(map(float, shown)) == points
    assert "ended or crashed" in lines[3] and any("3 students, 3 of them graded now" in line for line in lines[4:])
    for student in ("ben", "eve"):
        shutil.rmtree(course / "submitted" / student)
    done = runner.invoke(app, arguments)
    assert done.exit_code == 0 and "1 student, 0 of them graded now" in done.stdout
