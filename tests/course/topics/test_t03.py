"""The references of 03_gradient are the kit's functions, and agree with SciPy, autograd and a real network."""

import numpy as np
import torch

from labkit.course.topics import of_topic
from labkit.learning.network import SmallSegNet

QUESTIONS = of_topic("03_gradient")
right = {name: question.reference for name, question in QUESTIONS.items()}


def test_the_ways_back_are_autograds():
    rng = np.random.default_rng(0)
    z, g = torch.tensor(rng.normal(size=(3, 4)), requires_grad=True), rng.normal(size=(3, 4))
    p = torch.softmax(z, dim=-1)
    p.backward(torch.tensor(g))
    assert np.allclose(right["softmax_backward"](p.detach().numpy(), g), z.grad)
    x, g = torch.tensor(rng.normal(size=(6, 8)), requires_grad=True), rng.normal(size=(3, 4))
    torch.nn.functional.max_pool2d(x[None], 2)[0].backward(torch.tensor(g))
    assert np.array_equal(right["max_pool_backward"](x.detach().numpy(), g), x.grad)


def test_a_window_is_what_a_network_depends_on():
    torch.manual_seed(0)
    x = torch.rand(64, 3, 48, 64, requires_grad=True)
    SmallSegNet()(x)[:, :, 24, 33].sum().backward()
    (columns,) = np.nonzero(x.grad.abs().sum(dim=(0, 1, 2)).numpy())
    layers = np.array([3, 2, 3, 2, 3]), np.array([1, 2, 1, 2, 1]), np.array([1, 0, 1, 0, 1])
    assert right["input_window"](*layers, 33 // 4) == (columns[0], columns[-1])
