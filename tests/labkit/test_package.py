"""What the package offers by itself: the names that most users begin with, loaded when one is asked for."""

import importlib
import subprocess
import sys

import pytest

import labkit


def test_the_names_that_most_users_begin_with_come_from_the_package():
    from labkit import Gripper, Pipeline, RGBDFrame, check, load_model

    offered = {"Gripper": Gripper, "Pipeline": Pipeline, "RGBDFrame": RGBDFrame, "load_model": load_model}
    offered |= {"check": check}
    assert offered.keys() == labkit.OFFERED.keys() <= {*dir(labkit)}
    for name, module in labkit.OFFERED.items():
        assert offered[name] is getattr(importlib.import_module(module), name)


def test_what_check_file_returns_is_no_output_of_a_cell(monkeypatch):
    monkeypatch.setattr("labgrader.file_check.check_file", lambda path: path == "lab.ipynb")
    assert labkit.check_file("lab.ipynb") is None


def test_importing_the_package_loads_neither_torch_nor_numpy_nor_the_course():
    program = "import sys, labkit; print(*{name.partition('.')[0] for name in sys.modules})"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
    assert "labkit" in loaded
    assert not {"torch", "numpy", "cv2", "labcourse", "labgrader"} & {*loaded}


def test_a_name_that_it_does_not_have_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'labkit' has no attribute 'Piepline'"):
        _ = labkit.Piepline
