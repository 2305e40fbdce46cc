"""What looks wrong is said with its numbers, at every door; a picture that is as it should be is left in peace."""

import json
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
from scenes import box, scene
from scipy.spatial.transform import Rotation

from labcli import cameras, own_data, perceive
from labkit.frame import RGBDFrame
from labkit.geometry.sensor import DepthSensor, StereoSensor
from labkit.labels import TARGET, one_hot
from labkit.node.actors import Camera
from labkit.node.bus import Bus
from labkit.node.messages import Diagnostics, Topics
from labkit.node.segmentation import SegmentationNode
from labkit.notices import notices
from labkit.pipeline import Pipeline
from labkit.sim.world import World


@pytest.fixture(scope="module")
def frame() -> RGBDFrame:
    """Two boxes in the middle of a table."""
    spec = scene(box("left", 0.5, 0.08), box("right", 0.55, -0.09, (0.04, 0.05, 0.1)))
    with World(spec) as world:
        return world.render()


def moved(frame: RGBDFrame, up: float = 0.0, degrees: float = 0.0) -> RGBDFrame:
    """The frame with a wrong pose."""
    T = frame.T_base_cam.copy()
    T[:3, :3] = T[:3, :3] @ Rotation.from_euler("x", degrees, degrees=True).as_matrix()
    T[2, 3] += up
    return replace(frame, T_base_cam=T)


def shifted(frame: RGBDFrame, right: int, down: int) -> RGBDFrame:
    return replace(frame, depth=np.roll(frame.depth, (down, right), (0, 1)))


@pytest.mark.parametrize("sensor", [None, DepthSensor(), StereoSensor()])
def test_nothing_is_said_of_a_calibrated_picture(frame, sensor):
    for seed in range(5):
        seen = frame if sensor is None else sensor.apply(frame, np.random.default_rng(seed))
        assert notices(seen) == () and Pipeline().locate(seen, frame.labels).notices == ()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda f: moved(f, up=0.1),
            r"lies \+100 mm off table_z = 0\.000 m .* leans by 0\.0 .*table_z is likely 0\.100",
        ),
        (lambda f: moved(f, up=-0.02), r"lies -20 mm off table_z .* table_z is likely -0\.020 m"),
        (lambda f: moved(f, degrees=10.0), r"leans by (9\.9|10\.0) degrees: T_base_cam is likely wrong"),
        (lambda f: replace(f, table_z=0.05), r"lies -50 mm off table_z = 0\.050 m .* table_z is likely 0\.000 m"),
        (
            lambda f: replace(f, depth=4.0 * f.depth),
            r"only \d+% of the picture has depth within 0\.25 m .* of depth times 0\.25 most lies on the table",
        ),
        (lambda f: shifted(f, 12, 0), r"depth lies \(12, 0\) pixels off the colours"),
        (lambda f: shifted(f, 0, -5), r"depth lies \(0, -5\) pixels off the colours"),
        (lambda f: replace(f, K=f.K + np.outer([1, 0, 0], [0, 0, 200.0])), r"outside the picture of 320 x 240"),
        (lambda f: replace(f, K=np.diag([0.5, 0.5, 1.0]) @ f.K), r"\(80\.0, 59\.5\) lies far .*one of 160 x 119\?"),
        (lambda f: replace(f, K=np.diag([0.75, 0.75, 1.0]) @ f.K), r"\(120\.0, 89\.2\) lies far .*one of 240 x 178\?"),
        (lambda f: replace(f, depth=np.zeros_like(f.depth)), r"there is no depth: the picture is taken as it is"),
    ],
    ids=[
        "up",
        "down",
        "leaning",
        "table_z",
        "unit",
        "shift",
        "shift_up",
        "outside",
        "half_size",
        "three_quarters",
        "no_depth",
    ],
)
def test_what_looks_wrong_is_said_with_its_numbers(frame, change, said):
    found = notices(change(frame))
    assert any(re.search(said, sentence) for sentence in found), found


def test_a_table_far_off_its_height_does_not_lean(frame):
    (said,) = notices(moved(frame, up=0.243))
    lean = float(re.search(r"leans by (\d+\.\d) degrees", said)[1])
    assert lean < 0.5 and "lies +243 mm off table_z" in said and "table_z is likely 0.243 m" in said


def test_an_identity_pose_is_no_wrong_unit(frame):
    (said,) = notices(replace(frame, T_base_cam=np.eye(4)))
    assert "T_base_cam is the identity" in said and "depth_scale" not in said


def test_noise_has_no_edges_that_could_be_shifted(frame):
    rng = np.random.default_rng(0)
    for _ in range(5):
        rgb = rng.integers(0, 256, frame.rgb.shape, dtype=np.uint8)
        assert notices(replace(frame, rgb=rgb)) == ()


def as_the_depth_camera_sees_it(frame: RGBDFrame, scale: float = 585 / 525, aside: float = 0.025) -> RGBDFrame:
    """Depth of a camera of a longer focal length, so many metres beside the colour camera, not brought into it."""
    (v, u), z, K = np.indices(frame.depth.shape), frame.depth.astype(float), frame.K
    x, y = (u - K[0, 2]) / K[0, 0] * z - aside, (v - K[1, 2]) / K[1, 1] * z
    at = [np.rint(scale * K[i, i] * side / z + K[i, 2]).astype(int) for i, side in enumerate((x, y))]
    inside = (at[0] >= 0) & (at[0] < z.shape[1]) & (at[1] >= 0) & (at[1] < z.shape[0])
    seen = np.full(z.shape, np.inf)
    np.minimum.at(seen, (at[1][inside], at[0][inside]), z[inside])
    seen = np.where(np.isfinite(seen), seen, 0.0).astype(np.float32)
    return replace(frame, depth=np.where(seen > 0.0, seen, cv2.dilate(seen, np.ones((3, 3)))))  # a finer grid has gaps


@pytest.fixture(scope="module")
def crowd() -> RGBDFrame:
    """Seven boxes all over a table, 640x480."""
    places = [(0.4, -0.25), (0.42, 0.02), (0.45, 0.26), (0.55, -0.12), (0.6, 0.14), (0.7, -0.28), (0.72, 0.3)]
    things = [box(f"box{k}", x, y, (0.05, 0.06, 0.05 + 0.02 * (k % 3))) for k, (x, y) in enumerate(places)]
    with World(scene(*things)) as world:
        return world.render((640, 480))


def test_depth_as_the_depth_camera_sees_it_is_told_by_its_scale(crowd):
    aligned = DepthSensor().apply(crowd, np.random.default_rng(0))
    assert notices(aligned) == ()
    (said,) = [sentence for sentence in notices(as_the_depth_camera_sees_it(aligned)) if "depth is" in sentence]
    scale, dx = map(
        float, re.search(r"depth is (\d\.\d+) times as large .* lies \((-?\d+), -?\d+\) pixels", said).groups()
    )
    assert scale == pytest.approx(585 / 525, abs=0.03)
    near, far = 0.025 * crowd.K[0, 0] * scale / np.percentile(crowd.depth, [2, 80])
    assert far < -dx < near, "25 mm, at the distance of the table and its things"
    assert any("pixels off the colours" in sentence for sentence in notices(shifted(aligned, 8, 0)))


def test_where_depth_ends_is_no_edge_of_a_thing():
    """One thing at half a metre, nothing around it with depth; what is drawn about it lies where filling ends."""
    rgb, depth = np.full((240, 320, 3), 120, np.uint8), np.zeros((240, 320), np.float32)
    depth[90:150, 130:190] = np.linspace(0.3, 0.5, 60)[:, None]
    rgb[90:150, 130:190] = 130
    rgb[67:151, 106:190] -= 60  # a shadow, a sheet: 84 pixels wide, (-12, -11) off the middle
    alone = RGBDFrame(rgb, depth, np.array([[300.0, 0.0, 159.5], [0.0, 300.0, 119.5], [0.0, 0.0, 1.0]]), np.eye(4))
    assert not any("pixels off" in sentence for sentence in notices(alone))


def test_noise_is_no_table(frame):
    rng = np.random.default_rng(0)
    noise = replace(frame, depth=(frame.depth + rng.uniform(-0.15, 0.15, frame.depth.shape)).astype(np.float32))
    assert any("lie on one plane: is it noise, or no table?" in sentence for sentence in notices(noise))


def test_a_unit_that_puts_the_camera_far_from_its_own_table_or_close_to_it_is_noticed(frame):
    for factor in (3.0, 0.2):
        seen, _ = perceive.on_table(replace(frame, depth=factor * frame.depth))
        assert any("m away: is depth in another unit (depth_scale)" in sentence for sentence in notices(seen))


def test_the_top_of_a_box_that_fills_the_picture_is_not_taken_for_the_table():
    with World(scene(box("box", 0.5, 0.0, (0.18, 0.14, 0.06)))) as world:
        seen = world.render()
    v, u = np.nonzero(seen.instances == 1)
    left, top = u.min() - 4, v.min() - 4
    cut = np.s_[top : v.max() + 4, left : u.max() + 4]
    K = seen.K - np.array([[0.0, 0.0, left], [0.0, 0.0, top], [0.0, 0.0, 0.0]])
    part, _ = perceive.on_table(RGBDFrame(seen.rgb[cut], seen.depth[cut], K, np.eye(4)))
    assert part.T_base_cam[2, 3] == pytest.approx(seen.T_base_cam[2, 3], abs=0.003)


def test_a_picture_unlike_the_trainings_is_told_by_its_table(frame):
    def model(rgb):
        p = np.zeros((*rgb.shape[:2], 4))
        p[..., 3] = 1.0
        return p

    (said,) = Pipeline(model).run(frame).notices
    assert said.startswith("this picture is unlike the training's: 0% of the table's pixels are called surface")
    assert said.endswith("are as the training's")
    (said,) = Pipeline(model).run(moved(frame, up=0.02)).notices  # which alone can be why
    assert "table_z is likely 0.020 m" in said
    bright = replace(frame, rgb=np.full_like(frame.rgb, 250))
    assert any(
        "250.0 mean of the colours (training's are 39 to 190), 0.0 mean saturation" in sentence
        for sentence in Pipeline(model).run(bright).notices
    )
    few = RGBDFrame(
        frame.rgb[::8, ::8], frame.depth[::8, ::8], np.diag([0.125, 0.125, 1.0]) @ frame.K, frame.T_base_cam
    )
    assert any("millimetres of the table per pixel" in sentence for sentence in Pipeline(model).run(few).notices)


def test_targets_without_depth_and_targets_at_the_border_are_noticed(frame):
    blind = replace(frame, depth=np.where(frame.labels == TARGET, np.float32(0.0), frame.depth))
    n = np.count_nonzero(frame.labels == TARGET)
    assert f"{n} of {n} pixels labelled target have no depth" in Pipeline().locate(blind, frame.labels).notices
    assert f"{n} of {n} pixels labelled target have no depth" in notices(blind)
    columns = np.nonzero(frame.labels == TARGET)[1]
    for last, touches in ((columns.max(), True), (columns.max() + 2, False)):
        cut = np.s_[:, : last + 1]
        part = RGBDFrame(frame.rgb[cut], frame.depth[cut], frame.K, frame.T_base_cam, table_z=frame.table_z)
        found = Pipeline().locate(part, frame.labels[cut]).notices
        assert any("touches the picture's border: a part of it is unseen" in each for each in found) == touches


def test_only_what_no_hand_can_grasp_is_said_to_be_a_lump():
    """Two boxes that touch, and a long one, may be one thing; half a metre of boxes is not."""
    for length, lump in ((0.08, False), (0.26, True)):
        size = (0.04, length, 0.06)
        with World(scene(box("left", 0.5, length / 2, size), box("right", 0.5, -length / 2 - 0.001, size))) as world:
            frame = world.render()
        found = Pipeline().locate(frame, frame.labels)
        assert len(found.clouds) == 1
        said = [sentence for sentence in found.notices if "target 1 is one lump of" in sentence]
        assert bool(said) == lump, found.notices
        assert not any("touch?" in sentence for sentence in found.notices)


def test_the_same_sentence_comes_from_the_pipeline_perceive_training_and_the_node(frame, tmp_path, capsys):
    wrong = shifted(frame, 12, 0)
    sentence = "depth lies (12, 0) pixels off the colours: is it aligned to colour, of one moment?"
    assert sentence in Pipeline().locate(wrong, frame.labels).notices

    seen = perceive.perceive(wrong, Pipeline(), labels=frame.labels, T_base_cam=frame.T_base_cam)
    assert f"notice: {sentence}" in perceive.describe(seen).splitlines()
    assert sentence in perceive.grasps_json(seen)["notices"]

    depth = np.round(1000.0 * wrong.depth).astype(np.uint16)
    for kind, image in {"color": wrong.rgb, "depth": depth, "mask": frame.labels}.items():
        (tmp_path / kind).mkdir()
        cv2.imwrite(str(tmp_path / kind / "a.png"), image)
    (tmp_path / "camera.txt").write_text(" ".join(map(str, (frame.K[0, 0], frame.K[1, 1], *frame.K[:2, 2]))))
    assert own_data.PictureFolder(tmp_path)[0].labels is not None
    assert sentence in capsys.readouterr().err

    bus, heard = Bus(), []
    bus.subscribe(Topics().diagnostics, Diagnostics, heard.append)
    node = SegmentationNode(Pipeline(lambda rgb: one_hot(frame.labels, 4)), bus)
    Camera(bus).publish(wrong)
    assert node.spin_once() and heard[-1].level == 1 and sentence in heard[-1].message
    node = SegmentationNode(Pipeline(lambda rgb: one_hot(frame.labels, 4)), bus)
    Camera(bus).publish(frame)
    assert node.spin_once() and (heard[-1].level, heard[-1].message) == (0, "answered")


def test_a_calibration_of_another_size_is_refused(frame, tmp_path):
    cv2.imwrite(str(tmp_path / "color.png"), frame.rgb)
    cv2.imwrite(str(tmp_path / "depth.png"), np.round(1000 * frame.depth).astype(np.uint16))
    facts = {"fx": 600, "fy": 600, "ppx": 320, "ppy": 180, "width": 640, "height": 360, "coeffs": [0.1, -0.2, 0, 0, 0]}
    (tmp_path / "camera.json").write_text(json.dumps(facts))
    camera = cameras.read_intrinsics(str(tmp_path / "camera.json"))
    assert camera.size == (640, 360) and camera.distortion == (0.1, -0.2, 0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="intrinsics: expected a calibration of pictures of 320 x 240, got one of 640"):
        perceive.read_frame(tmp_path / "color.png", tmp_path / "depth.png", camera)
    (tmp_path / "ros.yaml").write_text(
        "image_height: 240\nimage_width: 320\n"
        "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [300, 0, 160, 0, 300, 120, 0, 0, 1]\n"
        "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0.25, 0, 0, 0, 0]\n"
    )
    camera = cameras.read_intrinsics(str(tmp_path / "ros.yaml"))
    assert camera.size == (320, 240) and camera.distortion[0] == 0.25 and camera.K[0, 2] == 160.0


def test_a_lens_is_undone_before_anything_else(frame, tmp_path):
    """Pictures bent by the lens's formula come back; labels of what the lens did not see are unknown."""
    K, (k1, k2) = frame.K, (-0.3, 0.1)
    v, u = np.indices(frame.depth.shape)
    bent = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1]])
    straight = bent.copy()
    for _ in range(100):  # the pinhole's ray of each pixel of the bent picture
        r2 = (straight**2).sum(axis=0)
        straight = bent / (1 + k1 * r2 + k2 * r2**2)
    at = [(K[i, i] * straight[i] + K[i, 2]).astype(np.float32) for i in range(2)]
    depth = np.round(1000 * frame.depth).astype(np.uint16)
    for kind, image in {"color": frame.rgb[..., ::-1], "depth": depth, "mask": frame.labels}.items():
        (tmp_path / kind).mkdir()
        cv2.imwrite(str(tmp_path / kind / "a.png"), cv2.remap(image, *at, cv2.INTER_NEAREST))
    facts = {"fx": K[0, 0], "fy": K[1, 1], "ppx": K[0, 2], "ppy": K[1, 2], "coeffs": [k1, k2, 0, 0, 0]}
    (tmp_path / "camera.json").write_text(json.dumps(facts))

    read = own_data.PictureFolder(tmp_path)[0]
    inner = np.s_[20:-20, 20:-20]
    assert (np.abs(read.depth - frame.depth)[inner] < 0.01).mean() > 0.97
    assert (read.labels == frame.labels)[inner].mean() > 0.98
    unbent = RGBDFrame(frame.rgb, frame.depth, K, np.eye(4))
    assert np.abs(read.rgb.astype(float) - unbent.rgb)[inner].mean() < 4

    (tmp_path / "camera.json").write_text(json.dumps(facts | {"model": "kannala_brandt4"}))
    with pytest.raises(
        ValueError, match=r"got a fisheye or other wide lens \(kannala_brandt4\); rectify the pictures first"
    ):
        cameras.read_intrinsics(str(tmp_path / "camera.json"))
