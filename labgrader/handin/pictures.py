"""Pictures that students attach to their answers in words: a photograph of a derivation, a drawing.

A notebook holds them in the cell, as base64. Only what begins as a picture of one of four kinds is taken, so that no
page shows a stranger's file as anything else.
"""

import base64
import binascii
from collections.abc import Collection, Sequence

from labgrader.program.cell import grade_id

BEGINNINGS = {
    "image/png": (b"\x89PNG\r\n\x1a\n",),
    "image/jpeg": (b"\xff\xd8\xff",),
    "image/gif": (b"GIF87a", b"GIF89a"),
    "image/webp": (b"RIFF",),
}
MOST_BYTES = 16 << 20  # of an answer's pictures as base64: two photographs of a telephone
LONGEST_NAME = 100  # characters

Pictures = dict[str, dict[str, str]]  # base64 by kind, by the picture's name, as a notebook's cell has them


def pictures_of(cells: Sequence, written: Collection[str]) -> dict[str, Pictures]:
    """The pictures of the answers in words, by grade id; what is no picture, or too much, is left out."""
    found: dict[str, Pictures] = {}
    for cell in cells:
        if (name := grade_id(cell)) in written and isinstance(attached := cell.get("attachments"), dict):
            for title, content in attached.items():
                picture = picture_in(content)
                left = MOST_BYTES - sum(len(data) for one in found.get(name, {}).values() for data in one.values())
                if picture and len(title) <= LONGEST_NAME and len(picture[1]) <= left:
                    found.setdefault(name, {})[title] = dict([picture])
    return found


def picture_in(content: object) -> tuple[str, str] | None:
    """The kind and the base64 of an attachment that is a picture, None for any other.

    >>> picture_in({"image/gif": "R0lGODlhAQABAAAAACw="}), picture_in({"image/svg+xml": "PHN2Zz4="})
    (('image/gif', 'R0lGODlhAQABAAAAACw='), None)
    """
    for kind, data in content.items() if isinstance(content, dict) else ():
        data = "".join(data) if isinstance(data, list) and all(isinstance(line, str) for line in data) else data
        try:
            start = base64.b64decode(data[:24].encode("ascii"), validate=True) if isinstance(data, str) else b""
            if start.startswith(BEGINNINGS.get(kind, ())) and len(data) <= MOST_BYTES:
                base64.b64decode(data.replace("\n", "").encode("ascii"), validate=True)
                return kind, data.replace("\n", "")
        except (UnicodeEncodeError, binascii.Error, ValueError):
            continue
    return None
