"""What holds for a course as a whole: weights, what is dropped, free late days; and points for everybody.

[[course]]
drop_lowest = 1      # of each student's labs so many do not count, those with the smallest share
late_days = 3        # so many days late cost nothing, in the order of the deadlines

[[weight]]
lab = "04_iou"
weight = 2           # 1 if nothing is said; with 0 it does not count

[[bonus]]
lab = "04_iou"
points = 1           # for everybody who handed it in, whatever the maximum is
reason = "the exercise was longer than announced"
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from labgrader.course import topics
from labgrader.grade.deadlines import read_deadline
from labgrader.handin.collect import marked_late
from labgrader.handin.roster import identity, read_roster
from labgrader.settings import usable_blocks


@dataclass(frozen=True)
class Policy:
    """How the labs of a course make one number. weights: by lab, 1 where there is none."""

    weights: dict[str, float]
    drop_lowest: int = 0
    late_days: int = 0

    def total(self, shares: Mapping[str, float]) -> tuple[float, list[str]]:
        """The weighted mean of a student's shares, 0..1 by lab, without the lowest; and which labs were dropped.

        One lab stays in any case; without labs that count the mean is 0.

        >>> Policy({"b": 3.0}, drop_lowest=1).total({"a": 0.5, "b": 1.0, "c": 0.25})
        (0.875, ['c'])
        """
        counted = sorted((share, lab) for lab, share in shares.items() if self.weights.get(lab, 1.0) > 0)
        dropped = [lab for _, lab in counted[: min(self.drop_lowest, max(0, len(counted) - 1))]]
        kept = [(self.weights.get(lab, 1.0), share) for share, lab in counted if lab not in dropped]
        whole = sum(weight for weight, _ in kept)
        return (sum(weight * share for weight, share in kept) / whole if whole else 0.0), dropped


def read_policy(course: Path) -> Policy:
    """The policy in course.toml; raises ValueError, with the place, for what cannot be used."""
    weights: dict[str, float] = {}
    for where, data in usable_blocks(course, "weight", {"lab": str, "weight": float}):
        if data["lab"] in weights:
            raise ValueError(f"{where}: lab: {data['lab']} has a weight above")
        weights[data["lab"]] = float(data["weight"])
    found = Policy(weights)
    possible = {"drop_lowest": float, "late_days": float}
    for i, (where, data) in enumerate(usable_blocks(course, "course", {}, possible)):
        if i or any(not isinstance(value, int) for value in data.values()):
            raise ValueError(f"{where}: expected {'one block of this name' if i else 'whole numbers in this block'}")
        found = Policy(weights, **data)
    return found


def read_bonus(course: Path, topic: str) -> list[tuple[float, str]]:
    """The points that everybody gets in a lab, each with its reason; raises ValueError for what cannot be used."""
    blocks = usable_blocks(course, "bonus", {"lab": str, "points": float, "reason": str})
    return [(float(data["points"]), data["reason"]) for _, data in blocks if data["lab"] == topic]


def free_days(course: Path, gradebook, topic: str, late_days: int) -> Counter[str]:
    """How many free days each student uses in a lab: what the labs that were due before have left of them."""
    deadlines = {lab: deadline for lab in topics() if (deadline := read_deadline(course, lab)) is not None}
    roster, left = read_roster(course), {}
    for lab in sorted(deadlines, key=lambda lab: deadlines[lab].due):
        deadline, marked, used = deadlines[lab], marked_late(course, lab), Counter()
        for submission in gradebook.assignment_submissions(lab):
            student = submission.student.id
            days = deadline.lateness(student, submission.timestamp, marked.get(student)).days
            who = identity(roster, student)
            used[student] = min(days, left.setdefault(who, late_days))
            left[who] -= used[student]
        if lab == topic:
            return used
    return Counter()
