"""Answers that are alike beyond what their task forces: for the instructor to read side by side; no grade knows of it.

Two answers are compared by the shapes of their programs (`shapes`), without those that a task hands out: what stands in
the released lab, in its model solution and references, or in more than a few answers of the class. What is left is
a student's own. A pair is listed if most of it is the same and it is not too little; so is an answer that is nearly all
a model solution's or a reference's. Answers of an earlier term count as others of the class.
"""

import json
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

from labgrader.course import of_topic
from labgrader.grade.batch import Record, read_record
from labgrader.grade.read_programs import Read, read_program
from labgrader.grade.shapes import Shapes
from labgrader.handin.reading import Lab
from labgrader.handin.roster import keys_of
from labgrader.program.cell import grade_id, source_of

ALIKE, LEAST = 0.7, 6  # the share of two answers' own shapes that is the same, and how many these are at least
COPIED, LEAST_COPIED = 0.9, 8  # the same for an answer and the kit's own, of which nothing was taken away
FEW, PART = 4, 0.1  # a shape that more answers hold, and more of this part of them, is the task's


@dataclass(frozen=True)
class Hand:
    """An answer, or the kit's own. whose: a student's name, or "the model solution"; term: of an earlier course."""

    whose: str
    program: str
    shapes: Shapes = field(repr=False)
    term: str = ""

    def __str__(self) -> str:
        return f"{self.whose} ({self.term})" if self.term else self.whose


@dataclass(frozen=True)
class Pair:
    """Two answers to a question that are alike. share: of what is their own; shared: these shapes, by fingerprint."""

    question: str
    one: Hand
    other: Hand
    share: float
    shared: frozenset[str]


@dataclass(frozen=True)
class Group:
    """Answers to a question of which each is alike to another one: two, or a crowd with one answer.

    least, most: the shares that pairs of them have; shared: shapes that at least two of them share.
    """

    question: str
    hands: tuple[Hand, ...]
    least: float
    most: float
    shared: frozenset[str]


@dataclass(frozen=True)
class Found:
    """The pairs in a lab, those who share most first. unread: answers that could not be compared, STUDENT: QUESTION."""

    pairs: tuple[Pair, ...] = ()
    unread: tuple[str, ...] = ()

    @property
    def groups(self) -> list[Group]:
        """The pairs put together: whoever is alike to one of a group is in it."""
        together: dict[tuple[str, str], list[Pair]] = {}  # by question and person; one list for all of a group
        for pair in self.pairs:
            keys = [(pair.question, str(hand)) for hand in (pair.one, pair.other)]
            one, other = (together.setdefault(key, []) for key in keys)
            if one is not other:
                one += other
                for inside in other:
                    together |= dict.fromkeys([(inside.question, str(h)) for h in (inside.one, inside.other)], one)
                together[keys[1]] = one
            one.append(pair)
        return [group_of(pairs) for pairs in {id(pairs): pairs for pairs in together.values()}.values()]


def find_alike(
    course: Path, lab: Lab, terms: Mapping[str, Sequence[Record]], known: Mapping[str, Read | None]
) -> Found:
    """Find the answers of a class that are alike, and those like the kit's own.

    course: whose solutions are looked at. terms: records by term, "" for those of this class; others are compared with
    these, not among themselves. known: what is in the programs.
    """
    texts = [
        (result.question, record.student, result.program, term)
        for term, records in terms.items()
        for record in records
        for result in record.results
        if result.program and result.kind != "syntax" and result.question in lab.answers
    ]
    hands: dict[str, list[Hand]] = defaultdict(list)
    for question, student, program, term in texts:
        if (found := known[program]) is not None:
            hands[question].append(Hand(student, program, found.shapes, term))
    models, released = models_of(course, lab), released_shapes(lab)
    of_the_kit = released.union(*(model.shapes for of_one in models.values() for model in of_one))
    found = [pair for name in hands for pair in pairs_of(name, hands[name], of_the_kit)]
    found += [pair for name in hands for pair in copies_of(name, hands[name], models[name], released)]
    found.sort(key=lambda pair: (-len(pair.shared) * pair.share, pair.question, str(pair.one), str(pair.other)))
    unread = (f"{student}: {name}" for name, student, program, term in texts if known[program] is None and not term)
    return Found(tuple(found), tuple(unread))


def old_records(course: Path, topic: str) -> list[Record]:
    """The records of an earlier course; raises ValueError if there are none."""
    folder = Path(course) / "grades" / topic / "records"
    found = [record for path in sorted(folder.glob("*.json")) if (record := read_record(path)) is not None]
    if not found:
        raise ValueError(f"against: expected a course in which {topic} was graded, found no records in {folder}")
    return found


def released_shapes(lab: Lab) -> set[str]:
    """The shapes in the code that every student was given."""
    found: set[str] = set()
    for cell in lab.notebook["cells"]:
        if cell["cell_type"] == "code":
            with suppress(SyntaxError):  # a cell's magic
                found |= read_program(source_of(cell)).shapes.keys()
    return found


def models_of(course: Path, lab: Lab) -> dict[str, list[Hand]]:
    """By question the kit's own answers: its reference, and the model solution in course/solutions if that is there."""
    references = {name: question.source for name, question in of_topic(lab.topic).items()}
    found = {name: [Hand("the kit's reference", text, read_program(text).shapes)] for name, text in references.items()}
    path = Path(course) / "solutions" / lab.topic / f"{lab.topic}.ipynb"
    for cell in json.loads(path.read_bytes())["cells"] if path.is_file() else ():
        if (name := grade_id(cell)) in found and cell["cell_type"] == "code":
            found[name].append(Hand("the model solution", source_of(cell), read_program(source_of(cell)).shapes))
    return found


def pairs_of(question: str, hands: Sequence[Hand], of_the_kit: set[str]) -> Iterator[Pair]:
    """The pairs among the answers to a question; those of an earlier course are compared with new ones alone."""
    different = {hand.program: hand.shapes for hand in hands}  # a text that many have counts once: they share it
    counts = Counter(shape for of_one in different.values() for shape in of_one)
    few = max(FEW, PART * len(different))
    own = [{s for s in hand.shapes if s not in of_the_kit and counts[s] <= few} for hand in hands]
    holders: dict[str, list[int]] = defaultdict(list)
    for i, left in enumerate(own):
        for shape in left:
            holders[shape].append(i)
    shared = Counter(pair for some in holders.values() for pair in combinations(some, 2))
    for (i, j), count in shared.items():
        one, other = sorted((hands[i], hands[j]), key=lambda hand: bool(hand.term))
        share = 2.0 * count / (len(own[i]) + len(own[j]))
        is_one_person = set(keys_of(one.whose)) & set(keys_of(other.whose))  # who takes the course again
        if share >= ALIKE and count >= LEAST and not (one.term or is_one_person):
            yield Pair(question, one, other, share, frozenset(own[i] & own[j]))


def copies_of(question: str, hands: Sequence[Hand], models: Sequence[Hand], released: set[str]) -> Iterator[Pair]:
    """The answers of this class that are nearly all the kit's own."""
    for hand in hands:
        for model in models if not hand.term else ():
            one, other = hand.shapes.keys() - released, model.shapes.keys() - released
            share = 2.0 * len(one & other) / max(1, len(one) + len(other))
            if share >= COPIED and len(one & other) >= LEAST_COPIED:
                yield Pair(question, hand, model, share, frozenset(one & other))
                break


def group_of(pairs: Sequence[Pair]) -> Group:
    """Some pairs as one group."""
    hands = {str(hand): hand for pair in pairs for hand in (pair.one, pair.other)}
    shares = [pair.share for pair in pairs]
    shared = frozenset().union(*(pair.shared for pair in pairs))
    return Group(pairs[0].question, tuple(hands.values()), min(shares), max(shares), shared)


def by_people(groups: Sequence[Group]) -> Mapping[tuple[str, ...], list[Group]]:
    """The groups of the same people, in order."""
    found: dict[tuple[str, ...], list[Group]] = defaultdict(list)
    for group in groups:
        found[tuple(sorted(map(str, group.hands)))].append(group)
    return dict(sorted(found.items(), key=lambda item: -sum(len(group.shared) for group in item[1])))
