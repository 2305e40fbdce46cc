"""Questions for paper: their keys against formulas written out here, their numbers, and what is printed."""

import itertools
import math
import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from at_night import others_at_night

from labcourse.exam.draw import bank, choose, draw, topics, topics_of
from labcourse.exam.page import exam, write
from labcourse.exam.paper import LARGEST_DENOMINATOR, Paper

SAMPLES = Path(__file__).parents[2] / "docs" / "exams"
BANK = [question for topic in topics() for question in bank(topic)]


def plain(html: str) -> str:
    """A text without tags, with ordinary minus signs."""
    return re.sub(r"<[^>]*>", " ", re.sub(r"<su[bp]>.*?</su[bp]>", "", html)).replace("−", "-").replace("&nbsp;", " ")


def numbers(html: str) -> list[float]:
    """All numbers of a text, in order."""
    return [float(word) for word in re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?", plain(html))]


def labels_in(html: str) -> list[int]:
    """The labels that a text names outside of tables."""
    return [int(word) for words in re.findall(r"<b>(.*?)</b>", html) for word in words.split(", ")]


# --------------------------------------------------------------------------------- the same answers, by other ways


def raw_mask(g, text):
    seen = re.findall(r"(\d) \+ (\d) ·", plain(text).split("raw values")[1])
    return {"labels": [g["classes"][int(body)][int(part)] for body, part in seen] + [0]}


def resize_row(g, text):
    w, W = g["old width"], g["new width"]
    return {"new row": [g["y"][0][math.floor((Fraction(i) + Fraction(1, 2)) * w / W)] for i in range(W)]}


def ghosts(g, text):
    a, b = g["a"], g["b"]
    mixed = [(3 * a + b) / 4, (a + 3 * b) / 4]
    return {"row": [a, a, a, *mixed, b, b, b], "invented": sorted(mixed)}


def shares(g, text):
    judged = [label for row in g["y"].tolist() for label in row if label != 255]
    return {"shares": [judged.count(c) / len(judged) for c in range(3)]}


def unanimous(g, text):
    return {"argmax": [column.index(max(column)) for column in g["votes"].T.tolist()]}


def energy_2x3(g, text):
    y, psi, cost = g["y"].astype(int), g["psi"], 0
    for v, u in itertools.product(range(2), range(3)):
        cost += psi[v, u, y[v, u]]
        cost += g["lam"] * sum(y[v, u] != y[b, a] for b, a in ((v + 1, u), (v, u + 1)) if b < 2 and a < 3)
    return {"E(y)": cost}


def one_pixel(g, text):
    costs = [g["psi"][c] + sum(g["lam"] for label in labels_in(text) if label != c) for c in range(3)]
    return {"costs": costs, "class": costs.index(min(costs))}


def two_pixels(g, text):
    of = {(a, b): g["psi"][0, 0, a] + g["psi"][0, 1, b] for a in (0, 1) for b in (0, 1)}
    energies = {(a, b): cost + g["w"] * (a != b) for (a, b), cost in of.items()}
    best = min(energies, key=energies.get)
    tie = min(of[0, 0], of[1, 1]) - min(of[0, 1], of[1, 0])
    return {"least energy": energies[best], "labels": best, "w of a tie": tie}


def augment(g, text):
    flow = min(g["source"], g["pair"], g["sink"])
    return {"flow": flow, "left": [g["source"] - flow, g["pair"] - flow, g["pair"] + flow, g["sink"] - flow]}


def terminals(g, text):
    source, sink, constant = [], [], 0
    for of_0, of_1 in g["psi"][0].tolist():
        low = min(of_0, of_1)
        source, sink, constant = [*source, of_1 - low], [*sink, of_0 - low], constant + low
    for y in itertools.product((0, 1), repeat=3):  # a cut pays for what it separates
        cut = constant + sum(source[i] if label else sink[i] for i, label in enumerate(y))
        assert cut == sum(g["psi"][0, i, label] for i, label in enumerate(y))
    return {"source →": source, "→ sink": sink, "constant": constant}


def gibbs(g, text):
    k, m = [int(n) for n in g["k"]], g["m"]
    worth = [Fraction(1, k[0] ** a * k[1] ** (1 - b) * m ** (a != b)) for a in (0, 1) for b in (0, 1)]
    return {"exp(−E)": worth, "p(01)": worth[1] / sum(worth)}


def softmax_of_logs(g, text):
    return {"softmax": g["k"] / sum(g["k"]), "shifted": g["k"] / sum(g["k"])}


def slope(loss, z, h=1e-6):
    """Central differences."""
    steps = h * np.eye(len(z))
    return [(loss(z + step) - loss(z - step)) / (2 * h) for step in steps]


def one_gradient(g, text):
    (y,) = labels_in(text)
    return {"dL/dz": slope(lambda z: math.log(np.exp(z).sum()) - z[y], np.log(g["k"])), "sum": 0}


def summed_loss(g, text):
    (hidden,) = labels_in(text)
    counted = [n for i, n in enumerate(g["powers"]) if i != hidden]
    return {"sum": sum(counted), "mean": sum(counted) / 3}


def through_softmax(g, text):
    return {"dL/dz": slope(lambda z: g["g"] @ (np.exp(z) / np.exp(z).sum()), np.log(g["p"]))}


def pooled(g, text):
    def loss(x):
        x = x.reshape(2, 4)
        return g["g"][0, 0] * x[:, :2].max() + g["g"][0, 1] * x[:, 2:].max()

    return {"dL/dx": np.reshape(slope(loss, g["x"].astype(float).ravel()), (2, 4))}


def window(g, text):
    places = {g["u"]}
    for kernel, stride in reversed(list(zip(g["kernels"], g["strides"], strict=True))):
        places = {p * stride - kernel // 2 + i for p in places for i in range(kernel)}
    return {"first": min(places), "last": max(places)}


def fill_matrix(g, text):
    pairs = list(zip(g["truth"].ravel().tolist(), g["prediction"].ravel().tolist(), strict=True))
    return {"n": [[pairs.count((i, j)) for j in range(3)] for i in range(3)]}


def ious(n):
    n = np.asarray(n)
    return [Fraction(int(n[c, c]), int(n[c].sum() + n[:, c].sum() - n[c, c])) for c in range(len(n))]


def scores(g, text):
    return {"IoU": ious(g["n"]), "pixel accuracy": Fraction(int(np.trace(g["n"])), int(g["n"].sum()))}


def absent(g, text):
    n = np.reshape(numbers(text.split("<table")[1].split("</table")[0])[4:], (4, 5))[:, 1:]
    here = [c for c in range(4) if n[c].sum() + n[:, c].sum() > 0]
    return {"mean IoU": sum(ious(n[np.ix_(here, here)])) / len(here)}


def useless_mask(g, text):
    share = 1 - g["percent"] / 100
    return {"accuracy": share, "IoU": [share, 0], "mean": share / 2, "recall": 0}


def which_mistake(g, text):
    tp, fp, fn = g["TP"], g["FP"], g["FN"]
    return {"precision": tp / (tp + fp), "recall": tp / (tp + fn), "IoU": tp / (tp + fp + fn)}


def two_images(g, text):
    (i, j), (m, n) = g["inside"], g["union"]
    return {"counts added": Fraction(i + j, m + n), "mean of frames": (Fraction(i, m) + Fraction(j, n)) / 2}


def merged(g, text):
    new, n = set(labels_in(text)), np.zeros((2, 2), int)
    for i, j in itertools.product(range(3), range(3)):
        n[int(i in new), int(j in new)] += g["n"][i, j]
    return {"matrix": n, "IoU": ious(n)[1]}


def inverse_weights(g, text):
    w = sum(g["counts"]) / 3 / g["counts"]
    assert math.isclose(w @ g["counts"], g["counts"].sum())
    return {"weights": w}


def optimum(g, text):
    q = np.arange(1, 1000) / 1000
    loss = -g["w"] * g["p"] * np.log(q) - (1 - g["p"]) * np.log(1 - q)
    return {"q": q[loss.argmin()]}


def weighted_mean(g, text):
    total = sum(g["powers"][:3]) + g["w"] * g["powers"][3]
    return {"sum": total, "PyTorch": total / (3 + g["w"])}


def decide(g, text):
    cost = np.reshape(numbers(text.split("<table")[1].split("</table")[0])[3:], (3, 4))[:, 1:]
    expected = [sum(g["q"][i] * cost[i][j] for i in range(3)) for j in range(3)]
    return {"costs": expected, "say": expected.index(min(expected))}


def weight_of_recall(g, text):
    tries = sorted((1 - q) / q for q in g["q"])
    return {"w": min(w for w in tries if sum(w * q >= 1 - q - 1e-9 for q in g["q"]) >= g["need"])}


def other_scenes(g, text):
    # Of the pixels that look so, as many mugs and as much background as Bayes says; each kind grows with its share.
    mugs, rest = g["q"] * g["new"] / g["old"], (1 - g["q"]) * (1 - g["new"]) / (1 - g["old"])
    return {"odds": mugs / rest, "probability": mugs / (mugs + rest)}


def weighted_gradient(g, text):
    (y,) = labels_in(text)
    return {"dL/dz": slope(lambda z: g["w"][y] * (math.log(np.exp(z).sum()) - z[y]), np.log(g["k"]))}


def one_point(g, text):
    return {"P_cam": [(g["u"] - g["cx"]) * g["d"] / g["fx"], (g["v"] - g["cy"]) * g["d"] / g["fy"], g["d"]]}


def to_pixel(g, text):
    x, y, z = g["P"]
    return {"u": g["fx"] * x / z + g["cx"], "v": g["fy"] * y / z + g["cy"]}


def matrix_in(text):
    return np.reshape(numbers(text.split("<table")[1].split("</table")[0])[-16:], (4, 4))


def to_base(g, text):
    T = matrix_in(text)
    return {"P_base": [sum(T[i, j] * g["P"][j] for j in range(3)) + T[i, 3] for i in range(3)], "camera": T[:3, 3]}


def inverse(g, text):
    T = np.linalg.inv(matrix_in(text))
    return {"R": T[:3, :3], "origin": T[:3, 3]}


def cropped(g, text):
    # The image's left edge is half a pixel left of the first centre, before and after.
    from_edge = (g["cx"] + 0.5 - g["left"]) * g["scale"]
    return {"cx": from_edge - 0.5, "fx": g["fx"] * g["scale"]}


def height_error(g, text):
    rows = (np.array([-1, 1]) * g["pixel"] + g["dv"]) * g["d"] / g["fy"]
    depths = g["dv"] * (g["d"] + np.array([-1, 1]) * g["depth"] / 1000) / g["fy"]
    return {"mm": 500 * math.hypot(np.diff(rows)[0], np.diff(depths)[0])}


def ray_length(g, text):
    z = g["length"] * g["f"] / math.hypot(g["f"], g["du"])
    return {"z": z, "x": math.sqrt(g["length"] ** 2 - z * z)}


def over_the_sheet(g, text):
    # Where no point of the sheet and no point above it has a pixel: the camera itself, at [r1 r2 r3 t] (X, 1) = 0.
    H = np.reshape(numbers(text.split("<table")[1].split("</table")[0])[-9:], (3, 3))
    A = np.linalg.solve([[g["fx"], 0, g["cx"]], [0, g["fy"], g["cy"]], [0, 0, 1]], H)
    A /= math.copysign(math.hypot(*A[:, 0]), A[2, 2])
    return {"camera": np.linalg.solve(np.column_stack([A[:, 0], A[:, 1], np.cross(A[:, 0], A[:, 1])]), -A[:, 2])}


def disparity(g, text):
    first, second = (int(n) for n in re.findall(r"column (\d+)", text))
    depth = [g["f"] * g["b"] / (first - second + off) for off in (-1e-4, 0.0, 1e-4)]
    return {"z": depth[1], "mm": 1000 * (depth[0] - depth[2]) / 2e-4}


def covariance(g, text):
    x, y = (list(map(int, column)) for column in g["xy"].T)
    mean = [Fraction(sum(x), 4), Fraction(sum(y), 4)]

    def second(a, b):
        return Fraction(sum(p * q for p, q in zip(a, b, strict=True)), 4)

    xx, xy, yy = second(x, x) - mean[0] ** 2, second(x, y) - mean[0] * mean[1], second(y, y) - mean[1] ** 2
    return {"centroid": mean, "covariance": [[xx, xy], [xy, yy]]}


def axes(g, text):
    (a, b), (_, d) = g["Sigma"]
    root = math.sqrt((a - d) ** 2 / 4 + b * b)
    x, y = (int(n) for n in re.search(r"\((-?\d+), (-?\d+)\)", plain(text)).groups())
    long = (a + d) / 2 + root
    return {"eigenvalues": [long, a + d - long], "Σ v": [long * x, long * y], "jaws": np.array([-y, x]) * np.sign(-y)}


def nearest_yaw(g, text):
    return {"yaw": min((g["axis"] + 180 * k for k in range(-6, 7)), key=lambda yaw: abs(yaw - g["hand"]))}


def height(g, text):
    z = max(g["top"] - g["palm"], g["bottom"], g["table"] + g["above"])
    return {"z": z + g["tips"]}


def slip(g, text):
    a, b, c = (int(n) for n in re.search(r"\((-?\d+), (-?\d+)\)/(\d+)", plain(text)).groups())
    x, y = g["off"]
    return {"pushed": abs(x * a + y * b) / c, "stays": abs(x * b - y * a) / c}


def coin(g, text):
    both = g["gained"] + g["lost"]
    heads = [sum(flips) for flips in itertools.product((0, 1), repeat=both)]
    far = sum(abs(2 * n - both) >= g["gained"] - g["lost"] for n in heads)
    return {"p": far / len(heads)}


def pairs(g, text):
    a, b, found = g["a"].tolist(), g["b"].tolist(), []
    for stamp in a:
        j = min(range(len(b)), key=lambda j: abs(b[j] - stamp))
        mutual = min(a, key=lambda other: abs(other - b[j])) == stamp
        found.append(j if mutual and abs(b[j] - stamp) <= g["slop"] else -1)
    return {"partners": found}


def between_poses(g, text):
    speed = (g["there"] - g["x"]) / (g["end"] - g["start"])
    return {
        "x": g["x"] + speed * (g["at"] - g["start"]),
        "off": speed * (g["end"] - g["at"]),
        "speed in mm/s": 1000 * speed,
    }


def half_angle(g, text):
    half = math.atan(g["tangent"])
    q = [math.sin(half) * (axis in plain(text).split(" axis")[0][-2:]) for axis in "xyz"] + [math.cos(half)]
    return {"q": q, "another": [-x for x in q], "cos α": math.cos(2 * half)}


def nchw(g, text):
    c, v, u, C, H, W = (g[name] for name in ("c", "v", "u", "C", "H", "W"))
    return {"NCHW": u + W * (v + H * c), "NHWC": c + C * (u + W * v)}


def blob(g, text):
    n = g["multiple"]
    return {"numbers": g["parts"][::-1], "shape": [1, 3, *(math.ceil(side / n) * n for side in (g["H"], g["W"]))]}


def red(g, text):
    bright = [s >= g["s"] and v >= g["v"] for _, s, v in g["pixels"]]
    hues = {*range(g["lower"], 180), *range(g["upper"] + 1)}
    return {"marked": [int(int(h) in hues and ok) for (h, _, _), ok in zip(g["pixels"], bright, strict=True)]}


def pieces(g, text):
    def fill(diagonal):
        waiting = {(int(v), int(u)) for v, u in np.argwhere(g["image"])}
        found = []
        while waiting:
            piece, border = set(), {min(waiting)}
            while border:
                v, u = border.pop()
                piece.add((v, u))
                near = {(v + i, u + j) for i in (-1, 0, 1) for j in (-1, 0, 1) if diagonal or i == 0 or j == 0}
                border |= near & waiting - piece
            waiting -= piece
            found.append(piece)
        return found

    four = fill(diagonal=False)
    v, u = zip(*max(four, key=len), strict=True)
    box = [min(u), min(v), max(u), max(v)]
    return {
        "pieces": [len(four), len(fill(diagonal=True))],
        "area": len(u),
        "centroid": [np.mean(u), np.mean(v)],
        "box": box,
    }


def mahalanobis(g, text):
    squared = [
        sum(((x - m) / s) ** 2 for x, m, s in zip(f, g["mean"], g["spread"], strict=True)) for f in g["features"]
    ]
    return {"squared": squared, "piece": 1 + squared.index(min(squared))}


ONE_LINE = {
    "flat_index": lambda g: {"byte": g["v"] * g["W"] + g["u"]},
    "two_bytes": lambda g: {"m": int.from_bytes(bytes([g["low"], g["high"]]), "little") / 1000},
    "row_step": lambda g: {"byte": g["v"] * g["step"] + g["u"] * g["channels"]},
    "enough_digits": lambda g: {"from": (g["scores"][0] - g["scores"][1]) / 2},
}


@pytest.mark.parametrize("question", BANK, ids=lambda question: f"{question.topic}.{question.name}")
def test_the_key_is_what_another_way_gives_and_round(question):
    """In each of three versions, of which no two have a number in the same place."""
    papers = draw(question, 1, 3)
    for paper in papers:
        if question.name == "cloud_bytes":
            offset = 4 * "xyz".index(re.search("does ([yz])", paper.text)[1])
            other = {"byte": 16 * paper.given["i"] + offset, "all": 16 * (paper.given["i"] + 1)}
        elif question.name in ONE_LINE:
            other = ONE_LINE[question.name](paper.given)
        else:
            other = globals()[question.name](paper.given, paper.text)
        for name, value in other.items():
            expected = np.asarray(value, dtype=float)
            np.testing.assert_allclose(np.asarray(paper.answer[name], float), expected, atol=2e-6, err_msg=name)
        for value in paper.answer.values():
            for number in np.ravel(value) if not isinstance(value, str) else ():
                nearest = Fraction(float(number)).limit_denominator(LARGEST_DENOMINATOR)
                assert abs(float(number) - nearest) < 1e-9, f"{number} is not round"
    written = [numbers(re.sub(r'<table class="names".*?</table>|<b>.*?</b>', "", paper.text)) for paper in papers]
    for place in zip(*written, strict=True):
        drawn = [number for number in place if number != 0]
        assert len(set(drawn)) in (len(drawn), min(len(drawn), 1)), f"two versions share {place}"


def test_there_are_enough_questions_and_each_tells_a_mistake():
    assert len(BANK) >= 40 and len(topics()) == 9
    assert min(len(bank(topic)) for topic in topics()) >= 4
    told = [question.name for question in BANK if draw(question, 1, 1)[0].mistakes]
    assert {question.name for question in BANK} - set(told) <= {"unanimous"}  # whose answer names the mistake itself


def test_an_exam_fills_its_minutes_with_every_topic():
    for wanted, minutes in (("01-05", 60), ("06-09", 60), ("01-09", 60), ("03", 10)):
        for seed in range(20):
            taken = choose(topics_of(wanted), minutes, seed)
            assert {question.topic for question in taken} == set(topics_of(wanted))
            assert minutes - 3 <= sum(question.minutes for question in taken) * 6 / 5 <= minutes or wanted == "03"
            assert len(set(taken)) == len(taken)
    assert choose(topics_of("01-05"), 60, 1) != choose(topics_of("01-05"), 60, 2)
    names = {question.name for question in choose(topics_of("01-05"), 60, 1)}
    assert not names & {question.name for question in choose(topics_of("01-05"), 60, 1, names)}


def test_a_wrong_value_that_is_right_asks_for_other_numbers():
    from labcourse.exam.paper import Again

    for mistakes in ({"added": 0.1 + 0.2}, {"added": 4, "multiplied": 4.0}, {"added": 4, "multiplied": {"n": 4}}):
        with pytest.raises(Again):
            Paper({}, "", {"n": 0.3}, "", mistakes)


SHARES = ("q", "p", "p(01)", "probability", "shares", "softmax", "IoU", "mean IoU", "counts added", "precision", "mean")


def numerical(value) -> bool:
    return np.asarray(value).dtype.kind in "iuf"


@pytest.mark.parametrize("seeds", others_at_night([range(4), range(4, 30)]), ids=len)
@pytest.mark.parametrize("question", BANK, ids=lambda question: f"{question.topic}.{question.name}")
def test_a_wrong_value_tells_one_mistake_and_versions_share_no_answer(question, seeds):
    """In three versions of each seed; titles ask for nothing that the text does not."""
    for seed in seeds:
        papers = draw(question, seed, 3)
        for paper in papers:
            asked = plain(paper.text + " ".join(paper.answer))
            for word in ("mean", "IoU", "accuracy", "precision", "recall", "undo"):
                assert word in asked or not re.search(rf"\b{word}\b", question.about)
            worth = paper.worth(question.points).values()
            assert sum(worth) == question.points and min(worth) >= Fraction(1, 2)
            told = [pair for pair in (*paper.answer.items(), *paper.wrong().values()) if numerical(pair[1])]
            for (name, one), (other, two) in itertools.combinations(told, 2):
                assert name != other or not np.allclose(one, two), f"two ways to {name} {one}"
            for name, wrong in paper.wrong().values():
                assert np.shape(wrong) == np.shape(paper.answer[name]) or question.name in ("raw_mask", "ghosts")
                if name in SHARES and question.topic < "08" and question.name != "summed_loss":
                    assert np.min(wrong) >= 0 and np.max(wrong) <= 1, f"{wrong} is no share"
        for one, other in itertools.combinations(papers, 2):
            for name in filter(lambda name: numerical(one.answer[name]) and np.any(one.answer[name]), one.answer):
                a, b = np.asarray(one.answer[name]), np.asarray(other.answer[name])
                same = (np.isclose(a, b) & (a != 0)).any() if a.dtype.kind == "f" else np.array_equal(a, b)
                assert not same, f"two versions share {name}, {a}, {b}"


@pytest.mark.parametrize(("folder", "wanted", "seed"), [("weeks_1_to_5", "01-05", 1), ("weeks_6_to_9", "06-09", 2)])
def test_the_samples_are_what_the_bank_writes(tmp_path, folder, wanted, seed):
    write(tmp_path, exam(topics_of(wanted), 60, seed, 2))
    written = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert written.keys() == {"exam_A.html", "exam_B.html", "key.html"}
    assert written == {path.name: path.read_bytes() for path in (SAMPLES / folder).iterdir()}
    assert not re.search(rb"seed|http", written["exam_A.html"])
    assert written["exam_A.html"] != written["exam_B.html"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--topics", "11"), "topics: expected numbers such as 01-05"),
        (("--minutes", "9"), "minutes: expected at least"),
        (("--versions", "9"), "versions: expected 1 to 3, got 9"),
        (("--without", "windows"), "without: expected names of questions, as a key prints them, got windows"),
        (
            ("--topics", "03", *(w for q in bank("03_gradient") for w in ("--without", q.name))),
            "without: expected to leave",
        ),
    ],
)
def test_what_cannot_be_drawn_is_said(labkit, tmp_path, capsys, words, said):
    assert labkit("exam", "--seed", 1, "--out", tmp_path, *words) == 2
    assert said in capsys.readouterr().err


def test_the_command_says_what_it_wrote(labkit, tmp_path, capsys):
    words = ("--without", "scores", "--without", "merged", "--course", "Sight & grasp", "--aids", "a ruler")
    assert labkit("exam", "--topics", "04", "--minutes", 48, "--seed", 3, "--out", tmp_path, *words) == 0
    said = capsys.readouterr().out.splitlines()
    sheet, key = ((tmp_path / name).read_text() for name in ("exam_A.html", "key.html"))
    for printed in ("Course: Sight &amp; grasp", "Date", "Name", "number", "a ruler", "48 minutes", "of 15</div>"):
        assert printed in sheet
    asked = {question.name for question in bank("04_iou") if f"04_iou, {question.name}" in key}
    assert asked == {question.name for question in bank("04_iou")} - {"scores", "merged"}
    assert "½ point</span>" in key
    assert said == [f"wrote {tmp_path / name}" for name in ("exam_A.html", "key.html")]
    assert topics_of("01-09", ["04_iou", "10_capstone"]) == ("04_iou",)


def test_no_other_exam_lies_beside_a_key(labkit, tmp_path, capsys):
    """Of three versions one is left, and the key is of the second exam; the same exam may be written again."""
    words = ("exam", "--topics", "04", "--minutes", 30, "--out", tmp_path)
    assert labkit(*words, "--seed", 1, "--versions", 3) == 0 and labkit(*words, "--seed", 1, "--versions", 3) == 0
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    capsys.readouterr()
    assert labkit(*words, "--seed", 2) == 2
    assert "has exam_A.html, exam_B.html, exam_C.html, key.html; --overwrite removes it" in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    assert labkit(*words, "--seed", 2, "--overwrite") == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["exam_A.html", "key.html"]


def test_the_system_draws_a_seed_that_nobody_tries_and_the_key_alone_says_it(labkit, tmp_path, capsys):
    seeds = []
    for name in ("one", "two"):
        assert labkit("exam", "--topics", "04", "--minutes", 30, "--out", tmp_path / name) == 0
        key, sheet = ((tmp_path / name / page).read_text() for page in ("key.html", "exam_A.html"))
        seeds.append(re.search(r"seed (\d+)", key)[1])
        assert seeds[-1] not in sheet + capsys.readouterr().out
    assert seeds[0] != seeds[1] and min(map(int, seeds)) > 2**40
    assert labkit("exam", "--topics", "04", "--minutes", 30, "--seed", seeds[0], "--out", tmp_path / "one") == 0
