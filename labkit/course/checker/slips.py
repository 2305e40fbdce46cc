"""Slips of the hand: the reference with one small thing changed, and what kind of slip that is.

A wrong answer that gives what such a copy gives is told the kind of slip, and which argument is near it; not the line.
"""

import ast
import copy
import inspect
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import dataclass

SILENT = ("errstate", "catch_warnings", "simplefilter")  # context managers whose change nobody sees


@dataclass(frozen=True)
class Slip:
    """A function with one thing changed.

    name: "line 3: a + b -> a - b", lines counted in the function. says: what kind of slip it is, in words; near: the
    arguments of the function that the changed piece is made of.
    """

    name: str
    says: str
    near: tuple[str, ...]
    function: Callable

    def __str__(self) -> str:
        near = f" where {' and '.join(self.near)} come{'s' * (len(self.near) == 1)} in" if self.near else ""
        return f"Your output is right as if{near} {self.says}."


Operator = Callable[[ast.AST], Iterator[tuple[str, ast.AST | None]]]
Operators = dict[type[ast.AST], list[Operator]]
OPERATORS: Operators = {}


def on(operators: Operators, *kinds: type[ast.AST]) -> Callable[[Operator], Operator]:
    """Enter an operator for kinds of nodes."""

    def enter(operator: Operator) -> Operator:
        for kind in kinds:
            operators.setdefault(kind, []).append(operator)
        return operator

    return enter


def slips(function: Callable, operators: Operators = OPERATORS) -> list[Slip]:
    """Give all slips of a plain function that is complete in itself, each different in its text.

    Raises ValueError for anything but a `def`.
    """
    definition = definition_of(function)
    sources = made_of(definition)
    found: dict[str, tuple[str, str, tuple[str, ...]]] = {}
    for path in observable(definition):
        old = follow(definition, path)
        for operator in operators.get(type(old), ()):
            for says, new in operator(old):
                changed = copy.deepcopy(definition)
                put(changed, path, new)
                text = ast.unparse(ast.fix_missing_locations(changed))
                line = getattr(old, "lineno", None) or getattr(follow(definition, path[:-1]), "lineno", 0)
                near = tuple(sorted(set().union(*(sources.get(name, set()) for name in names_in(old)))))
                found.setdefault(text, (f"line {line}: {shown(old)} -> {shown(new)}", says, near))
    found.pop(ast.unparse(definition), None)
    return [Slip(*told, compiled(text, function)) for text, told in found.items() if is_python(text)]


def definition_of(function: Callable) -> ast.FunctionDef:
    """The definition of a plain function, without decorators and docstring; raises ValueError for anything else."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(inspect.unwrap(function))))
    (definition,) = tree.body
    if not isinstance(definition, ast.FunctionDef):
        raise ValueError(f"function: expected a plain `def`, got {ast.unparse(definition)[:60]}")
    definition.decorator_list, definition.returns = [], None
    if ast.get_docstring(definition) is not None:
        definition.body = definition.body[1:] or [ast.Pass()]
    return definition


def is_python(text: str) -> bool:
    """Whether a text can be compiled: a tuple without its brackets, say, cannot stand everywhere."""
    try:
        compile(text, "<slip>", "exec")
    except SyntaxError:
        return False
    return True


def compiled(text: str, function: Callable, **more: object) -> Callable:
    """Define the function that a text defines, among the names that the original sees and more."""
    function = inspect.unwrap(function)
    names = function.__globals__ | more
    exec(compile(text, f"<slip of {function.__name__}>", "exec"), names)
    return names[function.__name__]


def shown(node: ast.AST | None) -> str:
    """A piece of code in one line."""
    return "nothing" if node is None else " ".join(ast.unparse(node).split())


def names_in(node: ast.AST) -> set[str]:
    """The names in a piece of code."""
    return {part.id for part in ast.walk(node) if isinstance(part, ast.Name)}


def made_of(definition: ast.FunctionDef) -> dict[str, set[str]]:
    """For each name in a function, and in functions defined in it, the arguments that its value is made of."""
    sources = {argument.arg: {argument.arg} for argument in definition.args.args}
    inner = {node.name: node.args.args for node in ast.walk(definition) if isinstance(node, ast.FunctionDef)}
    given = []  # names, and what they are given
    for node in ast.walk(definition):
        if isinstance(node, ast.Assign | ast.AugAssign | ast.For | ast.comprehension | ast.NamedExpr):
            value = node.iter if isinstance(node, ast.For | ast.comprehension) else node.value
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            given.append((set().union(*map(names_in, targets)), names_in(value)))
        elif isinstance(node, ast.Call):
            called = inner.get(getattr(node.func, "id", ""), ())
            given += [({to.arg}, names_in(value)) for to, value in zip(called, node.args, strict=False)]
    for _ in range(3):  # an assignment may use a name that is set further down, in a loop
        for names, others in given:
            origin = set().union(*(sources.get(name, set()) for name in others))
            for name in names:
                sources[name] = sources.get(name, set()) | origin
    return sources


# ---------------------------------------------------------------------------------------- places in the tree

Path = tuple[tuple[str, int | None], ...]


def observable(root: ast.FunctionDef) -> Iterator[Path]:
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


def put(root: ast.AST, path: Path, new: ast.AST | None) -> None:
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


def but(node: ast.AST, **fields) -> ast.AST:
    """A copy of a node with some fields replaced."""
    node = copy.deepcopy(node)
    for name, value in fields.items():
        setattr(node, name, value)
    return node


# ------------------------------------------------------------------------------------------------- operators

ARITHMETIC = {
    ast.Add: ((ast.Sub, "a plus were a minus"),),
    ast.Sub: ((ast.Add, "a minus were a plus"),),
    ast.Mult: ((ast.Div, "a product were a quotient"), (ast.Add, "a product were a sum")),
    ast.Div: ((ast.Mult, "a quotient were a product"),),
    ast.FloorDiv: ((ast.Div, "a division were not rounded down"), (ast.Mult, "a quotient were a product")),
    ast.Mod: ((ast.FloorDiv, "a remainder were a quotient"),),
    ast.Pow: ((ast.Mult, "a power were a product"),),
    ast.MatMult: ((ast.Mult, "a product of matrices were taken number by number"),),
    ast.BitAnd: ((ast.BitOr, "an `and` were an `or`"),),
    ast.BitOr: ((ast.BitAnd, "an `or` were an `and`"),),
    ast.BitXor: ((ast.BitOr, "an `either` were an `or`"),),
    ast.LShift: ((ast.RShift, "bits were moved the other way"),),
    ast.RShift: ((ast.LShift, "bits were moved the other way"),),
}
LEFT_OUT = {
    ast.Add: "one term of a sum were left out",
    ast.Sub: "one term of a difference were left out",
    ast.Mult: "one factor were left out",
    ast.Div: "a divisor or what it divides were left out",
    ast.FloorDiv: "a divisor were left out",
    ast.Mod: "a remainder were not taken",
    ast.Pow: "a power were left out",
    ast.MatMult: "one matrix of a product were left out",
}


@on(OPERATORS, ast.BinOp)
def operation(node: ast.BinOp) -> Iterator[tuple[str, ast.AST]]:
    """Another operator, the two sides exchanged, or one of them alone."""
    for op, says in ARITHMETIC.get(type(node.op), ()):
        yield says, but(node, op=op())
    says = LEFT_OUT.get(type(node.op), "one of two conditions were left out")
    yield says, node.left
    if not isinstance(node.op, ast.Pow | ast.Mod | ast.FloorDiv):
        yield says, node.right
    if isinstance(node.op, ast.Sub | ast.Div | ast.Pow | ast.MatMult | ast.FloorDiv):
        yield "the two sides of an operation were exchanged", but(node, left=node.right, right=node.left)


COMPARED = {
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
}
LIMITS = {(ast.Lt, ast.LtE), (ast.LtE, ast.Lt), (ast.Gt, ast.GtE), (ast.GtE, ast.Gt)}


@on(OPERATORS, ast.Compare)
def comparison(node: ast.Compare) -> Iterator[tuple[str, ast.AST]]:
    """With the limit or without it, or the other way round."""
    for i, op in enumerate(node.ops):
        for other in COMPARED[type(op)]:
            limit = (type(op), other) in LIMITS
            says = (
                "a limit itself were counted otherwise (< and <=)" if limit else "a comparison were the other way round"
            )
            yield says, but(node, ops=[*node.ops[:i], other(), *node.ops[i + 1 :]])


@on(OPERATORS, ast.BoolOp)
def conditions(node: ast.BoolOp) -> Iterator[tuple[str, ast.AST]]:
    """And for or; one condition dropped."""
    other = ast.Or() if isinstance(node.op, ast.And) else ast.And()
    yield "an `and` and an `or` were exchanged", but(node, op=other)
    for i in range(len(node.values)):
        rest = node.values[:i] + node.values[i + 1 :]
        yield "one of two conditions were left out", rest[0] if len(rest) == 1 else but(node, values=rest)


@on(OPERATORS, ast.Constant)
def constant(node: ast.Constant) -> Iterator[tuple[str, ast.AST]]:
    """A number beside it; its double, half and negative; the other truth value."""
    value = node.value
    if isinstance(value, bool):
        yield "a yes were a no", but(node, value=not value)
    elif isinstance(value, int):
        for other in (value + 1, value - 1):
            yield "a whole number, or an axis, were one off", but(node, value=other)
    elif isinstance(value, float):
        for other in (2.0 * value, 0.5 * value):
            yield "a number were doubled or halved", but(node, value=other)
        if value:
            yield "a number had the other sign", but(node, value=-value)
        for other in (value + 1.0, value - 1.0):
            yield "a number were one off", but(node, value=other)


@on(OPERATORS, ast.UnaryOp)
def unary(node: ast.UnaryOp) -> Iterator[tuple[str, ast.AST]]:
    """Without the sign, or the negation."""
    yield "a minus, or a `not`, were left out", node.operand


@on(OPERATORS, ast.Slice)
def sliced(node: ast.Slice) -> Iterator[tuple[str, ast.AST]]:
    """Without one of its bounds."""
    for bound in ("lower", "upper", "step"):
        if getattr(node, bound) is not None:
            yield "a bound of a slice were left out", but(node, **{bound: None})


@on(OPERATORS, ast.Tuple)
def neighbours(node: ast.Tuple) -> Iterator[tuple[str, ast.AST]]:
    """Two neighbours of a tuple, of indices or of results, swapped."""
    for i in range(len(node.elts) - 1):
        a, b = node.elts[i : i + 2]
        if not isinstance(a, ast.Starred) and not isinstance(b, ast.Starred):
            yield (
                "two neighbours (indices or results) were exchanged",
                but(node, elts=[*node.elts[:i], b, a, *node.elts[i + 2 :]]),
            )


@on(OPERATORS, ast.Expr)
def step(node: ast.Expr) -> Iterator[tuple[str, None]]:
    """A statement left out; its value is not used, so it does something."""
    yield "a step were left out", None


@on(OPERATORS, ast.Attribute)
def transposition(node: ast.Attribute) -> Iterator[tuple[str, ast.AST]]:
    """Without the transposition."""
    if node.attr == "T":
        yield "a transposition were left out", node.value


@on(OPERATORS, ast.Call)
def unwrapped(node: ast.Call) -> Iterator[tuple[str, ast.AST]]:
    """A function not applied at all."""
    if len(node.args) == 1 and isinstance(node.func, ast.Attribute) and getattr(node.func.value, "id", "") == "np":
        yield f"{node.func.attr} were not taken", node.args[0]
    if not node.args and isinstance(node.func, ast.Attribute) and getattr(node.func.value, "id", "") != "np":
        yield f"{node.func.attr} were not taken", node.func.value
