"""Checks of what callers pass in: each raises a ValueError that names the argument, what was expected and what came.

Shape annotations are checked only while tests run; these checks always are, at the public entrances.
"""

import numpy as np

# No sensor of this kit sees further, and no arm's camera stands further away; larger numbers are millimetres, but for
# a few: a stereo pair that matches wrongly reads any distance.
MAX_DEPTH_M = 100.0
MOST_STRAYS = 0.05  # of the readings
FILL = "fill them: array.filled(...)"
MAX_TRANSLATION_M = 20.0
MAX_ITERATIONS = 10_000  # of any method here: more is a slip, and looks like a program that hangs


def require(name: str, fits, expected: str, got) -> None:
    """Raise a ValueError that names an argument, what was expected and what came, unless `fits`.

    got: what came, or a function that says it; checks that run for each frame find their words only when needed.

    >>> require("alpha", 0.0 <= 1.5 <= 1.0, "a share in 0..1", 1.5)
    Traceback (most recent call last):
    ...
    ValueError: alpha: expected a share in 0..1, got 1.5
    """
    if not fits:
        raise ValueError(f"{name}: expected {expected}, got {got() if callable(got) else got}")


def check_whole(name: str, value, least: int, most: int | None = None) -> int:
    """Return a whole number from `least` to `most`; True and 2.0 are none.

    >>> check_whole("holes", 3, least=0, most=0)
    Traceback (most recent call last):
    ...
    ValueError: holes: expected a whole number of at least 0, at most 0, got 3
    """
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not (whole and least <= value and (most is None or value <= most)):
        up_to = "" if most is None else f", at most {most}"
        raise ValueError(f"{name}: expected a whole number of at least {least}{up_to}, got {value!r}")
    return int(value)


def check_number(name: str, value, least: float, most: float) -> float:
    """Return a real number from `least` to `most`; NaN, True, texts and arrays are none.

    >>> check_number("theta", 1e-8, least=1e-3, most=1e6)
    Traceback (most recent call last):
    ...
    ValueError: theta: expected a number from 0.001 to 1e+06, got 1e-08
    """
    real = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    require(name, real and least <= value <= most, f"a number from {least:g} to {most:g}", lambda: repr_of(value))
    return float(value)


def repr_of(value) -> str:
    """A value in a message: in short, and NumPy's numbers as Python's."""
    text = repr(value.item() if isinstance(value, np.generic) else value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def as_array(name: str, value) -> np.ndarray:
    """Return a value as an ndarray; one with masked values is refused, since nothing here computes without these.

    >>> as_array("depth", np.ma.masked_equal([0.0, 0.5], 0.0))
    Traceback (most recent call last):
    ...
    ValueError: depth: expected an array without a mask, got 1 masked values of 2; fill them: array.filled(...)
    """
    if isinstance(value, np.ma.MaskedArray):
        count = int(np.ma.getmaskarray(value).sum())
        require(name, not count, "an array without a mask", f"{count} masked values of {value.size}; {FILL}")
    try:
        return np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name}: expected an array, got rows of different lengths") from error


def check_shape(name: str, array, shape: tuple) -> np.ndarray:
    """Return `array` as an ndarray if its shape fits; None in `shape` stands for any length.

    >>> check_shape("P", [[1.0, 2.0, 3.0]], (None, 3)).shape
    (1, 3)
    """
    array = as_array(name, array)
    fits = array.ndim == len(shape) and all(s in (None, n) for s, n in zip(shape, array.shape, strict=True))
    if not fits:
        expected = str(tuple("any" if s is None else s for s in shape)).replace("'", "")
        raise ValueError(f"{name}: expected shape {expected}, got {array.shape}")
    return array


def check_same_size(name_a: str, a: np.ndarray, name_b: str, b: np.ndarray) -> None:
    """Raise unless two images have the same height and width (their first two axes)."""
    require(name_b, a.shape[:2] == b.shape[:2], f"the size of {name_a}, {a.shape[:2]}", b.shape[:2])


def check_finite(name: str, array: np.ndarray) -> np.ndarray:
    """Return `array` if it is real, numeric and without NaN or infinity."""
    array = as_array(name, array)
    require(name, array.dtype.kind in "fiu", "real numbers", lambda: f"dtype {array.dtype}")
    bad = array.size - np.count_nonzero(np.isfinite(array))
    require(name, not bad, "finite numbers", lambda: f"{bad} NaN or infinite of {array.size}")
    return array


def check_height(name: str, z) -> float:
    """Return a height in metres, one finite number of at most 10: more would be millimetres."""
    z = float(check_finite(name, check_shape(name, z, ())))
    require(name, abs(z) <= 10.0, "metres", f"{z:.6g}, which looks like millimetres: multiply by 0.001")
    return z


def check_rgb(name: str, image) -> np.ndarray:
    """Return an RGB image, uint8 (H, W, 3)."""
    image = check_shape(name, image, (None, None, 3))
    require(name, image.dtype == np.uint8, "uint8 RGB in 0..255", f"dtype {image.dtype}")
    require(name, 0 not in image.shape, "at least one pixel", f"shape {image.shape}")
    return image


def check_depth(name: str, depth) -> np.ndarray:
    """Return a depth image in metres, floating point (H, W); 0 and NaN mean "no reading" and are fine.

    Up to a twentieth of the readings may lie beyond 100 m.
    """
    depth = check_shape(name, depth, (None, None))
    advice = "integer depth is usually millimetres: multiply by its scale (often 0.001)"
    require(name, depth.dtype.kind == "f", "floating-point metres", lambda: f"dtype {depth.dtype}; {advice}")
    # One reduction answers most frames: NaN fails both comparisons, so only odd frames pay for the second look.
    low, high = (depth.min(), depth.max()) if depth.size else (0.0, 0.0)
    if not (low >= 0.0 and high <= MAX_DEPTH_M):
        read = depth[~np.isnan(depth) & (depth != 0.0)]
        low, high, far = read.min(initial=0.0), read.max(initial=0.0), np.count_nonzero(read > MAX_DEPTH_M)
        mend = "multiply by 0.001 (and mark missing readings with 0 or NaN, not infinity)"
        require(name, low >= 0.0, "metres >= 0", f"a minimum of {low:.6g}")
        fits = far <= MOST_STRAYS * read.size and high < np.inf
        require(name, fits, "metres", f"a maximum of {high:.6g}, which looks like millimetres: {mend}")
    return depth


def check_points(name: str, P) -> np.ndarray:
    """Return points, floating point (..., 3): x, y, z on the last axis; NaN is fine."""
    P = as_array(name, P)
    if P.ndim == 0 or P.shape[-1] != 3 or P.dtype.kind != "f":
        raise ValueError(f"{name}: expected floating-point x, y, z on the last axis, got {P.dtype} {P.shape}")
    return P


def check_K(name: str, K) -> np.ndarray:
    """Return an intrinsic matrix as float64 (3, 3): upper triangular, last row 0 0 1, positive focal lengths."""
    K = check_finite(name, check_shape(name, K, (3, 3))).astype(np.float64)
    if K[1, 0] or K[2, 0] or K[2, 1]:
        raise ValueError(f"{name}: expected an upper triangular intrinsic matrix, got {K.tolist()}; is it transposed?")
    if not (K[0, 0] > 1e-9 and K[1, 1] > 1e-9):  # pixels; below, its inverse has no numbers
        unknown = "" if K.any() else "; a K of zeros is an uncalibrated camera's"
        raise ValueError(
            f"{name}: expected positive focal lengths (else it is singular), got {K[0, 0]} and {K[1, 1]}{unknown}"
        )
    require(name, K[2, 2] == 1.0, "its last row to be 0 0 1", K[2].tolist)
    return K


def check_T(name: str, T, tolerance: float = 1e-4) -> np.ndarray:
    """Return a rigid transform in SE(3) as float64 (4, 4): orthonormal, right-handed, last row 0 0 0 1, in metres."""
    T = check_finite(name, check_shape(name, T, (4, 4))).astype(np.float64)
    x, y, z, last = T.tolist()
    if max(map(abs, last[:3])) > tolerance or abs(last[3] - 1.0) > tolerance:
        raise ValueError(f"{name}: expected its last row to be 0 0 0 1, got {last}; is it transposed?")
    R = T[:3, :3]
    error = np.abs(R @ R.T - np.eye(3)).max()
    require(
        name, error <= tolerance, "an orthonormal rotation", lambda: f"R @ R.T off from the identity by {error:.3g}"
    )
    third = (x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0])  # the row x cross y
    turns_right = third[0] * z[0] + third[1] * z[1] + third[2] * z[2] >= 0.0
    require(name, turns_right, "a right-handed rotation (determinant +1)", "a mirror image (-1)")
    far = max(abs(x[3]), abs(y[3]), abs(z[3]))
    mend = "which looks like millimetres: multiply T[:3, 3] by 0.001"
    require(name, far <= MAX_TRANSLATION_M, "a translation in metres", lambda: f"{far:.6g}, {mend}")
    return T


def check_pixel(name: str, at, size: tuple[int, int]) -> tuple[int, int]:
    """Return a pixel (u, v) as whole numbers if it lies in a picture of (width, height) `size`."""
    u, v = check_finite(name, check_shape(name, at, (2,)))
    fits = 0 <= round(u) < size[0] and 0 <= round(v) < size[1]
    require(name, fits, f"a pixel (u, v) of the picture of {size[0]} x {size[1]}", f"({u:g}, {v:g})")
    return round(u), round(v)


def check_labels(name: str, y, num_classes: int, ignore: int | None = 255) -> np.ndarray:
    """Return integer labels in 0 .. num_classes - 1, or `ignore`; any shape and integer dtype."""
    y = as_array(name, y)
    require(name, y.dtype.kind in "iu", "integer labels", lambda: f"dtype {y.dtype}")
    if y.size and (y.min() < 0 or y.max() >= num_classes):
        wrong = (y < 0) | (y >= num_classes)
        if ignore is not None:
            wrong &= y != ignore
        if wrong.any():
            allowed = f"0 to {num_classes - 1}" + (f" or {ignore}" if ignore is not None else "")
            raise ValueError(f"{name}: expected labels {allowed}, got {np.unique(y[wrong])[:5].tolist()}")
    return y
