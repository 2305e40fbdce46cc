"""A course that was released, collected and graded by 0.2, before the packages had their names of today, goes on.

data/course_0_2.zip holds what 0.2 left of README's sample course: the lab, three submissions, which import
`labkit.course`, nbgrader's configuration and gradebook, and the tables and records of its grades.
"""

import csv
import json
import shutil
import zipfile
from pathlib import Path

import pytest
from grading_course import lab_notebook

from labgrader.course import asked, find, of_topic
from labgrader.file_check import check_file
from labgrader.grade.grade import Grading
from labgrader.grade.gradebook import opened
from labgrader.grade_course import grade_course
from labgrader.handin.reading import read_lab, read_submission

TOPIC, WRITTEN = "04_iou", "accuracy_and_iou"


@pytest.fixture(scope="module")
def old(tmp_path_factory):
    """The course as 0.2 left it; the instructor has since read what ada wrote."""
    folder = tmp_path_factory.mktemp("old")
    with zipfile.ZipFile(Path(__file__).parents[1] / "data/course_0_2.zip") as archive:
        archive.extractall(folder)
    with opened(folder) as book:
        written = book.find_grade(WRITTEN, TOPIC, TOPIC, "ada")
        written.manual_score, written.needs_manual_grade = 2.0, False
        book.db.commit()
    return folder


def points(course: Path) -> dict[tuple[str, str], float]:
    """Points by student and question, of the table."""
    with (course / "grades" / TOPIC / "grades.csv").open(newline="") as table:
        return {(row["student"], row["question"]): float(row["points"]) for row in csv.DictReader(table)}


def scores(course: Path) -> dict[str, float]:
    """Points by student, of the gradebook."""
    with opened(course) as book:
        return {submission.student.id: submission.score for submission in book.assignment_submissions(TOPIC)}


def test_everybody_keeps_points_and_what_was_graded_by_hand(old):
    before, total = points(old), scores(old)
    assert total == {"ada": 14.0, "ben": 5.0, "eve": 5.0}
    graded = grade_course(TOPIC, old, workers=2, progress=False)
    assert graded.graded_now == 3 and not graded.failures
    says = [result.says for record in graded.records for result in record.results]
    assert not [text for text in says if "released" in text]  # no task is taken for another one
    assert (old / "grades" / TOPIC / "secret_seed").read_text().strip() == "fixed"  # the round goes on
    assert points(old) == before and scores(old) == total
    with opened(old) as book:
        assert book.find_grade(WRITTEN, TOPIC, TOPIC, "ada").manual_score == 2.0


# ------------------------------------------------------------------------------- a lab that asked other questions


def released_with(blanks: list[str], folder: Path, answers: dict[str, str] | None = None) -> Path:
    """A lab of topic 01 with some blanks alone, as a release says it, in folder/labs."""
    lab = lab_notebook("01_labels", answers)
    names = {*of_topic("01_labels")} - {*blanks}
    left_out = names | {f"check_{name}" for name in names}
    lab["cells"] = [c for c in lab["cells"] if c["metadata"].get("nbgrader", {}).get("grade_id") not in left_out]
    lab["metadata"]["labkit"] = {"version": "0.2.0", "tasks": dict.fromkeys(blanks, "as it was")}
    path = folder / "labs/01_labels/01_labels.ipynb"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(lab))
    return path


ONE_HOT = "def one_hot(y, C):\n    return np.stack([y == c for c in range(C)], axis=1).astype(int)\n"


def test_a_blank_that_no_lab_has_any_more_is_checked_and_graded_where_one_had_it(tmp_path, capsys):
    """Here topic 01's one_hot; and blanks that are newer than the lab are not missed in it."""
    assert "one_hot" in of_topic("01_labels") and "one_hot" not in asked("01_labels")
    released_with(["one_hot"], tmp_path)
    lab = read_lab(tmp_path, "01_labels")
    assert lab.points == {"one_hot": find("01_labels.one_hot").points}
    handed_in = released_with(["one_hot"], tmp_path / "ada", {"one_hot": ONE_HOT})
    assert check_file(handed_in) and "1 of 1 answers are right" in capsys.readouterr().out
    shutil.copytree(handed_in.parent, tmp_path / "ada/01_labels")
    (result,) = Grading(lab, read_submission(tmp_path / "ada", lab), unsafe=True).in_public()
    assert result.points == 1.0


def test_a_lab_of_today_has_todays_blanks(tmp_path):
    path = released_with(["one_hot"], tmp_path)
    lab = json.loads(path.read_text())
    del lab["metadata"]["labkit"]
    path.write_text(json.dumps(lab))
    with pytest.raises(ValueError, match=f"lacks {', '.join(asked('01_labels'))}"):
        read_lab(tmp_path, "01_labels")
