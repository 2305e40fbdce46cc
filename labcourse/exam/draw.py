"""Draw an exam: which questions, and numbers for each version; no other has them, or its answers, in the same place."""

import importlib
import pkgutil
import zlib
from collections.abc import Collection, Sequence
from fractions import Fraction
from math import ceil

import numpy as np

from labcourse import exam
from labcourse.exam.paper import Again, Paper, PaperQuestion

TRIES = 4000
ANSWERING = Fraction(5, 6)  # of an exam's time; the rest is for reading, and for looking twice


def topics() -> tuple[str, ...]:
    """Topics that have questions for paper, in order."""
    names = (module.name for module in pkgutil.iter_modules(exam.__path__))
    return tuple(sorted(name[1:] for name in names if name[0] == "t" and name[1:3].isdigit()))


def topics_of(numbers: str, taught: Sequence[str] = ()) -> tuple[str, ...]:
    """Topics by their numbers, of those that are taught if they are given; raises ValueError for a number of none.

    >>> topics_of("01-02,04")
    ('01_labels', '02_crf', '04_iou')
    """
    chosen: list[str] = []
    for part in numbers.split(","):
        first, _, last = (word.strip() for word in part.partition("-"))
        low, high = first.zfill(2), (last or first).zfill(2)
        found = [topic for topic in topics() if topic in (taught or topics()) and low <= topic[:2] <= high]
        if not found:
            raise ValueError(f"topics: expected numbers such as 01-05 or 01,04 of {', '.join(topics())}, got {part!r}")
        chosen += found
    return tuple(sorted(set(chosen)))


def bank(topic: str) -> tuple[PaperQuestion, ...]:
    """The questions of a topic, in the order of its module; raises ValueError for a topic that has none."""
    if topic not in topics():
        raise ValueError(f"topics: expected some of {', '.join(topics())}, got {topic!r}")
    module = importlib.import_module(f"labcourse.exam.t{topic}")
    return tuple(value for value in vars(module).values() if isinstance(value, PaperQuestion))


def choose(chosen: Sequence[str], minutes: int, seed: int, without: Collection[str] = ()) -> list[PaperQuestion]:
    """Choose questions that fill five sixths of the minutes: one of each topic in turn, until none is left that fits.

    without: names of questions that are not asked. Raises ValueError for one that no topic has, if a topic has no other
    question, or if there is not time for the shortest question of each topic.
    """
    unknown = set(without) - {q.name for topic in topics() for q in bank(topic)}
    if unknown:
        raise ValueError(f"without: expected names of questions, as a key prints them, got {', '.join(unknown)}")
    rng = np.random.default_rng([seed, 0])
    piles = {topic: [bank(topic)[i] for i in rng.permutation(len(bank(topic)))] for topic in chosen}
    piles = {topic: [q for q in pile if q.name not in without] for topic, pile in piles.items()}
    if not all(piles.values()):
        raise ValueError("without: expected to leave a question of each topic; ask for fewer topics")
    least = {topic: min(q.minutes for q in pile) for topic, pile in piles.items()}
    if sum(least.values()) > minutes * ANSWERING:
        need = f"at least {ceil(sum(least.values()) / ANSWERING)}, for a question of each topic"
        raise ValueError(f"minutes: expected {need}, got {minutes}; ask for fewer topics")
    taken: list[PaperQuestion] = []
    while any(piles.values()):
        for topic, pile in piles.items():
            waiting = sum(m for t, m in least.items() if t > topic and not any(q.topic == t for q in taken))
            left = minutes * ANSWERING - sum(q.minutes for q in taken) - waiting
            fits = [q for q in pile if q.minutes <= left]
            pile[:] = fits[1:]
            taken += fits[:1]
    return sorted(taken, key=lambda q: (q.topic, [other.name for other in bank(q.topic)].index(q.name)))


def draw(question: PaperQuestion, seed: int, versions: int = 1) -> list[Paper]:
    """Draw a question's numbers for each version; raises ValueError if there are not that many different ones."""
    rng = np.random.default_rng([seed, zlib.crc32(f"{question.topic}.{question.name}".encode())])
    papers: list[Paper] = []
    for _ in range(TRIES):
        if len(papers) == versions:
            return papers
        try:
            paper = question.draw(rng)
        except Again:
            continue
        if not any(alike(paper, other) for other in papers):
            papers.append(paper)
    raise ValueError(
        f"versions: expected at most {len(papers)}, since {question.name} has no more numbers to draw, got {versions}"
    )


def alike(one: Paper, other: Paper) -> bool:
    """Whether two versions have a given or a right number in the same place.

    Only all of them together count of labels, which are names, and of an answer's whole numbers, such as labels and
    counts. Not counted are an answer's zeros, and words, such as yes and no.
    """
    for name in one.given.keys() & other.given.keys():
        a, b = np.asarray(one.given[name]), np.asarray(other.given[name])
        if a.shape == b.shape and (np.array_equal(a, b) if a.dtype == np.uint8 else (a == b).any()):
            return True
    for name in one.answer.keys() & other.answer.keys():
        a, b = np.asarray(one.answer[name]), np.asarray(other.answer[name])
        if a.dtype.kind in "iu" and a.any() and np.array_equal(a, b):
            return True
        if a.dtype.kind == "f" and (np.isclose(a, b) & (a != 0)).any():
            return True
    return False
