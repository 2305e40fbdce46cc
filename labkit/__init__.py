"""Semantic segmentation for robotic manipulation: one RGB-D image becomes one grasp.

    RGBDFrame -> class probabilities -> labels -> target cloud in the base frame -> grasp -> lift

Each arrow is a module; `labkit.pipeline` puts them in a row. Labs need more names: `from labkit import check`.
"""

import sys
from collections.abc import Callable

if not (3, 11) <= sys.version_info[:2] < (3, 14):
    raise ImportError(
        f"labkit needs Python 3.11, 3.12 or 3.13, this is {sys.version_info[0]}.{sys.version_info[1]}: the packages "
        "that it is pinned to have wheels for no other (`make` sets up .venv with the right one)"
    )

__version__ = "0.2.0"


def check(name: str, answer: object) -> Callable:
    """Check a student's answer, show the result, and return the function to go on with (`labgrader.check`)."""
    from labgrader.check import check

    return check(name, answer)


def check_file(path: str | None = None) -> None:
    """Check a saved lab, or the one that runs, as the grader will; print the results (`labgrader.file_check`)."""
    from labgrader.file_check import check_file

    check_file(path)
