"""labkit doctor: what is whole is called whole, and each thing that can be broken is found when it is broken."""

import os
import shutil
import subprocess
import sys
from types import SimpleNamespace

import pytest

from labcli import doctor
from labcli.doctor import NOTE, OK, WRONG
from labgrader import packages
from labkit.support import compiled


def write_package(folder, name: str, version: str, *requires: str):
    """Install a package that is nothing but its metadata."""
    info = folder / f"{name}-{version}.dist-info"
    info.mkdir()
    lines = ["Metadata-Version: 2.4", f"Name: {name}", f"Version: {version}"]
    (info / "METADATA").write_text("\n".join(lines + [f"Requires-Dist: {r}" for r in requires]) + "\n")


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """toy -> toy_a[fast] -> toy_b, toy (a cycle) and, for [fast], toy_c; toy's extra "draw" -> toy_d, not installed."""
    write_package(tmp_path, "toy", "1.0", "toy_a[fast]", "toy-d>=2; extra == 'draw'", "toy-old; python_version < '3'")
    write_package(tmp_path, "toy_a", "1.1", "toy.b", "toy-c; extra == 'fast'", "toy-other; extra == 'slow'", "toy")
    write_package(tmp_path, "toy_b", "2.13.0+cpu")
    write_package(tmp_path, "toy_c", "1.3rc1")
    monkeypatch.syspath_prepend(tmp_path)


def test_requirements_follow_dependencies_markers_and_extras(toy):
    assert packages.requirements("toy") == {"toy-a": "1.1", "toy-b": "2.13.0+cpu", "toy-c": "1.3rc1"}
    assert packages.requirements("toy", "draw")["toy-d"] is None
    with pytest.raises(ModuleNotFoundError, match="no-such-package"):
        packages.requirements("no-such-package")


def test_a_missing_package_is_wrong_unless_only_an_extra_needs_it(tmp_path, monkeypatch):
    needed = doctor.complete("packages", {"numpy": "2.4", "torch": None})
    assert needed.state == WRONG and "missing: torch" in needed.found and "constraints.txt" in needed.mend
    optional = doctor.complete("[stacks]", {"onnx": None}, "stacks")
    assert optional.state == NOTE and "labkit export" in optional.found and ".[stacks]" in optional.mend
    monkeypatch.setattr(doctor, "CLONE", tmp_path / "constraints.txt")  # installed from a wheel: there is no clone
    assert doctor.complete("[stacks]", {"onnx": None}, "stacks").mend == f"python -m pip install '{doctor.KIT}[stacks]'"


def test_this_environment_is_whole_and_a_version_that_does_not_fit_is_named(toy, tmp_path, monkeypatch):
    extras = set(packages.metadata.metadata(doctor.KIT).get_all("Provides-Extra"))
    assert doctor.USERS.keys() == extras - {"bench", "hub", "models", "site"}
    findings = {finding.name: finding for finding in doctor.check_packages()}
    assert findings["packages"].state == findings["[test]"].state == findings["versions"].state == OK, findings
    write_package(tmp_path, "toy_d", "1.0", "toy_b<2")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    *_, versions = doctor.check_packages()
    assert versions.state == NOTE and "has requirement toy_b<2, but you have toy-b 2.13.0+cpu" in versions.found


@pytest.mark.parametrize("name, numpy, words", [("pybullet", 1, "with"), ("pybullet-arm64", 0, "without")])
def test_pybullet_is_found_whichever_distribution_it_is_of(monkeypatch, name, numpy, words):
    assert doctor.check_pybullet()[0].found.startswith("pybullet")
    monkeypatch.setattr(doctor, "requirements", lambda package: {"numpy": "2.4", name: "3.2.8"})
    monkeypatch.setattr("pybullet.isNumpyEnabled", lambda: numpy)
    assert doctor.check_pybullet() == [doctor.Finding("PyBullet", OK, f"{name} 3.2.8, {words} numpy")]


def test_the_render_check_passes_here_and_sees_a_shift_of_half_a_pixel(monkeypatch):
    assert doctor.check_render()[0].state == OK
    from labkit.sim import world

    measured = world.intrinsics

    def shifted(*arguments):
        K = measured(*arguments)
        K[1, 2] += 0.5
        return K

    monkeypatch.setattr(world, "intrinsics", shifted)
    assert doctor.check_render()[0].state == WRONG
    monkeypatch.setattr(doctor, "table_error", lambda: float("nan"))  # no pixel has depth
    assert doctor.check_render()[0].state == WRONG


@pytest.mark.parametrize("free, state", [(1e8, WRONG), (50e9, OK)])
def test_disk_needs_room_for_a_data_set(monkeypatch, free, state):
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=free))
    assert doctor.check_disk()[0].state == state


def test_a_gpu_is_welcome_but_not_needed(monkeypatch):
    monkeypatch.setattr("torch.cuda.is_available", lambda: False)
    assert doctor.check_gpu()[0].state == NOTE
    monkeypatch.setattr("torch.cuda.is_available", lambda: True)
    monkeypatch.setattr("torch.cuda.get_device_name", lambda: "Toy GPU")
    finding = doctor.check_gpu()[0]
    assert finding.state == OK and "Toy GPU" in finding.found


def test_outside_a_virtual_environment_the_report_says_so(monkeypatch):
    assert doctor.check_python()[0].state == OK
    monkeypatch.setattr("sys.prefix", "/usr")
    monkeypatch.setattr("sys.base_prefix", "/usr")
    assert doctor.check_python()[0].state == NOTE


def test_one_broken_check_leaves_the_others_standing(monkeypatch):
    def broken():
        raise ImportError("libthing.so: cannot open shared object file")

    for name in ("check_packages", "check_render", "check_gpu"):
        monkeypatch.setattr(doctor, name, lambda: [])
    monkeypatch.setattr(doctor, "check_pybullet", broken)
    findings = {finding.name: finding for finding in doctor.examine()}
    assert findings["PyBullet"].state == WRONG and "libthing.so" in findings["PyBullet"].found
    assert findings["cores"].found[0].isdigit()
    assert not doctor.all_well(list(findings.values()))
    assert "mend: " in doctor.report(list(findings.values()))


# labkit doctor --warm -----------------------------------------------------------------------------------------------


@pytest.mark.nightly
def test_warming_up_compiles_every_kernel():
    doctor.warm_up()
    assert [kernel.py_func.__name__ for kernel in compiled.KERNELS if not kernel.signatures] == []


@pytest.mark.parametrize(
    ("place", "state", "words"),
    [
        (doctor.PACKAGE / "crf" / "__pycache__", OK, "all who use this installation find them"),
        ("/elsewhere/numba/crf_0123", NOTE, "kept in /elsewhere/numba/crf_0123"),
    ],
)
def test_warming_up_says_who_finds_what_it_compiled(place, state, words):
    kernel = SimpleNamespace(signatures=["float64"], stats=SimpleNamespace(cache_path=str(place)))
    finding = doctor.where_kept([kernel])
    assert (finding.state, bool(finding.mend)) == (state, state == NOTE) and words in finding.found


@pytest.mark.nightly
def test_users_of_a_read_only_installation_load_what_was_compiled_beside_the_code(tmp_path):
    (tmp_path / "some_kernels.py").write_text(
        "from labkit.support.compiled import kernel\n\n\n@kernel\ndef twice(x):\n    return 2 * x\n"
    )
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    environment |= {"XDG_CACHE_HOME": str(tmp_path / "own"), "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}

    def call(before: str, argument: str) -> list[str]:
        code = f"{before}; from some_kernels import twice; twice({argument}); s = twice.stats"
        code += "; print(s.cache_path, sum(s.cache_hits.values()), sum(s.cache_misses.values()))"
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        return done.stdout.split()

    assert call("pass", "3") == [str(tmp_path / "__pycache__"), "0", "1"]
    for argument, loaded in (("3", ["1", "0"]), ("0.5", ["0", "1"])):  # another kind of argument is compiled, and kept
        place, *counts = call("import os; os.access = lambda *_: False", argument)  # as for a user who may only read
        assert place.startswith(str(tmp_path / "own")) and counts == loaded
    older = "from numba.core import caching as c; c._UserWideCacheLocator = c.UserWideCacheLocator"  # before numba 0.62
    older += "; del c.UserWideCacheLocator; import os; os.access = lambda *_: False"
    assert call(older, "0.5")[1:] == ["1", "0"]
