"""What a reference computes on the way: the values of its expressions, with words for them, to compare outputs with.

A wrong answer often returns such a step, lacks one of them as a term or a factor, or has it twice; or it takes a step
otherwise than the reference does (`otherwise`), or another one in its place.
"""

import ast
import copy
import functools
import re
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from labkit.course.checker.comparison import quiet
from labkit.course.checker.otherwise import COMPARISONS, OPERATIONS, Change, compared, done_otherwise
from labkit.course.checker.slips import Path, below, compiled, definition_of, follow, made_of, names_in, put

KINDS = {kind: f"the {name.removeprefix('a ')}" for kind, (name, _) in OPERATIONS.items()} | {
    ast.FloorDiv: "the quotient",
    ast.BitAnd: "the condition",
    ast.BitOr: "the condition",
    ast.BitXor: "the condition",
    ast.LShift: "the shift of bits",
    ast.RShift: "the shift of bits",
    ast.Compare: "the comparison",
    ast.Subscript: "the entry or part",
    ast.BoolOp: "the condition",
    ast.Tuple: "the tuple",
    ast.List: "the list",
    ast.USub: "the negative",
    ast.Not: "the negation",
    ast.Invert: "the negation",
}
TOLD = (ast.BinOp, ast.Compare, ast.Subscript, ast.Call)  # kinds of steps whose value may be compared with outputs
CALLED = ("min", "max", "abs", "int", "float", "len", "sum", "round")  # functions of Python that are steps
LOOPS = (ast.For, ast.While, ast.ListComp, ast.GeneratorExp, ast.SetComp, ast.DictComp, ast.Lambda, ast.FunctionDef)
STRANGE = ("were 1 over what it is", "were 1 minus what it is")  # of what is only compared, these explain by accident
UNDONE = {  # of a function's result: that it was not taken
    "were squared": "sqrt",
    "were its roots": "square",
    "were its logarithms": "exp",
    "were its exponentials": "log",
}
MOST_LOOKS = 50  # at calls of one step, to see whether a change of it makes a difference
MOST_STEPS = 20_000  # of a reference in which one is changed
Steps = list[tuple[str, list[np.ndarray | None]]]


@dataclass(frozen=True)
class Step:
    """An expression of a reference: words for it, what it is, how it is computed, and whether it has no one value."""

    words: str
    node: ast.AST
    compute: Callable
    looped: bool


@dataclass
class Traced:
    """A reference that also gives its steps by their numbers, and in which one of them can be changed."""

    function: Callable = print
    steps: list[Step] = field(default_factory=list)
    calls: dict[int, list] = field(default_factory=dict)  # of the last run: operands, options and value of each
    change: tuple[int, Change, int | None] | None = None
    parameters: tuple[str, ...] = ()
    given: tuple = ()
    count: int = 0

    def run(self, args: tuple, change: tuple[int, Change, int | None] | None = None) -> object:
        """Run it, with a change of the step of some number; with a change it may alter its arguments.

        Without a change the calls of all steps are kept, with one those of the third entry's step: few, to be fast.
        """
        self.calls, self.change, self.given, self.count = {}, change, args, 0
        return self.function(*args)

    def step(self, number: int, *operands: object, **options: object) -> object:
        """Compute a step; its reference calls this in the place of its expression."""
        compute = self.steps[number].compute
        if self.change:
            self.count += 1
            if self.count > MOST_STEPS:
                raise RuntimeError("a change of a step has made a loop that does not end")
            if self.change[0] == number:
                return self.change[1](compute, *operands, **options)
            if self.change[2] != number:
                return compute(*operands, **options)
        value = compute(*operands, **options)
        self.calls.setdefault(number, []).append((operands, options, kept(value)))
        return value

    def last(self, number: int) -> object:
        """The last value of a step in this run; raises KeyError if there is none yet."""
        return self.calls[number][-1][2]


def kept(value: object) -> object:
    """A value that does not change when the reference goes on in place."""
    return value.copy() if isinstance(value, np.ndarray) else value


def steps(reference: Callable, arguments: Sequence[tuple]) -> Steps:
    """Words for what a reference computes on the way, and its value in each case, None where it does not get there."""
    try:
        trace, values = traced(reference), []
        with quiet():
            for args in arguments:
                trace.run(args)
                values.append({number: trace.last(number) for number in trace.calls})
    except (OSError, SyntaxError, ValueError, NameError):  # its source is not complete in itself
        return []
    told = [
        (step.words.removesuffix(","), [as_array(found.get(number)) for found in values])
        for number, step in enumerate(trace.steps)
        if not step.looped and isinstance(step.node, TOLD)
    ]
    return [(words, found) for words, found in told if any(value is not None for value in found)]


def as_array(value: object) -> np.ndarray | None:
    """A number or an array of numbers as an array; None for anything else."""
    known = isinstance(value, np.ndarray | np.generic | int | float) and np.asarray(value).dtype.kind in "biuf"
    return np.array(value) if known else None


def changed_steps(reference: Callable, args: tuple) -> Iterator[tuple[str, Callable]]:
    """Words for a reference in which one step is changed, and this function of a tuple of arguments.

    args: those of one case; what makes no difference to the step there is left out.
    """
    try:
        trace = traced(reference)
        with quiet():
            trace.run(args)
    except Exception:  # its source is not complete in itself
        return
    calls = trace.calls
    for number, step in enumerate(trace.steps):
        with quiet():
            here = [
                (says, change)
                for says, change in done_otherwise(step.node)
                if any(matters(change, step, *call) for call in calls.get(number, ())[:MOST_LOOKS])
            ]
        for says, change in here:
            if says in UNDONE and f"the result of {UNDONE[says]}," in step.words:
                says = "were not taken"
            elif says in UNDONE or (says in STRANGE and "one of the places" in step.words):
                continue
            words = step.words.removesuffix(",") + "," * (", made of" in step.words or ", in one of" in step.words)
            yield told(trace, f"{words} {says}", number, change)
    for number, words, instead, needed in exchanges(trace, args, calls):
        place = trace.steps[number].words.removesuffix(",")
        yield told(trace, f"{words} stood in the place of {place}", number, instead, needed)


def told(trace: Traced, words: str, number: int, change: Change, needed: int | None = None) -> tuple[str, Callable]:
    """The sentence about a change of a step, which may need another step, and the reference with it."""
    return f"Your output is right as if {words}.", lambda args: trace.run(args, (number, change, needed))


def matters(change: Change, step: Step, operands: tuple, options: dict, value: object) -> bool:
    """Whether a change gives another value than a step had; not if it cannot be made."""
    try:
        return not same(change(step.compute, *operands, **options), value)
    except Exception:
        return False


def same(a: object, b: object) -> bool:
    """Whether two values are the same in type, shape and numbers."""
    if as_array(a) is None or as_array(b) is None:
        return False
    if np.shape(a) != np.shape(b) or (np.asarray(a).dtype.kind == "b") != (np.asarray(b).dtype.kind == "b"):
        return False
    return np.array_equal(a, b, equal_nan=np.asarray(a).dtype.kind == "f" == np.asarray(b).dtype.kind)


def exchanges(trace: Traced, args: tuple, calls: dict[int, list]) -> Iterator[tuple[int, str, Change, int | None]]:
    """Steps by their numbers, and what of the same shape, an argument or an earlier step, could stand in its place."""
    known = [
        (name, value, lambda *a, i=i, **o: trace.given[i], None)
        for i, (name, value) in enumerate(zip(trace.parameters, args, strict=False))  # not those of *arguments
    ]
    for number in calls:
        step, value = trace.steps[number], calls[number][-1][2]
        if isinstance(step.node, ast.Constant) or as_array(value) is None:
            continue
        for words, other, instead, needed in known:
            truths = {np.asarray(v).dtype.kind == "b" for v in (value, other)}
            if np.shape(value) == np.shape(other) and len(truths) == 1 and not same(value, other):
                yield number, words, instead, needed
        if not isinstance(step.node, ast.Name):
            words = step.words.removesuffix(",")
            known.append((words, value, lambda *a, number=number, **o: kept(trace.last(number)), number))


class InFull(ast.NodeTransformer):
    """Write a += b as a = a + b, so that it is a step."""

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.Assign:
        """One of them."""
        before = copy.deepcopy(node.target)
        before.ctx = ast.Load()
        return ast.Assign([node.target], ast.BinOp(before, node.op, node.value), lineno=node.lineno)


@functools.cache
def traced(reference: Callable) -> Traced:
    """A reference whose expressions are steps; raises OSError, SyntaxError or ValueError if it has no source."""
    definition = InFull().visit(definition_of(reference))
    original = copy.deepcopy(definition)
    arguments = [argument.arg for argument in definition.args.args]
    sources, trace = made_of(definition), Traced(parameters=tuple(arguments))
    paths = [path for i, line in enumerate(definition.body) for path in below(line, (("body", i),))]
    for path in sorted(paths, key=len, reverse=True):  # the inner ones first
        outer = [follow(original, path[:n]) for n in range(1, len(path))]
        what = outer[-1] if path[-1][0] == "iter" else literal(follow(original, path))
        words, node = words_for(what, outer, path, sources, arguments), follow(definition, path)
        if words:
            compute, operands, options = taken_apart(what, node, sources)
            looped = any(isinstance(o, LOOPS) for o in outer) or isinstance(node, ast.Name)
            trace.steps.append(Step(words, what, compute, looped))
            given = [ast.Constant(len(trace.steps) - 1), *operands]
            put(definition, path, ast.Call(ast.Name("_step", ast.Load()), given, options))
    trace.function = compiled(ast.unparse(ast.fix_missing_locations(definition)), reference, _step=trace.step)
    return trace


def literal(node: ast.AST) -> ast.AST:
    """A number with its sign as one constant; anything else as it is."""
    signed = isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant)
    return ast.Constant(-node.operand.value) if signed else node


def taken_apart(what: ast.AST, node: ast.AST, sources: dict) -> tuple[Callable, list[ast.AST], list[ast.keyword]]:
    """How a step is computed, and what of: expressions of its operands and its options."""
    if isinstance(what, ast.BinOp):
        return OPERATIONS[type(node.op)][1], [node.left, node.right], []
    if isinstance(what, ast.Compare) and all(type(op) in COMPARISONS for op in what.ops):
        return compared(*map(type, what.ops)), [node.left, *node.comparators], []
    if isinstance(what, ast.Subscript):
        return (lambda whole, index: whole[index]), [node.value, index_of(node.slice)], []
    if isinstance(what, ast.UnaryOp):
        minus = isinstance(what.op, ast.USub)
        return ((lambda a: -a) if minus else opposite), [node.operand], []
    if isinstance(what, ast.Call) and is_method(what, sources):
        name = what.func.attr
        return (lambda a, *b, **c: getattr(a, name)(*b, **c)), [node.func.value, *node.args], node.keywords
    if isinstance(what, ast.Call):
        return (lambda function, *b, **c: function(*b, **c)), [node.func, *node.args], node.keywords
    return (lambda value: value), [node], []


def opposite(value: object) -> object:
    """`not` of one truth value, `~` of an array or a whole number."""
    return not value if isinstance(value, bool) else ~value


def is_method(node: ast.Call, sources: dict) -> bool:
    """Whether something is asked to do it that is no module."""
    root = node.func
    while isinstance(root, ast.Attribute):
        root = root.value
    return isinstance(node.func, ast.Attribute) and not (isinstance(root, ast.Name) and root.id not in sources)


def index_of(node: ast.AST) -> ast.AST:
    """An index as an expression outside of square brackets."""
    if isinstance(node, ast.Tuple):
        return ast.Tuple([index_of(part) for part in node.elts], ast.Load())
    if isinstance(node, ast.Slice):
        bounds = [part or ast.Constant(None) for part in (node.lower, node.upper, node.step)]
        return ast.Call(ast.Name("slice", ast.Load()), bounds, [])
    return node


def words_for(what: ast.AST, outer: Sequence[ast.AST], path: Path, sources: dict, arguments: Collection[str]) -> str:
    """Words for a step, "" if an expression is none."""
    made = sorted(set().union(*(sources.get(name, set()) for name in names_in(what))))
    if isinstance(what, ast.Constant):
        if not isinstance(what.value, bool | int | float) or (outer and literal(outer[-1]) is not outer[-1]):
            return ""
        around = (words_for(o, (), (), sources, arguments) for o in reversed(outer) if not isinstance(o, ast.Tuple))
        option = next((o.arg for o in reversed(outer) if isinstance(o, ast.keyword)), "a number")
        return "" if option == "axis" else f"{option} in {next(filter(None, around), 'the formula').removesuffix(',')}"
    if path and path[-1][0] == "iter" and isinstance(what, ast.For | ast.comprehension):
        return words_for_loop(what, outer[:-1], sources, arguments)
    kind = kind_of(what, arguments)
    if isinstance(what, ast.Subscript) and is_entry(what, arguments):
        return kind
    if isinstance(what, ast.Name) or not kind or (path and path[-1][0] == "slice" and isinstance(what, ast.Tuple)):
        return kind if isinstance(what, ast.Name) else ""
    return f"{kind} made of {listed(made) if made else 'fixed numbers'}"


def words_for_loop(loop: ast.AST, outer: Sequence[ast.AST], sources: dict, arguments: Collection[str]) -> str:
    """Words for a loop: over an axis of an argument, or over what it is made of; the inner one of two alike."""
    origins = (set().union(*(sources.get(name, set()) for name in names_in(node))) for node in (loop.iter, loop))
    made = sorted(next(filter(None, origins), ()))
    words = f"loop over what is made of {listed(made)}" if made else "loop"
    sized = re.fullmatch(r"range\((?:(\w+)\.shape\[(-?\d)\]|len\((\w+)\))\)", ast.unparse(loop.iter))
    if sized and {sized[1], sized[3]} & set(arguments):
        axis = "the last axis" if sized[2] == "-1" else f"axis {sized[2] or 0}"
        words = f"loop over {axis} of {sized[1] or sized[3]}"
    around = (words_for_loop(o, (), sources, arguments) for o in outer if isinstance(o, ast.For))
    return f"the inner {words}" if f"the {words}" in around else f"the {words}"


def listed(names: Sequence[str]) -> str:
    """Names in a row: a, b and c."""
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def is_entry(node: ast.Subscript, arguments: Collection[str]) -> bool:
    """Whether it is a part of an argument whose place is written in numbers, such as R[0, 2]."""
    return getattr(node.value, "id", "") in arguments and not names_in(node.slice)


def kind_of(node: ast.AST, arguments: Collection[str]) -> str:
    """What kind of step an expression is, in words; "" if it is none."""
    if isinstance(getattr(node, "ctx", None), ast.Store | ast.Del):
        return ""
    if isinstance(node, ast.Name):
        return f"{node.id}, in one of the places where it comes in," if node.id in arguments else ""
    if isinstance(node, ast.Subscript) and is_entry(node, arguments):
        return f"{ast.unparse(node)},"
    if isinstance(node, ast.Call):
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        known = isinstance(node.func, ast.Attribute) or name in CALLED
        axis = next((literal(k.value) for k in node.keywords if k.arg == "axis"), None)
        over = f" over axis {axis.value}" if isinstance(axis, ast.Constant) else ""
        return f"the result of {name}{over}," if known else ""
    return KINDS.get(type(node.op) if isinstance(node, ast.BinOp | ast.UnaryOp) else type(node), "")
