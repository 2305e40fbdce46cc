"""Started in a folder that a stranger filled, such as an unpacked hand-in, no command runs code that lies there."""

import os
import subprocess
import sys
from pathlib import Path

import grading_course as kit
import pytest

ROOT = Path(__file__).parents[2]
LABKIT = Path(sys.executable).with_name("labkit")
TOPIC = "04_iou"
LAB = f"submitted/bob/{TOPIC}/{TOPIC}.ipynb"
NAMES = (*sys.stdlib_module_names, "numpy", "labgrader", "labkit", "torch", "pip", "nbformat", "sitecustomize")
# Of each command what makes it work, as far as a folder with nothing but a graded lab in it lets it.
COMMANDS = {
    "check": ("check", LAB),
    "grade": ("grade", TOPIC, "--workers", "1"),
    "look": ("grade", TOPIC, "--look", "iou-00000000"),
    "grades": ("grades", TOPIC),
    "forget": ("forget", "bob"),
    "release": ("release", "--check"),
    "exam": ("exam", "--out", "exam", "--topics", "04"),
    "new": ("new", "question", f"{TOPIC}.mine"),
    "texts": ("texts", "05_class_weights"),
    "doctor": ("doctor",),
    "train": ("train", "--data", "nowhere", "--out", "out"),
    "evaluate": ("evaluate", "--data", "nowhere"),
    "compare": ("compare", "--help"),
    "perceive": ("perceive", "nowhere.png"),
    "export": ("export", "--model", "nowhere.pt"),
    "demo": ("demo", "--help"),
    "study": ("study", "--help"),
    "node": ("node", "--help"),
    "renumber": ("renumber", "--help"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A course in which a wrong answer is to be graded, with a module under each name that a process may import."""
    folder = tmp_path_factory.mktemp("strangers")
    kit.write_lab(folder, TOPIC)
    kit.submit(folder, "bob", TOPIC, kit.right_answers(TOPIC) | {"iou": "def iou(n):\n    return n.sum(0) / n.sum(1)"})
    marker = folder.with_name("ran")
    for name in NAMES:
        text = f"open({str(marker)!r}, 'a').write('{name} ')\nraise ImportError('not this')"
        (folder / f"{name}.py").write_text(text)
    program = folder.with_name("program")
    program.write_text(f"#!/bin/sh\necho git >> {marker}\n")
    program.chmod(0o755)
    subprocess.run(["git", "init", "-q"], cwd=folder, check=True)
    subprocess.run(["git", "add", "labs"], cwd=folder, check=True)
    subprocess.run(["git", "config", "core.fsmonitor", str(program)], cwd=folder, check=True)
    return folder


def run(folder: Path, *words: str, **variables: str) -> subprocess.CompletedProcess:
    """Type a command in a folder; a course that an earlier one named is not known."""
    environment = {name: value for name, value in os.environ.items() if name not in ("LABGRADER_COURSE", "PYTHONPATH")}
    environment |= {"XDG_CONFIG_HOME": str(folder.with_name("config")), "OMP_NUM_THREADS": "1"} | variables
    return subprocess.run([LABKIT, *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=300)


@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
def test_no_module_beside_the_notebook_is_imported(folder, words):
    done = run(folder, *words)
    marker = folder.with_name("ran")
    assert not marker.exists(), marker.read_text()
    assert "Traceback" not in done.stderr, done.stderr
    assert "submitted" in {path.name for path in folder.iterdir()}
    if words[:2] == ("grade", TOPIC) and "--look" not in words:
        assert "1 student, 1 of them graded now" in done.stdout, done.stderr


def test_each_command_is_tried():
    from labcli.cli import app

    names = {command.name or command.callback.__name__ for command in app.registered_commands}
    assert names | {"new", "node"} == {words[0] for words in COMMANDS.values()}
