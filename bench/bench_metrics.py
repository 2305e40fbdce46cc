"""Confusion matrix at 640x480: the kit's beside scikit-learn's, torchmetrics' and NumPy's, in one run.

The clock is the processor time of one thread, which a busy machine disturbs less than the time on the wall.
"""

import time

import numpy as np
import sklearn.metrics
import torch
from torchmetrics.functional.classification import multiclass_confusion_matrix

from bench.measure import in_turns, table
from labkit import metrics

C = 4
ROUNDS = 30


def scene(shape=(480, 640)) -> tuple[np.ndarray, np.ndarray]:
    """Draw labels as a frame has them, floor, table, two objects and a rim to ignore, and a prediction a bit off."""
    v, u = np.mgrid[: shape[0], : shape[1]]
    y = np.where(v > 150, 1, 0).astype(np.uint8)
    for c, centre in ((2, (280, 250)), (3, (320, 450))):
        y[(v - centre[0]) ** 2 + 2 * (u - centre[1]) ** 2 < 40**2] = c
    y_pred = np.roll(y, (2, 3), axis=(0, 1))
    y[:2] = 255
    return y, y_pred


def noise(rng, shape=(480, 640)) -> tuple[np.ndarray, np.ndarray]:
    """Draw labels without any order, the worst case for a loop that counts."""
    return rng.choice([0, 1, 2, 3, 255], shape).astype(np.uint8), rng.integers(0, C, shape, np.uint8)


def numpy_one_liner(y_true, y_pred):
    counted = y_true != 255
    codes = C * y_true[counted].astype(np.int64) + y_pred[counted]
    return np.bincount(codes, minlength=C * C).reshape(C, C)


def medians(ways: dict) -> dict[str, float]:
    """Median milliseconds of processor time by name."""
    return {name: float(np.median(ms)) for name, ms in in_turns(ways, ROUNDS, time.thread_time).items()}


def contenders(y_true, y_pred) -> dict:
    """Name each way to count, as a call without arguments; what a way wants prepared is prepared before the clock."""
    tensors = torch.from_numpy(y_pred), torch.from_numpy(y_true)
    flat = y_true.ravel(), y_pred.ravel()

    def torchmetrics(validate):
        return multiclass_confusion_matrix(*tensors, C, ignore_index=255, validate_args=validate).numpy()

    return {
        "labkit": lambda: metrics.confusion_matrix(y_true, y_pred, C),
        "NumPy's bincount, unchecked": lambda: numpy_one_liner(y_true, y_pred),
        "torchmetrics, unchecked": lambda: torchmetrics(False),
        "torchmetrics": lambda: torchmetrics(True),
        "scikit-learn": lambda: sklearn.metrics.confusion_matrix(*flat, labels=range(C)),
    }


def main() -> str:
    """Measure on a scene and on noise, in the dtypes that labels come in, and return the table in Markdown."""
    torch.set_num_threads(1)
    rows = []
    for kind, images in {"scene": scene(), "noise": noise(np.random.default_rng(0))}.items():
        for dtype in (np.uint8, np.int64):
            ways = contenders(*(y.astype(dtype) for y in images))
            expected = ways["labkit"]()
            for name, count in ways.items():
                assert (count() == expected).all(), f"{name} counts otherwise"
            times = medians(ways)
            what = f"{kind}, {np.dtype(dtype).name}"
            rows += [(what, name, f"{ms:.2f}", f"{ms / times['labkit']:.1f}") for name, ms in times.items()]
    images = scene()
    ms = medians({"boundary": lambda: metrics.boundary_counts(*images, C)})["boundary"]
    rows.append(("scene, uint8", "labkit's boundary counts", f"{ms:.2f}", ""))
    return table("labels | method | median ms of one thread | times labkit", rows)
