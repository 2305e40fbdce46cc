"""The autograder for Gradescope gives the grades of `labkit grade`, in a bare Debian that stands for their image."""

import importlib.machinery
import importlib.util
import json
import os
import stat
import subprocess
import sysconfig
import zipfile
from pathlib import Path

import grading_course as kit
import pytest

from labgrader.grade.batch import Record
from labgrader.grade.changes import change_of
from labgrader.grade.grade import Result
from labgrader.grade_course import grade_course
from labgrader.report import gradescope
from labgrader.sandbox import bwrap

ROOT = Path(__file__).parents[3]
TOPIC = "04_iou"
POINTS = {name: question.points for name, question in kit.asked(TOPIC).items()}
# Right only if it can do what it must not: read the autograder or other packages, start a process, reach the network.
LOOKS_AROUND = """import os
import socket
import numpy as np

def iou(n):
    reached = 0
    for call, *arguments in (
        (os.listdir, "/autograder"),
        (open, "/autograder/source/secret_seed"),
        (open, "/autograder/results/results.json", "w"),
        (os.fork,),
        (os.setuid, 0),
        (os.kill, os.getppid(), 0),
        (socket.socket,),
        (__import__, "packaging"),
        (__import__, "labkit"),
    ):
        try:
            call(*arguments)
            reached += 1
        except (OSError, ImportError):
            pass
    tp = np.diagonal(n)
    union = n.sum(axis=0) + n.sum(axis=1) - tp
    with np.errstate(invalid="ignore"):
        return tp / union if reached else n
"""
# What a container's runtime leaves root; without CAP_SYS_ADMIN there is no bubblewrap.
CAPABILITIES = ("SETUID", "SETGID", "KILL", "CHOWN", "DAC_OVERRIDE", "FOWNER", "FSETID", "SYS_CHROOT")
PYTHON = '#!/bin/sh\nPYTHONPATH=/autograder/source:/site exec /usr/bin/python3 "$@"\n'


def in_their_image(place: Path) -> None:
    """Run run_autograder as root in a bare Debian, where PLACE is /autograder and setup.sh was run."""
    loader = importlib.machinery.SourceFileLoader("fresh", str(ROOT / "tests/fresh/run"))
    fresh = importlib.util.module_from_spec(importlib.util.spec_from_loader("fresh", loader))
    loader.exec_module(fresh)
    debian = fresh.bare_debian("bookworm")
    (place / "python").write_text(PYTHON)
    (place / "python").chmod(0o755)
    command = [bwrap.executable(), "--unshare-pid", "--unshare-net", "--die-with-parent", "--cap-drop", "ALL"]
    for name in CAPABILITIES:
        command += ["--cap-add", f"CAP_{name}"]
    for name in ("bin", "sbin", "lib", "lib64"):
        command += ["--symlink", f"usr/{name}", f"/{name}"]
    command += ["--ro-bind", debian / "usr", "/usr", "--ro-bind", debian / "etc", "/etc"]
    command += [
        "--perms",
        "1777",
        "--tmpfs",
        "/tmp",
        "--dev",
        "/dev",
        "--proc",
        "/proc",
        "--bind",
        place,
        "/autograder",
    ]
    command += ["--ro-bind", sysconfig.get_path("purelib"), "/site", "--tmpfs", "/usr/local"]
    command += [
        "--ro-bind",
        place / "python",
        "/usr/local/grader/bin/python",
        "--clearenv",
        "/autograder/source/run_autograder",
    ]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.debian("debootstrap")
@pytest.mark.timeout(900)
@pytest.mark.skipif(
    os.getuid() != 0 or sysconfig.get_python_version() != "3.11", reason="root can enter it, with bookworm's Python"
)
def test_grades_are_those_of_labkit_grade(tmp_path):
    course, place = tmp_path / "course", tmp_path / "autograder"
    kit.write_lab(course, TOPIC)
    right = kit.right_answers(TOPIC)
    answers = {
        "right": right,
        "wrong": right | {"iou": "def iou(n):\n    return n.sum(axis=0) / n.sum(axis=0)\n"},
        "hostile": right | {"iou": LOOKS_AROUND},
    }
    for student, given in answers.items():
        kit.submit(course, student, TOPIC, given)
    grade_course(TOPIC, course, progress=False, change=change_of(TOPIC, "short", points="mean_iou=1"))
    with zipfile.ZipFile(gradescope.write_autograder(course, TOPIC)) as archive:
        modes = {info.filename: stat.S_IMODE(info.external_attr >> 16) for info in archive.infolist()}
        archive.extractall(place / "source")
    assert "labcourse/questions/t04_iou/iou.de.toml" in modes
    assert modes["secret_seed"] == 0o600 and modes["setup.sh"] == modes["run_autograder"] == 0o700
    (place / "source/run_autograder").chmod(0o700)
    (place / "submission").mkdir()
    (place / "results").mkdir()
    total = sum(POINTS.values()) - POINTS["mean_iou"] + 1
    for student in answers:
        notebook = (course / f"submitted/{student}/{TOPIC}/{TOPIC}.ipynb").read_bytes()
        (place / f"submission/{TOPIC}.ipynb").write_bytes(notebook)
        in_their_image(place)
        results = json.loads((place / "results/results.json").read_text())
        assert results["score"] == total - (0 if student == "right" else POINTS["iou"])
        if student != "hostile":  # what it is told depends on what is there
            assert results == json.loads((course / f"grades/{TOPIC}/results/{student}/results.json").read_text())


@pytest.mark.bad_input
def test_what_cannot_be_graded_says_why(tmp_path):
    kit.write_lab(tmp_path, TOPIC)
    with pytest.raises(ValueError, match="expected a round of grading"):
        gradescope.write_autograder(tmp_path, TOPIC)
    kit.write_lab(tmp_path / "source", TOPIC)
    (tmp_path / "submission").mkdir()
    for name, says in ((None, "it is empty"), ("report.pdf", "it holds report.pdf"), ("04_iou.ipynb", "it is empty")):
        if name is not None:
            (tmp_path / "submission" / name).touch()
        gradescope.main(TOPIC, str(tmp_path))
        results = json.loads((tmp_path / "results/results.json").read_text())
        assert results["score"] == 0.0 and says in results["output"]


COURSE = f"""
[[deadline]]
lab = "{TOPIC}"
due = 2026-10-05T12:00:00Z
penalty_per_day = 10

[[extension]]
lab = "{TOPIC}"
student = "ada@x.org"
due = 2026-10-12T12:00:00Z
reason = "ill"
"""


@pytest.mark.parametrize(
    "user, more, files, share, says",
    [
        ({"id": 7, "email": "ben@x.org"}, "", ("04_iou.ipynb",), 0.9, "Handed in 1 day late, 10 % less."),
        ({"id": 7, "email": "ada@x.org"}, "", ("04_iou.ipynb",), 1.0, ""),
        ({"id": 7, "email": "ben@x.org"}, "[[course]]\nlate_days = 2\n", ("04_iou.ipynb",), 1.0, ""),
        (
            {"id": 7, "email": "ada@x.org"},
            "",
            ("04_iou.ipynb", "x/04_iou (2).ipynb"),
            1.0,
            "Of its notebooks 04_iou.ipynb was graded, not 04_iou (2).ipynb.",
        ),
    ],
)
def test_deadline_extension_and_a_second_notebook_count_there_too(
    tmp_path, monkeypatch, user, more, files, share, says
):
    source = tmp_path / "source"
    kit.write_lab(source, TOPIC)
    (source / "secret_seed").write_text("secret")
    (source / "course.toml").write_text(COURSE + more)
    for i, name in enumerate(files):
        kit.write(tmp_path / "submission" / name, kit.lab_notebook(TOPIC, {"iou": f"def iou(n):\n    return {i}"}))
    told = {"created_at": "2026-10-06T04:00:00-07:00", "users": [user]}
    (tmp_path / "submission_metadata.json").write_text(json.dumps(told))
    results = tuple(Result(name, worth, worth, "right", right=True) for name, worth in POINTS.items())
    record = Record("student-7", "", results, True, "digest", "key")
    monkeypatch.setattr(gradescope, "grade_batch", lambda batch, progress: ([record], 1))
    gradescope.main(TOPIC, str(tmp_path))
    written = json.loads((tmp_path / "results/results.json").read_text())
    assert written["score"] == pytest.approx(share * sum(POINTS.values())) and written["output"].startswith(says)


def test_whoever_hands_in_again_has_the_same_name(tmp_path):
    """Of a group, in whatever order Gradescope names its members; a container that says nothing has one for all."""
    metadata = tmp_path / "submission_metadata.json"
    assert gradescope.student_of(gradescope.read_metadata(metadata)) == "student"
    for users in ([{"id": 7}, {"id": 12}], [{"id": 12, "name": "Ada"}, {"id": 7}]):
        metadata.write_text(json.dumps({"id": len(users), "users": users}))
        assert gradescope.student_of(gradescope.read_metadata(metadata)) == "student-12-7"
