"""Where the kit has the function that a lab asks for, the reference of the question gives what the kit gives.

That references are right is said by tests/alternatives: each question has several answers written otherwise, with
PyTorch, SciPy, OpenCV or loops.
"""

import re
import warnings

import numpy as np
import pytest
from notebooks import ROOT, notebook

from labcourse.questions.t07_grasp import cloud
from labcourse.stacks import regions
from labgrader.course import find
from labgrader.reply.judge import judge
from labkit import geometry, grasp, labels, losses, metrics
from labkit.crf import PottsCRF
from labkit.grasp.planner import HAND_MARGIN, TIP_CLEARANCE
from labkit.node import convert
from labkit.node.messages import Header, Image


def pair_weights(image, *settings):
    return PottsCRF.from_image(np.zeros((*image.shape[:2], 2)), image, *settings, connectivity=8).weights


def back_project(depth, K, along_ray):
    P = geometry.back_project(depth, K)
    return P / np.linalg.norm(geometry.pixel_rays(depth.shape, K), axis=-1, keepdims=True) if along_ray else P


def height_noise(u, v, d, K, T_base_cam, sigma_pixel, sigma_depth, sigma_tilt):
    """The kit's noise of a point, and what a turn by a ten-thousandth of a radian changes."""
    c, s = np.cos(1e-4), np.sin(1e-4)
    P, tilt = d * np.linalg.inv(K) @ (u, v, 1.0), np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    moved = (tilt @ P - tilt.T @ P) / 2e-4
    Sigma = geometry.back_projection_noise(u, v, d, K, sigma_pixel, sigma_depth) + sigma_tilt**2 * np.outer(
        moved, moved
    )
    return np.sqrt(T_base_cam[2, :3] @ Sigma @ T_base_cam[2, :3])


def decode_depth(data, height, width, step, is_bigendian):
    depth = convert.depth_image(Image(Header(), height, width, "16UC1", is_bigendian, step, data.tobytes()))
    return np.where(depth > 0.0, depth, np.nan)


def softmax(z, possible):
    """The kit's softmax of the possible classes alone, 0 at the places of the others."""
    p = np.zeros_like(z)
    p[..., possible] = losses.softmax(z[..., possible])
    return p


def smoothed(of_labels, z, y, s):
    """What the kit gives for the labels, and for each class in its turn, in the shares of a smoothed target."""
    C = z.shape[-1]
    return (1.0 - s) * of_labels(z, y) + s / C * sum(of_labels(z, np.where(y == 255, y, c)) for c in range(C))


KIT = {
    "01_labels.one_hot": lambda y, C: np.stack([np.moveaxis(labels.one_hot(image, C), -1, 0) for image in y]),
    "02_crf.pair_weights": pair_weights,
    # The kit asks for two classes at least; one more that no pixel has costs nothing.
    "02_crf.energy": lambda y, psi, weights: PottsCRF(
        np.pad(psi, ((0, 0), (0, 0), (0, psi.shape[2] == 1))), weights
    ).energy(y),
    "03_gradient.softmax": softmax,
    "03_gradient.cross_entropy": lambda z, y, s: smoothed(losses.cross_entropy, z, y, s),
    "03_gradient.cross_entropy_grad": lambda z, y, s: smoothed(losses.cross_entropy_grad, z, y, s),
    "04_iou.confusion_matrix": metrics.confusion_matrix,
    "04_iou.iou": metrics.iou,
    "04_iou.mean_iou": lambda n_frames: metrics.mean_iou(n_frames.sum(axis=0)),
    "04_iou.jackknife": lambda n_frames: metrics.mean_iou(n_frames.sum(axis=0)),
    "06_back_projection.back_project": back_project,
    "06_back_projection.height_noise": height_noise,
    "08_node.decode_depth": decode_depth,
    "09_other_stacks.measure_pieces": lambda pieces: regions.region_properties(pieces).area,
}


@pytest.mark.parametrize("name", KIT)
def test_a_reference_gives_what_the_kit_gives(name):
    question = find(name)
    for arguments in (*question.by_hand, *question.draws(np.random.default_rng(0), 5)):
        found = question.reference(*arguments)
        found = found[0] if isinstance(found, tuple) else found
        np.testing.assert_allclose(found, KIT[name](*arguments), rtol=1e-5, atol=1e-12)


def test_colours_are_the_kits():
    y = np.random.default_rng(0).integers(0, 4, (5, 7)).astype(np.uint8)
    y[2, 3] = 255
    assert np.array_equal(find("01_labels.labels_from_colours").reference(labels.colorize(y), labels.PALETTE), y)


@pytest.mark.parametrize("scheme, power", [("none", 0.0), ("sqrt", 0.5), ("inverse", 1.0)])
def test_class_weights_are_the_kits(scheme, power):
    counts, reference = np.array([5000, 70, 1, 333]), find("05_class_weights.class_weights").reference
    np.testing.assert_allclose(reference(counts, power), losses.class_weights(counts, scheme))


def test_yaw_height_and_pose_together_are_the_kits_grasp_by_the_principal_axis():
    rng, hand, pose = np.random.default_rng(7), grasp.Gripper(), find("07_grasp.grasp_pose")
    for P in (cloud(rng) for _ in range(20)):
        for table_z in (P[:, 2].min() - 0.02, P[:, 2].min() + 0.001):
            mu, Sigma = geometry.centroid_and_covariance(P)
            lengths = hand.palm_above_tips - HAND_MARGIN, hand.tips_below_grasp, TIP_CLEARANCE
            z = find("07_grasp.grasp_height").reference(P, table_z, *lengths)
            yaw = find("07_grasp.closing_yaw").reference(Sigma, 0.0)
            closing, down = np.array([np.cos(yaw), np.sin(yaw), 0.0]), np.array([0.0, 0.0, -1.0])
            T = pose.reference(np.array([mu[0], mu[1], z]), down, closing)
            kits = grasp.principal_axis_grasp(P, table_z).T_base_grasp
            for a, b in zip(pose.canonical(T), pose.canonical(kits), strict=True):
                np.testing.assert_allclose(a, b, atol=1e-9)


# -------------------------------------------------------------------------------- what questions take, and refuse


def test_the_open_task_of_lab_02_leaves_something_to_win():
    """As the solution shows it: ICM, which is to be beaten, stops well above the bound."""
    cells = notebook(ROOT / "solutions/02_crf/02_crf.ipynb").cells
    table = next(cell.outputs[-1].data["text/plain"] for cell in cells if 'score("ICM"' in cell.source)
    assert float(re.search(r"ICM +([\d.]+)% above", table)[1]) > 5.0


@pytest.mark.parametrize("seed", range(5))
def test_undoing_a_lens_by_guesses_that_stop_too_early_is_refused(seed):
    def twelve_rounds(pixels, K, k):
        seen = ideal = (pixels - K[:2, 2]) / np.diagonal(K)[:2]
        for _ in range(12):
            r2 = (ideal**2).sum(axis=1, keepdims=True)
            ideal = seen / (1.0 + k[0] * r2 + k[1] * r2**2)
        return K[:2, 2] + np.diagonal(K)[:2] * ideal

    assert not judge(find("06_back_projection.undistort"), twelve_rounds, seed).passed


def test_looking_for_a_hint_warns_of_nothing():
    """`canonical` multiplies what wrong outputs hold, infinity and 0 among it."""

    def closing_not_square_to_the_approach(position, approach, closing):
        y, z = (v / np.linalg.norm(v) for v in (closing - (closing @ approach) * approach, approach))
        x = np.cross(y, z)
        return np.vstack([np.column_stack([x / np.linalg.norm(x), y, z, position]), np.eye(4)[3]])

    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        assert judge(find("07_grasp.grasp_pose"), closing_not_square_to_the_approach, seed=0).hint
    assert not told
