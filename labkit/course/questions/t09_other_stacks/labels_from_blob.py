"""09_other_stacks.labels_from_blob: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong


def labels_from_blob(scores):
    """Label each pixel with its best class, the first of equals: scores (1, C, H, W) -> (H, W)."""
    return scores[0].argmax(axis=0)


def _scores(rng):
    C, H, W = (int(rng.integers(low, low + 3)) for low in (3, 5, 8))
    z = rng.normal(size=(1, C, H, W))
    return (np.round(z, 0 if rng.random() < 0.5 else 3).astype(np.float32) - np.float32(rng.integers(0, 3)),)


QUESTION = Question(
    name="09_other_stacks.labels_from_blob",
    reference=labels_from_blob,
    inputs=_scores,
    by_hand=(
        (np.array([[[[1, 0, 0], [9, 9, 0]], [[0, 5, 0], [2, 3, 8]]]], np.float32),),
        (np.zeros((1, 3, 2, 4), np.float32),),
        (np.array([[[[200.0, -300.0]], [[210.0, -310.0]], [[205.0, -305.0]]]], np.float32),),  # beyond exp
        (np.array([[[[-3.0, -1.0]], [[-2.0, -5.0]], [[-9.0, -1.0]]]], np.float32),),
    ),
    random_cases=6,
    rtol=0.0,
    atol=0.0,
    points=2,
    properties=(
        Property(
            "every label is one of the classes",
            lambda arguments, labels: bool(np.isin(labels, np.arange(arguments[0].shape[1])).all()),
        ),
    ),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(QUESTION, "Many C++ listings do this: how far apart in memory are two classes of one pixel?")
def labels_as_nhwc(scores):
    _, C, H, W = scores.shape
    return scores.reshape(H, W, C).argmax(axis=-1)


@wrong(QUESTION, "Let class 1 win in one row only: do you get a row?")
def labels_column_by_column(scores):
    _, C, H, W = scores.shape
    return scores.reshape(C, W, H).argmax(axis=0).T


@wrong(QUESTION, "Where all scores are equal, the first class wins.")
def last_of_equals(scores):
    return scores.shape[1] - 1 - scores[0, ::-1].argmax(axis=0)


@wrong(QUESTION, "Background is a class like any other.")
def without_class_0(scores):
    return scores[0, 1:].argmax(axis=0) + 1


@wrong(QUESTION, "Not how good the best score is, but whose it is.")
def best_scores(scores):
    return scores[0].max(axis=0)


@wrong(QUESTION, "The first class has number 0 in the kit.")
def classes_from_1(scores):
    return scores[0].argmax(axis=0) + 1


@wrong(QUESTION, "Logits have no zero: only the differences within a pixel count.")
def above_zero(scores):
    return np.where(scores[0].max(axis=0) > 0, scores[0].argmax(axis=0), 0)
