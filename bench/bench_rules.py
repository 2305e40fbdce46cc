"""Rules about tables: which things do they keep that truly stand there, and is a robot's arm refused?

Simulated pictures (`bench/rules.py`): things along the edges of a table that a camera bends, things that the picture's
border cuts off, full bins that fill the picture, and messy tables with an arm over them; noise grows with the square of
distance. The rules are given the true things, so that what is lost is lost by the rules alone and by no network. The
rules before, for which a table was a plane and nothing touched it, kept 42, 30, 25 and 40 of the same things, in the
order of the table, and refused the same arms.
"""

from collections import Counter

import numpy as np

from bench.measure import table
from bench.rules import frames
from labkit.frame import RGBDFrame
from labkit.geometry import back_project_to_base, find_tables
from labkit.geometry.standing import reasons_against
from labkit.geometry.tables import table_at

SCENES, LEAST = 10, 60  # scenes of a kind; pixels with depth of a thing that counts
NO_TABLE = "no table is found"


def main() -> str:
    """Judge the true things of each kind of picture; returns the table."""
    rows = []
    for kind in ("edges", "cut off", "bin", "arm"):
        judged = [why for frame in frames(kind, range(SCENES)) for why in judge(frame, arm=kind == "arm")]
        things = Counter(why for why, is_arm in judged if not is_arm)
        arms = [why for why, is_arm in judged if is_arm]
        lost = "; ".join(f"{n} {why}" for why, n in things.items() if why)
        refused = f"{sum(map(bool, arms))} of {len(arms)}" if arms else ""
        rows.append([kind, f"{things['']} of {things.total()}", refused, lost])
    return table("pictures | things kept | arms refused | why the others are not", rows)


def judge(frame: RGBDFrame, arm: bool) -> list[tuple[str, bool]]:
    """Why each true thing of a frame does not stand on its table, "" if it does, and whether it is the arm."""
    points = back_project_to_base(frame.depth, frame.K, frame.T_base_cam)
    tables = find_tables(points, frame.T_base_cam[:3, 3], up=(0.0, 0.0, 1.0))
    on = table_at(tables, 0.0)
    numbers, seen = frame.instances.ravel(), np.isfinite(points[..., 2]).ravel()
    things = {n: np.flatnonzero((numbers == n) & seen) for n in np.unique(numbers[numbers > 0])}
    things = {n: pixels for n, pixels in things.items() if len(pixels) > LEAST}
    why = [NO_TABLE] * len(things) if on is None else reasons_against(on, tables, points, list(things.values()))
    return [(reason, arm and n == numbers.max()) for n, reason in zip(things, why, strict=True)]


if __name__ == "__main__":
    print(main())
