"""The references of topic 05 against descent, PyTorch, sampling, and trying every weight."""

import numpy as np
import pytest
import torch
from references import drawn

from labkit import losses
from labkit.course.topics import of_topic

QUESTIONS = of_topic("05_class_weights")
SEEDS = pytest.mark.parametrize("seed", range(5))


@pytest.mark.parametrize("scheme, power", [("none", 0.0), ("sqrt", 0.5), ("inverse", 1.0)])
def test_weights_are_the_kits(scheme, power):
    counts = np.array([5000, 70, 1, 333])
    np.testing.assert_allclose(
        QUESTIONS["class_weights"].reference(counts, power), losses.class_weights(counts, scheme)
    )


@SEEDS
def test_both_means_are_those_of_torch(seed):
    two_means, (z, y, w) = drawn("05_class_weights.two_means", seed)
    logits, labels = torch.from_numpy(z).permute(2, 0, 1)[None], torch.from_numpy(y).long()[None]
    by_weights = torch.nn.functional.cross_entropy(logits, labels, torch.from_numpy(w), ignore_index=255).item()
    by_pixels = losses.cross_entropy(z, y, w) / np.count_nonzero(y != 255)
    np.testing.assert_allclose(two_means(z, y, w), (by_pixels, by_weights))


def test_a_promise_that_falls_on_a_pixel_is_kept_by_that_pixel():
    p1 = np.linspace(0.95, 0.05, 50)
    weight = QUESTIONS["weight_for_recall"].reference(p1, np.ones(50, bool), 0.28)  # in floats 0.28 * 50 is above 14
    assert weight == pytest.approx((1.0 - p1[13]) / p1[13])


@SEEDS
def test_no_other_decision_costs_less_on_the_average(seed):
    """A hundred thousand pixels of each kind: what each decision would have cost."""
    least_cost, (p, cost) = drawn("05_class_weights.least_cost", seed)
    rng = np.random.default_rng(seed)
    for often, said in zip(p[0], least_cost(p, cost)[0], strict=True):
        paid = cost[rng.choice(len(cost), 100_000, p=often)].mean(axis=0)
        assert paid[said] <= paid.min() * 1.02


@SEEDS
def test_the_weight_reaches_the_recall_and_a_smaller_one_does_not(seed):
    weight_for_recall, (p1, y, recall) = drawn("05_class_weights.weight_for_recall", seed)
    w = weight_for_recall(p1, y, recall)
    reached = [np.mean(v * p1[y] >= 1.0 - p1[y]) for v in (w * 1.000001, w * 0.999999)]
    assert reached[0] >= recall > reached[1]


@SEEDS
def test_the_adjusted_gradient_is_autograds(seed):
    adjusted_grad, (z, y, shares, tau) = drawn("05_class_weights.adjusted_grad", seed)
    t = torch.from_numpy(z).requires_grad_()
    a = (t + tau * torch.from_numpy(shares).log()).permute(2, 0, 1)[None]
    labels = torch.from_numpy(y).long()[None]
    torch.nn.functional.cross_entropy(a, labels, ignore_index=255, reduction="sum").backward()
    np.testing.assert_allclose(adjusted_grad(z, y, shares, tau), t.grad.numpy(), atol=1e-12)


def test_what_weighted_training_says_is_turned_into_bayes_rule_for_new_scenes():
    """By counting: two kinds of pixels, as they are seen in training and in use."""
    likelihood = np.array([[0.7, 0.3], [0.2, 0.8]])  # of the two kinds of pixels, per class
    shares, new_shares, w = np.array([0.9, 0.1]), np.array([0.4, 0.6]), np.array([1.0, 7.0])
    joints = [likelihood * prior[:, None] for prior in (shares, new_shares)]
    trained, used = ((joint / joint.sum(axis=0)).T for joint in joints)
    z = np.log(losses.weighted_optimum(trained, w))
    found = losses.softmax(QUESTIONS["change_prior"].reference(z, w, shares, new_shares))
    np.testing.assert_allclose(found, used, atol=1e-12)
