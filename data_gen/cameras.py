"""Ranges for a scene's camera in place of a config's own."""

from collections.abc import Mapping

from labkit.support.validation import require

LIMITS = {"distance": (0.2, 5.0), "elevation": (5.0, 89.0), "roll": (0.0, 180.0), "fov_y": (5.0, 120.0)}
Ranges = Mapping[str, object]  # by key a number, or [low, high]


def check_camera(camera: Ranges | None) -> dict[str, list[float]]:
    """Return ranges of a camera as [low, high] each; a number is both, and None is no range.

    Metres and degrees; keys: distance (from what is looked at), elevation (over the table), roll (up to so many degrees
    to either side), fov_y (vertical field of view). Raises ValueError for another key, or a value that makes no sense.

    >>> check_camera({"distance": 0.8, "elevation": (50, 70)})
    {'distance': [0.8, 0.8], 'elevation': [50.0, 70.0]}
    """
    camera = {} if camera is None else camera
    known = isinstance(camera, Mapping) and camera.keys() <= LIMITS.keys()
    require("camera", known, f"keys {', '.join(LIMITS)}", camera)
    ranges = {}
    for key, value in camera.items():
        ends = value if isinstance(value, list | tuple) else [value, value]
        low, high = LIMITS[key]
        is_range = len(ends) == 2 and all(isinstance(end, int | float) and end is not True for end in ends)
        is_range = is_range and low <= ends[0] <= ends[1] <= high
        unit = "metres" if key == "distance" else "degrees"
        require(f"camera: {key}", is_range, f"a number from {low:g} to {high:g} {unit}, or [low, high]", value)
        ranges[key] = [float(end) for end in ends]
    return ranges
