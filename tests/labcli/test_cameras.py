"""Cameras as the programs of this field write them down, each against what its published format says."""

import json
import time

import numpy as np
import pytest
from camera_files import FILES, FLAT, KALIBR, NERF, PLAIN, REALSENSE, ROS2, VIEWER, K

from labcli import cameras
from labcli.camera_formats import READERS
from labcli.cameras import read_intrinsics
from labcli.poses import read_pose


@pytest.mark.parametrize("kind", FILES)
def test_each_format_gives_its_matrix_size_and_lens(kind, tmp_path):
    name, content, size, lens = FILES[kind]
    (tmp_path / name).write_text(content)
    found = read_intrinsics(str(tmp_path / name))
    assert np.allclose(found.K, K, atol=1e-9) and found.size == size
    assert np.allclose(np.trim_zeros(found.distortion, "b"), np.trim_zeros(lens, "b")), "k1, k2, p1, p2"
    assert found.same_view == (kind in ("Polycam", "Record3D", "Stray Scanner"))
    assert any("OpenGL" in sentence for sentence in found.said) == (kind in ("NeRF", "Polycam"))


def test_every_reader_has_a_file_here(tmp_path, monkeypatch):
    answered = set()

    def noted(name, read):
        def noting(facts):
            camera = read(facts)
            answered.update([name] * (camera is not None))
            return camera

        return noting

    for name, read in list(READERS.items()):
        monkeypatch.setitem(READERS, name, noted(name, read))
    for name, content, *_ in (*FILES.values(), OPEN3D):
        (tmp_path / name).write_text(content)
        read_intrinsics(str(tmp_path / name))
    assert answered == set(READERS)


BY_COLUMNS = [600, 0, 0, 0, 601, 0, 320, 240, 1]
OPEN3D = "open3d.json", json.dumps({"width": 640, "height": 480, "intrinsic_matrix": BY_COLUMNS})


def test_a_matrix_may_be_an_npy_and_words(tmp_path):
    np.save(tmp_path / "K.npy", np.array(K))
    assert read_intrinsics(str(tmp_path / "K.npy")).K.tolist() == read_intrinsics(str(np.array(K))).K.tolist() == K


def test_what_opencvs_calibration_gave_may_be_kept_in_an_npz(tmp_path):
    """As the tutorial keeps it, with arrays of other kinds beside it."""
    others = {"rvecs": np.array([None, "x"], object), "tvecs": np.zeros((2, 3, 1))}
    np.savez(tmp_path / "B.npz", mtx=np.array(K), dist=np.array([[0.1, -0.2, 0.001, 0.002, 0.0]]), **others)
    found = read_intrinsics(str(tmp_path / "B.npz"))
    assert found.K.tolist() == K and found.distortion == (0.1, -0.2, 0.001, 0.002, 0.0)
    np.savez(tmp_path / "depth.npz", depth=np.ones((480, 640)))
    with pytest.raises(ValueError, match=r"intrinsics: found no camera matrix in .*depth\.npz"):
        read_intrinsics(str(tmp_path / "depth.npz"))


def test_of_a_camera_that_prints_all_its_sizes_the_named_one_is_taken(tmp_path):
    large = REALSENSE.replace("640", "1280").replace("480", "960").replace('"Color"', '"Depth"')
    small = REALSENSE.replace("640", "320").replace("480", "240")
    (tmp_path / "d455.txt").write_text(large + small + REALSENSE)
    with pytest.raises(ValueError, match="got Depth 1280x960, Color 320x240, Color 640x480; --camera-name says which"):
        read_intrinsics(str(tmp_path / "d455.txt"))
    assert read_intrinsics(str(tmp_path / "d455.txt"), name="color 640x480").size == (640, 480)


def test_a_lens_that_the_viewer_leaves_out_is_said(tmp_path):
    (tmp_path / "a_metadata.csv").write_text(VIEWER)
    assert "no coefficients of the lens" in read_intrinsics(str(tmp_path / "a_metadata.csv")).said[0]


@pytest.mark.parametrize(
    "begins, says",
    [
        (b"PK\x03\x04", "an archive, as Record3D's .r3d is: unpack it"),
        (b"#ROSBAG V2.0\n", "a recording of ROS 1; `rostopic echo -b"),
        (b"SQLite format 3\0", "a recording of ROS 2"),
        (b"\x89MCAP0\r\n", "a recording of ROS 2"),
        (b"\x89PNG\r\n", "a picture"),
        (b"%time,field.header.seq,", "what `rostopic echo -p` prints: leave -p out"),
    ],
)
@pytest.mark.parametrize("read", [read_intrinsics, read_pose])
def test_a_file_that_is_no_text_says_what_it_is_whatever_its_size(begins, says, read, tmp_path):
    with (tmp_path / "capture").open("wb") as file:
        file.write(begins)
        file.truncate(1 << 33)
    with pytest.raises(ValueError, match=f"expected a text in .*capture, got {says}"):
        read(str(tmp_path / "capture"))


def test_an_angle_of_view_is_a_focal_length(tmp_path):
    """640 wide at 90 degrees: f is half the width. The middle of the first pixel is 0 here, and 0.5 there."""
    path = tmp_path / "transforms.json"
    path.write_text(json.dumps({"camera_angle_x": np.pi / 2, "w": 640, "h": 480, "frames": []}))
    assert np.allclose(read_intrinsics(str(path)).K, [[320, 0, 319.5], [0, 320, 239.5], [0, 0, 1]])
    path.write_text(json.dumps({"camera_angle_x": np.pi / 2}))
    with pytest.raises(ValueError, match="expected w and h beside camera_angle_x, got none: add them"):
        read_intrinsics(str(path))


# ---------------------------------------------------------------------------------------------- which of several

TWO = {
    "rgb_camera": {"fx": 600, "fy": 601, "cx": 320, "cy": 240},
    "depth": {"fx": 400, "fy": 401, "cx": 300, "cy": 200},
}


def test_of_two_cameras_the_colour_one_is_taken_and_said(tmp_path):
    path = tmp_path / "cameras.json"
    path.write_text(json.dumps(TWO))
    found = read_intrinsics(str(path))
    assert found.K.tolist() == K and found.said == ("intrinsics: of rgb_camera, depth, rgb_camera is taken",)
    assert read_intrinsics(str(path), name="depth").K[0, 0] == 400
    with pytest.raises(ValueError, match=r"camera_name: expected one of rgb_camera, depth, got 'left', in .*json"):
        read_intrinsics(str(path), name="left")
    for names in (("left", "right"), ("rgb", "rgb_rect")):
        path.write_text(json.dumps(dict(zip(names, TWO.values(), strict=True))))
        with pytest.raises(ValueError, match=f"expected one camera, got {', '.join(names)}; --camera-name says which"):
            read_intrinsics(str(path))
    path.write_text(json.dumps(dict.fromkeys(("left", "right"), TWO["depth"])))
    assert read_intrinsics(str(path)).K[0, 0] == 400, "it is one and the same"


def test_names_that_are_numbers_are_frames(tmp_path):
    """BOP: the picture's own, or any if all are the same."""
    path, other = tmp_path / "scene_camera.json", [500, 0, 320, 0, 501, 240, 0, 0, 1]
    path.write_text(json.dumps({"0": {"cam_K": FLAT}, "12": {"cam_K": other}}))
    assert read_intrinsics(str(path), "rgb/000012.png").K[0, 0] == 500
    assert read_intrinsics(str(path), "rgb/000000.png").K[0, 0] == 600
    with pytest.raises(ValueError, match="one for the picture 'mine', got 2 frames whose K differ; --camera-name"):
        read_intrinsics(str(path), "mine.png")
    path.write_text(json.dumps({"0": {"cam_K": FLAT, "depth_scale": 0.1}, "12": {"cam_K": FLAT, "depth_scale": 0.1}}))
    assert read_intrinsics(str(path), "mine.png").depth_scale == 0.1


def test_what_cannot_be_followed_of_one_camera_is_no_matter_of_the_other(tmp_path):
    path = tmp_path / "cameras.json"
    path.write_text(json.dumps(TWO | {"depth": TWO["depth"] | {"model": "equidistant"}}))
    assert read_intrinsics(str(path)).K.tolist() == K
    with pytest.raises(ValueError, match="fisheye"):
        read_intrinsics(str(path), name="depth")


# ------------------------------------------------------------------------------------------ what is refused in words

BOMB = "a: &a [x, x]\n" + "".join(
    f"{b}: &{b} {{<<: *{a}, k{b}: [*{a}, *{a}, *{a}]}}\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
REFUSED = {
    "nested deep, JSON": ('{"a":' * 3000 + "1" + "}" * 3000, "nested deeper than 20"),
    "nested deep, YAML": ("- " * 3000 + "1", "nested deeper than 20"),
    "cyclic": ("a: &a\n  b: *a\n", "it has an alias, [*]a: write out"),
    "merge keys": (BOMB, "it has an alias"),
    "much YAML": ("x: y\n" * 50_000, "characters of YAML, more than"),
    "entities": ('<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "it declares entities"),
    "not closed": ("a: [1", "expected JSON or YAML that can be read"),
    "an infinite width": (
        '{"fx": 1, "fy": 1, "cx": 1, "cy": 1, "width": Infinity, "height": 3}',
        "expected width and height",
    ),
    "no width": (
        json.dumps(PLAIN | {"width": 0, "height": 480}),
        r"width and height in pixels, got \[0, 480\]",
    ),
    "400 digits": (json.dumps(PLAIN).replace("600", "6" * 400), "a camera matrix of finite numbers"),
    "5000 digits": (json.dumps(PLAIN).replace("600", "6" * 5000), "expected JSON or YAML that can be read"),
    "NaN": (json.dumps(PLAIN).replace("600", "NaN"), "a camera matrix of finite numbers"),
    "a model of 5": (json.dumps(PLAIN | {"model": 5}), "expected the lens's model as a text, got 5"),
    "a text as a lens": (json.dumps(PLAIN | {"coeffs": ["much"]}), "the lens's coefficients as finite numbers"),
    "three numbers of a lens": (json.dumps(PLAIN | {"coeffs": [1, 2, 3]}), "got 3; rectify the pictures first"),
    "a scale in words": (json.dumps(PLAIN | {"depth_scale": "mm"}), "expected depth_scale as a number, got 'mm'"),
    "fisheye, ROS": (ROS2.replace("plumb_bob", "equidistant"), "a fisheye or other wide lens .equidistant."),
    "fisheye without coefficients": (json.dumps(PLAIN | {"distortion_model": "equidistant"}), "fisheye"),
    "fisheye, COLMAP": ("1 OPENCV_FISHEYE 640 480 600 601 320 240 0 0 0 0\n", "fisheye .* .OPENCV_FISHEYE."),
    "fisheye, NeRF": (json.dumps(NERF | {"is_fisheye": True}), "fisheye"),
    "omni, Kalibr": (KALIBR.replace("pinhole", "omni"), "wide lens .omni."),
    "k4 alone": (json.dumps(NERF | {"k4": 0.1}), "k4 of a longer polynomial; rectify first"),
    "binned": (ROS2.replace("binning_x: 0", "binning_x: 2"), "a camera that bins no pixels"),
    "a region": (ROS2.replace("x_offset: 0", "x_offset: 8"), r"a region that begins at \[8, 0\]"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_hostile_and_unclear_files_are_refused_in_words_and_at_once(kind, tmp_path):
    content, says = REFUSED[kind]
    (tmp_path / "camera.json").write_text(content)
    begin = time.process_time()
    with pytest.raises(ValueError, match=rf"^intrinsics: .*{says}.*camera\.json"):
        read_intrinsics(str(tmp_path / "camera.json"))
    assert time.process_time() - begin < 3.0, "8 levels of merge keys took ten"


def test_a_file_that_is_large_is_not_read(tmp_path):
    with (tmp_path / "camera.json").open("wb") as file:
        file.truncate(1 << 33)
    with pytest.raises(ValueError, match="intrinsics: expected a small file"):
        read_intrinsics(str(tmp_path / "camera.json"))
    cameras._cameras.cache_clear()
