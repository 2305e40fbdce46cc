"""What a reference computes on the way: the values of its expressions, with words for them, to compare outputs with.

A wrong answer often returns such a step, lacks one of them as a term or a factor, or has it twice.
"""

import ast
import copy
import functools
import warnings
from collections.abc import Callable, Collection, Iterator, Sequence

import numpy as np

from labkit.course.questions.inputs import ARRAYS
from labkit.course.questions.slips import below, compiled, definition_of, follow, made_of, names_in, put

KINDS = {
    ast.Add: "the sum",
    ast.Sub: "the difference",
    ast.Mult: "the product",
    ast.Div: "the quotient",
    ast.Pow: "the power",
    ast.MatMult: "the product of matrices",
    ast.Compare: "the comparison",
    ast.Subscript: "the entry or part",
}
LOOPS = (ast.For, ast.While, ast.ListComp, ast.GeneratorExp, ast.SetComp, ast.DictComp, ast.Lambda)
STRANGE = ("were 1 over what it is", "were 1 minus what it is")  # of what is only compared, these explain by accident
UNDONE = {  # of a function's result: that it was not taken
    "were squared": "sqrt",
    "were its roots": "square",
    "were its logarithms": "exp",
    "were its exponentials": "log",
}
Steps = list[tuple[str, list[np.ndarray | None]]]


Change = Callable[[np.ndarray], np.ndarray | None]


def steps(reference: Callable, arguments: Sequence[tuple]) -> Steps:
    """Words for what a reference computes on the way, and its value in each case, None where it does not get there."""
    try:
        function, words = traced(reference)
        values = [function(args)[1] for args in arguments]
    except (OSError, SyntaxError, ValueError, NameError):  # its source is not complete in itself
        return []
    told = [
        (says, [found.get(number) for found in values]) for number, (says, looped) in enumerate(words) if not looped
    ]
    return [(says, found) for says, found in told if any(value is not None for value in found)]


def changed_steps(reference: Callable) -> Iterator[tuple[str, Callable]]:
    """Words for a reference in which one step is changed, and this function of a tuple of arguments."""
    try:
        function, words = traced(reference)
    except (OSError, SyntaxError, ValueError):
        return
    for number, (step, _) in enumerate(words):
        for says, change in ARRAYS.items():
            if says in UNDONE:
                if f"the result of {UNDONE[says]}," not in step:
                    continue
                says = "were not taken"
            if says in STRANGE and "one of the places" in step:
                continue
            yield (
                f"Your output is right as if {step} {says}.",
                lambda args, number=number, change=change: function(args, number, change)[0],
            )


@functools.cache
def traced(reference: Callable) -> tuple[Callable, list[tuple[str, bool]]]:
    """A reference that also gives its steps by their numbers; words for them, and whether they have no one value.

    The function takes the arguments in a tuple, and the number of a step that is to be changed, and its change.
    """
    definition = definition_of(reference)
    sources, words, arguments = made_of(definition), [], {argument.arg for argument in definition.args.args}
    paths = [path for i, line in enumerate(definition.body) for path in below(line, (("body", i),))]
    for path in sorted(paths, key=len, reverse=True):  # the inner ones first
        node, outer = follow(definition, path), [follow(definition, path[:n]) for n in range(1, len(path))]
        made = sorted(set().union(*(sources.get(name, set()) for name in names_in(node))))
        if made and (kind := kind_of(node, arguments)):
            put(definition, path, ast.Call(ast.Name("_keep", ast.Load()), [ast.Constant(len(words)), node], []))
            looped = any(isinstance(o, LOOPS) for o in outer) or isinstance(node, ast.Name)
            words.append((kind if isinstance(node, ast.Name) else f"{kind} made of {' and '.join(made)}", looped))
    kept: dict[int, np.ndarray] = {}
    to_change: list[tuple[int, Change]] = []

    def keep(number: int, value: object) -> object:
        if not isinstance(value, np.ndarray | np.generic | int | float):
            return value
        if to_change and number == to_change[0][0]:
            new = to_change[0][1](np.asarray(value))
            if new is None:
                raise ValueError("this step cannot be changed so")
            return new if isinstance(value, np.ndarray) else new[()]
        if not to_change:
            kept[number] = np.array(value)
        return value

    function = compiled(ast.unparse(ast.fix_missing_locations(definition)), reference, _keep=keep)

    def values(args: tuple, number: int | None = None, change: Change | None = None) -> tuple[object, dict]:
        kept.clear()
        to_change[:] = [] if number is None else [(number, change)]
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            return function(*copy.deepcopy(args)), dict(kept)

    return values, words


def kind_of(node: ast.AST, arguments: Collection[str]) -> str:
    """What kind of step an expression is, in words; "" if it is none."""
    if isinstance(getattr(node, "ctx", None), ast.Store | ast.Del):
        return ""
    if isinstance(node, ast.Name):
        return f"{node.id}, in one of the places where it comes in," if node.id in arguments else ""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        return f"the result of {node.func.attr},"
    return KINDS.get(type(node.op) if isinstance(node, ast.BinOp) else type(node), "")
