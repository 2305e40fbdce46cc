"""The explorers of topic 06: what each bug does to a cloud, and that the noise drawn is the noise predicted."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from matplotlib.figure import Figure

from data_gen import render, sample_scene
from labcourse.explorers import back_projection as widgets
from labkit.frame import RGBDFrame
from labkit.geometry import back_project_to_base, back_projection_noise, transform_points
from labkit.labels import OBSTACLE, TARGET
from labkit.learning.channels import CHANNELS
from labkit.learning.network import TorchEngine, load_model, weights_path
from labkit.learning.view import rolled_camera

K = np.array([[60.0, 0.0, 33.0], [0.0, 66.0, 20.0], [0.0, 0.0, 1.0]])
# The camera stands at (1, 0.2, 0.8) and looks at the base, tilted down.
Z = np.array([-0.8, 0.0, -0.6])
X = np.array([0.0, 1.0, 0.0])
T_BASE_CAM = np.eye(4)
T_BASE_CAM[:3, :3] = np.stack([X, np.cross(Z, X), Z], axis=1)
T_BASE_CAM[:3, 3] = 1.0, 0.2, 0.8


@pytest.fixture
def frame():
    """A table, the plane z = 0, as the camera sees it, with a hole in its depth."""
    v, u = np.mgrid[0:48, 0:64]
    rays = np.stack([u, v, np.ones(u.shape)], axis=-1) @ np.linalg.inv(K).T @ T_BASE_CAM[:3, :3].T
    depth = (-0.8 / rays[..., 2]).astype(np.float32)
    depth[8:12] = 0.0
    labels = np.ones(depth.shape, np.uint8)
    labels[40:] = 0
    return RGBDFrame(np.zeros((48, 64, 3), np.uint8), depth, K, T_BASE_CAM, labels)


def test_without_a_bug_it_is_the_kits_cloud(frame):
    points = back_project_to_base(frame.depth, frame.K, frame.T_base_cam)[::4, ::4]
    seen = np.isfinite(points[..., 0]) & (frame.labels[::4, ::4] > 0)
    np.testing.assert_allclose(widgets.bent_cloud(frame), points[seen], atol=1e-5)
    assert 0 < seen.sum() < seen.size


def test_no_two_sets_of_bugs_bend_alike(frame):
    sets = [bugs for size in range(3) for bugs in combinations(widgets.BUGS, size)]
    for a, b in combinations(sets, 2):
        assert np.abs(widgets.bent_cloud(frame, a) - widgets.bent_cloud(frame, b)).max() > 0.01, (a, b)


def test_each_bug_does_what_the_lesson_says(frame):
    flat = widgets.bent_cloud(frame)
    assert np.abs(flat[:, 2]).max() < 1e-5  # the table is flat, at height 0

    bowed = widgets.bent_cloud(frame, ["ray"])
    assert bowed[:, 2].min() > -1e-5 and bowed[:, 2].max() > 0.02  # its far corners rise

    camera = T_BASE_CAM[:3, 3]
    behind = (widgets.bent_cloud(frame, ["opengl"]) - camera) @ Z
    assert (behind < 0.0).all()

    depth_along_z = (widgets.bent_cloud(frame, ["buffer"]) - camera) @ Z
    assert (depth_along_z < 1.0).all() and np.ptp(depth_along_z) < 0.15

    P_cam = transform_points(np.linalg.inv(T_BASE_CAM), flat)
    np.testing.assert_allclose(widgets.bent_cloud(frame, ["view"]), transform_points(np.linalg.inv(T_BASE_CAM), P_cam))


def test_each_mystery_hides_one_bug_and_its_box_covers_it(frame):
    assert sorted(widgets.MYSTERIES[1:]) == sorted(widgets.BUGS) and widgets.MYSTERIES[0] is None
    explorer = widgets.name_that_bug(frame)
    for number, bug in enumerate(widgets.MYSTERIES[1:], start=1):
        ticked = dict.fromkeys(widgets.BUGS, False) | {bug: True}
        axes = explorer.figure(mystery=number, **ticked).axes[0]
        _, mystery, bent, _ = axes.lines  # the table is one class; the last is the camera
        np.testing.assert_allclose(mystery.get_xydata(), bent.get_xydata())


def test_noisy_points_spread_as_the_covariance_says():
    arguments = (50.0, 24.0, 1.3, K, 0.7, 0.02)
    P = widgets.noisy_points(*arguments, n=40_000, seed=3)
    Sigma = back_projection_noise(*arguments)
    np.testing.assert_allclose(np.cov(P.T), Sigma, atol=0.03 * np.diagonal(Sigma).max())


def test_the_ellipse_lies_two_standard_deviations_out():
    Sigma, axes = np.array([[4.0, 1.0], [1.0, 2.0]]), Figure().subplots()
    widgets.draw_ellipse(axes, np.array([5.0, -1.0]), Sigma)
    off = axes.lines[0].get_xydata() - (5.0, -1.0)
    np.testing.assert_allclose(np.einsum("ni,ij,nj->n", off, np.linalg.inv(Sigma), off), 4.0)


def test_the_canonical_view_holds_its_score_when_the_camera_is_turned_over():
    frame = render(sample_scene(600006, "test"), (160, 120))
    explorer = widgets.camera_held(frame, load_model(weights_path("unet_rgbd")))
    scores = {}
    for roll in (0, 180):
        picture, *others = explorer.figure(roll=roll, width=160).axes
        assert picture.get_title() == "160 x 120 pixels"
        scores[roll] = [float(axes.get_title().split(": ")[1]) for axes in others]
    as_it_is, in_view = zip(*(scores[roll] for roll in (0, 180)), strict=True)
    assert as_it_is[1] < as_it_is[0] - 0.3 and in_view[1] == pytest.approx(in_view[0], abs=0.03)
    assert np.array_equal(explorer.figure(roll=0, width=160).axes[0].images[0].get_array(), frame.rgb)


def test_turned_over_or_with_the_wrong_sign_of_away_most_targets_look_like_obstacles():
    network = load_model(weights_path("unet_rgbd"))
    engine, takes, away = TorchEngine(network), replace(network.takes, pixel=None), CHANNELS.index("away")

    def taken_for_obstacles(image, geometry, labels):
        logits = engine.classes(*(array.transpose(2, 0, 1)[None] for array in (image, geometry)))[0]
        return np.mean(logits.argmax(axis=0)[labels == TARGET] == OBSTACLE)

    shares = []
    for seed in range(600001, 600007):
        frame = render(sample_scene(seed, "test"), (320, 240))
        over = rolled_camera(frame, np.pi, frame.K, frame.size)
        upright, turned = takes.build(frame), takes.build(over)
        shares.append([taken_for_obstacles(*upright, frame.labels), taken_for_obstacles(*turned, over.labels)])
        upright[1][..., away] = 1.0 - upright[1][..., away]
        shares[-1].append(taken_for_obstacles(*upright, frame.labels))
    as_it_is, turned, wrong_sign = np.median(shares, axis=0)
    assert as_it_is < 0.05 and turned > 0.5 and wrong_sign > 0.5
