"""`labkit check`: what it ticks in a saved lab the grader marks right, and what it refuses is told in its words."""

import json
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
from at_night import others_at_night
from grading_course import lab_notebook, right_answers

from labgrader.check import why_its_file_is_not_graded
from labgrader.course import asked, of_topic, topics
from labgrader.file_check import check_file, is_lab, topic_of
from labgrader.program.cell import Cell
from labgrader.program.open_notebook import running_file

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
    assert check_file(saved(tmp_path, lab_notebook(TOPIC, right_answers(TOPIC), whole=True)))
    assert f"{ANSWERS} of {ANSWERS} answers are right" in capsys.readouterr().out
    assert not check_file(saved(tmp_path, lab_notebook(TOPIC, whole=True)))
    shown = capsys.readouterr().out
    assert shown.count("not answered yet") == ANSWERS and "below" not in shown, "nothing follows a notebook's last cell"


@pytest.mark.parametrize("topic", others_at_night(topics(), by_day=(TOPIC, "07_grasp")))
def test_every_solution_is_right_as_it_is_saved(topic):
    assert check_file(ROOT / "solutions" / topic / f"{topic}.ipynb")


def test_a_lab_of_texts_alone_is_right_when_none_is_empty(capsys):
    lab, solution = (ROOT / folder / "10_capstone" / "10_capstone.ipynb" for folder in ("labs", "solutions"))
    assert not check_file(lab)
    assert "has 6 written answers, graded by hand; still empty: question, labels," in capsys.readouterr().out
    assert check_file(solution)
    assert "has 6 written answers, graded by hand; none of them is empty" in capsys.readouterr().out


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
    assert topic_of(Path("notes.ipynb"), []) is None


def test_a_lab_of_texts_alone_is_checked_under_any_name_and_other_notebooks_are_no_labs(tmp_path, capsys):
    """As on Colab, which tells no name: "This notebook"."""
    path = tmp_path / "This notebook.ipynb"
    path.write_bytes((ROOT / "labs/10_capstone/10_capstone.ipynb").read_bytes())
    assert not check_file(path)
    assert "written answers, graded by hand; still empty: " in capsys.readouterr().out
    path.write_text(json.dumps({"cells": [], "metadata": {}, "nbformat": 4, "nbformat_minor": 5}))
    with pytest.raises(ValueError, match="calls no check"):
        check_file(path)


@pytest.mark.parametrize(
    "content, says", [(None, "there is no file"), ("{", "cannot be read"), ("[]", "cannot be read")]
)
def test_what_is_no_notebook_is_said(content, says, tmp_path):
    path = tmp_path / "lab.ipynb"
    if content is not None:
        path.write_text(content)
    with pytest.raises(ValueError, match=says):
        check_file(path)


TOO_LARGE = {
    "it is larger than 100 MB": {"outputs": "x" * (101 << 20)},
    "it is larger than 20 MB without its outputs": {"metadata": {"x": "y" * (21 << 20)}},
    "it holds more than 1,000,000 values without its outputs": {"metadata": {"x": [0] * 1_100_000}},
    "its code is longer than 1,000,000 characters": {"source": "x = 1\n" * 200_000},
}


@pytest.mark.parametrize("reason", TOO_LARGE)
def test_what_the_grader_does_not_take_for_its_size_is_not_ticked(reason, tmp_path, monkeypatch):
    """Neither in the file, nor without a word in the notebook, where that tells its kernel which file it is."""
    notebook = lab_notebook(TOPIC, right_answers(TOPIC))
    notebook["cells"][1] |= TOO_LARGE[reason]
    path = saved(tmp_path, notebook)
    with pytest.raises(ValueError, match=f"path: expected a notebook, .*{reason}"):
        check_file(path)
    monkeypatch.setenv("JPY_SESSION_NAME", str(path))
    assert why_its_file_is_not_graded() == ("" if "code" in reason else reason)


def test_outputs_of_any_size_are_not_read(tmp_path, capsys):
    notebook = lab_notebook(TOPIC, right_answers(TOPIC))
    notebook["cells"][1]["outputs"] = [{"data": {"image/png": "x" * (21 << 20)}}]
    assert said(saved(tmp_path, notebook), capsys)["iou"].startswith("\u2714")


def test_which_of_several_cells_counts_is_said_and_that_a_cell_must_be_code(tmp_path, capsys):
    notebook = lab_notebook(TOPIC, right_answers(TOPIC))
    at = next(i for i, cell in enumerate(notebook["cells"]) if cell["id"] == "iou")
    first_try = notebook["cells"][at] | {"source": WRONG_IOU}
    check_file(saved(tmp_path, notebook | {"cells": [*notebook["cells"][:at], first_try, *notebook["cells"][at:]]}))
    shown = capsys.readouterr().out
    assert "\u2714 iou is right" in shown and "Code cells 2 and 3 both define it, and the lower one counts" in shown
    notebook["cells"][at]["cell_type"] = "markdown"
    assert "is Markdown, and must be code" in said(saved(tmp_path, notebook), capsys)["iou"]


MALFORMED = {
    "a list": [],
    "cells that are none": {"cells": 3},
    "texts as cells": {"cells": ["a", "b"]},
    "numbers as cells": {"cells": [1, None]},
    "no kind of a cell": {"cells": [{"source": "x"}]},
    "metadata that is null": {"cells": [{"cell_type": "markdown", "metadata": None, "source": "x"}]},
    "a mark that is a list": {"cells": [{"cell_type": "markdown", "metadata": {"nbgrader": []}, "source": "x"}]},
    "a text that is a number": {
        "cells": [{"cell_type": "markdown", "metadata": {"nbgrader": {"grade": True, "grade_id": "q"}}, "source": 3}]
    },
}


@pytest.mark.parametrize("kind", MALFORMED)
def test_a_malformed_notebook_is_refused_in_words(tmp_path, kind):
    with pytest.raises(ValueError, match=r"path: expected a (notebook|lab)"):
        check_file(saved(tmp_path, MALFORMED[kind]))


def test_a_file_nested_deeper_than_json_can_be_read_is_refused_in_words(tmp_path):
    path = tmp_path / "deep.ipynb"
    path.write_text("[" * 100_000)
    with pytest.raises(ValueError, match="path: expected a notebook"):
        check_file(path)


def test_a_grade_id_reaches_no_terminal_as_it_is(tmp_path, capsys):
    """An escape code in it would clear the screen, or write a tick over a cross."""
    mark = {"grade": True, "solution": True, "grade_id": "explain\x1b[2J\u202e"}
    cell = {"cell_type": "markdown", "metadata": {"nbgrader": mark}, "source": ""}
    notebook = lab_notebook(TOPIC)
    check_file(saved(tmp_path, notebook | {"cells": [*notebook["cells"], cell]}))
    shown = capsys.readouterr().out
    assert "explain\\x1b[2J\\u202e" in shown and "\x1b" not in shown and "\u202e" not in shown


# ------------------------------------------------------------------------------------ which notebook runs


def test_without_a_name_it_is_the_folders_only_lab_or_the_one_that_the_editor_names(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("JPY_SESSION_NAME", raising=False)
    with pytest.raises(ValueError, match="this folder holds no lab; say which, such as"):
        check_file()
    mine = tmp_path / "Copy of 04_iou (1).ipynb"
    mine.write_bytes((ROOT / "labs" / TOPIC / f"{TOPIC}.ipynb").read_bytes())
    (tmp_path / "notes.ipynb").write_text(json.dumps({"cells": [], "metadata": {}, "nbformat": 4, "nbformat_minor": 5}))
    (tmp_path / "broken.ipynb").write_text("{")
    assert running_file(None, is_lab).name == mine.name
    assert all(is_lab(json.loads(path.read_bytes())) for path in ROOT.glob("solutions/*/*.ipynb"))  # texts alone, too
    (tmp_path / "second.ipynb").write_bytes(mine.read_bytes())
    with pytest.raises(ValueError, match=r"2 labs, Copy of 04_iou \(1\).ipynb, second.ipynb; say which"):
        check_file()
    monkeypatch.setenv("JPY_SESSION_NAME", str(tmp_path / "second.ipynb"))
    assert running_file(None, is_lab).name == "second.ipynb"
    monkeypatch.setenv("JPY_SESSION_NAME", str(tmp_path / "renamed since.ipynb"))
    shell = SimpleNamespace(user_ns={"__vsc_ipynb_file__": str(mine)})
    assert running_file(shell, is_lab).name == mine.name


@pytest.mark.parametrize("name", [(), ("04_iou.ipynb",)])
def test_on_colab_it_is_the_notebook_on_the_page_whatever_its_name(name, tmp_path, monkeypatch, capsys):
    """Colab's kernel has no file of the notebook, and asks the page for it."""
    monkeypatch.chdir(tmp_path)
    requests, page = [], json.loads((ROOT / "solutions" / TOPIC / f"{TOPIC}.ipynb").read_text(encoding="utf-8"))
    colab, message = ModuleType("google.colab"), ModuleType("google.colab._message")
    message.blocking_request = lambda kind, **options: requests.append(kind) or {"ipynb": page}
    colab._message = message
    for module in (colab, message):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setitem(sys.modules, "google", ModuleType("google"))
    assert check_file(*name)
    assert requests == ["get_ipynb"]
    n = len(asked(TOPIC))
    assert f"as it is now: {n} of {n} answers are right" in capsys.readouterr().out
