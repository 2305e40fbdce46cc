"""The references of lab 07 equal the kit's functions, and what its questions accept is really a right answer."""

import numpy as np
from scipy.spatial.transform import Rotation

from labkit import geometry, grasp
from labkit.course.questions.question import of_topic
from labkit.course.questions.t07_grasp import cloud
from labkit.grasp.planner import HAND_MARGIN, TIP_CLEARANCE

QUESTIONS = of_topic("07_grasp")
HAND = grasp.Gripper()


def clouds(count=20):
    rng = np.random.default_rng(7)
    return [cloud(rng) for _ in range(count)]


def reference(name):
    return QUESTIONS[name].reference


def test_centroid_and_covariance_equals_the_kits():
    for P in clouds():
        for mine, kits in zip(
            reference("centroid_and_covariance")(P), geometry.centroid_and_covariance(P), strict=True
        ):
            np.testing.assert_allclose(mine, kits, rtol=1e-12)


def test_yaw_height_and_pose_together_are_the_kits_grasp_by_the_principal_axis():
    for P in clouds():
        for table_z in (P[:, 2].min() - 0.02, P[:, 2].min() + 0.001):
            mu, Sigma = reference("centroid_and_covariance")(P)
            palm = HAND.palm_above_tips - HAND_MARGIN
            z = reference("grasp_height")(P, table_z, palm, HAND.tips_below_grasp, TIP_CLEARANCE)
            T = reference("grasp_pose")(np.array([mu[0], mu[1], z]), reference("closing_yaw")(Sigma))
            kits = grasp.principal_axis_grasp(P, table_z).T_base_grasp
            same = QUESTIONS["grasp_pose"].canonical
            for a, b in zip(same(T), same(kits), strict=True):
                np.testing.assert_allclose(a, b, atol=1e-9)


def test_the_width_is_the_extent_in_x_of_the_cloud_turned_back_by_the_yaw():
    for number, P in enumerate(clouds()):
        yaw = 0.15 * number
        turned = Rotation.from_euler("z", -yaw).apply(P)
        assert np.isclose(reference("width_across")(P, yaw), np.ptp(turned[:, 0]))


def test_points_in_fingers_equals_boxes_in_the_kits_grasp_frame():
    rng = np.random.default_rng(3)
    found = 0
    for _ in range(10):
        P, T, width, half, thickness, tips = QUESTIONS["points_in_fingers"].inputs(rng)
        p = geometry.transform_points(geometry.invert_transform(T), P)
        left, right = (
            (abs(p[:, 0]) <= half) & (p[:, 1] >= low) & (p[:, 1] <= low + thickness) & (p[:, 2] <= tips)
            for low in (-width / 2 - thickness, width / 2)
        )
        count = reference("points_in_fingers")(P, T, width, half, thickness, tips)
        assert count == left.sum() + right.sum()
        found += count
    assert found > 20


def test_each_bound_of_the_height_is_the_one_that_counts_in_some_case():
    rng = np.random.default_rng(0)
    counts = set()
    for P, table_z, palm, _, clearance in (QUESTIONS["grasp_height"].inputs(rng) for _ in range(30)):
        counts.add(int(np.argmax([P[:, 2].max() - palm, P[:, 2].min(), table_z + clearance])))
    assert counts == {0, 1, 2}
