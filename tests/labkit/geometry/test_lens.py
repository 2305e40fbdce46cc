"""Lenses against librealsense's published formulas, typed anew here pixel by pixel, and against OpenCV."""

import cv2
import numpy as np
import pytest

from labkit.geometry.lens import COUNTS, Lens, rectified

K = np.array([[385.0, 0.0, 318.0], [0.0, 384.0, 242.0], [0.0, 0.0, 1.0]])
D455 = (-0.0567, 0.0674, -0.0006, 0.0007, -0.0218)  # the size of a D455's colour camera
WIDE = (-0.2, 0.06, 0.002, -0.001, -0.005)


def deprojected(u: float, v: float, depth: float, c: tuple) -> tuple[float, float, float]:
    """librealsense: a pixel of a picture with inverse Brown-Conrady distortion, and its depth, to a point."""
    x, y = (u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1]
    r2 = x * x + y * y
    f = 1 + c[0] * r2 + c[1] * r2 * r2 + c[4] * r2 * r2 * r2
    ux = x * f + 2 * c[2] * x * y + c[3] * (r2 + 2 * x * x)
    uy = y * f + 2 * c[3] * x * y + c[2] * (r2 + 2 * y * y)
    return depth * ux, depth * uy, depth


def projected(point, c: tuple) -> tuple[float, float]:
    """librealsense: a point to a pixel of a picture with modified Brown-Conrady distortion."""
    x, y = point[0] / point[2], point[1] / point[2]
    r2 = x * x + y * y
    f = 1 + c[0] * r2 + c[1] * r2 * r2 + c[4] * r2 * r2 * r2
    x, y = x * f, y * f
    dx = x + 2 * c[2] * x * y + c[3] * (r2 + 2 * x * x)
    dy = y + 2 * c[3] * x * y + c[2] * (r2 + 2 * y * y)
    return dx * K[0, 0] + K[0, 2], dy * K[1, 1] + K[1, 2]


def normalised(uv: np.ndarray) -> np.ndarray:
    return (uv - K[:2, 2]) / np.array([K[0, 0], K[1, 1]])


@pytest.fixture
def pixels() -> np.ndarray:
    return np.random.default_rng(0).uniform((0.0, 0.0), (639.0, 479.0), (500, 2))


@pytest.mark.parametrize("coefficients", [D455, WIDE])
def test_an_inverse_lens_gives_the_points_of_librealsenses_deprojection(coefficients, pixels):
    rays = Lens(coefficients, "inverse_brown_conrady").to_rays(normalised(pixels))
    depths = np.linspace(0.3, 2.0, len(pixels))
    points = [deprojected(u, v, d, coefficients) for (u, v), d in zip(pixels, depths, strict=True)]
    assert np.allclose(np.column_stack([rays * depths[:, None], depths]), points, atol=1e-12)


@pytest.mark.parametrize("coefficients", [D455, WIDE])
def test_a_modified_lens_puts_points_where_librealsenses_projection_does(coefficients, pixels):
    rays = normalised(pixels)
    found = Lens(coefficients, "modified_brown_conrady").to_pixels(rays)
    expected = [projected((x, y, 1.0), coefficients) for x, y in rays]
    assert np.allclose(found * [K[0, 0], K[1, 1]] + K[:2, 2], expected, atol=1e-9)


def test_a_usual_lens_is_opencvs(pixels):
    rays = normalised(pixels)
    bent = cv2.undistortPoints(pixels[:, None], K, np.array(D455))[:, 0]  # five steps of its own iteration
    assert np.allclose(Lens(D455).to_rays(rays), bent, atol=1e-4)


@pytest.mark.parametrize("model", COUNTS)
@pytest.mark.parametrize("coefficients", [D455, WIDE])
def test_both_ways_undo_each_other(model, coefficients, pixels):
    lens, xy = Lens(coefficients, model), normalised(pixels)
    assert np.allclose(lens.to_pixels(lens.to_rays(xy)), xy, atol=1e-8)


@pytest.mark.parametrize("model", ["inverse_brown_conrady", "modified_brown_conrady", "brown_conrady"])
def test_a_straight_picture_has_at_each_pixel_what_its_ray_saw(model):
    """A scene painted by its rays: each pixel of the bent picture by the ray of the lens, of the straight one by K."""
    lens = Lens(D455, model)

    def painted(rays):
        return (127.0 + 60.0 * np.sin(9.0 * rays[:, 0]) + 60.0 * np.cos(7.0 * rays[:, 1])).reshape(480, 640)

    v, u = np.indices((480, 640)).reshape(2, -1)
    xy = normalised(np.column_stack([u, v]).astype(float))
    bent = painted(lens.to_rays(xy)).astype(np.float32)
    straight = rectified(bent, K, lens, smooth=True, outside=-1)
    assert np.isfinite(bent).all()
    seen = cv2.erode((straight >= 0.0).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0  # but for what mixes with none
    assert np.abs(straight - painted(xy))[seen].max() < 1.0 and seen.mean() > 0.9
    assert set(np.unique(rectified(bent, K, lens))) <= {*np.unique(bent), 0.0}, "nothing is mixed"


def test_a_ray_that_a_lens_does_not_show_has_no_pixel():
    """Beyond its turning point, a formula folds the picture over."""
    lens = Lens((-0.5, 0.0, 0.0, 0.0), "inverse_brown_conrady")  # x (1 - x^2 / 2) reaches no more than 0.544
    assert np.isnan(lens.to_pixels(np.array([[0.6, 0.0]]))).all()
    assert np.allclose(lens.to_pixels(np.array([[0.5, 0.0]])), [[0.618034, 0.0]], atol=1e-5)  # x - x^3 / 2 = 1 / 2


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (((0.1, 0.2),), "coefficients: expected 4, 5, 8, 12, 14 numbers"),
        (((0.1,) * 8, "inverse_brown_conrady"), "coefficients: expected 4, 5 numbers"),
        (((0.1,) * 4, "fisheye"), "model: expected one of brown_conrady"),
        (((np.nan,) * 4,), "coefficients: expected finite"),
    ],
)
def test_other_lenses_are_refused(arguments, says):
    with pytest.raises(ValueError, match=f"^{says}"):
        Lens(*arguments)
