"""`labkit photos`, as somebody uses it who has a phone and the sheet: what belongs together, what is refused."""

import json
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
import sheets

from labcli import photos
from labcli.cameras import read_intrinsics
from labcli.pictures import read_shot
from labcli.poses import read_pose
from labkit.geometry import back_project_to_base, sweep
from labkit.geometry.sheet import Sheet

TILTS = ((30, 0), (28, 14), (32, -14), (22, 8), (35, -8))  # degrees about x and y: from where the sheet is seen


@pytest.fixture(autouse=True)
def fewer_heights(monkeypatch):
    """What is tested here is not how finely heights are told."""
    monkeypatch.setattr(sweep, "HEIGHTS", np.arange(-0.04, 0.121, 0.02))


@pytest.fixture(scope="module")
def shots():
    rng = np.random.default_rng(4)
    return [sheets.photograph(sheets.pose(tilt, turn=5.0 * i), rng) for i, tilt in enumerate(TILTS)]


@pytest.fixture
def here(tmp_path, shots):
    """shots/ with five photographs of the sheet, and camera.json beside it."""
    (tmp_path / "shots").mkdir()
    for i, picture in enumerate(shots):
        sheets.save(tmp_path / "shots" / f"{i}.jpg", picture)
    camera = {"width": 640, "height": 480, "fx": 520.0, "fy": 523.0, "cx": 325.0, "cy": 236.0}
    (tmp_path / "camera.json").write_text(json.dumps({**camera, "coeffs": list(sheets.LENS), "exif_orientation": 1}))
    return tmp_path


@pytest.fixture
def make(here, labkit):
    """A function that runs the command and returns its exit status."""

    def run(name="one", folder="shots", out="data", *more):
        return labkit(
            "photos", here / folder, "--camera", here / "camera.json", "--out", here / out, "--name", name, *more
        )

    return run


def test_photographs_become_a_frame_that_perceive_reads(here, make, shots, capsys):
    """The sheet's plane is at z = 0 of what the files say, to 5 mm; what does not belong is named."""
    rng = np.random.default_rng(6)
    folder = here / "shots"
    sheets.save(folder / "3.jpg", shots[3], orientation=3)  # the phone was held upside down; its sensor saw the same
    sheets.save(folder / "cat.jpg", np.full_like(shots[0], 90))
    zoomed = np.diag([1.25, 1.25, 1.0]) @ sheets.K
    sheets.save(folder / "zoom.jpg", sheets.photograph(sheets.pose((38, 10)), rng, K=zoomed))
    sheets.save(folder / "large.jpg", cv2.resize(shots[0], (800, 600)))
    (folder / "broken.jpg").write_bytes(b"\xff\xd8\xff\xe0nothing")
    assert make() == 0
    said = capsys.readouterr().out
    for name, why in (
        ("cat.jpg", "no sheet found"),
        ("zoom.jpg", "zoomed, focused anew"),
        ("large.jpg", "another resolution"),
        ("broken.jpg", "not a picture"),
    ):
        assert why in next(line for line in said.splitlines() if name in line)
    assert "5 photographs" in said and "labkit perceive" in said
    data = here / "data"
    camera = read_intrinsics(str(data / "camera.json"))
    frame = read_shot(data / "color" / "one.png", data / "depth" / "one.png", camera).frame
    T, _ = read_pose(str(data / "pose" / "one.txt"), data / "color" / "one.png").in_base()
    z = back_project_to_base(frame.depth, frame.K, T)[150:330, 200:440, 2]
    assert frame.size == (640, 480) and np.isfinite(z).mean() > 0.9
    assert np.nanmedian(np.abs(z)) < 0.002 and (np.abs(z[np.isfinite(z)]) < 0.005).mean() > 0.95
    assert sorted(path.name for path in data.iterdir()) == ["camera.json", "color", "depth", "pose"]


def test_a_second_frame_joins_the_first(here, make, capsys):
    assert make("one") == 0 and make("two") == 0
    assert sorted(path.name for path in (here / "data" / "color").iterdir()) == ["one.png", "two.png"]
    before = (here / "data" / "color" / "one.png").stat().st_mtime_ns
    assert make("one") == 2
    assert "color/one.png" in capsys.readouterr().err
    assert (here / "data" / "color" / "one.png").stat().st_mtime_ns == before
    facts = json.loads((here / "data" / "camera.json").read_text())
    (here / "data" / "camera.json").write_text(json.dumps({**facts, "fx": 600.0}))
    assert make("three") == 2
    assert "another camera's" in capsys.readouterr().err and not list(here.glob("data/*/three*"))


def test_too_few_leave_nothing_behind(here, make, capsys):
    (here / "shots" / "0.jpg").unlink()
    sheets.save(here / "shots" / "1.jpg", np.full((480, 640, 3), 90, np.uint8))
    assert make() == 2
    said = capsys.readouterr().err
    assert "at least 5 photographs" in said and "1.jpg: no sheet found" in said and "hand's width apart" in said
    assert not (here / "data").exists()


def test_photographs_from_one_place_tell_no_depth(here, make, capsys):
    rng = np.random.default_rng(1)
    for i in range(5):
        sheets.save(here / "shots" / f"{i}.jpg", sheets.photograph(sheets.pose((30, 0.1 * i)), rng))
    assert make() == 2
    assert "from several places" in capsys.readouterr().err and not (here / "data").exists()


def test_another_camera_is_refused(here, make, capsys):
    """A phone whose camera.json is of another lens: no photograph fits it, and each is named."""
    facts = json.loads((here / "camera.json").read_text())
    (here / "camera.json").write_text(json.dumps({**facts, "fx": 700.0, "fy": 700.0}))
    assert make() == 2
    assert "calibrate anew" in capsys.readouterr().err and not (here / "data").exists()


def another(markers: int, columns=6, rows=8):
    """A sheet of another make, on paper of the same size: other markers, or other counts of squares."""
    board = cv2.aruco.CharucoBoard((columns, rows), 0.03, 0.024, cv2.aruco.getPredefinedDictionary(markers))
    width, height = Sheet().size_mm
    printed = board.generateImage((10 * width, 10 * height))
    edge = [10 * sheets.MARGIN] * 4
    return cv2.GaussianBlur(cv2.copyMakeBorder(printed, *edge, cv2.BORDER_CONSTANT, value=255), (0, 0), 4)


@pytest.mark.parametrize(
    ("sheet", "says"),
    [
        (lambda: another(cv2.aruco.DICT_6X6_50), "not the sheet that `labkit sheet` prints"),
        (lambda: another(cv2.aruco.DICT_4X4_50, 5, 7), "no sheet of this kit|not the sheet that `labkit sheet` prints"),
        (lambda: cv2.flip(sheets.paper(), 1), "not the sheet that `labkit sheet` prints"),
        (lambda: stretched(sheets.paper()), "a sheet that is bent or no sheet of this kit"),
    ],
    ids=["other markers", "other squares", "seen in a mirror", "stretched by the printer"],
)
def test_another_sheet_is_refused(here, make, capsys, sheet, says):
    """With what to do, and nothing written."""
    rng, paper = np.random.default_rng(2), sheet()
    for i, tilt in enumerate(TILTS):
        picture = sheets.photograph(sheets.pose(tilt, turn=5.0 * i), rng, paper=paper)
        sheets.save(here / "shots" / f"{i}.jpg", picture)
    assert make() == 2
    assert re.search(says, capsys.readouterr().err) and not (here / "data").exists()


def stretched(paper, by=1.04):
    """Printed 4 % too long and not too wide, as a page that is made to fit."""
    height, width = paper.shape
    return cv2.resize(paper, (width, round(by * height)))[:height]


def test_a_length_measured_wrong_makes_all_larger(here, make, capsys):
    """No photograph tells it: the height of the camera that is printed does, to who knows it."""
    assert make("one") == 0 and make("two", "shots", "other", "--measured-mm", 165.0) == 0
    one, two = re.findall(r"camera: ([\d.]+) m over the sheet", capsys.readouterr().out)
    assert float(two) == pytest.approx(1.1 * float(one), rel=5e-3)


def test_a_full_disk_leaves_nothing_behind(here, make, monkeypatch, capsys):
    whole = photos.write_atomically

    def full(path, content):
        if path.parent.name == "color":
            raise OSError(28, "No space left on device", str(path))
        whole(path, content)

    monkeypatch.setattr(photos, "write_atomically", full)
    assert make() == 2
    assert "No space left" in capsys.readouterr().err and not [
        path for path in here.glob("data/**/*") if path.is_file()
    ]


@pytest.mark.parametrize(
    ("name", "changed", "says"),
    [
        ("a/b", {}, "name: expected a file's name"),
        ("one", {"width": None, "height": None}, "camera: expected a file that says the photographs' size"),
        ("one", {"model": "inverse_brown_conrady"}, "camera: expected a lens of OpenCV's kind"),
    ],
)
def test_what_cannot_be_is_refused_at_once(here, make, capsys, name, changed, says):
    facts = {**json.loads((here / "camera.json").read_text()), **changed}
    (here / "camera.json").write_text(json.dumps({key: fact for key, fact in facts.items() if fact is not None}))
    assert make(name) == 2
    assert says in capsys.readouterr().err and not (here / "data").exists()


def test_a_photograph_in_which_something_moved_is_named(monkeypatch):
    """Views that differ are swept again without; where most differ from the first, the first is what differs."""
    view = sweep.View(np.zeros((8, 8, 3), np.uint8), np.eye(3) + np.diag([7.0, 7.0, 0.0]), np.eye(4))
    answers = [(0.0, 0.02, 0.0, 0.0, 0.0), (0.1, 0.1, 0.1, 0.0), (0.0, 0.0, 0.0)]
    empty = np.zeros((8, 8), np.float32)
    monkeypatch.setattr(photos, "sweep", lambda views, progress: sweep.Swept(empty, empty, answers.pop(0)))
    said = []
    _, left, names = photos._unmoved([replace(view) for _ in range(6)], [*"abcdef"], said)
    assert names == ["b", "d", "e", "f"] and len(left) == 4
    assert [re.search("left out: (.)", line)[1] for line in said] == ["c", "a"]


@pytest.mark.nightly
def test_from_a_phones_photographs_to_a_grasp(tmp_path, labkit, monkeypatch, capsys):
    """A simulated phone: things on a table become a frame, its best grasp is on a thing, and what moved is named."""
    from data_gen.phone import photograph

    monkeypatch.undo()
    shots = photograph(700_004)
    moved = photograph(700_004, moved=2)
    (tmp_path / "shots").mkdir()
    for i, picture in enumerate([*shots.pictures[:2], moved.pictures[2], *shots.pictures[3:]]):
        sheets.save(tmp_path / "shots" / f"{i}.jpg", picture)
    (fx, _, cx), (_, fy, cy) = shots.K[:2].tolist()
    camera = {"width": 1280, "height": 960, "fx": fx, "fy": fy, "cx": cx, "cy": cy, "coeffs": list(shots.distortion)}
    (tmp_path / "camera.json").write_text(json.dumps(camera))
    data = tmp_path / "data"
    where = ["--camera", tmp_path / "camera.json", "--out", data, "--name", "one"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["labkit", "photos", str(tmp_path / "shots"), *map(str, where)])
        from labcli import cli

        with pytest.raises(SystemExit) as stop:
            cli.main()
        assert stop.value.code == 0
        assert "2.jpg: something lies elsewhere" in capsys.readouterr().out
        paths = data / "color" / "one.png", data / "depth" / "one.png"
        pose = ["--camera-pose", data / "pose" / "one.txt", "--anything", "--out", tmp_path / "out"]
        patch.setattr(
            "sys.argv", [*map(str, ["labkit", "perceive", *paths, "--intrinsics", data / "camera.json", *pose])]
        )
        with pytest.raises(SystemExit) as stop:
            cli.main()
        assert stop.value.code == 0
    grasps = json.loads((tmp_path / "out" / "grasps.json").read_text())["grasps"]
    T = shots.T_base_sheet @ np.array(grasps[0]["T_base_grasp"])
    cloud = back_project_to_base(shots.frame.depth, shots.frame.K, shots.frame.T_base_cam)[shots.frame.instances > 0]
    assert np.nanmin(np.linalg.norm(cloud - T[:3, 3], axis=1)) < 0.03
