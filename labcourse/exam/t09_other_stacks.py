"""Paper questions on blobs, colours, pieces and engines (topic 09)."""

import numpy as np

from labcourse.exam.paper import Paper, again, names, question, table
from labcourse.questions.t09_other_stacks.choose_region import choose_region
from labcourse.questions.t09_other_stacks.hsv_mask import hsv_mask
from labcourse.questions.t09_other_stacks.make_blob import make_blob
from labcourse.questions.t09_other_stacks.measure_pieces import measure_pieces
from labcourse.stacks.regions import components


@question(points=3, minutes=4)
def nchw(rng):
    """Find a score in a network's output, in two layouts."""
    C, H, W = (
        int(rng.integers(3, 7)),
        int(rng.choice([20, 24, 30, 40, 48, 50, 60])),
        int(rng.choice([32, 64, 70, 80, 90, 100])),
    )
    c, v, u = int(rng.integers(1, C)), int(rng.integers(2, 20)), int(rng.integers(2, 30))
    place = int(np.arange(C * H * W).reshape(1, C, H, W)[0, c, v, u])
    other = int(np.arange(C * H * W).reshape(1, H, W, C)[0, v, u, c])
    return Paper(
        {"C": C, "H": H, "W": W, "c": c, "v": v, "u": u},
        f"<p>A network returns scores for C = {C} classes, H = {H}, W = {W}, as one array of numbers. At which "
        "place, counted from 0, "
        f"is the score of class {c} at row v = {v}, column u = {u} if the array is NCHW? And if it is NHWC?</p>",
        {"NCHW": place, "NHWC": other},
        f"({c} · {H} + {v}) · {W} + {u}; ({v} · {W} + {u}) · {C} + {c}.",
        {"exchanged the layouts": other, "took u for the row": (c * H + u) * W + v},
    )


@question(points=3, minutes=5)
def blob(rng):
    """Turn a picture into a network's input."""
    multiple = int(rng.choice([4, 8, 16, 32]))
    H, W = int(rng.integers(41, 100)), int(rng.integers(101, 200))
    parts = rng.choice([0.2, 0.4, 0.6, 0.8, 1.0], 3, replace=False)
    again(H % multiple == 0 or W % multiple == 0)
    b, g, r = (round(255 * part) for part in parts)
    made = make_blob(np.full((H, W, 3), (b, g, r), np.uint8), multiple)
    values = made[0, :, 0, 0].astype(float).round(6)
    return Paper(
        {"H": H, "W": W, "parts": parts, "multiple": multiple},
        f"<p>An image as OpenCV reads it, height {H} and width {W}, shows one colour: its pixels are ({b}, {g}, "
        f"{r}). A network wants "
        f"RGB in 0 to 1, NCHW, and sides that are multiples of {multiple}, padded below and at the right. Give the "
        "input's shape, and "
        "its numbers [0, :, 0, 0].</p>",
        {"numbers": values, "shape": np.array(made.shape)},
        "OpenCV's order is blue, green, red; 255 is 1. Sides are rounded up.",
        {
            "left blue first": values[::-1],
            "rounded the sides down": {"shape": np.array([1, 3, H // multiple * multiple, W // multiple * multiple])},
        },
    )


@question(points=3, minutes=5)
def red(rng):
    """Mark pixels in a range of hues that goes round through red."""
    lower, upper = int(rng.integers(160, 179)), int(rng.integers(4, 16))
    s, v = int(rng.integers(60, 130)), int(rng.integers(50, 120))
    hues = [
        lower - int(rng.integers(1, 9)),
        lower,
        int(rng.integers(0, upper)),
        upper + int(rng.integers(1, 9)),
        int(rng.integers(lower, 180)),
    ]
    pixels = np.array([[h, s + int(rng.integers(1, 90)), v + int(rng.integers(1, 90))] for h in hues])
    pixels[4, 1 + int(rng.integers(2))] = 40
    order = rng.permutation(5)
    pixels = pixels[order]
    low, high = np.array([lower, s, v], np.uint8), np.array([upper, 255, 255], np.uint8)
    marked = hsv_mask(pixels[None].astype(np.uint8), low, high)[0]
    return Paper(
        {"lower": lower, "upper": upper, "s": s, "v": v, "pixels": pixels},
        "<p>A detector takes for red what lies, in OpenCV's hues of 0 to 179, between the bounds "
        f"({lower}, {s}, {v}) and ({upper}, 255, 255), both included; the hue goes round through 0. "
        "Which of these pixels does it mark? (1 or 0 each.)</p>"
        + table(pixels.T, [f"pixel {i}" for i in range(5)], ["hue", "saturation", "value"]),
        {"marked": marked.astype(int)},
        "Above the lower hue or below the upper one, and both others at least their bounds.",
        {
            "asked for both bounds of the hue": np.zeros(5),
            "left the bound itself out": marked & (pixels[:, 0] != lower),
        },
    )


@question(points=3, minutes=5)
def pieces(rng):
    """Count connected pieces with 4 and with 8 neighbours, and measure the largest."""
    image = (rng.random((4, 6)) < 0.45).astype(np.uint8)
    four, eight = (components(image, n) * (image > 0) for n in (4, 8))
    numbers, sizes = np.unique(four[four > 0], return_counts=True)
    again(
        len(numbers) == len(np.unique(eight[eight > 0]))
        or len(numbers) > 6
        or (sizes == sizes.max()).sum() > 1
        or sizes.max() < 4
    )
    largest = (four == numbers[sizes.argmax()]).astype(int)
    area, centroid, box = measure_pieces(largest)
    again(not np.allclose(centroid * 4, np.round(centroid * 4)))
    many = len(np.unique(eight[eight > 0]))
    return Paper(
        {"image": image},
        f"<p>This mask is 1 where something was found.</p>{names(image)}"
        "<p>How many pieces does it have with 4 neighbours, and with 8? Of the largest piece with 4 neighbours give "
        "the area, the centroid (u, v) and the box "
        "(u<sub>0</sub>, v<sub>0</sub>, u<sub>1</sub>, v<sub>1</sub>), ends included.</p>",
        {"centroid": centroid[0], "pieces": np.array([len(numbers), many]), "area": int(area[0]), "box": box[0]},
        "Corners join pieces only with 8 neighbours. u counts columns, v rows, both from 0.",
        {"exchanged u and v": centroid[0][::-1], "exchanged 4 and 8": {"pieces": np.array([many, len(numbers)])}},
    )


@question(points=3, minutes=5)
def mahalanobis(rng):
    """Choose a piece by its distance in standard deviations."""
    mean = np.array([rng.integers(40, 90) * 10, rng.integers(30, 90)])
    spread = np.array([rng.integers(5, 20) * 10, rng.integers(2, 9)])
    steps = rng.integers(-3, 4, (3, 2))
    features = mean + steps * spread
    squared = (steps**2).sum(axis=1)
    plain = ((features - mean) ** 2).sum(axis=1)
    again(features.min() < 10)
    again(len(set(squared.tolist())) < 3 or squared.argmin() == plain.argmin())
    number = int(
        choose_region(features.astype(float), mean.astype(float), np.diag(spread**2).astype(float), np.ones(3, bool))
    )
    return Paper(
        {"mean": mean, "spread": spread, "features": features},
        f"<p>Mugs have an area of {mean[0]} pixels on average, with a standard deviation of {spread[0]}, and a "
        f"length of {mean[1]} pixels with one of {spread[1]}, independently. Three pieces were found:</p>"
        + table(features, ["area", "length"], ["piece 1", "piece 2", "piece 3"])
        + "<p>Compute the squared Mahalanobis distance of each. Which piece is chosen?</p>",
        {"squared": squared.astype(float), "piece": number},
        "Each difference over its own standard deviation, squared, and added.",
        {
            "did not divide by the spread": {"piece": int(plain.argmin()) + 1},
            "added without squares": np.abs(steps).sum(axis=1),
        },
    )


@question(points=2, minutes=4)
def enough_digits(rng):
    """Say when two engines may disagree on a label."""
    best, gap, off = int(rng.integers(20, 90)), int(rng.integers(2, 9)), int(rng.integers(1, 8))
    scores = np.array([best, best - gap, best - gap - int(rng.integers(5, 19))])
    again(off * 2 == gap)
    moved = (scores + off * np.array([-1, 1, 1])).argmax()
    return Paper(
        {"scores": scores, "off": off},
        f"<p>One engine gives a pixel the scores {', '.join(map(str, scores))} (in thousandths). Another one "
        "computes the same network, and "
        f"each of its scores is off by at most {off} thousandths. Can it choose another class? From which deviation "
        "on can it?</p>",
        {"another?": "yes" if moved else "no", "from": gap / 2},
        f"The best may fall while the second rises: by half of the gap of {gap} each.",
        {"compared the whole gap": {"from": gap}},
    )
