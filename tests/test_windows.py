"""What a student needs runs on a Python without what Windows lacks; nobody here has run it on Windows itself."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
OTHERS = """numpy torch cv2 matplotlib.pyplot scipy.spatial.transform scipy.ndimage scipy.optimize numba pybullet
    trimesh typer tqdm.auto plotly.graph_objects PIL.Image psutil ruamel.yaml rosbags.highlevel cloudpickle
    IPython.display ipywidgets ipykernel.ipkernel nbformat nbclient nbconvert jaxtyping packaging.requirements
    onnxruntime""".split()  # noqa: SIM905
# What no student's command imports.
FOR_INSTRUCTORS = ("labgrader.sandbox", "labgrader.handin", "labgrader.grade", "labgrader.report", "labgrader.release")
FOR_INSTRUCTORS += ("labcourse.exam", "labros", "labtrain.ranks")
BEGIN = f"import sys; sys.path[:0] = [{str(ROOT)!r}, {str(ROOT / 'tests')!r}]; import as_windows; "


def as_on_windows(program: str, packages: list[str], **environment: str) -> subprocess.CompletedProcess:
    """Run a program in a process of its own that lacks what Windows lacks; workers that it starts lack it, too."""
    begin = f"{BEGIN}as_windows.take_away({packages})\nimport labgrader.run.subprocess_worker as plain\n"
    begin += f"plain.START_PLAIN = {BEGIN + 'as_windows.take_away(); '!r} + plain.START_PLAIN\n"
    how = {"capture_output": True, "cwd": ROOT, "env": os.environ | {"PYTHONIOENCODING": "utf-8"} | environment}
    done = subprocess.run([sys.executable, "-c", begin + program], **how)
    assert done.returncode == 0, done.stderr[-3000:].decode(errors="replace")
    return done


def students_modules() -> list[str]:
    """Every module that no instructor's command alone needs."""
    rooms = ("labkit", "labtrain", "labgrader", "labcourse", "labcli", "data_gen")
    files = [path for room in rooms for path in (ROOT / room).rglob("*.py")]
    names = [".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for path in files]
    return sorted(name for name in names if not name.startswith(FOR_INSTRUCTORS) and not name.endswith("__main__"))


STUDENT = """
import contextlib, importlib, importlib.util, io, os, pathlib, signal, tempfile
assert not hasattr(os, "fork") and not hasattr(signal, "SIGKILL")
for name in MODULES: importlib.import_module(name)
import data_gen
from labkit.network import load_model, weights_path
from labkit.pipeline import Pipeline
frame = data_gen.render(data_gen.sample_scene(7, "test"))
assert Pipeline(load_model(weights_path("unet_rgbd"))).run(frame).plan.grasps
from labgrader.check import check
from labgrader.course import of_topic, topics
folder = pathlib.Path(tempfile.mkdtemp())
for topic in topics():
    for question in [*of_topic(topic).values()][:1]:
        name = question.function
        number = f"def {name}({', '.join(question.parameters)}):\\n    return 12345.678\\n"
        for kind, source, mark in (("right", question.source, "✔"), ("wrong", number, "✘")):
            file = folder / f"{kind}_{name}.py"
            file.write_text(source, encoding="utf-8", newline="\\r\\n")  # as a checkout has it there
            spec = importlib.util.spec_from_file_location(file.stem, file)
            module = sys.modules[file.stem] = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
            said = io.StringIO()
            with contextlib.redirect_stdout(said): check(question.name, getattr(module, name))
            assert said.getvalue().startswith(mark), (question.name, kind, said.getvalue())
            print(mark)
"""


def test_a_student_imports_perceives_and_checks():
    """Every module that a student's command needs, a frame to grasps, and a right and a wrong answer of each lab."""
    said = as_on_windows(f"MODULES = {students_modules()}{STUDENT}", OTHERS).stdout.decode()
    assert said.count("✔") == said.count("✘") == len([*(ROOT / "labs").iterdir()]) - 1  # lab 10 has texts alone


def test_what_grades_says_that_it_needs_linux():
    program = """
import labcli.cli, sysconfig
sysconfig.get_config_vars()  # of this machine, before it says that it is another
sys.platform = "win32"
for words in (["grade", "04_iou"], ["grades", "04_iou"], ["texts", "04_iou"], ["forget", "ada"]):
    sys.argv = ["labkit", *words]
    try: labcli.cli.main()
    except SystemExit as stop: print(stop.code)
"""
    done = as_on_windows(program, ["numpy", "typer"])
    assert done.stdout.split() == [b"2"] * 4
    for name in (b"grade", b"grades", b"texts", b"forget"):
        assert b"labkit " + name + b" needs Linux" in done.stderr, done.stderr


@pytest.mark.nightly
def test_a_console_of_code_page_1252_gets_lines_and_no_traceback():
    program = "import labcli.cli\nsys.argv = ['labkit', 'doctor']\ntry: labcli.cli.main()\nexcept SystemExit: pass"
    done = as_on_windows(program, OTHERS, PYTHONIOENCODING="cp1252", PYTHONUTF8="0")
    assert b"Traceback" not in done.stderr and b"packages" in done.stdout, done.stderr.decode("cp1252")
