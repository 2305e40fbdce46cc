"""What librealsense's own programs print of a camera: rs-enumerate-devices -c, the viewer's CSV, and Python's print."""

import re

from labcli.documents import NUMBER

BLOCK = re.compile(r'Intrinsic of\s+"([^"\n]+)"\s*/\s*(\d+x\d+)[^\n]*\n((?:[^\n:]{1,40}:[^\n]*\n?)+)')
PRINTED = re.compile(r"\[\s*(\d+)x(\d+)\s+p\[(\S+) (\S+)\]\s+f\[(\S+) (\S+)\]\s+([\w ]+?)\s+\[([^\]\n]*)\]\s*\]")
NAMES = {"resolution x": "width", "resolution y": "height", "distortion": "model", "distorsion": "model"}
CSV = "Frame Info:"  # how the viewer's begins
WITHOUT = (
    "intrinsics: the viewer's CSV has no coefficients of the lens, which are taken for 0; rs-enumerate-devices -c "
    "prints them"
)


def cameras_printed(text: str) -> dict[str, dict]:
    """The cameras of a text by name, each as `camera_of` takes it; none if librealsense did not write the text.

    >>> cameras_printed("[ 640x480  p[320 240]  f[600 601]  Brown Conrady [0 0 0 0 0] ]")[""]["ppx"]
    320.0
    """
    if len(text) > 1 << 17:
        return {}
    if found := PRINTED.fullmatch(text.strip()):
        *numbers, model, coefficients = found.groups()
        facts = zip(("width", "height", "ppx", "ppy", "fx", "fy"), map(_value, numbers), strict=True)
        return {"": {**dict(facts), "model": model, "coeffs": _values(coefficients)}}
    if text.startswith(CSV):
        return {"": _facts(line.split(",", 1) for line in text.splitlines() if "," in line)}
    return {
        f"{stream} {size}": _facts(line.split(":", 1) for line in lines.splitlines() if ":" in line)
        for stream, size, lines in BLOCK.findall(text)
    }


def _facts(rows) -> dict:
    named = {name.strip().lower(): value.strip() for name, value in rows}
    return {NAMES.get(name, name): _values(v) if name == "coeffs" else _value(v) for name, v in named.items()}


def _value(word: str):
    return float(word) if NUMBER.fullmatch(word) else word


def _values(words: str) -> list:
    return [_value(word) for word in words.split()]
