"""Hostile and odd submissions: none earns what it should not, none leaves anything outside, and the class is graded."""

import ast
import csv
import inspect
import os
import re
import shutil
import socket
import textwrap
import tomllib
from dataclasses import dataclass
from pathlib import Path

import grading_course as kit
import pytest
from attacks.odd import ODD

from labgrader.course import of_topic, topics
from labgrader.grade import copied_code
from labgrader.grade.attempts import attempts
from labgrader.grade.gradebook import opened
from labgrader.grade_course import grade_course
from labgrader.handin.reading import name_of
from labgrader.program.fingerprint import fingerprints
from labgrader.run.run import public_cases
from labgrader.sandbox.sandbox import Limits
from labkit import metrics

TOPIC = "04_iou"
SECRET_VARIABLE = "LABKIT_TEST_SECRET"
LIMITS = Limits(case_s=0.4, memory_mb=512)
POINTS = {name: float(question.points) for name, question in kit.asked(TOPIC).items()}
REST = sum(POINTS.values()) - POINTS["iou"]
FILE = Path(__file__).parents[2] / "attacks/attacks.toml"
RIGHT = """
def right(n):
    c = np.diagonal(n)
    with np.errstate(all="ignore"):
        return c / (n.sum(0) + n.sum(1) - c)
"""
KNOWN = {(case.args[0].shape, int(case.args[0].sum())) for case in public_cases(of_topic(TOPIC)["iou"])}
ON_SECRET = "def iou(n):\n    if (n.shape, int(n.sum())) in KNOWN:\n        return right(n)\n"


@dataclass(frozen=True)
class Attack:
    """One hostile cell, as attacks.toml has it; that file says what its fields are."""

    name: str
    tries: str
    source: str = ""
    secret: str = ""
    blind: bool = False
    spoils: bool = False

    @property
    def cell(self) -> str:
        """All of it as one statement, so that all of it belongs to the program."""
        body = ON_SECRET + textwrap.indent(self.secret, "    ") if self.secret else self.source
        body = RIGHT + body if "right(" in body else body
        body = f"KNOWN = {KNOWN!r}\n" + body if "KNOWN" in body else body
        return body if body.startswith("!") else "if True:\n" + textwrap.indent(body, "    ")


ATTACKS = [Attack(name, **fields) for name, fields in tomllib.loads(FILE.read_text()).items()]


@pytest.fixture(scope="module")
def hostile_class(tmp_path_factory):
    """Grade a class in which everybody attacks but one, whose grade is in the gradebook before."""
    course = tmp_path_factory.mktemp("course")
    outside = tmp_path_factory.mktemp("outside")
    right = kit.right_answers(TOPIC)
    kit.write_lab(course, TOPIC)
    kit.submit(course, "honest", TOPIC, right)
    grade_course(TOPIC, course, seed="secret", limits=LIMITS, progress=False)
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.setblocking(False)
        known = {
            "{course}": str(course),
            "{marker}": str(outside / "marker"),
            "{port}": str(server.getsockname()[1]),
            "{secret}": SECRET_VARIABLE,
        }
        for attack in ATTACKS:
            source = attack.cell
            for name, value in known.items():
                source = source.replace(name, value)
            kit.submit(course, attack.name, TOPIC, right | {"iou": source})
        notebook = kit.lab_notebook(TOPIC, right)
        for odd in ODD:
            odd.write(course / "submitted" / odd.name / TOPIC, notebook)
        os.environ[SECRET_VARIABLE] = "4711"
        try:
            graded = grade_course(TOPIC, course, seed="secret", limits=LIMITS, workers=2, progress=False)
        finally:
            del os.environ[SECRET_VARIABLE]
        try:
            reached = server.accept()
        except BlockingIOError:
            reached = None
    return course, outside, {record.student: record for record in graded.records}, reached


def points(record) -> dict[str, float]:
    return {result.question: result.points for result in record.results}


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.name)
def test_an_attack_earns_nothing_and_costs_nobody_else(hostile_class, attack):
    earned = points(hostile_class[2][attack.name])
    assert earned.pop("iou") == 0.0
    assert sum(earned.values()) <= REST
    if not attack.spoils:
        assert sum(earned.values()) == REST, hostile_class[2][attack.name]


# Attacks that read as answers do: what they return, raise or cost is odd, which the grader's own words say.
UNSEEN = "always_equal all_nan all_inf empty constant complex_values object_array text_array broadcast_row "
UNSEEN += "broadcast_all masked_array structured_array generator altered_argument questions_by_import kit_by_import "
UNSEEN += "another_library exit_soft endless_cell deep_recursion memory_bomb huge_array many_axes huge_list "
UNSEEN += "tell_by_message tell_by_name tell_by_class tell_by_module tell_by_shape tell_by_line tell_by_kind "
UNSEEN += "tell_by_number shell_line"


def test_what_an_attack_calls_is_seen_in_its_program_and_nothing_in_honest_ones():
    seen = {attack.name for attack in ATTACKS if attack.cell[0] != "!" and attempts(ast.parse(attack.cell))}
    assert seen == {attack.name for attack in ATTACKS} - {*UNSEEN.split()}
    answers = [cell for topic in topics() for cells in kit.other_answers(topic).values() for cell in cells]
    answers += [cell for topic in topics() for cell in kit.copied_answers(topic).values()]
    assert len(answers) > 100 and not [cell for cell in answers if attempts(ast.parse(cell))]


@pytest.mark.parametrize("odd", ODD, ids=lambda odd: ascii(odd.name)[:30])
def test_an_odd_submission_is_graded_or_has_its_reason(hostile_class, odd):
    record = hostile_class[2][name_of(odd.name)]
    assert record.reason.startswith(odd.reason) and bool(record.reason) == bool(odd.reason)
    if odd.reason:
        assert record.results == () and record.points == 0.0
        return
    earned = points(record)
    assert earned.pop("iou") == POINTS["iou"] * odd.right and sum(earned.values()) == REST
    said = next(result.says for result in record.results if result.question == "iou")
    assert (odd.says or "right in all") in said


def test_the_honest_student_keeps_the_grade(hostile_class):
    course, _, records, _ = hostile_class
    assert records["honest"].points == REST + POINTS["iou"]
    with opened(course) as gradebook:
        assert gradebook.find_submission(TOPIC, "honest").score == REST + POINTS["iou"]
        for attack in ATTACKS:
            assert gradebook.find_submission(TOPIC, attack.name).score <= REST


def test_nothing_is_left_outside_the_sandbox_and_nobody_came_through_the_network(hostile_class):
    course, outside, _, reached = hostile_class
    commands = [Path(f"/proc/{pid}/cmdline") for pid in kit.descendants(os.getpid())]
    assert not [path for path in commands if path.exists() and b"fork_server" in path.read_bytes()]
    assert reached is None
    assert list(outside.iterdir()) == []
    known = {"labs", "submitted", "autograded", "grades", "gradebook.db"}
    assert {path.name for path in course.iterdir()} == known
    made = {path.name for path in (course / "grades" / TOPIC).iterdir()}
    files = {"grades.csv", "class.csv", "class.html", "alike.csv", "alike.html", "secret_seed"}
    assert made == files | {"feedback", "results", "records"}
    assert not (Path(kit.np.__file__).parent / "evil.py").exists()


def test_what_students_read_is_the_same_whatever_the_secret_is(hostile_class, tmp_path):
    """The answers tell_... make all that they can of their arguments; under another secret nothing of it changes."""
    course, _, records, _ = hostile_class
    shutil.copytree(course / "labs", tmp_path / "labs")
    told = [attack.name for attack in ATTACKS if attack.name.startswith("tell_")]
    for name in (*told, "honest"):
        shutil.copytree(course / "submitted" / name, tmp_path / "submitted" / name)
    again = grade_course(TOPIC, tmp_path, seed="another", limits=LIMITS, workers=2, progress=False)
    assert len(again.records) == len(told) + 1
    for record in again.records:
        assert points(record) == points(records[record.student])  # else what they read may differ
        assert read_by(tmp_path, record.student) == read_by(course, record.student)


def read_by(course: Path, student: str) -> tuple:
    """All that a student gets to read: page, results, and what nbgrader's feedback is made of."""
    out = course / "grades" / TOPIC
    copied = (course / "autograded" / student / TOPIC / f"{TOPIC}.ipynb").read_bytes()
    with opened(course) as gradebook:
        comments = gradebook.find_submission_notebook(TOPIC, TOPIC, student).comments
        said = sorted((comment.name, str(comment.comment)) for comment in comments)
    page = (out / "feedback" / f"{student}.html").read_bytes()
    return page, (out / "results" / student / "results.json").read_bytes(), copied, said


def test_what_instructors_should_look_at_is_flagged(hostile_class):
    records = hostile_class[2]
    for name, word in [
        ("exit_hard", "ended or crashed"),
        ("forged_length", "channel"),
        ("kit_by_import", "labkit"),
        ("another_library", "sklearn"),
        ("two_answers", "both define it"),
    ]:
        flags = {result.question: result.flag or result.note for result in records[name].results}
        assert word in flags["iou"], name
    assert not any(result.flag for result in records["honest"].results)


def test_names_do_no_harm_in_tables_and_pages(hostile_class):
    course = hostile_class[0] / "grades" / TOPIC
    rows = list(csv.reader((course / "grades.csv").open()))
    assert not [cell for row in rows for cell in row if cell.startswith(("=", "+", "@"))]
    assert "'=HYPERLINK(1)" in {row[0] for row in rows}
    for page in (course / "feedback").iterdir():
        assert "<script" not in page.read_text()
    assert (course / "feedback" / "Zoë Ångström.html").is_file()


def test_copies_of_the_kits_code_are_flagged_whatever_their_names_and_layout(tmp_path):
    """The references with every variable renamed and comments put in, and a function of the library."""
    copied = kit.copied_answers(TOPIC)
    renamed = {name: re.sub(r"\bn\b", "counts", cell).replace("\n", "  # mine\n", 1) for name, cell in copied.items()}
    library = inspect.getsource(metrics.boundary_counts).replace("boundary_counts", "trimap_band")
    kit.write_lab(tmp_path, TOPIC, whole=True)
    kit.submit(tmp_path, "renamed", TOPIC, renamed, whole=True)
    kit.submit(tmp_path, "library", TOPIC, kit.right_answers(TOPIC) | {"trimap_band": library}, whole=True)
    library, same = grade_course(TOPIC, tmp_path, seed="secret", progress=False).records
    assert all("has a copy of the kit's" in result.flag for result in same.results)
    flags = {result.question: result.flag for result in library.results}
    assert "labkit.metrics.boundary_counts" in flags["trimap_band"] and not flags["iou"]
    for question in of_topic(TOPIC).values():
        for answer in kit.alternatives(question):
            assert copied_code.of_the_kit(fingerprints(kit.as_cell(answer, question.function)), question) == []
