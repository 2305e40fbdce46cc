"""labkit.losses against loops, central differences, torch autograd and scikit-learn's class weights."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from sklearn.utils.class_weight import compute_class_weight

from labkit import losses, metrics
from labkit.labels import one_hot

DTYPES = (np.int8, np.uint8, np.int32, np.int64)
WEIGHTS = np.array([0.5, 1.0, 20.0, 3.0])
untimed = settings(deadline=None)


@pytest.fixture(autouse=True, scope="module")
def one_thread():
    """These tensors are tiny; on a busy machine more threads would only wait for one another."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@st.composite
def pixels(draw, largest=30.0, ignored=True):
    """Draw logits (..., C), labels (...) of some dtype with some 255 where that fits, and one weight a class."""
    shape = draw(hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=5))
    C = draw(st.integers(1, 5))
    dtype = draw(st.sampled_from(DTYPES))
    classes = [*range(C), 255] if ignored and np.iinfo(dtype).max >= 255 else list(range(C))
    z = draw(hnp.arrays(np.float64, (*shape, C), elements=st.floats(-largest, largest)))
    y = draw(hnp.arrays(dtype, shape, elements=st.sampled_from(classes)))
    return z, y, draw(hnp.arrays(np.float64, C, elements=st.floats(0.1, 50.0)))


def loss_by_hand(z, y, w):
    """Add up w[y] (log(sum(exp(z))) - z[y]) pixel by pixel, the formula of problem 1 as it stands."""
    total = 0.0
    for scores, c in zip(z.reshape(-1, z.shape[-1]).tolist(), y.ravel().tolist(), strict=True):
        if c != 255:
            total += w[c] * (math.log(math.fsum(math.exp(score) for score in scores)) - scores[c])
    return total


def batch(seed, N=2, C=4, H=5, W=7, share_ignored=0.2):
    """Draw torch logits (N, C, H, W), float64, and labels (N, H, W) of which some are 255."""
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, C, (N, H, W))
    labels[rng.random(labels.shape) < share_ignored] = 255
    return torch.from_numpy(3.0 * rng.normal(size=(N, C, H, W))), torch.from_numpy(labels)


def channels_last(logits: torch.Tensor) -> np.ndarray:
    return logits.detach().permute(0, 2, 3, 1).numpy()


# Softmax


@untimed
@given(pixels())
def test_probabilities_sum_to_one_over_the_classes(case):
    # Mistake 11: the sum over any other axis is not one.
    z, _, _ = case
    p = losses.softmax(z)
    assert p.shape == z.shape and p.dtype == np.float64
    np.testing.assert_allclose(p.sum(axis=-1), np.ones(z.shape[:-1]), rtol=1e-14)
    np.testing.assert_allclose(np.log(p), losses.log_softmax(z), rtol=1e-12, atol=1e-14)


def test_softmax_agrees_with_torch_in_every_dtype():
    z = np.random.default_rng(0).normal(size=(3, 5, 4)) * 10
    for logits in (z, z.astype(np.float32), z.round().astype(np.int32)):
        peer = torch.from_numpy(logits).double()
        np.testing.assert_allclose(losses.softmax(logits), peer.softmax(-1).numpy(), rtol=1e-13)
        np.testing.assert_allclose(losses.log_softmax(logits), peer.log_softmax(-1).numpy(), rtol=1e-13)


@untimed
@given(pixels(), st.floats(-1e4, 1e4))
def test_a_constant_added_to_all_logits_of_a_pixel_changes_nothing(case, constant):
    z, y, w = case
    np.testing.assert_allclose(losses.softmax(z + constant), losses.softmax(z), atol=1e-11)
    assert losses.cross_entropy(z + constant, y, w) == pytest.approx(losses.cross_entropy(z, y, w), abs=1e-6)


def test_logits_of_ten_thousand_are_exact():
    # Mistake 13: log(p + 1e-12) would answer 27.6, and log(0) infinity; z - logsumexp(z) answers 20,000.
    z = np.array([[1e4, -1e4, 0.0]])
    assert losses.cross_entropy(z, np.array([1])) == 2e4
    assert losses.cross_entropy(z, np.array([0])) == 0.0
    assert losses.softmax(z).tolist() == [[1.0, 0.0, 0.0]]
    assert losses.cross_entropy_grad(z, np.array([1])).tolist() == [[1.0, -1.0, 0.0]]


# Cross-entropy


@untimed
@given(pixels())
def test_cross_entropy_is_the_sum_by_hand(case):
    z, y, w = case
    assert losses.cross_entropy(z, y, w) == pytest.approx(loss_by_hand(z, y, w), rel=1e-9, abs=1e-9)
    ones = np.ones(z.shape[-1])
    assert losses.cross_entropy(z, y) == pytest.approx(loss_by_hand(z, y, ones), rel=1e-9, abs=1e-9)


def test_the_loss_sums_over_pixels_so_that_a_pixels_gradient_knows_nothing_of_how_many_there_are():
    # Mistake 12: a mean would keep the loss and shrink each gradient.
    rng = np.random.default_rng(0)
    z, y = rng.normal(size=(3, 5, 4)), rng.integers(0, 4, (3, 5))
    twice = np.concatenate([z, z]), np.concatenate([y, y])
    assert losses.cross_entropy(*twice) == pytest.approx(2 * losses.cross_entropy(z, y))
    np.testing.assert_array_equal(losses.cross_entropy_grad(*twice)[:3], losses.cross_entropy_grad(z, y))


def test_probabilities_given_for_logits_keep_the_loss_from_falling():
    # Mistake 14: softmax twice. Right and certain pixels cost nothing; with a second softmax each still costs 0.74.
    z = np.array([[1e3, 0.0, 0.0, 0.0]] * 10)
    y = np.zeros(10, int)
    assert losses.cross_entropy(z, y) == 0.0
    assert losses.cross_entropy(losses.softmax(z), y) / 10 == pytest.approx(math.log(1 + 3 / math.e))


@untimed
@given(pixels(ignored=False), st.data())
def test_ignored_pixels_add_neither_loss_nor_gradient(case, data):
    z, y, w = case
    ignored = data.draw(hnp.arrays(bool, y.shape))
    y = np.where(ignored, 255, y.astype(int))
    counted = np.asarray(~ignored)
    assert losses.cross_entropy(z, y, w) == pytest.approx(losses.cross_entropy(z[counted], y[counted], w))
    grad = losses.cross_entropy_grad(z, y, w)
    assert not grad[ignored].any()
    np.testing.assert_allclose(grad[counted], losses.cross_entropy_grad(z[counted], y[counted], w))


def test_an_image_of_ignored_pixels_has_loss_zero_and_no_gradient():
    z, y = np.random.default_rng(0).normal(size=(3, 5, 4)), np.full((3, 5), 255, np.uint8)
    assert losses.cross_entropy(z, y, WEIGHTS) == 0.0
    assert not losses.cross_entropy_grad(z, y, WEIGHTS).any()


def test_many_float32_pixels_are_added_up_in_float64():
    # A running float32 sum of these 300,000 terms is off in the fourth digit.
    z = np.zeros((480, 640, 2), np.float32)
    z[..., 0] = np.float32(0.1)
    y = np.ones((480, 640), np.uint8)
    exact = 480 * 640 * math.log1p(math.exp(float(np.float32(0.1))))
    assert losses.cross_entropy(z, y) == pytest.approx(exact, rel=1e-12)


# The gradient


@untimed
@given(pixels())
def test_the_gradient_of_each_pixel_sums_to_zero(case):
    # Mistake 16: without the one-hot it would sum to the pixel's weight.
    z, y, w = case
    grad = losses.cross_entropy_grad(z, y, w)
    assert grad.shape == z.shape
    np.testing.assert_allclose(grad.sum(axis=-1), np.zeros(y.shape), atol=1e-12)


@untimed
@given(pixels())
def test_the_gradient_lowers_the_true_class_only_and_is_never_larger_than_the_weight(case):
    z, y, w = case
    C = z.shape[-1]
    grad, Y = losses.cross_entropy_grad(z, y, w), one_hot(y, C)
    assert (grad[Y == 1] <= 0).all() and (grad[Y == 0] >= 0).all()
    np.testing.assert_array_less(np.abs(grad).max(axis=-1, initial=0.0), (Y @ w) * (1 + 1e-12) + 1e-300)


@pytest.mark.parametrize("weights", [None, WEIGHTS])
def test_the_gradient_agrees_with_central_differences(weights):
    rng = np.random.default_rng(0)
    z, y = 2.0 * rng.normal(size=(2, 3, 4)), rng.choice([0, 1, 2, 3, 255], (2, 3))
    h = 1e-5
    numerical = np.zeros_like(z)
    for entry in np.ndindex(z.shape):
        step = np.zeros_like(z)
        step[entry] = h
        numerical[entry] = (losses.cross_entropy(z + step, y, weights) - losses.cross_entropy(z - step, y, weights)) / (
            2 * h
        )
    np.testing.assert_allclose(losses.cross_entropy_grad(z, y, weights), numerical, atol=1e-8)


@pytest.mark.parametrize("weights", [None, WEIGHTS])
@pytest.mark.parametrize("scale", [1.0, 1e4])
def test_loss_and_gradient_agree_with_torch_autograd(weights, scale):
    logits, labels = batch(seed=1)
    logits = (scale * logits).requires_grad_()
    loss = torch.nn.functional.cross_entropy(
        logits,
        labels,
        weight=None if weights is None else torch.from_numpy(weights),
        ignore_index=255,
        reduction="sum",
    )
    loss.backward()
    z, y = channels_last(logits), labels.numpy()
    assert losses.cross_entropy(z, y, weights) == pytest.approx(loss.item(), rel=1e-12)
    np.testing.assert_allclose(losses.cross_entropy_grad(z, y, weights), channels_last(logits.grad), atol=1e-12)


@pytest.mark.bad_input
@pytest.mark.parametrize("function", [losses.cross_entropy, losses.cross_entropy_grad])
@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("z", {"z": np.full((2, 3, 4), np.nan)}),
        ("z", {"z": np.full((2, 3, 4), np.inf)}),
        ("z", {"z": np.zeros((2, 3, 4), complex)}),
        ("z", {"z": np.zeros((2, 3, 0))}),
        ("z", {"z": np.float64(1.0)}),
        ("y", {"y": np.zeros((3, 2), int)}),
        ("y", {"y": np.zeros((2, 3, 4), int)}),
        ("y", {"y": np.zeros((2, 3))}),
        ("y", {"y": np.full((2, 3), 4)}),
        ("y", {"y": np.full((2, 3), -1)}),
        ("weights", {"weights": np.ones(3)}),
        ("weights", {"weights": np.array([1.0, 1.0, 0.0, 1.0])}),
        ("weights", {"weights": np.array([1.0, 1.0, -2.0, 1.0])}),
        ("weights", {"weights": np.array([1.0, 1.0, np.inf, 1.0])}),
    ],
)
def test_loss_and_gradient_name_the_argument_that_is_wrong(function, name, change):
    good = {"z": np.zeros((2, 3, 4)), "y": np.zeros((2, 3), int), "weights": WEIGHTS}
    with pytest.raises(ValueError, match=f"^{name}: expected"):
        function(**(good | change))


@pytest.mark.bad_input
@pytest.mark.parametrize("function", [losses.softmax, losses.log_softmax])
def test_softmax_names_logits_that_are_nan(function):
    with pytest.raises(ValueError, match=r"^z: expected finite numbers, got 1 NaN"):
        function(np.array([0.0, np.nan]))


# Class weights


counts = hnp.arrays(np.int64, st.integers(1, 6), elements=st.integers(0, 10**6)).filter(np.any)


@untimed
@given(counts, st.sampled_from(list(losses.SCHEMES)))
def test_the_mean_weight_of_the_counted_pixels_is_one(n, scheme):
    w = losses.class_weights(n, scheme)
    assert (w > 0).all() and np.isfinite(w).all()
    assert (n @ w) / n.sum() == pytest.approx(1.0)


@untimed
@given(counts)
def test_weights_follow_their_scheme_and_a_class_without_pixels_gets_one(n):
    present = n > 0
    assert losses.class_weights(n, "none").tolist() == [1.0] * n.size
    for scheme, power in (("inverse", 1.0), ("sqrt", 0.5)):
        w = losses.class_weights(n, scheme)
        np.testing.assert_allclose(w[present] * n[present] ** power, (w * n**power)[present][0])
        assert (w[~present] == 1.0).all()
        np.testing.assert_allclose(losses.class_weights(n[present], scheme), w[present])


def test_inverse_weights_are_those_that_scikit_learn_calls_balanced():
    y = np.random.default_rng(0).choice(4, size=5000, p=[0.6, 0.3, 0.01, 0.09])
    peer = compute_class_weight("balanced", classes=np.arange(4), y=y)
    np.testing.assert_allclose(losses.class_weights(np.bincount(y), "inverse"), peer)


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("name", "n", "scheme"),
    [
        ("counts", np.array([3, -1]), "none"),
        ("counts", np.zeros(4, int), "sqrt"),
        ("counts", np.zeros(0, int), "sqrt"),
        ("counts", np.ones((2, 2)), "sqrt"),
        ("counts", np.array([1.0, np.nan]), "sqrt"),
        ("scheme", np.array([3, 1]), "squared"),
    ],
)
def test_class_weights_name_the_argument_that_is_wrong(name, n, scheme):
    with pytest.raises(ValueError, match=f"^{name}: expected"):
        losses.class_weights(n, scheme)


# Problem 5: what weights do


def test_a_weight_scales_the_gradient_of_its_true_class_by_exactly_itself():
    rng = np.random.default_rng(0)
    z, y = rng.normal(size=(20, 30, 4)), rng.integers(0, 4, (20, 30))
    plain, weighted = losses.cross_entropy_grad(z, y), losses.cross_entropy_grad(z, y, WEIGHTS)
    for c in range(4):
        np.testing.assert_array_equal(weighted[y == c], WEIGHTS[c] * plain[y == c])


def test_gradient_descent_on_the_weighted_loss_ends_at_the_weighted_optimum():
    # Pixels that look alike share their logits; of a hundred, the classes are true this often.
    often = np.array([70, 24, 1, 5])
    y = np.repeat(np.arange(4), often)
    z = np.zeros(4)
    for _ in range(200):
        everywhere = np.broadcast_to(z, (100, 4))
        z = z - 0.02 * losses.cross_entropy_grad(everywhere, y, WEIGHTS).sum(axis=0)
    q = losses.weighted_optimum(often / 100, WEIGHTS)
    np.testing.assert_allclose(losses.softmax(z), q, atol=1e-10)
    assert np.abs(q - often / 100).max() > 0.1  # which is not where the data are


@untimed
@given(hnp.arrays(np.float64, 4, elements=st.floats(0.01, 1.0)), hnp.arrays(np.float64, 4, elements=st.floats(0.1, 50)))
def test_the_weighted_optimum_has_no_gradient_and_dividing_by_the_weights_undoes_it(p, w):
    p = p / p.sum()
    q = losses.weighted_optimum(p, w)
    expected_grad = sum(p[c] * losses.cross_entropy_grad(np.log(q), np.asarray(c), w) for c in range(4))
    np.testing.assert_allclose(expected_grad, 0.0, atol=1e-11)
    np.testing.assert_allclose(losses.weighted_optimum(q, 1 / w), p, atol=1e-12)
    np.testing.assert_allclose(losses.weighted_optimum(p, np.full(4, 7.0)), p, atol=1e-12)


def test_a_heavier_class_gains_recall_and_loses_precision():
    # Mistake 24, "weights always help". A rare and a common class with Gaussian features, decided at the optimum.
    x = np.linspace(-6.0, 8.0, 4001)
    density = np.stack([0.95 * np.exp(-(x**2) / 2), 0.05 * np.exp(-((x - 2.0) ** 2) / 2)], axis=-1)
    density /= density.sum()
    posterior = density / density.sum(axis=-1, keepdims=True)
    scores = []
    for weight in (1.0, 3.0, 10.0, 30.0):
        decided = losses.weighted_optimum(posterior, np.array([1.0, weight])).argmax(axis=-1)
        n = np.stack([density[decided == j].sum(axis=0) for j in range(2)], axis=1)
        precision, recall = metrics.precision_recall(n)
        scores.append((precision[1], recall[1], metrics.iou(n)[1]))
    precision, recall, iou = np.array(scores).T
    assert (np.diff(recall) > 0).all()
    assert (np.diff(precision) < 0).all()
    assert 0 < iou.argmax() < 3  # a weight in between is the best for IoU


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("name", "p", "w"),
    [
        ("p", np.array([0.5, 0.6]), np.ones(2)),
        ("p", np.array([1.5, -0.5]), np.ones(2)),
        ("p", np.array([np.nan, 1.0]), np.ones(2)),
        ("p", np.float64(1.0), np.ones(1)),
        ("w", np.array([0.5, 0.5]), np.ones(3)),
        ("w", np.array([0.5, 0.5]), np.array([1.0, 0.0])),
    ],
)
def test_weighted_optimum_names_the_argument_that_is_wrong(name, p, w):
    with pytest.raises(ValueError, match=f"^{name}: expected"):
        losses.weighted_optimum(p, w)


# The loss to train with


@pytest.mark.parametrize("weights", [None, WEIGHTS, torch.from_numpy(WEIGHTS).float(), WEIGHTS.tolist()])
@pytest.mark.parametrize("dtype", [torch.uint8, torch.int32, torch.int64])
def test_the_training_loss_is_the_texts_sum_over_the_number_of_counted_pixels(weights, dtype):
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


def test_the_training_loss_passes_torchs_own_gradient_check():
    logits, labels = batch(seed=3, N=1, H=2, W=3)
    assert torch.autograd.gradcheck(
        lambda z: losses.segmentation_loss(z, labels, WEIGHTS), logits.clone().requires_grad_()
    )


def test_torchs_weighted_mean_divides_by_the_sum_of_weights_and_the_kits_by_the_number_of_pixels():
    # Mistake 22.
    logits, labels = batch(seed=4)
    torchs = torch.nn.CrossEntropyLoss(weight=torch.from_numpy(WEIGHTS), ignore_index=255)(logits, labels)
    y = labels[labels != 255].numpy()
    kits = losses.segmentation_loss(logits, labels, WEIGHTS)
    assert kits.item() * y.size == pytest.approx(torchs.item() * WEIGHTS[y].sum())
    assert abs(kits.item() / torchs.item() - 1) > 0.5
    # Without weights the two are one.
    plain = torch.nn.CrossEntropyLoss(ignore_index=255)(logits, labels)
    assert losses.segmentation_loss(logits, labels).item() == pytest.approx(plain.item())


def test_weights_cancel_in_torchs_mean_of_one_class_but_not_in_the_kits():
    # Mistake 23.
    logits, _ = batch(seed=5)
    labels = torch.full((2, 5, 7), 2)
    torchs = [torch.nn.CrossEntropyLoss(weight=w)(logits, labels) for w in (None, torch.from_numpy(WEIGHTS))]
    assert torchs[0].item() == pytest.approx(torchs[1].item())
    plain, weighted = losses.segmentation_loss(logits, labels), losses.segmentation_loss(logits, labels, WEIGHTS)
    assert weighted.item() == pytest.approx(WEIGHTS[2] * plain.item())


def test_with_class_weights_of_the_same_pixels_the_two_normalisations_meet():
    logits, labels = batch(seed=6)
    weights = losses.class_weights(np.bincount(labels[labels != 255].numpy(), minlength=4), "inverse")
    torchs = torch.nn.CrossEntropyLoss(weight=torch.from_numpy(weights), ignore_index=255)(logits, labels)
    assert losses.segmentation_loss(logits, labels, weights).item() == pytest.approx(torchs.item())


def steps_of(optimiser, factor):
    """Train a linear network for 20 steps with all class weights multiplied by `factor`; return its parameters."""
    generator = torch.Generator().manual_seed(0)
    network = torch.nn.Conv2d(3, 4, 1, dtype=torch.float64)
    for parameter in network.parameters():
        parameter.data = torch.randn(parameter.shape, generator=generator, dtype=torch.float64)
    image = torch.randn(2, 3, 5, 7, generator=generator, dtype=torch.float64)
    labels = torch.randint(0, 4, (2, 5, 7), generator=generator)
    optimiser = optimiser(network.parameters())
    for _ in range(20):
        optimiser.zero_grad()
        losses.segmentation_loss(network(image), labels, factor * WEIGHTS).backward()
        optimiser.step()
    return torch.cat([parameter.detach().ravel() for parameter in network.parameters()])


def test_adam_cancels_a_common_factor_of_all_weights_and_plain_descent_does_not():
    def adam(parameters):
        return torch.optim.Adam(parameters, lr=0.05, eps=1e-30)

    def descent(parameters):
        return torch.optim.SGD(parameters, lr=0.001)

    start = steps_of(lambda parameters: torch.optim.SGD(parameters, lr=0.0), 1.0)
    torch.testing.assert_close(steps_of(adam, 1000.0), steps_of(adam, 1.0), rtol=1e-9, atol=1e-9)
    assert (steps_of(adam, 1.0) - start).abs().max() > 0.1
    assert (steps_of(descent, 10.0) - start).norm() > 3 * (steps_of(descent, 1.0) - start).norm()


def test_low_precision_logits_are_reduced_in_float32_and_added_up_in_float64():
    logits, labels = batch(seed=7, N=4, H=120, W=160)
    exact = losses.segmentation_loss(logits.bfloat16().double(), labels, WEIGHTS)
    loss = losses.segmentation_loss(logits.bfloat16(), labels, WEIGHTS)
    assert loss.dtype == torch.float32
    assert loss.item() == pytest.approx(exact.item(), rel=3e-7)
    memory_format = logits.float().to(memory_format=torch.channels_last)
    assert losses.segmentation_loss(memory_format, labels).item() == pytest.approx(
        losses.segmentation_loss(logits, labels).item(), rel=1e-6
    )


def test_a_batch_of_ignored_pixels_trains_nothing():
    logits, labels = batch(seed=8, share_ignored=1.0)
    logits.requires_grad_()
    loss = losses.segmentation_loss(logits, labels, WEIGHTS)
    loss.backward()
    assert loss.item() == 0.0
    assert not logits.grad.any()


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("logits", {"logits": torch.full((1, 4, 2, 3), torch.nan)}),
        ("logits", {"logits": torch.full((1, 4, 2, 3), torch.inf)}),
        ("logits", {"logits": torch.zeros(4, 2, 3)}),
        ("labels", {"labels": torch.zeros((1, 3, 2), dtype=torch.int64)}),
        ("labels", {"labels": torch.zeros((1, 2, 3))}),
        ("labels", {"labels": torch.zeros((1, 2, 3), dtype=torch.bool)}),
        ("labels", {"labels": torch.full((1, 2, 3), 4)}),
        ("labels", {"labels": torch.full((1, 2, 3), -100)}),
        ("weights", {"weights": torch.ones(3)}),
        ("weights", {"weights": np.array([1.0, 0.0, 1.0, 1.0])}),
    ],
)
def test_the_training_loss_names_the_argument_that_is_wrong(name, change):
    good = {"logits": torch.zeros(1, 4, 2, 3), "labels": torch.zeros((1, 2, 3), dtype=torch.int64), "weights": WEIGHTS}
    with pytest.raises(ValueError, match=f"^{name}: expected"):
        losses.segmentation_loss(**(good | change))


def test_nan_at_an_ignored_pixel_is_found_before_it_reaches_the_gradient():
    logits, labels = batch(seed=9)
    n, v, u = (labels == 255).nonzero()[0]
    logits[n, 0, v, u] = torch.nan
    with pytest.raises(ValueError, match=r"^logits: expected finite"):
        losses.segmentation_loss(logits, labels)
