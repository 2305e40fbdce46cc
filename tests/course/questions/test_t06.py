"""The references of topic 06 are the kit's own geometry, and the simulator's K."""

import numpy as np

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


def test_the_height_noise_by_hand():
    """Looking down only depth counts; looking level a pixel down is d / fy, and depth lifts the point along its ray."""
    by_hand = [QUESTIONS["height_noise"].reference(*arguments) for arguments in QUESTIONS["height_noise"].by_hand]
    np.testing.assert_allclose(by_hand, [0.01, np.hypot(0.5 * 0.125, 0.25 * 0.01), 0.5 * 0.02], rtol=1e-12)
