"""The pages and the model card say what docs/evidence.md says, and that page says what the files of results say."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from notebooks import prose
from prose import evidence

ROOT = Path(__file__).parents[2]
PAGE = evidence.PAGE.read_text()


def test_the_page_is_what_the_files_of_results_give():
    """But for date and commit, which are those of the page: a clone without history has no others."""
    stamp = r"\d{4}-\d\d-\d\d, [0-9a-f]{7,}"
    stamps = iter(re.findall(rf"\| ({stamp}) \|$", PAGE, re.MULTILINE))
    assert evidence.page(when=lambda result: next(stamps)) == PAGE, "run `make evidence`"
    assert next(stamps, None) is None


@pytest.mark.parametrize(("page", "at_least"), [("docs/scores.md", 10), ("labkit/weights/MODEL_CARD.md", 15)])
def test_scores_are_those_that_were_measured(page, at_least):
    text = re.sub(r"(?<=\| )(UNet|SmallSegNet)(?= \|)", r"\1, without the CRF", (ROOT / page).read_text())  # the card's
    rows = re.findall(r"^\| [\w, ]+ \| (?:UNet|Small|true masks).* \| .*\|$", text, re.MULTILINE)
    assert len(rows) >= at_least
    measured = {row for row, _, _ in evidence.score_rows()}
    assert not set(rows) - measured


def test_a_promise_that_no_page_makes_in_these_words_is_refused():
    assert evidence.said("Submissions run in a sandbox").endswith("([README](../README.md))")
    with pytest.raises(ValueError, match=r"words: expected a promise .* got 'lifts everything'"):
        evidence.said("lifts everything")


def test_readme_is_short():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 120


def test_the_lesson_shows_the_same_certainty():
    shown = json.loads((ROOT / "labcourse" / "tables" / "07_certainty.json").read_text())
    for kind, report in shown.items():
        measured = json.loads((ROOT / "docs" / "results" / f"{kind}.json").read_text())
        assert report["declining"] == [pytest.approx(row, abs=1e-4) for row in measured["declining"]]
        assert report["calibration"] == [pytest.approx(row, abs=1e-4) for row in measured["calibration"]]


def test_notebooks_quote_the_target_iou_that_was_measured():
    files = ("hard_unet", "test_unet", "test_unet_crf")
    hard, trained, refined = (
        f"{json.loads((ROOT / 'docs' / 'results' / f'{file}.json').read_text())['iou']['target']:.2f}" for file in files
    )
    quoted = f"target IoU of {trained} on `test`. With other shapes, textures and views, on `hard`, it has {hard}."
    assert quoted in prose(ROOT / "lessons" / "03_gradient_network.ipynb")
    on_average = f"target IoU is {trained} on its own and {refined} with the CRF"
    assert on_average in (ROOT / "lessons" / "02_crf_lower_bounds.ipynb").read_text()
    assert f"target IoU is {trained}" in (ROOT / "labs" / "04_iou" / "04_iou.ipynb").read_text()


def test_the_card_says_what_the_benchmark_of_the_phone_says():
    rows = [row for row in evidence.cells("phone") if row[0] in ("photographs", "exact")]
    card = (ROOT / "labkit" / "weights" / "MODEL_CARD.md").read_text()
    assert len(rows) == 4
    for row in rows:
        assert " | ".join([row[1], *row[4:8]]) in card


def test_lesson_03_and_the_card_say_what_depth_is_worth():
    """Means over both trainings, of the network with depth, with colours alone, and with colours kept."""
    rows = [row for row in evidence.cells("depth") if row[0] in ("test", "hard")]
    assert [row[:2] for row in rows] == [["test", "0"], ["test", "1"], ["hard", "0"], ["hard", "1"]]
    means = np.array([row[3:6] for row in rows], float).reshape(2, 2, 3).mean(axis=1)  # scenes, seeds, networks
    (test, test_alone, test_kept), (hard, hard_alone, hard_kept) = ([f"{x:.2f}" for x in row] for row in means)
    lesson = prose(ROOT / "lessons" / "03_gradient_network.ipynb")
    assert f"| new ones of the kind learned from | {test} | {test_alone} | {test_kept} |" in lesson
    assert f"| `hard`: other shapes, textures, views | {hard} | {hard_alone} | {hard_kept} |" in lesson
    card = " ".join((ROOT / "labkit/weights/MODEL_CARD.md").read_text().split())
    assert f"{test} with depth, {test_alone} without; of `hard` {hard} and {hard_alone}" in card
    assert f"the network without depth has {test_kept} and {hard_kept}" in card
    interval = re.compile(r"(\S+) \((\S+) to (\S+)\)")
    gains = np.array([interval.fullmatch(cell).groups() for row in rows for cell in row[6:]], float)
    gain, low, high = np.moveaxis(gains.reshape(2, 2, 2, 3), -1, 0)  # each: scenes, seeds, compared with
    assert (high - low <= 0.08).all()  # "known to 0.04"
    assert ((gain > 0.15) & (gain < 0.25)).all()  # "about 0.2"
    assert abs(np.diff(gain, axis=1)).max() < 0.03  # "moved it by up to 0.03"


def test_lesson_03_shows_the_photographs_and_the_ablations_that_were_measured():
    """All rows of the ablations; of the photographs, what the network's classes and its things reach."""
    lesson, page = prose(ROOT / "lessons" / "03_gradient_things.ipynb"), (ROOT / "BENCHMARKS.md").read_text()

    def rows(section: str) -> list[list[str]]:
        text = page.partition(f"<!-- bench: {section} -->")[2].partition("<!-- bench:")[0]
        return [row.strip("| ").split(" | ") for row in re.findall(r"^\|.*\|$", text, re.MULTILINE)]

    ablations = rows("ablations")
    assert len(ablations) == 7 and all(f"| {' | '.join(row)} |" in lesson for row in ablations[2:])
    for way, shown in (("target or obstacle", "regions of target or obstacle"), ("its things", "in two sizes")):
        pieces, foreground, grasps = (row[1:] for row in rows("photographs") if row[0] == f"`unet_rgbd`, {way}")
        tables, _, board, bins = foreground
        assert f"| {shown} | {pieces[0].partition(' (')[0]} | {tables} | {board} | {bins} |" in lesson
        on, off, none = np.array([kind.split(", ") for kind in grasps], int).sum(axis=0)
        assert off == 0 and (on, none) == ((9, 0) if way == "its things" else (6, 3))  # as the lesson says in words
