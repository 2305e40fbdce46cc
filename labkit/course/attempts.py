"""An open task of a lab: try one's own idea on a few cases, at most a minute, and see it beside the earlier attempts."""

import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from tqdm.auto import tqdm


class Attempts:
    """The attempts at an open task, a row each.

    measure: function (answer, case) -> numbers by name, the same names for each case. cases: what an answer is tried on.
    seconds: how long one attempt may take; cases that are not reached by then are left out, and the table says so.

    >>> attempts = Attempts(lambda answer, case: {"error": abs(answer(case) - case**2)}, cases=[1, 2, 3])
    >>> attempts.score(lambda x: x, "the same")
    attempt   cases    error
    the same      3    2.667
    >>> attempts.score(lambda x: 2 * x, "twice")
    attempt   cases    error
    the same      3    2.667
    twice         3    1.333
    """

    def __init__(self, measure: Callable[..., Mapping[str, float]], cases: Sequence, seconds: float = 60.0):
        self.measure, self.cases, self.seconds = measure, cases, seconds
        self.rows: dict[str, tuple[int, dict[str, float]]] = {}

    def score(self, answer: Callable, name: str) -> None:
        """Try an answer on the cases under a progress bar, and print the means of all attempts so far.

        An attempt of the same name is replaced. Ctrl-C, or the square button, stops it; what was reached counts.
        """
        end, measured = time.monotonic() + self.seconds, []
        try:
            for case in tqdm(self.cases, desc=name, leave=False):
                measured.append(self.measure(answer, case))
                if time.monotonic() > end:
                    break
        except KeyboardInterrupt:
            print("stopped")
        if measured:
            means = {key: float(np.mean([m[key] for m in measured])) for key in measured[0]}
            self.rows[name] = len(measured), means
        self.table()

    def table(self) -> None:
        """Print the attempts: how many cases each was tried on, and the means of what was measured."""
        wide = max(map(len, ("attempt", *self.rows)))
        keys = list(dict.fromkeys(key for _, means in self.rows.values() for key in means))
        print(f"{'attempt':{wide}s}   cases" + "".join(f" {key:>8s}" for key in keys))
        for name, (tried, means) in self.rows.items():
            cells = "".join(f" {means[key]:{max(8, len(key))}.4g}" for key in keys)
            print(f"{name:{wide}s}   {tried:5d}{cells}")
