"""Where a camera stands, in the ways that people write it down, against SciPy's transforms."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labcli.commands.node import Settings
from labcli.poses import read_pose
from labkit.frame import RGBDFrame
from labkit.geometry import invert_transform

QUATERNION = Rotation.from_euler("xyz", [-145.0, 8.0, 30.0], degrees=True).as_quat()
T = np.eye(4)
T[:3, :3], T[:3, 3] = Rotation.from_quat(QUATERNION).as_matrix(), (0.4, -0.1, 0.9)
SEVEN = " ".join(map(str, (*T[:3, 3], *QUATERNION)))
K = np.array([[300.0, 0.0, 79.5], [0.0, 300.0, 59.5], [0.0, 0.0, 1.0]])


def seen_from(T_base_cam) -> RGBDFrame:
    """A frame, in the camera's own frame, of a level table at height 0 with a block on it."""
    v, u = np.indices((120, 160))
    rays = np.stack([u, v, np.ones(u.shape)], axis=-1) @ np.linalg.inv(K).T @ T_base_cam[:3, :3].T
    depth = T_base_cam[2, 3] / -rays[..., 2]
    depth[50:70, 70:90] -= 0.04
    return RGBDFrame(np.zeros((120, 160, 3), np.uint8), depth.astype(np.float32), K, np.eye(4))


def rows(matrix, decimals: int = 12) -> str:
    return "\n".join(" ".join(f"{x:.{decimals}f}" for x in row) for row in matrix)


FILES = {
    "4x4 as text": ("pose.txt", rows(T)),
    "3x4 as text": ("pose.txt", rows(T[:3])),
    "with commas": ("pose.csv", rows(T).replace(" ", ",")),
    "NumPy's brackets": ("pose.txt", str(T.tolist())),
    "a line with #": ("pose.txt", "# camera to base\n" + rows(T)),
    "JSON by name": ("pose.json", json.dumps({"T_base_cam": T.tolist(), "note": "by hand"})),
    "the other way by name": ("pose.json", json.dumps({"T_cam_base": invert_transform(T).tolist()})),
    "a list of lists": ("pose.json", json.dumps(T.tolist())),
    "seven numbers": ("pose.txt", SEVEN),
    "ROS": (
        "pose.yaml",
        "pose:\n  position:\n    x: 0.4\n    y: -0.1\n    z: 0.9\n  orientation:\n"
        + "".join(f"    {axis}: {x}\n" for axis, x in zip("xyzw", QUATERNION, strict=True)),
    ),
    "NeRF": (
        "transforms.json",
        json.dumps({"frames": [{"file_path": "a.png", "transform_matrix": (T @ np.diag([1, -1, -1, 1])).tolist()}]}),
    ),
}


@pytest.mark.parametrize("kind", FILES)
def test_poses_are_read_from_files(kind, tmp_path):
    name, content = FILES[kind]
    (tmp_path / name).write_text(content)
    found, said = read_pose(str(tmp_path / name), "color/a.png").in_base(seen_from(T))
    assert np.allclose(found, T, atol=1e-9)
    assert any("OpenGL's axes" in sentence for sentence in said) == (kind == "NeRF")


def test_a_bop_frame_has_its_own_pose_in_millimetres(tmp_path):
    """The kit's own data sets are written so, too, and their world is the robot's base."""
    T_cam_world = invert_transform(T)
    ours = {"cam_R_w2c": T_cam_world[:3, :3].ravel().tolist(), "cam_t_w2c": (1000.0 * T_cam_world[:3, 3]).tolist()}
    other = {"cam_R_w2c": np.eye(3).ravel().tolist(), "cam_t_w2c": [0.0, 0.0, 800.0]}
    facts = {str(i): {"cam_K": K.ravel().tolist(), **pose} for i, pose in enumerate((other, ours))}
    (tmp_path / "scene_camera.json").write_text(json.dumps(facts))
    assert np.allclose(read_pose(str(tmp_path / "scene_camera.json"), "rgb/000001.png").in_base()[0], T)
    with pytest.raises(ValueError, match=r"^camera_pose: expected a frame of the picture '000007', got 0, 1"):
        read_pose(str(tmp_path / "scene_camera.json"), "rgb/000007.png")


def test_polycams_world_has_y_up(tmp_path):
    """Its camera looks along -z of its own, with y up; the base frame has z up, and x is x."""
    z_up = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    theirs = np.linalg.inv(z_up) @ T @ np.diag([1, -1, -1, 1])
    facts = {f"t_{i}{j}": theirs[i, j] for i in range(3) for j in range(4)}
    (tmp_path / "1700.json").write_text(json.dumps(facts))
    found, said = read_pose(str(tmp_path / "1700.json")).in_base()
    assert np.allclose(found, T) and "OpenGL's axes" in said[0]


@pytest.mark.parametrize("shape", [(4, 4), (3, 4)])
def test_an_npy_is_read(shape, tmp_path):
    np.save(tmp_path / "pose.npy", T[: shape[0]])
    assert np.allclose(read_pose(str(tmp_path / "pose.npy")).in_base(seen_from(T))[0], T)


def test_which_way_a_matrix_maps_is_told_by_the_table():
    for matrix, way in ((T, "T_base_cam"), (invert_transform(T), "T_cam_base")):
        found, said = read_pose(rows(matrix)).in_base(seen_from(T))
        assert np.allclose(found, T, atol=1e-9) and said == (
            f"camera_pose: the matrix is taken for {way}, which puts the table below the camera",
        )


def test_a_matrix_that_maps_both_ways_or_neither_asks():
    """A camera that looks straight down is as level the other way; one that is mistaken is level in neither."""
    down = np.diag([1.0, -1.0, -1.0, 1.0])
    down[:3, 3] = 0.1, 0.2, 0.8
    with pytest.raises(ValueError, match=r"^camera_pose: .* that does both ways .*; write T_base_cam=FILE if it maps"):
        read_pose(rows(down)).in_base(seen_from(down))
    with pytest.raises(ValueError, match=r"^camera_pose: .* that does neither way"):
        read_pose(rows(down)).in_base(seen_from(T))
    with pytest.raises(ValueError, match=r"no table tells; write T_base_cam=FILE"):
        read_pose(rows(down)).in_base()
    assert np.allclose(read_pose("T_base_cam=" + rows(down)).in_base(seen_from(down))[0], down)
    assert np.allclose(read_pose("T_cam_base = " + rows(down)).in_base()[0], invert_transform(down))


def test_the_node_takes_a_matrix_whose_way_is_said(tmp_path):
    """It has no picture yet when it starts."""
    (tmp_path / "pose.txt").write_text(rows(T))
    assert np.allclose(Settings(camera_pose=f"T_base_cam={tmp_path / 'pose.txt'}").node()["T_base_cam"], T)
    with pytest.raises(ValueError, match="write T_base_cam=FILE"):
        Settings(camera_pose=str(tmp_path / "pose.txt")).node()


@pytest.mark.parametrize("decimals", [3, 4])
def test_a_rotation_of_few_decimals_becomes_the_nearest_one_and_says_how_far_it_was(decimals):
    rounded = np.array([[float(x) for x in row.split()] for row in rows(T, decimals).splitlines()])
    off = np.abs(rounded[:3, :3] @ rounded[:3, :3].T - np.eye(3)).max()
    found, said = read_pose(rows(T, decimals)).in_base(seen_from(T))
    assert np.abs(found[:3, :3] @ found[:3, :3].T - np.eye(3)).max() < 1e-12
    assert np.allclose(found, T, atol=10.0**-decimals)
    assert any(f"R R^T is off the identity by {off:.2g}" in sentence for sentence in said) == (off > 1e-4)


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("1 2 3", "expected \"x y z qx qy qz qw\", a matrix of 4x4 or 3x4, or a file of one .*, got '1 2 3'"),
        (rows(T, 2), "expected an orthonormal rotation"),
        (rows(np.diag([1.0, 1.0, -1.0, 1.0])), "right-handed"),
        (rows(1000.0 * T), "last row"),
        (rows(np.vstack([T[:3, :3].T, T[:3, 3]]).T.repeat(1, axis=0) * [[1, 1, 1, 1000]]), "millimetres"),
        ("nan " * 16, "expected .* got"),
    ],
)
def test_what_is_no_pose_is_refused(text, says):
    with pytest.raises(ValueError, match=rf"^camera_pose: .*{says}|^camera_pose: {says}"):
        read_pose(text)


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("content", "says"),
    [
        ('{"a":' * 3000 + "1" + "}" * 3000, "nested deeper than 20"),
        ("a: &a [1]\nb: *a\n", "alias"),
        ('{"T_base_cam": 5}', "a matrix of finite numbers, got 5"),
        ('{"T_base_cam": [[NaN]]}', "a matrix of finite numbers"),
        ('{"frames": [{"file_path": "b.png"}]}', "expected a frame of the picture 'a', got b"),
        ('{"other": 1}', "got none in"),
    ],
)
def test_a_file_without_a_pose_is_refused_in_words(content, says, tmp_path):
    (tmp_path / "pose.json").write_text(content)
    with pytest.raises(ValueError, match=rf"^camera_pose: .*{says}"):
        read_pose(str(tmp_path / "pose.json"), "a.png")
