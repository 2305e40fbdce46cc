"""labkit evaluate FOLDER: things in pictures of one's own, judged by simulated scenes whose things are known."""

import json
import re
import shutil

import cv2
import numpy as np
import pytest
from scenes import box, scene
from typer.testing import CliRunner

from bench import outlines
from labcli import evaluate_folder as own
from labcli.cli import app
from labcli.perceive import on_table
from labkit.instance_metrics import InstanceScores
from labkit.labels import OBSTACLE, SURFACE, TARGET
from labkit.learning.things import instance_finder
from labkit.sim.world import World


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two pictures with three and one things, whose numbers need 16 bits, and a corner where nobody knows."""
    folder = tmp_path_factory.mktemp("own")
    for kind in ("color", "depth", "mask"):
        (folder / kind).mkdir()
    boxes = (box("a", 0.5, 0.1), box("b", 0.55, -0.1, (0.06, 0.06, 0.1)), box("c", 0.65, 0.05))
    for name, things in (("one", boxes[:1]), ("three", boxes)):
        with World(scene(*things)) as world:
            frame = world.render()
        numbers = 300 * frame.instances.astype(np.uint16)
        numbers[:20, :20] = 65535
        cv2.imwrite(str(folder / "color" / f"{name}.png"), frame.rgb[..., ::-1])
        cv2.imwrite(str(folder / "depth" / f"{name}.png"), np.rint(1000.0 * frame.depth).astype(np.uint16))
        cv2.imwrite(str(folder / "mask" / f"{name}.png"), numbers)
    K = frame.K
    (folder / "camera.txt").write_text(f"{K[0, 0]} {K[1, 1]} {K[0, 2]} {K[1, 2]}")
    return folder


@pytest.fixture
def alone(folder, tmp_path):
    """The same pictures with a truth that does not tell things apart."""
    shutil.copytree(folder, tmp_path / "alone")
    (tmp_path / "alone" / "mask").rename(tmp_path / "alone" / "foreground")
    for path in (tmp_path / "alone" / "foreground").iterdir():
        mask = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        cv2.imwrite(str(path), np.where((mask > 0) & (mask < 65535), 200, 0).astype(np.uint8))
    return tmp_path / "alone"


def run(*arguments) -> str:
    done = CliRunner().invoke(app, ["evaluate", *map(str, arguments)])
    if done.exception is not None:
        raise done.exception
    return done.output


def test_what_stands_on_a_table_is_found_and_scored(folder, tmp_path):
    said = run(folder, "--anything", "--json", tmp_path / "scores.json", "--worst", "1", "--out", tmp_path)
    assert "2 pictures, 4 things, 4 found" in said
    assert re.search(r"IoU over 0\.5: 4 of 4 \(100%, 95 % interval 51% to 100%\)", said)
    facts = json.loads((tmp_path / "scores.json").read_text())
    assert (facts["pictures"], facts["true"], facts["over_half"]) == (2, 4, 4) and facts["overlap"][2] > 0.9
    assert [row["name"] for row in facts["rows"]] == ["one", "three"] and facts["foreground_iou"] > 0.85
    assert f"foreground IoU {facts['foreground_iou']:.3f}" in said
    page = (tmp_path / "worst.html").read_text()
    low = min(facts["rows"], key=lambda row: row["overlap"][2])
    assert f"<h2>{low['name']}</h2>" in page and page.count("<img") == 2 and "The worst 1 of 2 pictures" in page


def test_true_things_score_as_perfect_and_what_nobody_knows_does_not_count(folder):
    """A finder that gives the truth, with nonsense where nobody knows."""
    things = own.TrueThings(folder)
    answers = iter([frame.instances for frame in things])
    assert not things.alone and things[1].instances.max() == 65535 == things.ignore(1)
    for picture in own.judge(things, lambda frame: next(answers).astype(np.int32)):
        assert picture.scores.overlap == picture.scores.boundary == (1.0, 1.0, 1.0) and picture.said == ""
        assert picture.scores.true == picture.scores.over(0.75) == {"one": 1, "three": 3}[picture.name]


def test_a_truth_that_does_not_tell_things_apart_gives_foreground_alone_and_says_so(folder, alone, tmp_path):
    apart = own.as_dict(own.judge(own.TrueThings(folder), instance_finder()), False)
    said = run(alone, "--anything", "--json", tmp_path / "scores.json", "--worst", "2", "--out", tmp_path)
    assert "2 pictures whose truth does not tell things apart" in said and "as one piece" not in said
    facts = json.loads((tmp_path / "scores.json").read_text())
    assert set(facts) == {"pictures", "foreground_iou", "rows"}
    assert facts["foreground_iou"] == pytest.approx(apart["foreground_iou"], abs=0.01)
    assert "as one piece" not in (tmp_path / "worst.html").read_text()
    (alone / "foreground").rename(alone / "mask")  # 0 and one other number alone
    assert own.TrueThings(alone).alone


def test_a_network_gives_things_by_its_classes(folder):
    """What it calls target or obstacle, cut apart by empty space, the pixels without depth with them."""
    frame = own.TrueThings(folder)[1]
    true = np.where(frame.instances == 65535, 0, frame.instances)
    depth = frame.depth.copy()
    depth[::7] = 0.0
    frame, _ = on_table(own.replace(frame, depth=depth))

    def network(rgb):
        classes = np.where(true == 300, OBSTACLE, np.where(true > 0, TARGET, SURFACE))
        return np.eye(4)[classes]

    found = own.things_by_class(network)(frame)
    assert np.array_equal(found > 0, true > 0) and len(np.unique(found)) == 4
    assert own.score_instances(true, found).over(0.75) == 3
    nothing = own.things_by_class(lambda rgb: np.eye(4)[np.full(rgb.shape[:2], SURFACE)])(frame)
    assert not nothing.any()


def test_anybodys_masks_are_scored_beside_the_kits(folder, tmp_path):
    """The true things under other numbers, 8 and 16 bits, one of them cut: the scores are known by counting."""
    (tmp_path / "theirs").mkdir()
    things, cut = own.TrueThings(folder), 0.0
    for name, frame in zip(("one", "three"), things, strict=True):
        numbers = np.where(frame.instances == 65535, 0, frame.instances // 300)
        numbers = numbers.astype(np.uint8) if name == "one" else 999 * numbers.astype(np.uint16)
        if name == "one":
            rows = np.flatnonzero((numbers > 0).any(axis=1))
            numbers[: rows[len(rows) // 2]] = 0
            true = (frame.instances > 0) & (frame.instances != 65535)
            cut = np.count_nonzero(numbers) / np.count_nonzero(true)
        cv2.imwrite(str(tmp_path / "theirs" / f"{name}.png"), numbers)
    options = "--masks", tmp_path / "theirs", "--anything", "--json", tmp_path / "scores.json", "--worst", "1"
    said = run(folder, *options, "--out", tmp_path)
    theirs, kit = said.split("the kit's, unet_rgbd:")
    over = 3 + (cut > 0.5)
    assert f"the masks of {tmp_path / 'theirs'}:\n2 pictures, 4 things, 4 found" in theirs
    assert f"IoU over 0.5: {over} of 4" in theirs and "IoU over 0.75: 3 of 4" in theirs
    assert "2 pictures, 4 things, 4 found" in kit
    facts = json.loads((tmp_path / "scores.json").read_text())
    assert set(facts) == {"masks", "kit"} and facts["masks"]["over_three_quarters"] == 3
    (one, three) = facts["masks"]["rows"]
    assert one["foreground_iou"] == pytest.approx(cut) and three["foreground_iou"] == 1.0
    assert facts["kit"]["over_half"] == 4 and [row["name"] for row in facts["kit"]["rows"]] == ["one", "three"]
    page = (tmp_path / "worst.html").read_text()
    assert "<h2>one</h2>" in page and page.count("<img") == 3 and "found by the kit" in page


@pytest.mark.bad_input
def test_masks_that_are_missing_or_of_another_size_are_named(folder, tmp_path):
    with pytest.raises(FileNotFoundError, match=r"masks: expected a mask for each picture in .*, got no one\.png, th"):
        run(folder, "--masks", tmp_path)
    for name in ("one", "three"):
        cv2.imwrite(str(tmp_path / f"{name}.png"), np.zeros((60, 80), np.uint8))
    with pytest.raises(ValueError, match=r"mask: expected the colour picture's size, 320 x 240, in .*one\.png, got 80"):
        run(folder, "--masks", tmp_path)
    with pytest.raises(ValueError, match="masks: expected predicted or truth, or FOLDER beside a folder of masks, got"):
        run("--masks", tmp_path)


def test_without_a_table_nothing_is_found_which_counts_and_is_said(folder, tmp_path):
    shutil.copytree(folder, tmp_path / "own")
    path = str(tmp_path / "own" / "depth" / "one.png")
    depth = np.zeros_like(cv2.imread(path, cv2.IMREAD_UNCHANGED))
    depth[3, 4:6] = 800
    cv2.imwrite(path, depth)
    said = run(tmp_path / "own", "--anything")
    assert "one: nothing was looked for: " in said and "2 pictures, 4 things, 3 found" in said


def test_a_mask_of_classes_is_suspected(folder, tmp_path):
    shutil.copytree(folder, tmp_path / "own")
    path = str(tmp_path / "own" / "mask" / "one.png")
    numbers = cv2.imread(path, cv2.IMREAD_UNCHANGED)
    cv2.imwrite(path, np.where(numbers == 0, 1, np.where(numbers == 300, 2, 255)).astype(np.uint8))
    said = run(tmp_path / "own", "--anything")
    assert re.search(r"one: one true thing covers 9\d% of the picture: are these numbers of classes", said)
    assert "three: " not in said


def test_the_worst_come_first():
    def judged(name, F, foreground):
        scores = InstanceScores(1, 1, (F,), 0, (F, F, F), (F, F, F), foreground)
        image = np.zeros((2, 2), int)
        return own.Judged(name, np.zeros((2, 2, 3), np.uint8), image, image, 255, scores)

    pictures = [judged("a", 0.9, (1, 9)), judged("b", 0.2, (5, 9)), judged("c", 0.5, (0, 0))]
    assert [one.name for one in own.worst(pictures, 2, alone=False)] == ["b", "c"]
    assert [one.name for one in own.worst(pictures, 3, alone=True)] == ["a", "b", "c"], "no thing is no mistake"


@pytest.mark.bad_input
def test_what_is_missing_or_does_not_fit_is_named(folder, tmp_path):
    with pytest.raises(ValueError, match="scenes: expected no FOLDER beside it"):
        run(folder, "--scenes", "3")
    with pytest.raises(ValueError, match="anything: expected FOLDER beside it"):
        run("--anything")
    with pytest.raises(ValueError, match="model: expected a network that tells things apart"):
        run(folder, "--anything", "--model", "unet")
    with pytest.raises(FileNotFoundError, match=r"folder: expected pictures in color/, depth/ and mask/ .* in "):
        run(tmp_path, "--anything")
    shutil.copytree(folder, tmp_path / "own")
    mask = tmp_path / "own" / "mask" / "three.png"
    cv2.imwrite(str(mask), np.ones((10, 20), np.uint8))
    with pytest.raises(
        ValueError, match=r"mask: expected the colour picture's size, 320 x 240, in .*three\.png, got 20 x"
    ):
        run(tmp_path / "own", "--anything")
    mask.unlink()
    with pytest.raises(FileNotFoundError, match=r"three\.png"):
        run(tmp_path / "own", "--anything")


def test_outlines_are_of_things_that_do_not_vanish_behind_each_other():
    """21 things of five frames; each is seen, most are one piece, and none is where no one can tell."""
    seen = 0
    for frame, kept in outlines.OUTLINES.items():
        numbers = outlines.instances(frame)
        for number, thing in enumerate(kept["things"], start=1):
            mask = (numbers == number).astype(np.uint8)
            share = cv2.connectedComponentsWithStats(mask)[2][1:, cv2.CC_STAT_AREA].max() / mask.sum()
            assert mask.sum() > 4000 and share > 0.95, (frame, thing["name"])
            seen += 1
            u, v = np.array(thing["outline"]).T
            assert u.min() >= 0 and u.max() < 640 and v.min() >= 0 and v.max() < 480
    assert seen == 21
