"""Units of raw depth, and depth of another size: by enumeration, and by surfaces that are known."""

import numpy as np
import pytest

from labkit.geometry import back_project
from labkit.geometry.depth_units import metres_per_unit, readings, resize_depth, resized_K


def table(metres: float, unit: float, dtype) -> np.ndarray:
    raw = np.full((6, 8), metres / unit)
    raw[0] = 0.0
    return raw.astype(dtype)


@pytest.mark.parametrize("metres", [0.2, 0.5, 0.9, 2.0])
def test_what_nobody_states_is_taken_only_where_it_is_likely(metres):
    assert metres_per_unit(table(metres, 0.001, np.uint16))[0] == 0.001
    assert metres_per_unit(table(metres, 1.0, np.float32)) == (1.0, "")
    unit, said = metres_per_unit(table(metres, 0.001, np.float64))
    assert unit == 0.001 and "floats are taken for millimetres" in said
    if metres >= 0.5:
        with pytest.raises(ValueError, match=r"^depth_scale: .* 0.0001 makes it .*; --depth-scale says how many"):
            metres_per_unit(table(metres, 0.0001, np.uint16))


@pytest.mark.bad_input
def test_the_user_comes_first_then_the_file():
    raw = table(0.8, 0.0001, np.uint16)
    assert metres_per_unit(raw, given=0.0001, stated=1.0) == (0.0001, "")
    for stated in (0.0001, 0.1, 10_000.0):
        assert metres_per_unit(raw, stated=stated)[0] == pytest.approx(0.0001)
    for wrong in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match=r"^depth_scale: expected metres per unit"):
            metres_per_unit(raw, given=wrong)
        with pytest.raises(ValueError, match=r"^depth_scale: expected a number above 0 in the camera's file"):
            metres_per_unit(raw, stated=wrong)
    with pytest.raises(ValueError, match=r"^depth_scale: .* got 3e-07; with 3e-07 metres per unit the median"):
        metres_per_unit(raw, stated=3e-7)
    with pytest.raises(ValueError, match=r"^depth: expected readings"):
        metres_per_unit(np.zeros((3, 4), np.uint16))
    with pytest.raises(ValueError, match=r"^depth: expected numbers of 0 or more, got a minimum of -0.8"):
        readings(np.full((2, 2), -0.8))


def test_no_pixel_of_a_resized_depth_lies_between_two_surfaces():
    """Two planes with a jump of 5 cm between them, larger and smaller; a hole stays one."""
    K = np.array([[210.0, 0.0, 127.5], [0.0, 210.0, 95.5], [0.0, 0.0, 1.0]])
    v, u = np.indices((192, 256))
    near, far = (-d / ((v - K[1, 2]) / K[1, 1] * np.sin(0.5) - np.cos(0.5)) for d in (0.70, 0.75))
    left = u + 0.3 * v < 130
    depth = np.where(left, near, far).astype(np.float32)
    depth[50:60, 20:30] = 0.0
    for size in ((640, 480), (1920, 1440), (300, 225), (100, 75)):
        out, K_out = resize_depth(depth, size), resized_K(K, (256, 192), size)
        normal = np.array([0.0, -np.sin(0.5), np.cos(0.5)])
        heights = back_project(out, K_out) @ normal
        known = out > 0.0
        off = np.minimum(np.abs(heights - 0.70), np.abs(heights - 0.75))[known]
        assert off.max() < 0.006, "half a pixel of the slope where the nearest alone counts"
        assert np.median(off) < 1e-5 and 0.99 < known.mean() < 1.0
        assert out.shape == size[::-1] and out.dtype == np.float32
    assert np.array_equal(resize_depth(depth, (256, 192)), depth)


@pytest.mark.parametrize("size", [(640, 480), (100, 75), (257, 193)])
def test_a_resized_K_sees_the_pictures_corners_along_the_same_rays(size):
    K = np.array([[210.0, 0.4, 120.0], [0.0, 211.0, 90.0], [0.0, 0.0, 1.0]])
    ours = resized_K(K, (256, 192), size)
    for corner, other in (((-0.5, -0.5), (-0.5, -0.5)), ((255.5, 191.5), (size[0] - 0.5, size[1] - 0.5))):
        assert np.allclose(np.linalg.solve(K, (*corner, 1.0)), np.linalg.solve(ours, (*other, 1.0)))
