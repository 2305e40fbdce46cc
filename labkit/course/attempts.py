"""A table of one's own attempts at an open task: each is scored on the same cases, and stays in the table."""

from collections.abc import Callable, Sequence

from tqdm.auto import tqdm


class Attempts:
    """Score answers of one's own on the same cases, and keep a table of them.

    trial: function (answer, case) to what became of it. cases: what each answer is tried on. says: function of the
    list of results to the words for the table. `score` shows a progress bar and gives the table, the newest last.

    >>> attempts = Attempts(lambda power, x: x**power, (1, 2, 3), lambda results: f"sum {sum(results)}")
    >>> _ = attempts.score("squares", 2)
    >>> attempts.score("cubes", 3)
    1  squares  sum 14
    2  cubes    sum 36
    """

    def __init__(self, trial: Callable, cases: Sequence, says: Callable[[list], str]):
        self.trial, self.cases, self.says = trial, list(cases), says
        self.rows: list[tuple[str, str]] = []

    def score(self, name: str, answer) -> "Attempts":
        """Try an answer on all cases and add it to the table under a name."""
        results = [self.trial(answer, case) for case in tqdm(self.cases, desc=name, leave=False)]
        self.rows.append((name, self.says(results)))
        return self

    def __repr__(self) -> str:
        width = max((len(name) for name, _ in self.rows), default=0)
        return "\n".join(f"{i}  {name:<{width}}  {says}" for i, (name, says) in enumerate(self.rows, start=1))
