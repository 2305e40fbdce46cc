"""Mutations of a program: each kind is made somewhere, marks its place, and leaves the tree as it was."""

import ast

import pytest

from labgrader.reply.finding import REPAIRS
from labgrader.reply.mutation import mutations

pytestmark = pytest.mark.bad_input  # without the shape checks, which wrap every recipe

# A kind, a function, what it becomes, and the parts that are marked.
MADE = [
    ("comparison", "def f(a, b): return a < b", "a <= b", ["<"]),
    ("operator", "def f(a, b): return a + b", "a - b", ["+"]),
    ("operator", "def f(a, b):\n    a += b\n    return a", "a -= b", ["a += b"]),
    ("axis", "def f(a): return a.sum(axis=0)", "a.sum(axis=1)", ["axis=0"]),
    ("axis", "def f(a): return a.max(axis=0) - a.min(axis=0)", "a.max(axis=1) - a.min(axis=1)", ["0", "0"]),
    ("axis", "def f(a): return np.sum(a)", "np.sum(a, axis=0)", ["np.sum(a)"]),
    ("name", "def f(a, b): return a", "return b", ["a"]),
    ("sign", "def f(a): return -a", "return a", ["-a"]),
    ("absolute", "def f(a): return a", "return np.abs(a)", ["a"]),
    ("not", "def f(a): return a > 0", "~(a > 0)", ["a > 0"]),
    ("order", "def f(a, b): return np.arctan2(a, b)", "np.arctan2(b, a)", ["a", "b"]),
    ("order", "def f(a, b): return a[0, 1]", "a[1, 0]", ["0", "1"]),
    ("brackets", "def f(a, b): return a - b + 1", "a - (b + 1)", ["a - b + 1"]),
    ("constant", "def f(a): return a[1]", "a[2]", ["1"]),
    ("constant", "def f(a): return np.where(a, np.nan, a)", "np.where(a, 0.0, a)", ["np.nan"]),
    ("slice", "def f(a): return a[1:]", "a[:]", ["1:"]),
    ("slice", "def f(a): return a[:2]", "a[:2 + 1]", [":2"]),
    ("part", "def f(a): return a.max()", "a[:, 0].max()", ["a"]),
    ("branch", "def f(a):\n    if a: b = 1\n    else: b = 2\n    return b", "def f(a):\n    b = 2", ["if a"]),
    ("branch", "def f(a):\n    if a: b = 1\n    else: b = 2\n    return b", "def f(a):\n    b = 1", ["b = 2"]),
    ("always", "def f(a):\n    if a: a = 1\n    return a", "def f(a):\n    a = 1", ["if a"]),
    ("branch", "def f(a): return 1 if a else 2", "return 2", ["1"]),
    ("type", "def f(a): return a.astype(np.uint8)", "a.astype(float)", ["np.uint8"]),
    ("option", "def f(a): return np.zeros(3, dtype=int)", "np.zeros(3)", ["dtype=int"]),
    ("option", "def f(a): return np.pad(a, 1, mode='edge')", "mode='constant'", ["'edge'"]),
    ("function", "def f(a): return np.argmin(a)", "np.argmax(a)", ["np.argmin"]),
    ("transpose", "def f(a): return a.T @ a", "a @ a", ["a.T"]),
    ("transpose", "def f(a): return a", "a.T", ["a"]),
    ("condition", "def f(a): return 1 if a > 0 and a < 3 else 2", "a > 0 or a < 3", ["a > 0 and a < 3"]),
    ("condition", "def f(a): return 1 if a > 0 and a < 3 else 2", "1 if a < 3", ["a > 0"]),
    ("condition", "def f(y): return y < 3", "(y < 3) & (y != 255)", ["y < 3"]),
    ("cast", "def f(a): return a / 2", "a.astype(float) / 2", ["a"]),
    ("line too many", "def f(a):\n    a = a + 1\n    return a", "def f(a):\n    return a", ["a = a + 1"]),
    ("lines exchanged", "def f(a):\n    b = 1\n    a = 2\n    return a", "a = 2\n    b = 1", ["b = 1", "a = 2"]),
    ("loop", "def f(a):\n    for i in a:\n        if i: break\n    return a", "continue", ["break"]),
    ("moved", "def f(a):\n    for i in a:\n        a = i\n        i = 0\n    return a", "a = i\n    i = 0", ["i = 0"]),
    ("moved", "def f(a):\n    for i in a:\n        a = i\n    b = 0\n    return b", "a = i\n        b = 0", ["b = 0"]),
    ("names exchanged", "def f(a, b): return a - 2 * b + a", "b - 2 * a + b", ["a", "b", "a"]),
    ("copy", "def f(a): return a", "a.copy()", ["a"]),
    ("factor", "def f(a): return a", "a / 1000", ["a"]),
    ("logarithm", "def f(a): return a", "np.log(a)", ["a"]),
    ("a hair", "def f(a): return int(a)", "int(a + 1e-07)", ["a"]),
    ("reciprocal", "def f(v, a, b): return v * a / b", "v * b / a", ["a", "b"]),
    ("off by one", "def f(a): return a", "a + 0.5", ["a"]),
    ("reciprocal", "def f(a): return a", "1 / a", ["a"]),
    ("shift", "def f(a): return np.exp(a)", "np.exp(a - a.max())", ["a"]),
    ("divided", "def f(a): return a", "a / a.sum()", ["a"]),
    ("term", "def f(a, b): return a", "a * b", ["a"]),
    ("new axis", "def f(a): return a", "a[:, None]", ["a"]),
    ("sum", "def f(a): return a", "a.sum(axis=0)", ["a"]),
    ("reversed", "def f(a): return a", "a[::-1]", ["a"]),
    ("rounding", "def f(a): return a", "np.floor(a)", ["a"]),
    ("index too many", "def f(a, i): return a[i]", "return a", ["i"]),
    ("call too many", "def f(a): return np.sqrt(a)", "return a", ["np.sqrt(a)"]),
    ("too much", "def f(a): return a / 2", "return a", ["2"]),
    ("too much", "def f(a): return -a * np.log(a)", "return -np.log(a)", ["a"]),
]  # fmt: skip


def made(source):
    """The mutations of a function, each with the text that it makes; the tree is as before afterwards."""
    tree = ast.parse(source)
    before = ast.dump(tree, include_attributes=True)
    found = []
    for mutation in mutations(tree.body[0]):
        with mutation.applied():
            found.append((mutation, ast.unparse(tree)))
            compile(tree, "<mutant>", "exec")
    assert ast.dump(tree, include_attributes=True) == before
    return found


def text_of(source, span):
    """The part of a text that a span marks, without what stands round an operator."""
    lines = source.encode().split(b"\n")[span.line - 1 : span.last_line]
    lines[-1] = lines[-1][: span.end]
    return b"\n".join([lines[0][span.column :], *lines[1:]]).decode().strip(" ()[]")


@pytest.mark.parametrize("kind, source, becomes, marked", MADE)
def test_each_kind_is_made_and_marks_its_place(kind, source, becomes, marked):
    becomes = becomes.replace("(a > 0)", "a > 0") if kind != "not" else becomes
    wanted = [part.strip(" ()[]") for part in marked]
    found = [m for m, text in made(source) if m.kind == kind and becomes in text]
    assert wanted in [[text_of(source, span) for span in mutation.spans] for mutation in found]


def test_every_kind_is_among_them():
    assert {kind for kind, *_ in MADE} == set(REPAIRS)


LONG = """
def back_project(depth, K):
    größe, y = "Höhe", np.arange(len(depth))[:, None] - K[1, 2]
    P = np.stack([y / K[1, 1] * depth, depth], axis=-1)
    for v in range(3):
        if np.isnan(P[v]).any() and v > 0:
            P[v] = 0.0
    return P
"""


def test_a_long_program_is_mutated_at_places_that_are_its_own():
    """Also beyond letters of two bytes; smallest first; nothing is brought in but NumPy and what the program has."""
    found = made(LONG)
    costs = [mutation.cost for mutation, _ in found]
    assert costs == sorted(costs) and len(found) > 1000
    lines = LONG.encode().split(b"\n")
    for mutation, _ in found:
        for span in mutation.spans:
            assert 1 <= span.line <= span.last_line <= len(lines)
            assert 0 <= span.column <= len(lines[span.line - 1]) and 0 < span.end <= len(lines[span.last_line - 1])
    known = {node.id for node in ast.walk(ast.parse(LONG)) if isinstance(node, ast.Name)} | {"depth", "K"}
    for _, text in found:
        used = {node.id for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Name)}
        assert used <= known | {"len", "float", "int", "bool", "nan", "inf"}, used - known


def test_parallel_places_count_as_one():
    """The same slip in both halves of a tuple, and in lines that are alike, is one mistake."""
    both = [text for m, text in made("def f(x, y, K): return x * K[0, 0], y * K[1, 1]") if m.kind == "operator"]
    assert any("x / K[0, 0], y / K[1, 1]" in text for text in both)
    lines = "def f(r, s):\n    u = r[0] + 1\n    v = s[1] + 1\n    return u, v"
    assert any("r[0] + 2\n    v = s[1] + 2" in text for _, text in made(lines))


def test_a_line_that_writes_into_an_array_is_not_turned_into_one_that_does_nothing():
    for mutation, text in made("def f(y):\n    out = y * 2\n    out[y == 255] = 0\n    return out"):
        assert "out.copy()[" not in text and ".astype(float)[" not in text, mutation


def test_a_list_is_not_put_into_itself():
    """np.array of such a list wants all memory."""
    texts = [text for _, text in made("def f(a, b):\n    b = []\n    b.append((len(a), a + 1))\n    b.append(b[0])")]
    assert any("b.append((a, a + 1))" in text for text in texts)
    assert not [text for text in texts for part in ("append(b)", "append((b,", "a + 1, b)", ", b))") if part in text]
