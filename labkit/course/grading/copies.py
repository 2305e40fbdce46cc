"""Copies of the kit's own code among answers: each student has the references, since `check` needs them."""

import functools
import inspect
import threading
from collections.abc import Callable, Iterable
from pathlib import Path

from labkit.course.grading.shapes import shapes_in

parsing = threading.Lock()  # Python 3.11's parser fails when two threads make syntax trees at a time


def of_the_kit(shapes: Iterable[str], reference: Callable) -> list[str]:
    """Say of which functions of the kit there are copies, by the shapes of the functions of an answer to a question."""
    known = known_functions() | shapes_of(reference)
    return [f"has a copy of the kit's {known[shape]}" for shape in shapes if shape in known]


def known_functions() -> dict[str, str]:
    """The names of the library's functions that are long enough to be known by their shape."""
    with parsing:
        return _known_functions()


@functools.cache
def _known_functions() -> dict[str, str]:
    root, found = Path(__file__).parents[2], {}
    for path in sorted(root.rglob("*.py")):
        if "course" not in path.relative_to(root).parts:
            module = ".".join(path.relative_to(root.parent).with_suffix("").parts)
            found |= {shape: f"{module}.{name}" for shape, name in shapes_in(path.read_text()).items()}
    return found


@functools.cache
def shapes_of(reference: Callable) -> dict[str, str]:
    """The shapes of a question's reference; not of the wrong answers beside it."""
    with parsing:
        return shapes_in(reference_source(reference))


@functools.cache
def reference_source(reference: Callable) -> str:
    """A question's reference as a student would write it; it is complete in itself but for NumPy."""
    source = inspect.getsource(inspect.unwrap(reference))
    return "\n".join(["import numpy as np", *filter(str.strip, source.splitlines())]) + "\n"
