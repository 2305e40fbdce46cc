"""The references of topic 06 are the kit's own geometry, and the simulator's K."""

import numpy as np
import pytest

from labkit import geometry
from labkit.course.questions.question import of_topic
from labkit.sim import world

QUESTIONS = of_topic("06_back_projection")


def height_noise(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth):
    R = T_base_cam[:3, :3]
    Sigma = R @ geometry.back_projection_noise(u, v, d, K, sigma_pixel, sigma_depth) @ R.T
    return np.sqrt(Sigma[2, 2])


KIT = {
    "intrinsics": world.intrinsics,
    "back_project": geometry.back_project,
    "transform_points": geometry.transform_points,
    "back_projection_jacobian": geometry.back_projection_jacobian,
    "height_noise": height_noise,
}


@pytest.mark.parametrize("name", KIT)
def test_the_reference_is_the_kits_function(name):
    question = QUESTIONS[name]
    drawn = [question.inputs(np.random.default_rng(seed)) for seed in range(20)]
    for arguments in (*question.by_hand, *drawn):
        np.testing.assert_allclose(question.reference(*arguments), KIT[name](*arguments), rtol=1e-6, atol=1e-6)


def test_every_blank_has_the_kits_function_beside_it():
    assert QUESTIONS.keys() == KIT.keys()


def test_the_height_noise_by_hand():
    """Looking down only depth counts; looking level a pixel down is d / fy, and depth lifts the point along its ray."""
    by_hand = [QUESTIONS["height_noise"].reference(*arguments) for arguments in QUESTIONS["height_noise"].by_hand]
    np.testing.assert_allclose(by_hand, [0.01, np.hypot(0.5 * 0.125, 0.25 * 0.01), 0.5 * 0.02], rtol=1e-12)
