"""A student's program that runs in this process: its namespace, calls of its functions, and its lines in a traceback.

It is run in a worker (`labgrader.run`), never in a student's kernel or beside the grader's cases.
"""

import ast
import copy
from collections.abc import Collection, Iterable, Iterator, Sequence
from types import TracebackType

import numpy as np

from labgrader.comparison import same_argument
from labgrader.program.slice import is_students


class LiveProgram:
    """Pieces of a program, (label, text) each, that have run in one namespace, and the name of its function."""

    def __init__(self, name: str = "", pieces: Iterable[tuple[str, str]] = ()):
        self.name = name
        self.pieces: list[tuple[str, str]] = []
        self.namespace: dict = {"__name__": "__main__"}
        for label, text in pieces:
            self.run(label, text)

    @property
    def files(self) -> list[str]:
        """What the student's pieces are called in a traceback; "" for the kit's."""
        return [f"<{label}>" if is_students(label) else "" for label, _ in self.pieces]

    def run(self, label: str, text: str) -> None:
        """Run one more piece; raises what it raises."""
        self.pieces.append((label, text))
        exec(compile(text, f"<{label}>", "exec", dont_inherit=True), self.namespace)

    @property
    def answer(self) -> object:
        """The function as it is now."""
        return self.namespace[self.name]

    def call(self, args: tuple) -> tuple[object, bool]:
        """Call the function on copies of arguments: its output, and whether it left them as they were."""
        given = copied(args)
        output = self.answer(*given)
        return output, not altered(args, given)

    def functions(self) -> Iterator[tuple[int, ast.stmt]]:
        """The student's functions with the number of their piece; the answer first, and none of the kit's."""
        found = []
        for k, (label, text) in enumerate(self.pieces):
            if is_students(label):
                found += [(k, node) for node in ast.parse(text).body if is_function(node)]
        yield from sorted(found, key=lambda entry: defines(entry[1]) != self.name)

    def replace(self, statement: ast.stmt) -> None:
        """Run a changed definition in the program's namespace; raises what compiling it raises."""
        code = compile(ast.Module([statement], []), "<repair>", "exec", dont_inherit=True)
        exec(code, self.namespace)


def is_function(node: ast.stmt) -> bool:
    """Whether a statement can be compiled again at no cost: NAME = lambda, or a def without decorators."""
    if isinstance(node, ast.Assign):
        return isinstance(node.value, ast.Lambda) and isinstance(node.targets[0], ast.Name)
    return isinstance(node, ast.FunctionDef) and not node.decorator_list


def defines(node: ast.stmt) -> str:
    """The name of a function that a statement defines."""
    return node.name if isinstance(node, ast.FunctionDef) else node.targets[0].id


def copied(args: tuple) -> tuple:
    """Copies of arguments: arrays quickly, anything else safely."""
    return tuple(a.copy() if type(a) is np.ndarray else copy.deepcopy(a) for a in args)


def altered(before: Sequence, after: Sequence) -> list[int]:
    """The positions of the arguments that are not what they were."""
    return [i for i, pair in enumerate(zip(before, after, strict=True)) if not same_argument(*pair)]


def own_entry(trace: TracebackType | None, files: Collection[str]) -> tuple[TracebackType | None, bool]:
    """The deepest entry of a traceback that stands in some files, None if there is none; and whether it is the last."""
    own = last = None
    while trace is not None:
        last = trace
        own = trace if trace.tb_frame.f_code.co_filename in files else own
        trace = trace.tb_next
    return own, own is not None and own is last
