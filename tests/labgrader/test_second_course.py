"""A course on something else, in a folder of its own, is released, checked and graded by the same package."""

import json
import os
import subprocess
import sys
from pathlib import Path

import grading_course as kit
import pytest

ROOT = Path(__file__).parents[2]
TOPIC = "01_adding"
SETTINGS = """
[project]
name = "sums"
version = "3.1"

[tool.labgrader]
questions = "sums.questions"
packages = ["numpy"]
kit = ["sums"]
command = "lab"
metadata = "sums"
"""
QUESTION = '''
import numpy as np

from labgrader.question import Question, wrong


def {name}(values):
    """{says}"""
    return {right}


QUESTION = Question(reference={name}, inputs=lambda rng: (rng.integers(1, 9, 5),), by_hand=((np.array([3, 1, 2]),),))


@wrong("{hint}")
def {wrong_name}(values):
    return {wrong}
'''
TOTAL = {"name": "total", "says": "Add all values.", "right": "values.sum()"}
TOTAL |= {"hint": "You multiply them.", "wrong_name": "product", "wrong": "values.prod()"}
RUNNING = {"name": "running", "says": "Add what came so far, at each place.", "right": "values.cumsum()"}
RUNNING |= {"hint": "Does the last value count?", "wrong_name": "one_late", "wrong": "values.cumsum() - values"}

# What an instructor and a student do, in the course's folder; the last line says which packages that took.
STEPS = """
import json, sys
from pathlib import Path

from sums import check
from labgrader.file_check import check_file
from labgrader.grade_course import grade_course
from labgrader.release.release import release

topic, course = "01_adding", Path(".")
changed = [path.as_posix() for path in release(course)]
import numpy as np
def total(values):
    return values.prod()
def running(values):
    return np.array([values[: i + 1].sum() for i in range(len(values))])
returned = [check(f"{topic}.{answer.__name__}", answer) for answer in (total, running)]
checked = [getattr(got, "__wrapped__", got) is answer for got, answer in zip(returned, (total, running))]
files = [check_file(course / f"submitted/{name}/{topic}/{topic}.ipynb") for name in ("right", "copied")]
graded = grade_course(topic, course, seed="a seed", workers=1, progress=False)
points = {record.student: [result.points for result in record.results] for record in graded.records}
says = {record.student: [result.hint or result.says for result in record.results] for record in graded.records}
packages = sorted({name.partition(".")[0] for name in sys.modules})
print(json.dumps([changed, checked, files, points, says, packages]))
"""


def cells(answers: dict[str, str]) -> dict:
    """The course's lab with answers in its cells."""
    made = [kit.code_cell("import numpy as np\nfrom sums import check", "setup", locked=True)]
    for name, source in answers.items():
        made.append(kit.code_cell(source, name, solution=True))
        check = f'{name} = check("{TOPIC}.{name}", {name})'
        made.append(kit.code_cell(check, f"check_{name}", grade=True, locked=True, points=2))
    return kit.notebook(made)


def answer(name: str, line: str) -> str:
    return f"def {name}(values):\n    ### BEGIN SOLUTION\n    {line}\n    ### END SOLUTION\n"


@pytest.fixture
def course(tmp_path):
    """Two questions, their solution, and three students: one right, one wrong twice, one who calls the course's own."""
    folder = tmp_path / "sums" / "questions" / f"t{TOPIC}"
    folder.mkdir(parents=True)
    (tmp_path / "pyproject.toml").write_text(SETTINGS)
    (folder / "__init__.py").touch()
    (tmp_path / "sums" / "__init__.py").write_text("from labgrader.check import check\n")
    for question in (TOTAL, RUNNING):
        (folder / f"{question['name']}.py").write_text(QUESTION.format(**question))
    right = {question["name"]: answer(question["name"], f"return {question['right']}") for question in (TOTAL, RUNNING)}
    kit.write(tmp_path / "solutions" / TOPIC / f"{TOPIC}.ipynb", cells(right))
    students = {
        "right": {"total": answer("total", "return np.add.reduce(values)")},
        "wrong": {
            "total": answer("total", "return values.prod()"),
            "running": answer("running", "return values.cumsum() - values"),
        },
        "copied": {"total": answer("total", f"from sums.questions.t{TOPIC}.total import total; return total(values)")},
    }
    for student, answers in students.items():
        kit.submit(tmp_path, student, TOPIC, cells(right | answers))
    return tmp_path


def test_it_is_released_checked_and_graded_without_the_course_that_came_with_the_package(course):
    environment = os.environ | {"PYTHONPATH": f"{course}{os.pathsep}{ROOT}"}
    (course / "steps.py").write_text(STEPS)
    done = subprocess.run(
        [sys.executable, "steps.py"], cwd=course, env=environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    changed, checked, files, points, says, packages = json.loads(done.stdout.splitlines()[-1])
    assert f"labs/{TOPIC}/{TOPIC}.ipynb" in changed
    lab = json.loads((course / f"labs/{TOPIC}/{TOPIC}.ipynb").read_text())
    assert lab["metadata"]["sums"]["version"] == "3.1" and "cumsum" not in json.dumps(lab)
    assert checked == [False, True] and "You multiply them." in done.stdout
    assert files == [True, False]
    assert points == {"copied": [0, 2], "right": [2, 2], "wrong": [0, 0]}
    assert says["wrong"] == [TOTAL["hint"], RUNNING["hint"]]
    assert says["copied"][0] == "an answer does not use sums; take what you need from the arguments"
    assert not {"labkit", "labtrain", "labros", "labcourse", "labcli", "data_gen"} & set(packages)


@pytest.mark.parametrize(
    "words, says",
    [
        (("release",), "changed"),
        (("grade", TOPIC), "expected a released lab"),
        pytest.param(("release", "--check"), "not what `lab", marks=pytest.mark.nightly),
        pytest.param(("grades", TOPIC), "expected a released lab", marks=pytest.mark.nightly),
        pytest.param(("new", "question", f"{TOPIC}.mean"), "expected", marks=pytest.mark.nightly),
    ],
    ids=["release", "grade", "check", "grades", "new"],
)
def test_a_command_from_outside_its_folder_takes_its_settings(course, tmp_path_factory, words, says):
    """With the settings of the course that came with the package there would be no topic of that name."""
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "labcli.cli", *words, "--course", str(course)]
    done = subprocess.run(command, cwd=elsewhere, env=environment, capture_output=True, text=True, timeout=300)
    told = done.stdout + done.stderr
    assert says in told and "04_iou" not in told and "Traceback" not in told, told
    if words == ("release",):
        lab = json.loads((course / f"labs/{TOPIC}/{TOPIC}.ipynb").read_text())
        assert lab["metadata"]["sums"]["version"] == "3.1"
