"""Mutations of a program: each changes one place, as a student would who has found the mistake (used by `repair`).

    for mutation in mutations(function): with mutation.applied(): compile it

A mutation is a recipe, such as "another axis" or "minus in place of plus", and the places where it is applied: one,
each occurrence of the same expression, or the same spot in parallel lines. None of them brings in what the student's
function does not know: beside NumPy's own names there are only those that it uses itself. The module needs the standard
library alone, so that it also runs in the grader's sandbox.
"""

import ast
import contextlib
import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

from labkit.course.checker.finding import Span

MOST_TERMS = 10  # names and short expressions of the function that are tried as a missing term
SHORT = 6  # nodes of an expression that counts as short
LONGEST_GROUP = 6  # places that one recipe is applied to together
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
    ("power", 2, "np.sqrt(_) | _ ** 2"),
    ("logarithm", 2, "np.log(_) | np.log2(_) | np.log10(_)"),
    ("exponential", 2, "np.exp(_)"),
    ("rounding", 2, "np.round(_) | np.floor(_) | np.ceil(_)"),
    ("off by one", 2, "_ + 1 | _ - 1 | _ + 0.5 | _ - 0.5"),
    ("factor", 2, "2 * _ | _ / 2 | _ * 1000 | _ / 1000 | _ * 255 | _ / 255 | _ * 256"),
    ("complement", 2, "1 - _"),
    ("reciprocal", 2, "1 / _"),
    ("new axis", 2, "_[None] | _[:, None] | _[..., None] | _[:, None, None] | _[:, :, None]"),
    ("reversed", 2, "_[::-1] | _[:, ::-1] | _[..., ::-1]"),
    ("slice", 2, "_[1:] | _[:-1] | _[0] | _[-1] | _[:, 0] | _[:, -1] | _[..., 0] | _[:3] | _[:3, :3] | _[..., :3]"),
    ("bound", 2, "np.maximum(_, 0) | np.maximum(_, 1) | np.minimum(_, 1) | np.clip(_, 0, 1)"),
    ("period", 2, "_ % np.pi | _ % (2 * np.pi)"),
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
class Place:
    """A node of a syntax tree, or a list of statements (index None), in its parent."""

    parent: ast.AST
    field: str
    index: int | None = None

    @property
    def node(self):
        """What stands there."""
        value = getattr(self.parent, self.field)
        return value if self.index is None else value[self.index]

    def put(self, node) -> None:
        """Put another node there."""
        if self.index is None:
            setattr(self.parent, self.field, node)
        else:
            getattr(self.parent, self.field)[self.index] = node


@dataclass(frozen=True)
class Recipe:
    """How a node is replaced, by what `make` gives. key: the same for other nodes; cost: nodes that change."""

    kind: str
    key: str
    cost: float
    make: Callable[[], ast.AST]
    mark: tuple[ast.AST | Span, ...] = ()  # what is shown, if not the whole node


@dataclass(frozen=True)
class Mutation:
    """A recipe at one place, or at several that count as one."""

    kind: str
    cost: float
    places: tuple[Place, ...]
    makes: tuple[Callable, ...]
    spans: tuple[Span, ...]

    @contextlib.contextmanager
    def applied(self) -> Iterator[None]:
        """The tree is changed inside of the block."""
        before = [place.node for place in self.places]
        for place, make in zip(self.places, self.makes, strict=True):
            place.put(make())
        try:
            yield
        finally:
            for place, node in zip(self.places, before, strict=True):
                place.put(node)


def mutations(function: ast.stmt) -> list[Mutation]:
    """All mutations of a function, those that change least first; equal ones in the order of the text."""
    scope = Scope(function)
    found = [*of_expressions(function, scope), *of_statements(function)]
    return sorted(found, key=lambda mutation: mutation.cost)  # stable


# --------------------------------------------------------------------------------------- the student's own names


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
            if not isinstance(node, ast.Attribute | ast.Subscript | ast.Call) or size(node) > SHORT:
                continue
            used = {part.id for part in ast.walk(node) if isinstance(part, ast.Name)}
            if used & self.names.keys() and isinstance(getattr(node, "ctx", ast.Load()), ast.Load):
                short.setdefault(ast.unparse(node), node)
        self.terms = [*self.names, *sorted(short, key=len)][:MOST_TERMS]


def size(node: ast.AST) -> int:
    """The number of nodes of an expression, without contexts and operators."""
    return sum(isinstance(part, ast.expr | ast.keyword) for part in ast.walk(node))


def expressions(root: ast.AST) -> Iterator[Place]:
    """The places of all expressions that are read, in the order of the text; not annotations and defaults."""
    for field, value in ast.iter_fields(root):
        if field in ("annotation", "returns", "decorator_list", "args") and not isinstance(root, ast.Call):
            continue
        if isinstance(root, ast.Raise | ast.JoinedStr | ast.Import | ast.ImportFrom | ast.Assert):
            return
        for index, child in enumerate(value) if isinstance(value, list) else ((None, value),):
            if not isinstance(child, ast.AST):
                continue
            called = isinstance(root, ast.Call) and field == "func"
            is_read = isinstance(child, ast.expr) and isinstance(getattr(child, "ctx", ast.Load()), ast.Load)
            if is_read and not called:
                yield Place(root, field, index)
            yield from expressions(child)


# ------------------------------------------------------------------------------------------------- expressions


def of_expressions(function: ast.stmt, scope: Scope) -> Iterator[Mutation]:
    """Recipes at single places, at each occurrence of an expression, and in parallel lines."""
    places = list(expressions(function))
    recipes = {place: {(r.kind, r.key): r for r in recipes_for(place, scope)} for place in places}
    for place in places:
        for recipe in recipes[place].values():
            yield at([place], [recipe])
    seen = set()
    lines = [list(expressions(line)) for line in simple_statements(function)]
    equal = (group for inside in (places, *lines) for group in equal_places(inside))
    for group in (*equal, *parallel_places(function)):
        identity = tuple(id(place.node) for place in group)
        if identity in seen or any(place not in recipes for place in group):
            continue
        seen.add(identity)
        for key in recipes[group[0]]:
            if all(key in recipes[place] for place in group):
                yield at(group, [recipes[place][key] for place in group])
    yield from exchanged_names(function, scope, places)
    for inside in lines:
        yield from exchanged_parts(inside)


def at(places: Sequence[Place], recipes: Sequence[Recipe]) -> Mutation:
    """A mutation of some recipes at their places."""
    marks = [mark for p, recipe in zip(places, recipes, strict=True) for mark in recipe.mark or (p.node,)]
    cost = recipes[0].cost + (0.5 if len(places) > 1 else 0.0)
    makes = tuple(recipe.make for recipe in recipes)
    return Mutation(recipes[0].kind, cost, tuple(places), makes, tuple(map(span_of, marks)))


def between(left: ast.expr, right: ast.expr) -> Span:
    """The place between two operands, where the operator stands."""
    return Span(left.end_lineno, left.end_col_offset, right.lineno, right.col_offset)


def span_of(node: ast.AST | Span) -> Span:
    """Where a node stands."""
    if isinstance(node, Span):
        return node
    return Span(node.lineno, node.col_offset, node.end_lineno, node.end_col_offset)


def equal_places(places: Sequence[Place]) -> Iterator[list[Place]]:
    """Places of the same expression, where there are several."""
    same: dict[str, list[Place]] = {}
    for place in places:
        same.setdefault(ast.dump(place.node), []).append(place)
    yield from (group for group in same.values() if 1 < len(group) <= LONGEST_GROUP)


def parallel_places(function: ast.stmt) -> Iterator[list[Place]]:
    """The same spot of statements, or of entries of a tuple or call, that are alike but for names and numbers."""
    for node in ast.walk(function):
        for field in ("body", "orelse", "elts", "args"):
            children = getattr(node, field, None)
            if not isinstance(children, list) or len(children) < 2:
                continue
            alike = itertools.groupby(enumerate(children), key=lambda entry: skeleton(entry[1]))
            for _, group in alike:
                members = list(group)
                if 1 < len(members) <= LONGEST_GROUP:
                    inside = [list(expressions(child)) for _, child in members]
                    if isinstance(members[0][1], ast.expr):
                        inside = [[Place(node, field, i), *rest] for (i, _), rest in zip(members, inside, strict=True)]
                    yield from (list(group) for group in zip(*inside, strict=True))


def skeleton(node: ast.AST) -> str:
    """A node's form without its names and numbers; one of its own for what has none to compare."""
    if isinstance(node, ast.Name | ast.Constant):
        return f"{type(node).__name__} at {id(node)}"
    parts = []
    for part in ast.walk(node):
        parts.append(type(part).__name__)
        if isinstance(part, ast.Attribute):
            parts.append(part.attr)
    return " ".join(parts)


def exchanged_names(function: ast.stmt, scope: Scope, places: Sequence[Place]) -> Iterator[Mutation]:
    """Two names exchanged wherever they are read, in one statement or in the whole function."""
    for where in (function, *simple_statements(function)):
        read = list(places) if where is function else list(expressions(where))
        named = [place for place in read if isinstance(place.node, ast.Name) and place.node.id in scope.names]
        for a, b in itertools.combinations(dict.fromkeys(place.node.id for place in named), 2):
            both = [place for place in named if place.node.id in (a, b)]
            other = {a: b, b: a}
            makes = tuple(template(other[place.node.id], place.node) for place in both)
            spans = tuple(span_of(place.node) for place in both)
            if len(both) <= LONGEST_GROUP:
                yield Mutation("names exchanged", 2.0, tuple(both), makes, spans)


def exchanged_parts(places: Sequence[Place]) -> Iterator[Mutation]:
    """Two short parts of a statement exchanged, such as k // 2 and k % 2."""
    short = [p for p in places if isinstance(p.node, ast.BinOp | ast.Subscript | ast.Call) and size(p.node) <= SHORT]
    for a, b in itertools.combinations(short, 2):
        apart = span_of(a.node).last_line < b.node.lineno or a.node.end_col_offset <= b.node.col_offset
        if apart and type(a.node) is type(b.node) and ast.dump(a.node) != ast.dump(b.node):
            spans = span_of(a.node), span_of(b.node)
            yield Mutation("order", 2.0, (a, b), (the(b.node), the(a.node)), spans)


def simple_statements(function: ast.stmt) -> list[ast.stmt]:
    """The statements without a block of their own."""
    return [node for node in ast.walk(function) if isinstance(node, ast.stmt) and not hasattr(node, "body")]


def recipes_for(place: Place, scope: Scope) -> Iterator[Recipe]:
    """All recipes for an expression at its place."""
    node, parent = place.node, place.parent
    if isinstance(node, ast.Slice):
        yield from slices(node)
        return
    if isinstance(parent, ast.Subscript) and isinstance(parent.ctx, ast.Store) and node is parent.value:
        yield from names(node, scope)  # x in x[i] = 1: written to anything else, the line would do nothing
        return
    option = parent.arg if isinstance(parent, ast.keyword) and parent.arg in ("axis", "keepdims") else ""
    for family in (operators, comparisons, conditions, calls, constants, names, attributes, subscripts, branches):
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


# What a recipe makes: a node as it is, one with other fields, or a text around it.


def the(node) -> Callable:
    """Give a node, or a list of statements, as it is."""
    return lambda: node


def changed(node: ast.AST, **fields) -> ast.AST:
    """A copy of a node with other fields, at its place in the text."""
    return ast.fix_missing_locations(ast.copy_location(type(node)(**dict(ast.iter_fields(node)) | fields), node))


def template(text: str, node: ast.AST) -> Callable:
    """Make an expression of a text, with a node in the place of `_`."""
    return partial(filled, parsed(text), node)


parsed = cache(lambda text: ast.parse(text, mode="eval").body)


def filled(part, node: ast.AST):
    """Copy a part of a template; what is new has the node's place in the text."""
    if isinstance(part, list):
        return [filled(each, node) for each in part]
    if not isinstance(part, ast.AST):
        return part
    if isinstance(part, ast.Name) and part.id == "_":
        return node
    new = type(part)(**{field: filled(value, node) for field, value in ast.iter_fields(part)})
    return ast.copy_location(new, node)


def without(items: list, i: int) -> list:
    """A list without one of its entries."""
    return items[:i] + items[i + 1 :]


def exchanged(items: list, i: int, j: int) -> list:
    """A list with two of its entries exchanged."""
    new = list(items)
    new[i], new[j] = new[j], new[i]
    return new


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


def conditions(node: ast.expr, scope: Scope) -> Iterator[Recipe]:
    """`and` for `or`, one condition too many, and one that is missing."""
    if isinstance(node, ast.BoolOp):
        other = ast.Or if isinstance(node.op, ast.And) else ast.And
        yield Recipe("condition", "and, or", 1, partial(changed, node, op=other()))
        for i, value in enumerate(node.values):
            rest = without(node.values, i)
            make = partial(changed, node, values=rest) if len(rest) > 1 else the(rest[0])
            yield Recipe("condition", f"without {i}", 1, make, (value,))
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
        kind = keyword.arg if keyword.arg in ("axis", "keepdims") else "option"
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
        if "keepdims" not in given:
            yield Recipe("keepdims", "keepdims", 1.5, with_option(node, "keepdims", "True"))


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


def attributes(node: ast.expr, scope: Scope) -> Iterator[Recipe]:
    """A transpose too many, another entry of a shape."""
    if isinstance(node, ast.Attribute) and node.attr == "T":
        yield Recipe("transpose", "without T", 1, the(node.value))
    if isinstance(node, ast.Attribute) and node.attr in ("size", "shape") and not is_module(node, scope):
        yield Recipe("size", "len", 1, template("len(_)", node.value))
    if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "len" and node.args:
        yield Recipe("size", "size", 1, template("_.size", node.args[0]))
        yield Recipe("size", "columns", 1, template("_.shape[1]", node.args[0]))


def subscripts(node: ast.expr, scope: Scope) -> Iterator[Recipe]:
    """Indices in another order, or one that is too much."""
    if isinstance(node, ast.Subscript):
        yield Recipe("index too many", "without the index", 1, the(node.value), (node.slice,))
        if isinstance(node.slice, ast.Name | ast.Constant | ast.BinOp):
            for key, before in (("column", ast.Slice()), ("last axis", ast.Constant(...))):
                make = partial(changed, node, slice=ast.Tuple([before, node.slice], ast.Load()))
                yield Recipe("index", key, 1.5, make, (node.slice,))
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


def branches(node: ast.expr, scope: Scope) -> Iterator[Recipe]:
    """The branches of a conditional expression exchanged, or one of them alone."""
    if isinstance(node, ast.IfExp):
        yield Recipe("branch", "exchanged", 1, partial(changed, node, body=node.orelse, orelse=node.body))
        yield Recipe("branch", "first", 1, the(node.body))
        yield Recipe("branch", "second", 1, the(node.orelse))


def missing_around(node: ast.expr) -> Iterator[Recipe]:
    """What may be missing around an expression."""
    for kind, cost, texts in AROUND:
        for text in texts.split(" | "):
            yield Recipe(kind, text, cost, template(text, node))


def missing_terms(node: ast.expr, scope: Scope) -> Iterator[Recipe]:
    """A term or factor of the function's own names that is missing, or an index."""
    own = ast.unparse(node)
    for term in scope.terms:
        if term == own:
            continue
        for op in ("+", "-", "*", "/"):
            yield Recipe("term", f"{op} {term}", 2, template(f"_ {op} ({term})", node))
        if term in scope.names:
            yield Recipe("index missing", term, 2, template(f"_[{term}]", node))
            yield Recipe("term", f"@ {term}", 2.5, template(f"_ @ {term}", node))
            yield Recipe("term", f"& {term}", 2.5, template(f"_ & {term}", node))


# --------------------------------------------------------------------------------------------------- statements


def of_statements(function: ast.stmt) -> Iterator[Mutation]:
    """A line left out, two lines exchanged, one moved into or out of a block, another assignment."""
    for node in ast.walk(function):
        for field in ("body", "orelse"):
            block = getattr(node, field, None)
            if isinstance(block, list) and block and isinstance(block[0], ast.stmt):
                yield from of_block(Place(node, field))
        if isinstance(node, ast.AugAssign):
            yield from augmented(node)
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Tuple):
            yield from targets_exchanged(node.targets[0])


def of_block(place: Place) -> Iterator[Mutation]:
    """Mutations of a list of statements."""
    block = place.node

    def mutation(kind: str, cost: float, new: list[ast.stmt], *marked: ast.stmt) -> Mutation:
        return Mutation(kind, cost, (place,), (the(new),), tuple(map(first_line, marked)))

    for i, statement in enumerate(block):
        above, below = block[:i], block[i + 1 :]
        if len(block) > 1 and not is_docstring(statement):
            yield mutation("line too many", 1, above + below, statement)
        if below:
            yield mutation("lines exchanged", 2, exchanged(block, i, i + 1), statement, below[0])
        inner = getattr(statement, "body", None)
        if not isinstance(inner, list) or isinstance(statement, ast.FunctionDef | ast.ClassDef):
            continue
        if len(inner) > 1:
            yield mutation("moved", 2, [*above, changed(statement, body=inner[:-1]), inner[-1], *below], inner[-1])
            yield mutation("moved", 2, [*above, inner[0], changed(statement, body=inner[1:]), *below], inner[0])
        if below:
            yield mutation("moved", 2, [*above, changed(statement, body=[*inner, below[0]]), *below[1:]], below[0])
        if above:
            yield mutation("moved", 2, [*above[:-1], changed(statement, body=[above[-1], *inner]), *below], above[-1])
        if isinstance(statement, ast.If):
            yield mutation("branch", 1.5, [*above, *inner, *below], statement)
            if statement.orelse:
                turned = changed(statement, body=statement.orelse, orelse=inner)
                yield mutation("branch", 1.5, [*above, turned, *below], statement)


def is_docstring(statement: ast.stmt) -> bool:
    """Whether a statement is a text alone."""
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def first_line(statement: ast.stmt) -> Span:
    """The part of a statement's first line that belongs to it: up to the block that it opens."""
    body = getattr(statement, "body", None)
    if not isinstance(body, list):
        return span_of(statement)
    ends = [n for n in ast.iter_child_nodes(statement) if isinstance(n, ast.expr)]
    last = max(ends, key=lambda n: (n.end_lineno, n.end_col_offset), default=None)
    if last is None:
        return Span(statement.lineno, statement.col_offset, statement.lineno, statement.col_offset + 4)
    return Span(statement.lineno, statement.col_offset, last.end_lineno, last.end_col_offset)


def targets_exchanged(targets: ast.Tuple) -> Iterator[Mutation]:
    """`W, H = y.shape` for `H, W = y.shape`."""
    place = Place(targets, "elts")
    for i, j in itertools.combinations(range(len(targets.elts)), 2):
        spans = span_of(targets.elts[i]), span_of(targets.elts[j])
        yield Mutation("order", 1, (place,), (the(exchanged(targets.elts, i, j)),), spans)


def augmented(node: ast.AugAssign) -> Iterator[Mutation]:
    """Another operator of `+=`; `|=` for `&=`."""
    for op in OPERATORS.get(type(node.op), ()):
        if not isinstance(node.op, op):
            yield Mutation("operator", 1, (Place(node, "op"),), (the(op()),), (span_of(node),))
