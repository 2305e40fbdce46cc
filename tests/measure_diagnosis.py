"""How many wrong answers that nobody wrote down get a sentence that is true of them and of few others, by lab.

    python tests/measure_diagnosis.py [--sample N] [--held-out] [--unnamed] [--survivors SECONDS] [TOPIC ...]

Wrong answers are the mutants of references and alternatives (`mutants`); those of the same outputs count once.
One is named by a sentence that is true of it and false for nine tenths of the question's others; where it is wrong does
not count alone. "strictly" leaves out slips, which know some of the operators, and properties; "at once" counts only
the sentence that is said first. --survivors lists the mutants that are not refused, and on how many inputs each was
compared with the reference: 10,000, random ones and such with ties and zeros on which all right answers agree, or fewer
if time is up.
"""

import argparse
import contextlib
import random
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from unittest import mock

import numpy as np
from alternatives import alternatives
from mutants import mutants

from labkit.course.checker import diagnosis
from labkit.course.checker.comparison import Problem, alike, compare, expected_cases, parts
from labkit.course.checker.diagnosis import Sentence, sentences
from labkit.course.checker.question import Question
from labkit.course.checker.run import run
from labkit.course.topics import TOPICS, of_topic

SEEDS = (0, 1, 20_260_101)  # an answer that passes these is not refused
INPUTS = 10_000
SHARE = 0.1  # of the other mutants that a sentence may be true of


@dataclass
class Named:
    """How many of some wrong answers are named, strictly and with slips, by which kind of sentence, and which not."""

    wrong: int = 0
    named: int = 0
    strict: int = 0
    at_once: int = 0
    kinds: Counter = field(default_factory=Counter)
    unnamed: list[str] = field(default_factory=list)

    def __add__(self, other: "Named") -> "Named":
        kinds, unnamed = self.kinds + other.kinds, self.unnamed + other.unnamed
        counts = ((getattr(a, n) for a in (self, other)) for n in ("wrong", "named", "strict", "at_once"))
        return Named(*map(sum, counts), kinds, unnamed)

    def __str__(self) -> str:
        named, strict, at_once = (n / max(self.wrong, 1) for n in (self.named, self.strict, self.at_once))
        share = f"{named:.0%} named, strictly {strict:.0%}, strictly and at once {at_once:.0%}"
        return f"{self.wrong} wrong answers, {share}; {', '.join(f'{k} {n}' for k, n in self.kinds.most_common())}"


def wrong_answers(question: Question, held_out: bool, sample: int | None) -> dict[str, list[object]]:
    """Mutants that are refused, by their names, with their outputs; those of the same outputs once."""
    cases, found = expected_cases(question, 0), {}
    right = [question.reference, *(a for a in alternatives(question) if "torch" not in a.__name__)]
    everything = [mutant for function in right for mutant in mutants(function, held_out)]
    random.Random(question.name).shuffle(everything)
    for mutant in everything:
        if sample is not None and len(found) == sample:
            break
        outputs, _ = run(mutant.function, [case.args for case in cases], 1.0)
        refused = any(compare(question, case.expected, got) for case, got in zip(cases, outputs, strict=True))
        if refused and not any(same(question, outputs, others) for others in found.values()):
            found[mutant.name] = outputs
    return found


def same(question: Question, outputs: Sequence[object], others: Sequence[object]) -> bool:
    """Whether two wrong answers give the same, within the tolerance, or fail in the same words, in every case."""
    for a, b in zip(outputs, others, strict=True):
        failed = isinstance(a, Problem) or isinstance(b, Problem)
        if getattr(a, "says", 0) != getattr(b, "says", 1) if failed else not alike(question, a, b):
            return False
    return True


def measure(question: Question, held_out: bool = False, sample: int | None = None) -> Named:
    """Diagnose the wrong answers to a question."""
    cases = expected_cases(question, 0)
    wrong = wrong_answers(question, held_out, sample)
    with remembering():
        said = {name: list(dict.fromkeys(sentences(question, cases, outputs))) for name, outputs in wrong.items()}
    true_of = Counter(sentence for found in said.values() for sentence in found)
    result = Named(wrong=len(wrong))
    for name, found in said.items():
        good = [s for s in found if s.kind != "place" and true_of[s] - 1 <= SHARE * (len(wrong) - 1)]
        result.named += bool(good)
        strict = [s for s in good if s.kind not in ("slip", "property")]
        result.strict += bool(strict)
        result.at_once += bool(strict) and found[0] is strict[0]
        result.kinds[good[0].kind if good else "none"] += 1
        if not good:
            result.unnamed.append(f"{question.name}: {name}\n    {first(found)}")
    return result


@contextlib.contextmanager
def remembering() -> Iterator[None]:
    """What a diagnosis tries is computed once for many wrong answers; what is said stays the same."""

    def once(function: Callable, listed: bool) -> Callable:
        def recalled(first: object, args: tuple) -> object:
            key = id(first), id(args)  # both stay, so that no other gets their numbers
            if key not in known:
                known[key] = first, args, list(function(first, args)) if listed else function(first, args)
            return known[key][-1]

        known = {}
        return recalled

    tried = {name: once(getattr(diagnosis, name), name != "made") for name in ("of_inputs", "of_answers", "made")}
    with mock.patch.multiple(diagnosis, **tried):
        yield


def survivors(question: Question, seconds: float, held_out: bool = False) -> Iterator[str]:
    """Each mutant that is not refused, and where it differs from the reference, or that it does not."""
    cases = [case for seed in SEEDS for case in expected_cases(question, seed)]
    right = [question.reference, *(a for a in alternatives(question) if "torch" not in a.__name__)]
    alive = {}
    for function in right:
        for mutant in mutants(function, held_out):
            outputs, _ = run(mutant.function, [case.args for case in cases], 1.0)
            if not any(compare(question, case.expected, got) for case, got in zip(cases, outputs, strict=True)):
                alive[f"{question.name}: {function.__name__}, {mutant.name}"] = mutant.function
    rng, end, tried = np.random.default_rng(1), time.process_time() + seconds * len(alive), 0
    while alive and tried < INPUTS and time.process_time() < end:
        args, spoil = question.inputs(rng), rng.random() < 0.5
        args = tuple(spoilt(value, rng) for value in args) if spoil else args
        expected = output_of(question.reference, args)
        if spoil and any(compare(question, expected, output_of(function, args)) for function in right):
            continue  # right answers fail or disagree: the task does not allow such arguments
        if spoil and any(np.isinf(part).any() for part in parts(expected)):
            continue  # no task asks for infinities
        tried += 1
        for name in [n for n, function in alive.items() if compare(question, expected, output_of(function, args))]:
            yield f"{name}: differs on input {tried}{' (with ties and zeros)' * spoil}"
            del alive[name]
    yield from (f"{name}: equal on {tried} inputs" for name in alive)


def output_of(function: Callable, args: tuple) -> object:
    """What a function gives; it has ten seconds, since a busy machine may take its time."""
    return run(function, [args], 10.0)[0][0]


def spoilt(value: object, rng: np.random.Generator) -> object:
    """An array of numbers with ties, or with zeros, not all of them; not a matrix, which may not stay what it is."""
    if not isinstance(value, np.ndarray) or value.dtype.kind != "f" or value.shape in ((3, 3), (4, 4)):
        return value
    new = np.round(value, 1) if rng.random() < 0.5 else np.where(rng.random(value.shape) < 0.1, 0, value)
    return new if new.any() else value  # no direction is all zeros


def first(found: Sequence[Sentence]) -> str:
    """What is said first."""
    return found[0].says if found else "nothing is said"


def main(arguments: Sequence[str]) -> None:
    """Measure the labs that are named, or all."""
    parser = argparse.ArgumentParser()
    parser.add_argument("topics", nargs="*", default=TOPICS)
    parser.add_argument("--sample", type=int, help="wrong answers to each question; all if not given")
    parser.add_argument("--held-out", action="store_true", help="of the operators that are held out")
    parser.add_argument("--unnamed", action="store_true", help="list those that are not named")
    parser.add_argument("--survivors", type=float, metavar="SECONDS", help="list those that are not refused, instead")
    given = parser.parse_args(arguments)
    total = Named()
    for topic in given.topics:
        questions = of_topic(topic).values()
        if given.survivors:
            for question in questions:
                for found in survivors(question, given.survivors, given.held_out):
                    print(found, flush=True)
            continue
        found = sum((measure(q, given.held_out, given.sample) for q in questions), Named())
        print(f"{topic}: {found}", *(found.unnamed if given.unnamed else ()), sep="\n  ", flush=True)
        total += found
    if not given.survivors:
        print(f"all: {total}")


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main(sys.argv[1:])
