"""Paper questions on messages, stamps and poses (topic 08)."""

import numpy as np

from labcourse.exam.paper import Paper, again, question
from labcourse.questions.t08_node.decode_depth import decode_depth
from labcourse.questions.t08_node.pair_stamps import pair_stamps
from labcourse.questions.t08_node.pose_at import pose_at
from labcourse.questions.t08_node.quaternion import quaternion
from labkit.node.convert import encode_cloud
from labkit.node.messages import Header


@question(points=4, minutes=6)
def pairs(rng):
    """Pair the stamps of two streams."""
    a, b = (np.cumsum(rng.integers(10, 60, 5)) for _ in "ab")
    slop = int(rng.integers(8, 20))
    partners = pair_stamps(a, b, slop)
    nearest = np.abs(a[:, None] - b).argmin(axis=1)
    again((partners == -1).sum() != 2 or (np.abs(a[:, None] - b).min(axis=1) > slop).sum() == 2)
    return Paper(
        {"a": a, "b": b, "slop": slop},
        f"<p>Colour images have the stamps {', '.join(map(str, a))} ms, depth images {', '.join(map(str, b))} ms. "
        "Two belong together "
        f"if each is the other's nearest and they are at most {slop} ms apart. Give for each colour image the number "
        "of its depth "
        "image, counted from 0, or −1.</p>",
        {"partners": partners},
        f"The nearest are {nearest.tolist()}; then those fall out that are too far, or nearer to another.",
        {
            "paired each with its nearest": nearest,
            "let two have one partner": np.where(np.abs(a[:, None] - b).min(axis=1) <= slop, nearest, -1),
        },
    )


@question(points=3, minutes=4)
def between_poses(rng):
    """Interpolate a camera's place, and say what the latest pose would cost."""
    start, gap, speed = (
        int(rng.integers(1, 60)) * 10,
        int(rng.choice([20, 40, 50, 80, 100])),
        int(rng.integers(2, 40)) * 10,
    )
    share = float(rng.choice([0.2, 0.25, 0.4, 0.5, 0.6, 0.75]))
    at, way = start + int(share * gap), gap * speed / 1000
    again(share * gap != int(share * gap) or way * share != int(way * share) or way != int(way))
    x = int(rng.integers(10, 60)) * 10
    places = np.array([[x, 0, 400], [x + way, 0, 400]]) / 1000
    still = np.tile([0.0, 0, 0, 1], (2, 1))
    place = 1000 * pose_at(np.array([start, start + gap]), places, still, at)[0][0]
    return Paper(
        {"start": start, "end": start + gap, "at": at, "x": x, "there": x + way, "speed": speed},
        f"<p>At {start} ms an arm's camera is at x = {x} mm, at {start + gap} ms at x = {x + way:g} mm; it does not "
        "turn. An image has "
        f"the stamp {at} ms. Where was the camera then? By how many millimetres are the points off if the latest "
        "pose is used "
        "instead? How fast does the arm move?</p>",
        {"x": round(place, 6), "off": round(x + way - place, 6), "speed in mm/s": speed},
        f"{at - start} of {gap} ms have passed: {x} + {share:g} · {way:g}.",
        {"took the latest pose": x + way, "took the pose before": x},
    )


@question(points=2, minutes=3)
def two_bytes(rng):
    """Read a depth from two bytes."""
    low, high = int(rng.integers(1, 256)), int(rng.integers(1, 8))
    d = float(decode_depth(np.array([low, high], np.uint8), 1, 1, 2, False)[0, 0])
    other = float(decode_depth(np.array([low, high], np.uint8), 1, 1, 2, True)[0, 0])
    return Paper(
        {"low": low, "high": high},
        f"<p>A pixel of a 16UC1 depth image arrives as the bytes {low}, {high}, little-endian, in millimetres. How "
        "many metres are "
        "they? And what do two zeros mean?</p>",
        {"m": d, "zeros": "no reading"},
        f"{low} + 256 · {high} millimetres.",
        {"exchanged the bytes": other, "took millimetres for metres": 1000 * d},
    )


@question(points=2, minutes=3)
def row_step(rng):
    """Find a byte in an image message."""
    width, channels = int(rng.integers(20, 80)) * 10 + int(rng.integers(1, 10)), int(rng.choice([2, 3, 4, 6]))
    step = -(-width * channels // 64) * 64
    v, u = int(rng.integers(2, 60)), int(rng.integers(2, 90))
    again(step == width * channels or u == v)
    place = np.arange(100 * step).reshape(100, step)[v, channels * u]
    return Paper(
        {"width": width, "channels": channels, "step": step, "v": v, "u": u},
        f"<p>An image message has width {width}, {channels} bytes per pixel and step {step}. At which byte of its "
        "data, counted from 0, "
        f"does the pixel in row v = {v}, column u = {u} begin? Why is step not {width * channels}?</p>",
        {"byte": int(place), "why": "rows are padded"},
        f"{v} · {step} + {u} · {channels}.",
        {"left the padding out": channels * (v * width + u), "counted a byte per pixel": v * step + u},
    )


@question(points=2, minutes=3)
def cloud_bytes(rng):
    """Find a field of a point in a cloud's bytes."""
    i, name = int(rng.integers(3, 400)), str(rng.choice(["y", "z"]))
    message = encode_cloud(np.zeros((i + 1, 3), np.float32), Header(0, "base"), rgb=np.zeros(i + 1, np.float32))
    field = next(f for f in message.fields if f.name == name)
    return Paper(
        {"i": i},
        "<p>A point cloud has the fields x, y, z and rgb, a float32 each without gaps. At which byte, counted from "
        f"0, does {name} of "
        f"point number {i} (the first is 0) begin? How many bytes does a cloud of {i + 1} points have?</p>",
        {"byte": i * message.point_step + field.offset, "all": len(message.data)},
        f"point_step is {message.point_step}, the offset of {name} is {field.offset}.",
        {
            "counted numbers, not bytes": (i * message.point_step + field.offset) // 4,
            "left rgb out": 12 * i + field.offset,
        },
    )


@question(points=3, minutes=4)
def half_angle(rng):
    """Write a turn as a quaternion."""
    s, c, r = [(3, 4, 5), (4, 3, 5), (5, 12, 13), (12, 5, 13), (8, 15, 17), (7, 24, 25), (15, 8, 17)][rng.integers(7)]
    axis, sign = int(rng.integers(3)), int(rng.choice([-1, 1]))
    cos, sin = (c * c - s * s) / r**2, sign * 2 * s * c / r**2
    R = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[i, i] = R[j, j] = cos
    R[i, j], R[j, i] = -sin, sin
    q = quaternion(R)
    q = q * np.sign(q[3])
    return Paper(
        {"tangent": sign * s / c, "parts": [s, c, r]},
        f"<p>An arm turns by an angle α about its {'xyz'[axis]} axis; sin(α/2) = {sign * s}/{r} and cos(α/2) = "
        f"{c}/{r}. Write the unit "
        "quaternion (x, y, z, w), and another one of the same turn. What is cos α?</p>".replace("-", "−"),
        {"q": q, "another": -q, "cos α": cos},
        "The axis times sin(α/2), and cos(α/2); −q turns the same way. cos α = cos²(α/2) − sin²(α/2).",
        {"wrote w first": np.roll(q, 1)},
    )
