"""The explorer of topic 06, calibration: sheets lean as asked, and tilt, not the RMS, says how well f is known."""

import numpy as np
import pytest

from labcourse.explorers import calibration as widgets
from labkit.geometry import invert_transform, project, transform_points
from labkit.geometry.calibration import calibrate


@pytest.mark.parametrize("tilt", [3.0, 20.0, 45.0])
def test_sheets_lean_as_asked_to_all_sides_and_lie_in_the_picture(tilt):
    poses = widgets.sheet_poses(np.radians(tilt), 8)
    normals = np.array([T[:3, 2] for T in poses])
    np.testing.assert_allclose(normals[:, 2], -np.cos(np.radians(tilt)), atol=1e-9)
    np.testing.assert_allclose(normals[:, :2].sum(axis=0), 0.0, atol=1e-9)  # evenly around
    for T in poses:
        assert invert_transform(T)[2, 3] > 0.0  # the camera sees the printed side
        pixels = widgets.seen(T, 0.0, np.random.default_rng(0)).pixels
        assert (pixels > 0).all() and (pixels < widgets.SIZE).all()


def test_corners_are_off_by_the_noise_and_an_arch_lifts_the_middle_alone():
    T = widgets.sheet_poses(0.4, 1)[0]
    exact = widgets.seen(T, 0.0, np.random.default_rng(0))
    np.testing.assert_allclose(
        exact.pixels, np.column_stack(project(transform_points(T, exact.points), widgets.K_TRUE)), atol=1e-9
    )
    off = np.concatenate(
        [widgets.seen(T, 0.5, np.random.default_rng(seed)).pixels - exact.pixels for seed in range(100)]
    )
    assert off.std() == pytest.approx(0.5, rel=0.05)
    arched = widgets.seen(T, 0.0, np.random.default_rng(0), arch=0.01)
    np.testing.assert_array_equal(arched.points, exact.points)
    moved = np.linalg.norm(arched.pixels - exact.pixels, axis=1)
    from_middle = np.abs(exact.points[:, 0] - 0.09)
    assert np.median(moved[from_middle < 0.01]) > 1.5 * np.median(moved[from_middle > 0.05]) > 1.0


def test_tilt_and_not_the_rms_says_how_well_f_is_known():
    explorer, rms, error = widgets.tilt_the_sheet(), {}, {}
    for tilt in (3, 10, 12, 40):
        picture, scatter = explorer.figure(tilt=tilt, count=6, noise=0.3).axes
        rms[tilt] = float(picture.get_title().split("RMS ")[1].split()[0])
        error[tilt] = float(scatter.get_title().split("error ")[1].split()[0])
    assert max(rms.values()) - min(rms.values()) < 0.03
    assert error[3] > 5.0 > 1.2 >= error[10] > 1.0 > error[12] > error[40]  # the lesson: below 1 % from 12 degrees on


def test_the_fit_without_a_lens_agrees_with_the_kits_where_both_can_tell():
    views = [widgets.seen(T, 0.1, np.random.default_rng(k)) for k, T in enumerate(widgets.sheet_poses(0.6, 12))]
    K, rms = widgets.fitted(views)
    kit = calibrate(views, widgets.SIZE)
    assert abs(K[0, 0] - widgets.K_TRUE[0, 0]) < 4.0 * kit.K_std[0] < 4.0
    assert abs(K[0, 0] - kit.K[0, 0]) < 4.0 * kit.K_std[0] and rms == pytest.approx(kit.rms, rel=0.05)
