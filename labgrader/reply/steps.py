"""The last step that a wrong answer gets right: an expression whose numbers a right answer computes, too.

While a function runs on a case, the value of each of its expressions is kept (`values_in`): of the question's own
answer where cases are made, of the student's in a worker, which is sent the values of the former. Such a step is told
where nothing else is known of a wrong answer: it says where to look, and not what is wrong.
"""

import ast
import contextlib
import inspect
import textwrap
from collections.abc import Callable, Sequence

import numpy as np

from labgrader.comparison import quiet
from labgrader.program.live import LiveProgram, copied, defines
from labgrader.reply.alarm import limited
from labgrader.reply.finding import Finding, Span
from labgrader.reply.syntax import span_of

MOST_CASES = 3  # in which a step has to be right
MOST_NUMBERS = 20_000  # of a value that is kept
MOST_S = 0.5  # CPU seconds
KEEP = "__keep__"  # the name of the function that keeps values: no student's
STEPS = ast.BinOp | ast.UnaryOp | ast.Call | ast.Subscript | ast.Compare | ast.IfExp | ast.Attribute

Values = Sequence[np.ndarray]  # that a right answer computes in a case


class Watched(ast.NodeTransformer):
    """Puts __keep__(k, step) in the place of each step of a function; places: of the steps, by k."""

    def __init__(self):
        self.places: list[Span] = []

    def visit(self, node: ast.AST) -> ast.AST:
        if isinstance(node, ast.arguments | ast.JoinedStr | ast.AnnAssign | ast.Raise | ast.Assert):
            return node
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Tuple):
            self.generic_visit(node.value)  # the value is right only if each name gets the part that is meant
            return node
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            node.func.value = self.visit(node.func.value)  # the method itself is no value
            node.args, node.keywords = ([self.visit(part) for part in parts] for parts in (node.args, node.keywords))
        else:
            node = self.generic_visit(node)
        if not isinstance(node, STEPS) or not isinstance(getattr(node, "ctx", ast.Load()), ast.Load):
            return node
        self.places.append(span_of(node))
        number = ast.Constant(len(self.places) - 1)
        return ast.copy_location(ast.Call(ast.Name(KEEP, ast.Load()), [number, node], []), node)


def values_in(call: Callable[[], object], namespace: dict) -> dict[int, np.ndarray]:
    """The last value of each step, by its number, in the order in which these were computed; numbers alone."""
    kept: dict[int, np.ndarray] = {}

    def keep(number: int, value: object) -> object:
        if isinstance(value, np.ndarray | np.generic | int | float) and np.size(value) <= MOST_NUMBERS:
            array = np.array(value)
            if array.dtype.kind in "biuf":
                kept.pop(number, None)
                kept[number] = array
        return value

    namespace[KEEP] = keep
    with contextlib.suppress(Exception), quiet():
        call()
    return kept


def values_of_a_right_answer(reference: Callable, args: tuple) -> Values:
    """What a question's own answer computes on its way in a case, each value once; nothing where it has no text."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(reference)))
    except (OSError, TypeError, SyntaxError):
        return []
    namespace = dict(vars(inspect.getmodule(reference)))
    exec(compile(ast.fix_missing_locations(Watched().visit(tree)), "<steps>", "exec"), namespace)
    kept = values_in(lambda: namespace[reference.__name__](*copied(args)), namespace)
    return list({(value.shape, value.tobytes()): value for value in kept.values()}.values())


def last_right_step(
    pieces: Sequence[tuple[str, str]], name: str, cases: Sequence[tuple[tuple, Values]]
) -> list[Finding]:
    """The last step of the function `name` whose value a right answer computes in each case; empty if there is none.

    cases: arguments, and what a right answer computes for them. A value that says little does not count: an argument,
    or a part of one, and equal numbers.
    """
    common: list[int] | None = None
    with contextlib.suppress(BaseException), limited(MOST_S):
        program = LiveProgram(name, pieces)
        named = [(k, f) for k, f in program.functions() if defines(f) == name and isinstance(f, ast.FunctionDef)]
        ((piece, function),) = named[:1]
        watched = Watched()
        program.replace(ast.fix_missing_locations(watched.visit(function)))
        for args, right in cases:
            kept = values_in(lambda args=args: program.answer(*copied(args)), program.namespace)
            told = [k for k, v in kept.items() if says_much(v, args) and any(equal(v, other) for other in right)]
            common = told if common is None else [k for k in told if k in common]
        if common:
            return [Finding("reached", piece, (watched.places[common[-1]],))]
    return []


def says_much(value: np.ndarray, args: tuple) -> bool:
    """Whether that a value is right says something: it is no part of an argument, and its numbers are not all equal."""
    if value.size < 2:  # one number is soon right by accident
        return False
    given = [np.asarray(a) for a in args if isinstance(a, np.ndarray | int | float)]
    if any(value.size <= a.size and np.isin(value, a).all() for a in given):
        return False
    return bool((value != value.ravel()[0]).any())


def equal(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two values are the same numbers in the same shape."""
    return a.shape == b.shape and np.allclose(a, b, rtol=1e-9, atol=1e-12, equal_nan=True)
