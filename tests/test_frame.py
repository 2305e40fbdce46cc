import cv2
import numpy as np
import pytest

from labkit.frame import RGBDFrame

K = np.array([[100.0, 0.0, 4.0], [0.0, 110.0, 3.0], [0.0, 0.0, 1.0]])


def arguments(**changes):
    good = {
        "rgb": np.zeros((6, 8, 3), np.uint8),
        "depth": np.ones((6, 8), np.float32),
        "K": K,
        "T_base_cam": np.eye(4),
        "labels": np.zeros((6, 8), np.int64),
    }
    return {**good, **changes}


def changed(matrix, index, value):
    matrix = np.array(matrix, dtype=float)
    matrix[index] = value
    return matrix


def test_a_good_frame_keeps_its_values_in_the_kits_types():
    frame = RGBDFrame(**arguments(depth=np.full((6, 8), 0.5)))
    assert frame.depth.dtype == np.float32 and frame.labels.dtype == np.uint8
    assert frame.size == (8, 6)


@pytest.mark.parametrize("missing", [0.0, np.nan])
def test_zero_and_nan_depth_are_fine(missing):
    depth = np.ones((6, 8), np.float32)
    depth[2, 3] = missing
    assert RGBDFrame(**arguments(depth=depth)).depth.shape == (6, 8)


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("argument", "value", "says"),
    [
        ("rgb", np.zeros((6, 8), np.uint8), "shape"),
        ("rgb", np.zeros((6, 8, 3)), "uint8"),
        ("rgb", np.zeros((0, 8, 3), np.uint8), "pixel"),
        ("depth", np.ones((8, 6), np.float32), "size"),
        ("depth", np.ones((6, 8), np.uint16), "millimetres"),
        ("depth", np.full((6, 8), 850.0, np.float32), "millimetres"),
        ("depth", np.full((6, 8), -0.1, np.float32), ">= 0"),
        ("depth", np.full((6, 8), np.inf, np.float32), "0 or NaN"),
        ("K", K.T, "transposed"),
        ("K", changed(K, (0, 0), 0.0), "singular"),
        ("K", changed(K, (0, 0), np.nan), "finite"),
        ("K", np.eye(4), "shape"),
        ("T_base_cam", 2.0 * np.eye(4), "0 0 0 1"),
        ("T_base_cam", changed(np.eye(4), (0, 0), 1.1), "orthonormal"),
        ("T_base_cam", changed(np.eye(4), (0, 0), -1.0), "right-handed"),
        ("T_base_cam", changed(np.eye(4), (3, 0), 1.0), "transposed"),
        ("T_base_cam", changed(np.eye(4), (2, 3), 850.0), "millimetres"),
        ("T_base_cam", np.eye(3), "shape"),
        ("labels", np.full((6, 8), 256), "0 to 254 or 255"),
        ("labels", np.zeros((6, 8)), "integer"),
        ("labels", np.zeros((5, 8), int), "size"),
        ("instances", np.zeros((6, 9), np.uint8), "size"),
        ("table_z", 750, "millimetres"),
    ],
)
def test_wrong_arguments_are_named(argument, value, says):
    with pytest.raises(ValueError, match=rf"^{argument}: .*{says}"):
        RGBDFrame(**arguments(**{argument: value}))


def write(path, image):
    assert cv2.imwrite(str(path), image)
    return path


def test_from_files_reads_what_was_written(tmp_path):
    rng = np.random.default_rng(0)
    rgb = rng.integers(0, 256, (6, 8, 3), dtype=np.uint8)
    depth = rng.integers(0, 3000, (6, 8), dtype=np.uint16)
    labels = rng.integers(0, 4, (6, 8), dtype=np.uint8)
    frame = RGBDFrame.from_files(
        write(tmp_path / "rgb.png", rgb[:, :, ::-1]),
        write(tmp_path / "depth.png", depth),
        K,
        np.eye(4),
        write(tmp_path / "labels.png", labels),
        depth_scale=0.0005,
    )
    assert np.array_equal(frame.rgb, rgb) and np.array_equal(frame.labels, labels)
    assert np.allclose(frame.depth, depth * 0.0005, atol=1e-6)


@pytest.mark.bad_input
def test_files_that_do_not_fit_are_named(tmp_path):
    rgb = write(tmp_path / "rgb.png", np.zeros((6, 8, 3), np.uint8))
    depth = write(tmp_path / "depth.png", np.ones((6, 8), np.uint16))
    eight_bit = write(tmp_path / "eight.png", np.ones((6, 8), np.uint8))
    truncated = tmp_path / "truncated.png"
    truncated.write_bytes(rgb.read_bytes()[:20])
    with pytest.raises(FileNotFoundError, match="nowhere"):
        RGBDFrame.from_files(tmp_path / "nowhere.png", depth, K, np.eye(4))
    with pytest.raises(ValueError, match=r"^rgb: .*damaged"):
        RGBDFrame.from_files(truncated, depth, K, np.eye(4))
    with pytest.raises(ValueError, match=r"^depth: expected uint16"):
        RGBDFrame.from_files(rgb, eight_bit, K, np.eye(4))
    with pytest.raises(ValueError, match=r"^depth_scale:"):
        RGBDFrame.from_files(rgb, depth, K, np.eye(4), depth_scale=0.0)
