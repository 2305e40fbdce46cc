"""`labkit sheet` and `labkit calibrate`, as somebody uses them who has a printer and a phone."""

import json

import cv2
import numpy as np
import pypdfium2
import pytest
import sheets
from scipy.spatial.transform import Rotation

from labcli.cameras import read_intrinsics
from labcli.sheet import PAPERS, corner_mm, sheet_pdf
from labkit.geometry.sheet import RULER_MM, Sheet


def printed(paper: str, dpi: int) -> np.ndarray:
    """The page as a printer rasterises it."""
    return np.ascontiguousarray(pypdfium2.PdfDocument(sheet_pdf(paper))[0].render(scale=dpi / 72).to_numpy()[..., :3])


@pytest.mark.parametrize("paper", PAPERS)
def test_the_sheet_is_printed_at_true_size(paper):
    """Corners and the ruler's ends lie on the page where the millimetres say, whatever drew the PDF."""
    dpi = 200
    page, mm = printed(paper, dpi), 25.4 / dpi
    assert [side * mm for side in page.shape[1::-1]] == pytest.approx(PAPERS[paper], abs=0.2)
    found = Sheet().find(page)
    left, bottom = corner_mm(paper)
    where = np.column_stack([found.pixels[:, 0] + 0.5, page.shape[0] - found.pixels[:, 1] - 0.5]) * mm
    assert len(found.points) == len(Sheet().points)
    assert np.abs(where - (left, bottom) - 1e3 * found.points[:, :2]).max() < 0.2
    ruler = round(page.shape[0] - (bottom - 14.0) / mm) - 1
    row = page[ruler - 2 : ruler + 3].min(axis=(0, 2))
    dark = np.flatnonzero(row < 160)
    assert (dark[-1] - dark[0]) * mm == pytest.approx(RULER_MM, abs=0.4)


@pytest.fixture(scope="module")
def shots():
    """Photographs of the printed page, warped and seen through a lens."""
    rng = np.random.default_rng(0)
    page = cv2.GaussianBlur(printed("a4", 254), (0, 0), 4)[..., 0]
    (left, bottom), edge = corner_mm("a4"), sheets.MARGIN
    x, y = round(10 * (left - edge)), round(page.shape[0] - 10 * (bottom + Sheet().size_mm[1] + edge))
    page = cv2.copyMakeBorder(page, 100, 100, 100, 100, cv2.BORDER_CONSTANT, value=255)[y + 100 :, x + 100 :]
    return [sheets.photograph(T, rng, paper=page) for T in sheets.poses(rng, 9)]


@pytest.fixture
def folder(tmp_path, shots):
    """A folder of nine good photographs."""
    for i, picture in enumerate(shots):
        sheets.save(tmp_path / f"{i}.jpg", picture)
    return tmp_path


def focal(folder):
    return read_intrinsics(str(folder / "camera.json")).K[0, 0]


def test_a_folder_of_photographs_becomes_a_camera(folder, labkit, capsys):
    assert labkit("calibrate", folder) == 0
    camera = read_intrinsics(str(folder / "camera.json"))
    error = 4.0 * np.array([*json.loads((folder / "camera.json").read_text())["standard_errors"].values()])
    true = sheets.K[[0, 1, 0, 1], [0, 1, 2, 2]]
    assert (np.abs(camera.K[[0, 1, 0, 1], [0, 1, 2, 2]] - true) < np.maximum(error, 2.0)).all()
    assert camera.size == sheets.SIZE and len(camera.distortion) == 5
    page = (folder / "calibration.html").read_text()
    assert "<svg" in page and "8.jpg" in page and "standard error" in capsys.readouterr().out


def test_portrait_among_landscape_is_turned_back(folder, labkit, shots):
    """The sensor saw the same; only EXIF differs. So K is the same."""
    labkit("calibrate", folder)
    before = focal(folder)
    for i, orientation in ((0, 6), (1, 8), (2, 3)):
        sheets.save(folder / f"{i}.jpg", shots[i], orientation)
    labkit("calibrate", folder)
    assert focal(folder) == pytest.approx(before, rel=1e-6)
    for i, picture in enumerate(shots):
        sheets.save(folder / f"{i}.jpg", picture, 6)
    labkit("calibrate", folder)
    portrait = read_intrinsics(str(folder / "camera.json"))
    assert portrait.size == sheets.SIZE[::-1] and portrait.K[1, 1] == pytest.approx(before, abs=1.0)


def test_what_is_of_no_use_is_named_and_left_out(folder, labkit, shots, capsys):
    sheets.save(folder / "cat.jpg", np.full_like(shots[0], 90))
    sheets.save(folder / "zoom.jpg", cv2.resize(shots[0], (800, 600)))
    sheets.save(folder / "cut.jpg", np.ascontiguousarray(shots[0].transpose(1, 0, 2)))
    sheets.save(folder / "blurred.jpg", cv2.GaussianBlur(shots[3], (0, 0), 2.2))
    (folder / "broken.jpg").write_bytes(b"\xff\xd8\xff\xe0nothing")
    (folder / ".DS_Store").write_bytes(b"x")
    (folder / "IMG_1.HEIC").write_bytes(b"x")
    assert labkit("calibrate", folder) == 0
    said = capsys.readouterr().out
    for name, why in (
        ("cat.jpg", "no sheet found"),
        ("zoom.jpg", "another resolution"),
        ("cut.jpg", "cut or turned by another program"),
        ("blurred.jpg", "blurred|no sheet found"),
        ("broken.jpg", "not a picture"),
        ("IMG_1.HEIC", "Most Compatible|not a picture"),
    ):
        line = next(line for line in said.splitlines() if name in line)
        assert any(reason in line for reason in why.split("|")), line
    assert "DS_Store" not in said and "9 photographs" in said


def test_too_few_leave_nothing_behind(tmp_path, labkit, shots, capsys):
    for i in range(4):
        sheets.save(tmp_path / f"{i}.jpg", shots[i])
    before = sorted(tmp_path.iterdir())
    assert labkit("calibrate", tmp_path) == 2
    assert "at least 6 photographs" in capsys.readouterr().err and sorted(tmp_path.iterdir()) == before
    empty = tmp_path / "empty"
    empty.mkdir()
    assert labkit("calibrate", empty) == 2 and labkit("calibrate", tmp_path / "nowhere") == 2


def test_a_sheet_that_was_measured_moves_the_arms_camera(tmp_path, labkit, shots, capsys):
    """With an arm whose camera stands still over a sheet in the hand: T_base_cam, and its words for --camera-pose."""
    rng = np.random.default_rng(3)
    T_base_cam = np.eye(4)
    T_base_cam[:3, :3] = Rotation.from_euler("x", 180, degrees=True).as_matrix()
    T_base_cam[:3, 3] = 0.5, 0.1, 0.6
    T_hand_sheet = np.eye(4)
    T_hand_sheet[:3, 3] = -0.09, -0.12, 0.05
    lines = ["name,x,y,z,qx,qy,qz,qw"]
    for i, T_cam_sheet in enumerate(sheets.poses(rng, 8, tilt=30.0)):
        sheets.save(tmp_path / f"{i}.jpg", sheets.photograph(T_cam_sheet, rng))
        arm = T_base_cam @ T_cam_sheet @ np.linalg.inv(T_hand_sheet)
        numbers = [*arm[:3, 3], *Rotation.from_matrix(arm[:3, :3]).as_quat()]
        lines.append(f"{i}.jpg," + ",".join(f"{x:.6f}" for x in numbers))
    (tmp_path / "poses.csv").write_text("\n".join(lines))
    camera = {"fx": 520.0, "fy": 523.0, "cx": 325.0, "cy": 236.0, "coeffs": list(sheets.LENS)}
    (tmp_path / "known.json").write_text(json.dumps(camera))
    known = ["--arm", tmp_path / "poses.csv", "--camera", tmp_path / "known.json"]
    assert labkit("calibrate", tmp_path, *known) == 0
    assert '--camera-pose "' in capsys.readouterr().out
    found = np.array(json.loads((tmp_path / "hand_eye.json").read_text())["T_base_cam"])
    assert np.linalg.norm(found[:3, 3] - T_base_cam[:3, 3]) < 0.002
    (tmp_path / "poses.csv").write_text("\n".join(lines[:-1]))
    assert labkit("calibrate", tmp_path, *known) == 2
    assert "7.jpg" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--chessboard", "9by6", "--square", "0.02"], "inner corners across and down"),
        (["--chessboard", "9x6"], "--square METRES"),
        (["--square", "0.02"], "--chessboard COLUMNSxROWS"),
        (["--camera", "camera.json"], "--arm"),
        (["--measured-mm", "9"], "measured-mm"),
    ],
)
def test_options_that_do_not_fit_are_named(folder, labkit, capsys, options, says):
    assert labkit("calibrate", folder, *options) == 2
    assert says in capsys.readouterr().err
