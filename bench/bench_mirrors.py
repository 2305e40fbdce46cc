"""Mirrors and glass on a table that is photographed: is their depth unknown, or wrong?

Seven photographs by ray casting (`data_gen.mirrors`) with what a phone does to them, of a patterned table with six
patterned things around a mirror or a glass, in a room whose walls and ceiling have a pattern or are plain, with two
lamps; poses are off by 0.04 degrees and 0.7 mm, as a printed sheet leaves them. Flat: lies on the table. Tilted: one
side raised, 9 to 29 degrees. Leaning: 57 to 74 degrees. Pane: lies 4 cm over the table, its glass 8 % bright. Shares of
the mirror's or glass's pixels in the first view: without depth; within 2 cm of its own surface; within 2 cm of what is
seen in it or through it, as if there were no mirror; wrong, which is neither. Rest: of all other pixels, known. In
brackets: the largest share in one set. The thresholds of the look below the table (`DEEPER` in
`labkit.geometry.sweep`) were chosen on sets 0 to 2 of flat, tilted and leaning mirrors. On sets 3 and 4 in the
patterned room, on which nothing was chosen, nothing of the flat mirror was wrong, of the tilted one 1.0 and 6.9 %, of
the leaning one 3.0 and 15.2 %; without the look below the table 2.2 and 8.0, 7.7 and 31.0, 19.4 and 36.2 %. A ball's
image lies 3 cm behind its surface, which is what comes out, and counts as wrong.
`python -m bench.bench_mirrors 3` takes three sets of each.
"""

import sys
from typing import NamedTuple

import numpy as np

from bench.measure import table
from data_gen.mirrors import KINDS, Mirrored, photographed
from labkit.geometry.sweep import sweep

SETS = 2
NEAR = 0.02  # metres


def main(sets: int = SETS) -> str:
    """Photograph, sweep and score; returns the table."""
    header = "mirror or glass | room | no depth | its own surface | what is seen in it | wrong (worst) | rest known"
    rows = []
    for kind in KINDS:
        for patterned in (True, False):
            parts = np.array([shares(photographed(kind, seed, patterned)) for seed in range(int(sets))])
            without, own, seen, wrong, rest = (f"{share:.1%}" for share in parts.mean(axis=0))
            worst = f"{wrong} ({parts[:, 3].max():.1%})"
            rows.append([kind, "patterned" if patterned else "plain", without, own, seen, worst, rest])
    return table(header, rows)


class Shares(NamedTuple):
    """Of the mirror's pixels: without depth, with its own, with that of what is seen, wrong; of the rest: known."""

    without: float
    own: float
    seen: float
    wrong: float
    rest: float


def shares(shots: Mirrored) -> Shares:
    """Sweep the views, and compare with the truth about the first."""
    depth = sweep(shots.views).depth
    known = depth > 0.0
    own = known & (np.abs(depth - shots.depth) <= NEAR)
    seen = known & ~own & (np.abs(depth - shots.seen) <= NEAR)
    parts = (~known, own, seen, known & ~own & ~seen)
    return Shares(*(float(part[shots.there].mean()) for part in parts), float(known[~shots.there].mean()))


if __name__ == "__main__":
    print(main(*sys.argv[1:]))
