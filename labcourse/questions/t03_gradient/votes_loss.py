"""03_gradient.votes_loss: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, array, number
from labcourse.questions.t03_gradient import TOUCHING, random_votes, scored
from labgrader.question import Question, holds, wrong


def votes_loss(votes, instances, beta):
    """Give the votes' loss, quadratic up to an error of beta and linear beyond, each thing alike, and its gradient."""
    grad, losses = np.zeros(votes.shape), []
    things = [k for k in np.unique(instances) if k not in (0, 255)]
    for k in things:
        v, u = np.nonzero(instances == k)
        x = np.stack([u, v], axis=1)
        e = votes[v, u] - (x.mean(axis=0) - x)
        r = np.sqrt((e**2).sum(axis=1))
        losses.append(np.where(r <= beta, r**2 / (2.0 * beta), r - beta / 2.0).mean())
        grad[v, u] = e / np.maximum(r, beta)[:, None] / len(u) / len(things)
    return float(np.sum(losses) / max(len(things), 1)), grad


ONE_ROW = np.array([[3, 3, 3, 0, 255]], np.uint8)


def _scattered_things(rng, shape, size, beta, numbers=(0, 1, 9, 128, 254, 255)):
    """Draw votes of a size, scattered things of some numbers in a picture of a shape, and beta from a range."""
    instances = rng.permutation(np.resize(numbers, np.prod(shape))).reshape(shape)
    instances[-1, -1] = 254  # what is last counts
    votes = np.clip(size * rng.normal(size=(*shape, 2)), -1e6, 1e6)
    return votes, instances.astype(np.uint8), float(rng.uniform(*beta))


def _votes_from_a_network(rng):
    """Draw as `random_votes` does, in the numbers of a network."""
    votes, *others = random_votes(rng)
    return votes.astype(np.float32), *others


QUESTION = Question(
    reference=votes_loss,
    kinds={
        "votes": array("H W 2", -1e6, 1e6, dtype="float64 float32", says="-1e6 to 1e6"),
        "instances": array(
            "H W", 0, 254, also=(255,), dtype="uint8", says=("0 is no thing", "255"), free=("255 to 0", "0 to 255")
        ),
        "beta": number(0.01, 1000.0, says="0.01 to 1000"),
    },
    inputs=(
        random_votes,
        _votes_from_a_network,
        partial(_scattered_things, shape=(1, LONG), size=500.0, beta=(960.0, 1000.0), numbers=range(256)),
        partial(_scattered_things, shape=(LONG, 1), size=5e5, beta=(10.0, 1000.0)),
        partial(_scattered_things, shape=(20, 20), size=0.1, beta=(0.01, 0.011)),
    ),
    by_hand=(
        (np.zeros((1, 5, 2)), ONE_ROW, 2.0),
        (np.array([[[1.0, 0.0], [3.0, 4.0], [-1.0, 0.0], [9.0, 9.0], [9.0, 9.0]]]), ONE_ROW, 2.0),
        (np.ones((2, 6, 2)) * [2.0, -1.0], TOUCHING, 1.0),
        (np.ones((2, 3, 2)), np.array([[0, 255, 0], [0, 0, 255]], np.uint8), 1.0),  # no thing at all
        (np.zeros((1, 3, 2)), np.array([[3, 3, 3]], np.uint8), 2.0),
        (np.array([[[-0.004, 0.003]]]), np.array([[254]], np.uint8), 0.0104),
        (np.array([[[0.003, -0.004]]]), np.array([[1]], np.uint8), 0.0104),
    ),
    edges=3,
    random_cases=10,
    points=3,
    forbidden=("scipy", "torch"),
    outputs=("loss", "gradient"),
)


@holds("where there is no thing, the gradient is 0")
def elsewhere_0(votes, instances, beta, output):
    return not np.any(output[1][(instances == 0) | (instances == 255)])


@holds("the loss is at least 0")
def not_negative(votes, instances, beta, output):
    return output[0] >= 0.0


# ---------------------------------------------------------------------------------------------------- wrong answers


def along_each_axis(e, beta):
    """The lesson's loss of an error and its slope, of du and of dv."""
    size = np.abs(e)
    loss = np.where(size <= beta, size**2 / (2.0 * beta), size - beta / 2.0).sum(axis=1)
    return loss, np.clip(e / beta, -1.0, 1.0)


def round_loss(e, beta):
    """The loss of the length of an error, and its slope."""
    r = np.sqrt((e**2).sum(axis=1))
    slope = e / np.maximum(r, beta)[:, None]
    return np.where(r <= beta, r**2 / (2.0 * beta), r - beta / 2.0), slope


@wrong("That is the lesson's loss, of du and of dv each. Here one length counts: how long is the error (3, 4)?")
def each_axis_for_itself(votes, instances, beta):
    return scored(votes, instances, beta, along_each_axis)


@wrong("The true arrow leads from the pixel to the middle. Yours is the middle's position: what must be subtracted?")
def place_of_the_middle(votes, instances, beta):
    return scored(votes, instances, beta, round_loss, arrow=lambda middle, x: middle + 0 * x)


@wrong("Your true arrow leads from the middle to the pixel: which of the two is subtracted?")
def arrow_turned_round(votes, instances, beta):
    return scored(votes, instances, beta, round_loss, arrow=lambda middle, x: x - middle)


@wrong("votes[..., 0] is du, along the columns, and votes[..., 1] is dv. Which of your arrow's numbers is which?")
def rows_and_columns_exchanged(votes, instances, beta):
    return scored(votes, instances, beta, round_loss, arrow=lambda middle, x: (middle - x)[:, ::-1])


@wrong("Your middle is that of a thing's bounding box. The middle is the mean over all its pixels.")
def middle_of_the_box(votes, instances, beta):
    return scored(votes, instances, beta, round_loss, middle=lambda x: (x.min(axis=0) + x.max(axis=0)) / 2.0)


@wrong("A thing's middle is a mean, so it can be a fraction: what rounds yours?")
def middle_rounded(votes, instances, beta):
    return scored(votes, instances, beta, round_loss, middle=lambda x: np.round(x.mean(axis=0)))


@wrong("A thing's middle is a mean, so it can be a fraction: what rounds yours?")
def middle_rounded_down(votes, instances, beta):
    return scored(votes, instances, beta, round_loss, middle=lambda x: x.mean(axis=0).astype(int))


@wrong("Beyond beta the loss is linear: its slope has the same length for each error. Has yours?")
def slope_of_the_square_everywhere(votes, instances, beta):
    return scored(votes, instances, beta, lambda e, b: (round_loss(e, b)[0], e / b))


@wrong("Your slope points along the error and has length 1 everywhere. How steep is the quadratic part at 0?")
def slope_of_the_length_everywhere(votes, instances, beta):
    return scored(votes, instances, beta, lambda e, b: (round_loss(e, b)[0], unit(e)))


def unit(e):
    """Arrows of length 1, and 0 for one of length 0."""
    r = np.sqrt((e**2).sum(axis=1, keepdims=True))
    return np.divide(e, r, out=np.zeros_like(e), where=r > 0.0)


@wrong("Beyond beta your slope is 1 or -1 in du and in dv. Along which direction does the length of (3, 4) grow?")
def slope_of_signs(votes, instances, beta):
    def loss_and_slope(e, beta):
        loss, slope = round_loss(e, beta)
        far = np.sqrt((e**2).sum(axis=1, keepdims=True)) > beta
        return loss, np.where(far, np.sign(e), slope)

    return scored(votes, instances, beta, loss_and_slope)


@wrong("At an error of beta your loss jumps: what must be subtracted from the linear part so that the two parts meet?")
def parts_that_do_not_meet(votes, instances, beta):
    def loss_and_slope(e, beta):
        r = np.sqrt((e**2).sum(axis=1))
        return np.where(r <= beta, r**2 / (2.0 * beta), r), round_loss(e, beta)[1]

    return scored(votes, instances, beta, loss_and_slope)


@wrong("r squared over beta has the slope 2 at beta, and the linear part the slope 1: which factor is missing?")
def twice_the_square(votes, instances, beta):
    def loss_and_slope(e, beta):
        r = np.sqrt((e**2).sum(axis=1))
        near = (r <= beta)[:, None]
        return np.where(r <= beta, r**2 / beta, r - beta / 2.0), np.where(near, 2.0 * e / beta, unit(e))

    return scored(votes, instances, beta, loss_and_slope)


@wrong("That is the squared error, with no linear part: what does an error of 100 pixels cost?")
def squared_everywhere(votes, instances, beta):
    return scored(votes, instances, beta, lambda e, b: ((e**2).sum(axis=1) / (2.0 * b), e / b))


@wrong("The quadratic part is divided by beta, too: r ** 2 / (2 beta). What is its slope at beta?")
def square_without_beta(votes, instances, beta):
    def loss_and_slope(e, beta):
        r = np.sqrt((e**2).sum(axis=1))
        near = (r <= beta)[:, None]
        return np.where(r <= beta, r**2 / 2.0, r - beta / 2.0), np.where(near, e, unit(e))

    return scored(votes, instances, beta, loss_and_slope)


@wrong("You give each pixel the same weight, so a large thing counts more. How much should each *thing* count?")
def mean_over_pixels(votes, instances, beta):
    total = np.count_nonzero((instances > 0) & (instances != 255))
    return scored(votes, instances, beta, round_loss, share=lambda n, K: 1.0 / total)


@wrong("You add up a thing's pixels. Each thing contributes the mean over its pixels.")
def sum_over_a_things_pixels(votes, instances, beta):
    return scored(votes, instances, beta, round_loss, share=lambda n, K: 1.0 / K)


@wrong("You add up the things. The loss is the mean over things, and the gradient has the same factor.")
def sum_over_things(votes, instances, beta):
    return scored(votes, instances, beta, round_loss, share=lambda n, K: 1.0 / n)


@wrong("You divide by all pixels of the image. Which pixels of it have a loss?")
def divided_by_all_pixels(votes, instances, beta):
    return scored(votes, instances, beta, round_loss, share=lambda n, K: 1.0 / instances.size)


@wrong("Numbers of things may have gaps: how many different ones are there, besides 0 and 255?")
def as_many_as_the_largest_number(votes, instances, beta):
    largest = max([int(k) for k in np.unique(instances) if k != 255] + [1])
    return scored(votes, instances, beta, round_loss, share=lambda n, K: 1.0 / n / max(largest, 1))


@wrong("255 is not a thing: these pixels were never judged.")
def unjudged_pixels_are_a_thing(votes, instances, beta):
    return scored(votes, instances, beta, round_loss, no_thing=(0,))


@wrong("0 is not a thing: there the votes are free.")
def background_is_a_thing(votes, instances, beta):
    return scored(votes, instances, beta, round_loss, no_thing=(255,))


@wrong("You pool the pixels of all things, with one middle. Each thing has its own middle.")
def one_middle_for_all(votes, instances, beta):
    one = np.where((instances > 0) & (instances != 255), 1, instances).astype(np.uint8)
    return scored(votes, one, beta, round_loss)


@wrong("The loss is divided by pixels and things. Is your gradient that of the same loss?")
def gradient_of_the_sum(votes, instances, beta):
    loss, _ = scored(votes, instances, beta, round_loss)
    return loss, scored(votes, instances, beta, round_loss, share=lambda n, K: 1.0)[1]


@wrong("The loss is a mean over things: is your gradient that of the same loss?")
def gradient_of_the_sum_of_things(votes, instances, beta):
    loss, _ = scored(votes, instances, beta, round_loss)
    return loss, scored(votes, instances, beta, round_loss, share=lambda n, K: 1.0 / n)[1]


@wrong("If a vote is too far to the right, must its gradient be above or below 0? Descent goes against it.")
def gradient_turned_round(votes, instances, beta):
    loss, grad = scored(votes, instances, beta, round_loss)
    return loss, -grad


@wrong("A picture may have no thing: what is its loss, and how large is 0 / 0?")
def no_thing_is_0_by_0(votes, instances, beta):
    loss, grad = scored(votes, instances, beta, round_loss)
    return (loss, grad) if np.any((instances > 0) & (instances != 255)) else (float("nan"), grad)


@wrong("beta is in pixels, like the votes: where do you compare its square with a length?")
def square_compared_with_beta(votes, instances, beta):
    def loss_and_slope(e, beta):
        square = (e**2).sum(axis=1)
        r, near = np.sqrt(square), square <= beta
        return np.where(near, square / (2.0 * beta), r - beta / 2.0), np.where(near[:, None], e / beta, unit(e))

    return scored(votes, instances, beta, loss_and_slope)


@wrong("Numbers of things may have gaps, as 1, 2 and 5: where does your loop end?")
def up_to_the_first_gap(votes, instances, beta):
    present = np.isin(np.arange(1, 255), instances)
    last = len(present) if present.all() else int(np.argmin(present))
    return votes_loss(votes, np.where(instances <= last, instances, 0), beta)


@wrong("Things have numbers up to 254, and 8 bits with a sign end at 127: what becomes of the thing 200?")
def numbers_of_8_bits_with_a_sign(votes, instances, beta):
    return votes_loss(votes, np.where(instances > 127, 0, instances), beta)
