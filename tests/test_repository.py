"""Facts about the repository as a whole: what make does, what is pinned, what may import what, what the files hold."""

import ast
import inspect
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections import Counter
from functools import cache
from graphlib import TopologicalSorter
from itertools import chain, pairwise
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import labkit
from labgrader.packages import distribution_of, read_pins, requirements

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]
PINS = read_pins(ROOT / "constraints.txt")
KIT = distribution_of("labkit")
# The rooms of a package from the bottom up: each may import what stands left of it, itself, and the package.
ROOMS = {
    "labkit": (
        "support > labels > frame > geometry losses metrics instance_metrics crf > grasp learning > network > "
        "notices targets > pipeline sim > node"
    ),
    "labgrader": (
        "support question packages > comparison languages trust > as_arrays > course > settings > program > reply "
        "> run > sandbox handin > grade > report > check > file_check grade_course release"
    ),
}
BELOW = {
    (package, room): set(re.split(r"\W+", rooms.partition(layer)[0]))
    for package, rooms in ROOMS.items()
    for layer in rooms.split(" > ")
    for room in layer.split()
}
# What each package may import of the others, and a package of packages that may import less than the whole.
PACKAGES = {
    "labkit": {"labkit"},
    "labgrader": {"labgrader"},
    "labtrain": {"labtrain", "labkit"},
    "labros": {"labros", "labkit"},
    "data_gen": {"data_gen", "labkit", "labtrain"},
    "labcourse": {"labcourse", "labkit", "labtrain", "data_gen", "labgrader.question"},
    "labcourse.questions": {"labcourse.questions", "labkit", "labcourse.kinds", "labgrader.question"},
    "labcourse.stacks": {"labcourse.stacks", "labkit"},
    "labcli": {"labcli", "labkit", "labtrain", "labros", "labgrader", "labcourse", "data_gen"},
}


def tracked(*patterns: str) -> list[Path]:
    """Files that git knows or would add, so that a new file is judged before it is committed."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "--", *patterns]
    names = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
    return [ROOT / name for name in names if name and (ROOT / name).is_file()]


# -------------------------------------------------------------------------------- what may import what


@cache
def modules() -> dict[str, Path]:
    """Dotted names of all modules of the packages, with their files."""
    files = tracked(*(f"{package}/*.py" for package in PACKAGES if "." not in package))
    return {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path for path in files}


def imports(path: Path, everywhere: bool = True) -> set[str]:
    """Modules that a file names in its imports: everywhere, or only in those that run when it is imported itself."""
    found, waiting = set(), [ast.parse(path.read_text())]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are absolute here"
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name if name in modules() else node.module for name in names}
        elif everywhere or not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            waiting += ast.iter_child_nodes(node)
    return found


def test_arrows_between_rooms_point_one_way_and_in_no_circle():
    """Inside functions, too."""
    graphs = {name: imports(path) for name, path in modules().items()}
    for graph in (graphs, {name: imports(path, everywhere=False) for name, path in modules().items()}):
        TopologicalSorter({name: (found & graph.keys()) - {name} for name, found in graph.items()}).prepare()
    for name, found in graphs.items():
        roots = {other.split(".")[0] for other in found}
        assert not roots & {"tests", "bench", "lessons", "labs", "solutions"}, name
        assert "pybullet" not in roots or name.startswith("labkit.sim."), f"{name}: PyBullet belongs in labkit.sim"
        allowed = max((package for package in PACKAGES if f"{name}.".startswith(f"{package}.")), key=len)
        entered = {other for other in found if other.split(".")[0] in PACKAGES}
        strange = {o for o in entered if not any(f"{o}.".startswith(f"{way}.") for way in PACKAGES[allowed])}
        assert not strange, f"{name} imports {sorted(strange)}"
        package, _, rest = name.partition(".")
        if package in ROOMS and rest:
            own = rest.partition(".")[0]
            rooms = {other.split(".")[1] for other in found if other.startswith(f"{package}.")}
            above = rooms - {own, *BELOW[package, own]}
            assert not above, f"{name} imports {sorted(above)}"


def test_no_folder_is_longer_than_a_page():
    folders = Counter(path.parent for path in modules().values())
    assert not [
        str(folder)
        for folder, files in folders.items()
        if files > 24 and folder.relative_to(ROOT).parts[0] in ("labgrader", "labkit")
    ]


CHANGES = {"add", "append", "clear", "discard", "extend", "insert", "pop", "popitem", "remove", "setdefault", "update"}


def changed_globals(path: Path) -> set[str]:
    """Names in capitals, a module's own or another's, whose values a function of the file changes, and `global`s."""
    found = set()
    for function in (node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)):
        for node in ast.walk(function):
            changed = []
            if isinstance(node, ast.Global):
                found |= set(node.names)
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in CHANGES:
                changed = [node.func.value]
            elif isinstance(node, ast.Assign | ast.AugAssign | ast.Delete):
                targets = [node.target] if isinstance(node, ast.AugAssign) else node.targets
                changed = [target.value for target in targets if isinstance(target, ast.Subscript)]
                changed += [target for target in targets if isinstance(target, ast.Attribute)]
            names = [ast.unparse(value).rpartition(".")[2] for value in changed]
            found |= {name for name in names if name.isupper() and len(name) > 1}
    return found


def test_no_function_of_the_library_changes_a_global():
    """The same arguments would give other results later, or in another process."""
    rooms = ("labkit", "labtrain", "labros", "data_gen", "labcourse", "labcli")
    found = {
        str(path.relative_to(ROOT)): names
        for path in tracked(*(f"{room}/*.py" for room in rooms))
        if (names := changed_globals(path))
    }
    assert found == {"labkit/support/compiled.py": {"KERNELS"}}  # which kernels are loaded: no result hangs on it


def test_what_judges_and_grades_knows_no_course():
    """Not even in words: another course must not read of this one's tasks."""
    said = [
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for path in tracked("labgrader/*.py")
        for line in path.read_text().splitlines()
        if re.search(r"\blabkit\b|labtrain|labros|labcourse|segmentation", line)
    ]
    assert not said, said


def test_the_library_imports_without_jupyter_and_without_the_simulator():
    """Nothing of the pipeline asks for Jupyter, and nothing but labkit.sim for PyBullet."""
    library = [name for name in modules() if re.match(r"lab(kit(?!\.sim)|train|ros)\b", name)]
    absent = ("pybullet", "IPython", "ipywidgets", "jupyterlab", "nbformat", "nbgrader", "traitlets", "onnx")
    code = f"import importlib, sys\nsys.modules.update(dict.fromkeys({absent}))\n"
    code += f"for name in {library}: importlib.import_module(name)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("names", "unloaded"),
    [
        ("labkit", "numpy torch IPython cv2"),
        ("labkit.pipeline labkit.grasp", "numba"),
        ("labkit.pipeline labcli.evaluation labkit.sim.spec", "pybullet"),
        ("labkit.sim.panda", ""),  # PyBullet's greeting would stand in every notebook
    ],
)
def test_an_import_loads_no_more_than_it_needs_and_says_nothing(names, unloaded):
    code = f"import sys, {', '.join(names.split())}; sys.exit(any(name in sys.modules for name in {unloaded.split()}))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


# --------------------------------------------------------------------------------- what the files hold


def test_no_file_names_a_registry_or_a_place_of_one_machine():
    hosts = ["pypi" + ".org", "python" + "hosted", "download." + "pytorch", "deb." + "debian", "npm" + "js"]
    places = ["/" + place for place in ("home/", "root/", "work/", "Users/", "opt/")]
    forbidden = re.compile("|".join(map(re.escape, hosts)) + "|" + "|".join(rf"(?<![\w.~-]){p}" for p in places))
    text = [path for path in tracked() if b"\0" not in path.read_bytes()[:4096]]
    found = {str(path.relative_to(ROOT)): m[0] for path in text if (m := forbidden.search(path.read_text()))}
    assert not found, found


def test_the_licence_and_the_changelog_belong_to_this_version():
    assert PROJECT["version"] == labkit.__version__
    assert re.search(rf"^## {re.escape(labkit.__version__)}\b", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert (ROOT / "LICENSE").read_text().startswith("MIT License")


def test_docstrings_are_indented_as_the_sites_reference_reads_them():
    """A line that goes back to the left without an empty one before it makes Sphinx warn, unless a list goes on."""

    def complaints(docstring: str) -> list[str]:
        paragraphs = [text.splitlines() for text in re.split(r"\n\s*\n", inspect.cleandoc(docstring))]
        pairs = [pair for lines in paragraphs if ">>>" not in lines[0] for pair in pairwise(lines)]
        indented = [
            (len(before) - len(before.lstrip()), len(line) - len(line.lstrip()), line) for before, line in pairs
        ]
        return [line for before, here, line in indented if here < before and not line.lstrip().startswith("- ")]

    assert complaints("A box.\n\nx: a number,\n    in metres.\ny: another.") == ["y: another."]
    assert not complaints("A box.\n\n- x: a number,\n  in metres.\n- y: another.\n\nNothing else.")
    wrong = []
    for path in tracked("labkit/*.py", "labtrain/*.py", "labros/*.py", "labcourse/stacks/*.py", "labcourse/views.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                docstring = ast.get_docstring(node, clean=False) or "Nothing."
                wrong += [f"{path.relative_to(ROOT)}: {line!r}" for line in complaints(docstring)]
    assert not wrong, "\n".join(wrong)


def test_links_in_the_pages_lead_to_files():
    for page in tracked("*.md"):
        for link in re.findall(r"\]\((?!https?:|#|mailto:)([^)#\s]+)", page.read_text()):
            assert (page.parent / link).exists(), f"{page.name}: {link}"


# ----------------------------------------------------------------------------------- packages and pins


def test_whatever_is_required_or_installed_is_pinned_to_a_version_that_fits():
    """The build of a package stays open, and what students install holds no grader and no test tools."""
    for line in chain(PROJECT["dependencies"], *EXTRAS.values()):
        needed = Requirement(line)
        (pin,) = PINS[canonicalize_name(needed.name)].specifier
        assert pin.operator == "==" and needed.specifier.contains(pin.version, prereleases=True), line
    assert not [pin for pin in PINS.values() if "+" in str(pin.specifier)]
    for extra in ("", *EXTRAS):
        installed = {name for name, version in requirements(KIT, extra).items() if version is not None}
        # What only a build of torch for CUDA brings, that build pins itself.
        loose = {name for name in installed - PINS.keys() if not re.match("nvidia-|cuda-|triton$", name)}
        assert not loose, f"pin these in constraints.txt: {sorted(loose)}"
    students = {name for extra in ("course", "stacks") for name in requirements(KIT, extra)}
    assert not students & {"nbgrader", "pytest", "nbval", "hypothesis", "ruff", "playwright", "distributed"}
    assert not requirements(KIT).keys() & {"jupyterlab", "ipywidgets", "notebook", "ipykernel"}


def test_every_import_of_the_kit_is_required():
    """An import that works here only because another package brought it along breaks when that one lets go of it."""
    brought_by = {"cv2": "opencv-python-headless", "PIL": "pillow", "ruamel": "ruamel.yaml"}
    brought_by |= {"pybullet_data": "pybullet", "mpl_toolkits": "matplotlib"}
    users = chain(*(lines for extra, lines in EXTRAS.items() if extra not in ("test", "bench", "site")))
    required = {canonicalize_name(Requirement(line).name) for line in chain(PROJECT["dependencies"], users)}
    for name, path in modules().items():
        roots = {found.split(".")[0] for found in imports(path, everywhere=True)}
        foreign = roots - sys.stdlib_module_names - PACKAGES.keys() - {"google"}  # of Colab's kernel, asked only there
        missing = {root for root in foreign if canonicalize_name(brought_by.get(root, root)) not in required}
        assert not missing, f"{name} imports {missing}"


def test_a_wheel_has_every_file_of_the_packages_and_runs_without_a_checkout(tmp_path):
    """Built from what git knows, and installed into a folder of its own: weights and settings are there, too."""
    packages = [package for package in PACKAGES if "." not in package]
    packaged = {path.relative_to(ROOT) for path in tracked(*packages)}
    for name in {*packaged, *map(Path, ("pyproject.toml", "setup.py", "README.md", "LICENSE"))}:
        (tmp_path / "source" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / "source" / name)
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation", "--no-compile"]
    subprocess.run([*pip, "--target", tmp_path / "site", tmp_path / "source"], check=True, capture_output=True)
    shutil.rmtree(tmp_path / "source")
    roots = (tmp_path / "site" / name for name in packages)
    found = {path.relative_to(tmp_path / "site") for root in roots for path in root.rglob("*.*")}
    assert found == packaged | {Path("labgrader/pyproject.toml")}
    environment = os.environ | {"PYTHONPATH": str(tmp_path / "site")}
    command = [sys.executable, "-m", "labcli.cli", "doctor"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0 and "ok     packages" in done.stdout, done.stdout + done.stderr


# ------------------------------------------------------------------------------------------------ make


def make(folder: Path, *arguments: str, path: str | None = None) -> subprocess.CompletedProcess:
    """Run make in a folder."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("MAKE")}
    environment |= {} if path is None else {"PATH": path}
    return subprocess.run(["make", *arguments], cwd=folder, env=environment, capture_output=True, text=True)


@pytest.fixture
def checkout(tmp_path):
    """A folder with nothing but the Makefile and what it reads."""
    for name in ("Makefile", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, tmp_path)
    return tmp_path


@pytest.mark.parametrize("arguments", [[], ["PYTHON=./python3.12"]])
def test_the_wrong_python_gets_one_line(checkout, arguments):
    """A PATH on which every Python is of another version."""
    tools = checkout / "tools"
    tools.mkdir()
    for tool in ("make", "bash", "sh", "env"):
        (tools / tool).symlink_to(shutil.which(tool))
    for folder, name in ((tools, "python3"), (tools, "python3.11"), (checkout, "python3.12")):
        (folder / name).write_text("#!/bin/sh\nexit 1\n")
        (folder / name).chmod(0o755)
    done = make(checkout, "test", *arguments, path=str(tools))
    assert done.returncode != 0
    lines = [line for line in done.stderr.splitlines() if not line.startswith("make")]
    assert len(lines) == 1 and "Python 3.11, 3.12 or 3.13" in lines[0]
    assert not (checkout / ".venv").exists()


STUB = """#!/bin/bash
if [ "$1 $2" = "-m venv" ]; then
    mkdir -p "$3/bin" && cp "$0" "$3/bin/python" && cp "$0" "$3/bin/jupyter"
elif [ "$1 $2" = "-m pip" ]; then
    echo "$@" >> asked
elif [ "$1" != lab ]; then
    exec {python} "$@"
fi
"""


def test_a_student_begins_before_pytorch_is_there(checkout):
    """With a Python that only writes down what pip is asked for: all but torch, the kit, then torch."""
    (checkout / "python3.12").write_text(STUB.format(python=sys.executable))
    (checkout / "python3.12").chmod(0o755)
    done = make(checkout, "lab", "PYTHON=./python3.12")
    assert done.returncode == 0 and "PyTorch is there." in done.stdout, done.stderr
    first = (checkout / ".venv/first.txt").read_text().splitlines()
    extras = PROJECT["optional-dependencies"]
    needed = PROJECT["dependencies"] + extras["course"] + extras["stacks"]
    assert sorted(first) == sorted(line for line in needed if Requirement(line).name != "torch")
    asked = [line.partition(" off ")[2] for line in (checkout / "asked").read_text().splitlines() if " off " in line]
    assert [line.split()[-1] for line in asked] == ["setuptools", "--no-compile", ".", "torch"]
    assert asked[1].startswith("-c constraints.txt -r ") and "--no-deps" in asked[2]
    assert make(checkout, "lab").returncode == 0
    assert (checkout / "asked").read_text().count(" off ") == len(asked)
