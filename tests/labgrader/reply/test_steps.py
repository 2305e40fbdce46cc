"""The last right step of a wrong answer, and a second mistake beside a listed one."""

import numpy as np
import pytest

from labgrader.course import find
from labgrader.program.slice import Program
from labgrader.reply.steps import last_right_step, values_of_a_right_answer
from labgrader.run import plain
from labgrader.run.run import Answer, Limits, public_cases

pytestmark = pytest.mark.bad_input  # without the shape checks, as outside the suite


def right(n):
    total = n.sum(axis=0) + n.sum(axis=1)
    tp = np.diag(n)
    return tp / (total - tp)


N = np.array([[5.0, 1.0, 0.0], [2.0, 7.0, 1.0], [0.0, 3.0, 4.0]])


def step(body: str) -> str:
    """The marked part of an answer with this body."""
    text = "def right(n):\n" + "".join(f"    {line}\n" for line in body.split("; "))
    found = last_right_step((("f", text),), "right", [(args, values_of_a_right_answer(right, args)) for args in CASES])
    (span,) = found[0].spans if found else (None,)
    return text.split("\n")[span.line - 1][span.column : span.end] if span else ""


CASES = [(N,), (N @ N,)]


@pytest.mark.parametrize(
    "body, marked",
    [
        ("t = n.sum(0) + n.sum(1); return n.diagonal() / t", "n.sum(0) + n.sum(1)"),
        ("a = n.sum(0); b = n.sum(1); return n.diagonal() / (a * b)", "n.sum(1)"),
        ("t = n.sum(0) + n.sum(1); t -= np.diag(n); t[0] = 0; return t * np.abs(t)", "n.sum(0) + n.sum(1)"),
        ("b, a = n.sum(0) + n.sum(1), 1; return a / b", "n.sum(0) + n.sum(1)"),
        ("a, b, c = n.sum(0) + n.sum(1); return a / b", "n.sum(1)"),  # a name may have got another's part
        ("return n[0] * n[1]", ""),  # parts of an argument say nothing
        ("return np.zeros(3) + 1", ""),  # nor do equal numbers
        ("while True: n = n + 0", ""),
        ("return missing(n)", ""),
    ],
)
def test_the_last_step_whose_numbers_a_right_answer_computes_is_marked(body, marked):
    assert step("import numpy as np; " + body) == marked


def test_an_argument_is_left_as_it_is():
    before = N.copy()
    values_of_a_right_answer(right, (N,))
    step("n[0] = 0; return n")
    assert np.array_equal(N, before)


def reply(name: str, source: str) -> str:
    """What is said of a wrong answer, with the marked lines."""
    question = find(name)
    pieces = ("quiet", "import numpy as np"), (question.function, source)
    with Answer(question, Program(pieces), plain.fresh_worker, Limits()) as run:
        verdict, _ = run.judged(public_cases(question))
        said = type(verdict)(**{**vars(verdict), "findings": run.findings()}).sentence
    return "\n".join([*("\n".join(line.plain()) for line in said.marked), said.says])


def test_two_slips_of_which_one_is_listed_are_both_named():
    said = reply(
        "09_other_stacks.enlarge",
        "def enlarge(labels, size):\n    h, w = labels.shape\n    H, W = size\n"
        "    return labels[np.arange(H) * h // H][:, np.arange(W) * w // W]\n",
    )
    assert "H, W = size" in said and "Perhaps two things are wrong. One is this" in said and "centre" in said
    said = reply(
        "07_grasp.pad_slice",
        "def pad_slice(P, T_base_grasp, half):\n    Q = (P - T_base_grasp[:3, 3]) @ T_base_grasp[:3, :3]\n"
        "    y = Q[np.abs(Q[:, 0]) < half, 1]\n    if len(y) == 0:\n        return 0.0, 0.0\n"
        "    return y.mean(), np.ptp(y)\n",
    )
    assert "One is this: A mean leans" in said and "<" in said


def test_a_slip_that_a_name_in_its_place_would_hide_is_not_called_a_listed_one():
    said = reply(
        "05_class_weights.least_cost", "def least_cost(q, cost):\n    return (cost @ q[..., None])[..., 0].argmax(-1)\n"
    )
    assert "most likely class" not in said  # which is that of argmax(q), and this is none


def test_where_nothing_is_known_the_last_right_step_is_told():
    said = reply(
        "04_iou.iou",
        "def iou(n):\n    rows = n.sum(axis=1)\n"
        "    return [round(t / r, 3) if r else 0.0 for t, r in zip(np.diag(n), rows)]\n",
    )
    assert "rows = n.sum(axis=1)" in said and "numbers that a right answer has on its way" in said
