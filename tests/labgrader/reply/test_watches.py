"""What the watches show of a wrong answer, and that they are silent where no wrong output hangs on it."""

import numpy as np
import pytest

from labgrader.reply.watches import watch

pytestmark = pytest.mark.bad_input  # without the shape checks, as outside the suite


def softmax(z):
    e = np.exp(z - z.max())
    return e / e.sum()


def shares(n):
    return np.divide(n, n.sum(), out=np.zeros(n.shape), where=n.sum() > 0)


def mean_or_nan(n):
    with np.errstate(all="ignore"):
        return n.sum() / np.float64(n.size)


def right(expected, got):
    return np.shape(expected) == np.shape(got) and np.allclose(expected, got, equal_nan=True)


def near(x):
    return np.exp(-(x.astype(float) ** 2).sum())


BYTES = (np.array([0, 3], np.uint8),)
Z = (np.array([1.0, 2.0]), np.array([3.0, 1000.0]))
N = (np.array([3.0, 1.0]), np.zeros(2))
# A reference, arguments, an answer, and what is found with its marked part.
FOUND = [
    (softmax, Z, "def f(z):\n    e = np.exp(z)\n    return e / e.sum()", [("overflow", "np.exp(z)")]),
    (softmax, Z, "e = lambda z: np.exp(z)\ndef f(z): return e(z) / e(z).sum()", [("overflow", "np.exp(z)")]),
    (near, BYTES, "def f(x):\n    d = (x * x).sum()\n    return np.exp(-d)", [("wraps", "-d")]),
    (softmax, Z, "def f(z):\n    return np.log(z - 5)", [("no number", "np.log(z - 5)")]),
    (shares, N, "def f(n):\n    s = n.sum()\n    return n * (1 / s)", [("division", "1 / s")]),
    (shares, N, "def f(n):\n    n /= max(n.sum(), 1)\n    return n", [("writes", "n /= max(n.sum(), 1)")]),
    (shares, N, "def f(n):\n    n.sort()\n    return shares(n)\n", [("writes", "n.sort()")]),
    # A line that writes what is there already is right.
    (shares, N, "def f(n):\n    n[0] = n[0]\n    n += 1\n    return n / n.sum()", [("writes", "n += 1")]),
]  # fmt: skip
SILENT = [
    (mean_or_nan, (np.ones(3), np.zeros(0)), "def f(n):\n    return n.sum() / np.float64(n.size)"),  # NaN on purpose
    (mean_or_nan, (np.ones(3), np.zeros(0)), "def f(n):\n    return n.sum() / np.float64(n.size) + (n.size > 0)"),
    (softmax, Z, "def f(z):\n    np.exp(z)\n    return 0 * z"),  # overflows, and nothing that is wrong hangs on it
    (softmax, Z[:1], "def f(z):\n    return np.exp(z)"),  # wrong, and nothing overflows
    (softmax, Z, "def f(z):\n    return np.exp(z) / 7"),  # what overflows is not the case that is shown
    (shares, N, "def f(n):\n    return undefined"),
    (shares, N, "def f(n:\n"),
    (shares, N, "def g(n):\n    return n"),
    (shares, N, "def f(n):\n    while True: pass"),
    (shares, N, "def f(n):\n    raise SystemExit"),
]


def watched(reference, arguments, source):
    """Kinds and marked texts of what the watches find."""
    pieces = ("quiet", "import numpy as np"), ("shares, the kit's", "def shares(n): return n"), ("f", source)
    found = watch(pieces, "f", [((a,), reference(a)) for a in arguments], right)
    texts = [source.split("\n")[span.line - 1][span.column : span.end] for f in found for span in f.spans]
    return list(zip([f.kind for f in found], texts, strict=True)), found


@pytest.mark.parametrize("reference, arguments, source, shown", FOUND)
def test_the_line_is_found(reference, arguments, source, shown):
    assert watched(reference, arguments, source)[0] == shown


@pytest.mark.parametrize("reference, arguments, source", SILENT)
def test_nothing_is_found_where_nothing_hangs_on_it(reference, arguments, source):
    assert watched(reference, arguments, source)[0] == []


def test_the_number_that_is_too_large_is_told():
    (finding,) = watched(softmax, Z, "def f(z): return np.exp(z) / np.exp(z).sum()")[1]
    assert finding.exponent == 1000.0
