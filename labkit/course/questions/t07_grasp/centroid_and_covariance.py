"""07_grasp.centroid_and_covariance: the question, and wrong answers with the hints that they earn."""

import numpy as np

from labkit.course.questions.question import Property, Question, wrong
from labkit.course.questions.t07_grasp import RECTANGLE, cloud


def centroid_and_covariance(P):
    """Compute the mean of the points and their covariance with 1/N."""
    mu = P.mean(axis=0)
    centred = P - mu
    return mu, centred.T @ centred / len(P)


_TWO_POINTS = np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0]])


QUESTION = Question(
    name="07_grasp.centroid_and_covariance",
    reference=centroid_and_covariance,
    inputs=lambda rng: (cloud(rng),),
    by_hand=((_TWO_POINTS,), (RECTANGLE,), (RECTANGLE[:1],)),
    atol=1e-8,
    points=2,
    properties=(
        Property("the covariance is symmetric", lambda arguments, out: np.allclose(out[1], out[1].T, atol=1e-9)),
        Property(
            "a cloud that is moved has the same covariance; its trace is the mean squared distance from the centroid",
            lambda arguments, out: np.isclose(
                np.trace(out[1]), ((arguments[0] - out[0]) ** 2).sum(axis=1).mean(), rtol=1e-4
            ),
        ),
    ),
    forbidden=("sklearn", "scipy"),
)

# ---------------------------------------------------------------------------------------------------- wrong answers


@wrong(
    QUESTION, "Your axes are right, your variances a little too large: which of 1/N and 1/(N - 1) does the text state?"
)
def covariance_of_a_sample(P):
    return P.mean(axis=0), np.cov(P, rowvar=False)


@wrong(QUESTION, "A covariance with a row for each point? np.cov takes rows as variables unless told otherwise.")
def covariance_of_columns_as_samples(P):
    return P.mean(axis=0), np.cov(P, bias=True)


@wrong(QUESTION, "Move the cloud by a metre: the spread must stay as it is. What should be subtracted first?")
def not_centred(P):
    return P.mean(axis=0), P.T @ P / len(P)


@wrong(QUESTION, "List every point twice: the shape is the same, but your covariance doubles.")
def not_divided(P):
    centred = P - P.mean(axis=0)
    return P.mean(axis=0), centred.T @ centred


@wrong(QUESTION, "Off the diagonal stands how x, y and z vary together; without it no object is ever turned.")
def spreads_alone(P):
    return P.mean(axis=0), np.diag(P.var(axis=0))


@wrong(QUESTION, "The centroid is the mean; yours is the median, which another cloud of the same mean moves.")
def median_for_mean(P):
    centred = P - np.median(P, axis=0)
    return np.median(P, axis=0), centred.T @ centred / len(P)


@wrong(QUESTION, "The three coordinates of your centroid are equal: over which axis does the mean run?")
def one_mean_for_all(P):
    centred = P - P.mean()
    return np.full(3, P.mean()), centred.T @ centred / len(P)
