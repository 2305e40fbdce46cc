"""Paper questions on confusion matrices and scores (topic 04)."""

import numpy as np

from labcourse.exam.paper import Paper, again, blank, captioned, named, names, question, table
from labcourse.questions.t04_iou.merge_classes import merge_classes
from labkit.metrics import confusion_matrix, iou, mean_iou, pixel_accuracy, precision_recall

CLASSES = ("background", "surface", "mug")


@question(points=3, minutes=5)
def fill_matrix(rng):
    """Fill a confusion matrix from two label images."""
    y_true = rng.integers(0, 3, (3, 4))
    y_pred = np.where(rng.random((3, 4)) < 0.6, y_true, rng.integers(0, 3, (3, 4)))
    y_true[rng.integers(3), rng.integers(4)] = 255
    n = confusion_matrix(y_true, y_pred, 3)
    again(np.diag(n).min() == 0 or (n - np.diag(np.diag(n)) > 0).sum() < 3)
    return Paper(
        {"truth": y_true.astype(np.uint8), "prediction": y_pred.astype(np.uint8)},
        "<p>These are truth and prediction of twelve pixels; 255 means that nobody judged the pixel.</p><p>"
        + captioned(names(y_true), "truth")
        + captioned(names(y_pred), "prediction")
        + "</p>"
        + "<p>Fill in the confusion matrix: rows are true classes, columns predicted "
        f"ones.</p>{blank(3, 3, range(3), range(3))}",
        {"n": n},
        f"{n.sum()} pixels are judged; the diagonal holds the {np.trace(n)} right ones.",
        {"exchanged rows and columns": n.T},
    )


@question(points=4, minutes=6)
def scores(rng):
    """Compute the IoU of each class and the pixel accuracy from a matrix."""
    n = rng.integers(0, 20, (3, 3)) + np.diag(rng.integers(20, 60, 3))
    values = iou(n)
    again(not np.isclose(values * 20, np.round(values * 20)).any())
    again(len(set(values.tolist())) < 3)
    right = np.diag(n)
    return Paper(
        {"n": n},
        "<p>In this confusion matrix, rows are true classes.</p>"
        + table(n, range(3), range(3), "true, predicted")
        + "<p>Compute the IoU of each class, and the pixel accuracy. (Fractions will do.)</p>",
        {"IoU": values, "pixel accuracy": pixel_accuracy(n)},
        "n<sub>cc</sub> / (row sum + column sum − n<sub>cc</sub>); accuracy is the trace over the sum, "
        f"{right.sum()}/{n.sum()}.",
        {
            "counted the right pixels twice below": right / (n.sum(0) + n.sum(1)),
            "gave recall": right / n.sum(1),
            "gave precision": right / n.sum(0),
        },
    )


@question(points=3, minutes=4)
def absent(rng):
    """Average the IoU of four classes."""
    n = np.zeros((4, 4), int)
    gone = int(rng.integers(1, 4))
    here = [c for c in range(4) if c != gone]
    for c in here:
        n[c, c] = rng.integers(4, 60)
    n[here[1], here[0]] = rng.integers(2, 41)
    values = iou(n)[here]
    again(not np.isclose(values * 20, np.round(values * 20)).all() or len(set(values.tolist())) < 3)
    return Paper(
        {f"n[{i}, {j}]": n[i, j] for i, j in np.argwhere(n)},
        f"<p>In this confusion matrix of four classes, rows are true classes.</p>{table(n, range(4), range(4))}"
        "<p>Compute the mean IoU.</p>",
        {"mean IoU": mean_iou(n)},
        f"Class {gone} is in neither image: 0/0 is no score. IoU of the others: {', '.join(f'{v:g}' for v in values)}.",
        {"counted the absent class as 0": values.sum() / 4, "counted the absent class as 1": (values.sum() + 1) / 4},
    )


@question(points=3, minutes=4)
def useless_mask(rng):
    """Score a prediction of nothing but background."""
    percent = int(rng.integers(2, 21))
    y = (np.arange(100) < percent).astype(int)[None]
    n = confusion_matrix(y, np.zeros_like(y), 2)
    return Paper(
        {"percent": percent},
        f"<p>A mug covers {percent} % of an image; the rest is background. A network says “background” everywhere. "
        "Give pixel accuracy, IoU of both classes, their mean, and the mug's recall.</p>",
        {
            "accuracy": pixel_accuracy(n),
            "IoU": iou(n),
            "mean": mean_iou(n),
            "recall": float(precision_recall(n)[1][1]),
        },
        "All pixels are predicted as background: their union is the image. Of the mug nothing is found.",
        {"left the mug out of the mean": {"mean": iou(n)[0]}},
    )


@question(points=3, minutes=4)
def which_mistake(rng):
    """Compute precision, recall and IoU, and say which mistake bends a cloud."""
    tp, fp, fn = (int(x) for x in rng.integers(1, 40, 3) * 5)
    n = np.array([[1000, fp], [fn, tp]])
    precision, recall = (values[1] for values in precision_recall(n))
    again(not np.isclose([precision * 40, recall * 40], np.round([precision * 40, recall * 40])).all() or fp == fn)
    return Paper(
        {"TP": tp, "FP": fp, "FN": fn},
        f"<p>Of a mug's mask, {tp} pixels are right. {fp} pixels of the table are taken for mug, and {fn} pixels of "
        "the mug "
        "are missed. Compute precision, recall and IoU. Which of the two mistakes bends the mug's cloud towards the "
        "table?</p>",
        {"precision": precision, "recall": recall, "IoU": iou(n)[1], "bends": f"the {fp} of the table (precision)"},
        "TP/(TP + FP), TP/(TP + FN), TP/(TP + FP + FN).",
        {"exchanged the two": recall},
    )


@question(points=3, minutes=4)
def two_images(rng):
    """Compute an IoU over two frames, in two ways."""
    small, large = int(rng.choice([2, 4, 5, 10])), int(rng.choice([40, 50, 80, 100, 200]))
    hit = [int(rng.integers(1, small + 1)), int(rng.integers(1, large))]
    matrices = [
        np.array([[500, 0], [union - inside, inside]]) for inside, union in zip(hit, (small, large), strict=True)
    ]
    each = [iou(n)[1] for n in matrices]
    total = iou(sum(matrices))[1]
    again(abs(each[0] - each[1]) < 0.3)
    return Paper(
        {"inside": hit, "union": [small, large]},
        f"<p>In one frame, prediction and truth of a mug have {hit[0]} pixels in common and a union of {small}; in "
        "another frame "
        f"{hit[1]} and {large}. What is the mug's IoU over both frames, with counts added? What is the mean of the "
        "frames' "
        "two IoUs?</p>",
        {"counts added": total, "mean of frames": np.mean(each)},
        f"({hit[0]} + {hit[1]}) / ({small} + {large}); ({each[0]:g} + {each[1]:g}) / 2.",
        {"averaged the frames": np.mean(each)},
    )


@question(points=3, minutes=4)
def merged(rng):
    """Merge two classes of a confusion matrix."""
    n = rng.integers(0, 30, (3, 3)) + np.diag(rng.integers(30, 60, 3))
    group = np.array([0, 1, 1])[rng.permutation(3)]
    a, b = (int(c) for c in np.flatnonzero(group == group[np.bincount(group)[group] == 2][0]))
    together = merge_classes(n, np.array([int(c in (a, b)) for c in range(3)]))
    value = iou(together)[1]
    again(not np.isclose(value * 100, round(value * 100)))
    return Paper(
        {"n": n},
        "<p>In this confusion matrix, rows are true classes.</p>"
        + table(n, range(3), range(3), "true, predicted")
        + f"<p>Classes {named(a)} and {named(b)} get one name. Write the 2x2 matrix (the other class first), and the "
        "IoU of the new class.</p>",
        {"matrix": together, "IoU": value},
        "Add their rows, and then their columns; what was confused between the two is right now.",
        {"left their confusions out": {"IoU": (n[a, a] + n[b, b]) / (together[1].sum() + together[0, 1])}},
    )
