"""Copies of the kit's own code among answers: each student has the references, since `check` needs them."""

import functools
from collections.abc import Iterable

from labgrader.course import course, files_of
from labgrader.program.fingerprint import fingerprints
from labgrader.question import Question
from labgrader.run.run import reference_lock


def of_the_kit(prints: Iterable[str], question: Question) -> list[str]:
    """Say of which functions of the kit there are copies: `prints` are the fingerprints of an answer's functions."""
    known = known_functions() | fingerprints_of(question)
    return [f"has a copy of the kit's {known[found]}" for found in prints if found in known]


def known_functions() -> dict[str, str]:
    """The names of the library's functions that are long enough to be known by their fingerprint."""
    with reference_lock:
        return _known_functions()


@functools.cache
def _known_functions() -> dict[str, str]:
    found = {}
    for name, path in (entry for package in course().copied for entry in files_of(package)):
        module = name.removesuffix(".py").replace("/", ".")
        found |= {key: f"{module}.{name}" for key, name in fingerprints(path.read_text()).items()}
    return found


@functools.cache
def fingerprints_of(question: Question) -> dict[str, str]:
    """The fingerprints of a question's reference; not of the wrong answers beside it."""
    with reference_lock:
        return fingerprints(question.source)
