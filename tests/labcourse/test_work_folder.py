"""Where a student's own files go: beside the course, and on Colab to Google Drive."""

import sys
from pathlib import Path
from types import ModuleType

import labcourse


def test_files_go_to_the_courses_data_or_beside_a_notebook_that_stands_alone(tmp_path, monkeypatch):
    (tmp_path / "labs" / "10_capstone").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "labs" / "10_capstone")
    assert labcourse.work_folder("capstone").resolve() == (tmp_path / "data" / "capstone").resolve()
    monkeypatch.chdir(tmp_path)
    assert labcourse.work_folder("capstone") == Path("data/capstone")


def test_on_colab_they_go_to_drive_after_it_is_mounted(monkeypatch):
    mounted = []
    colab = ModuleType("google.colab")
    colab.drive = ModuleType("google.colab.drive")
    colab.drive.mount = mounted.append
    for module in (ModuleType("google"), colab, colab.drive):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    assert labcourse.work_folder("capstone") == Path("/content/drive/MyDrive/labkit/capstone")
    assert mounted == ["/content/drive"]
