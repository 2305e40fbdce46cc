"""Which change of the arguments makes the right answer give a wrong output: then that is what went wrong.

If the reference with its argument lam set to 0 gives the student's outputs in every case, the student forgot lam.
"""

import itertools
from collections.abc import Callable, Iterator

import numpy as np

from labkit.course.checker.question import Question

Change = Callable[[tuple], tuple | None]

NUMBERS: dict[str, Callable] = {
    "were the other one of 0 and 1": lambda x: 1 - x if isinstance(x, int) and x in (0, 1) else None,
    "did not count (as if it were 0)": lambda x: 0 * x,
    "were 1, or left out of a product": lambda x: type(x)(1),
    "had the other sign": lambda x: -x,
    "were twice as large": lambda x: 2 * x,
    "were half as large": lambda x: x // 2 if isinstance(x, int) else x / 2,
    "were squared": lambda x: x * x,
    "were not squared, or its root were taken": lambda x: None if isinstance(x, int) else np.sqrt(np.abs(x)),
    "were 1 over what it is": lambda x: None if isinstance(x, int) else 1.0 / x,
    "were one larger": lambda x: x + 1,
    "were one smaller": lambda x: x - 1,
    "were close to 0": lambda x: None if isinstance(x, int) else 1e-4 * x,
    "were in degrees": lambda x: None if isinstance(x, int) else np.rad2deg(x),
    "were turned from degrees to radians": lambda x: None if isinstance(x, int) else np.deg2rad(x),
    "were 90 degrees less": lambda x: None if isinstance(x, int) else x - np.pi / 2,
    "were 90 degrees more": lambda x: None if isinstance(x, int) else x + np.pi / 2,
    "had no sign": lambda x: abs(x),
    "were cut to a whole number": lambda x: None if isinstance(x, int) else float(np.trunc(x)),
}


def floats(change: Callable) -> Callable:
    """A change for floating-point arrays alone."""
    return lambda x: change(x) if x.dtype.kind == "f" else None


def integers(change: Callable) -> Callable:
    """A change for arrays of whole numbers alone."""
    return lambda x: change(x) if x.dtype.kind in "iu" else None


def square(change: Callable) -> Callable:
    """A change for square matrices alone."""
    return lambda x: change(x) if x.ndim == 2 and x.shape[0] == x.shape[1] else None


ARRAYS: dict[str, Callable] = {
    "did not count (as if it were all 0)": np.zeros_like,
    "were all 1": np.ones_like,
    "were exchanged for the unit matrix": square(lambda x: np.eye(len(x), dtype=x.dtype)),
    "were transposed": lambda x: np.swapaxes(x, 0, 1) if x.ndim > 1 else None,
    "were inverted": square(np.linalg.inv),
    "were without its translation": square(lambda x: without_translation(x)),
    "were without its rotation": square(lambda x: without_rotation(x)),
    "had the other sign": lambda x: None if x.dtype.kind in "bu" else -x,
    "had no signs": lambda x: None if x.dtype.kind == "b" else np.abs(x),
    "were twice as large": floats(lambda x: 2 * x),
    "were half as large": floats(lambda x: x / 2),
    "were squared": floats(np.square),
    "were its roots": floats(lambda x: np.sqrt(np.abs(x))),
    "were 1 over what it is": floats(lambda x: 1.0 / x),
    "were 1 minus what it is": floats(lambda x: 1.0 - x),
    "were its logarithms": floats(np.log),
    "were its exponentials": floats(np.exp),
    "were the opposite": lambda x: ~x if x.dtype.kind == "b" else None,
    "were one larger": integers(lambda x: x + np.ones((), x.dtype)),
    "were one smaller": integers(lambda x: x - np.ones((), x.dtype)),
    "were centred": floats(lambda x: x - x.mean(0)),
    "were divided by its sum": floats(lambda x: x / x.sum()),
    "were without its last row": lambda x: x[:-1] if x.ndim else None,
    "were without its first row": lambda x: x[1:] if x.ndim else None,
    "were without its last column": lambda x: x[:, :-1] if x.ndim > 1 else None,
    "were without its first column": lambda x: x[:, 1:] if x.ndim > 1 else None,
    "were its first row alone": lambda x: x[:1] if x.ndim else None,
    "were its last row alone": lambda x: x[-1:] if x.ndim else None,
    "were upside down (the last row first)": lambda x: x[::-1] if x.ndim else None,
    "were mirrored (the last column first)": lambda x: x[:, ::-1] if x.ndim > 1 else None,
    "had its last axis reversed": lambda x: x[..., ::-1] if x.ndim > 1 else None,
    "were shifted by one": lambda x: np.roll(x, 1, 0) if x.ndim else None,
    "were shifted back by one": lambda x: np.roll(x, -1, 0) if x.ndim else None,
    "were shifted by one column": lambda x: np.roll(x, 1, 1) if x.ndim > 1 else None,
    "were shifted back by one column": lambda x: np.roll(x, -1, 1) if x.ndim > 1 else None,
    "were sorted": lambda x: np.sort(x, axis=0) if x.ndim else None,
    "held each of its rows once": lambda x: np.unique(x, axis=0) if x.ndim else None,
    "held 0 where it holds 255": integers(lambda x: np.where(x == 255, 0, x).astype(x.dtype)),
    "held 0 where it holds NaN": floats(np.nan_to_num),
    "were cast to bytes, which wrap round": integers(lambda x: x.astype(np.uint8)),
    "were cast to whole numbers": floats(np.trunc),
    "were rounded": floats(np.round),
}


def without_translation(T: np.ndarray) -> np.ndarray | None:
    """A pose with its last column cleared."""
    if T.shape != (4, 4):
        return None
    T = T.copy()
    T[:3, 3] = 0.0
    return T


def without_rotation(T: np.ndarray) -> np.ndarray | None:
    """A pose that only translates."""
    if T.shape != (4, 4):
        return None
    moved = np.eye(4)
    moved[:3, 3] = T[:3, 3]
    return moved


def changes(question: Question, args: tuple) -> Iterator[tuple[str, Change]]:
    """Sentences and changes of the arguments, for arguments of these kinds."""
    names, single = question.parameters, []
    for i, (name, value) in enumerate(zip(names, args, strict=True)):
        number = isinstance(value, int | float | np.generic)
        table = ARRAYS if isinstance(value, np.ndarray) else NUMBERS if number else {}
        for rank, (says, change) in enumerate(table.items()):
            says = says.replace(" row", " entry") if np.ndim(value) == 1 else says
            single.append((rank, f"Your output is right as if {name} {says}.", at(i, change)))
    for _, words, change in sorted(single, key=lambda entry: entry[0]):  # what is likely first, of any argument
        yield words, change
    for i, (name, value) in enumerate(zip(names, args, strict=True)):
        if isinstance(value, np.ndarray):
            last = value.shape[-1] if value.ndim else 0
            for a in range(last if 1 < last <= 4 else 0):
                for b in range(a):
                    words = f"Your output is right as if columns {b} and {a} of {name} were exchanged."
                    yield words, at(i, exchange_columns(a, b))
    alike = [i for i, v in enumerate(args) if isinstance(v, np.ndarray) and v.ndim and v.shape == first_shape(args)]
    if len(alike) > 1:
        who = " and ".join(names[i] for i in alike)
        for says, change in ARRAYS.items():
            if says.startswith(("were without its", "were upside", "were mirrored", "were transposed", "were its")):
                yield f"Your output is right as if {who} {says.replace(' its ', ' their ')}.", at_all(alike, change)
    numbers = [i for i, value in enumerate(args) if isinstance(value, float)]
    for i, j in itertools.combinations(numbers if len(numbers) <= 4 else (), 2):
        for says, change in NUMBERS.items():
            yield f"Your output is right as if {names[i]} and {names[j]} {says}.", at_all([i, j], change)
    for i in range(len(args)):
        for j in range(i):
            yield f"Your output is right as if the arguments {names[j]} and {names[i]} were exchanged.", swap(i, j)
            yield f"Your output is right as if {names[j]} stood in the place of {names[i]}, too.", put(i, j)
            yield f"Your output is right as if {names[i]} stood in the place of {names[j]}, too.", put(j, i)


def at(i: int, change: Callable) -> Change:
    """A change of one argument."""

    def changed(args: tuple) -> tuple | None:
        new = change(args[i])
        return None if new is None else (*args[:i], new, *args[i + 1 :])

    return changed


def first_shape(args: tuple) -> tuple[int, ...]:
    """The shape of the first array."""
    return next((v.shape for v in args if isinstance(v, np.ndarray) and v.ndim), ())


def at_all(places: list[int], change: Callable) -> Change:
    """The same change of several arguments."""

    def changed(args: tuple) -> tuple | None:
        new = [change(args[i]) if i in places else args[i] for i in range(len(args))]
        return None if any(new[i] is None for i in places) else tuple(new)

    return changed


def exchange_columns(a: int, b: int) -> Callable:
    """Exchange two entries of the last axis."""

    def change(x: np.ndarray) -> np.ndarray:
        order = np.arange(x.shape[-1])
        order[[a, b]] = b, a
        return x[..., order]

    return change


def swap(i: int, j: int) -> Change:
    """Exchange two arguments."""

    def changed(args: tuple) -> tuple:
        new = list(args)
        new[i], new[j] = new[j], new[i]
        return tuple(new)

    return changed


def put(i: int, j: int) -> Change:
    """Put argument j in the place of argument i, too."""

    def changed(args: tuple) -> tuple:
        new = list(args)
        new[i] = new[j]
        return tuple(new)

    return changed
