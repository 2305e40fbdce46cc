"""What all explorers share: a control that changes redraws the picture, which is shown where widgets do not run."""

import base64
import io

import ipywidgets
import matplotlib.pyplot as plt
import numpy as np
import pytest
from at_night import others_at_night
from scenes import random_frame

from labcourse.explorers import back_projection, class_weights, crf, gradient, grasp, iou, labels, node, stacks
from labcourse.explorers.explorer import VIEW, Explorer
from labkit.learning.network import UNetRGBD


def probabilities(seed: int, shape: tuple[int, int] = (24, 32)) -> np.ndarray:
    return np.random.default_rng(seed).dirichlet(np.ones(4), shape)


FRAME, OTHER = random_frame(0), random_frame(1)
MASKS = {"a": FRAME.labels, "b": OTHER.labels, "c": random_frame(2).labels}
CLOUD = np.random.default_rng(0).normal(size=(50, 3)) * (0.04, 0.01, 0.01)
FRAMES = {"first": (FRAME, probabilities(0)), "second": (OTHER, probabilities(1))}
# Of each explorer: how to make one, and a value that each of its controls is moved to.
EXPLORERS = {
    "ghost_classes": (lambda: labels.ghost_classes(FRAME.labels), {"scale": 0.5, "way": "nearest"}),
    "segmentation_bits": (labels.segmentation_bits, {"body": 37, "link": 8}),
    "gibbs": (lambda: crf.gibbs(probabilities(3, (2, 2))[..., :2]), {"w": 2.5}),
    "you_are_the_solver": (crf.you_are_the_solver, {"pixel_2_1": True, "lam": 0.3, "reveal": True}),
    "lam_slider": (lambda: crf.lam_slider(FRAMES["first"][1], FRAME.rgb, FRAME.labels), {"lam": 8.0, "sigma_I": 200.0}),
    "logits": (gradient.logits, {"z0": -3.0, "z1": 4.5, "z2": 0.5, "y": 2, "h": 1.0}),
    "keyhole": (
        lambda: gradient.keyhole(FRAME.rgb, FRAME.labels, (12, 9), (5, 18)),
        {"u": 2, "v": 20, "width": 18, "reveal": True},
    ),
    "sliding_mask": (iou.sliding_mask, {"shift": 9, "radius": 12}),
    "confusion_cells": (
        lambda: iou.confusion_cells(FRAME.rgb, FRAME.labels, np.zeros_like(FRAME.labels)),
        {"true": "background", "predicted": "target"},
    ),
    "two_gaussians": (class_weights.two_gaussians, {"exponent": 5.5, "distance": 3.0, "share": 0.1}),
    "trained_masks": (lambda: class_weights.trained_masks(FRAMES), {"exponent": 3.0, "name": "second"}),
    "name_that_bug": (
        lambda: back_projection.name_that_bug(FRAME),
        dict.fromkeys(back_projection.BUGS, True) | {"mystery": 3},
    ),
    "depth_noise": (
        lambda: back_projection.depth_noise(FRAME.K, 24, 32),
        {"u": 3, "d": 2.0, "sigma_pixel": 2.0, "sigma_depth": 3.0},
    ),
    "jaws_at_a_yaw": (lambda: grasp.jaws_at_a_yaw(CLOUD), {"yaw": 90}),
    "visible_centroid": (grasp.visible_centroid, {"elevation": 75, "thing": "can"}),
    "lag_explorer": (node.lag_explorer, {"network": 20, "rate": 40, "speed": 300}),
    "sync_explorer": (node.sync_explorer, {"slop": 0.0, "jitter": 25.0, "lost": 0.5}),
    "wipe": (lambda: stacks.wipe(FRAME.rgb, MASKS, FRAME.labels), {"at": 3, "left": "c", "right": "a"}),
    "colour_range": (
        lambda: stacks.colour_range(FRAME.rgb, FRAME.labels == 1),
        {"first": 30, "last": 90, "saturation": 120, "value": (40, 200)},
    ),
    "camera_held": (lambda: back_projection.camera_held(FRAME, UNetRGBD().eval()), {"roll": 45, "width": 640}),
    "memory": (lambda: stacks.memory(np.arange(12.0).reshape(2, 2, 3)), {"v": 1, "u": 2, "layout": "NCHW"}),
}


@pytest.mark.parametrize("name", others_at_night(EXPLORERS, by_day=list(EXPLORERS)[::3]))
def test_every_control_changes_the_picture(name):
    make, moves = EXPLORERS[name]
    explorer = make()
    assert explorer.png.startswith(b"\x89PNG")
    for control, value in moves.items():
        before = explorer.png
        explorer.controls[control].value = value
        assert explorer.values[control] == value and explorer.png != before, control
    assert explorer.controls.keys() - moves.keys() <= {f"pixel_{v}_{u}" for v in range(4) for u in range(5)}


def test_a_change_of_any_control_draws_again(monkeypatch):
    seen = []

    def draw(figure, size, title):
        seen.append((size, title))
        figure.subplots().set_title(f"{title}{size}")

    controls = {"size": ipywidgets.IntSlider(2, min=0, max=9), "title": ipywidgets.Text("t"), "b": ipywidgets.Button()}
    explorer = Explorer(draw, controls)
    explorer.controls["size"].value = 3
    explorer.controls["title"].value = "u"
    assert seen == [(2, "t"), (3, "t"), (3, "u")]
    own = explorer.widget._repr_mimebundle_()[VIEW]
    monkeypatch.delattr(ipywidgets.Widget, "_repr_mimebundle_")  # as in ipywidgets 7, which Colab has
    bundle = explorer._repr_mimebundle_()
    assert base64.b64decode(bundle["image/png"]) == explorer.png and bundle[VIEW] == own


def test_stills_are_shown_where_no_widget_runs_and_leave_the_controls_alone():
    drawn = []
    slider = ipywidgets.FloatSlider(1.0, min=0, max=5)
    explorer = Explorer(
        lambda figure, slope: drawn.append(slope),
        {"slope": slider},
        size=(2.0, 1.0),
        stills=({"slope": 3.0}, {"slope": 4.0}),
    )
    shown = base64.b64decode(explorer._repr_mimebundle_()["image/png"])
    assert drawn == [1.0, 3.0, 4.0] and slider.value == 1.0
    assert plt.imread(io.BytesIO(shown)).shape[:2] == (160, 160)  # two pictures of 80 x 160, one below the other
