"""Wrong answers by the thousand: copies of a function with one small thing changed, as a slip of the hand would.

OPERATORS are those of `labkit.course.questions.slips`, by which a check recognises slips; HELD_OUT are others, which
slips do not know: branches, neighbouring functions, arguments, keywords, casts and copies. A check knows functions of
one family, exchanged arguments, missing options and turns of loops all the same, as steps of a right answer that are
taken otherwise (`labkit.course.questions.otherwise`).
"""

import ast
from collections.abc import Callable, Iterator

from labkit.course.questions.slips import OPERATORS, Operators, Slip, but, on, slips

HELD_OUT: Operators = {}
CONFUSED = [
    {"min", "max"},
    {"amin", "amax"},
    {"nanmin", "nanmax"},
    {"argmin", "argmax"},
    {"minimum", "maximum"},
    {"sin", "cos"},
    {"arctan2", "hypot"},
    {"sum", "mean", "prod"},
    {"nansum", "nanmean"},
    {"any", "all"},
    {"zeros", "ones"},
    {"zeros_like", "ones_like"},
    {"floor", "ceil", "round"},
    {"exp", "log"},
    {"sqrt", "square"},
    {"isnan", "isfinite"},
    {"eigh", "svd"},
    {"cumsum", "cumprod"},
    {"mean", "median"},
    {"hstack", "vstack"},
    {"vstack", "column_stack"},
    {"diff", "cumsum"},
    {"unique", "sort"},
]
ORDERED = {"where", "arctan2", "cross", "outer", "isin", "dot", "subtract", "divide"}  # the order of arguments counts
CASTS = {"float": "int", "float64": "float32", "int64": "uint8", "uint8": "int8", "intp": "uint8"}


def mutants(function: Callable, held_out: bool | None = None) -> list[Slip]:
    """Give the mutants of a plain function: of all operators, of those held out, or of the others."""
    tables = {None: (OPERATORS, HELD_OUT), True: (HELD_OUT,), False: (OPERATORS,)}[held_out]
    operators = {}
    for table in tables:
        for kind, entries in table.items():
            operators[kind] = operators.get(kind, []) + entries
    return slips(function, operators)


@on(HELD_OUT, ast.Call)
def neighbouring_function(node: ast.Call) -> Iterator[tuple[str, ast.AST]]:
    """A function that is confused with it."""
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    field = "attr" if isinstance(node.func, ast.Attribute) else "id"
    for group in CONFUSED:
        for other in sorted(group - {name}) if name in group else ():
            yield "", but(node, func=but(node.func, **{field: other}))


@on(HELD_OUT, ast.Call)
def arguments(node: ast.Call) -> Iterator[tuple[str, ast.AST]]:
    """The last two arguments swapped; a keyword argument left out."""
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    if name in ORDERED and len(node.args) >= 2:
        yield "", but(node, args=[*node.args[:-2], node.args[-1], node.args[-2]])
    for i in range(len(node.keywords)):
        if node.keywords[i].arg not in ("dtype", "out"):
            yield "", but(node, keywords=node.keywords[:i] + node.keywords[i + 1 :])


@on(HELD_OUT, ast.AugAssign)
def augmented(node: ast.AugAssign) -> Iterator[tuple[str, ast.AST | None]]:
    """Plain assignment, another operator, or nothing at all."""
    yield "", ast.Assign(targets=[node.target], value=node.value, lineno=node.lineno)
    yield "", but(node, op=ast.Sub() if isinstance(node.op, ast.Add) else ast.Add())
    yield "", None


@on(HELD_OUT, ast.If, ast.IfExp)
def branch(node: ast.If | ast.IfExp) -> Iterator[tuple[str, ast.AST]]:
    """One branch whatever the condition."""
    yield "", but(node, test=ast.Constant(True))
    yield "", but(node, test=ast.Constant(False))


@on(HELD_OUT, ast.Name, ast.Attribute)
def cast(node: ast.Name | ast.Attribute) -> Iterator[tuple[str, ast.AST]]:
    """A narrower type."""
    field = "id" if isinstance(node, ast.Name) else "attr"
    if isinstance(node.ctx, ast.Load) and getattr(node, field) in CASTS:
        yield "", but(node, **{field: CASTS[getattr(node, field)]})


@on(HELD_OUT, ast.For)
def loop(node: ast.For) -> Iterator[tuple[str, ast.AST]]:
    """Without the first turn, or without the last."""
    turns = ast.Call(ast.Name("list", ast.Load()), [node.iter], [])
    for bounds in (ast.Slice(lower=ast.Constant(1)), ast.Slice(upper=ast.Constant(-1))):
        yield "", but(node, iter=ast.Subscript(turns, bounds, ast.Load()))
