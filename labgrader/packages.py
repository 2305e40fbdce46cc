"""What a package requires, what of it is installed, and what the constraints file pins."""

import functools
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name


def read_pins(constraints) -> dict[str, Requirement]:
    """Read the lines NAME==VERSION of a constraints file, by canonical name."""
    lines = (line.split("#")[0].strip() for line in Path(constraints).read_text(encoding="utf-8").splitlines())
    pins = [Requirement(line) for line in lines if line]
    return {canonicalize_name(pin.name): pin for pin in pins}


@functools.cache
def distribution_of(package: str) -> str:
    """The name under which the project that has a package is installed; the first on the path, if several have it.

    >>> distribution_of("cv2").startswith("opencv-")
    True
    """
    return metadata.packages_distributions()[package][0]


def requirements(package: str, extra: str = "") -> dict[str, str | None]:
    """The version of each package that `package` requires on this machine, directly or not; None if it is missing.

    Raises PackageNotFoundError if `package` itself is not installed.
    """
    metadata.version(package)
    found: dict[str, str | None] = {}
    seen, waiting = set(), [(canonicalize_name(package), extra)]
    while waiting:
        name, extra = waiting.pop()
        if (name, extra) in seen:
            continue
        seen.add((name, extra))
        for line in metadata.requires(name) or []:
            needed = Requirement(line)
            if needed.marker is not None and not needed.marker.evaluate({"extra": extra}):
                continue
            child = canonicalize_name(needed.name)
            try:
                found[child] = metadata.version(child)
            except metadata.PackageNotFoundError:
                found[child] = None
                continue
            waiting += [(child, e) for e in ("", *needed.extras)]
    found.pop(canonicalize_name(package), None)
    return found
