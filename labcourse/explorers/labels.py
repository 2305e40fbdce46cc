"""Explorers of topic 01: the classes that a bilinear resize invents, and the bits of PyBullet's mask."""

import cv2
import ipywidgets
import numpy as np
from jaxtyping import Bool, Integer, UInt8
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from labcourse.explorers.explorer import Explorer, show
from labcourse.plots import class_legend
from labkit.labels import CLASSES, colorize, one_hot

GHOST = np.array([255, 0, 200], np.uint8)
LINK_BITS = 24  # PyBullet's masks hold the body in the 24 bits below, the link plus one in those above


def resize_bilinear(y: Integer[np.ndarray, "H W"], height: int, width: int) -> UInt8[np.ndarray, "{height} {width}"]:
    """Resize labels as if they were brightnesses, by averaging neighbours and rounding: the mistake of this topic.

    >>> resize_bilinear(np.array([[1, 3]]), 1, 4).tolist()
    [[1, 2, 3, 3]]
    """
    averaged = cv2.resize(y.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR)
    return np.floor(averaged + 0.5).astype(np.uint8)


def resize_nearest(y: Integer[np.ndarray, "H W"], height: int, width: int) -> UInt8[np.ndarray, "{height} {width}"]:
    """Resize labels by copying, for each new pixel, the old pixel under its centre.

    >>> resize_nearest(np.array([[1, 3]]), 1, 4).tolist()
    [[1, 1, 3, 3]]
    """
    return cv2.resize(y.astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST_EXACT)


def ghosts(y: Integer[np.ndarray, "H W"], resized: Integer[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """Mark the pixels of a resized label image whose class none of the old pixels had that were averaged there.

    >>> ghosts(np.array([[1, 3]]), np.array([[1, 2, 3, 3]])).tolist()
    [[False, True, False, False]]
    """
    height, width = resized.shape
    planes = one_hot(y).astype(np.float32)
    share = np.dstack([cv2.resize(plane, (width, height)) for plane in np.moveaxis(planes, -1, 0)])
    return np.take_along_axis(share, resized[..., None].astype(np.intp), axis=-1)[..., 0] == 0.0


def ghost_classes(y: Integer[np.ndarray, "H W"]) -> Explorer:
    """Resize a label image by a factor: bilinear interpolation invents classes at edges. Controls: scale and way."""
    ways = {"bilinear": resize_bilinear, "nearest": resize_nearest}

    def draw(figure: Figure, scale: float, way: str) -> None:
        size = tuple(max(1, round(scale * side)) for side in y.shape)
        resized = ways[way](y, *size)
        ghost = ghosts(y, resized)
        before, after, haunted = figure.subplots(1, 3)
        show(before, colorize(y), f"{y.shape[0]} x {y.shape[1]}: classes {np.unique(y).tolist()}")
        class_legend(before, fontsize=6, loc="upper left")
        show(after, colorize(resized), f"{size[0]} x {size[1]}, {way}: classes {np.unique(resized).tolist()}")
        invented = f"{np.count_nonzero(ghost)} pixels of a class that was not there"
        show(haunted, np.where(ghost[..., None], GHOST, colorize(resized) // 3), invented)

    controls = {
        "scale": ipywidgets.FloatSlider(1.5, min=0.25, max=3.0, step=0.05, description="scale"),
        "way": ipywidgets.Dropdown(options=list(ways), value="bilinear", description="way"),
    }
    return Explorer(
        draw, controls, size=(10.0, 2.9), stills=({"scale": 1.5, "way": "bilinear"}, {"scale": 1.5, "way": "nearest"})
    )


def segmentation_value(body: int, link: int) -> int:
    """Compose what PyBullet's mask holds for a link of a body, -1 being the base: body + ((link + 1) << 24).

    >>> segmentation_value(2, -1), segmentation_value(2, 0)
    (2, 16777218)
    """
    return body + ((link + 1) << LINK_BITS)


def segmentation_bits() -> Explorer:
    """Show the 32 bits of a pixel of PyBullet's mask. Controls: the body's number, and the link's, -1 for the base."""

    def draw(figure: Figure, body: int, link: int) -> None:
        value = segmentation_value(body, link)
        axes = figure.subplots()
        for bit in range(32):
            upper, on = bit >= LINK_BITS, bool(value >> bit & 1)
            colour = "tab:orange" if upper else "tab:blue"
            axes.add_patch(Rectangle((31 - bit, 0), 0.9, 0.9, facecolor=colour, alpha=1.0 if on else 0.2))
            axes.text(31.45 - bit, 0.45, str(int(on)), ha="center", va="center", fontsize=9)
        axes.text(3.9, 1.15, f"link + 1 = {link + 1}", ha="center", color="tab:orange")
        axes.text(19.9, 1.15, f"body = {body}", ha="center", color="tab:blue")
        axes.set(xlim=(-0.2, 32.1), ylim=(-0.1, 1.6), aspect="equal", title=f"{body} + ({link + 1} << 24) = {value:,}")
        axes.axis("off")

    controls = {
        "body": ipywidgets.IntSlider(5, min=0, max=40, description="body"),
        "link": ipywidgets.IntSlider(2, min=-1, max=11, description="link"),
    }
    return Explorer(draw, controls, size=(8.5, 1.5), stills=({"body": 5, "link": -1}, {"body": 5, "link": 2}))


def raw_segmentation(world, size: tuple[int, int] = (320, 240)) -> Integer[np.ndarray, "H W"]:
    """Take the mask of a labkit.sim World's camera as PyBullet gives it: bodies with the bits of their links, or -1.

    size: width and height. `World.render` decodes such a mask for you; here you see what it has to decode.
    """
    from labkit.sim.world import view_matrix  # PyBullet: loaded only where a world is at hand

    (width, height), camera, client = size, world.spec.camera, world.client
    projection = client.computeProjectionMatrixFOV(np.degrees(camera.fov_y), width / height, camera.near, camera.far)
    image = client.getCameraImage(
        width,
        height,
        viewMatrix=view_matrix(np.array(camera.T_base_cam)),
        projectionMatrix=projection,
        flags=client.ER_SEGMENTATION_MASK_OBJECT_AND_LINKINDEX,
        renderer=client.ER_TINY_RENDERER,
    )
    return np.asarray(image[4], np.int32).reshape(height, width)


def class_of_body(world) -> UInt8[np.ndarray, " B"]:
    """Look up the class of every body of a labkit.sim World, by the body's number."""
    table = np.full(world.client.getNumBodies(), CLASSES.index("background"), np.uint8)
    table[world.table] = CLASSES.index("surface")
    for thing in world.spec.objects:
        table[world.bodies[thing.name]] = thing.class_id
    return table
