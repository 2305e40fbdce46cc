"""Kinds of arguments: what a statement allows for each, said once, in a question's `kinds`.

    kinds={"p": probabilities("H W C"), "eps": number(1e-6, 1.0, says="from 1e-6 to 1")}

A kind is what the statement says of an argument: its axes, its type, the range of its numbers, and whatever else every
value has (`form`: a rotation, a sum of 1). `draw` gives any value of the kind, the ends of its ranges often. Tests ask
that the statement says it in these words, that all cases are of their kinds, that each end is in some case, and that no
simplification which changes a value of the kind goes unnoticed (`tests/promises.py`). `draw` serves a question's
`inputs`, too.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

MOST_CLASSES = 255  # as many as bytes number beside 255, "nobody judged"
LARGE = 1e6  # what is drawn of floats without an upper end
LONG = 300  # a side longer than bytes count, where a statement names no longest


@dataclass(frozen=True, kw_only=True)
class Kind:
    """What a statement allows for one argument.

    shape: the names of its axes, "H W 3"; "..." are none to three; "" is a number. dtype: NumPy's name, or names;
    "int", "float" and "bool" are Python's own where it is a number; of "int" with axes it is a tuple. least, most: the
    ends of its numbers, both allowed. also: what it may hold beside these, 255 or NaN. lengths: (shortest, longest) of
    axes by name; (1, None) if it is not said, None where there is no end, and of C (1, 255). form: function (rng,
    array) that makes a value of the kind from any numbers in its range. choices: all its values, where it has few.
    says: phrases of the statement that say this, beside the shape, which it says anyhow. free: simplifications that
    the answer does not depend on, as patterns of `fnmatch`. digits: how many of its numbers count; with more than 7
    float32 is too short.
    """

    shape: str = ""
    dtype: str = "float64"
    least: float = -np.inf
    most: float = np.inf
    also: tuple[float, ...] = ()
    lengths: Mapping[str, tuple[int, int | None]] = field(default_factory=dict)
    form: Callable | None = None
    choices: tuple = ()
    says: tuple[str, ...] = ()
    free: tuple[str, ...] = ()
    digits: int = 7

    @property
    def axes(self) -> tuple[str, ...]:
        """The names of its axes."""
        return tuple(self.shape.split())

    @property
    def dtypes(self) -> tuple[str, ...]:
        """The types that it may have."""
        return tuple(self.dtype.split())

    @property
    def is_tuple(self) -> bool:
        """Whether it is a tuple of Python's whole numbers, like a size."""
        return self.dtype == "int" and bool(self.axes)

    @property
    def whole(self) -> bool:
        """Whether it holds whole numbers."""
        return np.dtype(self.dtypes[0]).kind in "iu"

    def length(self, axis: str) -> tuple[int, int | None]:
        """The shortest and the longest that an axis may be; None where there is no end."""
        if axis.isdecimal():
            return int(axis), int(axis)
        return self.lengths.get(axis, (1, MOST_CLASSES if axis == "C" else None))

    def draw(self, rng: np.random.Generator, most: float | None = None, **sides: int | tuple[int, ...]) -> object:
        """Draw any value; most: of its numbers, where another argument says it. sides: lengths of axes, `lead` of ...

        >>> number(0.0, 1.0).draw(np.random.default_rng(1)) <= 1.0
        True
        >>> labels("H W").draw(np.random.default_rng(1), most=2, H=1, W=4).shape
        (1, 4)
        """
        if self.choices:
            return self.choices[rng.integers(len(self.choices))]
        shape = []
        for axis in self.axes:
            first, last = self.length(axis)
            if axis == "...":
                shape.extend(sides.get("lead", rng.integers(1, 5, rng.integers(4))))
            else:
                shape.append(sides.get(axis, rng.integers(first, min(first + 5, last or np.inf) + 1)))
        values = self._numbers(rng, tuple(map(int, shape)), self.most if most is None else most)
        values = self.form(rng, values) if self.form else values
        if self.is_tuple:
            return tuple(map(int, values))
        if self.axes:
            return np.ascontiguousarray(values, np.dtype(rng.choice(self.dtypes)))
        return {"int": int, "bool": bool}.get(self.dtype, float)(values)

    def _numbers(self, rng, shape, most):
        """Numbers of its range, in a quarter of the places its ends, 0, or what it may also hold."""
        if self.dtype == "bool":
            return rng.random(shape) < 0.5
        low, high = max(self.least, -LARGE), min(most, LARGE)
        if self.whole:
            high = min(high, np.iinfo(self.dtypes[0]).max)
            values = rng.integers(int(max(low, -LARGE)), int(high), shape, endpoint=True).astype(float)
        else:  # of any size
            sizes = np.exp(rng.uniform(np.log(1e-3), np.log(max(high, -low, 1e-2)), shape))
            values = np.clip(sizes * np.where(rng.random(shape) < 0.5, low / max(abs(low), 1.0), 1.0), low, high)
        ends = np.array([low, high, *([0.0] if low <= 0.0 <= high else []), *self.also])
        return np.where(rng.random(shape) < 0.25, rng.choice(ends, shape), values)

    def refuses(self, value: object) -> str:
        """What is not allowed in a value; "" if it is of the kind, so far as shape, type and range say it.

        >>> image().refuses(np.zeros((2, 3), np.uint8))
        'axes (2, 3), not (H, W, 3)'
        """
        if self.choices:
            return "" if value in self.choices else f"{value}, none of {self.choices}"
        if not self.axes or self.is_tuple:
            python = tuple if self.is_tuple else {"int": int, "bool": bool}.get(self.dtype, float)
            if type(value) is not python:
                return f"{type(value).__name__}, not {python.__name__}"
        elif not isinstance(value, np.ndarray) or value.dtype not in [np.dtype(name) for name in self.dtypes]:
            return f"{getattr(value, 'dtype', type(value).__name__)}, not {self.dtype}"
        ends = self.axes[1:] if self.axes[:1] == ("...",) else self.axes
        sides = np.shape(value)[len(np.shape(value)) - len(ends) :] if len(ends) < len(self.axes) else np.shape(value)
        fits = len(sides) == len(ends) and all(
            self.length(axis)[0] <= n <= (self.length(axis)[1] or n) for axis, n in zip(ends, sides, strict=True)
        )
        if not fits:
            return f"axes {np.shape(value)}, not ({', '.join(self.axes)})"
        numbers = np.asarray(value, float)
        outside = ~((numbers >= self.least) & (numbers <= self.most) | np.isin(numbers, self.also))
        outside &= ~(np.isnan(numbers) & np.isnan(self.also or 0.0).any())
        return f"{numbers[outside][0]:g}, not {self.least:g} to {self.most:g}" if outside.any() else ""


# -------------------------------------------------------------------------------------------------- the usual ones


def array(shape: str, least: float = -np.inf, most: float = np.inf, *, says: tuple | str = (), **more) -> Kind:
    """An array of floats, or of `dtype`."""
    return Kind(shape=shape, least=least, most=most, says=(says,) if isinstance(says, str) else says, **more)


def number(least: float = -np.inf, most: float = np.inf, **more) -> Kind:
    """A float."""
    return array("", least, most, **{"dtype": "float", **more})


def count(least: int = 0, most: float = np.inf, **more) -> Kind:
    """A whole number of Python."""
    return array("", least, most, **{"dtype": "int", **more})


def truth(shape: str = "", **more) -> Kind:
    """Whether something is so; a bool, or an array of them."""
    return array(shape, 0, 1, dtype="bool", **more)


def labels(shape: str = "H W", unjudged: bool = True, **more) -> Kind:
    """Labels, 0 .. C - 1, and 255 where nobody judged."""
    said = ("0 .. C - 1", "255") if unjudged else ("0 .. C - 1",)
    return array(shape, 0, MOST_CLASSES - 1, **{"dtype": "uint8", "says": said, "also": (255,) * unjudged, **more})


def image(**more) -> Kind:
    """A colour picture, bytes (H, W, 3)."""
    return array("H W 3", 0, 255, **{"dtype": "uint8", **more})


def probabilities(shape: str, **more) -> Kind:
    """Probabilities, which sum to 1 over the last axis."""
    return array(shape, 0.0, 1.0, form=sum_to_1, **{"says": ("probabilities", "1"), **more})


def sum_to_1(rng: np.random.Generator, values: np.ndarray) -> np.ndarray:
    """Numbers, 0 or more, divided by their sum over the last axis; all equal where that is 0."""
    total = values.sum(axis=-1, keepdims=True)
    return np.where(total > 0.0, values / np.where(total > 0.0, total, 1.0), 1.0 / values.shape[-1])


def rotation(rng: np.random.Generator) -> np.ndarray:
    """Draw a rotation, (3, 3), all of them alike: a quaternion of four normal numbers has no direction."""
    w, x, y, z = (q := rng.normal(size=4)) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def pose(rng: np.random.Generator, reach: float = 1.0) -> np.ndarray:
    """Draw a rigid transform, (4, 4): any rotation, and each coordinate of the origin from -reach to reach, metres."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation(rng), rng.uniform(-reach, reach, 3)
    return T


def rotations(**more) -> Kind:
    """A rotation matrix."""
    return array("3 3", -1.0, 1.0, form=lambda rng, _: rotation(rng), **{"says": "rotation", **more})


def poses(reach: float = 1.0, **more) -> Kind:
    """A pose, T_base_grasp, T_base_cam: a rigid transform."""
    return array("4 4", form=lambda rng, _: pose(rng, reach), **{"says": "rigid", **more})


def intrinsics(**more) -> Kind:
    """A camera matrix K without skew."""

    def camera(rng, _):
        fx, fy = np.exp(rng.uniform(np.log(50.0), np.log(2000.0), 2))
        return np.array([[fx, 0.0, rng.uniform(0.0, fx)], [0.0, fy, rng.uniform(0.0, fy)], [0.0, 0.0, 1.0]])

    return array("3 3", 0.0, form=camera, **{"says": "without skew", **more})
