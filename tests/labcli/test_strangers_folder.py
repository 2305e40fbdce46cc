"""Started in a folder that a stranger filled, such as an unpacked hand-in, no command runs code that lies there."""

import os
import subprocess
import sys
from pathlib import Path

import grading_course as kit
import pytest
from at_night import others_at_night

from labgrader.course import course, course_around, of_topic
from labgrader.file_check import check_file
from labgrader.support import git

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
    "sheet": ("sheet", "--help"),
    "calibrate": ("calibrate", "--help"),
    "photos": ("photos", "--help"),
    "trust": ("trust", "nowhere"),
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
    absent = f"100644,{'1' * 40},.gitignore"  # which git would fetch, by a program that the folder names
    settings = {
        "core.fsmonitor": program,
        "core.repositoryFormatVersion": 1,
        "extensions.partialClone": "origin",
        "remote.origin.promisor": "true",
        "remote.origin.url": folder,
        "remote.origin.uploadpack": program,
    }
    commands = [("update-index", "--add", "--cacheinfo", absent), ("update-index", "--skip-worktree", ".gitignore")]
    commands += [("config", name, str(value)) for name, value in settings.items()]
    for command in commands:
        subprocess.run(["git", *command], cwd=folder, check=True)
    return folder


def test_git_runs_no_program_of_the_folders(folder):
    """It would: it starts both without what keeps it from that."""
    marker = folder.with_name("ran")
    for words in (("check-ignore", "-q", "grades"), ("ls-files", "-z")):
        git(folder, *words)
        assert not marker.exists(), words
    subprocess.run(["git", "check-ignore", "-q", "grades"], cwd=folder, check=False, capture_output=True)
    subprocess.run(["git", "status"], cwd=folder, check=False, capture_output=True)
    assert len(marker.read_text().splitlines()) >= 2
    marker.unlink()


def run(folder: Path, *words: str, **variables: str) -> subprocess.CompletedProcess:
    """Type a command in a folder; a course that an earlier one named is not known."""
    environment = {name: value for name, value in os.environ.items() if name not in ("LABGRADER_COURSE", "PYTHONPATH")}
    environment |= {"XDG_CONFIG_HOME": str(folder.with_name("config")), "OMP_NUM_THREADS": "1"} | variables
    return subprocess.run([LABKIT, *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=300)


@pytest.mark.parametrize("name", others_at_night(COMMANDS, by_day=("check", "grade", "release", "perceive", "new")))
def test_no_module_beside_the_notebook_is_imported(folder, name):
    words = COMMANDS[name]
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


# ------------------------------------------------------------------------------------ a course of the stranger's

SETTINGS = """
[tool.labgrader]
questions = "evilcourse.questions"
packages = ["numpy"]
command = "evil"
"""


@pytest.fixture
def strangers(tmp_path, monkeypatch):
    """A folder with a lab, which says that it is a course; its package writes a file where it is imported."""
    monkeypatch.setattr(sys, "path", list(sys.path))  # to which the folder of a course is added
    folder = tmp_path / "bobs zip"
    kit.write_lab(folder, TOPIC)
    kit.submit(folder, "bob", TOPIC, kit.right_answers(TOPIC))
    kit.write(folder / f"solutions/{TOPIC}/{TOPIC}.ipynb", kit.lab_notebook(TOPIC))
    (folder / "pyproject.toml").write_text(SETTINGS)
    (folder / "evilcourse/questions").mkdir(parents=True)
    (folder / "evilcourse/__init__.py").write_text(f"open({str(folder.with_name('ran'))!r}, 'w')")
    (folder / "evilcourse/questions/__init__.py").touch()
    return folder


# What needs no course works; what needs one says how to trust this one.
REFUSED = ("check", "grade", "look", "grades", "release", "exam", "new", "texts")


@pytest.fixture(autouse=True)
def nothing_trusted(monkeypatch, tmp_path):
    """The user's own list of trusted folders is another one."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))


def has_run(strangers: Path) -> bool:
    """Whether the stranger's package was imported; from now on it was not."""
    for name in ("evilcourse", "evilcourse.questions"):
        sys.modules.pop(name, None)
    return strangers.with_name("ran").exists()


@pytest.mark.parametrize("name", [*REFUSED, "forget"])
def test_a_course_that_nobody_trusted_is_refused_in_words_and_not_imported(
    strangers, name, labkit, monkeypatch, capsys
):
    for place in (strangers, strangers / "labs"):
        monkeypatch.chdir(place)
        status = labkit(*[f"{strangers}/{LAB}" if word == LAB else word for word in COMMANDS[name]])
        told = capsys.readouterr().err
        assert not has_run(strangers)
        if name in REFUSED and (name, place.name) != ("release", "labs"):  # in which there is nothing to release
            assert status == 2 and f"type `labkit trust '{strangers}'`, once" in told, told


def test_a_check_in_a_notebook_imports_nothing_of_it_either(strangers, monkeypatch):
    monkeypatch.chdir(strangers)
    monkeypatch.syspath_prepend(strangers)  # as a kernel has it
    with pytest.raises(ValueError, match=r"course: .*labkit trust"):
        check_file(LAB)
    assert not has_run(strangers)


def test_a_folder_that_was_named_names_nothing_above_it(strangers, tmp_path, labkit, monkeypatch, capsys):
    """A course of the installed one's labs, in a stranger's folder."""
    kit.write_lab(strangers / "plain", TOPIC)
    monkeypatch.chdir(tmp_path)
    assert labkit("grades", TOPIC, "--course", strangers / "plain") == 2
    assert "expected a lab with grades" in capsys.readouterr().err and not has_run(strangers)


@pytest.mark.parametrize("how", ["trust", "--course", "LABGRADER_COURSE"])
def test_a_course_that_was_trusted_or_named_is_taken(strangers, how, labkit, monkeypatch, capsys):
    monkeypatch.chdir(strangers)
    if how == "trust":
        assert labkit("trust") == 0 and labkit("trust") == 0
        assert "is trusted from now on" in capsys.readouterr().out
        assert (strangers.with_name("config") / "labgrader/trusted").read_text() == f"{strangers}\n"
    if how == "LABGRADER_COURSE":
        monkeypatch.setenv(how, str(strangers))
    assert labkit("grades", TOPIC, *(("--course", ".") if how == "--course" else ())) == 2
    assert "topic: expected one of , got" in capsys.readouterr().err and has_run(strangers)


def test_what_names_no_course_is_said(strangers, labkit, monkeypatch, capsys):
    monkeypatch.setenv("LABGRADER_COURSE", str(strangers / "labs"))
    assert labkit("grades", TOPIC) == 2
    assert "LABGRADER_COURSE: expected a folder that has a pyproject.toml" in capsys.readouterr().err


def test_a_copy_of_the_installed_course_is_that_course(strangers, labkit, monkeypatch, capsys):
    """Such as a bundle that was unpacked beside the one that is installed: what its files hold is not imported."""
    monkeypatch.chdir(strangers)
    (strangers / "pyproject.toml").write_text((ROOT / "pyproject.toml").read_text())
    assert course() == course_around(str(ROOT))
    assert labkit("check", LAB) == 0 and "iou is right" in capsys.readouterr().out
    with pytest.raises(ValueError, match=f"this Python has the course of {ROOT}, not that of {strangers}: start"):
        of_topic("11_later")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="not run: needs root, to be two accounts")
def test_another_accounts_file_in_a_folder_above_changes_nothing(strangers, monkeypatch):
    """Anybody may put one into /tmp; who works below it goes on with the installed course."""
    monkeypatch.chdir(strangers / "labs")
    os.chown(strangers / "pyproject.toml", 61001, 61001)
    assert course() == course_around(str(ROOT))


ODD = {
    "tool": "tool = 3",
    "labgrader": "[tool]\nlabgrader = 3",
    "deep": "a = " + "[" * 5000,
    "bytes": "\udcff",
    "large": SETTINGS + "#" * 2**21,
}


@pytest.mark.parametrize("text", ODD.values(), ids=ODD)
def test_odd_settings_are_none(strangers, text, monkeypatch):
    monkeypatch.chdir(strangers)
    (strangers / "pyproject.toml").write_text(text, errors="surrogateescape")
    assert course() == course_around(str(ROOT))


def test_a_pipe_in_the_place_of_settings_stops_nobody(strangers, monkeypatch):
    monkeypatch.chdir(strangers)
    (strangers / "pyproject.toml").unlink()
    os.mkfifo(strangers / "pyproject.toml")
    assert course() == course_around(str(ROOT))


def test_odd_questions_are_refused_in_words(strangers, monkeypatch):
    monkeypatch.chdir(strangers)
    (strangers / "pyproject.toml").write_text("[tool.labgrader]\nquestions = [3]")
    with pytest.raises(ValueError, match="once; else work outside"):
        course()
