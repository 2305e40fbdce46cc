"""What somebody's small file says: the one reader of JSON, YAML and OpenCV's XML, for cameras, grippers and poses.

Files come from strangers, too: none of a few lines may take all memory or time, and none is refused but in words.
"""

import json
import re
import xml.etree.ElementTree as xml
from io import StringIO
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent, MappingStartEvent, ScalarEvent

from labkit.support.validation import require

MOST_BYTES = {"JSON": 32 << 20, "YAML": 1 << 17, "XML": 1 << 20}  # YAML is read slowly
DEEPEST = 20  # of what is nested in a file
OPENCV = re.compile(r"^%YAML:1\.0")  # what OpenCV writes and YAML does not know
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")

ROS2_BAG = (
    "a recording of ROS 2; play it, and `ros2 topic echo --once TOPIC > camera.yaml` writes a CameraInfo down, or "
    "answer it whole with `labkit node bag`"
)
NO_TEXT = {  # what a file begins with, and what it is
    b"PK\x03\x04": "an archive, as Record3D's .r3d is: unpack it, and name the file in it",
    b"#ROSBAG V2.0": (
        "a recording of ROS 1; `rostopic echo -b BAG -n 1 TOPIC > camera.yaml` writes a CameraInfo down, or answer it "
        "whole with `labkit node bag`"
    ),
    b"SQLite format 3": ROS2_BAG,
    b"\x89MCAP": ROS2_BAG,
    b"\x89PNG": "a picture",
    b"\xff\xd8\xff": "a picture",
    b"%PDF": "a PDF",
    b"%time,field": "what `rostopic echo -p` prints: leave -p out",
}


def numbers_of(text: str) -> list[float]:
    """The numbers of a text that holds nothing else but brackets and lines that begin with #; none if it does.

    >>> numbers_of("# K\\n[[1. 2.5]\\n [3. 4.]]"), numbers_of("[1, 2.5; 3]"), numbers_of("camera.json")
    ([1.0, 2.5, 3.0, 4.0], [1.0, 2.5, 3.0], [])
    """
    if len(text) > 10_000:
        return []
    words = re.split(r"[\s,;\[\]()]+", re.sub(r"^\s*(#|//).*$", "", text, flags=re.MULTILINE).strip(" \t\r\n,;[]()"))
    numbers = [float(word) for word in words if NUMBER.fullmatch(word)]
    return numbers if len(numbers) == len(words) and np.isfinite(numbers).all() else []


def text_of(name: str, path) -> str:
    """The text of a small file; `name` is the argument that the errors speak of, FileNotFoundError or ValueError."""
    path = Path(path)
    with path.open("rb") as file:
        begins = file.read(16)
    for magic, what in NO_TEXT.items():
        require(name, not begins.startswith(magic), f"a text in {path}", what)
    require(name, path.stat().st_size <= max(MOST_BYTES.values()), "a small file", f"{path.stat().st_size} bytes")
    return path.read_text(encoding="utf-8-sig", errors="replace")


def parsed(name: str, text: str):
    """What a JSON, YAML or OpenCV XML text says: dicts with texts as names, lists, texts, numbers.

    Of several YAML documents, as `ros2 topic echo` prints them, the first that says something counts. Raises ValueError
    that speaks of `name` for anything else: aliases, which a few lines of could fill all memory, what is nested deeper
    than 20, or more than any camera has to say.
    """
    try:
        if text.lstrip().startswith("<"):
            return _sized("XML", text, _of_xml)
        try:
            return _checked(_sized("JSON", text, json.loads))
        except json.JSONDecodeError:
            return _sized("YAML", text, _of_yaml)
    except (YAMLError, xml.ParseError, RecursionError, OverflowError, ValueError) as error:
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        if isinstance(error, RecursionError):
            reason = f"it is nested deeper than {DEEPEST}"
        raise ValueError(f"{name}: expected JSON or YAML that can be read, got other text ({reason})") from None


def _sized(kind: str, text: str, read):
    if len(text) > MOST_BYTES[kind]:
        raise ValueError(f"it is {len(text)} characters of {kind}, more than {MOST_BYTES[kind]}")
    return read(text)


def _of_yaml(text: str):
    """The first document that says something, built of the parser's events: no tag and no alias makes anything."""
    open_, documents = [], []
    for event in YAML(typ="safe", pure=True).parse(StringIO(OPENCV.sub("", text))):
        if isinstance(event, AliasEvent):
            raise ValueError(f"it has an alias, *{event.anchor}: write out what it stands for")
        if isinstance(event, CollectionStartEvent):
            open_.append(([], isinstance(event, MappingStartEvent)))
            if len(open_) > DEEPEST:
                raise RecursionError
            continue
        if isinstance(event, CollectionEndEvent):
            items, has_names = open_.pop()
            value = dict(zip(map(str, items[::2]), items[1::2], strict=True)) if has_names else items
        elif isinstance(event, ScalarEvent):
            value = _scalar(event.value) if event.implicit[0] else event.value
        else:
            continue
        (open_[-1][0] if open_ else documents).append(value)
        if len(documents) == 1 and documents[0] not in (None, ""):
            return documents[0]
        if not open_:
            documents.clear()
    return None


def _scalar(word: str):
    if NUMBER.fullmatch(word):
        return float(word) if not word.lstrip("+-").isdigit() else int(word)
    return {"": None, "~": None, "null": None, "true": True, "false": False}.get(word.lower(), word)


def _of_xml(text: str) -> dict:
    if "<!" in re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL):
        raise ValueError("it declares entities or a document type")
    return _of_element(xml.fromstring(text), 0)


def _of_element(element, depth: int):
    """A dict of an element's children, or its text: of several numbers a list."""
    if depth > DEEPEST:
        raise RecursionError
    if len(element):
        return {child.tag: _of_element(child, depth + 1) for child in element}
    words = (element.text or "").split()
    values = [float(word) if NUMBER.fullmatch(word) else word for word in words]
    return values[0] if len(values) == 1 else values


def _checked(value, depth: int = 0):
    """The same with texts as names, if it is not nested too deep."""
    if depth > DEEPEST:
        raise RecursionError
    if isinstance(value, dict):
        return {str(key): _checked(item, depth + 1) for key, item in value.items()}
    return [_checked(item, depth + 1) for item in value] if isinstance(value, list) else value


def flat_numbers(value, most: int = 100) -> list[float] | None:
    """The finite numbers of a list, of lists of lists, or of OpenCV's {data: ...}; None if it holds anything else.

    >>> flat_numbers([[1, 2], [3, 4.5]]), flat_numbers({"rows": 1, "data": [7]}), flat_numbers([1, "2"])
    ([1.0, 2.0, 3.0, 4.5], [7.0], None)
    """
    if isinstance(value, dict):
        value = value.get("data")
    if not isinstance(value, list):
        return None
    found = []
    for item in value:
        inner = flat_numbers(item) if isinstance(item, list) else [number_of(item)]
        if inner is None or None in inner or len(found) + len(inner) > most:
            return None
        found += inner
    return found


def number_of(value) -> float | None:
    """A finite number, or None: True, texts, NaN, and whole numbers of more digits than a float has are none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if np.isfinite(number) else None
