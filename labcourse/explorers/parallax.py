"""The explorer of topic 06, parallax: a height is tried, and where it is right two photographs agree."""

import cv2
import ipywidgets
import numpy as np
from jaxtyping import Float, Float32
from matplotlib.figure import Figure

from labcourse.explorers.explorer import Explorer, show
from labkit.frame import RGBDFrame
from labkit.geometry.projection import invert_transform, pixel_rays, project, transform_points
from labkit.sim.spec import Camera, Furniture, SceneSpec, Table, Texture
from labkit.sim.world import World
from labkit.support.validation import require

PRINTED, PLAIN = 0.06, 0.09  # metres over the table: the tops of the two boxes
WINDOW = 9  # pixels of a side of the window that is compared
SHOWN = 60.0  # grey levels of difference that are drawn as white


def two_photographs(size: tuple[int, int] = (320, 240)) -> tuple[RGBDFrame, RGBDFrame]:
    """Photograph a table (z = 0) with a printed box and a plain white one from two places, 10 degrees apart.

    The frames hold true depths and poses.
    """
    wood = Texture("wood", (0.55, 0.42, 0.28), (0.42, 0.3, 0.2), scale=14.0, seed=1)
    print_ = Texture("speckle", (0.75, 0.3, 0.2), (0.95, 0.85, 0.5), scale=9.0, seed=4)
    white = Texture("plain", (0.93, 0.93, 0.92))
    boxes = (
        Furniture((0.10, 0.14, PRINTED), (0.50, -0.09, PRINTED / 2.0), print_, yaw=0.4),
        Furniture((0.09, 0.12, PLAIN), (0.52, 0.11, PLAIN / 2.0), white, yaw=-0.3),
    )
    places = [Camera.looking_at((0.5, 0.0, 0.02), 0.55, np.radians(a), np.radians(50), fov_y=0.8) for a in (0, 10)]
    spec = SceneSpec((), places[0], table=Table(texture=wood), furniture=boxes, robot=False)
    with World(spec) as world:
        first, other = (world.render(size, camera, smooth=True) for camera in places)
    return first, other


def painted_by(first: RGBDFrame, other: RGBDFrame, height: float) -> Float32[np.ndarray, "H W"]:
    """What the other photograph shows where the first one's pixels lie, if all of them lie on the plane z = height.

    Grey levels, 0 to 255; NaN where the other photograph does not reach, or the pixel's ray never meets the plane.
    height: metres, base frame. Colours and poses are looked at, depths never.

    >>> rgb = np.arange(12, dtype=np.uint8).reshape(3, 4, 1).repeat(3, axis=2)
    >>> down = np.diag([1.0, -1.0, -1.0, 1.0])
    >>> down[2, 3] = 2.0
    >>> moved = down.copy()
    >>> moved[0, 3] = 1.0
    >>> K = np.array([[2.0, 0.0, 1.0], [0.0, 2.0, 1.0], [0.0, 0.0, 1.0]])
    >>> frames = [RGBDFrame(rgb, np.ones((3, 4), np.float32), K, T) for T in (down, moved)]
    >>> painted_by(*frames, 0.0)[0].tolist()  # f b / z = 2 x 1 / 2: one pixel to the left
    [nan, 0.0, 1.0, 2.0]
    """
    camera = first.T_base_cam
    rays = pixel_rays(first.depth.shape, first.K) @ camera[:3, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (height - camera[2, 3]) / rays[..., 2:]
    P = camera[:3, 3] + np.where(far > 0.0, far, np.nan) * rays
    u, v = project(transform_points(invert_transform(other.T_base_cam), P), other.K)
    rows, columns = other.depth.shape
    inside = (u >= 0) & (u <= columns - 1) & (v >= 0) & (v <= rows - 1)
    maps = [np.where(inside, places, 0.0).astype(np.float32) for places in (u, v)]
    return np.where(inside, cv2.remap(grey(other), *maps, cv2.INTER_LINEAR), np.nan).astype(np.float32)


def grey(frame: RGBDFrame) -> Float32[np.ndarray, "H W"]:
    """A frame's colours as grey levels, 0 to 255."""
    return cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2GRAY).astype(np.float32)


def cost_image(first: RGBDFrame, other: RGBDFrame, height: float) -> Float32[np.ndarray, "H W"]:
    """How much two photographs differ around each pixel of the first one, if it lies at a height (m, base frame).

    The mean absolute difference of grey levels in a window of 9 x 9 pixels; NaN where the other one
    does not show all of it.
    """
    off = np.abs(painted_by(first, other, height) - grey(first))
    cost = cv2.boxFilter(np.nan_to_num(off), -1, (WINDOW, WINDOW))
    return np.where(cv2.dilate(np.isnan(off).astype(np.uint8), np.ones((WINDOW, WINDOW))) > 0, np.float32("nan"), cost)


def cost_over_height(
    first: RGBDFrame, other: RGBDFrame, pixel: tuple[int, int], heights: Float[np.ndarray, "N"]
) -> Float[np.ndarray, "N"]:
    """The cost of `cost_image` at one pixel (u, v), for each height that is tried.

    Raises ValueError for a pixel whose window is not in the picture.
    """
    (u, v), (rows, columns), half = pixel, first.depth.shape, WINDOW // 2
    fits = half <= u < columns - half and half <= v < rows - half
    require("pixel", fits, f"(u, v) at least {half} pixels inside a picture of {columns}x{rows}", pixel)
    return np.array([cost_image(first, other, height)[v, u] for height in heights], np.float64)


def try_a_height(first: RGBDFrame, other: RGBDFrame, table_z: float) -> Explorer:
    """Try one height over the table for all pixels at once, and look where two photographs then agree.

    table_z: the table's height in the base frame, metres. Control: height over the table in millimetres. Left the first
    photograph, in the middle what the other one paints, right their difference, black where they agree.
    """
    own = grey(first)

    def draw(figure: Figure, height: int) -> None:
        painted = painted_by(first, other, table_z + height / 1000.0)
        left, middle, right = figure.subplots(1, 3)
        show(left, own, "the first photograph")
        show(middle, painted, f"the other, painted at {height} mm")
        difference = np.abs(cv2.boxFilter(np.nan_to_num(painted - own, nan=SHOWN), -1, (3, 3)))
        show(right, difference, f"difference, white: {SHOWN:.0f} and more")
        for axes, most in ((left, 255.0), (middle, 255.0), (right, SHOWN)):
            axes.images[0].set(cmap="gray", clim=(0.0, most))

    control = ipywidgets.IntSlider(0, min=-20, max=160, step=5, description="height (mm)")
    return Explorer(
        draw, {"height": control}, size=(9.0, 2.7), dpi=72, stills=({"height": 0}, {"height": 60}, {"height": 90})
    )
