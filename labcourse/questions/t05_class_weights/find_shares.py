"""05_class_weights.find_shares: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import MOST_CLASSES, array, count
from labcourse.questions.t05_class_weights import (
    SHARES,
    SURE,
    draw_shares,
    draw_weights,
    logits_of_any_size,
    some_logits,
)
from labgrader.question import Question, holds, wrong


def find_shares(z, w, shares, rounds):
    """Estimate the classes' shares in new scenes: a guess is the mean of the probabilities that the last one gives."""
    likelihoods = z.reshape(-1, z.shape[-1]) - np.log(w * shares)
    guess = shares
    for _ in range(rounds):
        a = likelihoods + np.log(guess)
        e = np.exp(a - a.max(axis=1, keepdims=True))
        guess = (e / e.sum(axis=1, keepdims=True)).mean(axis=0)
    return guess


def _network(rng):
    """Logits (H, W, C), weights, the classes' shares in the scenes of training, and a number of rounds."""
    H, W, C = int(rng.integers(2, 4)), int(rng.integers(4, 6)), int(rng.integers(6, 8))
    return some_logits(rng, H, W, C), draw_weights(rng, C), draw_shares(rng, C), int(rng.integers(2, 6))


_THREE = np.array([[2.0, 0.0], [0.0, 1.0], [0.0, 3.0]])


def _any_network(rng, shape, C):
    """Logits (*shape, C) of any size, some pixels twice, weights, shares in training, and one round."""
    z = logits_of_any_size(rng, shape, C)
    for axis in range(len(shape)):
        np.moveaxis(z, axis, 0)[-1] = np.moveaxis(z, axis, 0)[0]
    return z, draw_weights(rng, C), draw_shares(rng, C), 1


def _slow(rng):
    """Logits that say little, of a class that was rare: it grows by 15 % in each round, to the last."""
    w, rounds = draw_weights(rng, 2), int(rng.choice([97, MOST_ROUNDS]))
    rare = 0.2 * 1.15**-rounds
    says = rng.normal(0.0, 0.3, 30)
    says += np.log(1.15 / np.exp(says).mean())
    shares = np.array([1.0 - rare, rare])
    z = np.stack([0.0 * says, says], axis=1) + np.log(w * shares) + rng.choice([0.0, 1e5])
    return z, w, shares, rounds


MOST_ROUNDS = 100
SHAPES = ((3, 3, 4), 3), ((40,), MOST_CLASSES)
QUESTION = Question(
    reference=find_shares,
    kinds={
        "z": array(
            "... C", -1e6, 1e6, says=("-1e6 to 1e6", "C from 1 to 255"), free=("reversed along ...*", "transposed")
        ),
        "w": array("C", 0.1, 25.0, says="0.1 to 25"),
        "shares": SHARES,
        "rounds": count(1, MOST_ROUNDS, says="1 to 100"),
    },
    inputs=(_network, _slow, *(partial(_any_network, shape=shape, C=C) for shape, C in SHAPES)),
    by_hand=(
        (-_THREE, np.ones(2), np.array([0.9, 0.1]), 1),
        (np.array([[0.0, 0.0]]), np.array([1.0, 9.0]), np.array([0.9, 0.1]), 1),  # weights alone
        (_THREE, np.ones(2), np.array([0.5, 0.5]), 1),  # a mean of probabilities
        (_THREE, np.ones(2), np.array([0.9, 0.1]), 1),
        (_THREE, np.ones(2), np.array([0.96, 0.04]), 2),  # the second round begins with the network's logits, too
        (_THREE, np.array([1.0, 4.0]), np.array([0.8, 0.2]), 3),
        (_THREE + 1000.0, np.array([1.0, 4.0]), np.array([0.8, 0.2]), 1),  # exp overflows
        (SURE, np.array([0.5, 4.0, 1.0]), np.array([0.6, 0.1, 0.3]), 2),  # with one maximum for both, exp gives 0
        (np.array([3.0]), np.array([2.0]), np.ones(1), 2),
        (_THREE, np.array([6.0, 24.0]), np.array([0.8, 0.2]), MOST_ROUNDS),
    ),
    edges=2,
    random_cases=8,
    points=4,
    forbidden=("scipy", "torch"),
)


@holds("no share is below 0, and they sum to 1")
def shares_sum_to_1(z, w, shares, rounds, out):
    return np.all(out >= 0.0) and np.isclose(np.sum(out), 1.0, atol=1e-4)


# ---------------------------------------------------------------------------------------------------- wrong answers


def softmax(a):
    return np.exp(a - np.logaddexp.reduce(a, axis=-1, keepdims=True))


def repeated(step, guess, rounds):
    """The guess after some rounds of step(guess)."""
    for _ in range(rounds):
        guess = step(guess)
    return guess


def of_rounds(z, shares, rounds, believed, first=None):
    """Rounds with another step: believed(logits (N, C), guess) -> probabilities (N, C)."""
    z = z.reshape(-1, z.shape[-1])
    return repeated(lambda guess: believed(z, guess).mean(axis=0), shares if first is None else first, rounds)


@wrong("The network was trained with weights, and they are still in its logits. Where do you take them out?")
def weights_left_in(z, w, shares, rounds):
    return of_rounds(z, shares, rounds, lambda z, guess: softmax(z + np.log(guess / shares)))


@wrong("More of a class in the new scenes makes it likelier there: which of the two shares is divided by the other?")
def ratio_upside_down(z, w, shares, rounds):
    return of_rounds(z, shares, rounds, lambda z, guess: softmax(z + np.log(shares / guess / w)))


@wrong("You change what the last round changed. A guess replaces the training shares: what does each round begin with?")
def shifts_added_up(z, w, shares, rounds):
    a, guess = z.reshape(-1, z.shape[-1]) - np.log(w), shares
    for _ in range(rounds):
        a = a + np.log(guess / shares)
        guess = softmax(a).mean(axis=0)
    return guess


@wrong("You take the weights out in every round. Once is enough: after that, they are no longer in the logits.")
def weights_taken_out_each_time(z, w, shares, rounds):
    a, guess = z.reshape(-1, z.shape[-1]), shares
    for _ in range(rounds):
        a = a - np.log(w)
        guess = softmax(a + np.log(guess / shares)).mean(axis=0)
    return guess


@wrong("You start each round from the logits of the round before, weights and all. Which logits should it start from?")
def all_shifts_added_up(z, w, shares, rounds):
    a, guess = z.reshape(-1, z.shape[-1]), shares
    for _ in range(rounds):
        a = a + np.log(guess / shares / w)
        guess = softmax(a).mean(axis=0)
    return guess


@wrong("A pixel's probabilities sum to 1 over its classes; yours sum to 1 over the pixels. Which axis is which?")
def summed_over_pixels(z, w, shares, rounds):
    return of_rounds(z, shares, rounds, lambda z, guess: softmax((z + np.log(guess / shares / w)).T).T)


@wrong("A pixel's probabilities sum to 1 over its classes, the last axis. Over which axis do yours?")
def summed_over_the_first_axis(z, w, shares, rounds):
    def step(guess):
        p = np.moveaxis(softmax(np.moveaxis(z + np.log(guess / shares / w), 0, -1)), -1, 0)
        return p.reshape(-1, len(shares)).mean(axis=0)

    return repeated(step, shares, rounds)


@wrong(
    "Each pixel's probabilities sum to 1. Yours sum to 1 over all pixels together.", largest=("of all", "each pixel's")
)
def summed_over_everything(z, w, shares, rounds, largest):
    def step(guess):
        a = (z + np.log(guess / shares / w)).reshape(-1, len(shares))
        e = np.exp(a - (a.max() if largest == "of all" else a.max(axis=1, keepdims=True)))
        return e.sum(axis=0) / e.sum()

    return repeated(step, shares, rounds)


@wrong("The mean runs over all pixels. In an image they lie along two axes: over how many do you take it?")
def mean_over_the_first_axis(z, w, shares, rounds):
    return repeated(lambda guess: softmax(z + np.log(guess / shares / w)).mean(axis=0), shares, rounds)


@wrong(
    "The weights are in each pixel's probabilities. They cannot be taken out of the mean: when can they?",
    how=("each time", "at last"),
)
def weights_taken_out_of_the_mean(z, w, shares, rounds, how):
    z, guess = z.reshape(-1, z.shape[-1]), shares
    for number in range(rounds):
        guess = softmax(z + np.log(guess / shares)).mean(axis=0)
        if how == "each time" or number == rounds - 1:
            guess = guess / w / np.sum(guess / w)
    return guess


@wrong("Return only the guess after the last round.", first=(0, 1))
def all_guesses(z, w, shares, rounds, first):
    z, guesses = z.reshape(-1, z.shape[-1]), [shares]
    for _ in range(rounds):
        guesses.append(softmax(z + np.log(guesses[-1] / shares / w)).mean(axis=0))
    return np.array(guesses[first:])


@wrong("You count each pixel for its likeliest class. A pixel of 60 and 40 % is 0.6 and 0.4 of a pixel.")
def pixels_counted(z, w, shares, rounds):
    def one_hot(z, guess):
        a = z + np.log(np.maximum(guess, 1e-300)) - np.log(w * shares)
        return (a.argmax(axis=-1)[:, None] == np.arange(a.shape[-1])).astype(float)

    return of_rounds(z, shares, rounds, one_hot)


@wrong(
    "Take the softmax at each pixel and average the probabilities. You average the logits and then take the softmax."
)
def mean_of_logits(z, w, shares, rounds):
    def one(z, guess):
        return softmax((z + np.log(guess) - np.log(w * shares)).mean(axis=0, keepdims=True))

    return of_rounds(z, shares, rounds, one)


@wrong(
    "Each pixel's probabilities must sum to 1 before you take their mean; yours do so only on average.",
    of=("probabilities", "likelihoods"),
)
def normalised_after_the_mean(z, w, shares, rounds, of):
    z, guess = z.reshape(-1, z.shape[-1]), shares
    likely = softmax(z) / (w * shares) if of == "probabilities" else softmax(z - np.log(w * shares))
    for _ in range(rounds):
        guess = (likely * guess).mean(axis=0)
        guess = guess / guess.sum()
    return guess


@wrong("You ask each class on its own, yes or no. A pixel has one class: its probabilities sum to 1.", summed=(0, 1))
def sigmoids(z, w, shares, rounds, summed):
    def believed(z, guess):
        p = 1.0 / (1.0 + np.exp(-(z + np.log(guess / shares / w))))
        return p / p.mean(axis=0).sum() if summed else p

    return of_rounds(z, shares, rounds, believed)


@wrong(
    "Your guess is that of another round. Where does your loop begin, and after which step does it end?", more=(-1, 1)
)
def rounds_miscounted(z, w, shares, rounds, more):
    return find_shares(z, w, shares, rounds + more)


@wrong("The first guess is the training shares. You give all classes the same share.")
def from_equal_shares(z, w, shares, rounds):
    first = np.full(len(shares), 1.0 / len(shares))
    return of_rounds(z, shares, rounds, lambda z, guess: softmax(z + np.log(guess / shares / w)), first)


@wrong(
    "If a probability is multiplied by a factor, what is added to its logit?",
    added=("all", "the ratio", "the difference"),
)
def ratios_added(z, w, shares, rounds, added):
    def believed(z, guess):
        ratio = guess / shares if added == "the ratio" else guess - shares
        return softmax(z + guess / (w * shares) if added == "all" else z - np.log(w) + ratio)

    return of_rounds(z, shares, rounds, believed)


@wrong("Probabilities are multiplied by a ratio; what does that do to logits?")
def ratios_multiplied(z, w, shares, rounds):
    return of_rounds(z, shares, rounds, lambda z, guess: softmax(z * guess / (w * shares)))


@wrong("Probabilities are multiplied by a ratio; what does that do to logits?")
def new_ratio_multiplied(z, w, shares, rounds):
    return of_rounds(z, shares, rounds, lambda z, guess: softmax((z - np.log(w)) * guess / shares))


@wrong("What is np.exp(1000)? What may you subtract from every logit of a pixel?")
def that_overflows(z, w, shares, rounds):
    def believed(z, guess):
        e = np.exp(z + np.log(guess / shares / w))
        return e / e.sum(axis=-1, keepdims=True)

    return of_rounds(z, shares, rounds, believed)


@wrong("Subtract each pixel's own largest logit: with one maximum for all, a pixel far below it has 0 / 0.")
def one_maximum_for_all(z, w, shares, rounds):
    def believed(z, guess):
        a = z + np.log(guess / shares / w)
        e = np.exp(a - a.max())
        return e / e.sum(axis=-1, keepdims=True)

    return of_rounds(z, shares, rounds, believed)
