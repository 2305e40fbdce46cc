"""Writes docs/evidence.md: what the pages promise, the commands that show it, and the last results (`make evidence`).

It measures nothing. Results are read from the files that the commands wrote; when, and at which commit, git knows.
"""

import csv
import json
import os
import re
import subprocess
from itertools import product
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "evidence.md"
KINDS = {
    "test": ("", "test"),
    "test, perturbed": (" --perturb", "test_perturbed"),
    "hard": ("", "hard"),
    "hard, perturbed": (" --perturb", "hard_perturbed"),
    "other": ("", "other"),
}
MASKS = {
    "UNetRGBD": ("", ""),
    "UNet, without the CRF": (" --model unet --no-crf", "_unet"),
    "UNet and CRF": (" --model unet", "_unet_crf"),
    "SmallSegNet, without the CRF": (" --model smallsegnet --no-crf", "_smallsegnet"),
    "true masks": (" --masks truth", "_truth"),
}
SCORES = "| scenes | masks | mean IoU | target IoU | boundary IoU | pixel accuracy | lifted (95 % interval) |"
FINE_TUNED = "Twenty pictures took the target IoU of a camera unlike any in training from 0.43 to 0.64"
# Where promises are made; the first page that has the words counts.
PAGES = ("README.md", "CONTRIBUTING.md", *(f"docs/{name}.md" for name in ("scores", "install", "own_pictures", "ros2")))
# The page's words, with numbers from the file of results; the command; what else the file says. {a}: `numbers`.
PROMISES = [
    (
        "In {rate} of {scenes} simulated scenes that no training saw, the arm lifts the target",
        "labkit evaluate --scenes 300 --config test --json docs/results/test.json",
        "{interval}",
        "docs/results/test.json",
    ),
    (
        "Masks spoilt on purpose in five ways, {lifts} lifts",
        "labkit study",
        "{lifted} lifted",
        "labcourse/tables/07_grasp.csv",
    ),
    (
        FINE_TUNED,
        "labkit train FOLDER --init unet_rgbd",
        "no file of results: this sentence",
        f"docs/own_pictures.md:{FINE_TUNED[-30:]}",
    ),
    ("{bugs} bugs", "pytest tests/labcourse/test_errata.py", "each with a test", "lessons/errata.md"),
    ("two CPU cores are enough", "make bench ARGS=pipeline", "{frame} ms per frame", "pipeline"),
    ("makes data of any size", "make bench ARGS=data_gen", "{scene} s per scene on one core", "data_gen"),
    ("graded sample submissions", "make bench ARGS=grading", "{wrong} of {graded} grades wrong", "grading"),
    ("{pieces} objects came out in one piece", "make bench ARGS=phone", "{phone}, {lifts_by_phone} lifted", "phone"),
    ("camera, node and arm in one process", "make bench ARGS=node", "{memory} memory over 10,000 frames", "node"),
]
TESTED = [
    ("runs README's two commands on a bare Debian", "make fresh"),
    ("both produced the same bytes from fixed seeds", "make everywhere"),
    ("Submissions run in a sandbox", "pytest tests/labgrader/sandbox"),
    ("answers a recording of ROS 1 or ROS 2; needs no ROS", "pytest tests/labros/test_bags.py"),
    ("the same masks and clouds in C++, Java and Octave", "make stacks"),
    ("runs the tests of ROS 2", "make test-ros2"),
    ("run on more machines with `--dask`", "pytest tests/labtrain/test_scale.py"),
    ("All of it works without a network", "make test-site"),
]


def numbers() -> dict[str, str]:
    """The numbers that PROMISES speak of, from the files of results."""
    lifts = list(csv.DictReader((ROOT / "labcourse" / "tables" / "07_grasp.csv").read_text().splitlines()))
    bugs = re.findall(r"^## \d+\.", (ROOT / "lessons" / "errata.md").read_text(), re.MULTILINE)
    grades = [row for row in cells("grading") if re.match(r"\d\d_\w+$", row[0])]
    test = json.loads((ROOT / "docs" / "results" / "test.json").read_text())
    phone = next(row for row in cells("phone") if row[0] == "photographs")
    return {
        "rate": f"{100 * test['lift_rate']:.0f} %",
        "scenes": str(test["trials"]),
        "interval": scores(test, False)[-1] + " lifted",
        "lifts": f"{len(lifts):,}",
        "lifted": f"{sum(row['lifted'] == '1' for row in lifts) / len(lifts):.1%}",
        "bugs": {20: "Twenty"}.get(len(bugs), str(len(bugs))),
        "frame": next(row[3] for row in cells("pipeline") if row[0] == "640 x 480"),
        "scene": next(row[1] for row in cells("data_gen") if row[0].startswith("seconds")),
        "wrong": str(sum(int(row[4]) for row in grades)),
        "graded": f"{100 * len(grades)} submissions'",
        "pieces": phone[1].split(" (")[0],
        "phone": phone[1],
        "lifts_by_phone": phone[7],
        "memory": next(row[3] for row in cells("node") if row[0] == "resident memory"),
    }


def cells(section: str) -> list[list[str]]:
    """The rows of all tables of a benchmark's section, each a list of its cells."""
    lines = (ROOT / "BENCHMARKS.md").read_text().split(f"<!-- bench: {section} -->")[1].split("<!--")[0].splitlines()
    return [[cell.strip() for cell in line.strip("| ").split("|")] for line in lines if line.startswith("|")]


def footer(section: str) -> str:
    """The line of a benchmark's section that says in how long, and on what, it was measured."""
    text = (ROOT / "BENCHMARKS.md").read_text().split(f"<!-- bench: {section} -->")[1]
    return re.search(r"<sub>Measured.*", text)[0]


def score_rows() -> list[tuple[str, str, str]]:
    """A row per kind of scenes and masks, as README and the model card print it, the command, and the file."""
    rows = []
    for (kind, (how, stem)), (masks, (which, end)) in product(KINDS.items(), MASKS.items()):
        file = f"docs/results/{stem}{end}.json"
        command = f"labkit evaluate --scenes 300 --config {stem.removesuffix('_perturbed')}{how}{which} --json {file}"
        if (ROOT / file).exists():
            row = " | ".join([kind, masks, *scores(json.loads((ROOT / file).read_text()), masks == "true masks")])
            rows.append((f"| {row} |", command, file))
    return rows


def scores(report: dict, exact: bool) -> list[str]:
    """The cells of a row: mean, target and boundary IoU, pixel accuracy, and lifts with their interval."""
    masks = [f"{x:.3f}" for x in (report["mean_iou"], report["iou"]["target"], report["boundary_iou"])]
    low, high = (f"{100 * x:.1f}" for x in report["lift_interval"])
    lifts = f"{100 * report['lift_rate']:.1f} % ({low} to {high})"
    return [*(["1"] * 4 if exact else [*masks, f"{report['pixel_accuracy']:.4f}"]), lifts]


def when(result: str) -> str:
    """Date and commit at which a result got its text: a file, a line FILE:TEXT, or a section of BENCHMARKS.md.

    A line that moved to another page keeps its commit.
    """
    file, _, text = (result if "/" in result or ":" in result else f"BENCHMARKS.md:{footer(result)}").partition(":")
    commit, end = "HEAD", ["--", file]
    if text:
        number = (ROOT / file).read_text().split(text)[0].count("\n") + 1
        commit, end = git("blame", "-C", "-C", "--porcelain", f"-L{number},{number}", "--", file).split()[0], []
        if not commit.strip("0"):
            raise SystemExit(f"{file}, line {number}: commit this result first, then `make evidence`")
    return git("log", "-1", "--date=short", "--format=%ad, %h", commit, *end)


def git(*words: str) -> str:
    """What git answers."""
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def page(when=when) -> str:
    """The page; `when` tells date and commit of a result. Raises ValueError for words that no page has."""
    masks = [f"{row} `{command}` | {when(result)} |" for row, command, result in score_rows()]
    known = numbers()
    promises = [
        f"| {said(words.format(**known))} | `{command}` | {says.format(**known)} | {when(result)} |"
        for words, command, says, result in PROMISES
    ]
    tested = [f"| {said(words)} | `{command}` |" for words, command in TESTED]
    return "\n".join([HEAD, *masks, PROMISED, *promises, TESTS, *tested, ""])


def said(words: str) -> str:
    """A promise and the page that makes it in these words; ValueError if there is none."""
    for name in PAGES:
        if words in " ".join((ROOT / name).read_text().split()):
            return f"{words} ([{Path(name).stem}]({os.path.relpath(ROOT / name, PAGE.parent)}))"
    raise ValueError(f"words: expected a promise that one of {', '.join(PAGES)} makes, got {words!r}")


HEAD = f"""# Evidence

`make evidence` writes this page from the files of results; it measures nothing itself. Date and commit tell when each
result was recorded. A test compares README, the guides and the model card with this page.

## Masks and lifts

{SCORES} command | measured |
|---|---|---|---|---|---|---|---|---|"""
PROMISED = """
## Other claims

| claim | command | last result | measured |
|---|---|---|---|"""
TESTS = """
## Claims shown by tests

These have no file of results; they pass or fail at the commit that you have checked out.

| claim | command |
|---|---|"""


if __name__ == "__main__":
    PAGE.write_text(page())
    print(f"wrote {PAGE.relative_to(ROOT)}")
