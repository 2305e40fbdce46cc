"""labkit.losses against torch, torch's autograd and gradient check, and scikit-learn's class weights."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from labkit import losses

DTYPES = (np.int8, np.uint8, np.int32, np.int64)
WEIGHTS = np.array([0.5, 1.0, 20.0, 3.0])
untimed = settings(deadline=None)


pytestmark = pytest.mark.usefixtures("one_thread")  # tensors are tiny: more threads would wait for one another


@st.composite
def pixels(draw):
    """Draw logits (..., C), labels (...) of some dtype with some 255 where that fits, and one weight per class."""
    shape = draw(hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=5))
    C = draw(st.integers(1, 5))
    dtype, scale = draw(st.sampled_from(DTYPES)), draw(st.sampled_from([1.0, 30.0, 1e4]))
    classes = [*range(C), 255] if np.iinfo(dtype).max >= 255 else list(range(C))
    z = draw(hnp.arrays(np.float64, (*shape, C), elements=st.floats(-scale, scale)))
    y = draw(hnp.arrays(dtype, shape, elements=st.sampled_from(classes)))
    return z, y, draw(hnp.arrays(np.float64, C, elements=st.floats(0.1, 50.0)))


def batch(seed, N=2, C=4, H=5, W=7, share_ignored=0.2):
    """Draw torch logits (N, C, H, W), float64, and labels (N, H, W) of which some are 255."""
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, C, (N, H, W))
    labels[rng.random(labels.shape) < share_ignored] = 255
    return torch.from_numpy(3.0 * rng.normal(size=(N, C, H, W))), torch.from_numpy(labels)


def channels_last(logits: torch.Tensor) -> np.ndarray:
    return logits.detach().permute(0, 2, 3, 1).numpy()


# Softmax and cross-entropy


@untimed
@given(pixels(), st.sampled_from([np.float64, np.float32, np.int32]), st.floats(-1e4, 1e4))
def test_softmax_is_torchs_in_every_dtype_and_knows_no_constant(case, dtype, constant):
    z = case[0].astype(dtype)
    p, peer = losses.softmax(z), torch.from_numpy(z).double()
    assert p.shape == z.shape and p.dtype == np.float64
    np.testing.assert_allclose(p, peer.softmax(-1).numpy(), rtol=1e-12, atol=1e-300)
    np.testing.assert_allclose(losses.log_softmax(z), peer.log_softmax(-1).numpy(), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(losses.softmax(case[0] + constant), losses.softmax(case[0]), atol=1e-11)


@untimed
@given(pixels(), st.booleans())
def test_loss_and_gradient_are_torchs_sum_and_its_autograd(case, weighted):
    z, y, w = case
    w = w if weighted else None
    logits = torch.from_numpy(z.reshape(-1, z.shape[-1])).requires_grad_()
    weight = None if w is None else torch.from_numpy(w)
    labels = torch.from_numpy(y.reshape(-1).astype(np.int64))
    loss = torch.nn.functional.cross_entropy(logits, labels, weight, ignore_index=255, reduction="sum")
    loss.backward()
    assert losses.cross_entropy(z, y, w) == pytest.approx(loss.item(), rel=1e-9, abs=1e-9)
    grad = losses.cross_entropy_grad(z, y, w)
    assert grad.shape == z.shape and not grad[y == 255].any()
    np.testing.assert_allclose(grad.reshape(logits.shape), logits.grad.numpy(), atol=1e-10)


def test_logits_of_ten_thousand_are_exact():
    # Mistake 13: log(p + 1e-12) would answer 27.6, and log(0) infinity; z - logsumexp(z) answers 20,000.
    z = np.array([[1e4, -1e4, 0.0]])
    assert losses.cross_entropy(z, np.array([1])) == 2e4
    assert losses.cross_entropy(z, np.array([0])) == 0.0
    assert losses.softmax(z).tolist() == [[1.0, 0.0, 0.0]]
    assert losses.cross_entropy_grad(z, np.array([1])).tolist() == [[1.0, -1.0, 0.0]]


def test_many_float32_pixels_are_added_up_in_float64():
    # A running float32 sum of these 300,000 terms is off in the fourth digit.
    z = np.zeros((480, 640, 2), np.float32)
    z[..., 0] = np.float32(0.1)
    y = np.ones((480, 640), np.uint8)
    exact = 480 * 640 * math.log1p(math.exp(float(np.float32(0.1))))
    assert losses.cross_entropy(z, y) == pytest.approx(exact, rel=1e-12)


# Class weights, and what they do


counts = hnp.arrays(np.int64, st.integers(1, 6), elements=st.integers(0, 10**6)).filter(np.any)


@untimed
@given(counts)
def test_weights_follow_their_scheme_with_a_mean_of_one_over_the_counted_pixels(n):
    present = n > 0
    for scheme, power in (("none", 0.0), ("inverse", 1.0), ("sqrt", 0.5)):
        w = losses.class_weights(n, scheme)
        np.testing.assert_allclose(w[present] * n[present] ** power, (w * n**power)[present][0])
        assert (w > 0).all() and (w[~present] == 1.0).all() and (n @ w) / n.sum() == pytest.approx(1.0)


@untimed
@given(hnp.arrays(np.float64, 4, elements=st.floats(0.01, 1.0)), hnp.arrays(np.float64, 4, elements=st.floats(0.1, 50)))
def test_dividing_by_the_weights_undoes_them(p, w):
    p = p / p.sum()
    np.testing.assert_allclose(losses.weighted_optimum(p, w), p * w / (p @ w), atol=1e-12)
    np.testing.assert_allclose(losses.weighted_optimum(losses.weighted_optimum(p, w), 1 / w), p, atol=1e-12)
    np.testing.assert_allclose(losses.weighted_optimum(p, np.full(4, 7.0)), p, atol=1e-12)


# The loss to train with


@pytest.mark.parametrize("weights", [None, WEIGHTS, torch.from_numpy(WEIGHTS).float(), WEIGHTS.tolist()])
@pytest.mark.parametrize("dtype", [torch.uint8, torch.int32, torch.int64])
def test_the_training_loss_is_the_sum_over_the_number_of_counted_pixels(weights, dtype):
    logits, labels = batch(seed=2)
    logits.requires_grad_()
    loss = losses.segmentation_loss(logits, labels.to(dtype), weights)
    loss.backward()
    z, y = channels_last(logits), labels.numpy()
    w = None if weights is None else WEIGHTS
    counted = np.count_nonzero(y != 255)
    assert 0 < counted < y.size
    assert loss.item() == pytest.approx(losses.cross_entropy(z, y, w) / counted, rel=1e-12)
    grad = losses.cross_entropy_grad(z, y, w) / counted
    np.testing.assert_allclose(channels_last(logits.grad), grad, atol=1e-14)
    small = logits.detach()[:1, :, :2, :3].clone().requires_grad_()
    assert torch.autograd.gradcheck(lambda z: losses.segmentation_loss(z, labels[:1, :2, :3], weights), small)


def test_low_precision_logits_are_reduced_in_float32_and_added_up_in_float64():
    logits, labels = batch(seed=7, N=4, H=120, W=160)
    exact = losses.segmentation_loss(logits.bfloat16().double(), labels, WEIGHTS)
    for low in (logits.bfloat16(), logits.bfloat16().to(memory_format=torch.channels_last)):
        loss = losses.segmentation_loss(low, labels, WEIGHTS)
        assert loss.dtype == torch.float32 and loss.item() == pytest.approx(exact.item(), rel=3e-7)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_the_training_loss_of_large_logits_is_right_or_refused_in_true_words(dtype):
    """Their sum overflows, though each of them, and the loss, is a number."""
    large = 2e38 if dtype == torch.float32 else 1e308
    logits = torch.zeros((1, 2, 2, 3), dtype=dtype)
    logits[:, 0] = large
    right, wrong = torch.zeros((1, 2, 3), dtype=torch.int64), torch.full((1, 2, 3), 255)
    wrong[0, 0, 0] = 1
    assert losses.segmentation_loss(logits, right) == 0.0
    assert losses.segmentation_loss(logits, wrong).item() == pytest.approx(large, rel=1e-6)
    logits[:, 1] = -large
    with pytest.raises(ValueError, match=rf"^logits: expected smaller ones, got up to {large:.3g}".replace("+", r"\+")):
        losses.segmentation_loss(logits, wrong)
    logits[0, 0, 0, 0] = torch.nan
    with pytest.raises(ValueError, match=r"^logits: expected finite numbers, got 1 NaN or infinite"):
        losses.segmentation_loss(logits, right)


def test_a_batch_of_ignored_pixels_trains_nothing():
    logits, labels = batch(seed=8, share_ignored=1.0)
    logits.requires_grad_()
    loss = losses.segmentation_loss(logits, labels, WEIGHTS)
    loss.backward()
    assert loss.item() == 0.0 and not logits.grad.any()


# Bad input

Z, Y = np.zeros((2, 3, 4)), np.zeros((2, 3), int)
TENSORS = {"logits": torch.zeros(1, 4, 2, 3), "labels": torch.zeros((1, 2, 3), dtype=torch.int64)}
BAD = {
    "z": [Z + np.nan, Z + np.inf, Z + 0j, np.zeros((2, 3, 0)), np.float64(1.0)],
    "y": [Y.T, np.zeros((2, 3, 4), int), Y.astype(float), Y + 4, Y - 1],
    "weights": [np.ones(3), np.array([1.0, 1.0, 0.0, 1.0]), np.array([1.0, 1.0, np.inf, 1.0])],
}
BAD_TENSORS = {
    "logits": [TENSORS["logits"] + torch.nan, TENSORS["logits"] + torch.inf, torch.zeros(4, 2, 3)],
    "labels": [torch.zeros((1, 3, 2), dtype=torch.int64), torch.zeros((1, 2, 3)), torch.full((1, 2, 3), 4)],
    "weights": [torch.ones(3), np.array([1.0, 0.0, 1.0, 1.0])],
}
BAD_TENSORS["labels"] += [torch.zeros((1, 2, 3), dtype=torch.bool), torch.full((1, 2, 3), -100)]
CASES = [
    (function, name, {"z": Z, "y": Y, "weights": WEIGHTS, name: value})
    for function in (losses.cross_entropy, losses.cross_entropy_grad)
    for name, values in BAD.items()
    for value in values
]
CASES += [(losses.segmentation_loss, name, {**TENSORS, name: v}) for name, vs in BAD_TENSORS.items() for v in vs]
# NaN at an ignored pixel, too: it would reach the gradient.
IGNORED = {"logits": TENSORS["logits"] + torch.nan, "labels": torch.full((1, 2, 3), 255)}
CASES += [(losses.segmentation_loss, "logits", IGNORED)]
CASES += [(function, "z", {"z": np.array([0.0, np.nan])}) for function in (losses.softmax, losses.log_softmax)]
CASES += [
    (losses.class_weights, "counts", {"counts": n, "scheme": "sqrt"})
    for n in (np.array([3, -1]), Y[0], Y[0, :0], np.ones((2, 2)), np.array([1.0, np.nan]))
]
CASES += [(losses.class_weights, "scheme", {"counts": np.array([3, 1]), "scheme": "squared"})]
CASES += [
    (losses.weighted_optimum, "p", {"p": np.array(p), "w": np.ones(2)})
    for p in ([0.5, 0.6], [1.5, -0.5], [np.nan, 1.0], 1.0)
]
CASES += [
    (losses.weighted_optimum, "w", {"p": np.array([0.5, 0.5]), "w": w}) for w in (np.ones(3), np.array([1.0, 0.0]))
]


@pytest.mark.bad_input
@pytest.mark.parametrize(("function", "name", "arguments"), CASES)
def test_the_argument_that_is_wrong_is_named(function, name, arguments):
    with pytest.raises(ValueError, match=f"^{name}: expected"):
        function(**arguments)
