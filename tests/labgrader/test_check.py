"""The student's check: what it shows in a terminal and in Jupyter, what it returns; and it never stops a notebook."""

import re
import subprocess
import sys
from types import SimpleNamespace
from xml.etree import ElementTree

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient
from nbformat.v4 import new_code_cell, new_notebook

from labgrader import check as checking
from labgrader.check import CheckFailed, Shown
from labgrader.program.cell import Cell, Parsed
from labgrader.question import Misconception, Property, Question
from labgrader.reply.finding import WATCHES
from labgrader.reply.messages import Marked
from labkit import check

SECRET = 0.7312684519  # a number that only the reference knows


def share(n):
    """Divide by the sum."""
    return n / n.sum() + SECRET


QUESTION = Question(
    name="00_test.share",
    reference=share,
    inputs=lambda rng: (rng.random((2, 3)) + 0.1,),
    by_hand=((np.array([[1.0, 3.0]]),),),
    properties=[Property("shares are not over two", lambda n, got: bool(np.max(got) <= 2))],
    misconceptions=[Misconception(lambda n: n / n.sum(axis=1, keepdims=True), "Do all of them sum to one?")],
)


@pytest.fixture(autouse=True)
def one_question(monkeypatch):
    """Let the check find the question above, and no environment make it strict."""
    monkeypatch.delenv("LABKIT_STRICT", raising=False)
    find = checking.find
    monkeypatch.setattr(checking, "find", lambda name: QUESTION if name == QUESTION.name else find(name))
    of_topic = checking.of_topic
    monkeypatch.setattr(checking, "of_topic", lambda topic: {} if topic == QUESTION.topic else of_topic(topic))


def blank(n):
    # your lines
    raise NotImplementedError


def right(n):
    return n / np.sum(n) + SECRET


def transposed(n):
    total = n.sum()
    return n.T / total


def crash(n):
    total = n.sum()
    return n / total[0]


def rows(n):
    return n / n.sum(axis=1, keepdims=True)


def loud(n):
    print("hello\n" * 5000)
    return right(n)


def alters(n):
    n /= n.sum()
    return n + SECRET


def nine_more(n):
    return n + 9


def flags(n):
    return n > 0


ITS_LINE = Marked(alters.__code__.co_firstlineno + 1, "n /= n.sum()", ((0, 12),))
HERE = "  In hand-made case 1 of 1:\n      share([[1, 3]])\n"
CASES = [
    (right, "✔ share is right\n  Passed 1 hand-made and 4 random cases."),
    (blank, "○ share: not answered yet\n  The kit's function stands in for it below."),
    (rows, "✘ share: 2 of 2 values are wrong\n" + HERE +
           "      returns   [[0.25, 0.75]]\n      expected  [[0.98127, 1.4813]]\n  Hint: Do all of them sum to one?"),
    (transposed, "✘ share: expected shape (1, 2), got (2, 1)\n" + HERE +
           "      returns   [[0.25], [0.75]]\n      expected  [[0.98127, 1.4813]]\n"
           "  Hint: Do the case above by hand, and print what each of your lines gives for it."),
    (nine_more, "✘ share: 2 of 2 values are wrong\n" + HERE +
           "      returns   [[10, 12]]\n      expected  [[0.98127, 1.4813]]\n"
           "  Hint: Every right answer has this property, and yours does not: shares are not over two."),
    (flags, "✘ share: expected real numbers, got dtype bool\n" + HERE +
           "      returns   [[True, True]]\n      expected  [[0.98127, 1.4813]]\n"
           "  Hint: Do the case above by hand, and print what each of your lines gives for it."),
    (alters, "✘ share: it changes its argument n: work on a copy; what calls it still needs the old values\n  "
           + "\n  ".join((*ITS_LINE.plain(), f"Hint: {WATCHES['writes']}"))),
    (loud, "✔ share is right\n  Passed 1 hand-made and 4 random cases.\n"
           "  It prints: hello\n  It prints: hello\n  It prints: hello\n  ..."),
    (7, "✘ share is not a function\n  It is of type int."),
    (None, "✘ share is not a function\n  It is of type NoneType."),
]  # fmt: skip


@pytest.mark.parametrize("answer, shown", CASES)
def test_what_is_shown_in_a_terminal(answer, shown, capsys):
    go_on = check("00_test.share", answer)
    assert capsys.readouterr().out == shown + "\n"
    assert getattr(go_on, "__wrapped__", go_on) is (answer if shown.startswith("✔") else share)


def test_a_strict_check_raises_what_it_would_show(monkeypatch):
    monkeypatch.setenv("LABKIT_STRICT", "1")
    for answer, shown in CASES:
        if shown.startswith("✔"):
            assert check("00_test.share", answer).__wrapped__ is answer
        else:
            with pytest.raises(CheckFailed, match=re.escape(shown.splitlines()[0])):
                check("00_test.share", answer)


def test_an_exception_shows_the_students_line(capsys):
    check("00_test.share", crash)
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert first.startswith("✘ share: IndexError: invalid index to scalar variable")
    assert second == f"  line {crash.__code__.co_firstlineno + 2}:  return n / total[0]"


def test_whatever_an_answer_raises_or_is_the_notebook_goes_on(capsys):
    def leave(n):
        sys.exit(1)

    def stop(n):
        raise KeyboardInterrupt

    def again(n):
        return again(n)

    def itself(n):
        return itself

    for answer in (leave, stop, again, itself, print, np.linalg.inv, type, dict, lambda: 0, lambda *n: n):
        assert check("00_test.share", answer) is share
        assert capsys.readouterr().out.startswith("✘ share")


def test_the_kits_function_is_not_taken_for_the_students(capsys):
    """The check's cell run twice gets its own function the second time, and must not praise it."""
    go_on = check("00_test.share", blank)
    assert check("00_test.share", go_on) is share
    assert "this is the kit's function, not yours" in capsys.readouterr().out


def test_a_cell_that_python_cannot_read_is_said_and_not_taken_for_the_kits_function(monkeypatch):
    """Jupyter keeps what ran; the answer's own cell counts, as it was run last."""
    ran = [
        "",
        "import numpy as np",
        "def share(n):\n    return n",
        "def share(n):\n    total = n.sum(\n    return total",
    ]
    shell = SimpleNamespace(history_manager=SimpleNamespace(input_hist_raw=ran))
    monkeypatch.setattr(checking, "jupyter", lambda: shell)
    first, line, again = repr(checking.broken_cell(QUESTION)).splitlines()
    assert first == "✘ share: its cell is not Python: look at line 2" and line == "  line 2:  total = n.sum("
    assert "None of it has run" in again
    ran += ["shared = share(2", "def sharing(n:"]  # cells that only use it, or define another
    assert checking.broken_cell(QUESTION) is not None
    ran += ["def share(n):\n    return n"]
    assert checking.broken_cell(QUESTION) is None


def test_a_first_answer_that_is_not_python_is_said_by_its_check(monkeypatch, capsys):
    """Nothing has the answer's name, so that the check's line would be a NameError."""
    space, history = {}, ["def share(n):\n    return n.sum("]
    shell = SimpleNamespace(history_manager=SimpleNamespace(input_hist_raw=history), user_ns=space)
    monkeypatch.setattr(checking, "jupyter", lambda: shell)
    monkeypatch.setattr(checking.Page, "show", lambda page, shown: print(shown))
    line = "share = check('00_test.share', share)"
    checking.note_cell(SimpleNamespace(store_history=True, raw_cell=line))
    exec(line, space | {"check": check})
    assert capsys.readouterr().out.startswith("✘ share: its cell is not Python: look at line 2")
    space.clear()
    history[:] = ["def share(n):\n    return n"]  # one that is Python, and has not run
    checking.note_cell(SimpleNamespace(store_history=True, raw_cell=line))
    assert not space


def test_an_ipython_that_tells_no_cell_ids_is_no_hindrance(monkeypatch):
    """IPython 7, which Colab has."""
    before = dict(checking.cell_of_execution)
    checking.note_cell(SimpleNamespace(store_history=True, raw_cell="1 + 1"))
    assert checking.cell_of_execution == before


def test_an_unknown_question_is_said_and_the_answer_goes_on(capsys):
    assert check("04_iou.no_such", right) is right
    assert "expected one of 04_iou." in capsys.readouterr().out
    assert check("no_topic.iou", right) is right


# ------------------------------------------------------------------------------------------ in Jupyter


def test_html_says_the_same_in_colour_and_escapes_what_students_write():
    shown = Shown("✘", "share: NameError: <b>x</b>", "line 2:  return a < b & c", "Hint: 'why'?")
    page = ElementTree.fromstring(shown._repr_html_().replace("<br>", "<br/>"))  # every tag is closed
    assert "".join(page.itertext()) == "✘ share: NameError: <b>x</b>line 2:  return a < b & cHint: 'why'?"
    colours = {mark: Shown(mark, "x")._repr_html_() for mark in "✔✘○"}
    assert len(set(re.findall(r"#[0-9a-f]{6}", "".join(colours.values())))) == 3


def executed(cells, folder):
    """The outputs of the cells of a notebook that runs in a kernel of its own."""
    notebook = new_notebook(cells=[new_code_cell(cell) for cell in cells])
    for cell in notebook.cells:
        cell.metadata["tags"] = ["raises-exception"] if Parsed(Cell(cell.source)).problem else []
    NotebookClient(
        notebook, timeout=250, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
    ).execute()
    nbformat.validate(notebook)
    return [cell.outputs for cell in notebook.cells]


def test_the_counterexample_comes_at_once_and_the_marked_line_joins_it(tmp_path):
    cells = [
        "import numpy as np\nfrom labkit import check\nfrom labgrader import check as checking\n"
        "from labgrader.run import run\nrun.LOOK_S = 200.0\n"
        "checking.LIMITS = run.Limits(case_s=200.0, question_s=200.0)\n"
        "seen, show = [], checking.Page.show\n"
        "checking.Page.show = lambda page, shown: (seen.append(repr(shown)), show(page, shown))",
        "def iou(n):\n    i = np.diag(n)\n    return i / (n.sum(0) - n.sum(1) - i)",
        "iou = check('04_iou.iou', iou)\nprint(len(seen), checking.LOOKING in seen[0], 'Look at' in seen[0])",
        "print(seen[0].splitlines()[:5] == seen[1].splitlines()[:5])",
    ]
    *_, (shown, said), (same,) = executed(cells, tmp_path)
    assert said.text == "2 True False\n" and same.text == "True\n"
    label = "Look at line 3:  "
    line = f"  {label}return i / (n.sum(0) - n.sum(1) - i)"
    text = shown.data["text/plain"]
    assert f"{line}\n{' ' * line.index('-')}^\n  Hint: The marked place needs another operator." in text
    assert f"{label}<code>return i / (n.sum(0) <mark>-</mark> n.sum(1) - i)</code>" in shown.data["text/html"]
    assert checking.LOOKING not in text


def test_a_notebook_runs_through_a_blank_a_mistake_and_a_right_answer(tmp_path):
    """In a real kernel: one display a check, the student's line as it stands in the cell, then the kit's function."""
    cells = [
        "from labkit import check\nimport numpy as np",
        "def iou(n):\n    raise NotImplementedError",
        "iou = check('04_iou.iou', iou)\nprint(iou(np.eye(2, dtype=int)))",
        "def helper(n):\n    return n[99]\n",
        "def iou(n):\n    x = 1\n    return helper(n)",
        "iou = check('04_iou.iou', iou)",
        "def iou(n):\n    while True: pass",
        "from labgrader import check as checking\nlimits, checking.LIMITS = checking.LIMITS, "
        "checking.Limits(question_s=0.5)\niou = check('04_iou.iou', iou)\nchecking.LIMITS = limits",
        "def iou(n):\n    i = np.diag(n)\n    with np.errstate(invalid='ignore'):\n"
        "        return i / (n.sum(0) + n.sum(1) - i)",
        "mine = iou\niou = check('04_iou.iou', iou)\nprint(iou.__wrapped__ is mine)",
        "other = check('04_iou.iou', lambda n: np.diag(n) / n.sum(0))\nprint(other is iou)",
    ]
    outputs = executed(cells, tmp_path)
    shown = [[o.data["text/plain"] for o in cell if o.output_type == "display_data"] for cell in outputs]
    assert [len(texts) for texts in shown] == [0, 0, 1, 0, 0, 1, 0, 1, 0, 1, 1]
    assert shown[2][0].startswith("○ iou: not answered yet")
    assert "[1. 1.]" in outputs[2][-1].text
    assert "IndexError" in shown[5][0] and "line 2:  return n[99]" in shown[5][0]
    assert "did not return in time" in shown[7][0]
    assert shown[9][0].startswith("✔ iou is right") and outputs[9][-1].text == "True\n"
    assert shown[10][0].startswith("✘ iou cannot be graded") and "not the iou of your notebook" in shown[10][0]
    assert outputs[10][-1].text == "False\n"  # not the notebook's, which is right: it was not asked about
    assert "text/html" in outputs[9][0].data
    assert not [o for cell in outputs for o in cell if o.output_type == "stream" and o.name == "stderr"]


def test_the_first_check_of_a_notebook_says_that_the_first_answer_is_not_python(tmp_path):
    """Nothing of the grader has run by then but the import of `check`."""
    cells = [
        "from labkit import check\nimport numpy as np",
        "def iou(n):\n    i = np.diag(n)\n    return i / (n.sum(0) + n.sum(1)",
        "iou = check('04_iou.iou', iou)",
    ]
    *_, (error,), (shown,) = executed(cells, tmp_path)
    assert error.ename == "SyntaxError"
    assert shown.data["text/plain"].startswith("✘ iou: its cell is not Python: look at line 3")


FIRST_TRY = "def iou(n):\n    return n / 2"
IOU = (
    "def iou(n):\n    i = np.diag(n)\n    with np.errstate(all='ignore'):\n        return i / (n.sum(0) + n.sum(1) - i)"
)
MEAN_IOU = "def mean_iou(n_frames):\n    return np.nanmean(iou(n_frames.sum(axis=0)))"
CHECK_MEAN = ("mean_iou = check('04_iou.mean_iou', mean_iou)", "check_mean_iou")
CHECK = ("iou = check('04_iou.iou', iou)", "check_iou")


IN_CELLS = [
    ([(FIRST_TRY, "iou"), (IOU, "mine"), CHECK], "✘ iou cannot be graded: the cell of its task holds another iou"),
    ([(FIRST_TRY, "iou"), (IOU, "iou"), CHECK], "✔ iou is right"),
    ([(FIRST_TRY, "mine"), (IOU, "iou"), CHECK], "✔ iou is right"),
    ([(IOU, "iou"), (IOU, "mine"), CHECK], "✔ iou is right"),
    ([(IOU, "a-cell-of-another-editor"), CHECK], "✔ iou is right"),
    ([(MEAN_IOU, "mean_iou"), CHECK_MEAN], "✔ mean_iou is right"),  # of a kernel that has just started
    ([("import tempfile\n" + IOU + " + 0 * len(tempfile.gettempdir())", "iou"), CHECK], "an answer writes no file"),
    ([("def iou(n):\n    return open('scores')", "iou"), CHECK], "an answer opens no file"),
]


def test_a_notebooks_check_takes_the_cell_that_will_be_graded():
    """Jupyter tells with each cell that runs its id, which is the answer's name in a released lab.

    Each notebook has a shell and a kit of its own, one after the other in one process.
    """
    first = ("from labkit import check\nimport numpy as np", "setup")
    program = f"""
import linecache, sys
from IPython.core.interactiveshell import InteractiveShell
for cells in {[[first, *cells] for cells, _ in IN_CELLS]!r}:
    print("=== a notebook")
    shell = InteractiveShell.instance()
    for source, cell in cells:
        shell.run_cell(source, store_history=True, cell_id=cell).raise_error()
    InteractiveShell.clear_instance()
    linecache.clearcache()
    for name in [name for name in sys.modules if name.partition(".")[0] in ("labkit", "labgrader", "labcourse")]:
        del sys.modules[name]
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    _, *said = done.stdout.split("=== a notebook\n")
    for text, (cells, shown) in zip(said, IN_CELLS, strict=True):
        assert shown in text, cells
