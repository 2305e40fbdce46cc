"""Another camera for the scenes of all lessons and labs: a line of pyproject.toml, or an environment variable.

    [tool.labcourse]
    camera = { distance = 0.8, elevation = 60 }

or `LABKIT_CAMERA="distance = 0.8, elevation = [50, 70]"`, which wins. Metres and degrees; a pair is a range. Keys:
distance (from the targets), elevation (over the table), roll (up to so many degrees to either side), fov_y (vertical
field of view). What is not named stays as each scene draws it. Notebooks draw their scenes with the `sample_scene` of
this module; data sets and scores, whose scenes are `data_gen`'s own, never ask. `labkit renumber` then brings the
lessons' numbers up to date.
"""

import os
import tomllib
from pathlib import Path

from labkit.sim.spec import SceneSpec

NAMED = "LABKIT_CAMERA"


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


def sample_scene(seed: int, config: str = "train") -> SceneSpec:
    """`data_gen.sample_scene`, seen by the course's camera if one is set where this runs; raises as it does."""
    import data_gen

    return data_gen.sample_scene(seed, config, setting(Path.cwd()))
