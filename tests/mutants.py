"""Wrong answers by the thousand: copies of a function with one small thing changed, as a slip of the hand would.

OPERATORS are those of `labkit.course.checker.slips`, by which a check recognises slips. MORE are others: branches,
neighbouring functions, arguments, keywords, casts and turns of loops, many of which a check knows as steps of a right
answer that are taken otherwise (`labkit.course.checker.otherwise`). HELD_OUT, a third of all, are those of MutPy,
mutmut and PIT that are not among the others; no check was written with a view to them, and none should be.
"""

import ast
import builtins
from collections.abc import Callable, Iterator

from labkit.course.checker.slips import OPERATORS, Operators, Slip, but, on, slips

MORE: Operators = {}
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


def mutants(function: Callable, held_out: bool = False) -> list[Slip]:
    """Give the mutants of a plain function, or those of the operators that are held out."""
    operators = {kind: OPERATORS.get(kind, []) + MORE.get(kind, []) for kind in OPERATORS | MORE}
    return slips(function, HELD_OUT if held_out else operators)


@on(MORE, ast.Call)
def neighbouring_function(node: ast.Call) -> Iterator[tuple[str, ast.AST]]:
    """A function that is confused with it."""
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    field = "attr" if isinstance(node.func, ast.Attribute) else "id"
    for group in CONFUSED:
        for other in sorted(group - {name}) if name in group else ():
            yield "", but(node, func=but(node.func, **{field: other}))


@on(MORE, ast.Call)
def arguments(node: ast.Call) -> Iterator[tuple[str, ast.AST]]:
    """The last two arguments swapped; a keyword argument left out."""
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    if name in ORDERED and len(node.args) >= 2:
        yield "", but(node, args=[*node.args[:-2], node.args[-1], node.args[-2]])
    for i in range(len(node.keywords)):
        if node.keywords[i].arg not in ("dtype", "out"):
            yield "", but(node, keywords=node.keywords[:i] + node.keywords[i + 1 :])


@on(MORE, ast.AugAssign)
def augmented(node: ast.AugAssign) -> Iterator[tuple[str, ast.AST | None]]:
    """Plain assignment, another operator, or nothing at all."""
    yield "", ast.Assign(targets=[node.target], value=node.value, lineno=node.lineno)
    yield "", but(node, op=ast.Sub() if isinstance(node.op, ast.Add) else ast.Add())
    yield "", None


@on(MORE, ast.If, ast.IfExp)
def branch(node: ast.If | ast.IfExp) -> Iterator[tuple[str, ast.AST]]:
    """One branch whatever the condition."""
    yield "", but(node, test=ast.Constant(True))
    yield "", but(node, test=ast.Constant(False))


@on(MORE, ast.Name, ast.Attribute)
def cast(node: ast.Name | ast.Attribute) -> Iterator[tuple[str, ast.AST]]:
    """A narrower type."""
    field = "id" if isinstance(node, ast.Name) else "attr"
    if isinstance(node.ctx, ast.Load) and getattr(node, field) in CASTS:
        yield "", but(node, **{field: CASTS[getattr(node, field)]})


@on(MORE, ast.For)
def loop(node: ast.For) -> Iterator[tuple[str, ast.AST]]:
    """Without the first turn, or without the last."""
    turns = ast.Call(ast.Name("list", ast.Load()), [node.iter], [])
    for bounds in (ast.Slice(lower=ast.Constant(1)), ast.Slice(upper=ast.Constant(-1))):
        yield "", but(node, iter=ast.Subscript(turns, bounds, ast.Load()))


# --------------------------------------------------------------------------------------------------- held out


@on(HELD_OUT, ast.For)
def few_turns(node: ast.For) -> Iterator[tuple[str, ast.AST]]:
    """One turn alone, or none (MutPy's OIL and ZIL)."""
    turns = ast.Call(ast.Name("list", ast.Load()), [node.iter], [])
    for count in (1, 0):
        yield "", but(node, iter=ast.Subscript(turns, ast.Slice(upper=ast.Constant(count)), ast.Load()))


@on(HELD_OUT, ast.Assign, ast.If, ast.For, ast.While)
def statement_deleted(node: ast.stmt) -> Iterator[tuple[str, None]]:
    """A statement left out (SDL)."""
    yield "", None


@on(HELD_OUT, ast.Return)
def empty_return(node: ast.Return) -> Iterator[tuple[str, ast.AST]]:
    """Zeros in the place of the result (PIT's empty returns)."""
    if isinstance(node.value, ast.Tuple):
        for i, part in enumerate(node.value.elts):
            zero = ast.BinOp(ast.Constant(0), ast.Mult(), part)
            yield "", but(node, value=but(node.value, elts=[*node.value.elts[:i], zero, *node.value.elts[i + 1 :]]))
    elif node.value is not None:
        yield "", but(node, value=ast.BinOp(ast.Constant(0), ast.Mult(), node.value))


@on(HELD_OUT, ast.Continue, ast.Break)
def jump(node: ast.stmt) -> Iterator[tuple[str, ast.AST]]:
    """break for continue, and the other way round (MutPy's BCR)."""
    yield "", ast.Break() if isinstance(node, ast.Continue) else ast.Continue()


@on(HELD_OUT, ast.Name)
def sign_inserted(node: ast.Name) -> Iterator[tuple[str, ast.AST]]:
    """A minus before a variable (AOI)."""
    if isinstance(node.ctx, ast.Load) and node.id != "np" and not hasattr(builtins, node.id):
        yield "", ast.UnaryOp(ast.USub(), node)


@on(HELD_OUT, ast.Call)
def argument_handed_on(node: ast.Call) -> Iterator[tuple[str, ast.AST]]:
    """A call of several arguments replaced by one of them (PIT's argument propagation)."""
    if len(node.args) > 1:
        for part in node.args:
            if not isinstance(part, ast.Starred):
                yield "", part


@on(HELD_OUT, ast.Call)
def argument_none(node: ast.Call) -> Iterator[tuple[str, ast.AST]]:
    """None in the place of an argument (mutmut)."""
    for i in range(1, len(node.args)):
        yield "", but(node, args=[*node.args[:i], ast.Constant(None), *node.args[i + 1 :]])


@on(HELD_OUT, ast.If, ast.IfExp, ast.While)
def negated(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """The opposite condition (COI)."""
    yield "", but(node, test=ast.UnaryOp(ast.Not(), node.test))
