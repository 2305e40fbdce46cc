"""Paper questions on label images (topic 01)."""

import cv2
import numpy as np

from labcourse.exam.paper import Paper, again, blank, names, question
from labcourse.questions.t01_labels.class_shares import class_shares
from labcourse.questions.t01_labels.labels_from_segmentation import labels_from_segmentation
from labcourse.questions.t01_labels.resize_labels import resize_labels
from labkit.labels import from_one_hot


@question(points=3, minutes=5)
def raw_mask(rng):
    """Decode a simulator's mask of bodies and links."""
    classes = rng.integers(0, 4, (3, 3), np.uint8)
    bodies, parts = rng.permutation(3), rng.permutation(3)
    again(len({int(c) for c in classes.ravel()}) < 4)
    again((np.diff(classes.astype(int)) == 0).any())
    raw = np.append(bodies + (parts << 24), -1)
    words = [
        f"{body}&nbsp;+&nbsp;{part}&nbsp;·&nbsp;2<sup>24</sup>" for body, part in zip(bodies, parts, strict=True)
    ] + ["−1"]
    labels = labels_from_segmentation(raw[None].astype(np.int32), classes)[0]
    shifted = [str(np.append(classes[body], -1)[part + 1]) for body, part in zip(bodies, parts, strict=True)] + ["0"]
    return Paper(
        {"classes": classes},
        "<p>In a simulator's mask, a pixel that sees nothing holds −1. Others hold body + (link + 1) · 2<sup>24</sup>; "
        "the base counts as link −1. The table gives the class of each part.</p>"
        + names(classes, top=["base", "link 0", "link 1"], left=[f"body {i}" for i in range(3)])
        + f"<p>Which labels do four pixels get whose raw values are <b>{'; '.join(words)}</b>? Nothing is class 0.</p>",
        {"labels": labels},
        "The lower 24 bits are the body; what stands above them is link + 1, so 0 is the base; −1 is 0.",
        {"took the upper bits for the link itself": f"({', '.join(shifted).replace('-1', 'no such link')})"},
    )


@question(points=3, minutes=4)
def resize_row(rng):
    """Resize a row of labels by nearest centres."""
    w, W = [(4, 6), (6, 4), (4, 10), (5, 8), (6, 9), (8, 5), (9, 6), (8, 12), (5, 7), (7, 10)][rng.integers(10)]
    y = rng.integers(0, 4, (1, w)).astype(np.uint8)
    again((np.diff(y[0].astype(int)) == 0).sum() > 1)
    corners = y[0, np.arange(W) * w // W]
    return Paper(
        {"y": y, "old width": w, "new width": W},
        f"<p>A row of {w} labels is resized to {W} pixels. Each new pixel copies the old pixel in which its centre "
        "falls."
        f"</p>{names(y)}<p>Write the new row.</p>{blank(1, W)}",
        {"new row": resize_labels(y, 1, W)[0]},
        f"New pixel i copies the old pixel number floor((i + 1/2) · {w}/{W}).",
        {"measured from the pixels' corners, i · w/W": corners},
    )


@question(points=3, minutes=4)
def ghosts(rng):
    """Find the classes that a bilinear resize invents."""
    a, b = (int(x) for x in rng.permutation(30)[:2])
    again((b - a) % 4 != 0 or abs(b - a) < 8)
    row = np.array([[a, a, b, b]], np.float32)
    wide = cv2.resize(row, (8, 1), interpolation=cv2.INTER_LINEAR)[0].astype(int)
    return Paper(
        {"a": a, "b": b},
        f"<p>A row of labels, {a} {a} {b} {b}, is resized to eight pixels with bilinear interpolation. "
        "Pixel centres lie at the middles of the pixels.</p>"
        "<p>Write the eight values. Which of them are labels that the row did not hold?</p>",
        {"row": wide, "invented": np.array(sorted({int(x) for x in wide} - {a, b}))},
        "New centre i lies at (i + 1/2)/2 − 1/2 of the old row: a quarter or three quarters of the way between two old "
        "ones. Only the pair in the middle differs. Outside of the first and last old centre, their labels go on.",
        {"sampled at i/2, half a pixel off": {"invented": np.array([(a + b) / 2])}},
    )


@question(points=3, minutes=5)
def shares(rng):
    """Count classes where some pixels are judged by nobody."""
    y = rng.integers(0, 3, (1, 3, 4)).astype(np.uint8)
    hidden = int(rng.choice([2, 4]))
    y.ravel()[rng.permutation(12)[:hidden]] = 255
    counts = np.array([(y == c).sum() for c in range(3)])
    again(counts.min() == 0)
    return Paper(
        {"y": y[0]},
        f"<p>In this label image, 255 means that nobody judged the pixel.</p>{names(y[0])}"
        "<p>Give the share of each of the classes 0, 1 and 2 among the judged pixels.</p>",
        {"shares": class_shares(y, 3)},
        f"{counts.tolist()} of {12 - hidden} judged pixels; the shares sum to 1.",
        {"divided by all pixels": counts / 12},
    )


@question(points=2, minutes=3)
def flat_index(rng):
    """Find a pixel's place in an image's memory."""
    H, W = int(rng.choice([100, 120, 200, 240, 300, 480])), int(rng.choice([150, 160, 320, 400, 600, 640]))
    u, v = int(rng.integers(11, 99)), int(rng.integers(11, 99))
    again(u == v or H == W)
    return Paper(
        {"H": H, "W": W, "u": u, "v": v},
        f"<p>A label image of height {H} and width {W} lies in memory row after row, one byte per pixel. "
        f"At which byte, counted from 0, is the pixel in column u = {u} of row v = {v}?</p>",
        {"byte": int(np.ravel_multi_index((v, u), (H, W)))},
        f"v whole rows come first: {v} · {W} + {u}.",
        {
            "counted columns of the image first": u * H + v,
            "took u for the row": u * W + v,
            "took H for the width": v * H + u,
        },
    )


@question(points=2, minutes=4)
def unanimous(rng):
    """Choose classes from votes, and say what a pixel without votes becomes."""
    votes = rng.integers(0, 6, (4, 4))
    empty = int(rng.integers(0, 4))
    votes[:, empty] = 0
    top = np.sort(votes, axis=0)
    again((np.delete(top[-1] - top[-2], empty) == 0).any() or (np.delete(votes.argmax(axis=0), empty) == 0).all())
    votes[:, empty] = [0, 0, 0, 0]
    one_hot = (votes == votes.max(axis=0)) & (votes.max(axis=0) > 0)
    return Paper(
        {"votes": votes.astype(np.uint8), "empty": np.uint8(empty)},
        "<p>Several people labelled four pixels. The table counts their votes; for one pixel nobody voted.</p>"
        + names(votes, top=[f"pixel {i}" for i in range(4)], left=[f"class {c}" for c in range(4)])
        + "<p>Which labels does <code>votes.argmax(axis=0)</code> give? Which pixel's label is wrong, and what "
        "should it be?"
        "</p>",
        {
            "argmax": np.array([0 if i == empty else from_one_hot(one_hot[:, i].astype(int)) for i in range(4)]),
            "wrong": f"pixel {empty}: 255, nobody judged it",
        },
        "argmax of equal numbers is the first, class 0: a pixel without votes becomes background in silence.",
    )
