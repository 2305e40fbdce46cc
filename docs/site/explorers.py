"""The lessons' explorers for readers without a kernel: pictures of some states, which explorers.js switches between.

    python docs/site/explorers.py LESSON.ipynb FOLDER

runs a lesson up to its last explorer, and writes for each one a folder of WebP pictures and `state.json`: the controls
with their options, where they start, and what each state's picture says in words (the titles in it). The states are all
combinations of options, the last control's options next to each other. `build` does so for all lessons, and keeps what
is there as long as the lesson's code and the kit's are the same.
"""

import ast
import hashlib
import html
import io
import itertools
import json
import math
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parents[2]
ROOMS = ("labkit", "labtrain", "labcourse", "data_gen")  # what draws an explorer's picture
OUT = ROOT / "out" / "explorers"
LIMIT = 60  # states per explorer
DOTS = 120  # per inch of a picture; a page shows it with 80

# What the sliders of a page stop at, where the lesson's tasks need other values than evenly spread ones. A dict in
# place of a list is one control that sets several: label -> their values. It stands for those that no page can carry,
# such as a button for each pixel.
THING = ["pixel_2_1", "pixel_1_1", "pixel_2_2", "pixel_1_2", "pixel_2_3", "pixel_3_3"]
CLICKS = {"none": {f"pixel_{v}_{u}": False for v in range(4) for u in range(5)}}
CLICKS |= {f"{n} of the thing's 6": dict.fromkeys(THING[:n], True) for n in range(1, 7)}
CLICKS |= {"all 6, and the corner's 2": dict.fromkeys([*THING, "pixel_0_3", "pixel_0_4"], True)}
POINTS = [(172, 112), (120, 122), (88, 115), (172, 155), (140, 85), (43, 110), (250, 80)]
THINGS = [(139, 137), (66, 133), (196, 109), (227, 106), (209, 141), (193, 129), (60, 160)]
# What is pointed at, without a second click; then the round box and the small thing behind it, parted by one.
POINTED = {f"u = {u}, v = {v}": {"u": u, "v": v, "part": False} for u, v in THINGS}
for (u, v), (not_u, not_v) in (((209, 141), (193, 129)), ((193, 129), (209, 141))):
    parted = {"u": u, "v": v, "part": True, "not_u": not_u, "not_v": not_v}
    POINTED[f"u = {u}, v = {v}, not u = {not_u}, v = {not_v}"] = parted
BUGS = {"swapped": "u for the row", "ray": "depth along the ray", "buffer": "depth buffer", "view": "view matrix"}
BUGS |= {"opengl": "OpenGL's axes"}
CHOSEN = {
    "segmentation_bits": {"body": [0, 5, 20, 40], "link": range(-1, 12)},
    "you_are_the_solver": {"pixels clicked": CLICKS, "lam": [0.0, 2.0, 3.0]},
    "logits": {"z0": [-8.0, 2.0, 8.0], "z1": [1.0, 7.0], "z2": [-8.0, -1.0, 5.0], "y": [1], "h": [1e-16, 1e-5, 1.0]},
    "keyhole": {"pixel": {f"u = {u}, v = {v}": {"u": u, "v": v} for u, v in POINTS}},
    "votes_that_meet": {"side": [10, 16, 18, 20, 24, 36, 50], "sigma": [0.0, 2.0, 4.0, 6.0, 10.0, 14.0, 16.0, 18.0]},
    "pick_a_thing": {"pixel": POINTED},
    "sliding_mask": {"shift": [0, 1, 2, 3, 4, 5, 6, 8, 10, 13, 18, 24], "radius": [2, 4, 5, 9, 14]},
    "gaussians": {
        "exponent": [-4, -2, -1, 0, 0.5, 1, 2, 3, 4, 5, 5.25, 5.5, 6, 8, 10],
        "distance": [2.0, 5.0],
        "share": [0.02, 0.5],
    },
    "name_that_bug": {"bug": {"none": {}} | {name: {bug: True} for bug, name in BUGS.items()}},
    "depth_noise": {"u": [0, 160, 300], "d": [0.5, 1.0, 2.0], "sigma_pixel": [0.0, 0.5, 2.0], "sigma_depth": [0, 10]},
    "tilt_the_sheet": {"tilt": [3, 5, 8, 10, 11, 12, 15, 20, 30, 45], "count": [3, 6, 12], "noise": [0.1, 0.3]},
    "try_a_height": {"height": range(-20, 161, 10)},
    "jaws_at_a_yaw": {"yaw": sorted({*range(0, 181, 4), 66, 94, 122})},
    "sync_explorer": {
        "slop": [0, 2, 4, 6, 8, 10, 12, 14, 20, 27, 33, 35, 40, 50, 60],
        "jitter": [0, 12],
        "lost": [0, 0.2],
    },
    "lag_explorer": {
        "network": [40, 75, 90, 110, 130, 135, 140, 145, 150, 160, 180, 200, 220, 250, 300],
        "rate": [15, 60],
        "speed": [100, 200],
    },
    "colour_range": {
        "first": [0, 150, 160, 165, 169],
        "last": [170, 179],
        "saturation": [50, 150],
        "value": [(190, 255), (174, 255), (174, 210)],
    },
    "wipe": {"at": [0, 30, 60, 90, 120, 145, 160, 185, 215, 245, 280, 320], "left": ["U-Net"]},
}

# ------------------------------------------------------------------------------------------- an explorer's states


def options_of(control) -> dict[str, object]:
    """All options of an ipywidgets control: label -> value."""
    import ipywidgets
    import numpy as np

    if hasattr(control, "_options_full"):
        return dict(control._options_full)
    if isinstance(control, ipywidgets.Checkbox | ipywidgets.ToggleButton):
        return {"no": False, "yes": True}
    if isinstance(control, ipywidgets.IntRangeSlider):  # too many: CHOSEN has to name some
        return {"": control.value}
    values = np.arange(control.min, control.max + control.step / 2, control.step)
    return {f"{value:.10g}": type(control.value)(round(value, 9)) for value in values}


def thinned(controls: list[dict]) -> None:
    """Leave out options of sliders, evenly and not the start, until all combinations are LIMIT at most."""
    strides = [1] * len(controls)

    def kept(i: int) -> list[int]:
        count, start = len(controls[i]["options"]), controls[i]["start"]
        return list(range(start % strides[i], count, strides[i]))

    while math.prod(len(kept(i)) for i in range(len(controls))) > LIMIT:
        sliders = [i for i, c in enumerate(controls) if c["kind"] == "slider" and not c.get("chosen")]
        strides[max(sliders, key=lambda i: len(kept(i)))] += 1
    for i, control in enumerate(controls):
        keep = kept(i)
        control["options"] = [control["options"][k] for k in keep]
        control["start"] = keep.index(control["start"])


def controls_of(name: str, explorer) -> list[dict]:
    """The controls that a page shows: label, kind, options as (label, values of the explorer's controls), and start."""
    import ipywidgets

    chosen, found = CHOSEN.get(name, {}), []
    for label, choice in chosen.items():
        if isinstance(choice, dict):
            found.append({"label": label, "kind": "list", "options": list(choice.items()), "start": 0, "chosen": True})
    bundled = {key for control in found for _, values in control["options"] for key in values}
    for key, control in explorer.controls.items():
        if key in bundled or not control.has_trait("value"):
            continue
        labels = {value: label for label, value in options_of(control).items()}
        values = list(chosen.get(key, labels))
        assert control.value in values, f"{name}, {key}: the start, {control.value}, is not among the chosen ones"
        named = [(labels.get(value) or " to ".join(map(str, value)), {key: value}) for value in values]
        if isinstance(control, ipywidgets.Dropdown | ipywidgets.ToggleButtons):
            kind = "list"
        elif isinstance(control, ipywidgets.Checkbox | ipywidgets.ToggleButton):
            kind = "box"
        else:
            kind = "slider"
        shown = {"label": control.description or key, "kind": kind, "options": named, "chosen": key in chosen}
        found.append(shown | {"start": values.index(control.value)})
    strange = chosen.keys() - {*explorer.controls, *(control["label"] for control in found)}
    assert not strange, f"{name} has no {strange}"
    thinned(found)
    return [control for control in found if len(control["options"]) > 1]


def webp(rgb) -> bytes:
    """Pack a picture (H, W, 3): curves with sharp edges in 128 colours, photographs as such, whichever is smaller."""
    from PIL import Image

    picture, few, many = Image.fromarray(rgb), io.BytesIO(), io.BytesIO()
    picture.quantize(128, dither=Image.Dither.NONE).convert("RGB").save(few, "webp", lossless=True)
    picture.save(many, "webp", quality=75)
    return min(few.getvalue(), many.getvalue(), key=len)


def write(name: str, explorer, folder: Path) -> None:
    """Draw an explorer's states into a folder."""
    import numpy as np

    controls, words = controls_of(name, explorer), []
    folder.mkdir(parents=True)
    explorer.dpi = DOTS
    for n, picked in enumerate(itertools.product(*(control["options"] for control in controls))):
        figure = explorer.figure(**{key: value for _, values in picked for key, value in values.items()})
        figure.canvas.draw()
        (folder / f"{n}.webp").write_bytes(webp(np.asarray(figure.canvas.buffer_rgba())[..., :3]))
        titles = [figure.get_suptitle(), *(axes.get_title() for axes in figure.axes)]
        words.append(". ".join(" ".join(title.split()) for title in titles if title))
    for control in controls:
        control["options"] = [label for label, _ in control["options"]]
    width, height = (round(80 * side) for side in explorer.size)
    every = math.prod(len(options_of(c)) for c in explorer.controls.values() if c.has_trait("value"))
    state = {"controls": controls, "words": words, "width": width, "height": height, "some": len(words) < every}
    (folder / "state.json").write_text(json.dumps(state))


# ------------------------------------------------------------------------------------------- lessons, and their pages


def shows_explorer(cell: dict) -> bool:
    """Whether a cell of a notebook has an explorer for its output."""
    texts = ("".join(output.get("data", {}).get("text/plain", "")) for output in cell.get("outputs", []))
    return any(text.startswith("an explorer:") for text in texts)


def walk(lesson: Path, folder: Path) -> None:
    """Run a lesson as far as its last explorer, and write each one; `folder`/names.json has their names in order."""
    os.environ["MPLBACKEND"] = "agg"
    sys.path.insert(0, str(ROOT))
    folder = folder.resolve()
    os.chdir(lesson.parent)
    cells = [cell for cell in json.loads(Path(lesson.name).read_text())["cells"] if cell["cell_type"] == "code"]
    waiting, names = sum(map(shows_explorer, cells)), []
    scope = {"__name__": "lesson"}
    for cell in cells:
        tree = ast.parse("".join(cell["source"]))
        shown = tree.body.pop() if shows_explorer(cell) else None  # its last line is an expression, as of all that show
        exec(compile(tree, lesson.name, "exec"), scope)
        if shown:
            explorer = eval(compile(ast.Expression(shown.value), lesson.name, "eval"), scope)
            names.append(explorer.draw.__qualname__.partition(".")[0].removeprefix("draw_"))
            write(names[-1], explorer, folder / names[-1])
        if len(names) == waiting:
            break
    (folder / "names.json").write_text(json.dumps(names))


def build(lessons: list[str]) -> dict[str, list[str]]:
    """Walk the lessons (pages as Sphinx names them) that changed; give the names of each one's explorers, in order."""
    kit = [Path(__file__), *(path for room in ROOMS for path in sorted(ROOT.glob(f"{room}/**/*.py")))]
    code = hashlib.sha256(b"".join(path.read_bytes() for path in kit))

    def names(page: str) -> list[str]:
        cells = json.loads((ROOT / f"{page}.ipynb").read_text())["cells"]
        if not any(map(shows_explorer, cells)):
            return []
        key, folder = code.copy(), OUT / Path(page).name
        key.update(json.dumps([cell["source"] for cell in cells if cell["cell_type"] == "code"]).encode())
        if not (folder / "key").exists() or (folder / "key").read_text() != key.hexdigest():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            command = [sys.executable, __file__, str(ROOT / f"{page}.ipynb"), str(folder)]
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode:
                raise RuntimeError(f"{page}: its explorers could not be drawn\n{done.stderr[-2000:]}")
            (folder / "key").write_text(key.hexdigest())
        return json.loads((folder / "names.json").read_text())

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return dict(zip(lessons, pool.map(names, lessons), strict=True))


def page(name: str, place: str) -> str:
    """The piece of HTML that shows an explorer on a page; views.js puts its controls there."""
    (folder,) = OUT.glob(f"*/{name}")
    state = json.loads((folder / "state.json").read_text())
    start = 0
    for control in state["controls"]:
        start = start * len(control["options"]) + control["start"]
    source = "../" * place.count("/") + f"_static/explorers/{name}/{start}.webp"
    size = f'width="{state["width"]}" height="{state["height"]}" style="--width: {state["width"]}px"'
    text = json.dumps({"controls": state["controls"], "words": state["words"]}).replace("</", "<\\/")
    note = (
        f'<p class="note">The controls have {len(state["words"])} positions here; in JupyterLab they move freely.</p>'
    )
    note = note if state["some"] else ""
    return (
        f'<figure class="explorer" id="explorer-{name}"><script type="application/json">{text}</script>'
        f'<div class="picture" tabindex="0" role="group" aria-label="Picture">'
        f'<img src="{source}" {size} loading="lazy" alt="What the controls stand at; below in words"></div>'
        f'<figcaption><p aria-live="polite">{html.escape(state["words"][start])}</p>'
        f"{note}</figcaption></figure>"
    )


if __name__ == "__main__":
    walk(Path(sys.argv[1]).resolve(), Path(sys.argv[2]))
