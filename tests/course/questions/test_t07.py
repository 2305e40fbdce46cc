"""The references of lab 07 equal the kit's functions, and what its questions accept is really a right answer."""

import numpy as np
import pytest

from labkit import geometry, grasp
from labkit.course.questions.judge import plain
from labkit.course.questions.question import of_topic
from labkit.course.questions.t07_hand import cloud
from labkit.grasp.measure_kernels import turn
from labkit.grasp.planner import HAND_MARGIN, TIP_CLEARANCE

QUESTIONS = of_topic("07_grasp")
HAND = grasp.Gripper()


def clouds(count=20):
    rng = np.random.default_rng(7)
    return [cloud(rng) for _ in range(count)]


def reference(name):
    return QUESTIONS[name].reference


def test_the_questions_are_in_the_labs_order():
    assert list(QUESTIONS) == [
        "centroid_and_covariance",
        "closing_yaw",
        "width_across",
        "grasp_height",
        "grasp_pose",
        "points_in_fingers",
    ]


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


def test_the_width_equals_that_of_the_planners_kernel():
    for number, P in enumerate(clouds()):
        yaw, turned = 0.15 * number, np.empty_like(P)
        turn(P, 0.5, 0.1, yaw, 0.0, turned)
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


@pytest.mark.parametrize("turn_by, same", [(np.pi, True), (-np.pi, True), (np.pi / 2, False), (0.1, False)])
def test_half_a_turn_of_the_jaws_is_the_same_answer_and_no_other_turn_is(turn_by, same):
    question = QUESTIONS["closing_yaw"]
    assert np.allclose(question.canonical(0.4), question.canonical(0.4 + turn_by), atol=1e-9) == same
    question, position = QUESTIONS["grasp_pose"], np.array([0.5, 0.1, 0.02])
    a, b = (question.canonical(question.reference(position, yaw)) for yaw in (0.4, 0.4 + turn_by))
    assert all(np.allclose(x, y, atol=1e-9) for x, y in zip(a, b, strict=True)) == same


def test_a_mirror_image_of_the_grasp_frame_is_another_answer():
    question = QUESTIONS["grasp_pose"]
    T = question.reference(np.array([0.5, 0.1, 0.02]), 0.4)
    mirrored = T @ np.diag([-1.0, 1.0, 1.0, 1.0])
    assert not np.allclose(question.canonical(T)[0], question.canonical(mirrored)[0])


@pytest.mark.parametrize("name", QUESTIONS)
def test_wrong_answers_differ_from_the_reference_right_ones_do_not(name):
    question = QUESTIONS[name]
    rng = np.random.default_rng(1)
    cases = [*question.by_hand, *(question.inputs(rng) for _ in range(question.random_cases))]

    def agrees(answer, args):
        try:
            with np.errstate(all="ignore"):
                outputs = [question.canonical(plain(f(*args))) for f in (question.reference, answer)]
            a, b = (out if isinstance(out, tuple) else (out,) for out in outputs)
            pairs = [(np.asarray(x, float), np.asarray(y, float)) for x, y in zip(a, b, strict=True)]
            return all(x.shape == y.shape and np.allclose(x, y, question.rtol, question.atol) for x, y in pairs)
        except (IndexError, TypeError, ValueError):
            return False

    for wrong in question.misconceptions:
        assert not all(agrees(wrong.answer, args) for args in cases), wrong.name
    for right in question.alternatives:
        assert all(agrees(right, args) for args in cases), right.__name__
    for args in cases:
        for prop in question.properties:
            assert prop.holds(args, question.reference(*args)), prop.says
