"""Two notebooks of one student: the later one counts where a platform tells which that is; else a person decides."""

import datetime
import io
import json
import zipfile
from types import SimpleNamespace

import grading_course as kit
import pytest
from traitlets.config import Configurable

from labgrader.handin.collect import LmsCollector, LmsExtractor
from labgrader.handin.reading import read_lab, read_submissions
from labgrader.handin.several import HandIn, read_picks, the_later

TOPIC = "04_iou"
WRONG, RIGHT = "def iou(n):\n    return n\n", "def iou(n):\n    return 2 * n\n"
MOODLE = "Ada Lovelace_77_assignsubmission_file_"
PICK = f'[[notebook]]\nlab = "{TOPIC}"\nstudent = "77"\nfile = "{{}}"\n'


class Application(Configurable):
    """What nbgrader's command is to a plugin."""

    def __init__(self, coursedir):
        super().__init__()
        self.coursedir = coursedir


def times(*days):
    return [datetime.datetime(2026, 10, day) if day else None for day in days]


@pytest.mark.parametrize(
    "names, whens, numbers, later",
    [
        (("a", "b"), times(5, 3), (None, None), "a"),
        (("a", "b"), times(3, 3), (None, None), None),
        (("a", "b"), times(3, None), (None, None), None),
        (("04_iou", "04_iou (2)"), times(None, None), (8, 9), "04_iou (2)"),
        (("04_iou", "04_iou (2)"), times(None, None), (9, 8), None),  # Canvas and the browser say different things
        (("04_iou-1", "04_iou-3", "04_iou-2"), times(None, None, None), (7, 9, 8), "04_iou-3"),
        (("my (2)", "04_iou"), times(None, None), (8, 9), "04_iou"),  # of other files the numbers say nothing
        (("04_iou", "04_iou"), times(None, None), (0, 0), None),
    ],
)
def test_a_time_or_a_number_of_the_platforms_tells_the_later(tmp_path, names, whens, numbers, later):
    found = []
    for i, (name, when, number) in enumerate(zip(names, whens, numbers, strict=True)):
        (tmp_path / str(i)).write_text(str(i))
        found.append(HandIn(tmp_path / str(i), f"{name}.ipynb", when, number))
    chosen = the_later(found)
    assert (chosen and chosen.name) == (later and f"{later}.ipynb")
    assert the_later([found[0], HandIn(found[0].path, "copy.ipynb")]) is not None  # of the same bytes either will do


def collected(course, files: dict[str, tuple[str | bytes, int]]):
    """Take files, each with the day on which Moodle got it, to submitted/ as nbgrader does; what is read of them."""
    kit.write_lab(course, TOPIC)
    archive, out = course / "downloaded" / TOPIC / "archive", course / "downloaded" / TOPIC / "extracted"
    archive.mkdir(parents=True)
    with zipfile.ZipFile(archive / "all.zip", "w") as packed:
        for name, (content, day) in files.items():
            packed.writestr(zipfile.ZipInfo(name, (2026, 10, day, 12, 0, 0) if day else (1980, 1, 1, 0, 0, 0)), content)
    LmsExtractor().extract(str(archive), str(out))
    collector = LmsCollector(parent=Application(SimpleNamespace(root=str(course), assignment_id=TOPIC)))
    for path in sorted(path for path in out.rglob("*") if path.is_file()):
        info = collector.collect(str(path))
        target = course / "submitted" / info["student_id"] / TOPIC / info["file_id"]
        target.parent.mkdir(parents=True, exist_ok=True)
        assert not target.exists()
        target.write_bytes(path.read_bytes())
        if info["timestamp"]:
            (course / "submitted" / info["student_id"] / TOPIC / "timestamp.txt").write_text(info["timestamp"])
    return read(course)


def read(course):
    found = read_submissions(course / "submitted", read_lab(course, TOPIC), read_picks(course, TOPIC))
    return {submission.student: submission for submission in found}


def notebook(iou: str) -> str:
    return json.dumps(kit.lab_notebook(TOPIC, {"iou": iou}))


def iou_of(submission) -> str:
    return submission.cells["iou"]


@pytest.mark.parametrize("days, graded", [((3, 5), RIGHT), ((5, 3), WRONG)])
def test_the_later_is_graded_and_both_are_named(tmp_path, days, graded):
    files = {f"{MOODLE}/04_iou.ipynb": (notebook(WRONG), days[0])}
    files |= {f"{MOODLE}/04_iou final.ipynb": (notebook(RIGHT), days[1])}
    ada = collected(tmp_path, files)["Ada Lovelace_77"]
    first, last = (
        ("04_iou.ipynb", "04_iou final.ipynb") if days[1] > days[0] else ("04_iou final.ipynb", "04_iou.ipynb")
    )
    assert iou_of(ada) == graded and ada.timestamp.startswith("2026-10-05")
    assert ada.note.startswith(f"of its notebooks {last} was graded, not 2026-10-03 ") and ada.note.endswith(first)
    (tmp_path / "course.toml").write_text(PICK.format(first))
    ada = read(tmp_path)["Ada Lovelace_77"]
    assert iou_of(ada) != graded and not ada.note  # a person decided


def test_where_nothing_tells_that_student_is_stopped_and_the_others_go_on(tmp_path):
    files = {f"{MOODLE}/04_iou.ipynb": (notebook(WRONG), 0), f"{MOODLE}/04_iou (1).ipynb": (notebook(RIGHT), 0)}
    files |= {"Ben_5_assignsubmission_file_/04_iou.ipynb": (notebook(RIGHT), 0)}
    read_now = collected(tmp_path, files)
    assert iou_of(read_now["Ben_5"]) == RIGHT and not read_now["Ben_5"].reason
    why = "it is not known which of 04_iou (1).ipynb, 04_iou.ipynb is the later one: name the one to be graded in"
    assert read_now["Ada Lovelace_77"].reason == f"{why} [[notebook]] of course.toml"
    for name, iou in (("04_iou.ipynb", WRONG), ("04_iou (1).ipynb", RIGHT)):
        (tmp_path / "course.toml").write_text(PICK.format(name))
        assert iou_of(read(tmp_path)["Ada Lovelace_77"]) == iou
    (tmp_path / "course.toml").write_text(PICK.format("04_iou (7).ipynb"))
    assert "names 04_iou (7).ipynb, which none of" in read(tmp_path)["Ada Lovelace_77"].reason
    (tmp_path / "course.toml").write_text(PICK.format("a") * 2)
    with pytest.raises(ValueError, match=r"\[\[notebook\]\] number 2: student: 77 has a notebook above"):
        read(tmp_path)


def zipped(files: dict[str, str]) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as packed:
        for name, text in files.items():
            packed.writestr(name, text)
    return content.getvalue()


def test_what_is_no_copy_of_the_lab_or_the_same_again_is_no_second_notebook(tmp_path):
    """Students zip the whole course, with the lesson of the lab's name, other labs and what editors keep."""
    lesson, other = json.dumps(kit.notebook([kit.code_cell("1")])), json.dumps(kit.lab_notebook("07_grasp", {}))
    inner = {"labs/04_iou/04_iou.ipynb": notebook(RIGHT), "lessons/04_iou.ipynb": lesson, "labs/07_grasp.ipynb": other}
    inner |= {"labs/04_iou/.ipynb_checkpoints/04_iou-checkpoint.ipynb": notebook(WRONG), "__MACOSX/._x.ipynb": "x"}
    files = {f"{MOODLE}/course.zip": (zipped(inner), 4)}
    files |= {"Ben_5_assignsubmission_file_/04_iou.ipynb": (notebook(RIGHT), 3)}
    files |= {"Ben_5_assignsubmission_file_/again.ipynb": (notebook(RIGHT), 5)}
    files |= {"Cem_6_assignsubmission_onlinetext_/onlinetext.html": ("<p>my answer</p>", 3)}
    files |= {"Dan_7_assignsubmission_file_/a/../../../../x.pdf": ("%PDF", 3)}
    found = collected(tmp_path, files)
    assert [iou_of(found[name]) for name in ("Ada Lovelace_77", "Ben_5")] == [RIGHT, RIGHT] and not found["Ben_5"].note
    assert found["Cem_6"].reason == "no notebook was handed in, only onlinetext.html"
    assert found["Dan_7"].reason == "no notebook was handed in, only x.pdf" and not list(tmp_path.glob("*.txt"))


def test_where_a_folder_has_the_labs_name_and_others_that_one_counts_and_all_are_named(tmp_path):
    """As on a hub, where the folder is handed in as it is."""
    kit.write_lab(tmp_path, TOPIC)
    path = kit.submit(tmp_path, "ada", TOPIC, {"iou": RIGHT})
    path.with_name("04_iou-Copy1.ipynb").write_text(path.read_text())
    assert not read(tmp_path)["ada"].note
    path.with_name("04_iou-Copy1.ipynb").write_text(notebook(WRONG))
    assert read(tmp_path)["ada"].note == "of its notebooks 04_iou.ipynb was graded, not 04_iou-Copy1.ipynb"
