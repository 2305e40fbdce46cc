"""`labkit check`: what it ticks in a saved lab the grader marks right, and what it refuses is told in its words."""

import json
from pathlib import Path

import pytest
from grading_course import lab_notebook, right_answers

from labkit.course.checker.program import Cell
from labkit.course.checking_file import check_file, topic_of
from labkit.course.topics import TOPICS, of_topic

TOPIC = "04_iou"
ANSWERS = len(of_topic(TOPIC))
ROOT = Path(__file__).parents[2]
CALLS_IOU = "def mean_iou(n_frames):\n    return np.nanmean(iou(n_frames.sum(axis=0)))\n"
WRONG_IOU = "def iou(n):\n    return np.diagonal(n) / n.sum()\n"


def saved(folder: Path, notebook: dict) -> Path:
    """Write a notebook."""
    path = folder / f"{TOPIC}.ipynb"
    path.write_text(json.dumps(notebook))
    return path


def said(path: Path, capsys) -> dict[str, str]:
    """What is said of each answer, by its function, without the mark."""
    check_file(path)
    lines = [line for line in capsys.readouterr().out.splitlines() if line[:1] in "\u2714\u2718\u25cb"]
    return {line[2:].split()[0].rstrip(":"): line for line in lines}


def test_a_right_lab_is_right_and_a_released_one_is_not_answered(tmp_path, capsys):
    assert check_file(saved(tmp_path, lab_notebook(TOPIC, right_answers(TOPIC))))
    assert f"{ANSWERS} of {ANSWERS} answers are right" in capsys.readouterr().out
    assert not check_file(saved(tmp_path, lab_notebook(TOPIC)))
    shown = capsys.readouterr().out
    assert shown.count("not answered yet") == ANSWERS and "below" not in shown, "nothing follows a notebook's last cell"


@pytest.mark.parametrize("topic", TOPICS)
def test_every_solution_is_right_as_it_is_saved(topic):
    assert check_file(ROOT / "solutions" / topic / f"{topic}.ipynb")


def test_a_lab_of_texts_alone_is_right_when_none_is_empty(capsys):
    lab, solution = (ROOT / folder / "10_capstone" / "10_capstone.ipynb" for folder in ("labs", "solutions"))
    assert not check_file(lab)
    assert "has 6 texts that a person grades; still empty: question, labels," in capsys.readouterr().out
    assert check_file(solution)
    assert "has 6 texts that a person grades; none of them is empty" in capsys.readouterr().out


def test_an_answer_that_calls_a_wrong_one_gets_the_kits(tmp_path, capsys):
    answers = right_answers(TOPIC) | {"iou": WRONG_IOU, "mean_iou": CALLS_IOU}
    found = said(saved(tmp_path, lab_notebook(TOPIC, answers)), capsys)
    assert found["iou"].startswith("\u2718") and found["mean_iou"].startswith("\u2714")


def test_what_is_only_there_at_home_is_not_there(tmp_path, capsys):
    """A module found at run time by a name that is made up: the process has the grader's packages alone."""
    sneaky = 'def iou(n):\n    return __import__("lab" + "kit.metrics").metrics.iou(n)\n'
    found = said(saved(tmp_path, lab_notebook(TOPIC, right_answers(TOPIC) | {"iou": sneaky})), capsys)
    assert found["iou"].startswith("\u2718 iou")


def test_the_topic_is_that_of_the_checks_or_of_the_name():
    assert topic_of(Path("my copy.ipynb"), [Cell('iou = check("04_iou.iou", iou)')]) == TOPIC
    assert topic_of(Path("04_iou.ipynb"), []) == TOPIC
    with pytest.raises(ValueError, match="calls no check"):
        topic_of(Path("notes.ipynb"), [])


@pytest.mark.parametrize(
    "content, says", [(None, "there is no file"), ("{", "cannot be read"), ("[]", "cannot be read")]
)
def test_what_is_no_notebook_is_said(content, says, tmp_path):
    path = tmp_path / "lab.ipynb"
    if content is not None:
        path.write_text(content)
    with pytest.raises(ValueError, match=says):
        check_file(path)
