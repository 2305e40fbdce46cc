"""labkit perceive: pictures of anybody's camera, judged by a simulated scene whose poses are known."""

import json
import re
import shutil
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import trimesh
from at_night import others_at_night
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

import data_gen
from data_gen import DepthSensor
from labcli import cameras, evaluate_folder, perceive, report
from labcli.cli import app
from labcli.own_data import PictureFolder
from labcli.pictures import Reading, read_shot
from labkit.geometry import back_project_to_base, project, transform_points
from labkit.grasp import Gripper
from labkit.labels import IGNORE, SURFACE, TARGET, one_hot
from labkit.pipeline import Pipeline
from labkit.sim.world import World

SIZE = (424, 240)  # not the size of any training


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    """A scene as a camera sees it who knows nothing else: files of colour and depth, a mask, the camera matrix."""
    folder = tmp_path_factory.mktemp("shot")
    spec = data_gen.sample_scene(900_005, "test")
    with World(spec) as world:
        frame = world.render(SIZE)
        centres = {thing.name: world.centre(thing.name) for thing in spec.objects if thing.class_id == TARGET}
    depth = DepthSensor().apply(frame, np.random.default_rng(0)).depth
    cv2.imwrite(str(folder / "color.png"), frame.rgb[..., ::-1])
    cv2.imwrite(str(folder / "depth.png"), np.rint(np.nan_to_num(depth) * 1000.0).astype(np.uint16))
    cv2.imwrite(str(folder / "mask.png"), np.where(frame.labels == TARGET, 255, 0).astype(np.uint8))
    fx, fy, cx, cy = frame.K[0, 0], frame.K[1, 1], frame.K[0, 2], frame.K[1, 2]
    return SimpleNamespace(folder=folder, spec=spec, frame=frame, centres=centres, K=f"{fx} {fy} {cx} {cy}")


def run(shot, out, *options: str, color="color.png", depth="depth.png", K=None):
    """Run the command on the shot's files."""
    files = [str(shot.folder / color), str(shot.folder / depth)]
    arguments = ["perceive", *files, "--intrinsics", K or shot.K, "--out", str(out), *options]
    done = CliRunner().invoke(app, arguments)
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done


def read(shot):
    """The shot as it is read from its files."""
    return read_shot(shot.folder / "color.png", shot.folder / "depth.png", cameras.read_intrinsics(shot.K))


def test_with_the_table_fitted_the_targets_are_where_the_simulator_has_them(shot, tmp_path):
    done = run(shot, tmp_path, "--mask", str(shot.folder / "mask.png"))
    said = json.loads((tmp_path / "grasps.json").read_text())
    T_cam_base = np.linalg.inv(said["T_base_cam"])
    true_T_cam_base = np.linalg.inv(shot.frame.T_base_cam)
    assert np.degrees(np.arccos(T_cam_base[:3, 2] @ true_T_cam_base[:3, 2])) < 0.3, "the table's normal"
    height = shot.frame.T_base_cam[2, 3] - shot.spec.table.z
    assert said["T_base_cam"][2][3] == pytest.approx(height, abs=0.003), "the camera's height over the table"
    for target in said["targets"]:
        P_cam = transform_points(T_cam_base, np.array([target["centroid"]]))
        P_base = transform_points(shot.frame.T_base_cam, P_cam)[0]
        assert min(np.linalg.norm(P_base - centre) for centre in shot.centres.values()) < 0.04
    assert "lie on one plane" in done.output and "best grasp" in done.output


def test_a_given_pose_gives_the_grasps_of_the_pipeline_itself(shot, tmp_path):
    T = shot.frame.T_base_cam
    pose = " ".join(map(str, [*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_quat()]))
    mask = str(shot.folder / "mask.png")
    run(shot, tmp_path, "--camera-pose", pose, "--table-z", str(shot.spec.table.z), "--mask", mask)
    said = json.loads((tmp_path / "grasps.json").read_text())
    frame = read(shot).frame
    frame = type(frame)(frame.rgb, frame.depth, frame.K, T, table_z=shot.spec.table.z)
    labels = np.where(shot.frame.labels == TARGET, TARGET, 0)
    best = Pipeline().locate(frame, labels).plan.grasps[0]
    assert np.allclose(said["grasps"][0]["T_base_grasp"], best.T_base_grasp, atol=1e-3)
    assert np.allclose(np.array(said["T_base_cam"]) @ said["grasps"][0]["T_cam_grasp"], best.T_base_grasp, atol=1e-3)


def test_clouds_and_report_hold_what_was_seen(shot, tmp_path):
    (tmp_path / "target_7.ply").write_text("of an earlier picture")
    run(shot, tmp_path, "--mask", str(shot.folder / "mask.png"))
    said = json.loads((tmp_path / "grasps.json").read_text())
    clouds = sorted(tmp_path.glob("target_*.ply"))
    assert len(clouds) == len(said["targets"])
    first = trimesh.load(clouds[0])
    assert len(first.vertices) == said["targets"][0]["points"]
    assert np.allclose(first.vertices.mean(axis=0), said["targets"][0]["centroid"], atol=1e-5)
    report = (tmp_path / "report.html").read_bytes()
    assert len(report) < 6e6
    outside_scripts = re.sub(rb"<script[^>]*>.*?</script>", b"", report, flags=re.DOTALL)
    assert not re.search(rb'(?:src|href)="(?!data:)', outside_scripts) and b"<script src" not in report
    assert cv2.imread(str(tmp_path / "overlay.png")).shape == shot.frame.rgb.shape


def test_a_network_labels_the_picture_and_no_target_is_an_answer_with_a_reason(shot, tmp_path):
    done = run(shot, tmp_path, "--model", "unet")
    assert "target 1:" in done.output and "certainty 0." in done.output
    cv2.imwrite(str(shot.folder / "nothing.png"), np.zeros(SIZE[::-1], np.uint8))
    done = run(shot, tmp_path, "--mask", str(shot.folder / "nothing.png"))
    assert done.exit_code == 0 and "no grasp: no target points" in done.output
    assert json.loads((tmp_path / "grasps.json").read_text())["reason"] == "no target points"


def test_where_nothing_is_near_the_table_a_report_says_so(shot, tmp_path):
    """As with the height of another table: the picture and the notice are what its user needs."""
    pose = "0.5 0 0.8 1 0 0 0"
    done = run(shot, tmp_path, "--anything", "--camera-pose", pose, "--table-z", "2.5")
    assert done.exit_code == 0 and "notice: the camera stands -1.70 m over the table" in done.output
    assert json.loads((tmp_path / "grasps.json").read_text())["grasps"] == [] and (tmp_path / "report.html").is_file()


def targets_of(folder):
    """The pixels of each target that a run wrote down, largest first."""
    numbers = cv2.imread(str(folder / "targets.png"), cv2.IMREAD_UNCHANGED)
    return [numbers == n for n in range(1, numbers.max() + 1)]


def test_with_anything_whatever_stands_on_the_table_is_a_target(shot, tmp_path):
    """Two of the seven stand behind others, with half of them hidden."""
    done = run(shot, tmp_path, "--anything")
    assert "best grasp" in done.output
    found = targets_of(tmp_path)
    large = [shot.frame.instances == n for n in np.unique(shot.frame.instances) if n]
    large = [mask for mask in large if mask.sum() > 200]
    hits = [max(np.sum(f & true) / np.sum(f | true) for f in found) > 0.5 for true in large]
    assert sum(hits) >= len(large) - 2


def test_the_thing_at_a_pixel_is_the_only_target_and_a_pixel_of_the_table_says_so(shot, tmp_path):
    number = np.bincount(shot.frame.instances[shot.frame.instances > 0]).argmax()
    true = shot.frame.instances == number
    v, u = np.argwhere(true)[np.count_nonzero(true) // 2]
    done = run(shot, tmp_path, "--at", f"{u},{v}")
    (found,) = targets_of(tmp_path)
    assert np.sum(found & true) / np.sum(found | true) > 0.5 and "target 1:" in done.output
    v, u = np.argwhere(shot.frame.labels == SURFACE)[-1]
    done = run(shot, tmp_path / "table", "--at", f"{u},{v}")
    assert done.exit_code == 0 and f"no thing was found at ({u}, {v})" in done.output


def test_a_mask_of_instances_gives_a_target_each_for_the_hand_and_the_workspace_that_are_given(shot, tmp_path):
    mask = str(shot.folder / "instances.png")
    cv2.imwrite(mask, shot.frame.instances)
    run(shot, tmp_path, "--mask", mask, "--instances", "--gripper", "max_opening=0.03")
    found = targets_of(tmp_path)
    assert len(found) == len(np.unique(shot.frame.instances[shot.frame.instances > 0]))
    assert all(len(np.unique(shot.frame.instances[target])) == 1 for target in found), "one object each"
    said = json.loads((tmp_path / "grasps.json").read_text())
    assert all(grasp["width"] <= 0.03 for grasp in said["grasps"])
    run(shot, tmp_path, "--mask", mask, "--target", "2", "--workspace", "-9 9 -9 9 0.02 0.5")
    (target,) = targets_of(tmp_path)
    assert np.all(shot.frame.instances[target] == 2)
    height = trimesh.load(tmp_path / "target_1.ply").vertices[:, 2]
    assert height.min() > 0.02, "nothing below the workspace"


def test_a_gripper_is_words_or_a_file(tmp_path):
    file = tmp_path / "hand.json"
    file.write_text('{"max_opening": 0.14, "palm_length": 0.22}')
    assert perceive.read_gripper(str(file)) == perceive.read_gripper("max_opening=0.14, palm_length=0.22")
    assert perceive.read_gripper("") == Gripper()


HOSTILE = {
    "deep": '{"a":' * 3000 + "1" + "}" * 3000,
    "cyclic": "a: &a\n  b: *a\n",
    "400 digits": '{"max_opening": ' + "1" * 400 + "}",
    "lists": "[[1]]",
    "a number": "5",
    "nothing": "",
}


@pytest.mark.parametrize("content", HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_file_of_a_gripper_is_refused_in_words(content, tmp_path):
    (tmp_path / "hand.json").write_text(content)
    with pytest.raises(ValueError, match=r"^(gripper|max_opening): expected"):
        perceive.read_gripper(str(tmp_path / "hand.json"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"options": ["--gripper", "wide"]}, 'gripper: expected "NAME=METRES ..." or a JSON or YAML file'),
        ({"options": ["--gripper", "opening=0.1"]}, "gripper: expected measures of max_opening, pad_width"),
        ({"options": ["--gripper", "max_opening=140"]}, "max_opening: expected metres above 0 and below 1"),
        ({"options": ["--workspace", "0 1 0 1"]}, "workspace: expected six numbers"),
        ({"options": ["--workspace", "1 0 0 1 0 1"]}, "workspace: expected from < to"),
        ({"options": ["--instances"]}, "instances: expected --mask FILE"),
        ({"options": ["--anything", "--target", "3"]}, "anything: expected neither --mask nor --target"),
        ({"options": ["--target", "9"]}, "target_class: expected"),
        ({"color": "depth.png", "depth": "color.png"}, "swapped"),
        ({"depth": "mask.png"}, "it is a picture of depth, in which distances are shades or colours"),
        ({"options": ["--depth-scale", "1.0"]}, "depth_scale: with 1 metres per unit the median depth"),
        ({"options": ["--depth-scale", "0"]}, "depth_scale: expected"),
        ({"options": ["--at", "12"]}, "at: expected"),
        ({"options": ["--at", "424,0"]}, "at: expected a pixel (u, v) of the picture of 424 x 240"),
        ({"options": ["--not", "12,20"]}, "not: expected --at U,V beside it"),
        ({"options": ["--at", "12,20", "--not", "12"]}, 'not: expected two numbers "u,v"'),
        ({"options": ["--at", "12,20", "--not", "0,240"]}, "not: expected a pixel (u, v) of the picture of 424 x 240"),
        ({"options": ["--at", "12,20", "--not", "12,20"]}, "not_at: expected other pixels than `at`"),
        ({"options": ["--anything", "--model", "unet"]}, "model: expected a network that tells things apart"),
        ({"options": ["--depth-scale", "1e-6"]}, "0.001 makes it 0."),
        ({"color": "small.png"}, "align depth to colour"),
        ({"options": ["--mask", "small_mask.png"]}, "mask: expected the colour picture's size, 424 x 240, in "),
        ({"options": ["--mask", "grey_mask.png"]}, "--instances takes each for an object"),
        ({"K": "600 600 320"}, "intrinsics: expected"),
        (
            {"options": ["--camera-pose", "1 2 3"]},
            'camera_pose: expected "x y z qx qy qz qw", a matrix of 4x4 or 3x4, or a file',
        ),
        ({"options": ["--plane", "auto", "--camera-pose", "0 0 1 1 0 0 0"]}, "plane: expected either"),
    ],
)
def test_wrong_input_is_one_clear_line(shot, tmp_path, change, message):
    cv2.imwrite(str(shot.folder / "small.png"), shot.frame.rgb[::2, ::2])
    cv2.imwrite(str(shot.folder / "small_mask.png"), np.zeros((120, 212), np.uint8))
    cv2.imwrite(str(shot.folder / "grey_mask.png"), np.tile(np.arange(SIZE[0]) % 200, (SIZE[1], 1)).astype(np.uint8))
    options = [str(shot.folder / o) if o.endswith(".png") else o for o in change.pop("options", [])]
    with pytest.raises((ValueError, OSError), match=re.escape(message)):
        run(shot, tmp_path / "out", *options, **change)
    assert not (tmp_path / "out").exists()


@pytest.mark.bad_input
def test_a_place_that_cannot_be_written_is_said_before_anything_is_read(shot, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(NotADirectoryError, match="a file stands where a folder is wanted"):
        run(shot, tmp_path / "file" / "out", color="nowhere.png")


@pytest.mark.parametrize(
    ("name", "content", "scale"),
    [
        ("realsense.json", '{"width": 640, "fx": 600, "fy": 601, "ppx": 320, "ppy": 240}', None),
        ("camera.json", '{"fx": 600.0, "fy": 601.0, "cx": 320.0, "cy": 240.0, "depth_scale": 0.1}', 0.1),
        ("scene_camera.json", '{"12": {"cam_K": [600, 0, 320, 0, 601, 240, 0, 0, 1], "depth_scale": 1.0}}', 1.0),
        ("open3d.json", '{"width": 640, "intrinsic_matrix": [600, 0, 0, 0, 601, 0, 320, 240, 1]}', None),
        (
            "ros.yaml",
            "image_width: 640\ncamera_matrix:\n  rows: 3\n  data: [600, 0, 320, 0, 601, 240, 0, 0, 1]\n",
            None,
        ),
        (
            "opencv.yml",
            "%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
            "   data: [ 600., 0., 320., 0., 601., 240., 0., 0., 1. ]\n",
            None,
        ),
        ("K.txt", "600 0 320\n0 601 240\n0 0 1\n", None),
    ],
)
def test_camera_files_of_the_usual_kinds_are_read(tmp_path, name, content, scale):
    (tmp_path / name).write_text(content)
    found = cameras.read_intrinsics(str(tmp_path / name))
    assert found.K.tolist() == [[600.0, 0.0, 320.0], [0.0, 601.0, 240.0], [0.0, 0.0, 1.0]]
    assert found.depth_scale == scale


@pytest.mark.parametrize("content", ["{}", '{"fx": 1}', "[1, 2]", "nothing", "", '{"a": {"b": {}}}'])
def test_a_file_without_a_camera_is_refused(tmp_path, content):
    (tmp_path / "camera.json").write_text(content)
    with pytest.raises(ValueError, match="found no camera matrix"):
        cameras.read_intrinsics(str(tmp_path / "camera.json"))


@pytest.fixture
def own(shot, tmp_path):
    """A folder of one picture of somebody's own camera, with its mask."""
    for kind in ("color", "depth", "mask"):
        (tmp_path / kind).mkdir()
    cv2.imwrite(str(tmp_path / "color" / "a.png"), shot.frame.rgb[..., ::-1])
    cv2.imwrite(str(tmp_path / "mask" / "a.png"), shot.frame.labels)
    shutil.copy(shot.folder / "depth.png", tmp_path / "depth" / "a.png")
    (tmp_path / "camera.txt").write_text(shot.K)
    return tmp_path


def test_a_folder_of_ones_own_pictures_is_a_data_set(shot, own, capsys):
    """Frames with labels, on a table that was found where it is."""
    (frame,) = PictureFolder(own)[:]
    assert np.array_equal(frame.labels, shot.frame.labels) and np.array_equal(frame.rgb, shot.frame.rgb)
    z = back_project_to_base(frame.depth, frame.K, frame.T_base_cam)[frame.labels == SURFACE, 2]
    assert abs(np.nanmedian(z) - frame.table_z) < 0.002
    assert "no mask has a pixel of surface" not in capsys.readouterr().err
    cv2.imwrite(str(own / "mask" / "a.png"), np.where(shot.frame.labels == TARGET, 200, shot.frame.labels))
    with pytest.raises(ValueError, match=r"mask: expected classes 0 to 3, or 255, in .*a\.png"):
        PictureFolder(own)[0]
    (own / "camera.txt").unlink()
    with pytest.raises(FileNotFoundError, match=r"camera\.json"):
        PictureFolder(own)
    with pytest.raises(FileNotFoundError, match="color/, depth/ and mask/"):
        PictureFolder(own / "mask")


def test_a_pose_beside_a_picture_of_a_folder_is_taken(shot, own, tmp_path, capsys):
    """pose/NAME.txt, as `labkit photos` writes it: perceive, train and evaluate read it, and say so."""
    T = np.eye(4)
    T[:3, 3] = (0.0, 0.0, -shot.spec.table.z)
    T = T @ shot.frame.T_base_cam
    (own / "pose").mkdir()
    (own / "pose" / "a.txt").write_text(" ".join(map(str, [*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_quat()])))
    assert np.allclose(PictureFolder(own)[0].T_base_cam, T, atol=1e-6)
    assert "pose/ says where the camera was for 1 of them" in capsys.readouterr().err
    seen = []
    evaluate_folder.judge(
        evaluate_folder.TrueThings(own), lambda frame: seen.append(frame) or seen[0].depth.astype(int) * 0
    )
    assert np.allclose(seen[0].T_base_cam, T, atol=1e-6) and seen[0].table_z == 0.0
    arguments = ["perceive", own / "color" / "a.png", own / "depth" / "a.png", "--intrinsics", shot.K, "--mask"]
    arguments = [*map(str, arguments), str(own / "mask" / "a.png"), "--out", str(tmp_path / "out")]
    said = CliRunner().invoke(app, arguments).output
    assert f"camera_pose: {own / 'pose' / 'a.txt'}, which lies beside the picture" in said.replace("\n", "")
    assert np.allclose(json.loads((tmp_path / "out" / "grasps.json").read_text())["T_base_cam"], T, atol=1e-6)
    said = CliRunner().invoke(app, [*arguments, "--plane", "auto"]).output
    assert "lies beside" not in said and "lie on one plane" in said
    (own / "pose" / "a.txt").write_text("nothing")
    with pytest.raises(ValueError, match="camera_pose: expected"):
        PictureFolder(own)


@pytest.mark.parametrize("value", others_at_night([1, 2, 3, 200, 255, 3000], by_day=(1, 2, 3000)))
def test_masks_of_0_and_one_other_value_mean_the_same_in_perceive_and_train(shot, own, tmp_path, capsys, value):
    """The value is the target, which is said where the kit has another class of that number."""
    target = shot.frame.labels == TARGET
    path = own / "mask" / "a.png"
    cv2.imwrite(str(path), np.where(target, value, 0).astype(np.uint16 if value > 255 else np.uint8))
    labels, _, _ = perceive.read_mask(path, read(shot))
    assert np.array_equal(labels == TARGET, target) and np.array_equal(PictureFolder(own)[0].labels == TARGET, target)
    said = f"{value} is taken for the target, not for the class"
    assert (said in capsys.readouterr().err) == (value in (1, 3))
    out = run(shot, tmp_path / "out", "--mask", str(path)).output
    assert (f"notice: the mask holds 0 and {value} alone: {said}" in out) == (value in (1, 3))


def test_one_value_is_the_target_only_if_no_mask_has_another(shot, own, capsys):
    """A picture of an empty table among others holds 0 and 1, and 1 is surface."""
    for kind in ("color", "depth"):
        shutil.copy(own / kind / "a.png", own / kind / "b.png")
    empty = np.where(shot.frame.labels == SURFACE, 1, 0).astype(np.uint8)
    cv2.imwrite(str(own / "mask" / "b.png"), empty)
    assert np.array_equal(PictureFolder(own)[1].labels, empty) and "is taken for" not in capsys.readouterr().err


def test_masks_that_do_not_say_what_is_table_let_depth_say_it(shot, own, capsys):
    """Else a network learns that the table is background, and every picture is unlike its training's."""
    shutil.copy(shot.folder / "mask.png", own / "mask" / "a.png")
    (frame,) = PictureFolder(own)[:]
    assert (
        "no mask has a pixel of surface, 1: what is 0 on the table's plane is taken for it" in capsys.readouterr().err
    )
    both = (frame.labels != IGNORE) & (shot.frame.labels == SURFACE)
    assert np.mean(frame.labels[both] == SURFACE) > 0.95, "of the table with depth"
    assert np.mean(shot.frame.labels[frame.labels == SURFACE] == SURFACE) > 0.95
    assert np.array_equal(frame.labels == IGNORE, (frame.depth == 0.0) & (shot.frame.labels != TARGET))

    def as_learnt(rgb):
        return one_hot(np.where(frame.labels == IGNORE, SURFACE, frame.labels)).astype(float)

    assert not any("unlike the training's" in sentence for sentence in Pipeline(as_learnt).run(frame).notices)


def test_masks_of_instances_may_have_16_bits_and_more_than_255_objects(shot, tmp_path):
    numbers = 300 * shot.frame.instances.astype(np.uint16)
    cv2.imwrite(str(tmp_path / "instances.png"), numbers)
    labels, found, _ = perceive.read_mask(tmp_path / "instances.png", read(shot), instances=True)
    assert np.array_equal(found, numbers) and np.array_equal(labels == TARGET, numbers > 0)
    done = run(shot, tmp_path, "--mask", str(tmp_path / "instances.png"), "--instances")
    assert done.exit_code == 0 and done.output.count("points around") == len(np.unique(numbers)) - 1


def test_a_picture_that_cannot_be_used_is_named_and_left_out(shot, own, capsys):
    """The others are a data set; what is said of them, and the share of each class, is said once."""
    (own / "color" / "notes.txt").write_text("taken on Monday")
    for kind, image in (("color", shot.frame.rgb), ("mask", shot.frame.labels)):
        cv2.imwrite(str(own / kind / "b.png"), image)  # has no depth
    folder = PictureFolder(own)
    said = capsys.readouterr().err
    assert [path.name for path in folder.pictures] == ["a.png"] and len(folder[:]) == 1
    assert f"{own / 'color' / 'b.png'} is left out:" in said and str(own / "depth" / "b.png") in said
    assert "notes.txt is left out: color:" in said and f"{own}: 1 of 3 pictures; " in said
    assert f"target {np.mean(shot.frame.labels == TARGET):.1%}" in said and capsys.readouterr().err == ""


def test_the_depth_unit_of_a_folder_can_be_given(own):
    (usual,) = PictureFolder(own)[:]
    depth = cv2.imread(str(own / "depth" / "a.png"), cv2.IMREAD_UNCHANGED)
    cv2.imwrite(str(own / "depth" / "a.png"), 4 * depth)
    assert np.allclose(PictureFolder(own, Reading(0.00025))[0].depth, usual.depth)


def test_jaws_are_drawn_where_the_camera_would_see_them(shot):
    seen = perceive.perceive(shot.frame, Pipeline(), labels=shot.frame.labels, T_base_cam=shot.frame.T_base_cam)
    drawn = report.with_grasps(shot.frame, seen.perception.plan.grasps)
    best = seen.perception.plan.grasps[0]
    v, u = np.nonzero((drawn != shot.frame.rgb).any(axis=2))
    P_cam = transform_points(np.linalg.inv(shot.frame.T_base_cam), best.T_base_grasp[:3, 3])
    middle = np.array([u, v]).mean(axis=1)
    assert np.linalg.norm(middle - np.ravel(project(P_cam, shot.frame.K))) < 25.0
    assert np.array_equal(report.with_grasps(shot.frame, ()), shot.frame.rgb)
