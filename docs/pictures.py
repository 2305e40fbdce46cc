"""Regenerates README's pictures: the demo, a lab in JupyterLab, the site (`make pictures`, after `make site`).

It needs Debian's Chromium. NAMES as arguments choose: demo, lab, site, explorers. The last are the moving pictures of
docs/ten_minutes.md, for readers of the repository, where no script runs; the site has the explorers in their place.
"""

import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import nbformat

ROOT = Path(__file__).resolve().parents[1]
DOCS, SITE = ROOT / "docs", ROOT / "out" / "site"
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(DOCS / "site")]
from explorers import OUT, build  # noqa: E402
from serving import TOKEN, cell_with, jupyterlab, open_page, wait_until_idle  # noqa: E402

DEMO_SEED = 8  # README says so
CHROMIUM = "/usr/bin/chromium"
# The lesson of an explorer, the control that moves in its picture, where the others stand, and where in the last frame.
MOVES = {
    "keyhole": ("03_gradient_network", "sees", {}, {"show the image and the true class": "yes"}),
    "sliding_mask": ("04_iou", "shift", {"radius": "4"}, {}),
    "name_that_bug": ("06_back_projection", "bug", {"mystery": "0"}, {}),
    "jaws_at_a_yaw": ("07_grasp", "yaw", {}, {}),
}
GIF_WIDTH, COLOURS, ROUND_MS, LEAST_MS, LAST_MS = 640, 96, 9000, 450, 2000
MOST_FRAMES = 25  # every second one of those that have more


def demo(browser) -> None:
    """The seven steps, and the film."""
    with tempfile.TemporaryDirectory() as out:
        command = [sys.executable, "-c", "from labcli.cli import main; main()", "demo"]
        subprocess.run([*command, "--seed", str(DEMO_SEED), "--out", out], cwd=ROOT, check=True)
        for name in ("demo.png", "demo.gif"):
            shutil.copy(Path(out) / name, DOCS / name)


def lab(browser) -> None:
    """Lab 04 with a wrong answer, whose place is marked, and a right one, ticked."""
    solution = nbformat.read(ROOT / "solutions/04_iou/04_iou.ipynb", as_version=4)
    answers = {cell.metadata.get("nbgrader", {}).get("grade_id"): cell.source for cell in solution.cells}
    right = "\n".join(line for line in answers["confusion_matrix"].splitlines() if "###" not in line)
    wrong = "def iou(n):\n    tp = np.diag(n)\n    return tp - (n.sum(axis=0) + n.sum(axis=1) - tp)"
    with tempfile.TemporaryDirectory() as place:
        course, home = Path(place) / "course", Path(place) / "jupyter"
        home.mkdir()
        shutil.copytree(ROOT / "labs", course / "labs")
        with jupyterlab(course, home) as url:
            page = browser.new_page(viewport={"width": 1100, "height": 760}, device_scale_factor=1.5)
            page.set_default_timeout(300_000)
            open_page(page, f"{url}/lab/tree/labs/04_iou/04_iou.ipynb?token={TOKEN}&reset")
            for start in ("import numpy as np", "from labkit import check"):
                cell_with(page, start).locator(".cm-content").click()
                page.keyboard.press("Shift+Enter")
            for start, text in (("def confusion_matrix(", right), ("def iou(", wrong)):
                cell_with(page, start).locator(".cm-content").click()
                page.keyboard.press("Control+a")
                page.keyboard.insert_text(text)
                page.keyboard.press("Shift+Enter")
                page.keyboard.press("Shift+Enter")
            said = cell_with(page, 'iou = check("04_iou.iou"').locator(".jp-OutputArea-output")
            said.filter(has_text="returns").first.wait_for()
            page.wait_for_function("() => !document.body.innerText.includes('Looking for the place')")
            wait_until_idle(page)
            cell_with(page, "def iou(").evaluate("cell => cell.scrollIntoView({block: 'start'})")
            page.wait_for_timeout(1000)
            page.screenshot(path=DOCS / "lab.png")
            page.close()


def site(browser) -> None:
    """The first page on a desktop, and an explorer in the dark on a phone; `make site` made the pages."""
    if not (SITE / "index.html").exists():
        raise SystemExit("out/site: expected the site, found none; run `make site` first")
    desk = browser.new_page(viewport={"width": 1280, "height": 800})
    desk.goto((SITE / "index.html").as_uri())
    desk.wait_for_function("[...document.images].slice(0, 3).every((image) => image.complete)")
    desk.screenshot(path=DOCS / "site_desktop.png")
    phone = browser.new_page(viewport={"width": 390, "height": 760}, color_scheme="dark")
    phone.goto((SITE / "lessons/04_iou.html").as_uri())
    explorer = phone.locator("#explorer-sliding_mask")
    explorer.scroll_into_view_if_needed()
    picture = explorer.locator("img").element_handle()
    phone.wait_for_function("(image) => image.complete && image.naturalWidth > 0", arg=picture)
    explorer.evaluate("figure => figure.scrollIntoView({block: 'start'})")
    phone.screenshot(path=DOCS / "site_phone.png")


def explorers(browser) -> None:
    """A GIF for each explorer of MOVES: one control goes through its options."""
    from PIL import Image

    for name, (lesson, moved, others, last) in MOVES.items():
        build([f"lessons/{lesson}"])
        folder = OUT / lesson / name
        numbers = states(folder, moved, others)
        numbers += states(folder, moved, others | last)[-1:] if last else []
        frames = [Image.open(folder / f"{n}.webp").convert("RGB") for n in numbers]
        size = (GIF_WIDTH, round(GIF_WIDTH * frames[0].height / frames[0].width))
        frames = [frame.resize(size, Image.Resampling.LANCZOS) for frame in frames]
        frames = [frame.quantize(COLOURS, dither=Image.Dither.NONE) for frame in frames]
        durations = [max(LEAST_MS, ROUND_MS // len(frames))] * (len(frames) - 1) + [LAST_MS]
        target = DOCS / f"explorer_{name}.gif"
        frames[0].save(target, save_all=True, append_images=frames[1:], duration=durations, loop=0, optimize=True)


def states(folder: Path, moved: str, others: dict[str, str]) -> list[int]:
    """The numbers of an explorer's states in which one control goes through its options and the others stand still."""
    controls = json.loads((folder / "state.json").read_text(encoding="utf-8"))["controls"]
    wrong = {moved, *others} - {control["label"] for control in controls}
    if wrong:
        raise ValueError(f"MOVES: {folder.name} has no control {', '.join(wrong)}")
    stand = [c["options"].index(others[c["label"]]) if c["label"] in others else c["start"] for c in controls]
    place = next(i for i, control in enumerate(controls) if control["label"] == moved)
    count = len(controls[place]["options"])
    found = []
    for option in range(0, count, math.ceil(count / MOST_FRAMES)):
        number = 0
        for i, control in enumerate(controls):  # the last control's options lie next to each other
            number = number * len(control["options"]) + (option if i == place else stand[i])
        found.append(number)
    return found


ALL = {"demo": demo, "lab": lab, "site": site, "explorers": explorers}

if __name__ == "__main__":
    from playwright.sync_api import sync_playwright

    os.environ["PYTHONPATH"] = str(ROOT)
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        for name in sys.argv[1:] or ALL:
            ALL[name](chromium)
            print(f"{name}: regenerated in docs/")
        chromium.close()
