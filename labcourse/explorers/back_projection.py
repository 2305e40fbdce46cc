"""Explorers of topic 06: clouds bent by the usual bugs, a point under noise, and a camera that is held otherwise."""

from collections.abc import Collection
from dataclasses import replace

import ipywidgets
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from labcourse.explorers.explorer import Explorer, show
from labkit.frame import RGBDFrame
from labkit.geometry import back_projection_noise, invert_transform, transform_points
from labkit.labels import CLASSES, PALETTE, TARGET, overlay
from labkit.learning.network import TorchEngine
from labkit.learning.view import rolled_camera
from labkit.metrics import confusion_matrix, iou

BUGS = {
    "swapped": "u taken for the row",
    "ray": "depth taken for the length of the ray",
    "buffer": "the renderer's depth buffer taken for metres",
    "view": "the view matrix taken for the camera's pose",
    "opengl": "OpenGL's axes (y up, z backward)",
}
MYSTERIES = (None, "opengl", "ray", "view", "buffer", "swapped")  # what number 1 to 5 of "mystery" hides
NEAR, FAR = 0.1, 6.0  # of the kit's cameras, metres
STRIDE = 4  # of the pixels that are drawn


def bent_cloud(frame: RGBDFrame, bugs: Collection[str] = ()) -> Float[np.ndarray, "N 3"]:
    """Back-project every fourth row and column of a frame into the base frame, with bugs (keys of BUGS) put in.

    Pixels of the background and pixels without depth are left out. Without bugs it is what the kit computes. Raises
    ValueError for an unknown bug or a frame without labels.

    >>> rgb, depth = np.zeros((4, 8, 3), np.uint8), np.full((4, 8), 2.0, np.float32)
    >>> frame = RGBDFrame(rgb, depth, np.diag([4.0, 4.0, 1.0]), np.eye(4), labels=np.ones((4, 8), np.uint8))
    >>> bent_cloud(frame).tolist()
    [[0.0, 0.0, 2.0], [2.0, 0.0, 2.0]]
    >>> bent_cloud(frame, ["swapped", "opengl"]).tolist()
    [[0.0, 0.0, -2.0], [0.0, -2.0, -2.0]]
    """
    unknown = set(bugs) - BUGS.keys()
    if unknown:
        raise ValueError(f"bugs: expected some of {', '.join(BUGS)}, got {sorted(unknown)}")
    v, u, _ = _drawn_pixels(frame)
    d = frame.depth[v, u].astype(np.float64)
    if "buffer" in bugs:
        d = FAR * (d - NEAR) / (d * (FAR - NEAR))
    if "swapped" in bugs:
        u, v = v, u
    rays = np.stack([u, v, np.ones(len(u))], axis=1) @ np.linalg.inv(frame.K).T
    if "ray" in bugs:
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    P_cam = d[:, None] * rays
    if "opengl" in bugs:
        P_cam *= (1.0, -1.0, -1.0)
    T_base_cam = invert_transform(frame.T_base_cam) if "view" in bugs else frame.T_base_cam
    return transform_points(T_base_cam, P_cam)


def _drawn_pixels(frame: RGBDFrame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Give the rows, columns and labels of the pixels that are drawn."""
    if frame.labels is None:
        raise ValueError("frame: expected a frame with labels, got one without")
    coarse = np.s_[::STRIDE, ::STRIDE]
    v, u = STRIDE * np.argwhere((frame.labels[coarse] > 0) & (frame.depth[coarse] > 0.0)).T
    return v, u, frame.labels[v, u]


def name_that_bug(frame: RGBDFrame) -> Explorer:
    """Bend a frame's cloud by ticking bugs, beside the true one; or guess which bug bent the mystery cloud.

    Controls: a box for each of BUGS, and `mystery`, 0 for none or 1 to 5: then tick the box whose cloud covers it.
    """
    true, camera = bent_cloud(frame), frame.T_base_cam[:3, 3]
    labels = _drawn_pixels(frame)[2]

    def draw(figure: Figure, mystery: int, **ticked: bool) -> None:
        bugs = [bug for bug, on in ticked.items() if on]
        bent = bent_cloud(frame, bugs)
        for axes, vertical in zip(figure.subplots(1, 2), (1, 2), strict=True):
            axes.plot(true[:, 0], true[:, vertical], ".", markersize=1.0, color="0.7")
            if mystery:
                P = bent_cloud(frame, [MYSTERIES[mystery]])
                axes.plot(P[:, 0], P[:, vertical], ".", markersize=3.0, color="tab:red")
            for c in np.unique(labels):
                P = bent[labels == c]
                axes.plot(P[:, 0], P[:, vertical], ".", markersize=1.5, color=PALETTE[c] / 255.0)
            axes.plot(camera[0], camera[vertical], "k^", markersize=7)
            axes.set_aspect("equal", adjustable="datalim")
            side = ("from above", "from the side")[vertical - 1]
            axes.set(xlabel="x (m)", ylabel=f"{'xyz'[vertical]} (m)", title=side)
        guess = f" | red: mystery {mystery}" if mystery else ""
        colours = "; ".join(BUGS[bug] for bug in bugs) or "no bug"
        figure.suptitle(f"colours: {colours} | triangle: camera{guess}", size=9, wrap=True)

    boxes = {bug: ipywidgets.Checkbox(False, description=text, indent=False) for bug, text in BUGS.items()}
    mystery = ipywidgets.IntSlider(0, min=0, max=len(MYSTERIES) - 1, description="mystery")
    stills = tuple({bug: True} for bug in BUGS)
    return Explorer(draw, boxes | {"mystery": mystery}, size=(8.0, 3.6), dpi=52, stills=stills)


def noisy_points(
    u: float, v: float, d: float, K: Float[np.ndarray, "3 3"], sigma_pixel: float, sigma_depth: float, n: int, seed: int
) -> Float[np.ndarray, "{n} 3"]:
    """Back-project n noisy readings of one pixel, camera frame: pixels off by sigma_pixel, depths by sigma_depth (m).

    >>> noisy_points(0.0, 0.0, 2.0, np.eye(3), 0.0, 0.0, n=1, seed=0).tolist()
    [[0.0, 0.0, 2.0]]
    """
    du, dv, dd = np.random.default_rng(seed).standard_normal((3, n))
    pixels = np.stack([u + sigma_pixel * du, v + sigma_pixel * dv, np.ones(n)], axis=1)
    return (d + sigma_depth * dd)[:, None] * (pixels @ np.linalg.inv(K).T)


def draw_ellipse(axes: Axes, centre: Float[np.ndarray, "2"], Sigma: Float[np.ndarray, "2 2"], **options) -> None:
    """Draw the ellipse of two standard deviations of a 2 x 2 covariance; `options` go to Axes.plot."""
    variances, directions = np.linalg.eigh(Sigma)
    turn = np.linspace(0.0, 2.0 * np.pi, 100)
    circle = np.stack([np.cos(turn), np.sin(turn)])
    x, z = centre[:, None] + 2.0 * directions @ (np.sqrt(np.maximum(variances, 0.0))[:, None] * circle)
    axes.plot(x, z, **options)


def depth_noise(K: Float[np.ndarray, "3 3"], height: int, width: int) -> Explorer:
    """Follow one point under noise: 300 noisy readings, and the ellipse that J Sigma J^T predicts.

    Controls: column u (the row is the image's middle), depth d in metres, sigma_pixel, sigma_depth in millimetres.
    """
    v = height / 2.0

    def draw(figure: Figure, u: int, d: float, sigma_pixel: float, sigma_depth: float) -> None:
        arguments = (float(u), v, d, K, sigma_pixel, sigma_depth / 1000.0)
        P = 1000.0 * noisy_points(*arguments, n=300, seed=0)[:, [0, 2]]
        Sigma = 1e6 * back_projection_noise(*arguments)[np.ix_([0, 2], [0, 2])]
        point = 1000.0 * d * (np.linalg.inv(K) @ (u, v, 1.0))[[0, 2]]
        rays, close = figure.subplots(1, 2)
        for column in (0, width - 1):
            x = (np.linalg.inv(K) @ (column, v, 1.0))[0]
            rays.plot([0.0, 3.0 * x], [0.0, 3.0], color="0.8")
        rays.plot([0.0, point[0] / 1000.0], [0.0, point[1] / 1000.0], color="tab:blue")
        rays.plot(*(point / 1000.0), "o", color="tab:red")
        rays.set(xlabel="x (m)", ylabel="z (m)", title="the camera is at 0, 0", aspect="equal")
        close.scatter(*(P - point).T, s=3.0, color="0.5")
        draw_ellipse(close, np.zeros(2), Sigma, color="tab:red")
        close.set(xlabel="x (mm)", ylabel="z (mm)", xlim=(-60, 60), ylim=(-60, 60), aspect="equal")
        close.set_title(f"std of x {np.sqrt(Sigma[0, 0]):.1f} mm, of z {np.sqrt(Sigma[1, 1]):.1f} mm")

    controls = {
        "u": ipywidgets.IntSlider(width - 20, min=0, max=width - 1, description="u"),
        "d": ipywidgets.FloatSlider(1.0, min=0.3, max=3.0, step=0.1, description="d (m)"),
        "sigma_pixel": ipywidgets.FloatSlider(0.5, min=0.0, max=4.0, step=0.25, description="noise (px)"),
        "sigma_depth": ipywidgets.FloatSlider(10.0, min=0.0, max=25.0, step=1.0, description="noise (mm)"),
    }
    return Explorer(draw, controls, size=(8.0, 3.4), stills=({"u": width // 2}, {"u": width - 20}))


def camera_held(frame: RGBDFrame, network) -> Explorer:
    """Hold a frame's camera otherwise: what a network labels in the picture as it is, and in the canonical view.

    network: states the size of a view's pixel. Controls: the camera's roll in degrees, the picture's width in pixels
    (its field of view stays). The titles give the IoU of the target.
    """
    seeing = TorchEngine(network)
    engines = {"as it is": TorchEngine(network, replace(seeing.takes, pixel=None)), "in the canonical view": seeing}

    def draw(figure: Figure, roll: int, width: int) -> None:
        scale = width / frame.size[0]
        size = width, round(scale * frame.size[1])
        K = np.diag([scale, scale, 1.0]) @ frame.K
        K[:2, 2] += (scale - 1.0) / 2.0  # pixel centres lie at whole numbers
        seen = rolled_camera(frame, np.radians(roll), K, size)
        picture, *others = figure.subplots(1, 3)
        show(picture, seen.rgb, f"{size[0]} x {size[1]} pixels")
        for axes, (name, engine) in zip(others, engines.items(), strict=True):
            labels = engine.logits(seen).argmax(axis=0)
            score = iou(confusion_matrix(seen.labels, labels, len(CLASSES)))[TARGET]
            show(axes, overlay(seen.rgb, labels.astype(np.uint8), 0.65), f"{name}: {score:.2f}")

    controls = {
        "roll": ipywidgets.IntSlider(180, min=-180, max=180, step=15, description="roll (°)"),
        "width": ipywidgets.SelectionSlider(options=[160, 320, 640, 1280], value=320, description="width"),
    }
    stills = ({"roll": 0, "width": 320}, {"roll": 180, "width": 320}, {"roll": 0, "width": 1280})
    return Explorer(draw, controls, size=(8.5, 2.6), stills=stills)
