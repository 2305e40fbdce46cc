"""Draw the lessons' schematics: `python lessons/schematics` writes them, `--check` names those that have changed.

Each module `tNN.py` beside this one holds those of a topic; a schematic is the SVG file of its name in this folder.
`--png FOLDER` draws them there as pictures, to be looked at: each on a light and on a dark page.
"""

import argparse
import importlib
import sys
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.image import imsave
from style import ALL, SETTINGS, Schematic

HERE = Path(__file__).parent


def drifted() -> list[str]:
    """Names of files that are not what the code draws: other bytes, missing, or drawn by nobody."""
    files = {path.stem: path.read_bytes() for path in HERE.glob("*.svg")}
    drawn = {name: schematic.svg() for name, schematic in ALL.items()}
    return sorted(name for name in files.keys() | drawn.keys() if files.get(name) != drawn.get(name))


def preview(schematic: Schematic, folder: Path) -> None:
    """Show a schematic as a reader sees it, 700 pixels wide, on a light and on a dark page."""
    with matplotlib.rc_context(SETTINGS):
        figure = schematic.figure()
        figure.set_dpi(700 / figure.get_figwidth())
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
    card = np.asarray(canvas.buffer_rgba())[..., :3]
    pages = [np.pad(card, ((30, 30), (30, 30), (0, 0)), constant_values=page) for page in (255, 17)]
    imsave(folder / f"{schematic.name}.png", np.concatenate(pages))


def main() -> int:
    """Do what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="change nothing; fail if a file is not as drawn")
    parser.add_argument("--png", type=Path, metavar="FOLDER", help="draw pictures to look at instead")
    asked = parser.parse_args()
    for path in sorted(HERE.glob("t[0-9][0-9].py")):
        importlib.import_module(path.stem)
    if asked.png:
        asked.png.mkdir(parents=True, exist_ok=True)
        for schematic in ALL.values():
            preview(schematic, asked.png)
        return 0
    changed = drifted()
    print("\n".join(f"{name}.svg" for name in changed) or "the schematics are as the code draws them")
    if asked.check:
        return int(bool(changed))
    for name in changed:
        if name in ALL:
            (HERE / f"{name}.svg").write_bytes(ALL[name].svg())
        else:
            (HERE / f"{name}.svg").unlink()
    return 0


if __name__ == "__main__":
    sys.exit(main())
