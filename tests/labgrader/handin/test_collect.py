"""From the zip that a learning platform gives, through nbgrader's zip_collect, to grades."""

import io
import json
import os
import zipfile
from pathlib import Path

import grading_course as kit
import pytest

from labgrader.grade_course import grade_course
from labgrader.handin.collect import LmsExtractor, marked_late, student_and_notebook

ROOT = Path(__file__).parents[3]
TOPIC = "04_iou"
TOTAL = sum(question.points for question in kit.asked(TOPIC).values())
MOODLE = {
    "Ada Lovelace_1234567_assignsubmission_file_/04_iou.ipynb": True,
    "Zoë Müller_1234568_assignsubmission_file_/04_iou (1).ipynb": False,
    "Ada Lovelace_7654321_assignsubmission_file_/04_iou.ipynb": False,  # another of that name
    "Ada Lovelace_7654321_assignsubmission_file_/notes.txt": None,
}
MOODLE_FLAT = {name.replace("file_/", "file_"): right for name, right in MOODLE.items()}
CANVAS = {
    "lovelaceada_1234_567890_04_iou.ipynb": True,
    "mullerzoe_LATE_1235_567891_04_iou-2.ipynb": False,
    "mullerzoe_LATE_1235_567892_04_iou-3.ipynb": True,  # a second one: it is the later, and counts
    "lovelaceada_4321_567893_04_iou.ipynb": False,
    "sneaky_1_2_..%2f..%2fetc.ipynb": None,
}


def zipped(files: dict[str, str | bytes], when: tuple[int, ...] = (1980, 1, 1, 0, 0, 0)) -> bytes:
    """A zip of files with a time."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as packed:
        for name, data in files.items():
            packed.writestr(zipfile.ZipInfo(name, when), data)
    return content.getvalue()


def collect(course: Path, files: dict[str, str | bytes], when: tuple[int, ...] = (1980, 1, 1, 0, 0, 0)) -> str:
    """Let nbgrader collect a platform's zip of files; what it says."""
    archive = course / "downloaded" / TOPIC / "archive" / "vision_2026_10_04_iou_submissions.zip"
    archive.parent.mkdir(parents=True)
    archive.write_bytes(zipped(files, when))
    said = kit.zip_collect(course, TOPIC)
    assert not [name for name in ("downloaded", "submitted") if (course / name).stat().st_mode & 0o077]
    return said


@pytest.mark.parametrize(
    "files, students",
    [
        pytest.param(
            MOODLE,
            ("Ada Lovelace_1234567", "Ada Lovelace_7654321", "Zoë Müller_1234568"),
            marks=pytest.mark.nightly,
        ),
        (CANVAS, ("lovelaceada_1234", "lovelaceada_4321", "mullerzoe_1235")),
        pytest.param(
            MOODLE_FLAT,
            ("Ada Lovelace_1234567", "Ada Lovelace_7654321", "Zoë Müller_1234568"),
            marks=pytest.mark.nightly,
        ),
    ],
    ids=["Moodle", "Canvas", "Moodle without folders"],
)
def test_a_zip_becomes_grades(tmp_path, files, students):
    kit.write_lab(tmp_path, TOPIC)
    right = kit.lab_notebook(TOPIC, kit.right_answers(TOPIC))
    contents = {n: json.dumps(right if is_right else kit.lab_notebook(TOPIC, {})) for n, is_right in files.items()}
    collect(tmp_path, contents)
    records = {record.student: record for record in grade_course(TOPIC, tmp_path, progress=False).records}
    assert set(students) <= records.keys()
    later = TOTAL if "mullerzoe_1235" in students else 0.0  # Canvas's second upload of hers is right
    assert [records[student].points for student in students] == [TOTAL, 0.0, later]


GRACE = "Grace Hopper_7654321_assignsubmission_file_04_iou.ipynb"  # what others may call their files


@pytest.mark.parametrize(
    "name, student",
    [
        (f"Eve Adams_1111111_assignsubmission_file_{GRACE}", "Eve Adams_1111111"),
        (f"Eve Adams_1111111_assignsubmission_file_/{GRACE}", "Eve Adams_1111111"),
        (f"Eve Adams_1111111_assignsubmission_file_/{GRACE}/04_iou.ipynb", "Eve Adams_1111111"),
        (f"adamseve_1235_567891_{GRACE}", "adamseve_1235"),
        ("adamseve_LATE_1235_567891_hoppergrace_7654_1_04_iou.ipynb", "adamseve_1235"),
        ("adamseve_LATE_1235_567891_x_1235_assignsubmission_file_04_iou.ipynb", "adamseve_1235"),
        (f"Eve Adams_1111111_assignsubmission_file_x\n.zip/{GRACE}", "Eve Adams_1111111"),
        (f"Eve Adams_1111111_assignsubmission_file_/\u2028{GRACE}", "Eve Adams_1111111"),
        (f"adamseve_1235_567891_x\n.zip/{GRACE}", "adamseve_1235"),
        ("adamseve_1235_567891_x\\hoppergrace_7654_1_04_iou.ipynb", "adamseve_1235"),
    ],
)
def test_the_name_that_a_student_gives_a_file_makes_nobody_else_of_them(tmp_path, name, student):
    path = tmp_path / "downloaded" / TOPIC / "extracted/all" / name
    path.parent.mkdir(parents=True)
    path.touch()
    os.utime(path, (0, 0))
    assert student_and_notebook(str(path))[0] == student
    assert marked_late(tmp_path, TOPIC).keys() == ({student} if "_LATE_" in name else set())


NAMES = ("Ada_12", "Ada_LATE_12", "Ada_12_", "Grace Hopper_7654321_assignsubmission_file_")


@pytest.mark.parametrize("name", NAMES)
def test_a_display_name_with_underscores_which_no_platform_writes_hands_in_for_nobody(name):
    for rest in ("04_iou.ipynb", "/04_iou.ipynb"):
        found = student_and_notebook(f"extracted/all/{name}_1111111_assignsubmission_file_{rest}")
        assert found is None or found[1] != "04_iou.ipynb"


IN_MOODLE = "_assignsubmission_file_"


def test_what_a_student_zips_is_the_students_and_what_cannot_be_opened_stops_nobody(tmp_path):
    """Eve's zip, or folder, looks like Grace's; Mallory's is none; one who zips a notebook, or hides it, has a time."""
    kit.write_lab(tmp_path, TOPIC)
    right, wrong = (json.dumps(kit.lab_notebook(TOPIC, answers)) for answers in (kit.right_answers(TOPIC), {}))
    forged = zipped({f"Grace Hopper_7{IN_MOODLE}/04_iou.ipynb": wrong, f"Grace Hopper_7{IN_MOODLE}04_iou.ipynb": wrong})
    files = {
        f"Eve Adams_1{IN_MOODLE}x.zip": forged,
        f"Eve Adams_2{IN_MOODLE}/x.zip": forged,
        f"Grace Hopper_7{IN_MOODLE}04_iou.ipynb": right,
        f"Ivy Ho_8{IN_MOODLE}/extracted/all/Grace Hopper_7{IN_MOODLE}/04_iou.ipynb": wrong,
        f"Joy Ng_9{IN_MOODLE}/lab.zip": zipped({"iou/04_iou.ipynb": right, "__MACOSX/._04_iou.ipynb": "x"}),
        f"Mallory_3{IN_MOODLE}/x.zip": b"no zip",
        f"Mallory_4{IN_MOODLE}/../../../04_iou.ipynb": wrong,
    }
    said = collect(tmp_path, files, (2026, 10, 6, 12, 0, 0))
    assert (
        said.count("Left out") == 2
        and f"Left out 'Mallory_3{IN_MOODLE}/x.zip': it cannot be opened (BadZipFile)" in said
    )
    points = {record.student: record.points for record in grade_course(TOPIC, tmp_path, progress=False).records}
    assert {"Grace Hopper_7": TOTAL, "Ivy Ho_8": 0.0, "Joy Ng_9": TOTAL}.items() <= points.items()
    for student in ("Grace Hopper_7", "Ivy Ho_8", "Joy Ng_9"):
        assert (tmp_path / "submitted" / student / TOPIC / "timestamp.txt").read_text().startswith("2026-10-06 ")
    assert not list(tmp_path.glob("*.ipynb"))


@pytest.mark.nightly
def test_a_zip_in_canvass_zip_is_its_students(tmp_path):
    kit.write_lab(tmp_path, TOPIC)
    right, wrong = (json.dumps(kit.lab_notebook(TOPIC, answers)) for answers in (kit.right_answers(TOPIC), {}))
    collect(
        tmp_path,
        {
            "adamseve_LATE_1235_567891_x.zip": zipped({"hoppergrace_7654_9_04_iou.ipynb": wrong}),
            "hoppergrace_7654_567_04_iou.ipynb": right,
        },
    )
    points = {record.student: record.points for record in grade_course(TOPIC, tmp_path, progress=False).records}
    assert points == {"adamseve_1235": 0.0, "hoppergrace_7654": TOTAL}
    assert [path.name for path in (tmp_path / "submitted/hoppergrace_7654").rglob("*.ipynb")] == ["04_iou.ipynb"]
    assert marked_late(tmp_path, TOPIC).keys() == {"adamseve_1235"}


def test_a_number_in_other_digits_is_no_platforms():
    """Python's \\d takes the digits of all scripts; a platform writes ten."""
    assert student_and_notebook("extracted/all/Eve_\u0661\u0662_assignsubmission_file_/04_iou.ipynb") is None


def test_a_zip_is_measured_before_it_is_unpacked(tmp_path, monkeypatch):
    """Twenty notebooks of 15 MB zip to 0.3 MB: nothing of them is unpacked, Grace's and a second small one are."""
    monkeypatch.setattr(
        "labgrader.handin.collect.content", lambda packed, entry: read.append(entry) or packed.read(entry)
    )
    read = []
    big = io.BytesIO()
    with zipfile.ZipFile(big, "w", zipfile.ZIP_DEFLATED) as packed:
        for i in range(20):
            packed.writestr(f"{i}.ipynb", bytes(15 << 20))
    extractor = LmsExtractor()
    said = []
    monkeypatch.setattr(extractor.log, "warning", lambda text, *words: said.append(text % words))
    (tmp_path / "archive").mkdir()
    files = {
        f"Eve Adams_1{IN_MOODLE}/x.zip": big.getvalue(),
        f"Eve Adams_1{IN_MOODLE}/04_iou.ipynb": "{}",
        f"Grace Hopper_7{IN_MOODLE}/04_iou.ipynb": "{}",
    }
    (tmp_path / "archive/all.zip").write_bytes(zipped(files))
    extractor.extract(str(tmp_path / "archive"), str(tmp_path / "out"))
    assert max(entry.file_size for entry in read) == len(big.getvalue()) < 1 << 20
    eve = (
        f"Left out 'Eve Adams_1{IN_MOODLE}/x.zip': with it the student's notebooks are 300 MB unpacked, at most 200 MB"
    )
    assert len(said) == 1 and said[0].startswith(eve)
    kept = {path.relative_to(tmp_path / "out/all").as_posix() for path in (tmp_path / "out").rglob("*.ipynb")}
    assert kept == {f"Eve Adams_1{IN_MOODLE}/04_iou.ipynb", f"Grace Hopper_7{IN_MOODLE}/04_iou.ipynb"}


def test_a_notebook_is_known_by_whatever_ending_a_browser_gave_it_and_who_has_none_is_named(tmp_path, monkeypatch):
    extractor, said = LmsExtractor(), []
    monkeypatch.setattr(extractor.log, "warning", lambda text, *words: said.append(text % words))
    (tmp_path / "archive").mkdir()
    names = ["04_iou.IPYNB", "04_iou.ipynb.txt", "04_iou.ipynb.json", "04_iou\u202e\x1b[2J.ipynb", "04_iou.ipynb"]
    files = {f"S_{i}{IN_MOODLE}/{name}": "1" for i, name in enumerate(names)}
    files |= {f"S_5{IN_MOODLE}/X.ZIP": zipped({"04_iou.IPYNB": "1"}), f"S_6{IN_MOODLE}/04_iou.pdf\x1b[2J": "1"}
    files |= {f"S_7{IN_MOODLE}/x.zip": zipped({"04_iou.py": "1"}), "README": "1", f"S_8{IN_MOODLE}/": ""}
    (tmp_path / "archive/all.zip").write_bytes(zipped(files))
    extractor.extract(str(tmp_path / "archive"), str(tmp_path / "out"))
    found = [path for path in sorted((tmp_path / "out").rglob("*")) if path.is_file()]
    assert [student_and_notebook(str(path)) for path in found] == [
        *((f"S_{i}", "04_iou[2J.ipynb" if i == 3 else "04_iou.ipynb") for i in range(6)),
        *((f"S_{i}", "nothing.left_out.txt") for i in (6, 7)),
    ]
    assert found[-2].read_text() == "no notebook was handed in, only 04_iou.pdf[2J"
    assert said == ["No notebook of 'S_6', only '04_iou.pdf[2J'", "No notebook of 'S_7', only 'x.zip'"]


def test_a_student_and_a_class_have_a_limit_whatever_the_number_of_files(tmp_path, monkeypatch):
    monkeypatch.setattr("labgrader.handin.collect.MOST_OF_A_STUDENT", 10)
    monkeypatch.setattr("labgrader.handin.collect.MOST_OF_A_CLASS", 18)
    (tmp_path / "archive").mkdir()
    files = {f"Eve Adams_1{IN_MOODLE}/{i}.ipynb": "1234" for i in range(3)}
    files |= {f"S_{i}{IN_MOODLE}/04_iou.ipynb": "1234" for i in range(2, 5)}
    (tmp_path / "archive/all.zip").write_bytes(zipped(files))
    LmsExtractor().extract(str(tmp_path / "archive"), str(tmp_path / "out"))
    kept = [student_and_notebook(str(path))[0] for path in sorted((tmp_path / "out").rglob("*.ipynb"))]
    assert kept == ["Eve Adams_1", "Eve Adams_1", "S_2", "S_3"]
