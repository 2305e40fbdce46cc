"""Cross-entropy and its gradient, in NumPy to be read and in PyTorch to be trained with (topics 03 and 05).

The NumPy functions sum over pixels, in float64; a pixel labelled 255 adds neither loss nor gradient.
"""

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float64, Integer, Num

from labkit.labels import IGNORE, one_hot
from labkit.support.validation import as_array, check_finite, check_labels, check_shape, require

if TYPE_CHECKING:
    import torch

# Each scheme of class weights by its exponent of the class's number of pixels.
SCHEMES = {"none": 0.0, "inverse": -1.0, "sqrt": -0.5}


def softmax(z: Num[np.ndarray, "*shape C"]) -> Float64[np.ndarray, "*shape C"]:
    """Turn logits into probabilities over the last axis, the classes.

    Adding a constant to all logits of a pixel changes nothing, so the largest is taken off first: exp cannot overflow.
    Raises ValueError if z has a NaN or infinite entry, or no class. Topic 03.

    >>> softmax(np.array([1e4, 1e4, -1e4]))
    array([0.5, 0.5, 0. ])
    """
    z = _check_logits(z)
    exponentials = np.exp(z - z.max(axis=-1, keepdims=True))
    return exponentials / exponentials.sum(axis=-1, keepdims=True)


def log_softmax(z: Num[np.ndarray, "*shape C"]) -> Float64[np.ndarray, "*shape C"]:
    """Give the logarithm of the softmax, z - log(sum(exp(z))), right also where the probability itself rounds to 0.

    Raises ValueError as softmax does. Topic 03.

    >>> log_softmax(np.array([0.0, -1e4]))
    array([ 0., -10000.])
    """
    z = _check_logits(z)
    shifted = z - z.max(axis=-1, keepdims=True)
    return shifted - np.log(np.exp(shifted).sum(axis=-1, keepdims=True))


def cross_entropy(
    z: Num[np.ndarray, "*shape C"], y: Integer[np.ndarray, "*shape"], weights: Num[np.ndarray, " C"] | None = None
) -> float:
    """Sum -w[y] log p(y) over the pixels, y being a pixel's label; w is 1 unless `weights` are given.

    z: logits; y: labels; weights: one number above 0 for each class. Raises ValueError if shapes do not fit, z has NaN,
    a label is neither in 0 .. C - 1 nor 255, or a weight is not above 0. Topics 03 and 05.

    >>> round(cross_entropy(np.zeros((2, 4)), np.array([2, 255])), 4)  # one counted pixel, four equal classes: log 4
    1.3863
    """
    z, Y, w = _check_pixels(z, y, weights)
    return float(np.sum(Y * w * -log_softmax(z)))


def cross_entropy_grad(
    z: Num[np.ndarray, "*shape C"], y: Integer[np.ndarray, "*shape"], weights: Num[np.ndarray, " C"] | None = None
) -> Float64[np.ndarray, "*shape C"]:
    """Differentiate cross_entropy by its logits: w[y] (p - one-hot of y) at each pixel, which sums to 0 there.

    Arguments and errors as in cross_entropy. Topics 03 and 05.

    >>> cross_entropy_grad(np.zeros((1, 2)), np.array([1]), weights=np.array([1.0, 10.0]))
    array([[ 5., -5.]])
    """
    z, Y, w = _check_pixels(z, y, weights)
    pixel_weights = Y @ w  # w[y], and 0 where the pixel is ignored
    return pixel_weights[..., None] * (softmax(z) - Y)


def class_weights(counts: Num[np.ndarray, " C"], scheme: str) -> Float64[np.ndarray, " C"]:
    """Choose class weights from the number of pixels of each class.

    scheme: "none", all 1; "inverse", w_c proportional to 1 / counts_c; "sqrt", to 1 / sqrt(counts_c), which is milder.
    Scaled so that the mean weight over the counted pixels is 1: a learning rate found without weights still fits. A
    class without pixels gets 1, the mean, and has no part in the scaling. Raises ValueError for an unknown scheme, a
    negative count, or no pixel at all. Topic 05.

    >>> class_weights(np.array([900, 100, 0]), "inverse")
    array([0.55555556, 5. , 1. ])
    """
    counts = check_finite("counts", check_shape("counts", counts, (None,))).astype(np.float64)
    require("counts", counts.min(initial=0) >= 0, "numbers of pixels, at least 0", f"{counts.min(initial=0):g}")
    require("counts", counts.any(), "at least one pixel of some class", "none")
    require("scheme", scheme in SCHEMES, f"one of {', '.join(SCHEMES)}", repr(scheme))
    present = counts > 0
    w = np.ones(counts.size)
    w[present] = counts[present] ** SCHEMES[scheme]
    w[present] *= counts.sum() / (counts @ w)
    return w


def weighted_optimum(p: Num[np.ndarray, "*shape C"], w: Num[np.ndarray, " C"]) -> Float64[np.ndarray, "*shape C"]:
    """Predict where training with weights ends: q_c = w_c p_c / sum_k(w_k p_k), not at the true probabilities p.

    p: probabilities of the classes where pixels look alike, summing to 1 over the last axis; w: class weights above 0.
    This q minimises the expected weighted loss -sum_c w_c p_c log q_c, so a weighted network answers with q; it is the
    price of weights, and dividing its answer by w undoes it. Raises ValueError if p is no distribution or a weight is
    not above 0. Topic 05.

    >>> weighted_optimum(np.array([0.9, 0.1]), np.array([1.0, 9.0]))
    array([0.5, 0.5])
    """
    p = check_finite("p", p).astype(np.float64)
    require("p", p.ndim >= 1 and p.shape[-1] >= 1, "probabilities (..., C) of at least one class", f"shape {p.shape}")
    off = np.abs(p.sum(axis=-1) - 1.0).max(initial=0.0)
    got = f"a minimum of {p.min(initial=0.0):.3g} and a sum that is off by {off:.3g}"
    fits = p.min(initial=0.0) >= 0.0 and off <= 1e-5
    require("p", fits, "probabilities of at least 0 that sum to 1 over the last axis", got)
    weighted = _check_weights("w", w, p.shape[-1]) * p
    return weighted / weighted.sum(axis=-1, keepdims=True)


def segmentation_loss(logits: "torch.Tensor", labels: "torch.Tensor", weights=None) -> "torch.Tensor":
    """Give the loss to train with: the weighted sum of `cross_entropy`, divided by the number of counted pixels.

    logits: (N, C, H, W), any floating dtype; labels: (N, H, W), any integer dtype, 255 is left out; weights: (C,),
    array or tensor, or None. Returns a scalar, 0 if no pixel is counted. PyTorch's `CrossEntropyLoss(weight=...)`
    divides by the sum of the counted pixels' weights instead: there weights cancel in a batch of one class, here they
    never do. Raises ValueError if shapes do not fit, a label or weight is out of range, or logits have NaN or infinity.
    Topic 05.

    >>> import torch
    >>> segmentation_loss(torch.zeros(1, 2, 1, 1), torch.tensor([[[1]]]), weights=[1.0, 10.0]) / 10.0
    tensor(0.6931)
    """
    import torch  # here, so that the NumPy half of this module does not wait for it
    from torch.nn.functional import cross_entropy

    require("logits", logits.ndim == 4, "shape (N, C, H, W)", tuple(logits.shape))
    image_shape = (logits.shape[0], *logits.shape[2:])
    require("labels", labels.shape == image_shape, f"the shape (N, H, W) of logits, {image_shape}", tuple(labels.shape))
    check_labels("labels", labels.cpu().numpy(), logits.shape[1])
    labels = labels.long()
    counted = labels != IGNORE
    logits = logits if logits.dtype == torch.float64 else logits.float()
    # One sum finds any NaN or infinity; at an ignored pixel it would spare the loss and spoil the gradient.
    if not torch.isfinite(logits.detach().sum()) and not torch.isfinite(logits).all():
        bad = logits.numel() - torch.isfinite(logits).sum().item()
        raise ValueError(f"logits: expected finite numbers, got {bad} NaN or infinite; has the training diverged?")
    if weights is not None:
        array = torch.as_tensor(weights, dtype=torch.float64, device="cpu").detach().numpy()
        weights = torch.from_numpy(_check_weights("weights", array, logits.shape[1])).to(logits)
    losses = cross_entropy(logits, labels, weight=weights, ignore_index=IGNORE, reduction="none")
    # Summed in float64: in float32, a batch of some 100,000 pixels is off in the fourth digit.
    loss = (losses.sum(dtype=torch.float64) / counted.sum().clamp(min=1)).to(logits.dtype)
    if not torch.isfinite(loss):
        largest = logits.detach().abs().max()
        raise ValueError(f"logits: expected smaller ones, got up to {largest:.3g} in size; has the training diverged?")
    return loss


segmentation_loss.sums_over_pixels = True  # but for the division: so ranks can share a batch, see `train`


def _check_logits(z) -> np.ndarray:
    z = check_finite("z", z)
    require("z", z.ndim >= 1 and z.shape[-1] >= 1, "logits (..., C) of at least one class", f"shape {z.shape}")
    return z.astype(np.float64, copy=False)


def _check_weights(name: str, w, num_classes: int) -> np.ndarray:
    w = check_finite(name, check_shape(name, w, (num_classes,)))
    require(name, w.min() > 0, "one number above 0 for each class", f"{w.min():g}")
    return w.astype(np.float64)


def _check_pixels(z, y, weights) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the logits, the one-hot tensor Y (all zeros where ignored) and one weight per class."""
    z, y = _check_logits(z), as_array("y", y)
    require("y", y.shape == z.shape[:-1], f"one label for each pixel of z, shape {z.shape[:-1]}", y.shape)
    num_classes = z.shape[-1]
    w = np.ones(num_classes) if weights is None else _check_weights("weights", weights, num_classes)
    return z, one_hot(y, num_classes), w
