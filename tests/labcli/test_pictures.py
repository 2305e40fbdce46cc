"""Colour, depth and masks as cameras, phones and programs save them, judged by a scene that is known by formula."""

import json
import os
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from at_night import others_at_night
from camera_files import FILES
from PIL import Image, ImageOps
from scenes import png_that_claims
from typer.testing import CliRunner

from labcli import evaluate_folder
from labcli.arrays import open_array
from labcli.cameras import read_intrinsics
from labcli.cli import app
from labcli.own_data import PictureFolder
from labcli.perceive import on_table
from labcli.pictures import Reading, read_shot
from labkit.frame import RGBDFrame
from labkit.geometry import back_project, find_tables

W, H = 320, 240
K = np.array([[300.0, 0.0, 159.5], [0.0, 300.0, 119.5], [0.0, 0.0, 1.0]])
TILT = np.radians(35.0)  # off the vertical
NORMAL = np.array([0.0, -np.sin(TILT), -np.cos(TILT)])  # of the table, in the camera's frame
AWAY = 0.7  # metres from the table


def depth_of(K, size, block: bool = True):
    """Exact depth of a table 0.7 m away, seen at a tilt, with a block of 6 x 6 x 5 cm in its middle."""
    v, u = np.indices(size[::-1])
    rays = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(u.shape)], axis=-1)
    depth = -AWAY / (rays @ NORMAL)
    along = np.array([0.0, np.cos(TILT), -np.sin(TILT)])  # on the table, away from x
    if block:
        axes = np.stack([[1.0, 0.0, 0.0], along, NORMAL])
        corner, far = np.array([-0.03, -0.03, -AWAY]), np.array([0.03, 0.03, -AWAY + 0.05])
        slopes = rays @ axes.T
        centre = axes @ (np.array([0.0, 0.0, AWAY / np.cos(TILT)]))
        corner[:2] += centre[:2]
        far[:2] += centre[:2]
        with np.errstate(divide="ignore"):
            near, beyond = corner / slopes, far / slopes
        enters, leaves = np.minimum(near, beyond).max(axis=-1), np.maximum(near, beyond).min(axis=-1)
        depth = np.where((enters < leaves) & (enters > 0.0), np.minimum(enters, depth), depth)
    return depth.astype(np.float32)


DEPTH = depth_of(K, (W, H))
THING = np.abs(DEPTH - depth_of(K, (W, H), block=False)) > 1e-6
RGB = np.where(THING[..., None], (180, 40, 40), (120, 160, 120)).astype(np.uint8)
UNITS = np.rint(1000.0 * DEPTH).astype(np.uint16)


@pytest.fixture
def files(tmp_path):
    """Colour, depth in millimetres, the block's mask, and the camera, in files."""
    cv2.imwrite(str(tmp_path / "color.png"), RGB[..., ::-1])
    cv2.imwrite(str(tmp_path / "depth.png"), UNITS)
    cv2.imwrite(str(tmp_path / "mask.png"), np.where(THING, 255, 0).astype(np.uint8))
    (tmp_path / "camera.json").write_text(json.dumps(facts()))
    return tmp_path


def facts(**more) -> dict:
    return {"fx": 300.0, "fy": 300.0, "cx": 159.5, "cy": 119.5, "width": W, "height": H, **more}


def camera(files, **more):
    (files / "camera.json").write_text(json.dumps(facts(**more)))
    return read_intrinsics(str(files / "camera.json"))


def perceived(files, *options, color="color.png", depth="depth.png", intrinsics="camera.json", mask="mask.png"):
    """Run the command; returns what it says, and the grasps that it wrote."""
    arguments = ["perceive", str(files / color), str(files / depth), "--intrinsics", str(files / intrinsics)]
    arguments += ["--mask", str(files / mask), "--out", str(files / "out"), *options]
    done = CliRunner().invoke(app, arguments)
    if done.exception is not None:
        raise done.exception
    return done.output, json.loads((files / "out" / "grasps.json").read_text())


def written(kind: str, path, metres: np.ndarray) -> None:
    """Write depth as a program of that kind does."""
    if kind == "npy":
        np.save(path, metres)
    elif kind == "npz":
        np.savez_compressed(path, depth=metres, K=K)
    elif kind == "exr":
        exr = pytest.importorskip("OpenEXR")
        exr.File({"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage}, {"R": metres}).write(str(path))
    else:
        cv2.imwrite(str(path), metres)


# ------------------------------------------------------------------------------- from file to grasp, in one command


@pytest.mark.parametrize("kind", others_at_night(["tiff", "pfm", "npy", "npz", "exr"], by_day=("tiff", "npz")))
def test_depth_in_float_metres_gives_the_grasp_of_millimetres(kind, files):
    """NaN and infinity are no reading; the unit needs no word."""
    metres = DEPTH.copy()
    metres[:3], metres[3:6] = np.nan, np.inf
    written(kind, files / f"depth.{kind}", metres)
    shot = read_shot(files / "color.png", files / f"depth.{kind}", camera(files))
    assert not shot.frame.depth[:6].any() and np.allclose(shot.frame.depth[6:], DEPTH[6:], atol=1e-6)
    _, ours = perceived(files, depth=f"depth.{kind}")
    _, usual = perceived(files)
    assert np.allclose(ours["grasps"][0]["T_cam_grasp"], usual["grasps"][0]["T_cam_grasp"], atol=3e-3)
    assert ours["targets"][0]["points"] == pytest.approx(usual["targets"][0]["points"], abs=20)


def test_float64_and_one_array_of_any_name_and_fortran_order_are_read_too(files):
    cv2.imwrite(str(files / "depth.tiff"), DEPTH.astype(np.float64))
    np.savez(files / "depth.npz", anything=DEPTH[None])
    np.save(files / "depth.npy", np.asfortranarray(DEPTH))
    for end in ("tiff", "npz", "npy"):
        assert np.array_equal(read_shot(files / "color.png", files / f"depth.{end}", camera(files)).frame.depth, DEPTH)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", FILES)
def test_a_camera_of_each_format_leads_to_a_grasp_in_one_command(kind, files):
    name, content, *_ = FILES[kind]
    (files / name).write_text(content)
    K, size = np.array([[600.0, 0.0, 320.0], [0.0, 601.0, 240.0], [0.0, 0.0, 1.0]]), (640, 480)
    depth, table = (depth_of(K, size, block) for block in (True, False))
    units = 5000.0 if kind == "ORB-SLAM" else 10_000.0 if "BOP" in kind or "cam_K" in kind else 1000.0
    cv2.imwrite(str(files / "depth.png"), np.rint(units * depth).astype(np.uint16))
    cv2.imwrite(str(files / "color.png"), cv2.resize(RGB, size)[..., ::-1])
    cv2.imwrite(str(files / "mask.png"), np.where(np.abs(depth - table) > 1e-6, 255, 0).astype(np.uint8))
    out, said = perceived(files, intrinsics=name)
    assert "best grasp: target 1" in out
    closes_at = np.array(said["grasps"][0]["T_cam_grasp"])[:3, 3]
    assert np.linalg.norm(closes_at - [0.0, 0.0, AWAY / np.cos(TILT) - 0.03]) < 0.05


APPS = {
    "Stray Scanner": ("camera_matrix.csv", lambda K: "\n".join(",".join(map(str, row)) for row in K.tolist())),
    "Record3D": ("metadata", lambda K: json.dumps({"K": K.T.ravel().tolist(), "w": 1920, "h": 1440})),
    "Polycam": (
        "1700.json",
        lambda K: json.dumps(
            {"fx": K[0, 0], "fy": K[1, 1], "cx": K[0, 2], "cy": K[1, 2], "width": 1920, "height": 1440}
            | {f"t_{i}{j}": float(i == j) for i in range(3) for j in range(4)}
        ),
    ),
    "--aligned": ("camera.txt", lambda K: " ".join(map(str, (K[0, 0], K[1, 1], K[0, 2], K[1, 2])))),
}
PHONE = np.array([[1800.0, 0.0, 959.5], [0.0, 1800.0, 719.5], [0.0, 0.0, 1.0]])  # 1920 x 1440, the view of K


@pytest.fixture
def phone(files):
    """A phone's files: colour 1920 x 1440, depth 256 x 192 of the same view, and how sure it is."""
    (files / "depth").mkdir()
    size, small = (1920, 1440), (256, 192)
    color = cv2.resize(RGB, size, interpolation=cv2.INTER_NEAREST)
    cv2.imwrite(str(files / "color.png"), color[..., ::-1])
    K_small = PHONE.copy()
    K_small[:2] *= 256 / 1920
    K_small[:2, 2] += 0.5 * 256 / 1920 - 0.5
    millimetres = np.rint(1000.0 * depth_of(K_small, small)).astype(np.uint16)
    cv2.imwrite(str(files / "depth" / "000.png"), millimetres)
    mask = np.where(cv2.resize(THING.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0, 255, 0)
    cv2.imwrite(str(files / "mask.png"), mask.astype(np.uint8))
    return files


@pytest.mark.parametrize("app_name", APPS)
def test_a_phones_depth_is_brought_to_its_colours(app_name, phone):
    name, content = APPS[app_name]
    (phone / name).write_text(content(PHONE))
    options = ["--aligned"] if app_name == "--aligned" else []
    out, said = perceived(phone, *options, depth="depth/000.png", intrinsics=name)
    assert "color: 1920 x 1440 is made 640 x 480" in out and "best grasp: target 1" in out
    reading = Reading(aligned=bool(options))
    shot = read_shot(phone / "color.png", phone / "depth" / "000.png", read_intrinsics(str(phone / name)), reading)
    exact = depth_of(shot.frame.K, (640, 480))
    assert shot.frame.size == (640, 480) and np.allclose(shot.frame.K[:2, 2], [319.5, 239.5])
    off = np.abs(shot.frame.depth - exact)
    assert np.mean(off < 0.002) > 0.97, "but at the block's edges"
    tables = find_tables(back_project(shot.frame.depth, shot.frame.K))
    assert tables[0].plane.normal @ NORMAL > 0.9999 and tables[0].plane.offset == pytest.approx(AWAY, abs=0.001)
    centre = np.array(said["targets"][0]["centroid"]) @ np.array(said["T_base_cam"])[:3, :3]
    assert said["targets"][0]["points"] > 1000 and np.isfinite(centre).all()


def test_what_an_app_trusts_least_is_no_reading(phone):
    (phone / "confidence").mkdir()
    (phone / "camera_matrix.csv").write_text(APPS["Stray Scanner"][1](PHONE))
    files = phone / "color.png", phone / "depth" / "000.png", read_intrinsics(str(phone / "camera_matrix.csv"))
    for high in (2, 255):  # ARKit's own numbers; Polycam's
        confidence = np.full((192, 256), high, np.uint8)
        confidence[:, :64], confidence[:, 64:128] = 0, (high + 1) // 2
        cv2.imwrite(str(phone / "confidence" / "000.png"), confidence)
        shot = read_shot(*files)
        assert not shot.frame.depth[:, :160].any() and (shot.frame.depth[:, 160:] > 0.0).all()
        assert any(sentence.startswith("confidence: 25% of depth is left out, as ") for sentence in shot.said)


def test_a_pixel_and_a_mask_of_the_large_picture_are_found_in_the_small_one(phone):
    (phone / "camera_matrix.csv").write_text(APPS["Stray Scanner"][1](PHONE))
    shot = read_shot(
        phone / "color.png", phone / "depth" / "000.png", read_intrinsics(str(phone / "camera_matrix.csv"))
    )
    assert shot.pixel(959.5, 719.5) == (319.5, 239.5) and shot.pixel(0.0, 0.0) == (0.0, 0.0)
    with pytest.raises(ValueError, match=r"^at: expected a pixel \(u, v\) of the picture of 1920 x 1440"):
        shot.pixel(1920.0, 3.0)
    mask = cv2.imread(str(phone / "mask.png"), cv2.IMREAD_UNCHANGED)
    small = cv2.resize(THING.astype(np.uint8), (640, 480), interpolation=cv2.INTER_NEAREST)
    assert np.mean((shot.labels_like(mask) > 0) == small) > 0.995


@pytest.mark.parametrize(
    ("size", "says"),
    [((256, 192), "align depth to colour first, or say --aligned"), ((256, 144), "align depth to colour first$")],
)
def test_depth_of_another_view_stays_refused(size, says, files):
    cv2.imwrite(str(files / "depth.png"), cv2.resize(UNITS, size, interpolation=cv2.INTER_NEAREST))
    with pytest.raises(
        ValueError, match=f"^depth: expected the size of the colour picture, got 320 x 240 and .*{says}"
    ):
        perceived(files)
    if size == (256, 144):
        with pytest.raises(ValueError, match=r"align depth to colour first$"):
            perceived(files, "--aligned")


# -------------------------------------------------------------------------------- a phone that was held on its side


def held(files, orientation: int, depth_is_shown: bool, already: bool = False):
    """The scene as a phone held so writes it, and what `labkit calibrate` says of its camera."""

    def shown(image):  # Pillow is the judge of what EXIF's numbers say
        picture = Image.fromarray(image)
        picture.getexif()[0x0112] = orientation
        return np.array(ImageOps.exif_transpose(picture))

    note = Image.Exif()
    note[0x0112] = orientation
    rgb, units = shown(RGB), shown(UNITS.astype(np.int32))
    Image.fromarray(rgb if already else RGB).save(files / "color.png", **({} if already else {"exif": note}))
    cv2.imwrite(str(files / "depth.png"), units.astype(np.uint16) if depth_is_shown else UNITS)
    cv2.imwrite(str(files / "mask.png"), shown(MASK))
    h, w = units.shape
    camera = {"fx": 300.0, "fy": 300.0, "cx": (w - 1) / 2, "cy": (h - 1) / 2, "width": w, "height": h}
    (files / "camera.json").write_text(json.dumps(camera | {"exif_orientation": orientation}))
    return rgb, units


MASK = np.where(THING, 255, 0).astype(np.uint8)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_picture_is_turned_as_its_calibration_was(orientation, files):
    """Colour and depth as the sensor has them, however the phone was held."""
    rgb, units = held(files, orientation, depth_is_shown=False)
    shot = read_shot(files / "color.png", files / "depth.png", read_intrinsics(str(files / "camera.json")))
    assert np.array_equal(shot.frame.rgb, rgb) and np.allclose(shot.frame.depth, 0.001 * units)
    assert shot.file_size == rgb.shape[1::-1] and shot.pixel(3.0, 5.0) == (3.0, 5.0)
    assert any("exif_orientation" in sentence for sentence in shot.said) == (orientation != 1)
    mask = cv2.imread(str(files / "mask.png"), cv2.IMREAD_UNCHANGED)
    assert np.array_equal(shot.labels_like(mask), mask)
    if orientation >= 5:  # on its side it has another size
        assert np.array_equal(shot.labels_like(MASK), mask)


@pytest.mark.parametrize("depth_is_shown", [False, True])
@pytest.mark.parametrize("already", others_at_night([False, True]))
def test_a_portrait_picture_and_its_calibration_lead_to_the_grasp_of_the_sensors(depth_is_shown, already, files):
    _, usual = perceived(files)
    held(files, 6, depth_is_shown or already, already)
    out, ours = perceived(files)
    assert ("exif_orientation 6" in out) != already
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # clockwise in the picture
    places = [np.array(said["grasps"][0]["T_cam_grasp"])[:3, 3] for said in (usual, ours)]
    assert np.allclose(quarter @ places[0], places[1], atol=5e-3)
    assert ours["targets"][0]["points"] == pytest.approx(usual["targets"][0]["points"], abs=20)


# ---------------------------------------------------------------------------------------------------- depth's unit


@pytest.mark.parametrize(
    ("stated", "factor", "meaning"),
    [
        (0.001, 1000, "metres per unit"),
        (1.0, 1000, "millimetres per unit"),
        (0.1, 10_000, "millimetres per unit"),
        (1000.0, 1000, "units per metre"),
        (5000.0, 5000, "units per metre"),
    ],
)
@pytest.mark.parametrize("inside", [True, False])
def test_a_files_depth_scale_is_taken_for_what_makes_this_picture_possible(stated, factor, meaning, inside, files):
    cv2.imwrite(str(files / "depth.png"), np.rint(factor * DEPTH).astype(np.uint16))
    plain = facts()
    (files / "camera.json").write_text(
        json.dumps({"intrinsics": plain, "depth_scale": stated} if inside else plain | {"depth_scale": stated})
    )
    shot = read_shot(files / "color.png", files / "depth.png", read_intrinsics(str(files / "camera.json")))
    assert np.allclose(shot.frame.depth, DEPTH, atol=1e-3)
    assert any(f"{stated:g} is taken for {meaning}" in sentence for sentence in shot.said)
    shot = read_shot(files / "color.png", files / "depth.png", camera(files), Reading(depth_scale=1.0 / factor))
    assert np.allclose(shot.frame.depth, DEPTH, atol=1e-3), "what the user says comes first"


def test_a_depth_scale_that_may_mean_two_things_asks(files):
    cv2.imwrite(str(files / "depth.png"), np.full((H, W), 100, np.uint16))
    says = r"may be millimetres per unit \(BOP\) \(1 m .*or units per metre \(10 m .*--depth-scale says how many metres"
    with pytest.raises(ValueError, match=f"^depth_scale: .*{says}"):
        read_shot(files / "color.png", files / "depth.png", camera(files, depth_scale=10.0))


def test_tenths_of_millimetres_say_how_far_it_would_be_and_which_unit_fits(files):
    cv2.imwrite(str(files / "depth.png"), np.rint(1e4 * DEPTH).astype(np.uint16))
    far = f"{10 * np.median(DEPTH):.3g} m"
    with pytest.raises(
        ValueError, match=rf"depth_scale: .*the median depth is {far}.* 0.0001 makes it 0.*--depth-scale"
    ):
        perceived(files, "--plane", "auto")
    noise = np.random.default_rng(0).uniform(6.0, 9.0, DEPTH.shape).astype(np.float32)
    with pytest.raises(ValueError, match=r"got none; the median depth is 7\.\d m; a tenth of the unit makes it 0\.7"):
        on_table(RGBDFrame(RGB, noise, K, np.eye(4)))
    assert "best grasp" in perceived(files, "--depth-scale", "0.0001")[0]


# ------------------------------------------------------------------------------------- what is refused, and how soon


@pytest.mark.bad_input
def test_numbers_in_the_order_of_a_matrix_ask_for_the_order(files):
    with pytest.raises(ValueError, match=r'^intrinsics: expected the order .* is it "300 300 159.5 119.5"'):
        read_shot(files / "color.png", files / "depth.png", read_intrinsics("300 159.5 300 119.5"))


@pytest.mark.bad_input
@pytest.mark.parametrize("colours", [True, False])
def test_a_picture_of_depth_is_told_from_depth(colours, files):
    shades = cv2.convertScaleAbs(DEPTH, alpha=200.0)
    cv2.imwrite(str(files / "depth.png"), cv2.applyColorMap(shades, cv2.COLORMAP_JET) if colours else shades)
    with pytest.raises(ValueError, match=r"^depth: expected uint16 or floats, got 8 bits .*picture of depth.*save"):
        read_shot(files / "color.png", files / "depth.png", camera(files))


@pytest.mark.bad_input
def test_sizes_are_compared_before_a_pixel_is_read(files, monkeypatch):
    (files / "color.png").write_bytes(png_that_claims(6000, 5000))
    monkeypatch.setattr(cv2, "imdecode", None)  # whoever calls it fails
    with pytest.raises(ValueError, match=r"^depth: expected the size of .*, got 6000 x 5000 and 320 x 240"):
        read_shot(files / "color.png", files / "depth.png", camera(files))
    (files / "depth.png").write_bytes(png_that_claims(6000, 5000))
    with pytest.raises(ValueError, match=r"^intrinsics: expected a calibration of .* 6000 x 5000, got one of 320"):
        read_shot(files / "color.png", files / "depth.png", camera(files))


def npy(header: str) -> bytes:
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode()


HEADER = "{{'descr': '<f4', 'fortran_order': False, 'shape': {}}}"
BROKEN = {
    "a size that is claimed": (
        npy(HEADER.format("(90000, 90000)")),
        "at most 64 million",
    ),
    "cut short": (npy(HEADER.format("(240, 320)")) + bytes(40), "is it cut short"),
    "objects": (npy("{'descr': '|O', 'fortran_order': False, 'shape': (240, 320)}"), "expected an array of numbers"),
    "a header of brackets": (npy("(" * 5000), "not an array of numbers that can be read"),
    "no header": (b"\x93NUMPY", "not an array of numbers that can be read"),
    "no archive": (b"PK\x03\x04" + bytes(40), "not an NPZ that can be read"),
    "no EXR": (b"\x76\x2f\x31\x01" + bytes(40), "EXR"),
    "nothing": (b"", "not an image that can be read"),
    "a text": (b"depth", "not an image that can be read"),
}


@pytest.mark.bad_input
@pytest.mark.parametrize("kind", BROKEN)
def test_broken_and_hostile_arrays_are_refused_in_words(kind, files):
    data, says = BROKEN[kind]
    (files / "depth.bin").write_bytes(data)
    with pytest.raises(ValueError, match=f"^depth: .*{says}"):
        read_shot(files / "color.png", files / "depth.bin", camera(files))


@pytest.mark.bad_input
def test_an_archive_of_several_arrays_wants_one_that_is_called_depth(files):
    np.savez(files / "depth.npz", near=DEPTH, far=DEPTH)
    with pytest.raises(ValueError, match=r"^depth: expected one array, or one called depth, in .*, got near, far"):
        read_shot(files / "color.png", files / "depth.npz", camera(files))


@pytest.mark.bad_input
def test_without_the_package_a_sentence_names_what_reads_exr(files, monkeypatch):
    (files / "depth.exr").write_bytes(b"\x76\x2f\x31\x01")
    monkeypatch.setitem(__import__("sys").modules, "OpenEXR", None)
    with pytest.raises(ValueError, match=r"^depth: .*EXR is read by the package OpenEXR \(pip install"):
        read_shot(files / "color.png", files / "depth.exr", camera(files))


# -------------------------------------------------------------------------------------------------- a folder of them


@pytest.fixture
def folder(files):
    """One picture in a folder for training and scoring."""
    for kind in ("color", "depth", "mask"):
        (files / kind).mkdir()
        os.replace(files / f"{kind}.png", files / kind / "0.png")
    return files


def test_hidden_files_are_no_pictures_and_the_other_of_two_of_one_name_is_said(folder, capsys):
    for name in (".DS_Store", "._0.png"):
        (folder / "color" / name).write_bytes(b"\x00")
    cv2.imwrite(str(folder / "color" / "0.jpg"), RGB[..., ::-1])
    assert [path.name for path in PictureFolder(folder).pictures] == ["0.png"]
    assert "0.jpg is left out: 0.png has the same name" in capsys.readouterr().err
    things = evaluate_folder.TrueThings(folder)
    assert [path.name for path in things.colors] == ["0.png"] and "0.jpg is left out" in things.said[0]


@pytest.mark.bad_input
def test_a_depth_picture_in_the_place_of_a_mask_is_told_by_its_numbers(folder):
    cv2.imwrite(str(folder / "mask" / "0.png"), np.arange(W * H).reshape(H, W).astype(np.uint16))
    with pytest.raises(ValueError, match=r"^mask: expected at most 1000 numbers of things in .*, got 65536; is"):
        evaluate_folder.TrueThings(folder)
    with pytest.raises(ValueError, match=r"^mask: expected at most 1000 numbers of things"):
        perceived(folder, "--instances", color="color/0.png", depth="depth/0.png", mask="mask/0.png")


def test_each_picture_of_a_folder_has_the_camera_of_its_name(folder):
    """As BOP's scene_camera.json has it."""
    for kind in ("color", "depth", "mask"):
        (folder / kind / "7.png").write_bytes((folder / kind / "0.png").read_bytes())
    cameras = {str(n): {"cam_K": (K * [[f], [f], [1.0]]).ravel().tolist()} for n, f in ((0, 1.0), (7, 0.99))}
    (folder / "camera.json").unlink()
    (folder / "scene_camera.json").write_text(json.dumps(cameras))
    assert [frame.K[0, 0] for frame in evaluate_folder.TrueThings(folder)] == pytest.approx([300.0, 297.0])


PHOTOGRAPHS = Path(__file__).resolve().parents[3] / "shared" / "real" / "tabletop"


@pytest.mark.nightly
@pytest.mark.skipif(not PHOTOGRAPHS.is_dir(), reason="the photographs are not here")
def test_with_depth_of_a_phones_size_as_many_things_are_found_in_photographs(tmp_path):
    """Five tables, depth brought down to 256 x 192 and back."""
    from bench.bench_photographs import with_outlines
    from labkit.geometry.depth_units import resize_depth
    from labkit.instance_metrics import pool
    from labkit.learning.things import instance_finder

    things, found = with_outlines(PHOTOGRAPHS, tmp_path), {}
    rows, columns = (np.rint((np.arange(n) + 0.5) * N / n - 0.5).astype(int) for n, N in ((192, 480), (256, 640)))

    class Smaller(evaluate_folder.TrueThings):
        def __getitem__(self, index):
            frame = super().__getitem__(index)
            return replace(frame, depth=resize_depth(frame.depth[np.ix_(rows, columns)], (640, 480)))

    for name, of in (("as it is", things), ("a phone's", Smaller(tmp_path))):
        scores = pool([one.scores for one in evaluate_folder.judge(of, instance_finder())])
        found[name] = scores.over_half
    print(found)
    assert found["a phone's"] >= found["as it is"]


@pytest.mark.parametrize("name", ["1_Depth.raw", "0.depth"])
def test_bare_numbers_are_refused_with_what_to_save(name, tmp_path):
    (tmp_path / name).write_bytes(bytes(640 * 480 * 2))
    with pytest.raises(ValueError, match=rf"^depth: expected 16-bit PNG, TIFF, .* got .*{name}, which says no size"):
        open_array("depth", tmp_path / name)
