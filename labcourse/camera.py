"""Another camera for the scenes of all lessons and labs: a line of pyproject.toml, or an environment variable.

    [tool.labcourse]
    camera = { distance = 0.8, elevation = 60 }

or `LABKIT_CAMERA="distance = 0.8, elevation = [50, 70]"`, which wins. Metres and degrees; a pair is a range. Keys:
distance (from the targets), elevation (over the table), roll (up to so many degrees to either side), fov_y (vertical
field of view). What is not named stays as each scene draws it. `labcourse.plots.style`, which every notebook calls,
puts it into force; data sets and scores never ask. `labkit renumber` then brings the lessons' numbers up to date.
"""

import os
import tomllib
from pathlib import Path

from labkit.support.validation import require

NAMED = "LABKIT_CAMERA"
LIMITS = {"distance": (0.2, 5.0), "elevation": (5.0, 89.0), "roll": (0.0, 180.0), "fov_y": (5.0, 120.0)}


def setting(folder: Path) -> dict:
    """What is set: the environment variable's keys, else those of a pyproject.toml in the folder or above it."""
    if text := os.environ.get(NAMED):
        try:
            return tomllib.loads(f"camera = {{ {text} }}")["camera"]
        except tomllib.TOMLDecodeError as error:
            raise ValueError(f"{NAMED}: expected `distance = 0.8, elevation = 60`, got {text!r}: {error}") from None
    for path in (place / "pyproject.toml" for place in (folder, *folder.parents)):
        if path.is_file():
            found = tomllib.loads(path.read_text(encoding="utf-8")).get("tool", {}).get("labcourse", {})
            return found.get("camera", {})
    return {}


def hold(folder: Path | None = None) -> None:
    """Put the setting into force for all scenes that this process draws from now on; none takes it back.

    Raises ValueError for a key or a value that makes no sense.
    """
    said = setting(Path(folder or os.getcwd()))
    if not said:
        return
    from data_gen import scenes

    require("camera", isinstance(said, dict) and said.keys() <= LIMITS.keys(), f"keys {', '.join(LIMITS)}", said)
    scenes.HELD.clear()
    for key, value in said.items():
        ends = value if isinstance(value, list) else [value, value]
        low, high = LIMITS[key]
        is_range = len(ends) == 2 and all(type(end) in (int, float) for end in ends) and low <= min(ends)
        is_range = is_range and ends[0] <= ends[1] <= high
        unit = "metres" if key == "distance" else "degrees"
        require(f"camera: {key}", is_range, f"a number from {low:g} to {high:g} {unit}, or [low, high]", value)
        scenes.HELD[key] = tuple(float(end) for end in ends)
