"""Wrong answers by the dozen: copies of a function with one small thing changed, as a slip of the hand would.

Changed are operators, comparisons, constants (an axis is one), slices and indices, terms and factors, names of
functions that are easily confused, keyword arguments, and which branch is taken. What cannot be observed is left alone:
the docstring, annotations and defaults, and the context managers that only silence warnings.
"""

import ast
import copy
import inspect
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import dataclass

SWAPPED = {
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div, ast.Add),
    ast.Div: (ast.Mult,),
    ast.FloorDiv: (ast.Div, ast.Mult),
    ast.Mod: (ast.FloorDiv,),
    ast.Pow: (ast.Mult,),
    ast.MatMult: (ast.Mult,),
    ast.BitAnd: (ast.BitOr,),
    ast.BitOr: (ast.BitAnd,),
    ast.BitXor: (ast.BitOr,),
    ast.LShift: (ast.RShift,),
    ast.RShift: (ast.LShift,),
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.GtE),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.LtE),
    ast.Eq: (ast.NotEq, ast.GtE),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
    ast.And: (ast.Or,),
    ast.Or: (ast.And,),
}
CONFUSED = [
    {"min", "max"},
    {"amin", "amax"},
    {"nanmin", "nanmax"},
    {"argmin", "argmax"},
    {"minimum", "maximum"},
    {"sin", "cos"},
    {"sum", "mean", "prod"},
    {"nansum", "nanmean"},
    {"any", "all"},
    {"zeros", "ones"},
    {"zeros_like", "ones_like"},
    {"floor", "ceil"},
    {"exp", "log"},
    {"sqrt", "square"},
    {"isnan", "isfinite"},
    {"eigh", "svd"},
    {"cumsum", "cumprod"},
    {"mean", "median"},
    {"hstack", "vstack"},
    {"vstack", "column_stack"},
]
ORDERED = {"where", "arctan2", "cross", "outer", "isin", "dot", "subtract", "divide"}  # the order of arguments counts
SILENT = ("errstate", "catch_warnings", "simplefilter")


@dataclass(frozen=True)
class Mutant:
    """A function with one thing changed; name: "line 3: a + b -> a - b", lines counted in the function."""

    name: str
    function: Callable


def mutants(function: Callable) -> list[Mutant]:
    """Give all mutants of a plain function that is complete in itself, each different in its text."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    (definition,) = tree.body
    if not isinstance(definition, ast.FunctionDef):
        raise ValueError(f"function: expected a plain `def`, got {ast.unparse(definition)[:60]}")
    definition.decorator_list, definition.returns = [], None
    if ast.get_docstring(definition) is not None:
        definition.body = definition.body[1:] or [ast.Pass()]
    found = {}
    for path in observable(definition):
        old = follow(definition, path)
        for new in changes(old):
            changed = copy.deepcopy(definition)
            replace(changed, path, new)
            text = ast.unparse(ast.fix_missing_locations(changed))
            line = getattr(old, "lineno", None) or getattr(follow(definition, path[:-1]), "lineno", 0)
            found.setdefault(text, f"line {line}: {shown(old)} -> {shown(new)}")
    found.pop(ast.unparse(definition), None)
    return [Mutant(name, compiled(text, function)) for text, name in found.items()]


def compiled(text: str, function: Callable) -> Callable:
    """Define the function that a text defines, among the names that the original sees."""
    names = dict(function.__globals__)
    exec(compile(text, f"<mutant of {function.__name__}>", "exec"), names)
    return names[function.__name__]


def shown(node: ast.AST | None) -> str:
    """A piece of code in one line."""
    return "nothing" if node is None else " ".join(ast.unparse(node).split())


# ---------------------------------------------------------------------------------------- places in the tree

Path = tuple[tuple[str, int | None], ...]


def observable(root: ast.AST) -> Iterator[Path]:
    """Paths to all nodes of a function's body whose change could be seen from outside."""
    for i in range(len(root.body)):
        yield from below(root.body[i], (("body", i),))


def below(node: ast.AST, path: Path) -> Iterator[Path]:
    """Paths to a node and to all below it."""
    if isinstance(node, ast.Raise | ast.Assert | ast.JoinedStr):
        return
    yield path
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "defaults", "kw_defaults", "ctx", "op", "ops"):
            continue
        for i, child in enumerate(value if isinstance(value, list) else [value]):
            silent = isinstance(child, ast.withitem) and any(word in ast.unparse(child) for word in SILENT)
            if isinstance(child, ast.AST) and not silent:
                yield from below(child, (*path, (name, i if isinstance(value, list) else None)))


def follow(node: ast.AST, path: Path) -> ast.AST:
    """The node at the end of a path."""
    for name, i in path:
        node = getattr(node, name) if i is None else getattr(node, name)[i]
    return node


def replace(root: ast.AST, path: Path, new: ast.AST | None) -> None:
    """Put another node in the place of one; None takes it out of its list."""
    parent, (name, i) = follow(root, path[:-1]), path[-1]
    if i is None:
        setattr(parent, name, new)
    elif new is None:
        del getattr(parent, name)[i]
        if name == "body" and not parent.body:
            parent.body = [ast.Pass()]
    else:
        getattr(parent, name)[i] = new


# ------------------------------------------------------------------------------------------ what is changed


def changes(node: ast.AST) -> Iterator[ast.AST | None]:
    """What a node may be replaced by."""
    kind = CHANGES.get(type(node))
    if kind is not None:
        yield from kind(node)


def but(node: ast.AST, **fields) -> ast.AST:
    """A copy of a node with some fields replaced."""
    node = copy.deepcopy(node)
    for name, value in fields.items():
        setattr(node, name, value)
    return node


def binary(node: ast.BinOp) -> Iterator[ast.AST]:
    """Another operator; one of the two terms or factors alone."""
    for op in SWAPPED.get(type(node.op), ()):
        yield but(node, op=op())
    yield node.left
    if not isinstance(node.op, ast.Pow | ast.Mod | ast.FloorDiv):
        yield node.right


def boolean(node: ast.BoolOp) -> Iterator[ast.AST]:
    """And for or; one condition dropped."""
    yield but(node, op=SWAPPED[type(node.op)][0]())
    for i in range(len(node.values)):
        rest = node.values[:i] + node.values[i + 1 :]
        yield rest[0] if len(rest) == 1 else but(node, values=rest)


def comparison(node: ast.Compare) -> Iterator[ast.AST]:
    """Another comparison."""
    for i, op in enumerate(node.ops):
        for other in SWAPPED[type(op)]:
            yield but(node, ops=[*node.ops[:i], other(), *node.ops[i + 1 :]])


def augmented(node: ast.AugAssign) -> Iterator[ast.AST | None]:
    """Another operator, plain assignment, or nothing at all."""
    for op in SWAPPED.get(type(node.op), ()):
        yield but(node, op=op())
    yield ast.Assign(targets=[node.target], value=node.value, lineno=node.lineno)
    yield None


def constant(node: ast.Constant) -> Iterator[ast.AST]:
    """A number beside it; the other truth value."""
    value = node.value
    if isinstance(value, bool):
        yield but(node, value=not value)
    elif isinstance(value, int):
        yield but(node, value=value + 1)
        yield but(node, value=value - 1)
    elif isinstance(value, float):
        yield but(node, value=value * 1.5 + 0.1)
        yield but(node, value=-value if value else 1.0)


def unary(node: ast.UnaryOp) -> Iterator[ast.AST]:
    """Without the sign, or the negation."""
    yield node.operand


def called(node: ast.Call) -> Iterator[ast.AST]:
    """A function that is confused with it; the last two arguments swapped; a keyword argument left out."""
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    field = "attr" if isinstance(node.func, ast.Attribute) else "id"
    for group in CONFUSED:
        for other in sorted(group - {name}) if name in group else ():
            yield but(node, func=but(node.func, **{field: other}))
    if name in ORDERED and len(node.args) >= 2:
        yield but(node, args=[*node.args[:-2], node.args[-1], node.args[-2]])
    for i in range(len(node.keywords)):
        if node.keywords[i].arg not in ("dtype", "out"):
            yield but(node, keywords=node.keywords[:i] + node.keywords[i + 1 :])


def attribute(node: ast.Attribute) -> Iterator[ast.AST]:
    """Without the transposition."""
    if node.attr == "T":
        yield node.value


def sliced(node: ast.Slice) -> Iterator[ast.AST]:
    """Without one of its bounds."""
    for bound in ("lower", "upper", "step"):
        if getattr(node, bound) is not None:
            yield but(node, **{bound: None})


def indexed(node: ast.Tuple) -> Iterator[ast.AST]:
    """Two neighbours of a tuple, of indices or of results, swapped."""
    for i in range(len(node.elts) - 1):
        a, b = node.elts[i : i + 2]
        if isinstance(node.ctx, ast.Load) and not isinstance(a, ast.Starred) and not isinstance(b, ast.Starred):
            yield but(node, elts=[*node.elts[:i], b, a, *node.elts[i + 2 :]])


def branched(node: ast.If | ast.IfExp) -> Iterator[ast.AST]:
    """One branch whatever the condition."""
    yield but(node, test=ast.Constant(True))
    yield but(node, test=ast.Constant(False))


def expression(node: ast.Expr) -> Iterator[None]:
    """A statement left out; its value is not used, so it does something."""
    yield None


CHANGES = {
    ast.BinOp: binary,
    ast.BoolOp: boolean,
    ast.Compare: comparison,
    ast.AugAssign: augmented,
    ast.Constant: constant,
    ast.UnaryOp: unary,
    ast.Call: called,
    ast.Attribute: attribute,
    ast.Slice: sliced,
    ast.Tuple: indexed,
    ast.If: branched,
    ast.IfExp: branched,
    ast.Expr: expression,
}
