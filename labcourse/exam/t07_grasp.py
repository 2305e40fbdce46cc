"""Paper questions on clouds, axes, grasps and counted lifts (topic 07)."""

from math import comb

import numpy as np

from labcourse.exam.paper import Paper, again, question, table
from labcourse.questions.t07_grasp.closing_yaw import closing_yaw
from labcourse.questions.t07_grasp.grasp_height import grasp_height
from labcourse.questions.t07_grasp.slip_across import slip_across
from labkit.geometry.clouds import centroid_and_covariance
from labkit.metrics import paired_difference

TRIPLES = ((3, 4, 5), (4, 3, 5), (5, 12, 13), (12, 5, 13), (8, 15, 17), (15, 8, 17), (7, 24, 25))


@question(points=4, minutes=6)
def covariance(rng):
    """Compute a centroid and a covariance."""
    xy = rng.integers(-6, 13, (4, 2))
    mu, Sigma = centroid_and_covariance(np.column_stack([xy, np.zeros(4)]).astype(float))
    again(not np.allclose(mu, mu.round()) or not np.allclose(2 * Sigma, (2 * Sigma).round()) or Sigma[0, 1] == 0)
    second = xy.T @ xy / 4
    return Paper(
        {"xy": xy},
        "<p>Seen from above, a cloud has four points, in centimetres: "
        f"{', '.join(f'({x}, {y})' for x, y in xy)}.</p><p>Compute its centroid and its covariance, with "
        "1/N.</p>".replace("-", "−"),
        {"covariance": Sigma[:2, :2], "centroid": mu[:2]},
        f"Less the centroid, the points are {', '.join(f'({x:g}, {y:g})' for x, y in xy - mu[:2])}.".replace("-", "−"),
        {"divided by N − 1": Sigma[:2, :2] * 4 / 3, "did not subtract the centroid": second},
    )


@question(points=4, minutes=6)
def axes(rng):
    """Find a covariance's axes, and the direction in which the jaws close."""
    (a, b), (low, high) = (
        rng.choice(np.arange(1, 5), 2, replace=False),
        np.sort(rng.choice(np.arange(1, 13), 2, replace=False)),
    )
    long_way = np.array([a, rng.choice([-1, 1]) * b])
    square = int(long_way @ long_way)
    again(a + b > 5 or a % 2 == b % 2 == 0)
    short_way = np.array([-long_way[1], long_way[0]])
    Sigma = (high * np.outer(long_way, long_way) + low * np.outer(short_way, short_way)).astype(float)
    yaw = closing_yaw(np.pad(Sigma, ((0, 1), (0, 1))), 0.0)
    jaws = np.sqrt(square) * np.array([np.cos(yaw), np.sin(yaw)])
    jaws *= np.sign(jaws[0])
    return Paper(
        {"Sigma": Sigma, "vector": long_way},
        "<p>Seen from above, an object's cloud has the covariance (in 10<sup>−6</sup> m²)</p>"
        f"{table(Sigma)}<p>Show that ({long_way[0]}, {long_way[1]}) is an eigenvector, and give both eigenvalues. "
        "Along which "
        "direction do the jaws close? (A vector of whole numbers.)</p>".replace("-", "−"),
        {
            "eigenvalues": np.array([high, low]) * float(square),
            "Σ v": Sigma @ long_way,
            "jaws": jaws.round().astype(int),
        },
        f"Σ v = {high * square} v. The trace is the sum of both, so the other is {low * square}. The jaws close "
        "across the long "
        "axis; the vector may be turned round.",
        {"closed along the long axis": {"jaws": long_way.astype(float) * np.sign(long_way[0])}},
    )


@question(points=2, minutes=3)
def nearest_yaw(rng):
    """Choose the yaw to which a hand turns."""
    axis, hand = int(rng.integers(-17, 18)) * 10, int(rng.integers(-35, 36)) * 10
    x, y = np.cos(np.radians(axis)), np.sin(np.radians(axis))
    Sigma = np.eye(3) - 0.9 * np.outer([x, y, 0], [x, y, 0])
    yaw = float(np.degrees(closing_yaw(Sigma, np.radians(hand))))
    again(abs(yaw - hand) > 80 or abs(yaw - axis) < 1 or abs(hand) > 180)
    whole = axis + 360 * round((hand - axis) / 360)
    return Paper(
        {"axis": axis, "hand": hand},
        f"<p>The jaws are to close along an axis at {axis}°; the hand's yaw is {hand}°. Which yaw does it turn to, "
        "if it turns as "
        "little as it can?</p>".replace("-", "−"),
        {"yaw": round(yaw, 6)},
        "Jaws that are exchanged hold the same way: the yaw counts modulo 180°.",
        {"turned to the axis as it is given": axis} | ({} if whole == axis else {"counted modulo 360°": whole}),
    )


@question(points=3, minutes=4)
def height(rng):
    """Choose the height of a grasp, and the bound that counts."""
    low, tall, palm, above = (int(x) for x in rng.integers((2, 20, 25, 3), (30, 120, 60, 9)))
    table_z, tips = int(rng.integers(0, 5)) * 10, int(rng.integers(5, 13))
    bottom, top = table_z + low, table_z + low + tall
    P = np.array([[0, 0, bottom], [0, 0, top]]) / 1000
    z = 1000 * grasp_height(P, table_z / 1000, palm / 1000, tips / 1000, above / 1000)
    bounds = top - palm, bottom, table_z + above
    names = "the palm", "what was seen", "the table"
    again(len(set(bounds)) < 3)
    return Paper(
        {"bottom": bottom, "top": top, "palm": palm, "above": above, "tips": tips, "table": table_z}
        | {"bound": np.uint8(np.argmax(bounds))},
        f"<p>The table's top is at z = {table_z} mm. Of an object, points from z = {bottom} mm to {top} mm were "
        "seen. The palm may come "
        f"down to the highest point, and the fingertips reach {palm} mm below the palm. They stay {above} mm above "
        "the table and no "
        f"lower than what was seen. The grasp's frame stands {tips} mm above the fingertips. At which z is it, if it "
        "goes as low as "
        "it may? Which bound counts?</p>",
        {"z": round(z, 6), "bound": names[int(np.argmax(bounds))]},
        f"The lowest fingertips: the largest of {bounds[0]}, {bounds[1]} and {bounds[2]} mm.",
        {
            "gave the fingertips' height": max(bounds),
            **({"forgot the palm": max(bounds[1:]) + tips} if z > max(bounds[1:]) + tips else {}),
        },
    )


@question(points=3, minutes=5)
def slip(rng):
    """Split an offset into what the jaws push and what they leave."""
    a, b, c = TRIPLES[rng.integers(len(TRIPLES))]
    along, across = (int(n) * c for n in rng.choice(np.arange(1, 7), 2, replace=False))
    x, y = np.array([a, b]) / c, np.array([-b, a]) / c
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2] = [*x, 0], [*-y, 0], [0, 0, -1]
    off = across * x + along * y
    pushed, left = slip_across(T, np.array([*off, 0]) / 1000)
    return Paper(
        {"off": off, "direction": [-b, a, c]},
        f"<p>Seen from above, a grasp closes along the direction ({-b}, {a})/{c}. The object's middle is off the "
        "grasp's by "
        f"({off[0]:g}, {off[1]:g}) mm. By how much do the jaws push the object, and how far off does it stay along "
        "the pads?</p>".replace("-", "−"),
        {"pushed": round(float(pushed), 6), "stays": round(float(left), 6)},
        "The part along the closing direction (a dot product) is undone; the part across it stays.",
        {"exchanged the two": round(float(left), 6)},
    )


@question(points=3, minutes=5)
def coin(rng):
    """Say whether a difference of lifts may be chance."""
    lost, gained = int(rng.integers(0, 3)), int(rng.integers(4, 10))
    again(gained + lost > 10)
    trials = int(rng.choice([20, 40, 50, 80, 100, 200]))
    p = paired_difference(gained, lost, trials)[2]
    ways = sum(comb(gained + lost, k) for k in range(lost + 1))
    return Paper(
        {"gained": gained, "lost": lost, "trials": trials},
        f"<p>Two masks were tried in the same {trials} scenes. In {gained} scenes only the first led to a lift, in "
        f"{lost} only the "
        "second. If a fair coin had decided these scenes, how probable is a split as uneven as this, or more, either "
        "way round? "
        "Is the first mask better, at the usual 5 %?</p>",
        {"p": p, "better?": "yes" if p < 0.05 else "the trials do not say"},
        f"2 · {ways} / 2<sup>{gained + lost}</sup>; the other {trials - gained - lost} scenes say nothing.",
        {"looked one way only": p / 2},
    )
