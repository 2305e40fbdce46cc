"""The references of 05_class_weights are the kit's functions, and agree with descent, integration and PyTorch."""

import numpy as np
import pytest
import torch
from scipy.special import ndtr

from labkit import losses
from labkit.course.questions import t05_class_weights as t05
from labkit.course.questions.question import of_topic
from labkit.labels import CLASSES
from labkit.network import SmallSegNet
from labkit.training import ImagesInMemory, undo_weights


@pytest.mark.parametrize(("scheme", "exponent"), losses.SCHEMES.items())
def test_class_weights_are_the_kits_under_every_scheme(scheme, exponent):
    for seed in range(3):
        counts, _ = t05.draw_counts(np.random.default_rng(seed))
        np.testing.assert_allclose(t05.class_weights(counts, -exponent), losses.class_weights(counts, scheme))


@pytest.mark.parametrize("seed", range(3))
def test_the_gradient_is_the_kits_and_the_means_are_the_kits_and_pytorchs(seed):
    z, y, w = t05.draw_pixels(np.random.default_rng(seed))
    np.testing.assert_allclose(t05.weighted_grad(z, y, w), losses.cross_entropy_grad(z, y, w), atol=1e-13)
    logits, labels = torch.from_numpy(z).permute(2, 0, 1)[None], torch.from_numpy(y.astype(np.int64))[None]
    kits = losses.segmentation_loss(logits, labels, w).item()
    torchs = torch.nn.CrossEntropyLoss(weight=torch.from_numpy(w), ignore_index=255)(logits, labels).item()
    assert t05.two_means(z, y, w) == pytest.approx((kits, torchs), rel=1e-12)
    assert kits == pytest.approx(losses.cross_entropy(z, y, w) / np.count_nonzero(y != 255))


@pytest.mark.parametrize("seed", range(3))
def test_the_optimum_is_the_kits_and_has_no_expected_gradient(seed):
    p, w = t05.draw_distributions(np.random.default_rng(seed))
    q = t05.weighted_optimum(p, w)
    np.testing.assert_allclose(q, losses.weighted_optimum(p, w), rtol=1e-12)
    labels = [np.full(p.shape[:-1], c, np.uint8) for c in range(len(w))]
    expected = sum(p[..., [c]] * t05.weighted_grad(np.log(q), y, w) for c, y in enumerate(labels))
    np.testing.assert_allclose(expected, 0.0, atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_the_boundary_costs_least_of_all_boundaries(seed):
    means, sigma, counts, w = t05.draw_gaussians(np.random.default_rng(seed))
    x = np.linspace(means.min() - 40.0, means.max() + 40.0, 2_000_001)
    missed = [ndtr((x - means[0]) / sigma), ndtr((x - means[1]) / sigma)]  # the mass below each boundary
    missed[int(means[0] < means[1]) - 1] = 1.0 - missed[int(means[0] < means[1]) - 1]
    cost = counts[0] * w[0] * missed[0] + counts[1] * w[1] * missed[1]
    place = t05.boundary(means, sigma, counts, w)
    assert np.interp(place, x, cost) <= cost.min() * (1 + 1e-6)
    ties = counts * w * np.exp(-((place - means) ** 2) / (2 * sigma**2))
    assert ties[0] == pytest.approx(ties[1], rel=1e-6)


def test_undoing_the_weights_is_what_the_kit_does_to_a_network(tmp_path):
    torch.manual_seed(0)
    network = SmallSegNet()
    rng = np.random.default_rng(0)
    images = [(rng.integers(0, 256, (8, 12, 3)).astype(np.uint8), np.full((8, 12), 1, np.uint8))]
    data = ImagesInMemory(images, len(CLASSES), progress=False)
    x = data.rgb.permute(0, 3, 1, 2).float() / 255.0
    with torch.no_grad():
        before = network(x)[0].permute(1, 2, 0).numpy()
    w = np.array([2.0, 0.01, 5.0, 1.0])
    share, _ = undo_weights(network, torch.from_numpy(w), data, len(CLASSES))
    with torch.no_grad():
        after = network(x)[0].permute(1, 2, 0).numpy()
    assert share > 0.0  # all pixels are of class 1, whose logit rises
    np.testing.assert_allclose(t05.undo_weights(before, w, share), after, atol=1e-5)


def test_undoing_the_weights_leads_back_from_the_weighted_optimum():
    p, w = t05.draw_distributions(np.random.default_rng(0))
    q = t05.weighted_optimum(p, w)
    np.testing.assert_allclose(losses.softmax(t05.undo_weights(np.log(q), w, 1.0)), p, rtol=1e-12)


def test_the_topic_has_its_questions():
    questions = of_topic("05_class_weights")
    assert 3 <= len(questions) <= 6
    for question in questions.values():
        assert len(question.misconceptions) >= 5 and len(question.alternatives) >= 3
