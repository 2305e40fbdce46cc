"""Semantic segmentation for robotic manipulation: one RGB-D image becomes one grasp.

    from labkit import Gripper, Pipeline, RGBDFrame, load_model

    RGBDFrame -> class probabilities -> labels -> target cloud in the base frame -> grasp -> lift

Each arrow is a module; `labkit.pipeline` puts them in a row. `check` and `check_file` are the course's, those of
`labgrader`: notebooks import them from here.
"""

import importlib
import sys

if not (3, 11) <= sys.version_info[:2] < (3, 14):
    raise ImportError(
        f"labkit needs Python 3.11, 3.12 or 3.13, this is {sys.version_info[0]}.{sys.version_info[1]}: the packages "
        "that it is pinned to have wheels for no other (`make` sets up .venv with the right one)"
    )

__version__ = "0.2.0"
# What most users begin with, and its module, which is loaded when the name is asked for: `import labkit` loads nothing.
OFFERED = {
    "Gripper": "labkit.grasp",
    "Pipeline": "labkit.pipeline",
    "RGBDFrame": "labkit.frame",
    "load_model": "labkit.network",
    # In a notebook it notes which cells run, so it is loaded where it is imported, not at the first call.
    "check": "labgrader.check",
}


def __getattr__(name: str):
    """A name of OFFERED."""
    if name not in OFFERED:
        raise AttributeError(f"module 'labkit' has no attribute {name!r}")
    return getattr(importlib.import_module(OFFERED[name]), name)


def __dir__() -> list[str]:
    """What tab completion shows."""
    return [*globals(), *OFFERED]


def check_file(path: str | None = None) -> None:
    """Check a saved lab, or the one that runs, as the grader will; print the results (`labgrader.file_check`)."""
    importlib.import_module("labgrader.file_check").check_file(path)  # what it returns is no output of a cell
