"""06_back_projection.fit_plane: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import LONG, array
from labcourse.questions.t06_back_projection import pose
from labgrader.question import Question, holds, wrong


def fit_plane(P, sigma):
    """Fit n . p = c by least squares of the distances along n, each divided by its point's sigma; n points up."""
    w = 1.0 / sigma**2
    centre = w @ P / w.sum()
    n = np.linalg.eigh((P - centre).T * w @ (P - centre))[1][:, 0]
    n = n * np.sign(n[2])
    return n, float(n @ centre)


def _points_near_a_plane(rng, many=None, least=0.02, most=0.06, size=1.0, reach=0.0):
    """Draw points of a slanted plane, longer than wide, half of them noisier than the others, by default three times.

    The normal as np.linalg.eigh gives it points down in most draws.
    """
    N, any_sign = many or int(rng.integers(30, 40)), rng.random() < 0.3
    sigma = np.where(rng.random(N) < 0.5, least, most) * rng.uniform(0.8, 1.2, N)
    local = size * rng.uniform(-0.5, 0.5, (N, 3)) * (1.0, 0.4, 0.0) + sigma[:, None] * rng.normal(size=(N, 3))
    while True:
        T = pose(rng)
        P = local @ T[:3, :3].T + T[:3, 3] + rng.uniform(-reach, reach, 3)
        points_down = np.linalg.eigh(np.cov(P.T, aweights=sigma**-2.0))[1][2, 0] < 0.0
        if 0.3 < abs(T[2, 2]) < 0.9 and (any_sign or points_down):
            return P, sigma


QUESTION = Question(
    reference=fit_plane,
    kinds={
        "P": array("N 3", -10.0, 10.0, lengths={"N": (3, None)}, says=("-10 to 10", "at least three")),
        "sigma": array("N", 1e-4, 1.0, lengths={"N": (3, None)}, says="1e-4 to 1"),
    },
    inputs=(
        _points_near_a_plane,
        partial(_points_near_a_plane, many=LONG, least=2e-4, most=0.6, size=4.0, reach=6.0),
        partial(_points_near_a_plane, many=6, least=0.05, most=0.7, size=7.0, reach=4.0),
    ),
    by_hand=(
        (np.array([[0.0, 0, 2], [1, 0, 2], [0, 3, 2], [1, 3, 2]]), np.ones(4)),  # level, at height 2
        (np.array([[0.0, 0, 1], [1, 0, 0], [0, 5, 1], [1, 5, 0]]), np.ones(4)),  # 45 degrees: x + z = 1
        (np.array([[0.0, 0, 0], [4, 0, 0], [0, 3, 0], [4, 3, 0.1]]), np.array([0.01, 0.01, 0.01, 1.0])),
        (np.array([[0.0, 0, 1], [2, 0, 1], [0, 3, 2]]), np.array([0.0001, 0.3, 1.0])),  # z = 1 + y / 3, whatever sigma
        # twisted
        (np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 4e-4]]), np.array([1e-4, 2e-4, 2e-4, 2e-4])),
        (
            np.array([[-9.5, 6.5, 0], [-5.5, 6.5, 0], [-9.5, 9.5, 0], [-5.5, 9.5, -2]]),
            np.array([0.9803, 0.4, 0.4, 0.4]),
        ),
    ),
    edges=3,
    random_cases=6,
    atol=1e-5,
    points=3,
    outputs=("normal", "distance"),
)


@holds("n has length 1")
def n_has_length_1(P, sigma, plane):
    return np.isclose(np.linalg.norm(plane[0]), 1.0, atol=1e-3)


@holds("the plane goes through the weighted mean m of the points, n . m = c")
def goes_through_the_mean(P, sigma, plane):
    return np.isclose(plane[0] @ np.average(P, axis=0, weights=sigma**-2.0), plane[1], atol=1e-3)


# ---------------------------------------------------------------------------------------------------- wrong answers


def up(n, centre):
    """A plane through centre; a normal that is level stays as it is."""
    n = -n if n[2] < 0.0 else n
    return n, float(n @ centre)


def centre_and_axes(P, sigma):
    """The weighted centre, and the axes of the weighted scatter round it as columns, the shortest first."""
    w = 1.0 / sigma**2
    centre = w @ P / w.sum()
    return centre, np.linalg.eigh((P - centre).T * w @ (P - centre))[1]


@wrong("You measure errors along z. Tilt the plane: the distance of a point is measured along the normal.")
def along_z(P, sigma):
    A = np.column_stack([P[:, :2], np.ones(len(P))]) / sigma[:, None]
    a, b, c = np.linalg.lstsq(A, P[:, 2] / sigma, rcond=None)[0]
    length = np.sqrt(a * a + b * b + 1.0)
    return np.array([-a, -b, 1.0]) / length, float(c / length)


@wrong("In which direction do points of a plane scatter least, and in which most?")
def largest_spread(P, sigma):
    centre, axes = centre_and_axes(P, sigma)
    return up(axes[:, 2], centre)


@wrong("An eigenvector's sign is arbitrary: where n points down, turn n up, and c with it.")
def not_turned_up(P, sigma):
    centre, axes = centre_and_axes(P, sigma)
    return axes[:, 0], float(axes[:, 0] @ centre)


@wrong("A plane need not contain the origin: from which point are the directions measured?")
def through_the_origin(P, sigma):
    return up(np.linalg.svd(P / sigma[:, None], full_matrices=False)[2][2], np.zeros(3))


@wrong("The best plane passes through a mean of the points: do all points count alike in it?")
def centre_without_weights(P, sigma):
    centre = P.mean(axis=0)
    return up(np.linalg.svd((P - centre) / sigma[:, None], full_matrices=False)[2][2], centre)


@wrong("A point with a larger sigma is less certain and must count less; in your answer it counts more.")
def unsure_points_count_more(P, sigma):
    return fit_plane(P, sigma**-0.5)


@wrong("np.linalg.eigh gives the eigenvectors as the columns of its matrix: yours is a row.")
def row_of_the_eigenvectors(P, sigma):
    centre, axes = centre_and_axes(P, sigma)
    return up(axes[0], centre)


@wrong("c vanishes only if you subtract the mean m from the points before you look for n; then c = n . m.")
def not_centred(P, sigma):
    return up(np.linalg.eigh(P.T / sigma**2 @ P)[1][:, 0], np.average(P, axis=0, weights=sigma**-2.0))


@wrong("You divide by sigma squared twice: in A one of the two factors has the weight, not both.")
def weights_in_both_factors(P, sigma):
    centred = (P - np.average(P, axis=0, weights=sigma**-2.0)) / sigma[:, None] ** 2
    return up(np.linalg.eigh(centred.T @ centred)[1][:, 0], np.average(P, axis=0, weights=sigma**-2.0))


@wrong("Turn n up before you compute n . m = c: yours still has the sign of the other normal.")
def c_before_the_turn(P, sigma):
    n, c = not_turned_up(P, sigma)
    return up(n, P[0])[0], c


@wrong("In which direction do points of a plane scatter least, and in which most?")
def largest_spread_by_its_sign(P, sigma):
    """A level direction, whose z is 0, becomes no direction at all."""
    centre, axes = centre_and_axes(P, sigma)
    n = axes[:, 2] * np.sign(axes[2, 2])
    return n, float(n @ centre)


@wrong("np.linalg.svd returns V transposed, so the directions are its rows: yours is a column.")
def column_of_the_transposed_directions(P, sigma):
    centre, _ = centre_and_axes(P, sigma)
    return up(np.linalg.svd((P - centre) / sigma[:, None], full_matrices=False)[2][:, 2], centre)


@wrong("np.linalg.eig promises no order: is your first axis always the one of least spread?")
def first_axis_of_eig(P, sigma):
    centre, w = np.average(P, axis=0, weights=sigma**-2.0), 1.0 / sigma**2
    return up(np.linalg.eig((P - centre).T * w @ (P - centre))[1][:, 0], centre)


@wrong(
    "The weights are in your mean: are they also in the squares that the plane minimises?",
    around=("it", "the plain one"),
)
def scatter_without_weights(P, sigma, around):
    centre = np.average(P, axis=0, weights=sigma**-2.0)
    off = P - (centre if around == "it" else P.mean(axis=0))
    return up(np.linalg.eigh(off.T @ off)[1][:, 0], centre)
