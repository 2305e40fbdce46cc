"""What explorers refuse, in one table."""

import numpy as np
import pytest

from labcourse.explorers import back_projection, class_weights, gradient, parallax
from labkit.frame import RGBDFrame

RGB, Y = np.zeros((6, 8, 3), np.uint8), np.zeros((6, 8), np.uint8)
BARE = RGBDFrame(RGB, np.ones((6, 8), np.float32), np.diag([9.0, 9.0, 1.0]), np.eye(4))
REFUSED = [  # call, the argument that the error names, what was expected and what came
    (lambda: back_projection.bent_cloud(BARE, ["typo"]), "bugs", "expected some of swapped"),
    (lambda: back_projection.bent_cloud(BARE), "frame", "expected a frame with labels"),
    (
        lambda: parallax.cost_over_height(BARE, BARE, (1, 3), np.zeros(1)),
        "pixel",
        r"expected \(u, v\) at least 4 pixels",
    ),
    (lambda: class_weights.trained_masks({}), "frames", "expected at least one"),
    (lambda: class_weights.trained_masks({"x": (BARE, Y)}), "frames", "expected frames with labels, got 'x' without"),
    (lambda: gradient.keyhole(RGB, Y, at=(8, 0), widths=(5,)), "at", r"expected \(u, v\) in an image of 8x6"),
    (lambda: gradient.keyhole(RGB, Y[:-1], at=(1, 0), widths=(5,)), "y", "expected"),
]


@pytest.mark.bad_input
@pytest.mark.parametrize(("call", "name", "says"), REFUSED)
def test_what_does_not_fit_is_named(call, name, says):
    with pytest.raises(ValueError, match=f"^{name}: {says}"):
        call()
