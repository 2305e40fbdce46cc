"""Paper questions on class weights and decisions (topic 05)."""

import numpy as np

from labcourse.exam.paper import Paper, again, named, question, table
from labcourse.questions.t05_class_weights.change_prior import change_prior
from labcourse.questions.t05_class_weights.least_cost import least_cost
from labcourse.questions.t05_class_weights.weight_for_recall import weight_for_recall
from labkit.losses import class_weights, cross_entropy, cross_entropy_grad, softmax, weighted_optimum


@question(points=3, minutes=4)
def inverse_weights(rng):
    """Compute inverse-frequency weights with mean 1."""
    counts = rng.choice([10, 20, 25, 40, 50, 100, 125, 200, 250, 400, 500, 800, 1000], 3, replace=False)
    w = class_weights(counts, "inverse")
    again(not np.isclose(w * 100, np.round(w * 100)).all())
    return Paper(
        {"counts": counts},
        f"<p>In a training set the classes have {counts[0]}, {counts[1]} and {counts[2]} pixels. Choose weights "
        "proportional "
        "to 1/count, scaled so that the mean weight of all these pixels is 1.</p>",
        {"weights": w},
        f"Each class then has the same sum of weights, a third of {counts.sum()} pixels: {counts.sum()}/3 over its "
        "count.",
        {"scaled to mean 1 over the classes": 3 / counts / (1 / counts).sum()},
    )


@question(points=3, minutes=4)
def optimum(rng):
    """Predict where weighted training ends."""
    p = int(rng.choice([1, 2, 4, 5, 10, 20])) / 100
    w = int(rng.integers(2, 50))
    q = weighted_optimum(np.array([1 - p, p]), np.array([1.0, w]))[1]
    again(not np.isclose(q * 40, round(q * 40)))
    return Paper(
        {"p": p, "w": w},
        f"<p>Among pixels that look alike, {100 * p:g} % are mug. A network is trained with weight {w} for mug and 1 "
        "for "
        "background. Which probability of mug does it learn to give these pixels? Does it call them mug?</p>",
        {"q": q, "mug?": "yes" if q > 0.5 else "a tie" if np.isclose(q, 0.5) else "no"},
        f"q = {w} · {p:g} / ({w} · {p:g} + {1 - p:g}).",
        {"left the probability as it is": p}
        | ({"multiplied, and did not divide by the sum": w * p} if w * p < 1 else {}),
    )


@question(points=3, minutes=5)
def weighted_mean(rng):
    """Tell a weighted sum of losses from PyTorch's mean."""
    powers, w = rng.integers(1, 7, 4), int(rng.integers(2, 12))
    y = np.array([0, 0, 0, 1])
    p = 0.5**powers
    z = np.log(np.where(y[:, None] == [0, 1], p[:, None], 1 - p[:, None]))
    total = cross_entropy(z, y, np.array([1.0, w])) / np.log(2)
    again(not np.isclose(total / (3 + w) * 20, round(total / (3 + w) * 20)))
    return Paper(
        {"powers": powers, "w": w},
        "<p>A network gives the true class of four pixels the probabilities "
        f"{', '.join(f'1/{2**n}' for n in powers)}. The first three pixels are background, of weight 1; the last is "
        "mug, of "
        f"weight {w}. As multiples of ln 2: what is the weighted sum of the losses? What does PyTorch's "
        "<code>CrossEntropyLoss(weight=...)</code> with its usual mean return?</p>",
        {"sum": total, "PyTorch": total / (3 + w)},
        f"Losses {', '.join(map(str, powers))} times ln 2. PyTorch divides by the sum of the weights, {3 + w}, not "
        "by 4.",
        {"divided by the pixels": {"PyTorch": total / 4}},
    )


@question(points=4, minutes=5)
def decide(rng):
    """Decide for the least expected cost."""
    q = rng.integers(1, 8, 3)
    cost = rng.integers(1, 21, (3, 3)) * (1 - np.eye(3, dtype=int))
    again(q.sum() != 10)
    q = q / 10
    expected, said = q @ cost, int(least_cost(q[None], cost.astype(float))[0])
    again(said == q.argmax() or len(set(np.round(expected, 6))) < 3)
    off = ~np.eye(3, dtype=bool)
    return Paper(
        {"q": q, "cost": cost[off]},
        f"<p>A pixel has the probabilities q = ({', '.join(f'{x:g}' for x in q)}). Saying class j where class i is "
        "true costs:"
        f"</p>{table(cost, [f'say {j}' for j in range(3)], [f'true {i}' for i in range(3)])}"
        "<p>Compute the expected cost of each answer. Which class do you say?</p>",
        {"costs": expected, "say": said},
        "Multiply each column by q and add.",
        {"read the table by rows": cost @ q, "took the most probable class": {"say": int(q.argmax())}},
    )


@question(points=3, minutes=4)
def weight_of_recall(rng):
    """Find the smallest weight with which enough pixels are found."""
    many = [0.01, 0.02, 0.04, 0.05, 0.08, 0.1, 0.125, 0.15, 0.16, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.625, 0.75, 0.8]
    q = np.sort(rng.choice(many, 5, replace=False))[::-1]
    need = int(rng.integers(2, 5))
    w = weight_for_recall(q, np.ones(5, bool), need / 5)
    again(w <= 1)
    return Paper(
        {"q": q, "need": need},
        f"<p>A network gives the five pixels of a mug the probabilities {', '.join(f'{x:g}' for x in q)} of mug; the "
        "rest is "
        "background. A weight w multiplies mug's probability before the larger of the two is taken (a tie counts as "
        "found). "
        f"Which is the smallest w with which {need} of the five pixels are found?</p>",
        {"w": w},
        f"The last of the first {need} has q = {q[need - 1]:g}; w q ≥ 1 − q at w = (1 − q)/q.",
        {"compared w q with 1/2": 0.5 / q[need - 1], "took the pixel after it": (1 - q[need]) / q[need]},
    )


@question(points=3, minutes=5)
def other_scenes(rng):
    """Carry probabilities over to scenes with other shares of the classes."""
    old, new = int(rng.choice([2, 4, 5, 10, 20])) / 100, int(rng.choice([10, 20, 25, 40, 50])) / 100
    q = int(rng.choice([4, 5, 8, 10, 20, 25, 40, 50])) / 100
    shares, new_shares = np.array([1 - old, old]), np.array([1 - new, new])
    moved = change_prior(np.log([1 - q, q]), np.ones(2), shares, new_shares)
    answer = softmax(moved)[1]
    odds = moved[1] - moved[0]
    again(old >= new or not np.isclose(np.exp(odds) * 12, round(np.exp(odds) * 12)) or np.exp(odds) > 12)
    return Paper(
        {"old": old, "new": new, "q": q},
        f"<p>A network was trained without weights on scenes in which {100 * old:g} % of the pixels are mug, and "
        "gives a pixel "
        f"q = {q:g} for mug. In the scenes where it is used, {100 * new:g} % are mug, and a mug looks as it always "
        "did. "
        "What are the odds mug : background there, and what is the probability?</p>",
        {"odds": np.exp(odds), "probability": answer},
        f"Odds times new odds over old odds: {q / (1 - q):.4g} · {new / (1 - new):.4g} / {old / (1 - old):.4g}.",
        {"took the ratio of the shares, not of their odds": q / (1 - q) * new / old},
    )


@question(points=3, minutes=4)
def weighted_gradient(rng):
    """Compute a weighted pixel's gradient."""
    k, w, y = rng.integers(1, 8, 3), rng.integers(2, 12, 3), int(rng.integers(0, 3))
    again(k.sum() not in (5, 10) or len(set(w.tolist())) < 3)
    z = np.log(k)[None]
    g = cross_entropy_grad(z, np.array([y]), w.astype(float))[0]
    plain = cross_entropy_grad(z, np.array([y]))[0]
    return Paper(
        {"k": k, "w": w},
        f"<p>A pixel has the logits (ln {k[0]}, ln {k[1]}, ln {k[2]}) and the true class {named(y)}. The classes' "
        f"weights are {w[0]}, "
        f"{w[1]} and {w[2]}. Compute the gradient of its weighted cross-entropy by the logits.</p>",
        {"dL/dz": g},
        f"The true class's weight, {w[y]}, times (p − one-hot); it still sums to 0.",
        {"weighted each entry by its own class": w * plain, "left the weight out": plain},
    )
