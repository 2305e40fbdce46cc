"""Grading lab 04: `labkit grade` beside `nbgrader autograde` on the same submissions, and what a big class costs.

Both take one submission at a time on this machine, in turns; nbgrader's check cells run with LABKIT_STRICT=1, so that
a wrong answer stops them. The verdicts are compared on honest work. Memory is what the grader's own process holds.
"""

import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from bench.measure import in_turns, resident_mb, table
from labgrader.course import of_topic, topics
from labgrader.grade import grade
from labgrader.grade.gradebook import opened
from labgrader.grade_course import grade_course
from labgrader.handin import reading
from labgrader.program.cell import Cell
from labgrader.sandbox import sandbox

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import grading_course as kit  # noqa: E402

TOPIC = "04_iou"
ROUNDS = 5
CLASS = 100
MANY = 1000
HONEST = ("ada", "ben")
ENVIRONMENT = os.environ | {
    "LABKIT_STRICT": "1",
    "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
}


def main() -> str:
    """Measure all of it (some minutes)."""
    with tempfile.TemporaryDirectory() as folder:
        return "\n\n".join(
            [beside_nbgrader(Path(folder) / "course"), classes(Path(folder)), many(Path(folder) / "many")]
        )


def new_course(course: Path) -> Path:
    """A course with lab 04 as it is released, and the two honest sample submissions."""
    for name in (f"solutions/{TOPIC}", f"labs/{TOPIC}"):
        shutil.copytree(ROOT / name, course / name)
    for student in HONEST:
        shutil.copytree(ROOT / "tests/data/submitted" / student, course / "submitted" / student)
    shutil.copy(ROOT / "nbgrader_config.py", course)
    return course


def nbgrader(course: Path, *arguments: str) -> None:
    """Run nbgrader."""
    command = [sys.executable, "-m", "nbgrader", *arguments]
    subprocess.run(command, cwd=course, env=ENVIRONMENT, check=True, capture_output=True)


def beside_nbgrader(course: Path) -> str:
    """Both graders on the same two submissions, again and again, in turns; start-up of the command included in both."""
    new_course(course)
    ours, theirs = course / "ours", course / "theirs"
    for copy in (ours, theirs):
        new_course(copy)
    nbgrader(theirs, "generate_assignment", TOPIC, "--force")
    command = [sys.executable, "-m", "labcli.cli", "grade", TOPIC, "--workers", "1", "--force", "--seed", "s"]
    ways = {
        "nbgrader autograde": lambda: nbgrader(theirs, "autograde", TOPIC, "--force"),
        "labkit grade": lambda: subprocess.run(command, cwd=ours, capture_output=True),
        "labkit grade, without starting the command": lambda: grade_course(
            TOPIC, ours, seed="s", force=True, progress=False
        ),
    }
    seconds = {name: np.median(ms) / 1000 / len(HONEST) for name, ms in in_turns(ways, ROUNDS).items()}
    scores = []
    for copy in (ours, theirs):
        with opened(copy) as book:
            names = sorted(c.name for c in book.find_notebook(TOPIC, TOPIC).grade_cells if c.name.startswith("check_"))
            scores.append([book.find_grade(name, TOPIC, TOPIC, s).auto_score for s in HONEST for name in names])
    agree = sum(a == b for a, b in zip(*scores, strict=True))
    base = seconds["nbgrader autograde"]
    rows = ((name, f"{s:.2f}", f"{60 / s:.0f}", f"{base / s:.1f}") for name, s in seconds.items())
    header = "grader, one submission at a time | median s per submission | submissions per minute | times nbgrader's"
    return f"{table(header, rows)}\n\nSame verdicts on honest work: {agree} of {len(scores[0])}."


def classes(folder: Path) -> str:
    """A class of 100 a lab, as tests/grading_course.py builds them, one worker: seconds and wrong verdicts."""
    rows = []
    for topic in filter(of_topic, topics()):  # those that have questions
        course = folder / topic
        kit.write_lab(course, topic)
        lab = reading.read_lab(course, topic)
        students = list(kit.synthetic_class(topic).values())
        seconds, wrong, torch = [], 0, 0
        for i in range(CLASS):
            cells, right = students[i % len(students)]
            torch += any("torch" in cell for cell in cells.values())
            start = time.perf_counter()
            submission = reading.Submission(
                f"s{i}", tuple(Cell(text, name) for name, text in cells.items()), cells, "", str(i)
            )
            results = grade.Grading(lab, submission).in_secret(f"secret {i // len(students)}")
            seconds.append(time.perf_counter() - start)
            wrong += sum((r.points == r.max_points) != right[r.question] for r in results)
        rows.append((topic, f"{statistics.median(seconds):.2f}", f"{sum(seconds):.0f}", torch, wrong))
    return table("lab, 100 students | median s | all, s | of them with torch | grades not as constructed", rows)


def many(course: Path) -> str:
    """The memory of the grader over 1,000 submissions of lab 04."""
    new_course(course)
    shutil.rmtree(course / "submitted" / "ben")
    lab = reading.read_lab(course, TOPIC)
    place = course / "submitted/ada"
    sandbox.probe(("numpy",), sandbox.Limits())
    sizes, seconds = {}, []
    for i in range(1, MANY + 1):
        start = time.perf_counter()
        grade.Grading(lab, reading.read_submission(place, lab)).in_secret("secret")
        seconds.append(time.perf_counter() - start)
        if i in (100, MANY // 2, MANY):
            sizes[i] = resident_mb()
    row = ("one worker", f"{statistics.median(seconds):.3f}", *(f"{size:.1f}" for size in sizes.values()))
    return table(f"lab 04 | median s per submission | {' | '.join(f'MB after {i}' for i in sizes)}", [row])
