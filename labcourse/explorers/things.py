"""Explorers of things told apart: votes that meet or miss, and pointing at a thing (topics 03 and 07)."""

import cv2
import ipywidgets
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from labcourse.explorers.explorer import Explorer, show
from labcourse.plots import numbered
from labcourse.views import fingers
from labkit.frame import RGBDFrame
from labkit.geometry import invert_transform, project, transform_points
from labkit.labels import overlay
from labkit.learning.things import CELL, group, histogram, peaks_of, vote_targets
from labkit.pipeline import Pipeline

SIDES, ERRORS = (10, 50), (0.0, 20.0)  # pixels: of a square, and the standard deviation of a vote's error


def votes_that_meet() -> Explorer:
    """Two squares that touch, as large as one slider says, and votes that are as far off as the other says.

    On the left, each pixel in the colour of the thing that it is given to; on the right, the smoothed histogram of the
    places that are voted for, with its peaks and the true middles. The errors are normal, the same draws each time.
    """
    drawn = np.random.default_rng(0).normal(size=(SIDES[1], 2 * SIDES[1], 2))

    def draw(figure: Figure, side: int, sigma: float) -> None:
        instances = np.zeros((SIDES[1] + 30, 2 * SIDES[1] + 30), np.uint8)
        inside = np.s_[15 : 15 + side, 15 : 15 + 2 * side]
        instances[inside] = np.repeat([1, 2], side)
        votes = vote_targets(instances).astype(float)
        votes[inside] += sigma * drawn[:side, : 2 * side]
        numbers, certainty = group((instances > 0).astype(float), votes)
        v, u = np.nonzero(instances)
        counts, first = histogram(np.stack([u, v], axis=1) + votes[v, u])
        peaks, middles = peaks_of((counts, first)), 15 + side * np.array([0.5, 1.5]) - 0.5
        left, right = figure.subplots(1, 2)
        found = len(certainty)
        left.imshow(numbered(numbers))
        left.set_title(f"{found} thing{'s' * (found != 1)} found, certainty {', '.join(f'{c:.2f}' for c in certainty)}")
        low, high = first - CELL / 2, first + CELL * (np.array(counts.shape[::-1]) - 0.5)
        right.imshow(counts, extent=(low[0], high[0], high[1], low[1]), cmap="magma")
        right.plot(middles, np.full(2, 14.5 + side / 2), "o", color="white", fillstyle="none", label="true middles")
        right.plot(*peaks.T, "x", color="#56b4e9", markersize=9, markeredgewidth=2, label="peaks")
        right.set(title=f"histogram of votes: {len(peaks)} peak{'s' * (len(peaks) != 1)}", xlabel="u", ylabel="v")
        right.legend(fontsize=8, loc="upper right")
        left.set(xlabel="u (pixels)", ylabel="v (pixels)")

    controls = {
        "side": ipywidgets.IntSlider(36, min=SIDES[0], max=SIDES[1], step=2, description="side"),
        "sigma": ipywidgets.FloatSlider(4.0, min=ERRORS[0], max=ERRORS[1], step=1.0, description="error"),
    }
    return Explorer(draw, controls, size=(8.6, 3.4), stills=({"sigma": 4.0}, {"sigma": 14.0}))


def pick_a_thing(frame: RGBDFrame, pipeline: Pipeline, at: tuple[int, int] | None = None) -> Explorer:
    """Point at a thing with two sliders: its mask, and the jaws of its best grasp as the camera would see them.

    pipeline: `Pipeline(find_objects=...)` or one with a network. at: the pixel (u, v) to begin with, the middle of the
    picture if none. Each state runs the pipeline on the frame, as `run(frame, at=(u, v))` does. A picture of ipywidgets
    alone does not tell where it is clicked, so the pixel is chosen with sliders. With `part`, a second pair of sliders
    says which pixel is another thing, and the two are parted, as `run(frame, at=..., not_at=...)` does.
    """
    width, height = frame.size
    u0, v0 = (width // 2, height // 2) if at is None else at

    def draw(figure: Figure, u: int, v: int, part: bool, not_u: int, not_v: int) -> None:
        apart = part and (not_u, not_v) != (u, v)
        seen = pipeline.run(frame, at=(u, v), not_at=(not_u, not_v) if apart else None)
        mask = np.where(seen.labels == seen.target_class, seen.labels, 0)
        axes = figure.subplots()
        best = seen.plan.grasps[0] if seen.plan.grasps else None
        score = f"no grasp: {seen.plan.reason}" if best is None else f"best grasp {1000.0 * best.width:.0f} mm wide"
        show(axes, overlay(frame.rgb, mask.astype(np.uint8), 0.6), f"{np.count_nonzero(mask)} pixels; {score}")
        axes.plot(u, v, "w+", markersize=14, markeredgewidth=2)
        if apart:
            axes.plot(not_u, not_v, "wx", markersize=12, markeredgewidth=2)
        for corners in () if best is None else fingers(best.T_base_grasp, best.width, pipeline.gripper):
            P_cam = transform_points(invert_transform(frame.T_base_cam), corners)
            uv = np.stack(project(P_cam, frame.K), axis=1)
            if np.isfinite(uv).all():  # all in front of the camera
                hull = cv2.convexHull(uv.astype(np.float32))[:, 0]
                axes.add_patch(Polygon(hull, fill=False, edgecolor="#1e6eff", linewidth=2))

    def slider(value: int, size: int, name: str) -> ipywidgets.IntSlider:
        return ipywidgets.IntSlider(value, min=0, max=size - 1, description=name, continuous_update=False)

    controls = {"u": slider(u0, width, "u"), "v": slider(v0, height, "v")}
    controls["part"] = ipywidgets.Checkbox(False, description="part")
    controls |= {"not_u": slider(u0, width, "not u"), "not_v": slider(v0, height, "not v")}
    return Explorer(draw, controls, size=(6.0, 4.6), stills=({"u": u0, "v": v0},))
