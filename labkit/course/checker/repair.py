"""Repair: the one place of a student's own program that, written otherwise, makes every case right.

    repairs(pieces, "iou", cases, fresh, right)      what was found, the best first

Every mutation of the program (`mutation`) runs on the cases until one is wrong. What survives is right on every public
case and on fresh ones, so that what is said about its place is true. The mutated text is never shown: a student reads
where to look, and is asked what belongs there.

Numbers limit the search, so that all machines find the same; the clock is a safety net. Mutated programs may do
anything: this runs in a child process (`child`) or in the grader's sandbox, where there is no labkit, but NumPy.
"""

import ast
import contextlib
import copy
import signal
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from labkit.course.checker.comparison import quiet, same_argument
from labkit.course.checker.finding import REPAIRS, Finding
from labkit.course.checker.mutation import Mutation, mutations

RANK = {kind: number for number, kind in enumerate(REPAIRS)}
MOST_MUTATIONS = 6000  # of one program
MOST_S = 5.0  # CPU seconds of the whole search: then nothing is said
CALL_S = 0.4  # CPU seconds of one mutation on a case: an endless loop is wrong
MORE_COST = 0.5  # repairs that change so much more than the smallest are looked for, too


class TimeIsUp(BaseException):
    """Raised in a mutated program that does not end."""


class SearchIsOver(BaseException):
    """Raised when the time of the whole search is up."""


ENDS = (Exception, SystemExit, KeyboardInterrupt, TimeIsUp, SearchIsOver)  # how a student's program may end


class Mutant:
    """A program whose functions can be replaced, one at a time, and called on copies of a case's arguments."""

    def __init__(self, pieces: Sequence[tuple[str, str]], name: str):
        self.pieces, self.name = pieces, name
        self.namespace: dict = {"__name__": "__main__"}
        for label, text in pieces:
            exec(compile(text, f"<{label}>", "exec", dont_inherit=True), self.namespace)

    def functions(self) -> Iterator[tuple[int, ast.stmt]]:
        """The student's functions with the number of their piece; the answer first, and none of the kit's."""
        found = []
        for k, (label, text) in enumerate(self.pieces):
            if label == "quiet" or label.endswith("the kit's"):
                continue
            found += [(k, node) for node in ast.parse(text).body if is_function(node)]
        yield from sorted(found, key=lambda entry: defines(entry[1]) != self.name)

    def replaced(self, statement: ast.stmt) -> None:
        """Run a changed definition in the program's namespace; raises what compiling it raises."""
        code = compile(ast.Module([statement], []), "<repair>", "exec", dont_inherit=True)
        exec(code, self.namespace)

    def call(self, args: tuple) -> tuple[object, bool]:
        """Call the answer: its output, and whether it left its arguments as they were."""
        given = copied(args)
        output = self.namespace[self.name](*given)
        return output, all(map(same_argument, args, given))


def is_function(node: ast.stmt) -> bool:
    """Whether a statement defines a function, without a decorator, which may cost a second each time."""
    if isinstance(node, ast.Assign):
        return isinstance(node.value, ast.Lambda) and isinstance(node.targets[0], ast.Name)
    return isinstance(node, ast.FunctionDef) and not node.decorator_list


def defines(node: ast.stmt) -> str:
    """The name of a function that a statement defines."""
    return node.name if isinstance(node, ast.FunctionDef) else node.targets[0].id


def copied(args: tuple) -> tuple:
    """Copies of arguments: arrays quickly, anything else safely."""
    return tuple(a.copy() if type(a) is np.ndarray else copy.deepcopy(a) for a in args)


def weight(args: tuple) -> int:
    """How much a case has to be worked on: numbers in its arrays."""
    return sum(np.size(a) for a in args)


def repairs(
    pieces: Sequence[tuple[str, str]],
    name: str,
    cases: Sequence[tuple[tuple, object]],
    fresh: Callable[[], Sequence[tuple[tuple, object]]],
    right: Callable[[object, object], bool],
) -> list[Finding]:
    """Find the places of a program whose mutation makes all cases right, the best first.

    pieces: (label, text) of the program, as `program` cuts it; name: of its function. cases: (arguments, expected) of
    the public cases; fresh: gives more of them, asked for once, when a mutation passes the public ones. right: function
    (expected, got) -> bool. Empty if there is none, or if the time is up.
    """
    with limited(MOST_S), quiet():
        try:
            mutant = Mutant(pieces, name)
            return found_in(mutant, cases, fresh, right)
        except ENDS:  # nothing can be said about such a program
            return []


def found_in(mutant: Mutant, cases, fresh, right) -> list[Finding]:
    """Try the mutations of all functions, the smallest first, until those of the next cost are much larger."""
    tried = [(k, statement, m) for k, statement in mutant.functions() for m in mutations(statement)]
    tried.sort(key=lambda entry: (entry[2].cost, RANK[entry[2].kind]))
    cases = sorted(cases, key=lambda case: (passes(mutant, case, right), weight(case[0])))
    more: list = []
    found: dict[Finding, tuple] = {}  # with what decides which one is told first
    for k, statement, mutation in tried[:MOST_MUTATIONS]:
        if found and mutation.cost > min(found.values())[0] + MORE_COST:
            break
        if not mends(mutant, statement, mutation, cases, right):
            continue
        more = more or list(fresh())
        if mends(mutant, statement, mutation, more, right):
            finding = Finding(mutation.kind, k, mutation.spans)
            found.setdefault(finding, (mutation.cost, RANK[mutation.kind], finding.width))
    return sorted(found, key=found.get)


def mends(mutant: Mutant, statement: ast.stmt, mutation: Mutation, cases, right) -> bool:
    """Whether a mutation makes some cases right; the program is as before afterwards."""
    original = mutant.namespace[defines(statement)]
    try:
        with mutation.applied():
            mutant.replaced(statement)
        return all(passes(mutant, case, right) for case in cases)
    except Exception:  # what cannot be compiled
        return False
    finally:
        mutant.namespace[defines(statement)] = original


def passes(mutant: Mutant, case: tuple[tuple, object], right) -> bool:
    """Whether the program is right in a case, and leaves its arguments alone."""
    args, expected = case
    signal.setitimer(signal.ITIMER_VIRTUAL, CALL_S, 0.05)
    try:
        output, unaltered = mutant.call(args)
        return unaltered and right(expected, output)
    except (Exception, TimeIsUp, SystemExit):
        return False
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)


@contextlib.contextmanager
def limited(seconds: float) -> Iterator[None]:
    """CPU time for a block, in which single calls have their own alarm; a process of one's own is needed."""

    def ring(number, frame):
        raise TimeIsUp if number == signal.SIGVTALRM else SearchIsOver

    signal.signal(signal.SIGVTALRM, ring)
    signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, seconds, 0.1)  # again and again: a program may catch everything
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
