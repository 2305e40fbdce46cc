"""The outlines of the things in the five tabletop photographs, drawn by hand: `photographs.json` as label images.

The frames themselves are elsewhere (`../shared/real/tabletop`, 640x480); here are numbers alone. A thing is what stands
or lies on the table and rises over it: not table, floor or furniture, nor what stands on other furniture. An outline is
a polygon of pixels [u, v] that belong to the thing, drawn on the picture enlarged four to seven times, and looked at
again over it; holes are cut out. A thing's outline may run behind a nearer thing: things are listed from the farthest
to the nearest, and the nearer one has the pixel. Ignored is what has no height or what no one can tell: sheets of paper
that lie flat (frames 1 and 2), and the dark opening of the clamp (frame 5).

Lab 10's cut, free to move within four pixels of each outline, agrees with the hand at an IoU of 0.87 to 0.97. Looked at
over the pictures the hand is nearer, so the hand's outlines are kept.

The two overhead frames have a truth of their own; here stands the part of their board that no arm of the robot hides.
"""

import json
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from labkit.labels import IGNORE

_KEPT = json.loads(Path(__file__).with_name("photographs.json").read_text())
OUTLINES, BOARD = _KEPT["things"], _KEPT["board"]


def instances(frame: str, size: tuple[int, int] = (640, 480)) -> UInt8[np.ndarray, "H W"]:
    """Number a frame's things from 1 in the order of its list: 0 is none, 255 is ignored.

    frame: a key of OUTLINES, such as "tabletop/1". size: width and height of the picture.
    """
    numbers = np.zeros(size[::-1], np.uint8)
    for outline in OUTLINES[frame]["ignore"]:
        numbers[filled(outline, size)] = IGNORE
    for number, thing in enumerate(OUTLINES[frame]["things"], start=1):
        mask = filled(thing["outline"], size)
        for hole in thing["holes"]:
            mask &= ~filled(hole, size)
        numbers[mask] = number
    return numbers


def filled(outline, size: tuple[int, int]) -> Bool[np.ndarray, "H W"]:
    """The pixels inside a polygon or on its edge."""
    mask = np.zeros(size[::-1], np.uint8)
    cv2.fillPoly(mask, [np.array(outline, np.int32)], 1)
    return mask == 1
