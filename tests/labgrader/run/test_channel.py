"""Replies: what a worker writes comes back the same, and whatever else comes is refused without harm."""

import pickle
import struct
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from labgrader.comparison import Problem, expected_cases
from labgrader.course import find
from labgrader.reply.sentences import diagnose
from labgrader.run import process as worker
from labgrader.run.channel import Changed, Text, decode

NUMBERS = [dtype for code in "bhilqBHILQ" for dtype in (np.dtype(code),)] + [
    np.dtype(t) for t in ("?", "f2", "f4", "f8")
]
arrays = st.sampled_from(NUMBERS).flatmap(
    lambda dtype: hnp.arrays(dtype, hnp.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=4))
)


def same(a, b) -> bool:
    a, b = np.asarray(a), np.asarray(b)
    return (
        a.shape == b.shape and a.dtype.kind == b.dtype.kind and a.itemsize == b.itemsize and a.tobytes() == b.tobytes()
    )


@settings(max_examples=60, deadline=None)
@given(arrays)
def test_an_array_comes_back_the_same(array):
    assert same(decode(worker.encode(array)), array)


@settings(max_examples=30, deadline=None)
@given(st.lists(arrays, max_size=4).map(tuple))
def test_a_tuple_comes_back_the_same(values):
    got = decode(worker.encode(values))
    assert isinstance(got, tuple) and len(got) == len(values) and all(map(same, got, values))


@settings(max_examples=30, deadline=None)
@given(arrays)
def test_layout_and_byte_order_do_not_matter(array):
    odd = np.asarray(array.T, dtype=array.dtype.newbyteorder(">"), order="F")
    assert same(decode(worker.encode(odd)), array.T)


def test_numbers_and_tensors_come_back_as_numbers_and_arrays():
    import torch

    assert decode(worker.encode(3)) == 3 and decode(worker.encode(True)) == np.True_
    assert decode(worker.encode(np.longdouble(0.5))) == 0.5
    got = decode(worker.encode((torch.arange(3, dtype=torch.float32), 2.5)))
    assert got[0].tolist() == [0.0, 1.0, 2.0] and got[0].dtype == np.float32 and got[1] == 2.5
    assert decode(worker.encode(torch.ones(2, requires_grad=True).to_sparse().to_dense())).tolist() == [1.0, 1.0]


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=80))
def test_no_bytes_do_harm(data):
    for reply in (data, b"V" + data, b"E" + data, b"Pkind\0" + data, b"M" + data, b"C\1\0V" + data, b"J" + data):
        try:
            got = decode(reply, text=reply[:1] == b"J")
        except ValueError:
            continue
        got = got.value if isinstance(got, Changed) else got
        parts = got if isinstance(got, tuple) else (got,)
        assert all(part is None or isinstance(part, Problem | Text | np.generic | np.ndarray) for part in parts)


@settings(max_examples=60, deadline=None)
@given(arrays, st.data())
def test_a_reply_with_a_byte_more_or_less_is_refused(array, data):
    reply = worker.encode(array)
    cut = data.draw(st.integers(1, len(reply) - 1))
    for forged in (reply[:cut], reply + b"\0"):
        with pytest.raises(ValueError):
            decode(forged)


@pytest.mark.parametrize(
    "forged",
    [
        b"J0.5",  # a text, where none is asked for
        b"V\xff" + struct.pack("<BB2q", 11, 2, 2**33, 2**31),  # overflows 64 bits
        b"V\xff" + struct.pack("<BB2q", 11, 2, -1, -1) + bytes(8),
        b"V\xff" + struct.pack("<BB2q", 11, 2, 2**33, 0),  # nothing, whose sums along an axis are 64 GB
        b"V\xff" + struct.pack("<BB", 12, 0) + bytes(8),  # no such dtype
        b"V\xff" + struct.pack("<BB9q", 1, 9, *[1] * 9) + bytes(1),
        b"V\x11" + struct.pack("<BB", 1, 0) * 17 + bytes(17),
        b"V",
        b"",
        b"X",
        b"C\0V\xff" + struct.pack("<BB", 1, 0) + bytes(1),  # changes its arguments at no position
        b"Oh",
        b"E\0",
    ],
)
def test_forged_claims_are_refused(forged):
    with pytest.raises(ValueError):
        decode(forged)


def test_truth_values_are_true_or_false():
    got = decode(b"V\xff" + struct.pack("<BBq", 0, 1, 3) + b"\x02\x00\xff")
    assert got.dtype == bool and got.view(np.uint8).tolist() == [1, 0, 1]


@pytest.mark.parametrize(
    ("reply", "says"),
    [
        (b"E" + struct.pack("<IB", 3, 0) + b"IndexError\0", "it raises IndexError"),
        (b"E" + struct.pack("<IB", 3, 0) + b"IndexError\0index 3 is out", "it raises IndexError: index 3 is out"),
        (b"E" + struct.pack("<IB", 3, 0) + b"KeyError\0\x1b[31m\n\xff", "it raises KeyError: [31m \ufffd"),
        (b"E" + struct.pack("<IB", 3, 0) + b"KeyError\0" + 999 * b"x", "it raises KeyError: " + 211 * "x"),
        (b"E" + struct.pack("<IB", 3, 0) + b"KeyError\0<f at 0x7f00aa10>", "it raises KeyError: <f at 0x...>"),
        (b"E" + struct.pack("<IB", 3, 0) + b"SecretIs42\0", "it raises an exception"),
        (b"E" + struct.pack("<IB", 3, 0) + b"print\0", "it raises an exception"),
        (b"Pkind\0expected an array or a number, got dict", "expected an array or a number, got dict"),
        (b"Pkind\0expected an array or a number, got SecretIs42", "expected an array or a number, got something else"),
        (b"Pkind\0it returns None: is a `return` missing?", "it returns None: is a `return` missing?"),
        (b"Pdtype\0expected real numbers, got dtype complex128", "expected real numbers, got dtype complex128"),
        (b"Pdtype\0<b>", "expected real numbers, got others"),
        (b"Pmissing\0its cell makes it a Secret42, not a function", "its cell makes it something else, not a function"),
        (b"Mscipy.ndimage", "there is no module scipy.ndimage where answers are graded"),
        (b"M<script>", "there is no module that where answers are graded"),
    ],
)
def test_only_known_words_and_short_messages_are_repeated(reply, says):
    assert decode(reply).says == says


def test_a_call_that_changes_its_argument_says_so():
    cell = "def f(a, b, c):\n    b[0] = 9.0\n    c[1].append(0)\n    return a + b\n"
    session, arguments = worker.Session(list), (np.ones(2), np.array([1.0, np.nan]), (1, [2]))
    assert session.answer(("run", "f", cell)) == b"O"
    got = decode(session.answer(("call", "f", pickle.dumps(arguments))))
    assert isinstance(got, Changed) and got.positions == (1, 2) and got.value[0] == 10.0
    session.program.namespace["f"] = lambda a, b, c: a
    assert same(decode(session.answer(("call", "f", pickle.dumps(arguments)))), arguments[0])


def test_an_exception_that_came_through_the_channel_is_explained():
    """In the words of the notebook's check, so that the class page counts it as named."""
    question = find("04_iou.confusion_matrix")
    cases = expected_cases(question, 0)
    for name, message, says in (
        ("IndexError", "index 255 is out of bounds for axis 0 with size 3", "labelled 255, are used as an index"),
        ("AxisError", "axis 1 is out of bounds for array of dimension 1", "There is no axis 1 here"),
        ("LinAlgError", "Singular matrix", "has no inverse"),
    ):
        problem = decode(b"E" + struct.pack("<IB", 0, 0) + f"{name}\0{message}".encode())
        problem = replace(problem, says=problem.says.removeprefix("it raises "))
        outputs = [problem if (case.args[0] == 255).any() else case.expected for case in cases]
        sentence = diagnose(question, cases, outputs)
        assert sentence.kind == "exception" and says in sentence.says
