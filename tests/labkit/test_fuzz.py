"""Public functions under odd arguments: none ends the process, hangs or gives NaN in silence, and a refusal says what.

Each function has arguments that are good; one at a time is replaced by others of odd shapes, dtypes and values. It runs
in a process of its own, so that a crash or a hang is one function's. What it may do: answer, or raise a ValueError that
names the argument.
"""

import inspect
import json
import os
import select
import signal
import warnings
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from labcourse.stacks import regions, threshold
from labkit import crf, geometry, instance_metrics, labels, losses, metrics
from labkit.crf.exact import grid_max_flow
from labkit.crf.mean_field import mean_field_marginals
from labkit.geometry.depth_units import metres_per_unit, resize_depth, whole_units
from labkit.learning import things

pytestmark = [pytest.mark.nightly, pytest.mark.bad_input]

# What a function's inside says when nobody looked at the argument.
BARE = tuple(f": {name}: " for name in ("IndexError", "KeyError", "OverflowError", "ZeroDivisionError", "MemoryError"))
MOST_BYTES = 6 << 30  # of addresses, of which libraries take some: a function that asks for more gets a MemoryError
LONGEST_S = 120.0  # CPU seconds of all tries of one function
rng = np.random.default_rng(0)
Y = rng.integers(0, 4, (6, 8)).astype(np.uint8)
Z = rng.normal(size=(6, 8, 4))
P = Z / 4.0 + (0.0, 0.0, 0.0, 1.0)
CLOUD = rng.normal(size=(60, 3)) * 0.01
K = np.array([[500.0, 0.0, 4.0], [0.0, 500.0, 3.0], [0.0, 0.0, 1.0]])
RGB = rng.integers(0, 256, (6, 8, 3)).astype(np.uint8)
COUNTS = rng.integers(1, 9, (4, 4))
DEPTH = np.full((6, 8), 0.7, np.float32)
MODEL = crf.PottsCRF.from_image(Z, RGB, 1.0, 10.0)
INSIDE = np.ones((2, 6, 8), int)  # no pair leaves the image
INSIDE[0, :, -1] = INSIDE[1, -1] = 0
GOOD: dict[Callable, dict] = {
    labels.one_hot: {"y": Y, "C": 4},
    labels.from_one_hot: {"Y": np.eye(4)[Y]},
    labels.colorize: {"y": Y},
    metrics.confusion_matrix: {"y_true": Y, "y_pred": Y, "num_classes": 4},
    metrics.iou: {"n": COUNTS},
    metrics.mean_iou: {"n": COUNTS},
    metrics.pixel_accuracy: {"n": COUNTS},
    metrics.precision_recall: {"n": COUNTS},
    metrics.boundary_iou: {"y_true": Y, "y_pred": Y, "num_classes": 4},
    metrics.wilson_interval: {"successes": 3, "trials": 9, "confidence": 0.9},
    metrics.paired_difference: {"gained": 3, "lost": 1, "trials": 9},
    losses.softmax: {"z": Z},
    losses.log_softmax: {"z": Z},
    losses.cross_entropy: {"z": Z, "y": Y},
    losses.cross_entropy_grad: {"z": Z, "y": Y},
    losses.class_weights: {"counts": np.array([5, 3, 2]), "scheme": "inverse"},
    losses.weighted_optimum: {"p": np.array([[0.5, 0.5]]), "w": np.array([1.0, 2.0])},
    metrics.reliability_counts: {"p": P[..., 0] % 1.0, "true": Y > 1, "bins": 5},
    instance_metrics.score_instances: {"true": Y, "found": Y},
    things.group: {"foreground": (Y > 1).astype(float), "votes": Z[..., :2]},
    things.vote_targets: {"instances": Y},
    crf.dense_crf: {
        **{"unary": Z, "image": RGB, "theta_alpha": 6.0, "theta_beta": 9.0, "w_appearance": 1.0},
        **{"theta_gamma": 3.0, "w_smoothness": 1.0, "iterations": 2},
    },
    crf.PottsCRF: {"unary": Z, "weights": MODEL.weights},
    crf.PottsCRF.from_image: {"unary": Z, "image": RGB, "lam": 1.0, "sigma_I": 9.0, "sigma_p": 1.0, "connectivity": 8},
    crf.refine: {"probabilities": losses.softmax(Z), "image": RGB, "depth": DEPTH, "lam": 1.0, "sigma_I": 9.0},
    crf.unary_from_probabilities: {"probabilities": losses.softmax(Z), "floor": 1e-3},
    mean_field_marginals: {"crf": MODEL, "iterations": 3, "temperatures": (1.0, 0.5)},
    grid_max_flow: {"excess": Y.astype(int) - 1, "weights": INSIDE, "offsets": ((0, 1), (1, 0))},
    geometry.centroid_and_covariance: {"P": CLOUD},
    geometry.principal_axes: {"P": CLOUD, "tolerance": 0.05},
    geometry.fit_plane: {"P": CLOUD},
    geometry.inlier_indices: {"P": CLOUD, "radius": 0.01, "min_neighbours": 3},
    geometry.cluster_indices: {"P": CLOUD, "gap": 0.01, "min_points": 5},
    whole_units: {"depth": DEPTH, "unit": 0.001},
    resize_depth: {"depth": DEPTH, "size": (12, 9)},
    metres_per_unit: {"raw": (1000.0 * DEPTH).astype(np.uint16), "given": 0.001, "stated": 1000.0},
    geometry.pixel_rays: {"shape": (6, 8), "K": K},
    geometry.back_project: {"depth": DEPTH, "K": K},
    geometry.back_projection_jacobian: {"u": 3.0, "v": 2.0, "d": 0.7, "K": K},
    geometry.transform_points: {"T": np.eye(4), "P": CLOUD},
    geometry.invert_transform: {"T": np.eye(4)},
    regions.segment_kmeans: {"rgb": RGB, "k": 2},
    regions.components: {"regions": Y, "connectivity": 4},
    regions.region_properties: {"pieces": Y},
    threshold.things_on_table: {"table": Y > 1, "min_pixels": 4},
}
# No average without a pixel, no axes that points do not determine, no point without depth, 0 times infinity.
NAN_IS_SAID = ("iou", "mean_iou", "pixel_accuracy", "precision_recall", "boundary_iou")
NAN_IS_SAID = (*NAN_IS_SAID, "principal_axes", "back_project", "transform_points")
NUMBERS = (0, -1, 1, 3, 2**31, 2**62, -(2**62), 10**9, 1e-8, 1e-320, 1e300, -1e300, np.nan, np.inf, -np.inf, 2.5)
OTHERS = (None, True, "3", b"3", 1j, [], (), {}, object, np.float16(2), np.array(3), np.array([]), [[1], [2, 3]])


def odd(value) -> Iterator[tuple[str, object]]:
    """Arguments in the place of one that is good, each with words for it."""
    for other in (*NUMBERS, *OTHERS):
        yield f"{other!r}"[:40], other
    if not isinstance(value, np.ndarray):
        return
    for number in NUMBERS:
        if value.dtype.kind == "f" or (isinstance(number, int) and abs(number) <= np.iinfo(value.dtype).max):
            for where in ("one", "all"):
                array = value.copy() if value.dtype.kind != "u" or number >= 0 else value.astype(np.int64)
                with np.errstate(over="ignore"):
                    array[(0,) * value.ndim if where == "one" else ...] = number
                yield f"{where} {number!r}", array
    for dtype in (bool, np.int8, np.int64, np.uint64, np.float16, np.float32, np.longdouble, complex, object, "U4"):
        yield f"as {np.dtype(dtype)}", value.astype(dtype)
    yield "near 2^62", np.full(value.shape, 2**62, np.int64)
    yield "no rows", value[:0]
    yield "no last axis", value[..., :0]
    yield "one less", value[..., :-1]
    yield "one axis more", value[None]
    yield "flat", value.ravel()
    yield "transposed", value.T
    yield "backwards", value[::-1]
    yield "a list", value.tolist()
    yield "a mask of one", np.ma.array(value, mask=np.arange(value.size).reshape(value.shape) == 0)
    yield "a mask of all", np.ma.masked_all(value.shape, value.dtype)
    yield "read only", np.broadcast_to(value, value.shape)


def has_nan(value) -> bool:
    """Whether a NaN is in what a function gives."""
    if isinstance(value, tuple | list):
        return any(map(has_nan, value))
    if hasattr(value, "__dict__") and not isinstance(value, type):
        return any(map(has_nan, vars(value).values()))
    array = value if isinstance(value, np.ndarray) else np.asarray(value) if isinstance(value, float) else None
    return array is not None and array.dtype.kind == "f" and bool(np.isnan(array).any())


def findings(function: Callable, good: dict) -> Iterator[str]:
    """What a function does that it may not."""
    may_be_nan = function.__qualname__ in NAN_IS_SAID or has_nan(list(good.values())) or has_nan(function(**good))
    for name, value in good.items():
        for words, other in odd(value):
            try:
                with np.errstate(all="ignore"), warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    result = function(**good | {name: other})
            except ValueError as error:
                if name not in str(error):
                    yield f"{name} = {words}: the refusal does not name it: {str(error)[:60]}"
            except Exception as error:
                yield f"{name} = {words}: {type(error).__name__}: {str(error)[:60]}"
            else:
                if isinstance(other, np.ma.MaskedArray):
                    yield f"{name} = {words}: the mask is ignored"
                elif has_nan(result) and not may_be_nan and not has_nan(np.asarray(other, object).ravel().tolist()):
                    yield f"{name} = {words}: NaN in silence"


def fuzzed(function: Callable, good: dict) -> list[str]:
    """What `findings` finds, in a process of its own; a crash and a hang are findings, too."""
    source, sink = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.close(source)
            signal.alarm(0)
            import resource

            resource.setrlimit(resource.RLIMIT_CPU, (int(LONGEST_S), int(LONGEST_S)))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
            with os.fdopen(sink, "w") as out:
                for line in findings(function, good):
                    out.write(json.dumps(line) + "\n")
                    out.flush()
        finally:
            os._exit(0)
    os.close(sink)
    said = b""
    with os.fdopen(source, "rb", buffering=0) as pipe:
        while select.select([pipe], [], [], 10 * LONGEST_S)[0] and (more := pipe.read(1 << 16)):
            said += more
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    found = [json.loads(line) for line in said.decode().splitlines()]
    ended = os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0
    if ended == signal.SIGXCPU:
        found.append(f"after {len(found)} findings: it hangs")
    elif ended and ended != signal.SIGKILL:
        found.append(f"after {len(found)} findings: the process ended with signal {ended}")
    return found


@pytest.mark.parametrize("function", GOOD, ids=lambda function: function.__qualname__)
def test_no_argument_ends_the_process_hangs_or_gives_nan_in_silence(function):
    assert set(GOOD[function]) <= set(inspect.signature(function).parameters)
    found = fuzzed(function, GOOD[function])
    forbidden = ("the process ended", "it hangs", "in silence", "the mask is ignored", *BARE)
    bad = [line for line in found if any(words in line for words in forbidden)]
    assert not bad, "\n".join(bad)
