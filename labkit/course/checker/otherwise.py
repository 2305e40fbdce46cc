"""A step of a computation done otherwise: another operation, one side alone, over another axis, one entry further ...

Each change is a function (compute, *operands, **options) -> value, which takes the place of compute(*operands,
**options); it raises where it cannot be made. The words follow "as if" and the step's own: "the sum were a product".
"""

import ast
import operator
from collections.abc import Callable, Iterator

import numpy as np

from labkit.course.checker.inputs import ARRAYS, NUMBERS

Change = Callable[..., object]
Changes = Iterator[tuple[str, Change]]
CHANGES: dict[type[ast.AST], list[Callable[[ast.AST], Changes]]] = {}


def within(operation: Callable) -> Callable:
    """A power or a shift, but none that makes a whole number of thousands of digits."""

    def limited(a: object, b: object) -> object:
        if np.result_type(a, b).kind in "iuO" and not np.all(np.abs(b) < 64):
            raise OverflowError("b: expected less than 64")
        return operation(a, b)

    return limited


OPERATIONS = {
    ast.Add: ("a sum", operator.add),
    ast.Sub: ("a difference", operator.sub),
    ast.Mult: ("a product", operator.mul),
    ast.Div: ("a quotient", operator.truediv),
    ast.Pow: ("a power", within(operator.pow)),
    ast.FloorDiv: ("a quotient without its remainder", operator.floordiv),
    ast.Mod: ("a remainder", operator.mod),
    ast.MatMult: ("a product of matrices", operator.matmul),
    ast.BitAnd: ("an `and`", operator.and_),
    ast.BitOr: ("an `or`", operator.or_),
    ast.BitXor: ("an `either, or`", operator.xor),
    ast.LShift: ("bits moved to the left", within(operator.lshift)),
    ast.RShift: ("bits moved to the right", within(operator.rshift)),
}
BITS = (ast.BitAnd, ast.BitOr, ast.BitXor)  # of truth values, these are said before + and *
COMPARISONS = {
    ast.Lt: ("<", operator.lt),
    ast.LtE: ("<=", operator.le),
    ast.Eq: ("==", operator.eq),
    ast.NotEq: ("!=", operator.ne),
    ast.GtE: (">=", operator.ge),
    ast.Gt: (">", operator.gt),
}
FAMILIES = (
    ("sum", "mean", "prod", "max", "min", "median", "std"),
    ("argmax", "argmin"),
    ("any", "all"),
    ("maximum", "minimum"),
    ("sin", "cos", "tan"),
    ("arcsin", "arccos", "arctan"),
    ("floor", "ceil", "round"),
    ("log", "log2", "log10", "exp"),
    ("sqrt", "square", "abs"),
    ("zeros", "ones"),
    ("cumsum", "cumprod"),
)
BOUNDS = {  # of a slice: which of the two, and by how much it is moved
    "began one later": (0, 1),
    "began one earlier": (0, -1),
    "began at the first": (0, None),
    "ended one later": (1, 1),
    "ended one earlier": (1, -1),
    "went on to the last": (1, None),
}
TRUTHS = {"did not count (as if it were all 0)": "were never true", "were all 1": "were always true"}


def done_otherwise(node: ast.AST) -> Changes:
    """The changes of a step by what it is; then those of its value, whatever it is."""
    for entry in CHANGES.get(type(node), ()):
        yield from entry(node)
    if isinstance(node, ast.Constant):
        return
    truth = isinstance(node, ast.Compare | ast.BoolOp)
    for says, change in ARRAYS.items():
        yield (TRUTHS.get(says, says) if truth else says), of_value(change)
    for says, change in () if truth else NUMBERS.items():
        yield says, of_number(change)


def of_value(change: Callable[[np.ndarray], np.ndarray | None]) -> Change:
    """A change of a step's value, if that is an array or a truth value."""

    def changed(compute, *operands, **options):
        old = compute(*operands, **options)
        new = change(np.asarray(old)) if isinstance(old, np.ndarray | np.bool_ | bool) else None
        if new is None:
            raise ValueError("this step cannot be changed so")
        return new if isinstance(old, np.ndarray) else np.asarray(new)[()]

    return changed


def of_number(change: Callable[[float], float | None]) -> Change:
    """A change of a step's value, if that is one number."""

    def changed(compute, *operands, **options):
        old = compute(*operands, **options)
        number = old.item() if isinstance(old, np.generic) else old
        new = change(number) if isinstance(number, int | float) and not isinstance(number, bool) else None
        if new is None:
            raise ValueError("this step cannot be changed so")
        return type(old)(new) if isinstance(old, np.floating) else new

    return changed


def of(*kinds: type[ast.AST]) -> Callable:
    """Enter changes for kinds of nodes."""

    def enter(function: Callable[[ast.AST], Changes]) -> Callable[[ast.AST], Changes]:
        for kind in kinds:
            CHANGES.setdefault(kind, []).append(function)
        return function

    return enter


@of(ast.BinOp)
def operation(node: ast.BinOp) -> Changes:
    """Another operation, one side alone, the sides exchanged."""
    yield "were its first side alone", lambda compute, a, b: spread(a, compute(a, b))
    yield "were its second side alone", lambda compute, a, b: spread(b, compute(a, b))
    yield "had its two sides exchanged", lambda compute, a, b: compute(b, a)
    for kind in sorted(OPERATIONS, key=lambda kind: issubclass(kind, BITS) != isinstance(node.op, BITS)):
        name, other = OPERATIONS[kind]
        if isinstance(node.op, ast.MatMult) and kind is ast.Mult:
            name = "taken number by number"
        if kind is not type(node.op):
            yield f"were {name}", lambda compute, a, b, other=other: other(a, b)


def spread(side: object, value: object) -> object:
    """One side of an operation in the shape of the result, if it fits."""
    if isinstance(side, np.ndarray) and isinstance(value, np.ndarray) and side.ndim == value.ndim:
        return np.broadcast_to(side, value.shape).copy() if side.shape != value.shape else side
    return side


@of(ast.Compare)
def comparison(node: ast.Compare) -> Changes:
    """With another sign; of a chain a < b < c one part with another sign, or left out."""
    ops = [type(op) for op in node.ops]
    if not all(kind in COMPARISONS for kind in ops):
        return
    for i in range(len(ops)):
        chain = f", in its part number {i + 1}" if len(ops) > 1 else ""
        for kind, (sign, _) in COMPARISONS.items():
            if kind is not ops[i]:
                other = compared(*ops[:i], kind, *ops[i + 1 :])
                yield f"were made with {sign}{chain}", lambda compute, *values, other=other: other(*values)
    if len(ops) == 2:
        yield "were its first part alone", lambda compute, a, b, c: COMPARISONS[ops[0]][1](a, b)
        yield "were its second part alone", lambda compute, a, b, c: COMPARISONS[ops[1]][1](b, c)


def compared(*kinds: type[ast.cmpop]) -> Callable:
    """A comparison of two values, or a chain of comparisons."""
    signs = [COMPARISONS[kind][1] for kind in kinds]
    if len(signs) == 1:
        return signs[0]
    return lambda *values: all(sign(a, b) for sign, a, b in zip(signs, values, values[1:], strict=False))


@of(ast.UnaryOp)
def unary(node: ast.UnaryOp) -> Changes:
    """Not taken."""
    yield "were not taken", lambda compute, a: a


@of(ast.Call)
def call(node: ast.Call) -> Changes:
    """Another function of its family, the argument itself, two arguments exchanged, other options."""
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    for family in FAMILIES:
        for other in family if name in family else ():
            if other != name:
                yield f"were taken with {other}", by_another_function(other)
    yield "were not taken", lambda compute, callee, *rest, **options: (callee, *rest)[callable(callee)]
    if len(node.args) > 1:
        yield "had its first two arguments exchanged", lambda compute, f, a, b, *c, **o: compute(f, b, a, *c, **o)
    if len(node.args) > 2:
        yield "had its last two arguments exchanged", lambda compute, *a, **o: compute(*a[:-2], a[-1], a[-2], **o)
    for option in (keyword.arg for keyword in node.keywords):
        yield f"had no {option}", without_option(option)
    if any(keyword.arg == "axis" for keyword in node.keywords):
        for axis in (0, 1, 2):
            yield f"ran over axis {axis}", lambda compute, *a, onto=axis, **o: compute(*a, **{**o, "axis": onto})


def by_another_function(name: str) -> Change:
    """The same call of another function of NumPy."""
    return lambda compute, callee, *rest, **options: getattr(np, name)(
        *(() if callable(callee) else (callee,)), *rest, **options
    )


def without_option(name: str) -> Change:
    """The same call without an option."""
    return lambda compute, *operands, **options: compute(
        *operands, **{key: value for key, value in options.items() if key != name}
    )


@of(ast.Subscript)
def entry(node: ast.Subscript) -> Changes:
    """The whole of it, one entry further or before, a slice with other bounds, two indices exchanged."""
    yield "were the whole of it", lambda compute, whole, index: whole
    for step, words in ((1, "after"), (-1, "before")):
        yield f"were the one {words}", lambda compute, whole, index, step=step: whole[moved(index, step)]
    for says, (k, by) in BOUNDS.items():
        yield says, lambda compute, whole, index, k=k, by=by: whole[rebound(index, k, by)]
    for i in range(len(getattr(node.slice, "elts", ())) - 1):
        yield f"had its indices {i} and {i + 1} exchanged", lambda compute, whole, index, i=i: whole[turned(index, i)]


def turned(index: tuple, i: int) -> tuple:
    """An index with two neighbours exchanged."""
    return *index[:i], index[i + 1], index[i], *index[i + 2 :]


def moved(index: object, step: int) -> object:
    """Whole numbers of an index, moved; raises TypeError if there are none."""
    parts = index if isinstance(index, tuple) else (index,)
    whole = [np.asarray(p).dtype.kind in "iu" and not isinstance(p, slice) and p is not None for p in parts]
    if not any(whole):
        raise TypeError("index: expected whole numbers")
    parts = tuple(p + step if w else p for p, w in zip(parts, whole, strict=True))
    return parts if isinstance(index, tuple) else parts[0]


def rebound(index: object, k: int, by: int | None) -> object:
    """The slices of an index with another begin (k 0) or end (1): moved, or left out; raises TypeError without one."""
    parts, found = [], False
    for part in index if isinstance(index, tuple) else (index,):
        bounds = [part.start, part.stop, part.step] if isinstance(part, slice) else None
        if bounds and (bounds[k] is not None or by == 1 - 2 * k):  # without a bound it can only be narrowed
            bounds[k] = None if by is None else (bounds[k] or 0) + by
            found, part = True, slice(*bounds)
        parts.append(part)
    if not found:
        raise TypeError("index: expected a slice")
    return tuple(parts) if isinstance(index, tuple) else parts[0]


@of(ast.Tuple, ast.List)
def row(node: ast.Tuple | ast.List) -> Changes:
    """Two neighbours exchanged."""
    for i in range(len(node.elts) - 1):
        yield f"had its entries {i} and {i + 1} exchanged", lambda compute, row, i=i: type(row)(turned(tuple(row), i))


@of(ast.For, ast.comprehension)
def turns(node: ast.AST) -> Changes:
    """A turn less, or in another order."""
    yield "began one turn later", lambda compute, turns: list(turns)[1:]
    yield "ended one turn earlier", lambda compute, turns: list(turns)[:-1]
    yield "went through them from the end", lambda compute, turns: list(turns)[::-1]


@of(ast.Constant)
def number(node: ast.Constant) -> Changes:
    """A number beside it; twice, half, minus it; nothing; the other truth value."""
    if isinstance(node.value, bool):
        yield "were the other truth value", lambda compute, value: not value
        return
    yield "were one larger", lambda compute, value: value + 1
    yield "were one smaller", lambda compute, value: value - 1
    yield "had the other sign", lambda compute, value: -value
    yield "were 0", lambda compute, value: 0 * value
    yield "were twice as large", lambda compute, value: 2 * value
    yield "were half as large", lambda compute, value: value // 2 if isinstance(value, int) else value / 2
