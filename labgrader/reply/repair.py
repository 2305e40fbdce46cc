"""Repair: the place of a student's own program that, written otherwise, makes every case right.

    repairs(pieces, "iou", cases, fresh, right)      what was found, the best first

Every mutation of the program (`mutation`) runs on the cases until one is wrong. What survives is right on every public
case and on fresh ones, so that what is said about its place is true. Where none survives, a mutation is told with which
the program gives what a listed mistake gives, since then both are known. The mutated text is never shown: a student
reads where to look, and is asked what belongs there.

Of several repairs the nearest to what the student wrote is told: the one that changes the fewest nodes, of these the
kind that stands first in `finding.REPAIRS`, of these the one that marks least.

Heavy cases are tried last, on what mends all others. The number of mutations limits the search, so that all machines
find the same, and a test what a check finds; the clock is a safety net for programs of which one call takes long.
Mutated programs may do anything: this runs in a worker (`labgrader.run`).
"""

import ast
import contextlib
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from labgrader.comparison import is_heavy, quiet, weight
from labgrader.program.live import LiveProgram, defines
from labgrader.reply.alarm import ENDS, TimeIsUp, alarm, finite, limited
from labgrader.reply.finding import REPAIRS, Finding
from labgrader.reply.listed import Listed, fingerprint
from labgrader.reply.mutation import Mutation, mutations

RANK = {kind: number for number, kind in enumerate(REPAIRS)}
MOST_MUTATIONS = 3000  # of one program, the smallest first: they take 1 to 2.5 s
DEAREST_BESIDE = 2.0  # nodes that a mutation beside a listed mistake changes at most
MOST_S = 2.5  # CPU seconds of the whole search: then what has been found is told, if there is something
MOST_S_OF_ALL = 2.0  # for all cases once: of a program that takes longer, too few mutations could be tried
CALL_S = 0.4  # CPU seconds of one mutation on a case: an endless loop is wrong
MORE_S = 0.05  # on a case beside those on which it is searched: what takes longer there is neither right nor wrong
MORE_COST = 0.5  # repairs that change so much more than the smallest are looked for, too
# Beside a listed mistake these are none of their own.
LEFT_OUT = ("line too many", "branch", "too much", "call too many", "moved")

Cases = Sequence[tuple[tuple, object]]  # (arguments, expected) each


class SearchIsOver(Exception):
    """Raised when the time of the whole search is up."""


@dataclass(frozen=True)
class Search:
    """A program, and how its outputs are judged. end: of the search, in CPU seconds of this process.

    right: function (expected, got) -> bool; off: function (expected, got) -> how far each of its numbers is off, 0 if
    it is right; None for an output of another form. listed: what the question's listed mistakes give in each case, as
    `Listed`; None where nobody knows.
    """

    program: LiveProgram
    right: Callable[[object, object], bool]
    off: Callable[[object, object], np.ndarray | None]
    end: float
    listed: dict[int, Listed | None]


@dataclass(frozen=True)
class Trial:
    """A mutation of one of the program's functions. piece: the number of the function's piece."""

    piece: int
    statement: ast.stmt
    mutation: Mutation

    @property
    def rank(self) -> tuple[float, int, int]:
        """What decides which of several repairs is told: the smallest."""
        return self.mutation.cost, RANK[self.mutation.kind], self.finding.width

    @property
    def finding(self) -> Finding:
        """Where it changes the program, and how."""
        return Finding(self.mutation.kind, self.piece, self.mutation.spans)


def repairs(
    pieces: Sequence[tuple[str, str]],
    name: str,
    cases: Cases,
    fresh: Callable[[], Cases],
    right: Callable[[object, object], bool],
    off: Callable[[object, object], np.ndarray | None],
    listed: Sequence[Listed | None] = (),
) -> list[Finding]:
    """Find the places of a program whose mutation makes all cases right, the best first.

    pieces: (label, text) of the program, as `program` cuts it; name: of its function. cases: (arguments, expected) of
    the public cases, the one that is shown first; fresh: gives more of them, asked for once, when a mutation passes the
    public ones. right, off: as in `Search`; listed: one for each of the cases. Empty if there is none, or if the time
    is up.
    """
    with quiet(), finite():
        try:
            with limited(MOST_S):
                program = LiveProgram(name, pieces)
            of_cases = {id(case): told for case, told in zip(cases, listed, strict=False)}
            search = Search(program, right, off, time.process_time() + MOST_S, of_cases)
            light, heavy = ([case for case in cases if is_heavy(*case) is which] for which in (False, True))
            by_use = sorted_by_use(search, light)
            if not by_use or passes(search, by_use[0]):  # it is wrong in heavy ones alone
                by_use, heavy = sorted_by_use(search, cases), []
            if time.process_time() > search.end - MOST_S + MOST_S_OF_ALL:
                return []
            trials = [Trial(k, statement, m) for k, statement in program.functions() for m in mutations(statement)]
            trials.sort(key=lambda trial: trial.rank[:2])
            found, with_listed = one_repair(search, trials[:MOST_MUTATIONS], by_use, cases[0], LazyCases(fresh, heavy))
            return found or with_listed
        except ENDS:  # nothing can be said about such a program
            return []


def sorted_by_use(search: Search, cases: Cases) -> list[tuple[tuple, object]]:
    """The wrong cases first, of these the small ones; without those for which the program takes too long as it is."""
    tried = [(case, *outcome(search, case[0])) for case in cases]
    kept = [
        (unaltered and search.right(case[1], got), weight(case[0]), case)
        for case, got, unaltered in tried
        if unaltered is not None
    ]
    return [case for *_, case in sorted(kept, key=lambda entry: entry[:2])]


class LazyCases:
    """More cases, asked for once, when they are needed: those of them that are not heavy, and some that are known."""

    def __init__(self, ask: Callable[[], Cases], known: Cases):
        self.ask, self.known, self.cases = ask, known, None

    def __call__(self) -> Cases:
        if self.cases is None:
            self.cases = [*(case for case in self.ask() if not is_heavy(*case)), *self.known]
        return self.cases


def one_repair(
    search: Search, trials: Sequence[Trial], cases: Cases, shown: tuple[tuple, object], more: LazyCases
) -> tuple[list[Finding], list[Finding]]:
    """Try single mutations, the smallest first, until those of the next cost are much larger than one that repairs.

    Gives the repairs, and the best mutation beside a listed mistake: with it the program gives what that one does, the
    case that is shown is right, or at least closer in each of its numbers, and no case that was right is wrong: the
    listed mistake would have spoiled it. In heavy cases it gives what that one does, too: a few small ones agree by
    chance.
    """
    found: dict[Finding, tuple] = {}  # with what decides which one is told first
    with_listed: dict[Finding, tuple] = {}
    before = distance(search, shown)
    right_before = [case for case in cases if passes(search, case)]
    with over_if(found, with_listed):
        for trial in trials:
            if found and trial.mutation.cost > min(found.values())[0] + MORE_COST:
                break
            if trial.finding in found:
                continue
            with tried(search, trial) as runs:
                if runs and repaired(search, cases, more):
                    found[trial.finding] = trial.rank
                elif runs and not found and trial.mutation.cost <= DEAREST_BESIDE and not leaves_out(trial.mutation):
                    number = listed_mistake(search, cases)
                    now = None if number is None else distance(search, shown)
                    spoils_none = is_closer(now, before) and all(passes(search, case) for case in right_before)
                    if spoils_none and gives_in_large_ones_too(search, number, more.known):
                        with_listed[replace(trial.finding, listed=number)] = (now.any(), *trial.rank)
    return sorted(found, key=found.get), sorted(with_listed, key=with_listed.get)[:1]


def leaves_out(mutation: Mutation) -> bool:
    """Whether a mutation takes something out, or puts a name into the place of a longer expression."""
    return mutation.kind in LEFT_OUT or (mutation.kind == "name" and mutation.cost >= 2)


def listed_mistake(search: Search, cases: Cases) -> int | None:
    """The number of a listed mistake that gives what the program gives now in all cases of which that is known."""
    numbers: frozenset[int] | None = None
    for case in cases:
        if (listed := search.listed.get(id(case))) is None:
            continue
        given = listed.get(fingerprint(outcome(search, case[0])[0]), frozenset())
        numbers = given if numbers is None else numbers & given
        if not numbers:
            return None
    return min(numbers) if numbers else None


def gives_in_large_ones_too(search: Search, number: int, cases: Cases) -> bool:
    """Whether the program gives what a listed mistake does in more cases, but for those for which it takes too long."""
    for case in cases:
        if (listed := search.listed.get(id(case))) is None:
            continue
        output, unaltered = outcome(search, case[0])
        if unaltered is not None and number not in listed.get(fingerprint(output), ()):
            return False
    return True


def distance(search: Search, case: tuple[tuple, object]) -> np.ndarray | None:
    """How far off each number of a case is; None for an output of another form."""
    return search.off(case[1], outcome(search, case[0])[0])


def is_closer(now: np.ndarray | None, before: np.ndarray | None) -> bool:
    """Whether all numbers are right now, or each that was wrong is closer, and none that was right is wrong."""
    if now is None or before is None:
        return now is not None and not now.any()
    return bool((now <= before).all() and (now < before)[before > 0.0].all() and before.any())


@contextlib.contextmanager
def over_if(*found: dict) -> Iterator[None]:
    """A search whose time is up ends with what it has found, if that is something."""
    try:
        yield
    except SearchIsOver:
        if not any(found):
            raise


@contextlib.contextmanager
def tried(search: Search, trial: Trial) -> Iterator[bool]:
    """The program is mutated inside of the block, which gets whether it can be compiled."""
    namespace, name = search.program.namespace, defines(trial.statement)
    original = namespace[name]
    try:
        with trial.mutation.applied():
            yield compiled(search, trial.statement)
    finally:
        namespace[name] = original


def compiled(search: Search, statement: ast.stmt) -> bool:
    """Put a function as its tree is now into the program; whether that is possible."""
    try:
        search.program.replace(statement)
        return True
    except Exception:  # what cannot be compiled
        return False


def repaired(search: Search, cases: Cases, more: LazyCases) -> bool:
    """Whether the program is right in all cases, and then in more, but for those for which it takes too long."""
    if not all(passes(search, case) for case in cases):
        return False
    for case in more():
        output, unaltered = outcome(search, case[0], MORE_S)
        if unaltered is not None and not (unaltered and search.right(case[1], output)):
            return False
    return True


def passes(search: Search, case: tuple[tuple, object]) -> bool:
    """Whether the program is right in a case, and leaves its arguments alone; raises SearchIsOver at the end."""
    output, unaltered = outcome(search, case[0])
    return bool(unaltered) and search.right(case[1], output)


def outcome(search: Search, args: tuple, seconds: float = CALL_S) -> tuple[object, bool | None]:
    """The program's output, and whether its arguments are as before; (None, False) if it raises.

    It is (None, None) if that takes too long, and raises SearchIsOver once the whole search does.
    """
    if alarm().now > search.end:
        raise SearchIsOver
    try:
        with limited(seconds):
            return search.program.call(args)
    except TimeIsUp:
        return None, None
    except (Exception, SystemExit):
        return None, False
