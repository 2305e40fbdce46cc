from dataclasses import replace
from itertools import product

import cv2
import numpy as np
import pytest
from PIL import Image
from scenes import png_that_claims, random_image

from labkit.frame import RGBDFrame, read_image
from labkit.labels import unknown_number

K = np.array([[100.0, 0.0, 4.0], [0.0, 110.0, 3.0], [0.0, 0.0, 1.0]])
GOOD = {
    "rgb": np.zeros((6, 8, 3), np.uint8),
    "depth": np.ones((6, 8), np.float32),
    "K": K,
    "T_base_cam": np.eye(4),
    "labels": np.zeros((6, 8), np.int64),
}


def changed(matrix, index, value):
    matrix = np.array(matrix, dtype=float)
    matrix[index] = value
    return matrix


def test_a_good_frame_keeps_its_values_in_the_kits_types():
    depth = np.full((6, 8), 0.5)
    depth[2, 3], depth[2, 4] = 0.0, np.nan  # no reading
    frame = RGBDFrame(**(GOOD | {"depth": depth, "table_z": 0.25}))
    assert frame.depth.dtype == np.float32 and np.array_equal(frame.depth, depth.astype(np.float32), equal_nan=True)
    assert frame.labels.dtype == np.uint8 and frame.size == (8, 6) and frame.table_z == 0.25
    assert repr(frame) == "RGBDFrame(8 x 6, labels, table_z=0.25)"


def test_a_frame_stays_as_it_was_checked():
    """Neither through what it was made of nor through itself can a number come in that nobody checked."""
    images = {"labels": np.ones((6, 8), np.uint8), "instances": np.ones((6, 8), np.uint16)}
    given = {name: np.array(value) for name, value in (GOOD | images).items()}
    frame = RGBDFrame(**given)
    again = replace(frame, table_z=0.1)
    before = {name: getattr(frame, name).copy() for name in given}
    for name, array in given.items():
        array[...] = 7
        with pytest.raises(ValueError, match="read-only"):
            getattr(frame, name)[0, 0] = 7
    for name, array in before.items():
        assert np.array_equal(getattr(frame, name), array) and np.array_equal(getattr(again, name), array)
    assert again.depth is frame.depth, "what cannot change need not be copied"


def test_a_few_readings_that_are_far_too_far_are_no_millimetres():
    depth = np.full((20, 30), 0.8, np.float32)
    depth[3, 4] = 150.0
    frame = RGBDFrame(np.zeros((20, 30, 3), np.uint8), depth, K, np.eye(4))
    assert frame.depth[3, 4] == 150.0
    depth[:2] = 850.0  # a tenth of them
    with pytest.raises(ValueError, match=r"^depth: .*850, which looks like millimetres"):
        RGBDFrame(np.zeros((20, 30, 3), np.uint8), depth, K, np.eye(4))


def test_no_number_of_a_thing_is_lost_or_taken_for_unknown():
    """255 is unknown where the numbers have 8 bits; of a wider type it is a thing like any other, whatever its size."""
    for numbers, unknown in (([0, 1, 255], 255), ([0, 255], 255)):
        frame = RGBDFrame(**GOOD, instances=np.resize(np.array(numbers, np.uint8), (6, 8)))
        assert unknown_number(frame.instances) == unknown
    for kind, numbers in product((np.uint16, np.int64), ([0, 255], [0, 256, 300, 511], [0, 1, 65_535], [0, 3])):
        image = np.resize(np.array(numbers, kind), (6, 8))
        frame = RGBDFrame(**GOOD, instances=image)
        assert np.array_equal(frame.instances, image) and unknown_number(frame.instances) not in {*numbers} - {65_535}


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
        ("K", np.zeros((3, 3)), "positive focal lengths .* got 0.0 and 0.0; a K of zeros is an uncalibrated camera's"),
        ("T_base_cam", 2.0 * np.eye(4), "0 0 0 1"),
        ("T_base_cam", changed(np.eye(4), (0, 0), 1.1), "orthonormal"),
        ("T_base_cam", changed(np.eye(4), (0, 0), -1.0), "right-handed"),
        ("T_base_cam", changed(np.eye(4), (3, 0), 1.0), "transposed"),
        ("T_base_cam", np.eye(3), "shape"),
        ("labels", np.full((6, 8), 256), "0 to 254 or 255"),
        ("labels", np.zeros((6, 8)), "integer"),
        ("labels", np.zeros((5, 8), int), "size"),
        ("instances", np.zeros((6, 9), np.uint8), "size"),
        ("table_z", 750, "millimetres"),
        ("table_z", np.inf, "finite"),
    ],
)
def test_wrong_arguments_are_named(argument, value, says):
    with pytest.raises(ValueError, match=rf"^{argument}: .*{says}"):
        RGBDFrame(**(GOOD | {argument: value}))


@pytest.fixture
def files(tmp_path):
    """Random images on disk, and what they hold."""
    rng = np.random.default_rng(0)
    images = {
        "rgb": rng.integers(0, 256, (6, 8, 3), dtype=np.uint8),
        "depth": rng.integers(0, 3000, (6, 8), dtype=np.uint16),
        "labels": rng.integers(0, 4, (6, 8), dtype=np.uint8),
    }
    for name, image in images.items():
        assert cv2.imwrite(str(tmp_path / f"{name}.png"), image[..., ::-1] if name == "rgb" else image)
    return {name: tmp_path / f"{name}.png" for name in images}, images


def test_from_files_reads_what_was_written(files):
    paths, images = files
    frame = RGBDFrame.from_files(**paths, K=K, T_base_cam=np.eye(4), depth_scale=0.0005, table_z=0.1)
    assert np.array_equal(frame.rgb, images["rgb"]) and np.array_equal(frame.labels, images["labels"])
    assert np.allclose(frame.depth, images["depth"] * 0.0005, atol=1e-6) and frame.table_z == 0.1


def test_numbers_of_objects_may_have_16_bits(files, tmp_path):
    paths, _ = files
    for dtype, most in ((np.uint8, 200), (np.uint16, 60_000)):
        numbers = np.linspace(0, most, 48).reshape(6, 8).astype(dtype)
        cv2.imwrite(str(tmp_path / "instances.png"), numbers)
        known = paths | {"instances": tmp_path / "instances.png"}
        frame = RGBDFrame.from_files(**known, K=K, T_base_cam=np.eye(4))
        assert np.array_equal(frame.instances, numbers) and frame.instances.dtype == dtype


@pytest.mark.bad_input
def test_files_that_do_not_fit_are_named(files, tmp_path):
    paths, _ = files
    truncated = tmp_path / "truncated.png"
    truncated.write_bytes(paths["rgb"].read_bytes()[:20])
    cases = [
        ({"rgb": tmp_path / "nowhere.png"}, FileNotFoundError, "nowhere"),
        ({"rgb": truncated}, ValueError, r"^rgb: .*damaged"),
        ({"depth": paths["labels"]}, ValueError, r"^depth: expected uint16"),
        ({"rgb": paths["depth"]}, ValueError, r"^rgb: expected uint8 .*uint16 .*swapped"),
        ({"depth_scale": 0.0}, ValueError, r"^depth_scale:"),
    ]
    for change, error, says in cases:
        with pytest.raises(error, match=says):
            RGBDFrame.from_files(**(paths | {"K": K, "T_base_cam": np.eye(4)} | change))


@pytest.mark.bad_input
@pytest.mark.parametrize("end", ["png", "tif", "ppm", "pfm"])
def test_a_picture_of_more_pixels_than_any_camera_has_is_refused_before_one_is_read(end, tmp_path, monkeypatch):
    """A PNG of 0.9 MB can hold 20000 x 16000 pixels, which are a gigabyte."""
    claims = {
        "png": png_that_claims(20000, 16000),
        "tif": tiff_that_claims(20000, 16000),
        "ppm": b"P6 20000 16000 255 ",
        "pfm": b"Pf\n20000 16000\n-1.0\n",
    }
    (tmp_path / f"large.{end}").write_bytes(claims[end])
    monkeypatch.setattr(cv2, "imdecode", None)  # whoever calls it fails
    for colour in (True, False):
        with pytest.raises(
            ValueError, match=rf"^color: expected at most 64 million pixels, got 320 million in .*{end}"
        ):
            read_image("color", tmp_path / f"large.{end}", np.uint8, colour)


def tiff_that_claims(width: int, height: int) -> bytes:
    file = cv2.imencode(".tiff", np.zeros((1234, 321), np.float64))[1].tobytes()
    assert file.count((1234).to_bytes(4, "little")) and file[:2] == b"II"
    for tag, value in ((256, width), (257, height)):
        at = file.index(tag.to_bytes(2, "little"), int.from_bytes(file[4:8], "little"))
        file = (
            file[: at + 2]
            + (4).to_bytes(2, "little")
            + file[at + 4 : at + 8]
            + value.to_bytes(4, "little")
            + file[at + 12 :]
        )
    return file


def test_colours_of_16_bits_are_brought_to_8_or_refused_with_a_sentence_of_their_own(tmp_path):
    path, rgb = str(tmp_path / "deep.png"), random_image(12, 16)
    for ours in (rgb, rgb // 2):
        cv2.imwrite(path, ours[..., ::-1].astype(np.uint16) * 257)
        assert np.array_equal(read_image("color", path, np.uint8, colour=True), ours)
    cv2.imwrite(path, rgb.astype(np.uint16) * 4)  # 10 bits in the lower bits
    with pytest.raises(ValueError, match=r"^color: expected 16-bit colours up to 65535 .* got none above 1020; .* raw"):
        read_image("color", path, np.uint8, colour=True)


def test_how_a_phone_was_held_turns_no_picture(tmp_path):
    """Its note stands in the colour file alone: turned over, the colours would lie upside down on depth."""
    rgb, note = np.repeat(np.arange(64, dtype=np.uint8)[:, None] * 4, 64, axis=1), Image.Exif()
    note[0x0112] = 3  # turned over
    Image.fromarray(rgb).save(tmp_path / "held.jpg", exif=note, quality=95)
    assert np.abs(read_image("color", tmp_path / "held.jpg", np.uint8, colour=True)[..., 0] - rgb.astype(int)).max() < 8
