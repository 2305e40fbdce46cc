"""A table of one's own attempts at an open task: each is scored on the same cases, and stays in the table."""

import json
import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import repeat
from pathlib import Path

import numpy as np
from tqdm.auto import tqdm

from labkit.metrics import paired_difference
from labkit.support.files import write_atomically
from labtrain.executors import executor_for


class Attempts:
    """Score answers of one's own on the same cases, and keep a table of them.

    trial: function (answer, case) to a result: numbers, texts and lists of them. cases: what answers are tried on.
    measure: function of a list of results to the number that counts, a share. says: the same in words, for the table.
    workers: processes that share the cases; with several, an answer may be a function that a notebook defines.
    keep: a JSON file that holds the table; one that is there is read, so that it outlasts the kernel.

    A later row is compared with the first one that was tried on as many cases, on the same cases: how many went up and
    down, and the difference in points (hundredths) with its 95 % interval. Where each case is a success or none, the
    interval is that of `labkit.metrics.paired_difference`, with its p. Raises ValueError if `keep` is of other cases.

    >>> attempts = Attempts(lambda power, x: x**-power, (1, 2, 4), np.mean, lambda found: f"mean {np.mean(found):.2f}")
    >>> _ = attempts.score("inverse", 1)
    >>> attempts.score("inverse squares", 2)
    1  inverse          mean 0.58
    2  inverse squares  mean 0.44  against 1: +0 -2, -14.6 points (-29.3 to +0.1)
    """

    def __init__(
        self,
        trial: Callable,
        cases: Sequence,
        measure: Callable[[list], float],
        says: Callable[[list], str],
        workers: int = 1,
        keep: str | Path | None = None,
    ):
        self.trial, self.cases, self.measure, self.says, self.workers = trial, list(cases), measure, says, workers
        self.keep = None if keep is None else Path(keep)
        self.rows: list[tuple[str, list]] = []
        if self.keep and self.keep.exists():
            kept = json.loads(self.keep.read_text(encoding="utf-8"))
            if kept["cases"] != self.cases:
                raise ValueError(f"keep: {keep} is a table of other cases; remove it, or give another name")
            self.rows = [(name, results) for name, results in kept["rows"]]

    def score(self, name: str, answer, of: int | None = None) -> "Attempts":
        """Try an answer and add it to the table, in place of an older row of this name and number of cases.

        of: how many of the cases, the first ones; None for all. Ctrl-C stops it and leaves the table as it was.
        """
        cases = self.cases[:of]
        results = list(tqdm(self._tried(answer, cases), desc=name, total=len(cases), leave=False))
        old = [i for i, row in enumerate(self.rows) if (row[0], len(row[1])) == (name, len(results))]
        if old:
            self.rows[old[0]] = (name, results)
        else:
            self.rows.append((name, results))
        if self.keep:
            write_atomically(self.keep, json.dumps({"cases": self.cases, "rows": self.rows}).encode())
        return self

    def _tried(self, answer, cases: list) -> Iterator:
        if self.workers == 1:
            yield from (self.trial(answer, case) for case in cases)
            return
        import cloudpickle  # by value: a worker cannot import what a notebook defines

        both, others = cloudpickle.dumps((self.trial, answer)), set(multiprocessing.active_children())
        with executor_for(self.workers) as executor:
            try:
                yield from executor.map(_try, repeat(both), cases)
            except BaseException:  # also GeneratorExit: nobody waits for an answer that does not end
                for process in set(multiprocessing.active_children()) - others:
                    process.terminate()
                raise

    def gain(self, number: int) -> str:
        """Compare row `number` with the first row that was tried on as many cases; "" if that is itself."""
        ours = self.rows[number][1]
        first = next(i for i, (_, results) in enumerate(self.rows) if len(results) >= len(ours))
        theirs, n = self.rows[first][1][: len(ours)], len(ours)
        if first == number:
            return ""
        single = [(self.measure([a]), self.measure([b])) for a, b in zip(ours, theirs, strict=True)]
        up, down = sum(a > b for a, b in single), sum(a < b for a, b in single)

        def difference(leave: int | None = None) -> float:
            kept = [i for i in range(n) if i != leave]
            return 100 * (self.measure([ours[i] for i in kept]) - self.measure([theirs[i] for i in kept]))

        points = difference()
        said = f"  against {first + 1}: +{up} -{down}, {points:+.1f} points"
        if {value for pair in single for value in pair} <= {0, 1}:
            low, high, p = paired_difference(int(up), int(down), n)
            return f"{said} ({100 * low:+.1f} to {100 * high:+.1f}), p = {p:.3f}"
        # The jackknife: without each case in turn. Of a mean, it is the paired differences' standard error.
        half = 1.96 * np.std([difference(leave) for leave in range(n)]) * np.sqrt(n - 1) if n > 1 else np.inf
        return f"{said} ({points - half:+.1f} to {points + half:+.1f})"

    def __repr__(self) -> str:
        names = max((len(name) for name, _ in self.rows), default=0)
        said = [self.says(results) for _, results in self.rows]
        width = max(map(len, said), default=0)
        lines = [
            f"{i + 1}  {name:<{names}}  {said[i]:<{width}}{self.gain(i)}".rstrip()
            for i, (name, _) in enumerate(self.rows)
        ]
        return "\n".join(lines)


@cache
def _loaded(both: bytes) -> tuple[Callable, object]:
    import cloudpickle

    return cloudpickle.loads(both)


def _try(both: bytes, case):
    trial, answer = _loaded(both)
    return trial(answer, case)
