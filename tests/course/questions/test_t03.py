"""The references of 03_gradient are the kit's functions, and agree with SciPy, autograd and a real network."""

import numpy as np
import pytest
import scipy.special
import torch

from labkit import losses
from labkit.course.questions import t03_gradient as t03
from labkit.course.questions.question import of_topic
from labkit.network import SmallSegNet


@pytest.mark.parametrize("seed", range(3))
def test_softmax_and_log_sum_exp_are_the_kits_and_scipys(seed):
    z = t03.random_logits(np.random.default_rng(seed))
    np.testing.assert_allclose(t03.softmax(z), losses.softmax(z), rtol=1e-12)
    np.testing.assert_allclose(t03.log_sum_exp(z), scipy.special.logsumexp(z, axis=-1), rtol=1e-12)
    np.testing.assert_allclose(z - t03.log_sum_exp(z)[..., None], losses.log_softmax(z), atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_loss_and_gradient_are_the_kits(seed):
    z, y = t03.random_pixels(np.random.default_rng(seed))
    assert t03.cross_entropy(z, y) == pytest.approx(losses.cross_entropy(z, y), rel=1e-12)
    np.testing.assert_allclose(t03.cross_entropy_grad(z, y), losses.cross_entropy_grad(z, y), atol=1e-14)


def test_central_differences_of_a_small_step_are_the_kits_gradient():
    z, y, _ = t03.draw_pixel(np.random.default_rng(0))
    kits = losses.cross_entropy_grad(z, np.asarray(y))
    np.testing.assert_allclose(t03.numerical_grad(z, y, 1e-5), kits, atol=1e-9)
    assert np.abs(t03.numerical_grad(z, y, 1.0) - kits).max() > 1e-3


def test_the_receptive_field_of_smallsegnet_is_that_of_its_gradient():
    torch.manual_seed(0)
    network, x = SmallSegNet(), torch.rand(64, 3, 40, 44, requires_grad=True)
    network(x)[:, :, 20, 24].sum().backward()  # many images: each takes other paths through the max pooling
    rows, columns = (np.flatnonzero(x.grad.abs().sum(dim=(0, 1)).sum(dim=axis)) for axis in (1, 0))
    computed = t03.receptive_field(np.array([3, 2, 3, 2, 3]), np.array([1, 2, 1, 2, 1]))
    assert np.ptp(rows) + 1 == np.ptp(columns) + 1 == computed == 18


def test_the_topic_has_its_questions():
    questions = of_topic("03_gradient")
    assert 3 <= len(questions) <= 6
    for question in questions.values():
        assert len(question.misconceptions) >= 5 and len(question.alternatives) >= 3
