"""04_iou.jackknife: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labcourse.kinds import MOST_CLASSES, array
from labcourse.questions.t04_iou import MOST_COUNTED, counts_of_frames, divide, iou_of, parts
from labgrader.question import Question, holds, wrong


def jackknife(n_frames):
    """Pool the frames' counts to one mean IoU; its standard error, by leaving out one frame after the other."""
    F, total = len(n_frames), n_frames.sum(axis=0)
    scores = []
    for n in (total, *(total - n_frames)):
        correct = np.diagonal(n)
        union = n.sum(axis=0) + n.sum(axis=1) - correct
        scores.append(np.mean(correct[union > 0] / union[union > 0]))
    mean, *left = scores
    return mean, np.sqrt((F - 1) / F * np.square(left - np.mean(left)).sum())


def _frames_alike(rng):
    """Draw a hundred frames that differ in a few of their many pixels: their error is small, and not 0."""
    n = rng.integers(10**5, 10**6, (2, 2)) // [[1, 20], [20, 1]]
    return (n + rng.integers(0, 30, (MOST_FRAMES, 2, 2)),)


def _two_equal(rng):
    """Draw the frames of a camera that stands still at the end: the last two are equal."""
    (n,) = counts_of_frames(rng)
    n[-1] = n[-2]
    return (n,)


def _ends_unlike(rng):
    """Draw a hundred frames, many equal; the first and the last count most, each by another class."""
    n = np.resize(rng.integers(1, 50, (MOST_FRAMES // 3, 3, 3)), (MOST_FRAMES, 3, 3))
    n[0, 0, 1:], n[-1, 1:, 0] = rng.integers(3000, 9000, (2, 2))
    return (n,)


def _many_classes(rng):
    """Draw two to four frames of up to 255 classes, with up to all the pixels that there may be."""
    n = np.exp(rng.uniform(0.0, np.log(MOST_COUNTED), (int(rng.integers(2, 5)), MOST_CLASSES, MOST_CLASSES)))
    return (np.where(rng.random(n.shape) < 0.5, 0.0, n).astype(np.int64),)


MOST_FRAMES = 100
_ONE_PIXEL = np.array(
    [[[5, 0, 1], [1, 2, 0], [0, 0, 0]], [[9, 1, 0], [0, 2, 0], [0, 0, 0]], [[4, 2, 0], [1, 7, 0], [0, 0, 0]]]
)
# Beside so many pixels float32 forgets those of the other frames.
_ONE_HUGE = np.array([[[MOST_COUNTED, 7], [0, MOST_COUNTED - 999]], [[3, 1], [2, 1]], [[1, 1], [5, 1]]])


QUESTION = Question(
    reference=jackknife,
    kinds={
        "n_frames": array(
            "F C C",
            0,
            MOST_COUNTED,
            dtype="int64",
            lengths={"F": (2, MOST_FRAMES)},
            says=("F from 2 to 100", "C from 1 to 255", "0 to 10 ** 12"),
            free=("reversed along F",),
        )
    },
    inputs=(counts_of_frames, _frames_alike, _two_equal, _many_classes, _ends_unlike),
    by_hand=(
        (np.array([[[255, 0], [1, 3]], [[4, 5], [0, 6]]]),),
        (
            np.array([[[0, 0], [0, 1]], [[0, 99], [0, 0]]]),
        ),  # without one frame class 1 scores 0/99, without the other 1/1
        (np.array([[[1, 1], [0, 2]], [[3, 0], [1, 1]], [[1, 1], [0, 2]]]),),  # two frames are equal, and both count
        (_ONE_PIXEL,),  # one pixel is called class 2
        (np.array([[[30_000, 2_000], [0, 500]]] * 3),),  # no frame differs; more pixels than 16 bits count
        (np.array([[[3]], [[5]]]),),  # one class
        (_ONE_HUGE,),
    ),
    edges=2,
    random_cases=6,
    atol=1e-7,  # a hundred frames of a million pixels may differ by little more
    points=3,
    forbidden=("sklearn", "torchmetrics", "scipy"),
)


@holds("the score, a mean of shares, is from 0 to 1")
def score_is_a_share(n_frames, out):
    return 0.0 <= out[0] <= 1.0


@holds("frames that are all alike have a standard error of 0")
def alike_frames_say_the_same(n_frames, out):
    return np.isclose(out[1], 0.0, atol=1e-6) or not (n_frames == n_frames[0]).all()


@holds("a standard error is not negative")
def error_is_not_negative(n_frames, out):
    return out[1] >= 0.0


# ---------------------------------------------------------------------------------------------------- wrong answers


def pooled(n_frames):
    return np.nanmean(iou_of(n_frames.sum(axis=0)))


def without_each(n_frames, score):
    """The score of all frames but one, for each."""
    return np.array([score(np.delete(n_frames, k, axis=0)) for k in range(len(n_frames))])


def spread(left, factor):
    """The root of the squared deviations from their mean, added up and multiplied by a factor of F."""
    return np.sqrt(factor(len(left)) * np.square(left - left.mean()).sum())


def by(n_frames, score):
    """A jackknife of another score."""
    return score(n_frames), spread(without_each(n_frames, score), lambda F: (F - 1) / F)


def with_factor(n_frames, factor):
    return pooled(n_frames), spread(without_each(n_frames, pooled), factor)


@wrong("The scores without one frame are close together, as they share nearly all frames: by which factor too close?")
def spread_of_the_scores(n_frames):
    return with_factor(n_frames, lambda F: 1 / F)


@wrong("The scores without one frame share nearly all frames: which factor makes their spread a standard error?")
def spread_of_the_scores_of_a_sample(n_frames):
    return with_factor(n_frames, lambda F: 1 / (F - 1))


@wrong("That divides the scores' spread by the root of F, as for F independent numbers. Are these independent?")
def as_if_they_were_independent(n_frames):
    return with_factor(n_frames, lambda F: 1 / (F * (F - 1)))


@wrong("That divides the scores' spread by the root of F, as for F independent numbers. Are these independent?")
def as_if_they_were_independent_by_f(n_frames):
    return with_factor(n_frames, lambda F: 1 / F**2)


@wrong(
    "A factor made of F is missing: try it on numbers. What is it for the mean of 1 and 3, whose standard error is 1?"
)
def no_factor(n_frames):
    return with_factor(n_frames, lambda F: 1.0)


@wrong(
    "Your factor is too large. What is it for the mean of 1 and 3, whose standard error is 1?",
    of=("F - 1", "F", "up", "squared"),
)
def factor_too_large(n_frames, of):
    factors = {"F - 1": lambda F: F - 1, "F": lambda F: F, "up": lambda F: F / (F - 1)}
    return with_factor(n_frames, factors.get(of, lambda F: (F - 1) ** 2 / F))


@wrong("1/2 is the factor of two frames: what is it of three?")
def factor_of_two_frames(n_frames):
    return with_factor(n_frames, lambda F: 0.5)


@wrong("The factor belongs to the squares: it is under the root, too.")
def factor_outside_the_root(n_frames):
    return with_factor(n_frames, lambda F: ((F - 1) / F) ** 2)


@wrong("That is the square of the standard error.")
def squared(n_frames):
    score, error = jackknife(n_frames)
    return score, error**2


@wrong("The root is taken of the factor times the sum. You take it of the factor alone.")
def sum_outside_the_root(n_frames):
    score, error = jackknife(n_frames)
    return score, error**2 / np.sqrt(1 - 1 / len(n_frames))


@wrong("Your error is always 0. Deviations add up to 0 unless each is squared first; and (F - 1) // F is 0, too.")
def squared_after_the_sum(n_frames):
    return pooled(n_frames), 0.0


@wrong("Deviations are squared one by one and then added up: you do not square them.")
def absolute_deviations(n_frames):
    left = without_each(n_frames, pooled)
    return pooled(n_frames), (len(left) - 1) / len(left) * np.abs(left - left.mean()).sum()


@wrong("Deviations are taken from the mean of the scores without one frame. Yours are from the score of all frames.")
def deviations_from_the_score_of_all(n_frames):
    left = without_each(n_frames, pooled)
    return pooled(n_frames), np.sqrt((len(left) - 1) / len(left) * np.square(left - pooled(n_frames)).sum())


@wrong("You correct the score's bias. The task asks for the plain mean IoU of all frames.")
def bias_corrected(n_frames):
    F, (score, error) = len(n_frames), jackknife(n_frames)
    return F * score - (F - 1) * without_each(n_frames, pooled).mean(), error


@wrong(
    "Without frame k all other frames count, also those before it. You never bring back a frame once it is left out."
)
def left_out_for_good(n_frames):
    left = np.array([pooled(n_frames[k + 1 :]) for k in range(len(n_frames) - 1)])
    return pooled(n_frames), spread(left, lambda _: (len(n_frames) - 1) / len(n_frames))


@wrong("Two frames may be equal, as where a camera stands still: each counts, and each is left out once.")
def equal_frames_left_out_once(n_frames):
    left = np.array([pooled(n_frames.sum(axis=0, keepdims=True) - n) for n in np.unique(n_frames, axis=0)])
    return pooled(n_frames), spread(left, lambda F: (F - 1) / F)


@wrong("The overlap is in the row sum and in the column sum: how often is it in your union?")
def overlap_twice_in_the_union(n_frames):
    def score(some):
        correct, predicted, true = parts(some.sum(axis=0))
        return np.nanmean(divide(correct, predicted + true))

    return by(n_frames, score)


def alone(n_frames):
    return np.array([np.nanmean(iou_of(n)) for n in n_frames])


@wrong("You score each frame alone. The pooled score is not their mean: leave one frame out and score the others.")
def standard_error_of_the_frames(n_frames):
    return pooled(n_frames), spread(alone(n_frames), lambda F: 1 / (F * (F - 1)))


@wrong("You score each frame alone. Leave it out, and score all the others.")
def one_frame_in(n_frames):
    return pooled(n_frames), spread(alone(n_frames), lambda F: (F - 1) / F)


@wrong("Your score is the mean of those without one frame. It should be the score of all frames, pooled.")
def mean_of_what_is_left(n_frames):
    return without_each(n_frames, pooled).mean(), jackknife(n_frames)[1]


@wrong("1/1 in one frame and 0/99 in another: is that one half, or one hundredth? Add counts, divide once.")
def mean_of_frames_means(n_frames):
    return by(n_frames, lambda some: alone(some).mean())


@wrong("1/1 in one frame and 0/99 in another: is that one half, or one hundredth? Add counts, divide once.")
def mean_of_frames_means_by_size(n_frames):
    return by(n_frames, lambda some: np.average(alone(some), weights=some.sum(axis=(1, 2))))


@wrong("1/1 in one frame and 0/99 in another: is that one half, or one hundredth? Add counts, divide once.")
def mean_of_classes_means(n_frames):
    def score(some):
        scores = np.array([iou_of(n) for n in some])
        return np.mean([np.nanmean(of_a_class) for of_a_class in scores.T if not np.isnan(of_a_class).all()])

    return by(n_frames, score)


@wrong("1/1 in one frame and 0/99 in another: is that one half, or one hundredth? Add counts, divide once.")
def mean_and_standard_error_of_the_frames(n_frames):
    return alone(n_frames).mean(), spread(alone(n_frames), lambda F: 1 / (F * (F - 1)))


def occurring(n_frames):
    return ~np.isnan(iou_of(n_frames.sum(axis=0)))


@wrong("A class that is only in the omitted frame no longer occurs: does it count in the mean of the others?")
def a_class_left_out_scores_0(n_frames):
    left = without_each(n_frames, lambda some: iou_of(some.sum(axis=0), empty=0.0)[occurring(n_frames)].mean())
    return pooled(n_frames), spread(left, lambda F: (F - 1) / F)


@wrong("A class that is only in the omitted frame no longer occurs: its score is NaN. What is a mean with a NaN in it?")
def a_class_left_out_is_nan(n_frames):
    left = without_each(n_frames, lambda some: iou_of(some.sum(axis=0))[occurring(n_frames)].mean())
    return pooled(n_frames), spread(left, lambda F: (F - 1) / F)


@wrong("What is the mean of some numbers if one of them is NaN?")
def nan_in_the_mean(n_frames):
    return by(n_frames, lambda some: iou_of(some.sum(axis=0)).mean())


@wrong(
    "A class that is in no frame and never predicted changes your mean: over how many classes do you average?",
    empty=(0.0, 1.0),
)
def absent_classes_count(n_frames, empty):
    return by(n_frames, lambda some: iou_of(some.sum(axis=0), empty=empty).mean())


@wrong("A class that is predicted but never true is a mistake: its IoU is 0, and it counts.")
def truth_only(n_frames):
    def score(some):
        n = some.sum(axis=0)
        return iou_of(n)[n.sum(axis=1) > 0].mean()

    return by(n_frames, score)


@wrong("A class whose IoU is 0 occurs all the same: it counts. Which number says whether a class occurs?")
def found_only(n_frames):
    def score(some):
        scores = iou_of(some.sum(axis=0))
        return scores[scores > 0.0].mean() if (scores > 0.0).any() else 0.0

    return by(n_frames, score)


@wrong("In your sum a class with many pixels outweighs the others: here each class counts once, whatever its size.")
def sum_over_sum(n_frames):
    def score(some):
        correct, predicted, true = parts(some.sum(axis=0))
        return correct.sum() / (predicted + true - correct).sum()

    return by(n_frames, score)


@wrong(
    "Your scores are recall or precision: a union contains both the row and the column of a class.",
    whole=("true", "predicted"),
)
def half_of_the_union(n_frames, whole):
    def score(some):
        correct, predicted, true = parts(some.sum(axis=0))
        return np.nanmean(divide(correct, true if whole == "true" else predicted))

    return by(n_frames, score)


@wrong("That is the share of pixels that are right; where are the unions?")
def accuracy(n_frames):
    return by(n_frames, lambda some: np.trace(some.sum(axis=0)) / some.sum())


@wrong("Background is a class like the others: over which classes do you average?")
def without_background(n_frames):
    return by(n_frames, lambda some: np.nanmean(np.append(iou_of(some.sum(axis=0))[1:], np.nan)))


@wrong("You average the standard errors of the classes. Asked for is the one of their mean.")
def errors_of_the_classes_averaged(n_frames):
    left = np.array([iou_of(n_frames.sum(axis=0) - n) for n in n_frames])
    off = np.nansum(np.square(left - np.nanmean(left, axis=0)), axis=0)
    return pooled(n_frames), np.sqrt((1 - 1 / len(n_frames)) * off).mean()
