"""The references of lab 07 equal the kit's functions, and what its questions accept is really a right answer."""

import warnings

import numpy as np
from scipy.spatial.transform import Rotation

from labkit import geometry, grasp
from labkit.course.checker.run import judge
from labkit.course.topics import of_topic
from labkit.course.topics.t07_grasp import cloud
from labkit.grasp.planner import HAND_MARGIN, TIP_CLEARANCE

QUESTIONS = of_topic("07_grasp")
HAND = grasp.Gripper()


def clouds(count=20):
    rng = np.random.default_rng(7)
    return [cloud(rng) for _ in range(count)]


def reference(name):
    return QUESTIONS[name].reference


def test_yaw_height_and_pose_together_are_the_kits_grasp_by_the_principal_axis():
    for P in clouds():
        for table_z in (P[:, 2].min() - 0.02, P[:, 2].min() + 0.001):
            mu, Sigma = geometry.centroid_and_covariance(P)
            palm = HAND.palm_above_tips - HAND_MARGIN
            z = reference("grasp_height")(P, table_z, palm, HAND.tips_below_grasp, TIP_CLEARANCE)
            yaw = reference("closing_yaw")(Sigma)
            closing, down = np.array([np.cos(yaw), np.sin(yaw), 0.0]), np.array([0.0, 0.0, -1.0])
            T = reference("grasp_pose")(np.array([mu[0], mu[1], z]), down, closing)
            kits = grasp.principal_axis_grasp(P, table_z).T_base_grasp
            same = QUESTIONS["grasp_pose"].canonical
            for a, b in zip(same(T), same(kits), strict=True):
                np.testing.assert_allclose(a, b, atol=1e-9)


def test_the_closing_axis_is_the_one_of_the_hands_plane_that_is_nearest_to_what_was_asked_for():
    rng = np.random.default_rng(1)
    for _ in range(10):
        _, approach, closing = arguments = QUESTIONS["grasp_pose"].inputs(rng)
        T = reference("grasp_pose")(*arguments)
        fan = np.linspace(0.0, 2.0 * np.pi, 3600)
        plane = np.outer(np.cos(fan), T[:3, 0]) + np.outer(np.sin(fan), T[:3, 1])
        np.testing.assert_allclose(plane[(plane @ closing).argmax()], T[:3, 1], atol=2e-3)
        assert np.allclose(plane @ approach, 0.0, atol=1e-12)


def test_a_slice_is_the_extent_of_the_points_that_the_pads_reach_when_the_hand_is_turned_back():
    rng = np.random.default_rng(2)
    for _ in range(20):
        P, T, half = QUESTIONS["pad_slice"].inputs(rng)
        turned = Rotation.from_matrix(T[:3, :3]).inv().apply(P - T[:3, 3])
        y = turned[np.abs(turned[:, 0]) <= half, 1]
        middle, width = reference("pad_slice")(P, T, half)
        assert np.isclose(width, np.ptp(y)) and np.isclose(middle + width / 2, y.max())


def test_jaws_that_move_by_what_they_push_are_off_by_the_slip_and_the_height_alone():
    rng = np.random.default_rng(4)
    for _ in range(20):
        T, middle = QUESTIONS["slip_across"].inputs(rng)
        pushed, slip = (mm / 1000.0 for mm in reference("slip_across")(T, middle))
        left = [middle - T[:3, 3] - sign * pushed * T[:3, 1] for sign in (-1.0, 1.0)]
        off = min(left, key=np.linalg.norm)
        assert np.isclose(abs(off @ T[:3, 1]), 0.0, atol=1e-12)
        assert np.isclose(np.sqrt(off @ off - (off @ T[:3, 2]) ** 2), slip)


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


def test_looking_for_a_hint_warns_of_nothing():
    """`canonical` multiplies what wrong outputs hold, infinity and 0 among it."""

    def closing_not_square_to_the_approach(position, approach, closing):
        y, z = (v / np.linalg.norm(v) for v in (closing - (closing @ approach) * approach, approach))
        x = np.cross(y, z)
        return np.vstack([np.column_stack([x / np.linalg.norm(x), y, z, position]), np.eye(4)[3]])

    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        assert judge(QUESTIONS["grasp_pose"], closing_not_square_to_the_approach, seed=0).hint
    assert not told
