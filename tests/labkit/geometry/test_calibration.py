"""Cameras found in photographs of a sheet, against the cameras that the photographs were drawn with."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import sheets
from scipy.spatial.transform import Rotation

from labkit.geometry import invert_transform
from labkit.geometry.calibration import calibrate, hand_eye, sheet_pose
from labkit.geometry.sheet import Chessboard, Corners, Sheet


def away(T, true):
    """How far a pose lies from the true one: millimetres, degrees."""
    D = invert_transform(true) @ T
    return 1e3 * np.linalg.norm(T[:3, 3] - true[:3, 3]), np.degrees(Rotation.from_matrix(D[:3, :3]).magnitude())


@pytest.fixture(scope="module")
def shots():
    """Twelve true poses and the corners that were found."""
    rng = np.random.default_rng(0)
    poses = sheets.poses(rng)
    return poses, [Sheet().find(sheets.photograph(T, rng)) for T in poses]


def exact(T, K=sheets.K, lens=sheets.LENS, noise=0.0, seed=0):
    """Corners where a camera would see them, without a picture."""
    turn, shift = Rotation.from_matrix(T[:3, :3]).as_rotvec(), T[:3, 3]
    pixels = cv2.projectPoints(Sheet().points, turn, shift, K, np.array(lens))[0].reshape(-1, 2)
    return Corners(Sheet().points, pixels + np.random.default_rng(seed).normal(0.0, noise, pixels.shape), 2.0)


# ------------------------------------------------------------------------------------------------- finding corners


def test_corners_are_found_where_the_camera_sees_them(shots):
    for T, found in zip(*shots, strict=True):
        true = exact(T)
        numbers = [int(np.abs(true.points - point).sum(axis=1).argmin()) for point in found.points]
        error = np.linalg.norm(found.pixels - true.pixels[numbers], axis=1)
        seen = ((true.pixels > 30.0) & (true.pixels < np.subtract(sheets.SIZE, 30.0))).all(axis=1).sum()
        assert len(found.points) >= 0.8 * seen and np.median(error) < 0.15 and error.max() < 1.0


def test_part_of_the_sheet_is_enough_and_no_sheet_is_none():
    rng = np.random.default_rng(1)
    picture = sheets.photograph(sheets.pose(), rng)
    hidden = picture.copy()
    hidden[:, 350:] = 90
    assert 6 <= len(Sheet().find(hidden).points) < len(Sheet().find(picture).points)
    assert Sheet().find(np.full_like(picture, 120)) is None
    other = cv2.aruco.CharucoBoard((6, 8), 0.03, 0.024, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_250))
    page = cv2.copyMakeBorder(other.generateImage((360, 480)), 40, 40, 40, 40, cv2.BORDER_CONSTANT, value=255)
    assert Sheet().find(np.repeat(page[..., None], 3, axis=2)) is None


def test_blur_is_measured_in_pixels():
    """A Gaussian of sigma pixels makes an edge sqrt(2 pi) sigma wide, if width is contrast over steepest rise."""
    rng = np.random.default_rng(2)
    for sigma in (1.5, 2.5):
        near = sheets.pose(tilt=(20.0, 10.0), middle=(0.0, 0.0, 0.28))
        found = Sheet().find(sheets.photograph(near, rng, blur=sigma, noise=0.0))
        assert found.blur == pytest.approx(np.sqrt(2.0 * np.pi) * sigma, rel=0.25)


def test_a_chessboard_is_found_and_counted_squares_are_told():
    board = np.kron((np.indices((7, 10)).sum(axis=0) % 2) * 255, np.ones((40, 40))).astype(np.uint8)
    page = np.repeat(cv2.copyMakeBorder(board, *[60] * 4, cv2.BORDER_CONSTANT, value=255)[..., None], 3, axis=2)
    found = Chessboard(9, 6, 0.025).find(page)
    assert found.pixels.round().reshape(6, 9, 2)[0, 0].tolist() in ([100.0, 100.0], [420.0, 300.0])
    assert np.ptp(found.points, axis=0).tolist() == pytest.approx([0.2, 0.125, 0.0])
    with pytest.raises(ValueError, match="10x7, which counts squares: it is 9x6"):
        Chessboard(10, 7, 0.025).find(page)
    assert Chessboard(9, 6, 0.025).find(np.full_like(page, 90)) is None


# ----------------------------------------------------------------------------------------------- K, lens and poses


def test_the_camera_that_drew_the_photographs_is_found(shots):
    found = calibrate(shots[1], sheets.SIZE)
    error = np.abs((found.K - sheets.K)[[0, 1, 0, 1], [0, 1, 2, 2]])
    assert (error < 4.0 * np.array(found.K_std)).all() and (error[:2] < 2.0).all() and found.rms < 0.2
    assert found.dropped == () and len(found.used) == 12


def test_standard_errors_are_those_of_many_calibrations():
    rng = np.random.default_rng(3)
    poses = sheets.poses(rng, 10)
    fits = [
        calibrate([exact(T, noise=0.3, seed=100 * n + i) for i, T in enumerate(poses)], sheets.SIZE) for n in range(30)
    ]
    scatter = np.std([[fit.K[0, 0], fit.K[1, 1], fit.K[0, 2], fit.K[1, 2]] for fit in fits], axis=0)
    said = np.mean([fit.K_std for fit in fits], axis=0)
    assert (np.abs(np.log(scatter / said)) < np.log(1.8)).all()


def test_photographs_that_were_not_used_fit_the_camera(shots):
    """Held out: their corners, after a pose of six numbers, lie as near as those that were used."""
    found = calibrate(shots[1][:8], sheets.SIZE)
    for view in shots[1][8:]:
        left = sheet_pose(view, found.K, found.distortion)[1]
        assert np.sqrt((left**2).sum(axis=1).mean()) < 0.3


def test_the_sheets_pose_is_found(shots):
    errors = [away(sheet_pose(view, sheets.K, sheets.LENS)[0], T) for T, view in zip(*shots, strict=True)]
    assert np.median(errors, axis=0)[0] < 0.6 and np.median(errors, axis=0)[1] < 0.1


def test_a_sheet_printed_larger_is_farther_away():
    rng = np.random.default_rng(4)
    T = sheets.pose(tilt=(25.0, -15.0))
    picture = sheets.photograph(T, rng)
    small, large = (sheet_pose(Sheet(scale).find(picture), sheets.K, sheets.LENS)[0] for scale in (1.0, 1.1))
    assert large[:3, 3] == pytest.approx(1.1 * small[:3, 3], rel=1e-3)


def test_a_view_that_was_zoomed_is_dropped(shots):
    zoomed = sheets.K * np.array([[1.6, 1.0, 1.0], [1.0, 1.6, 1.0], [1.0, 1.0, 1.0]])
    views = [exact(T, noise=0.1, seed=i) for i, T in enumerate(shots[0])]
    views[4] = exact(shots[0][4], K=zoomed)
    assert calibrate(views, sheets.SIZE).dropped == (4,)
    for i in (1, 2, 7, 8, 10):
        other = shots[0][i].copy()
        other[:3, 3] += (0.0, 0.0, 0.3)
        bent = exact(other, K=zoomed)
        views[i] = Corners(bent.points, bent.pixels + 4.0 * np.sin(bent.pixels / 9.0 + i), 2.0)
    with pytest.raises(ValueError, match="that do not fit the others"):
        calibrate(views, sheets.SIZE)


@pytest.mark.parametrize(
    ("poses", "says"),
    [
        ([sheets.pose(turn=30.0 * i, middle=(0.05, 0.02, 0.4 + 0.01 * i)) for i in range(8)], "tilt the sheet"),
        ([sheets.pose(tilt=(30.0, 3.0 * i), middle=(0.02 * i, 0.0, 0.45)) for i in range(7)], "tilt the sheet"),
        ([sheets.pose(tilt=(t, 35.0 - t), middle=(0.0, 0.0, 2.0)) for t in range(0, 36, 5)], "to the picture's edges"),
        ([sheets.pose()] * 5, "at least 6"),
    ],
)
def test_photographs_that_cannot_tell_are_refused_with_what_to_do(poses, says):
    with pytest.raises(ValueError, match=says):
        calibrate([exact(T, noise=0.2, seed=i) for i, T in enumerate(poses)], sheets.SIZE)


# ---------------------------------------------------------------------------------------------- a camera on an arm


def motions(rng, count, axis=None):
    """Poses of a hand, turned by up to 60 degrees about any axis, or about one alone."""
    arm = np.tile(np.eye(4), (count, 1, 1))
    turns = rng.uniform(-1.0, 1.0, (count, 3)) if axis is None else rng.uniform(-1, 1, (count, 1)) * axis
    arm[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    arm[:, :3, 3] = rng.uniform(-0.2, 0.2, (count, 3)) + np.array((0.5, 0.0, 0.5))
    return arm


TRUE = np.eye(4)
TRUE[:3, :3] = Rotation.from_euler("xyz", (170, 5, 92), degrees=True).as_matrix()
TRUE[:3, 3] = 0.05, -0.02, 0.07


@pytest.mark.parametrize("stands", [False, True])
def test_exact_poses_give_the_exact_camera(stands):
    """On the hand: base <- hand <- camera <- sheet is one pose; a camera that stands has the arm's poses inverted."""
    rng = np.random.default_rng(5)
    arm = motions(rng, 6)
    still = motions(rng, 1)[0]
    moved = np.linalg.inv(arm) if stands else arm
    eye = [np.linalg.inv(T @ TRUE) @ still for T in moved]
    X, scatter = hand_eye(list(moved), eye)
    assert np.abs(X - TRUE).max() < 1e-9 and scatter.max() < 1e-7


def test_turns_about_one_axis_and_too_few_poses_are_refused():
    rng = np.random.default_rng(6)
    for arm, says in (
        (motions(rng, 8, axis=np.array([0.0, 0.0, 1.0])), "about one axis alone"),
        (motions(rng, 8, axis=np.zeros(3)), "hardly turned"),
        (motions(rng, 2), "at least three"),
    ):
        with pytest.raises(ValueError, match=says):
            hand_eye(list(arm), [np.linalg.inv(T @ TRUE) for T in arm])


@pytest.mark.nightly
def test_a_camera_on_the_simulated_arms_hand_is_found():
    """Fifteen poses of the Panda in PyBullet, corners detected in its pictures: within 2 mm and 0.2 degrees."""
    from bench.bench_calibration import errors, on_a_hand

    T_base_hand, T_cam_sheet, _ = on_a_hand(0)
    millimetres, degrees = errors(hand_eye(T_base_hand, T_cam_sheet)[0])
    assert millimetres < 2.0 and degrees < 0.2


@pytest.mark.nightly
def test_real_photographs_of_a_chessboard_give_the_camera_that_opencv_finds():
    """Fourteen photographs of the package mvtb-data, where it is installed: f within 2 pixels of OpenCV's own, from
    corners of another detector and from those of its example without the photograph that they do not fit."""
    from bench.bench_calibration import chessboard, opencv

    package = pytest.importorskip("mvtbdata", reason="needs the package mvtb-data, 130 MB")
    folder = Path(package.__path__[0]) / "images" / "calibration"
    found, others = chessboard(folder), opencv(folder)
    assert len(found.used) == 14 and found.rms < 0.25
    example, without, sectors = others.values()
    assert (example.used, example.rms) == (14, pytest.approx(0.407, abs=0.005))
    assert example.worst > 1.0 > 0.5 > without.worst, "one photograph's corners lie off"
    assert without.used == 13 and sectors.used == 12
    for other in (without, sectors):
        assert found.K[0, 0] == pytest.approx(other.f, abs=2.0)
