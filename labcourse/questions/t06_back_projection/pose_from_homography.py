"""06_back_projection.pose_from_homography: the question, and wrong answers with the hints that they earn."""

from functools import partial

import numpy as np

from labcourse.kinds import array, intrinsics
from labcourse.questions.t06_back_projection import K_SMALL, K_of
from labgrader.question import Question, holds, wrong


def pose_from_homography(H, K):
    """The camera's pose on a sheet, T_sheet_cam, from a homography: K^-1 H = s [r1 r2 t], with any sign of s."""
    A = np.linalg.solve(K, H)
    s = np.linalg.norm(A[:, :2], axis=0).mean() * np.sign(A[2, 2])
    U, _, Vt = np.linalg.svd(A[:, :2] / s, full_matrices=False)
    r1, r2 = (U @ Vt).T
    R = np.stack([r1, r2, np.cross(r1, r2)])
    return np.block([[R, -R @ A[:, 2:] / s], [np.zeros(3), 1.0]])


def _columns(rng, longer=0.05, askew=0.05):
    """Draw [r1 r2 t] of a camera that looks at the sheet from above, r1 and r2 a little off in length and angle."""
    while True:
        z = rng.normal(size=3)
        r2, t = rng.normal(size=3), rng.uniform((-0.3, -0.3, 0.3), (0.3, 0.3, 2.0))
        z /= np.linalg.norm(z)
        r1 = np.cross(r2, z) / np.linalg.norm(np.cross(r2, z))
        if z @ t < -0.2 and abs(z[2]) < 0.95:
            break
    r2 = np.cross(z, r1)
    spoil = np.eye(2) + rng.uniform(-1.0, 1.0, (2, 2)) * [[longer, askew], [askew, longer]]
    return np.column_stack([np.column_stack([r1, r2]) @ spoil, t])


def _homography(rng, K=None, sign=1.0, largest=None):
    """Draw a homography of a sheet, times any number: its largest entry is `largest` in size."""
    H = (intrinsics().draw(rng) if K is None else K) @ _columns(rng)
    largest = 10.0 ** rng.uniform(-2.0, 6.0) if largest is None else largest
    return sign * largest / np.abs(H).max() * H


def _sheet(rng, sign, largest=None):
    K = intrinsics().draw(rng)
    return _homography(rng, K, sign, largest), K


STRAIGHT_DOWN = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 2.0]])
TURNED = np.array([[0.0, 1.0, 0.5], [1.0, 0.0, -0.25], [0.0, 0.0, 1.0]])
SLANTED = np.array([[1.0, 0.0, 0.1], [0.0, -0.8, 0.2], [0.0, -0.6, 1.5]])
FROM_THE_LEFT = np.array([[0.8, 0.0, 0.25], [0.0, -1.0, 0.5], [0.6, 0.0, 1.0]])
K_OF_WIDTHS = K_of(0.8125, 1.0625, 0.5, 0.375)  # pixels as large as the picture is wide
ASKEW = np.array([[1.0, 0.05, 0.0], [-0.05, -1.0, 0.0], [0.0, 0.0, 2.0]])

QUESTION = Question(
    reference=pose_from_homography,
    kinds={
        "H": array(
            "3 3",
            -1e6,
            1e6,
            form=lambda rng, _: _homography(rng, sign=rng.choice([-1.0, 1.0])),
            says=("any number but 0", "-1e6 to 1e6", "up to a tenth", "80 to 100 degrees"),
        ),
        "K": intrinsics(),
    },
    inputs=(
        partial(_sheet, sign=1.0),
        partial(_sheet, sign=-1.0),
        partial(_sheet, sign=-1.0, largest=0.01),
        partial(_sheet, sign=1.0, largest=9e5),
    ),
    by_hand=(
        (K_SMALL @ STRAIGHT_DOWN, K_SMALL),  # 2 m over the origin
        (K_SMALL @ TURNED, K_SMALL),  # a quarter turn, beside the origin
        (-0.5 * K_SMALL @ STRAIGHT_DOWN, K_SMALL),  # the same homography as the first
        (K_of(500.0, 400.0, 320.0, 200.0) @ SLANTED, K_of(500.0, 400.0, 320.0, 200.0)),  # 3-4-5: looks from the side
        (K_SMALL @ (STRAIGHT_DOWN * [1.04, 0.96, 1.0]), K_SMALL),  # unequally long: their mean is 1
        (K_SMALL @ ASKEW, K_SMALL),  # each is turned by 3 degrees towards the other: the closest pair is in the middle
        (K_OF_WIDTHS @ FROM_THE_LEFT, K_OF_WIDTHS),
        (-2.5e5 * K_SMALL @ STRAIGHT_DOWN, K_SMALL),  # the first twice more
        (2.5e5 * K_SMALL @ STRAIGHT_DOWN, K_SMALL),
    ),
    edges=3,
    random_cases=8,
    points=3,
)


@holds("the matrix is rigid: R^T R = I, det R = 1, and its last row is 0, 0, 0, 1")
def is_rigid(H, K, T):
    R = T[:3, :3]
    return np.allclose(R.T @ R, np.eye(3), atol=1e-3) and np.linalg.det(R) > 0 and np.allclose(T[3], [0, 0, 0, 1])


@holds("the camera is above the sheet: its z in the sheet's frame is positive")
def is_above(H, K, T):
    return T[2, 3] > 0.0


# ---------------------------------------------------------------------------------------------------- wrong answers


def scaled(H, K, sign=True):
    """K^-1 H, divided by the mean length of its first two columns, with the sign that puts the sheet in front."""
    A = np.linalg.solve(K, H)
    s = np.linalg.norm(A[:, :2], axis=0).mean()
    return A / (s * np.sign(A[2, 2]) if sign else s)


def closest(A):
    """The two orthonormal columns that come closest to the first two of A."""
    U, _, Vt = np.linalg.svd(A[:, :2], full_matrices=False)
    return (U @ Vt).T


def pose(R, t):
    """T_sheet_cam of a sheet's axes, as columns, and its origin in the camera's frame."""
    return np.block([[R.T, (-R.T @ t)[:, None]], [np.zeros(3), 1.0]])


def of_columns(r1, r2, t):
    return pose(np.column_stack([r1, r2, np.cross(r1, r2)]), t)


@wrong("H and -H are the same homography. Where is the camera with yours, over the table or under it?")
def sign_left(H, K):
    A = scaled(H, K, sign=False)
    return of_columns(*closest(A), A[:, 2])


@wrong("That is T_cam_sheet, which maps the sheet into the camera. Asked for is where the camera is: what undoes it?")
def not_inverted(H, K):
    A = scaled(H, K)
    r1, r2 = closest(A)
    return np.block([[np.column_stack([r1, r2, np.cross(r1, r2)]), A[:, 2:]], [np.zeros(3), 1.0]])


@wrong("The position is that of the sheet in the camera's frame: which point does the inverse pose take to the origin?")
def position_of_the_sheet(H, K):
    A = scaled(H, K)
    T = of_columns(*closest(A), A[:, 2])
    T[:3, 3] = A[:, 2]
    return T


@wrong("A homography has no scale: H and 2 H are the same, and your camera is twice as far away with one of them.")
def scale_left(H, K):
    A = np.linalg.solve(K, H)
    return of_columns(*closest(A * np.sign(A[2, 2])), A[:, 2] * np.sign(A[2, 2]))


@wrong("What is H made of? K takes a direction to its pixel: undo it first.")
def K_left(H, K):
    A = scaled(H, np.eye(3))
    return of_columns(*closest(A), A[:, 2])


@wrong("Your axes are left-handed: the third is the first cross the second, x to y to z.")
def left_handed(H, K):
    A = scaled(H, K)
    r1, r2 = closest(A)
    return pose(np.column_stack([r1, r2, np.cross(r2, r1)]), A[:, 2])


@wrong("Measured columns are not quite at right angles, nor of length 1: is your R a rotation?")
def columns_as_they_are(H, K):
    A = scaled(H, K)
    return of_columns(A[:, 0], A[:, 1], A[:, 2])


@wrong("You leave the first column as it is and bend the second alone. Closest to both is U V^T.")
def first_column_kept(H, K):
    A = scaled(H, K)
    r1 = A[:, 0] / np.linalg.norm(A[:, 0])
    z = np.cross(r1, A[:, 1])
    z /= np.linalg.norm(z)
    return of_columns(r1, np.cross(z, r1), A[:, 2])


@wrong("Both columns have the same factor. You divide by the length of one of them: which length does the task name?")
def length_of_the_first(H, K):
    A = np.linalg.solve(K, H)
    A /= np.linalg.norm(A[:, 0]) * np.sign(A[2, 2])
    return of_columns(*closest(A), A[:, 2])


@wrong("The third column of H is no axis: the sheet is flat, so H knows its x, its y, and where its origin is.")
def third_column_as_an_axis(H, K):
    A = scaled(H, K)
    U, _, Vt = np.linalg.svd(A)
    return pose(U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt, A[:, 2])


@wrong("The last column of an inverse pose is -R^T t: yours has the other sign.")
def position_with_the_other_sign(H, K):
    A = scaled(H, K)
    T = of_columns(*closest(A), A[:, 2])
    T[:3, 3] *= -1.0
    return T
