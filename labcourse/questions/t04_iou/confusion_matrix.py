"""04_iou.confusion_matrix: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import MOST_CLASSES, array, count
from labgrader.question import Question, wrong


def confusion_matrix(y_true, y_pred, num_classes, ignore):
    """Count n[i, j], the pixels of true class i that are predicted as j; those with y_true == ignore are left out."""
    counted = y_true != ignore
    n = np.zeros((num_classes, num_classes), np.int64)
    np.add.at(n, (y_true[counted], y_pred[counted]), 1)
    return n


def _label_pair(rng, shape=(9, 14), classes=(4, 20)):
    """Two label images that agree on two pixels in three; what is ignored is 255 or one of the classes."""
    num_classes = int(rng.choice(classes))
    p = rng.dirichlet(np.full(num_classes, 2.0))
    p[-1] *= rng.random() < 0.5  # in some cases the last class is never true
    y_true = rng.choice(num_classes, size=shape, p=p / p.sum()).astype(np.uint8)
    y_pred = np.where(rng.random(y_true.shape) < 0.65, y_true, rng.integers(num_classes, size=y_true.shape))
    ignore = int(rng.choice([0, 255]))
    y_true[rng.random(y_true.shape) < 0.15] = ignore
    return y_true, y_pred.astype(np.uint8), num_classes, ignore


def _any_classes(rng, shape):
    """Two images of a shape with any of 255 classes; half of the pixels agree, and as many are ignored."""
    y_true, y_pred = rng.integers(MOST_CLASSES, size=(2, *shape))
    y_true, ignore = np.where(rng.random(shape) < 0.5, y_pred, y_true), int(rng.integers(MOST_CLASSES))
    y_true[rng.random(shape) < 0.5] = ignore
    return y_true.astype(np.uint8), y_pred.astype(np.uint8), MOST_CLASSES, ignore


MOST_SIDE = 4000
SIDES = {"H": (1, MOST_SIDE), "W": (1, MOST_SIDE)}
_LARGE = np.random.default_rng(4).integers(2, size=(2, 1100, 1000), dtype=np.uint8)  # no part is like the whole
QUESTION = Question(
    reference=confusion_matrix,
    kinds={
        "y_true": array(
            "H W",
            0,
            254,
            also=(255,),
            dtype="uint8",
            lengths=SIDES,
            says=("sides up to 4000", "0 .. num_classes - 1, or `ignore`"),
        ),
        "y_pred": array("H W", 0, 254, dtype="uint8", lengths=SIDES, says="0 .. num_classes - 1"),
        "num_classes": count(1, MOST_CLASSES, says="1 to 255"),
        "ignore": count(0, 255, says="0 to 255"),
    },
    inputs=(
        _label_pair,
        partial(_any_classes, shape=(MOST_SIDE, 2)),
        partial(_label_pair, shape=(40, 60), classes=(2, 3)),  # more pixels of a pair than a byte counts
        partial(_any_classes, shape=(1, MOST_SIDE)),
    ),
    by_hand=(
        # An array may lie in memory by columns, and be a part of another.
        (np.array([[0, 1, 1], [2, 0, 2]], np.uint8, order="F"), np.array([[0, 1, 2], [2, 0, 1]], np.uint8), 3, 255),
        (np.array([[0, 1], [2, 1]], np.uint8), np.array([[0, 2], [1, 0]], np.uint8), 3, 255),
        (np.array([[0, 0, 1]], np.uint8), np.array([[0, 1, 1]], np.uint8), 2, 255),
        (np.array([[2, 255], [2, 1], [0, 2]], np.uint8), np.array([[1, 0], [1, 1], [0, 2]], np.uint8), 3, 255),
        (np.array([[0, 1, 2, 1]], np.uint8), np.array([[1, 0, 2, 1]], np.uint8), 4, 0),
        (np.array([[0, 1, 2, 1]], np.uint8), np.array([[1, 0, 2, 2]], np.uint8), 3, 1),
        (np.array([[0]], np.uint8), np.array([[0]], np.uint8), 1, 255),
        (np.array([[255, 255]], np.uint8), np.array([[0, 1]], np.uint8), 2, 255),  # nothing was judged
        (np.array([[0, 255]], np.uint8), np.array([[0, 0]], np.uint8), 1, 255),  # one class, and what nobody judged
        (*_LARGE, 2, 255),  # more pixels of a pair than two bytes count
        (np.array([[19, 19, 18]], np.uint8), np.array([[19, 18, 19]], np.uint8), 20, 255),
        (np.array([[254]], np.uint8), np.array([[253]], np.uint8), 255, 255),
    ),
    edges=6,
    random_cases=10,
    forbidden=("sklearn", "torchmetrics"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


def counted_pairs(y_true, y_pred, ignore):
    counted = y_true != ignore
    return y_true[counted].astype(int), y_pred[counted].astype(int)


def pair_count(rows, columns, num_classes):
    return np.bincount(rows * num_classes + columns, minlength=num_classes**2).reshape(num_classes, num_classes)


@wrong("Row 0 is too full: what became of the pixels whose true label is `ignore`?")
def ignored_as_class_0(y_true, y_pred, num_classes, ignore):
    rows = np.where(y_true == ignore, 0, y_true).astype(int)
    return pair_count(rows.ravel(), y_pred.ravel().astype(int), num_classes)


@wrong("Whether a pixel counts is up to the truth alone; one that is predicted as `ignore` still counts.")
def prediction_ignored_too(y_true, y_pred, num_classes, ignore):
    rows, columns = counted_pairs(y_true, y_pred, ignore)
    return pair_count(rows[columns != ignore], columns[columns != ignore], num_classes)


@wrong("0 is a label like any other: where `ignore` is 0, the true pixels of class 0 do not count.")
def zero_ignores_nothing(y_true, y_pred, num_classes, ignore):
    return pair_count(*counted_pairs(y_true, y_pred, ignore if ignore else 255), num_classes)


@wrong("`ignore` need not be 255: where it is the number of a class, that class's true pixels do not count.")
def only_what_is_no_class_ignored(y_true, y_pred, num_classes, ignore):
    return pair_count(*counted_pairs(y_true, y_pred, 255), num_classes)


@wrong("n holds whole numbers of pixels: nothing is divided yet.", of=("rows", "all"))
def shares(y_true, y_pred, num_classes, ignore, of):
    n = pair_count(*counted_pairs(y_true, y_pred, ignore), num_classes)
    with np.errstate(invalid="ignore"):
        return n / n.sum() if of == "all" else n / np.maximum(n.sum(axis=1, keepdims=True), 1)


@wrong(
    "A row is num_classes long, whatever that is: by which number do you multiply the true class?",
    factor=(2, 3, 4, 10, 20),
)
def pairs_of_so_many_classes(y_true, y_pred, num_classes, ignore, factor):
    rows, columns = counted_pairs(y_true, y_pred, ignore)
    n = np.bincount(rows * factor + columns, minlength=num_classes**2)
    return n[: num_classes**2].reshape(num_classes, num_classes)


@wrong("With 20 classes the numbers go wrong: what is 19 * 20 + 19 in uint8, which ends at 255?")
def overflowing_bytes(y_true, y_pred, num_classes, ignore):
    counted = y_true != ignore
    pair = y_true[counted] * np.uint8(num_classes) + y_pred[counted]
    return np.bincount(pair, minlength=num_classes**2)[: num_classes**2].reshape(num_classes, num_classes)


@wrong("A counter in bytes starts anew after 255 pixels. Which dtype counts as many as a picture has?")
def counted_in_bytes(y_true, y_pred, num_classes, ignore):
    return pair_count(*counted_pairs(y_true, y_pred, ignore), num_classes).astype(np.uint8)


@wrong("np.bincount ends at the largest number that occurs: how long does its result have to be?")
def as_long_as_the_largest_pair(y_true, y_pred, num_classes, ignore):
    """ValueError, where the last pair of classes does not occur."""
    rows, columns = counted_pairs(y_true, y_pred, ignore)
    return np.bincount(rows * num_classes + columns).reshape(num_classes, num_classes)


@wrong("np.histogram2d spreads its bins from the least label to the largest: where does class 1 begin?")
def bins_between_the_extremes(y_true, y_pred, num_classes, ignore):
    return np.histogram2d(*counted_pairs(y_true, y_pred, ignore), bins=num_classes)[0].astype(int)


@wrong("Some pixels are lost: a pair of indices that occurs twice is written once. What adds them up?")
def written_once(y_true, y_pred, num_classes, ignore):
    n = np.zeros((num_classes, num_classes), int)
    n[counted_pairs(y_true, y_pred, ignore)] += 1
    return n


@wrong("Ignored pixels count nowhere: they have a row of their own in yours.", square=(True, False))
def ignored_in_a_row_of_their_own(y_true, y_pred, num_classes, ignore, square):
    rows = np.where(y_true == ignore, num_classes, y_true).astype(int)
    size = num_classes + 1
    return pair_count(rows.ravel(), y_pred.ravel().astype(int), size)[:, : size if square else num_classes]
