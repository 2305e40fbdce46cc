"""The program that is cut out of a notebook: every honest submission is right, or is told why it cannot be graded."""

import numpy as np
import pytest
from submissions import Honest, as_editors_save_it, honest

from labgrader.course import course, find
from labgrader.program.cell import Cell, cells_of
from labgrader.program.live import LiveProgram
from labgrader.program.slice import program
from labgrader.reply.judge import judge

IOU = find("04_iou.iou")
BLANKS = ("confusion_matrix", "iou", "precision_recall", "mean_iou", "boundary_band")
HONEST = honest()


def cut(notebook: dict, name: str = "iou", **how):
    return program(cells_of(notebook["cells"]), name, BLANKS, course().packages, IOU.forbidden, course().kit, **how)


def cells(*sources) -> list[Cell]:
    """Cells from sources, or from sources with grade ids."""
    return [Cell(*source) if isinstance(source, tuple) else Cell(source) for source in sources]


def function(*sources, name: str = "f", **how):
    """What the program of cells defines."""
    found = program(cells(*sources), name, **how)
    assert not found.refused
    return LiveProgram(name, found.pieces).answer


def test_there_are_submissions_enough():
    assert len({submission.name for submission in HONEST}) == len(HONEST) >= 90


@pytest.mark.parametrize("submission", HONEST, ids=lambda submission: submission.name)
def test_an_honest_submission_is_right_or_is_told(submission: Honest):
    found = cut(submission.notebook())
    if submission.refused:
        assert submission.refused in found.refused and not found.pieces
        return
    assert not found.refused
    answer = LiveProgram("iou", found.pieces).answer
    verdict = judge(IOU, answer, seed=5)
    assert verdict.passed, verdict


@pytest.mark.parametrize("editor", as_editors_save_it(HONEST[0]))
def test_editors_save_the_same_program(editor):
    assert cut(as_editors_save_it(HONEST[0])[editor]) == cut(HONEST[0].notebook())


def test_lines_keep_their_numbers():
    found = program(cells("# a\nx = 1\ny = 2\n\nz = 3", "def f():\n    return x + z"), "f")
    assert found.pieces == (("cell 1", "\nx = 1\n\n\nz = 3"), ("f", "def f():\n    return x + z"))


@pytest.mark.parametrize(
    "line, kept",
    [
        ("import numpy as np, matplotlib.pyplot as plt", "import numpy as np"),
        ("import numpy as np; import matplotlib.pyplot as plt; plt.style.use('x')", "import numpy as np"),
        ("größe = 1; import numpy as np; x = 3  # drawn", "import numpy as np"),
        ("import matplotlib; y = (1,\n 2); import numpy as np; y.split()", "\nimport numpy as np"),
        ("import numpy as np; plt.show()", "import numpy as np"),
    ],
)
def test_statements_on_one_line_come_apart(line, kept):
    found = program(cells(line, "def f(x):\n    return np.abs(x)"), "f")
    assert found.pieces[0][1].rstrip() == kept and len(found.pieces) == 2


# ------------------------------------------------------------------------------------- which definition counts

RIGHT_AND_LATER = ("k = 1", ("def f():\n    return k", "f"), "k = 2", "def f():\n    return 5")


def test_in_a_saved_notebook_the_nearest_above_counts_and_the_marked_cell_is_the_answer():
    assert function(*RIGHT_AND_LATER)() == 1
    assert function(*RIGHT_AND_LATER[1:])() == 2  # below, if there is none above


def test_what_cells_below_define_anew_makes_a_second_program():
    found = program(cells(*RIGHT_AND_LATER[:3]), "f")
    assert LiveProgram("f", found.late.pieces).answer() == 2
    assert program(cells(*RIGHT_AND_LATER[:2], RIGHT_AND_LATER[0]), "f").late is None  # the same once more
    asked = cells("import labkit\ndef h():\n    return labkit", "def f():\n    return h()", "def h():\n    return 3")
    found = program(asked, "f", kit=["labkit"])
    assert "labkit" in found.refused and LiveProgram("f", found.late.pieces).answer() == 3


@pytest.mark.parametrize(
    "marks, value, copies", [("ff", 2, (1, 2)), ("f ", 1, ()), (" f", 2, ()), ("fff", 3, (1, 2, 3))]
)
def test_of_several_cells_with_the_answers_grade_id_the_last_counts(marks, value, copies):
    """As a run from top to bottom leaves it; a cell copied to try again, or split, has its grade id twice."""
    sources = [(f"def f():\n    return {i}", mark.strip()) for i, mark in enumerate(marks, 1)]
    assert function(*sources)() == value
    found = program(cells(*sources), "f")
    assert found.copies == copies and bool(found.note) == bool(copies)
    blank = ("def f():\n    raise NotImplementedError", "f")
    assert function(*sources, blank)() == value  # a copy that holds no answer is none
    broken = ("def f(:", "f")
    assert function(*sources, broken)() == value


def test_a_split_cell_is_one_answer():
    parts = ("def half(x):\n    return x / 2", "f"), ("def f(x):\n    return half(x)", "f"), ("f(3)", "f")
    assert function(*parts)(3) == 1.5 and not program(cells(*parts), "f").note


@pytest.mark.parametrize(
    "sources, value",
    [
        (("k = 2", "k += 1", "def f():\n    return k"), 3),
        (("k = [1]", "k.append(2)", "k = [2 * n for n in k]; k.append(6)", "def f():\n    return k"), [2, 4, 6]),
        (("k = 5", "k = k + 1", "j = k; k = 0", "def f():\n    return j"), 6),
        (("def g():\n    return 1", "def g(of=g):\n    return of() + 1", "def f():\n    return g()"), 2),
        (("k = 1", "class A:\n    j = k + 1\nk = A.j", "def f():\n    return k"), 2),
        (("k = 1", "def k():\n    return k", "def f():\n    return k() is k"), True),  # which calls itself
        (("max = max", "def f():\n    return max([1, 2])"), 2),
    ],
)
def test_a_value_that_is_made_of_the_one_before_has_that_one_with_it(sources, value):
    """As a run from top to bottom does, which is the judge."""
    names = {}
    for source in sources:
        exec(source, names)
    assert names["f"]() == value
    assert function(*sources)() == value


def test_the_split_off_half_of_an_answer_may_wrap_the_other():
    half, wrap = ("def f(x):\n    return x / 2", "f"), ("def wrap(g):\n    return lambda x: g(x) + 1\nf = wrap(f)", "f")
    first, other = ("def f(x):\n    return 0", "f"), ("def h():\n    return 1", "h")
    for parts, copies in ((half, wrap), ()), ((half, other, wrap), ()), ((first, half, wrap), (1, 2)):
        assert function(*parts)(3) == 2.5
        assert program(cells(*parts), "f").copies == copies
    assert function(half, wrap, half)(3) == 1.5


@pytest.mark.parametrize("label", [" HEAD", ""])
def test_gits_marks_in_a_cell_are_named(label):
    source = f"import math\n<<<<<<<{label}\nk = 1\n=======\nk = 2\n>>>>>>> theirs\ndef f():\n    return k"
    refused = program(cells((source, "f")), "f").refused
    said = "it has git's conflict marks, the first in line 2: keep one of the versions"
    assert refused == f"its cell is not Python: {said}"
    assert "look at line 2" in program(cells(("def f():\n    return '\n=======\n'", "f")), "f").refused


def test_in_a_kernel_what_was_run_last_counts():
    assert function("k = 1", "def f():\n    return k", *RIGHT_AND_LATER[2:], latest=True)() == 5
    refused = program(cells(*RIGHT_AND_LATER), "f", latest=True).refused
    assert refused == "the cell of its task holds another f, which would be graded: put yours there"
    assert function(*RIGHT_AND_LATER[:3], latest=True)() == 2


def test_the_cells_own_definition_counts_before_any_other():
    assert (
        function("def g():\n    return 1", "def g():\n    return 2\ndef f():\n    return g()", "g = 3", latest=True)()
        == 2
    )


def test_a_builtin_is_the_builtin_unless_a_cell_above_replaces_it():
    answer = "def f():\n    return max([1, 2])"
    assert function(answer, "max = min")() == 2
    assert function("max = min", answer)() == 1


def test_a_variable_of_a_comprehension_is_no_name_of_its_cell():
    """From Python 3.12 on the comprehension's table is a part of the cell's."""
    assert function("n = 5", "q = [n for n in range(3)]", "def f():\n    return n")() == 5
    assert function("n = 5", "n = [n for n in range(3)]", "def f():\n    return n")() == [0, 1, 2]


# ------------------------------------------------------------------------------------ answers that call answers

SETUP = "import numpy as np"
FIRST = ("def iou(n):\n    return np.ones(len(n))", "iou")
SECOND = ("def mean_iou(n):\n    return np.mean(iou(n.sum(0)))", "mean_iou")


def test_an_answer_that_calls_another_has_that_one_with_it():
    found = program(cells(SETUP, FIRST, SECOND), "mean_iou", BLANKS)
    assert found.calls == ("iou",) and [name for name, _ in found.pieces] == ["cell 1", "cell 2", "mean_iou"]
    assert LiveProgram("mean_iou", found.pieces).answer(np.zeros((1, 2, 2))) == 1.0


def test_and_the_kits_in_its_place_if_that_one_is_wrong():
    kit = "def iou(n):\n    return 0.5"
    for first in (FIRST, ("def iou(n):\n    raise NotImplementedError", "iou"), ("def iou(:", "iou"), "pass"):
        found = program(cells(SETUP, first, SECOND), "mean_iou", BLANKS, given={"iou": kit})
        assert found.calls == ("iou",) and LiveProgram("mean_iou", found.pieces).answer(np.zeros((1, 2, 2))) == 0.5


def test_and_the_kits_brings_the_import_that_it_needs():
    """The student's own cells use NumPy nowhere."""
    own = ("def mean_iou(n):\n    return sum(iou(n)) / len(n)", "mean_iou")
    found = program(cells(own), "mean_iou", BLANKS, given={"iou": IOU.source})
    assert LiveProgram("mean_iou", found.pieces).answer(np.eye(2)) == 1.0


def test_a_check_does_not_redefine_what_it_checks():
    found = program(cells(SETUP, FIRST, 'iou = check("04_iou.iou", iou)', SECOND), "mean_iou", BLANKS, latest=True)
    assert LiveProgram("mean_iou", found.pieces).answer(np.zeros((1, 2, 2))) == 1.0


# -------------------------------------------------------------------------------------------- strangers' text


@pytest.mark.parametrize(
    "source",
    [
        "(" * 5000,
        "x" + ".a" * 50_000,
        "-" * 100_000 + "1",
        "\0",
        "def f(:",
        "%%",
        "?" * 1000,
        "%time",
        "x = 1\n" * 5_000,
    ],
    ids=range(9),
)
def test_no_text_of_another_cell_stops_the_program(source):
    assert function(source, ("def f():\n    return 1", "f"))() == 1
    assert program(cells((source, "f")), "f").refused


@pytest.mark.parametrize(
    "notebook_cells", [None, 3, {}, [[]], [{"cell_type": "code"}], [{"cell_type": "code", "source": 3}]]
)
def test_cells_that_are_none_are_left_out(notebook_cells):
    assert cells_of(notebook_cells) == []
