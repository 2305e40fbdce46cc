"""Recipes: how an expression of a student's could be written otherwise, such as "another axis" or "minus for plus".

None of them brings in what the student's function does not know: beside NumPy's own names there are only those that it
uses itself (`Scope`).
"""

import ast
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

from labgrader.reply.finding import Span
from labgrader.reply.syntax import (
    SHORT,
    Place,
    between,
    changed,
    exchanged,
    filled,
    node_count,
    parsed,
    template,
    the,
    without,
)

MOST_TERMS = 10  # names and short expressions of the function that are tried as a missing term
# Functions of one family: a student may have taken the wrong one.
FAMILIES = (
    "sum mean prod max min median any all std var",
    "argmax argmin argsort",
    "floor ceil round rint trunc",
    "maximum minimum fmax fmin hypot add subtract multiply",
    "zeros ones empty",
    "zeros_like ones_like empty_like",
    "sin cos tan",
    "arcsin arccos arctan",
    "arctan2 hypot",
    "exp log log2 log10 log1p expm1 sqrt square abs",
    "vstack hstack concatenate stack column_stack dstack",
    "repeat tile",
    "dot outer cross inner matmul",
    "cumsum cumprod",
    "argsort sort",
    "inv pinv",
    "isnan isfinite isinf",
    "logical_and logical_or logical_xor",
    "diag diagonal trace",
    "triu tril",
    "eye ones zeros",
    "append extend",
    "searchsorted digitize",
    "flip fliplr flipud",
    "ravel flatten",
)
RELATED = {name: [n for n in family.split() if n != name] for family in FAMILIES for name in family.split()}
OPTIONS = {"axis": "axis", "keepdims": "option"}  # the kind of any other value of them
AXES = ("0", "1", "2", "-1", "-2", "None", "(0, 1)")
TAKES_AXIS = {"sum", "mean", "prod", "max", "min", "argmax", "argmin", "any", "all", "cumsum", "cumprod", "sort"}
TAKES_AXIS |= {"median", "std", "var", "norm", "argsort", "stack", "concatenate", "diff", "flip", "repeat", "amax"}
ARITHMETIC = (ast.Add, ast.Sub, ast.Mult, ast.Div)
OPERATORS = {
    **dict.fromkeys(ARITHMETIC, ARITHMETIC),
    ast.Div: (*ARITHMETIC, ast.FloorDiv),
    ast.FloorDiv: (ast.Div, ast.Mod),
    ast.Mult: (*ARITHMETIC, ast.MatMult, ast.Pow),
    ast.MatMult: (ast.Mult,),
    ast.Pow: (ast.Mult,),
    ast.Mod: (ast.FloorDiv, ast.Div),
    ast.BitAnd: (ast.BitOr, ast.BitXor),
    ast.BitOr: (ast.BitAnd, ast.BitXor),
    ast.BitXor: (ast.BitAnd, ast.BitOr),
    ast.LShift: (ast.RShift,),
    ast.RShift: (ast.LShift,),
}
# Options in a text of which a student may have taken the wrong one.
STRINGS = ("<f4 >f4 <f8 f4", "<u2 >u2", "<i4 >i4 <f4", "C F", "ij xy", "left right", "little big", "< > =")
STRINGS += ("edge constant reflect symmetric wrap",)
COMPARISONS = (ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq)
# What may be missing around an expression `_`: the kind of the mistake, how many nodes it adds, and the texts.
AROUND = (
    ("transpose", 1.5, "_.T | np.swapaxes(_, -1, -2)"),
    ("sign", 1.5, "-_"),
    ("absolute", 1.5, "np.abs(_)"),
    ("cast", 1.5, "_.astype(float) | _.astype(int) | float(_) | int(_) | np.int64(_)"),
    ("copy", 1.5, "_.copy()"),
    ("logarithm", 2, "np.log(_) | np.log2(_) | np.log10(_)"),
    ("rounding", 2, "np.round(_) | np.floor(_) | np.ceil(_)"),
    ("off by one", 2, "_ + 1 | _ - 1 | _ + 0.5 | _ - 0.5"),
    ("factor", 2, "2 * _ | _ / 2 | _ * 1000 | _ / 1000 | _ * 255 | _ / 255 | _ * 256"),
    ("reciprocal", 2, "1 / _"),
    ("new axis", 2, "_[None] | _[:, None] | _[..., None] | _[:, None, None] | _[:, :, None]"),
    ("reversed", 2, "_[::-1] | _[:, ::-1] | _[..., ::-1]"),
    ("part", 2, "_[1:] | _[:-1] | _[0] | _[-1] | _[:, 0] | _[:, -1] | _[..., 0] | _[:3] | _[:3, :3] | _[..., :3]"),
    (
        "sum",
        2,
        "_.sum() | _.sum(axis=0) | _.sum(axis=1) | _.sum(axis=-1) | _.mean() | _.mean(axis=0) | _.max() | _.min()",
    ),
    ("sum", 3, "_.sum(axis=-1, keepdims=True) | _.mean(axis=-1, keepdims=True)"),
    ("shift", 3, "_ - _.max() | _ - _.min() | _ - _.mean() | _ - _.mean(axis=0) | _ - _.max(axis=-1, keepdims=True)"),
    ("divided", 3, "_ / _.sum() | _ / len(_) | _ / _.sum(axis=-1, keepdims=True) | _ / _.sum(axis=0)"),
    ("divided", 3, "_ / np.linalg.norm(_)"),
)
ROUND_A_CONDITION = " | ".join(f"_ & ({{}} {test})" for test in ("!= 255", "> 0", ">= 0", "== 0"))


@dataclass(frozen=True)
class Recipe:
    """How a node is replaced, by what `make` gives. key: the same for other nodes; cost: nodes that change."""

    kind: str
    key: str
    cost: float
    make: Callable[[], ast.AST]
    mark: tuple[ast.AST | Span, ...] = ()  # what is shown, if not the whole node


class Scope:
    """What a function knows: its names, and short expressions that it forms of them."""

    def __init__(self, function: ast.stmt):
        self.names: dict[str, None] = {}
        short: dict[str, ast.expr] = {}
        inside = [node for node in ast.walk(function) if node is not function]
        for node in inside:
            if isinstance(node, ast.arg):
                self.names[node.arg] = None
            elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                self.names[node.id] = None
        for node in inside:
            longest = 3 if isinstance(node, ast.BinOp) else SHORT
            if not isinstance(node, ast.Attribute | ast.Subscript | ast.Call | ast.BinOp) or node_count(node) > longest:
                continue
            used = {part.id for part in ast.walk(node) if isinstance(part, ast.Name)}
            if used & self.names.keys() and isinstance(getattr(node, "ctx", ast.Load()), ast.Load):
                short.setdefault(ast.unparse(node), node)
        self.terms = [*self.names, *sorted(short, key=len)][:MOST_TERMS]


def recipes_for(place: Place, scope: Scope) -> Iterator[Recipe]:
    """All recipes for an expression at its place."""
    node, parent = place.node, place.parent
    if isinstance(node, ast.Slice):
        yield from slices(node)
        return
    if isinstance(parent, ast.Subscript) and isinstance(parent.ctx, ast.Store) and node is parent.value:
        yield from names(node, scope)  # x in x[i] = 1: written to anything else, the line would do nothing
        return
    option = OPTIONS.get(parent.arg, "") if isinstance(parent, ast.keyword) else ""
    for family in (operators, comparisons, conditions, calls, constants, names, axes):
        for recipe in family(node, scope):
            yield replace(recipe, kind=option) if option else recipe
    if isinstance(node, ast.Constant | ast.Tuple | ast.List | ast.Starred | ast.Lambda):
        return
    if isinstance(parent, ast.keyword) and parent.arg in ("dtype", "axis", "mode"):
        return
    if isinstance(node, ast.Name) and node.id not in scope.names:  # np, range, float ...
        return
    if is_condition(node, parent):
        turned = "not _" if isinstance(parent, ast.If | ast.IfExp | ast.While) else "~_"
        yield Recipe("not", "~", 1, template(turned, node))
        return
    called = getattr(getattr(parent, "func", None), "attr", "")
    if called.startswith("is"):  # whatever keeps NaN and infinity would be right there by accident
        return
    if is_cut_off(node, parent):
        yield Recipe("a hair", "1e-7", 1, template("_ + 1e-7", node))
    yield from missing_around(node)
    yield from missing_terms(node, scope)
    if not isinstance(node, ast.Name):
        for other in scope.names:
            yield Recipe("name", other, 2, template(other, node))


def is_condition(node: ast.expr, parent: ast.AST) -> bool:
    """Whether an expression is true or false, perhaps for each entry."""
    if isinstance(parent, ast.If | ast.IfExp | ast.While) and node is parent.test:
        return True
    called = getattr(getattr(node, "func", None), "attr", "")
    masks = ast.BitAnd | ast.BitOr | ast.Invert | ast.Not
    named = called in ("any", "all", "isin") or called.startswith(("is", "logical"))
    return named or isinstance(node, ast.Compare | ast.BoolOp) or isinstance(getattr(node, "op", None), masks)


def is_cut_off(node: ast.expr, parent: ast.AST) -> bool:
    """Whether an expression becomes a whole number at once, the one below."""
    if isinstance(parent, ast.Attribute):
        return parent.attr == "astype" and isinstance(node, ast.BinOp | ast.Call)
    called = getattr(getattr(parent, "func", None), "attr", getattr(getattr(parent, "func", None), "id", ""))
    return called in ("int", "floor", "trunc") and node in parent.args


def operators(node: ast.expr, scope: Scope) -> Iterator[Recipe]:
    """Another operator, another order, other brackets, one operand too many, or a sign."""
    if isinstance(node, ast.UnaryOp):
        kind = "sign" if isinstance(node.op, ast.USub) else "not"
        yield Recipe(kind, "without the sign", 1, the(node.operand))
        return
    if not isinstance(node, ast.BinOp):
        return
    left, right = node.left, node.right
    for op in OPERATORS.get(type(node.op), ()):
        if not isinstance(node.op, op):
            yield Recipe("operator", op.__name__, 1, partial(changed, node, op=op()), (between(left, right),))
    yield from turned_fraction(node)
    yield Recipe("too much", "without the right", 1, the(left), (right,))
    yield Recipe("too much", "without the left", 1, the(right), (left,))
    if isinstance(node.op, ast.Mult) and isinstance(left, ast.UnaryOp):
        make = partial(changed, left, operand=right)
        yield Recipe("too much", "without the left but its sign", 1, make, (left.operand,))
    if not isinstance(node.op, ast.Add | ast.Mult | ast.BitAnd | ast.BitOr):
        yield Recipe("order", "sides", 1, partial(changed, node, left=right, right=left))
    if isinstance(left, ast.BinOp):
        yield Recipe("brackets", "right", 1, partial(changed, left, right=changed(node, left=left.right)))
    if isinstance(right, ast.BinOp):
        yield Recipe("brackets", "left", 1, partial(changed, right, left=changed(node, right=right.left)))


def turned_fraction(node: ast.BinOp) -> Iterator[Recipe]:
    """x * b / a for x * a / b, and x / a * b for x / b * a."""
    below = ast.Div | ast.FloorDiv
    inner = node.left
    if not isinstance(inner, ast.BinOp):
        return
    if (isinstance(node.op, below) and isinstance(inner.op, ast.Mult)) or (
        isinstance(node.op, ast.Mult) and isinstance(inner.op, below)
    ):
        make = partial(changed, node, left=changed(inner, right=node.right), right=inner.right)
        yield Recipe("reciprocal", "a fraction's sides", 1, make, (inner.right, node.right))


def comparisons(node: ast.expr, scope: Scope) -> Iterator[Recipe]:
    """Another comparison."""
    if not isinstance(node, ast.Compare):
        return
    sides = [node.left, *node.comparators]
    for i, op in enumerate(node.ops):
        for other in COMPARISONS if isinstance(op, COMPARISONS) else ():
            if not isinstance(op, other):
                make = partial(changed, node, ops=[*node.ops[:i], other(), *node.ops[i + 1 :]])
                yield Recipe("comparison", f"{i} {other.__name__}", 1, make, (between(*sides[i : i + 2]),))
    border = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
    if len(node.ops) == 2 and all(type(op) in border for op in node.ops):
        make = partial(changed, node, ops=[border[type(op)]() for op in node.ops])
        yield Recipe("comparison", "both", 1, make, (between(*sides[:2]), between(*sides[1:])))


def conditions(node: ast.expr, scope: Scope) -> Iterator[Recipe]:
    """`and` for `or`, one condition too many, and one that is missing."""
    if isinstance(node, ast.BoolOp):
        other = ast.Or if isinstance(node.op, ast.And) else ast.And
        yield Recipe("condition", "and, or", 1, partial(changed, node, op=other()))
        for i, value in enumerate(node.values):
            rest = without(node.values, i)
            make = partial(changed, node, values=rest) if len(rest) > 1 else the(rest[0])
            yield Recipe("condition", f"without {i}", 1, make, (value,))
    if isinstance(node, ast.IfExp):
        yield Recipe("branch", "else alone", 1, the(node.orelse), (node.body,))
        yield Recipe("branch", "without else", 1, the(node.body), (node.orelse,))
    masks = ast.BitAnd | ast.BitOr | ast.Invert
    if isinstance(node, ast.Name):
        yield Recipe("condition", "None", 2.5, template("_ is not None", node))
    if isinstance(node, ast.Compare) or isinstance(getattr(node, "op", None), masks):
        for term in scope.names:
            for text in ROUND_A_CONDITION.format(*[term] * 4).split(" | "):
                yield Recipe("condition", text, 3, template(text, node))


def calls(node: ast.expr, scope: Scope) -> Iterator[Recipe]:
    """Another function of the family, arguments in another order, another axis or option, or the call left out."""
    if not isinstance(node, ast.Call):
        return
    called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    field = "attr" if isinstance(node.func, ast.Attribute) else "id"
    for other in RELATED.get(called, ()):
        make = partial(changed, node, func=changed(node.func, **{field: other}))
        yield Recipe("function", other, 1, make, (node.func,))
    if called in ("isclose", "allclose") and len(node.args) > 1:
        equal = ast.Compare(node.args[0], [ast.Eq()], [node.args[1]])
        yield Recipe("function", "==", 1, partial(ast.copy_location, equal, node), (node.func,))
    for i, j in itertools.combinations(range(len(node.args)), 2):
        make = partial(changed, node, args=exchanged(node.args, i, j))
        yield Recipe("order", f"arguments {i} {j}", 1, make, (node.args[i], node.args[j]))
    for i in range(len(node.args) if len(node.args) > 1 else 0):
        make = partial(changed, node, args=without(node.args, i))
        yield Recipe("too much", f"without argument {i}", 1, make, (node.args[i],))
    method = isinstance(node.func, ast.Attribute) and not is_module(node.func.value, scope)
    if method:
        yield Recipe("call too many", "method", 1, the(node.func.value))
    elif node.args and not isinstance(node.args[0], ast.Starred):
        yield Recipe("call too many", "function", 1, the(node.args[0]))
    for i, keyword in enumerate(node.keywords):
        kind = "axis" if keyword.arg == "axis" else "option"
        make = partial(changed, node, keywords=without(node.keywords, i))
        yield Recipe(kind, f"without {keyword.arg}", 1, make, (keyword,))
        if keyword.arg == "axis":
            for axis in AXES:
                if axis != ast.unparse(keyword.value):
                    yield Recipe("axis", f"axis={axis}", 1, with_option(node, "axis", axis), (keyword,))
    if called in TAKES_AXIS:
        given = {keyword.arg for keyword in node.keywords}
        if "axis" not in given and len(node.args) < (1 if method else 2):
            for axis in AXES:
                yield Recipe("axis", f"axis={axis}", 1.5, with_option(node, "axis", axis))


def is_module(node: ast.expr, scope: Scope) -> bool:
    """Whether an expression is np, np.linalg and such: a name that the function does not give a value."""
    while isinstance(node, ast.Attribute):
        node = node.value
    return isinstance(node, ast.Name) and node.id not in scope.names


def with_option(node: ast.Call, option: str, value: str) -> Callable:
    """Set an option of a call."""
    kept = [keyword for keyword in node.keywords if keyword.arg != option]
    return partial(changed, node, keywords=[*kept, ast.keyword(option, filled(parsed(value), node))])


def constants(node: ast.expr, scope: Scope) -> Iterator[Recipe]:
    """Another number, truth value, or type."""
    if isinstance(node, ast.Attribute) and node.attr in ("nan", "inf", "pi", "e"):
        for text in ("0.0", "1.0", "np.nan", "np.inf", "2 * np.pi", "np.pi / 2"):
            yield Recipe("constant", text, 1, template(text, node))
    if not isinstance(node, ast.Constant):
        return
    value = node.value
    if isinstance(value, bool):
        others = [not value]
    elif isinstance(value, int | float):
        others = [value + 1, value - 1, -value, 2 * value, value / 2, 0, 1, 2, 255, 1000, value**2]
        others += [1 / value if value else 0]
        others += [2**bits - 1 for bits in (8, 16, 24, 32)] if isinstance(value, int) and value > 99 else []
        others += [float("nan")] if value in (0, 1) else [0.5, value * 1000, value / 1000, float("inf")]
    elif isinstance(value, str):
        others = [o for family in map(str.split, STRINGS) if value in family for o in family]
    else:
        others = []
    for other in dict.fromkeys(map(repr, others)):
        if other != repr(value):
            number = float(other) if other in ("nan", "inf") else ast.literal_eval(other)
            kind = "option" if isinstance(value, str) else "constant"
            yield Recipe(kind, other, 1, partial(changed, node, value=number))


TYPES = ("int", "float", "bool", "complex", "np.uint8", "np.uint16", "np.uint32", "np.int8", "np.int16", "np.int32")
TYPES += ("np.int64", "np.float16", "np.float32", "np.float64")


def names(node: ast.expr, scope: Scope) -> Iterator[Recipe]:
    """Another name of the function's own, or another type."""
    if isinstance(node, ast.Name) and node.id in scope.names:
        for other in scope.names:
            if other != node.id:
                yield Recipe("name", other, 1, template(other, node))
    text = ast.unparse(node) if isinstance(node, ast.Name | ast.Attribute) else ""
    if text in TYPES:
        for other in ("float", "int", "np.int64", "np.uint8", "np.float32", "bool"):
            if other != text:
                yield Recipe("type", other, 1, template(other, node))


def axes(node: ast.expr, scope: Scope) -> Iterator[Recipe]:
    """A transpose too many, indices in another order, or one that is too much."""
    if isinstance(node, ast.Attribute) and node.attr == "T":
        yield Recipe("transpose", "without T", 1, the(node.value))
    if isinstance(node, ast.Subscript):
        yield Recipe("index too many", "without the index", 1, the(node.value), (node.slice,))
    if isinstance(node, ast.Tuple | ast.List) and 2 <= len(node.elts) <= 4:
        for i, j in itertools.combinations(range(len(node.elts)), 2):
            make = partial(changed, node, elts=exchanged(node.elts, i, j))
            yield Recipe("order", f"entries {i} {j}", 1, make, (node.elts[i], node.elts[j]))


def slices(node: ast.Slice) -> Iterator[Recipe]:
    """Another bound or step of a slice."""
    for field, usual in (("lower", "1"), ("upper", "-1"), ("step", "-1")):
        bound = getattr(node, field)
        if bound is None:
            new = filled(parsed(usual), node)
            yield Recipe("slice", f"{field} {usual}", 1.5, partial(changed, node, **{field: new}))
            continue
        yield Recipe("slice", f"without {field}", 1, partial(changed, node, **{field: None}))
        for text in ("_ + 1", "_ - 1") if field != "step" else ():
            new = filled(parsed(text), bound)
            yield Recipe("slice", f"{field} {text}", 2, partial(changed, node, **{field: new}))


def missing_around(node: ast.expr) -> Iterator[Recipe]:
    """What may be missing around an expression."""
    for kind, cost, texts in AROUND:
        for text in texts.split(" | "):
            yield Recipe(kind, text, cost, template(text, node))


def missing_terms(node: ast.expr, scope: Scope) -> Iterator[Recipe]:
    """A term or factor of the function's own names that is missing."""
    own = ast.unparse(node)
    for term in scope.terms:
        if term == own:
            continue
        for op in ("+", "-", "*", "/"):
            yield Recipe("term", f"{op} {term}", 2, template(f"_ {op} ({term})", node))
        if term in scope.names:
            yield Recipe("term", f"@ {term}", 2.5, template(f"_ @ {term}", node))
            yield Recipe("term", f"& {term}", 2.5, template(f"_ & {term}", node))
