"""What the benchmarks share: ways timed in turns, memory, and tables in Markdown."""

import os
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np


def in_turns(
    ways: dict[str, Callable], rounds: int, clock=time.perf_counter, best_of: int = 1
) -> dict[str, np.ndarray]:
    """Milliseconds of each way, one number per round, by name.

    Each round calls every way, so that a busy moment of the machine hits all alike; one round before is not counted.
    best_of: how many calls a round makes of a way, of which the fastest counts, so that a way does not pay for what its
    predecessor did to the caches and to the heap.
    """
    times = {name: [] for name in ways}
    for _ in range(rounds + 1):
        for name, way in ways.items():
            calls = []
            for _ in range(best_of):
                start = clock()
                way()
                calls.append(1e3 * (clock() - start))
            times[name].append(min(calls))
    return {name: np.array(milliseconds[1:]) for name, milliseconds in times.items()}


def resampled(scenes: np.ndarray, statistic: Callable[[np.ndarray], float], draws: int = 2000) -> tuple[float, float]:
    """A 95 % interval of a statistic of scenes (first axis): between 2.5 and 97.5 % of those of scenes drawn again.

    >>> resampled(np.array([2.0, 2.0, 2.0]), np.mean)
    (2.0, 2.0)
    """
    rng = np.random.default_rng(0)
    again = [statistic(scenes[rng.integers(len(scenes), size=len(scenes))]) for _ in range(draws)]
    low, high = np.percentile(again, (2.5, 97.5))
    return float(low), float(high)


def table(header: str, rows: Iterable[Iterable]) -> str:
    """Rows of cells in Markdown under a header such as "method | median ms"."""
    lines = [header, "|".join(["---"] * (header.count("|") + 1)), *(" | ".join(map(str, row)) for row in rows)]
    return "\n".join(f"| {line} |" if "---" not in line else f"|{line}|" for line in lines)


def resident_mb() -> float:
    """Memory that this process holds."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
