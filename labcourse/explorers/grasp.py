"""Explorers of topic 07: the jaws at any yaw, the visible centroid from any height of the camera, and friction cones.

Besides the explorers: jaws seen from above, a lift as a row of pictures, and a can that is gripped beside its middle.
"""

from functools import lru_cache
from itertools import count

import ipywidgets
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle

from labcourse.explorers.explorer import Explorer
from labcourse.views import fingers
from labkit.geometry import masked_cloud_to_base
from labkit.grasp import Grasp, Gripper
from labkit.labels import PALETTE, TARGET
from labkit.sim.spec import Camera, ObjectSpec, Part, SceneSpec

ORANGE = tuple((PALETTE[TARGET] / 255).tolist())
AIR = 0.02  # metres between the pads beyond what stands there, both sides together
ELEVATIONS = tuple(range(10, 90, 5))  # degrees over the table
RADIUS = 0.03  # of the ball, metres
THINGS = {
    "ball": ((Part("sphere", (RADIUS,)),), RADIUS),
    "block": ((Part("box", (0.03, 0.07, 0.04)),), 0.02),
    "can": ((Part("cylinder", (0.025, 0.09)),), 0.045),
}
CAN_RADIUS, CAN_HEIGHT = 0.025, 0.08  # of the can that is gripped beside its middle, metres


def draw_jaws(axes: Axes, T_base_grasp: Float[np.ndarray, "4 4"], width: float, **style) -> None:
    """Draw the two fingertips of a grasp from above, in the base frame's x and y; `style` goes to the patches."""
    for corners in fingers(T_base_grasp, width, Gripper()):
        axes.add_patch(Polygon(corners[[0, 1, 3, 2], :2], **({"facecolor": "tab:blue", "alpha": 0.85} | style)))


def film(world, camera: Camera, seconds: float = 0.4, size: tuple[int, int] = (240, 180)) -> list[np.ndarray]:
    """Take a picture of a World every so many simulated seconds from now on; the list that they go to, RGB.

    >>> from labkit.sim.world import World
    >>> camera = Camera.looking_at((0.5, 0.0, 0.0), 1.0, 0.3, 0.8)
    >>> with World(SceneSpec((), camera, robot=False)) as world:
    ...     pictures = film(world, camera, seconds=0.1, size=(8, 6))
    ...     world.step(50)
    >>> len(pictures), pictures[0].shape
    (2, (6, 8, 3))
    """
    pictures, steps = [], count(1)

    def look(world) -> None:
        if next(steps) % round(240 * seconds) == 0:
            pictures.append(world.render(size, camera).rgb)

    world.observers.append(look)
    return pictures


def widths(P: Float[np.ndarray, "N 3"], yaws: Float[np.ndarray, "Y"]) -> Float[np.ndarray, "Y"]:
    """How wide a cloud is, seen from above, in each of the directions at angles `yaws` from x; metres, radians.

    >>> widths(np.array([[0.0, 0.0, 0.0], [0.4, 0.3, 0.0]]), np.array([0.0, np.pi / 2])).round(6).tolist()
    [0.4, 0.3]
    """
    return np.ptp(P[:, :2] @ np.stack([np.cos(yaws), np.sin(yaws)]), axis=0)


def jaws_at_a_yaw(P: Float[np.ndarray, "N 3"]) -> Explorer:
    """Turn the jaws over a cloud (base frame) and see how far they must open. Control: yaw, degrees from the base's x.

    The jaws are drawn red where the gripper cannot open that far.
    """
    limit = Gripper().max_opening
    degrees = np.arange(0, 181)
    curve = widths(P, np.radians(degrees.astype(float)))

    def draw(figure: Figure, yaw: int) -> None:
        above, opening = figure.subplots(1, 2, width_ratios=[1, 1.4])
        width, fits = curve[yaw] + AIR, curve[yaw] + AIR <= limit
        colour = "tab:blue" if fits else "tab:red"
        above.scatter(P[:, 0], P[:, 1], s=3, color=ORANGE, linewidths=0)
        draw_jaws(above, _frame_over(P, np.radians(yaw)), width, facecolor=colour)
        middle = (P[:, :2].min(axis=0) + P[:, :2].max(axis=0)) / 2
        above.set(xlim=middle[0] + np.array([-0.1, 0.1]), ylim=middle[1] + np.array([-0.1, 0.1]), aspect="equal")
        above.set(xlabel="x (m)", ylabel="y (m)", title="from above")
        above.locator_params(nbins=4)
        opening.plot(degrees, 1000 * (curve + AIR), color="0.4")
        opening.axhline(1000 * limit, color="tab:red", linestyle="--", linewidth=1, label="the gripper's limit")
        opening.plot(yaw, 1000 * width, "o", color=colour)
        opening.set(
            xlabel="yaw of the closing direction (degrees)", ylabel="opening (mm)", xlim=(0, 180), ylim=(0, None)
        )
        opening.set_title(f"yaw {yaw}: open {1000 * width:.0f} mm" + ("" if fits else ", more than it can"))
        opening.legend(loc="lower right", fontsize=8)

    slider = ipywidgets.IntSlider(20, min=0, max=180, step=2, description="yaw")
    return Explorer(draw, {"yaw": slider}, size=(8.0, 3.2))


def _frame_over(P, yaw: float) -> Float[np.ndarray, "4 4"]:
    """A grasp frame that closes at a yaw, its origin half way between the outermost points."""
    y = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    z = np.array([0.0, 0.0, -1.0])
    x = np.cross(y, z)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([x, y, z])
    along, across = P @ y, P @ x
    T[:3, 3] = (along.min() + along.max()) / 2 * y + (across.min() + across.max()) / 2 * x
    return T


@lru_cache(maxsize=4)
def views(thing: str) -> tuple[list[np.ndarray], np.ndarray]:
    """What one camera sees of a thing from each of ELEVATIONS: clouds (N, 3), and the thing's true centre (3,).

    thing: a name in THINGS; it stands alone on the table, the camera 0.6 m away on the side of the base's x axis.
    Base frame, metres.
    """
    from labkit.sim.world import World  # PyBullet stays out of this module's import

    parts, height = THINGS[thing]
    spec = ObjectSpec(thing, thing, TARGET, (0.5, 0.0, height), parts=parts)
    cameras = [Camera.looking_at((0.5, 0.0, height), 0.6, 0.0, np.radians(e), fov_y=0.35) for e in ELEVATIONS]
    with World(SceneSpec((spec,), cameras[0], robot=False)) as world:
        frames = [world.render((120, 90), camera) for camera in cameras]
        centre = world.centre(thing)
    return [masked_cloud_to_base(f.labels, f.depth, f.K, f.T_base_cam, TARGET) for f in frames], centre


def visible_centroid() -> Explorer:
    """Raise the camera and watch the centroid of what it sees leave the thing's middle. Controls: elevation, thing."""

    def draw(figure: Figure, elevation: int, thing: str) -> None:
        clouds, centre = views(thing)
        offsets = 1000 * np.array([cloud.mean(axis=0) - centre for cloud in clouds])
        now = ELEVATIONS.index(elevation)
        side, curve = figure.subplots(1, 2, width_ratios=[1, 1.3])
        x, _, z = (1000 * (clouds[now] - centre)).T
        side.scatter(x, z, s=3, color=ORANGE, linewidths=0, label="seen")
        side.plot(0, 0, "kx", ms=9, mew=2, label="middle of the thing")
        side.plot(offsets[now, 0], offsets[now, 2], "k+", ms=11, mew=2, label="visible centroid")
        ray = np.array([np.cos(np.radians(elevation)), np.sin(np.radians(elevation))])
        side.annotate("", 45 * ray, 75 * ray, arrowprops={"arrowstyle": "->", "color": "tab:blue"})
        side.text(*(78 * ray), "camera", color="tab:blue", ha="center", fontsize=8)
        side.axhline(-1000 * (centre[2]), color="0.6", linewidth=1)
        side.set(
            xlim=(-60, 95), ylim=(-55, 95), aspect="equal", xlabel="x (mm)", ylabel="z (mm)", title="from the side"
        )
        side.legend(fontsize=7, loc="upper left")
        lines = ((0, "sideways, to the camera", "tab:blue", "-"), (2, "upwards", "tab:green", "--"))
        for axis, name, colour, line in lines:
            curve.plot(ELEVATIONS, offsets[:, axis], line, color=colour, label=name)
            curve.plot(elevation, offsets[now, axis], "o", color=colour)
        curve.set(xlabel="elevation of the camera (degrees)", ylabel="visible centroid is off by (mm)", ylim=(-5, None))
        curve.set_title(f"{np.hypot(offsets[now, 0], offsets[now, 2]):.0f} mm off in all")
        curve.legend(fontsize=8)

    controls = {
        "elevation": ipywidgets.SelectionSlider(options=ELEVATIONS, value=30, description="elevation"),
        "thing": ipywidgets.Dropdown(options=list(THINGS), value="ball", description="thing"),
    }
    return Explorer(draw, controls, size=(8.5, 3.3))


def contact_angle(offset: float) -> float:
    """The angle between the closing direction and the can's normal where a pad meets it; radians.

    offset: from the middle of the pads to the can's axis, along the pads, metres. Up to half a pad's width the flat pad
    meets the can's side head-on; beyond, the pad's edge meets it at a slant. NaN where the pads pass the can by.

    >>> [round(float(np.degrees(contact_angle(offset))), 1) for offset in (0.0, 0.008, 0.0212, 0.04)]
    [0.0, 0.0, 30.0, nan]
    """
    beyond = max(abs(offset) - Gripper().pad_width / 2, 0.0) / CAN_RADIUS
    return float(np.arcsin(beyond)) if beyond <= 1.0 else np.nan


def lift_can(offset: float, friction: float, mass: float = 0.1, camera: Camera | None = None):
    """Let the arm grip a can so far beside its axis, and lift: its LiftResult, and the pictures of a camera, if any.

    offset: along the pads, metres. friction: the coefficient between pads and can. mass: kg. The simulator multiplies
    the coefficients of two bodies, and the Panda's fingers have 1.
    """
    from labkit.sim.panda import Panda
    from labkit.sim.world import World

    parts = (Part("cylinder", (CAN_RADIUS, CAN_HEIGHT)),)
    can = ObjectSpec(
        "can", "can", TARGET, (0.5, 0.0, CAN_HEIGHT / 2), parts=parts, mass=mass, friction=friction, colour=ORANGE
    )
    T = np.diag([1.0, -1.0, -1.0, 1.0])  # x along the base's x, the jaws close along y, the hand points down
    T[:3, 3] = 0.5 - offset, 0.0, 0.05
    spec = SceneSpec((can,), camera or Camera.looking_at((0.5, 0.0, 0.05), 0.6, 0.3, 0.6))
    with World(spec) as world:
        pictures = film(world, camera, 0.2) if camera else []
        return Panda(world).lift(Grasp(T, Gripper().max_opening)), pictures


def friction_cones() -> Explorer:
    """Two pads grip a can beside its axis: do both cones hold the line of force? Controls: offset (mm), friction."""
    half = Gripper().pad_width / 2

    def draw(figure: Figure, offset: int, friction: float) -> None:
        above, curve = figure.subplots(1, 2, width_ratios=[1, 1.2])
        angle, cone = contact_angle(offset / 1000), np.arctan(friction)
        holds = angle <= cone
        colour = "tab:green" if holds else "tab:red"
        above.add_patch(Circle((offset, 0.0), 1000 * CAN_RADIUS, facecolor=ORANGE, alpha=0.5))
        reach = 1000 * CAN_RADIUS * np.cos(angle)
        x = min(offset, 1000 * half)
        for side in (-1, 1):
            y = side * reach
            above.add_patch(Rectangle((-1000 * half, y), 2000 * half, 8 * side, facecolor="tab:blue"))
            inwards = np.arctan2(-y, offset - x)  # the can's normal, from the contact to the axis
            edges = inwards + np.array([-cone, cone])
            corners = [(x, y), *np.add((x, y), 20 * np.column_stack([np.cos(edges), np.sin(edges)]))]
            above.add_patch(Polygon(corners, facecolor=colour, alpha=0.35))
        above.plot([x, x], [-reach, reach], "k-o", markersize=4, linewidth=1.5)
        above.set(xlim=(-20, 60), ylim=(-40, 40), aspect="equal", xlabel="along the pads (mm)")
        above.set(ylabel="closing direction (mm)", title="from above")
        offsets = np.arange(0, 34)
        angles = np.degrees([contact_angle(millimetres / 1000) for millimetres in offsets])
        curve.plot(offsets, angles, color="0.4", label="angle at the contact")
        curve.axhline(np.degrees(cone), color="tab:blue", linestyle="--", label="half angle of the cone")
        curve.plot(offset, np.degrees(angle), "o", color=colour)
        curve.set(xlabel="the can's axis is off by (mm)", ylabel="degrees", ylim=(-3, 90))
        said = "inside, it holds" if holds else "outside, it slips"
        curve.set_title(f"{np.degrees(angle):.0f} degrees, cone of {np.degrees(cone):.0f}: {said}", fontsize=10)
        curve.legend(fontsize=8, loc="upper left")

    controls = {
        "offset": ipywidgets.IntSlider(14, min=0, max=32, step=2, description="offset (mm)"),
        "friction": ipywidgets.FloatSlider(0.2, min=0.1, max=1.2, step=0.1, description="friction"),
    }
    return Explorer(draw, controls, size=(8.5, 3.6), stills=({"offset": 12}, {"offset": 20}))
