"""Questions of topic 02: costs, weights, the energy, ICM's step, the arcs of a cut, a lower bound (section 2).

All models are Potts on 4 neighbours: psi (H, W, C) is what each class costs, w_right (H, W - 1) joins the pixels (v, u)
and (v, u + 1), w_down (H - 1, W) the pixels (v, u) and (v + 1, u).
"""

import numpy as np

from labkit.course.questions import answers_02 as answers
from labkit.course.questions.question import Misconception, Property, Question

# -------------------------------------------------------------------------------------- costs from probabilities


def unary_from_probabilities(p, floor):
    """Turn class probabilities into costs; those below `floor` count as `floor`."""
    return -np.log(np.maximum(p, floor))


def _probabilities(rng):
    """Draw probabilities some of which lie below the floor."""
    return rng.dirichlet((0.3, 0.4, 0.5), (4, 5)), float(rng.uniform(0.01, 0.05))


UNARY = Question(
    name="02_crf.unary_from_probabilities",
    reference=unary_from_probabilities,
    inputs=_probabilities,
    by_hand=(
        (np.array([[[0.5, 0.25, 0.25], [1.0, 0.0, 0.0]]]), 0.01),
        (np.array([[[0.7, 0.3]], [[0.05, 0.95]], [[0.1, 0.9]]]), 0.1),
    ),
    points=1,
    properties=(
        Property("every cost is 0 or more", lambda given, psi: bool(np.min(psi) >= -1e-9)),
        Property(
            "the likeliest class of a pixel is its cheapest",
            lambda given, psi: bool((np.take_along_axis(psi, given[0].argmax(2)[..., None], 2) <= psi + 1e-9).all()),
        ),
    ),
    misconceptions=(
        Misconception(
            "a score taken for a cost",
            lambda p, floor: np.log(np.maximum(p, floor)),
            "An energy is small where a label is likely: without any pairwise term, which class would yours choose?",
        ),
        Misconception(
            "the negative probability",
            lambda p, floor: -np.maximum(p, floor),
            "exp(-psi) should give the probability back: is its sum over the classes one at each pixel?",
        ),
        Misconception(
            "one minus the probability",
            lambda p, floor: 1.0 - np.maximum(p, floor),
            "What should a class of probability 0.001 cost, and one of 0.0001? In yours the two are nearly the same.",
        ),
        Misconception(
            "the floor added",
            lambda p, floor: -np.log(p + floor),
            "Only probabilities below the floor are to change: look at a pixel where one class has probability 1.",
        ),
        Misconception(
            "no floor",
            lambda p, floor: -np.log(np.maximum(p, 1e-300)),
            "What does a class of probability 0 cost, and can neighbours ever overrule that?",
        ),
        Misconception(
            "probabilities taken for logits",
            answers.softmaxed_again,
            "The softmax has been applied already: these numbers sum to one at each pixel.",
        ),
    ),
    alternatives=(answers.unary_torch, answers.unary_loops, answers.unary_float32),
    forbidden=("labkit",),
)

# ------------------------------------------------------------------------------ weights of the pairs to the right


def right_weights(image, lam, sigma_I, sigma_p):
    """Weigh each pixel's pair with its right neighbour by the colour difference, in the image's own units."""
    difference = np.diff(image.astype(np.float64), axis=1)
    squared = (difference**2).sum(axis=2)
    return lam * np.exp(-squared / (2.0 * sigma_I**2) - 1.0 / (2.0 * sigma_p**2))


def _image(rng):
    """Draw colours so far apart that bytes wrap round, and a sigma_I that lets every pair count all the same."""
    image = rng.integers(0, 256, (4, 6, 3)).astype(np.uint8)
    return image, float(rng.uniform(0.5, 3.0)), float(rng.uniform(70.0, 120.0)), float(rng.uniform(0.6, 1.8))


WEIGHTS = Question(
    name="02_crf.right_weights",
    reference=right_weights,
    inputs=_image,
    by_hand=(
        (np.array([[[120, 90, 60], [123, 94, 60]]], np.uint8), 2.0, 5.0, 1.0),
        (np.array([[[250, 5, 10], [245, 10, 10], [245, 10, 30]]], np.uint8), 1.0, 10.0, 2.0),
        (np.full((3, 2, 3), 77, np.uint8), 1.5, 8.0, 0.5),
    ),
    points=2,
    properties=(
        Property("no weight is negative", lambda given, w: bool(np.min(w) >= 0.0)),
        Property("no weight is above lam", lambda given, w: bool(np.max(w) <= given[1] + 1e-9)),
    ),
    misconceptions=(
        Misconception(
            "bytes wrap round",
            answers.wrapped_bytes,
            "Try np.uint8(5) - np.uint8(10): bytes have no negative numbers, so turn the image into floats first.",
        ),
        Misconception(
            "converted after the subtraction",
            answers.converted_late,
            "np.uint8(5) - np.uint8(10) is 251 already: turn the image into floats before you subtract.",
        ),
        Misconception(
            "the pairs below",
            answers.pairs_below,
            "A grid H by W has H (W - 1) pairs that go to the right: which axis counts columns?",
        ),
        Misconception(
            "no 2 in the denominators",
            answers.without_the_2,
            "Look at the denominators again: what stands before sigma squared in a Gaussian?",
        ),
        Misconception(
            "sigma not squared",
            answers.sigma_not_squared,
            "The exponent must have no unit: squared grey levels divided by what?",
        ),
        Misconception(
            "the mean over the channels",
            answers.mean_of_channels,
            "The squared length of a vector is a sum over its components: is yours a mean?",
        ),
        Misconception(
            "the channels added before squaring",
            answers.brightness_only,
            "Red against green of the same brightness is an edge too: which comes first, the square or the sum?",
        ),
        Misconception(
            "the distance left out",
            answers.without_distance,
            "What happened to sigma_p? These neighbours are one pixel apart.",
        ),
    ),
    alternatives=(answers.weights_loops, answers.weights_einsum, answers.weights_torch),
    forbidden=("labkit",),
)

# ---------------------------------------------------------------------------------------- energy of a labelling


def energy(y, psi, w_right, w_down):
    """Add up what the labels cost the pixels and what disagreement costs the pairs, each pair once."""
    rows, columns = np.indices(y.shape)
    unary = psi[rows, columns, y].sum()
    right = w_right[y[:, 1:] != y[:, :-1]].sum()
    down = w_down[y[1:] != y[:-1]].sum()
    return float(unary + right + down)


def _model(rng, H=4, W=6, C=3):
    """Draw psi, some of it negative, w_right and w_down."""
    return rng.normal(1.0, 2.0, (H, W, C)), rng.uniform(0.1, 2.0, (H, W - 1)), rng.uniform(0.1, 2.0, (H - 1, W))


def _labelled_model(rng):
    """Draw labels among which neighbours often agree, and a model."""
    return np.minimum(rng.integers(0, 4, (4, 6)), 2).astype(np.uint8), *_model(rng)


# Four pixels, two classes, four pairs: small enough for a pencil.
_PENCIL = (
    np.array([[[0.0, 2.0], [1.5, 0.5]], [[0.2, 1.0], [3.0, 0.1]]]),
    np.array([[1.0], [0.4]]),
    np.array([[0.3, 0.8]]),
)

ENERGY = Question(
    name="02_crf.energy",
    reference=energy,
    inputs=_labelled_model,
    by_hand=(
        (np.array([[0, 1], [0, 1]], np.uint8), *_PENCIL),
        (np.array([[0, 0], [0, 1]], np.uint8), *_PENCIL),
        (np.zeros((2, 2), np.uint8), *_PENCIL),
        (np.array([[2, 0, 2]], np.uint8), np.arange(9.0).reshape(1, 3, 3), np.array([[0.5, 0.25]]), np.zeros((0, 3))),
    ),
    points=2,
    misconceptions=(
        Misconception(
            "each pair counted from both ends",
            answers.pairs_twice,
            "An H by W grid has H (W - 1) + W (H - 1) pairs: does yours visit each of them once?",
        ),
        Misconception(
            "spins of plus and minus one",
            answers.spins,
            "What does agreement cost in the Potts model? Label everything alike: only unary costs may remain.",
        ),
        Misconception(
            "agreement charged",
            answers.agreement_charged,
            "The weight is paid where neighbours differ: what does an image of one label cost?",
        ),
        Misconception(
            "labels subtracted as if they were numbers",
            answers.label_steps,
            "Classes have names, not sizes: a pair (0, 2) disagrees no more than a pair (0, 1).",
        ),
        Misconception(
            "pairs to the right only",
            answers.rows_only,
            "Compare the energy of an image with that of its transpose: columns have neighbours too.",
        ),
    ),
    alternatives=(answers.energy_loops, answers.energy_einsum, answers.energy_torch, answers.energy_float32),
    forbidden=("labkit",),
)

# ---------------------------------------------------------------------------- costs of the classes at one pixel


def icm_costs(y, psi, w_right, w_down, v, u):
    """Say what each class would cost pixel (v, u), whose neighbours keep their labels."""
    H, W = y.shape
    classes = np.arange(psi.shape[2])
    costs = psi[v, u]
    if u + 1 < W:
        costs = costs + w_right[v, u] * (classes != y[v, u + 1])
    if u > 0:
        costs = costs + w_right[v, u - 1] * (classes != y[v, u - 1])
    if v + 1 < H:
        costs = costs + w_down[v, u] * (classes != y[v + 1, u])
    if v > 0:
        costs = costs + w_down[v - 1, u] * (classes != y[v - 1, u])
    return costs


def _pixel_of_a_model(rng):
    """Draw a labelled model and one of its pixels."""
    return *_labelled_model(rng), int(rng.integers(4)), int(rng.integers(6))


_LABELS = np.array([[0, 1, 1, 2], [0, 2, 1, 0], [2, 2, 0, 1]], np.uint8)
_MODEL = tuple(part.round(1) for part in _model(np.random.default_rng(2), 3, 4, 3))
_PIXELS = ((1, 1), (1, 2), (0, 0), (2, 3), (0, 3), (2, 0), (1, 0), (0, 2))  # the inside, all corners, two sides

ICM = Question(
    name="02_crf.icm_costs",
    reference=icm_costs,
    inputs=_pixel_of_a_model,
    by_hand=tuple((_LABELS, *_MODEL, v, u) for v, u in _PIXELS),
    points=3,
    misconceptions=(
        Misconception(
            "a class charged for agreeing",
            answers.charged_for_agreeing,
            "A class pays for each neighbour that has another label: which class should four like neighbours favour?",
        ),
        Misconception(
            "the pixel's own weights for the pairs behind it",
            answers.own_weights,
            "The pair with the left neighbour belongs to that neighbour: at which index of w_right does it stand?",
        ),
        Misconception(
            "the image closed to a ring",
            answers.closed_to_a_ring,
            "In NumPy, index -1 is the last row or column: has a pixel at the border a neighbour on that side?",
        ),
        Misconception(
            "w_right and w_down exchanged",
            answers.directions_exchanged,
            "w_right joins neighbours of one row, (v, u) and (v, u + 1): which weight goes with which neighbour?",
        ),
        Misconception(
            "only the neighbours to the right and below",
            answers.ahead_only,
            "In the energy each pair counts once, but a pixel in the middle belongs to four pairs.",
        ),
        Misconception(
            "no unary term",
            answers.neighbours_only,
            "What does each class cost the pixel before any neighbour is asked?",
        ),
    ),
    alternatives=(answers.icm_by_energies, answers.icm_loop, answers.icm_padded),
    forbidden=("labkit",),
)

# ------------------------------------------------------------------------------------------ arcs to the terminals


def terminal_capacities(psi):
    """Give the arcs source -> pixel and pixel -> sink for two classes, the source's side being 0, and the constant."""
    lowest = psi.min(axis=2)
    source = psi[..., 1] - lowest
    sink = psi[..., 0] - lowest
    return source, sink, float(lowest.sum())


CAPACITIES = Question(
    name="02_crf.terminal_capacities",
    reference=terminal_capacities,
    inputs=lambda rng: (_model(rng, 3, 5, 2)[0],),
    by_hand=(
        (np.array([[[2.0, 5.0]]]),),
        (np.array([[[4.0, 1.0], [-1.0, -3.0]]]),),
        (np.array([[[0.5, 0.5]], [[0.0, 2.0]], [[3.0, 1.0]]]),),
    ),
    points=2,
    properties=(
        Property("no capacity is negative", lambda given, out: bool(np.min(out[0]) >= 0.0 and np.min(out[1]) >= 0.0)),
        Property(
            "one of the two arcs of each pixel has capacity 0",
            lambda given, out: bool(np.minimum(out[0], out[1]).max() <= 1e-9),
        ),
    ),
    misconceptions=(
        Misconception(
            "source and sink exchanged",
            answers.source_and_sink_exchanged,
            "Try one pixel: on the source's side it has label 0, and which of its two arcs is cut then?",
        ),
        Misconception(
            "nothing subtracted",
            lambda psi: answers.terminals(psi[..., 1], psi[..., 0], 0.0),
            "What a pixel pays in any case can be taken off both of its arcs, and must be kept in the constant.",
        ),
        Misconception(
            "the constant forgotten",
            answers.with_constant(lambda lowest: 0.0),
            "The cut's value is the energy less what you subtracted: how much is that over all pixels?",
        ),
        Misconception(
            "the constant of the wrong sign",
            answers.with_constant(lambda lowest: -lowest.sum()),
            "Energy = cut + constant: what must be added to the cut's value to have the energy back?",
        ),
        Misconception(
            "one minimum for the whole image",
            answers.one_minimum_for_all,
            "Subtract the minimum pixel by pixel, so that one of each pixel's two arcs vanishes.",
        ),
    ),
    alternatives=(answers.capacities_by_difference, answers.capacities_loops, answers.capacities_torch),
    forbidden=("labkit",),
)

# ------------------------------------------------------------------------------------ a lower bound from the rows


def row_bound(psi, w_right):
    """Add up the least costs of the rows, each labelled as if there were no other row."""
    best = psi[:, 0]
    for u in range(1, psi.shape[1]):
        switch = best.min(axis=1, keepdims=True) + w_right[:, u - 1, None]
        best = psi[:, u] + np.minimum(best, switch)
    return float(best.min(axis=1).sum())


BOUND = Question(
    name="02_crf.row_bound",
    reference=row_bound,
    inputs=lambda rng: _model(rng)[:2],
    by_hand=(
        (np.array([[[0.0, 1.0], [1.0, 0.0], [0.0, 1.0]]]), np.array([[0.4, 0.4]])),
        (np.array([[[0.0, 3.0], [2.0, 0.0], [0.0, 3.0]], [[1.0, 0.0], [0.0, 5.0], [0.5, 0.0]]]), np.full((2, 2), 0.7)),
        (np.array([[[2.0, 1.0, 4.0]], [[0.5, 3.0, -1.0]]]), np.zeros((2, 0))),
    ),
    points=3,
    properties=(
        Property(
            "the bound is at most what the cheapest classes cost, pairs of the rows included",
            lambda given, bound: bool(bound <= answers.energy_of_cheapest_classes(*given) + 1e-9),
        ),
        Property(
            "the bound is at least the sum of the pixels' cheapest costs",
            lambda given, bound: bool(bound >= answers.switching_for_free(*given) - 1e-9),
        ),
    ),
    misconceptions=(
        Misconception(
            "the energy of one labelling",
            answers.energy_of_cheapest_classes,
            "That is what one labelling costs; a bound needs the least over all labellings of a row.",
        ),
        Misconception(
            "a walk that never looks back",
            answers.never_looking_back,
            "Keep one number for each class of the last pixel, and choose only at the end of the row.",
        ),
        Misconception(
            "switching for free",
            answers.switching_for_free,
            "A valid bound, but a weak one: the pairs of a row cost w_right where the label changes.",
        ),
        Misconception(
            "all rows end with one class",
            answers.rows_end_alike,
            "Each row chooses its own last class: first the minimum of each row, then the sum.",
        ),
        Misconception(
            "the weight of the next pair",
            answers.next_pairs_weight,
            "Going from pixel u - 1 to pixel u, the pair stands at w_right[:, u - 1].",
        ),
        Misconception("the last pixel left out", answers.last_pixel_left_out, "Does your loop reach the last column?"),
    ),
    alternatives=(answers.bound_loops, answers.bound_enumerated, answers.bound_torch),
    forbidden=("labkit",),
)

QUESTIONS = (UNARY, WEIGHTS, ENERGY, ICM, CAPACITIES, BOUND)
