"""Explorers of 05_class_weights: a weight that moves the boundary between two Gaussians, and masks under a weight."""

from collections.abc import Mapping, Sequence

import ipywidgets
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.special import ndtr

from labcourse.explorers.explorer import Explorer, show
from labkit.frame import RGBDFrame
from labkit.labels import CLASSES, PALETTE, TARGET, overlay
from labkit.metrics import confusion_matrix, iou, precision_recall

COMMON, RARE, CHOSEN = "#0072b2", "#d55e00", "0.2"
SCORES = ("precision", "recall", "IoU")
EXPONENTS = np.arange(-4.0, 10.25, 0.25)  # of 2, the weights that curves are drawn over


def gaussian_scores(
    distance: float, share: float, weights: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, " n"], ...]:
    """Where two unit Gaussians at 0 and `distance` are decided alike, and what the rare class then scores.

    share: of the rare class, the one at `distance`; weights: of it, the other's is 1. Returns the boundaries, and
    precision, recall and IoU of the rare class, one for each weight. Topic 05.

    >>> x, precision, recall, overlap = gaussian_scores(2.0, 0.5, np.ones(1))
    >>> [round(float(value[0]), 3) for value in (x, precision, recall, overlap)]
    [1.0, 0.841, 0.841, 0.726]
    """
    boundary = distance / 2 + np.log((1.0 - share) / (share * weights)) / distance
    found, false = share * ndtr(distance - boundary), (1.0 - share) * ndtr(-boundary)
    return boundary, found / (found + false), found / share, found / (share + false)


def draw_gaussians(figure: Figure, exponent: float, distance: float, share: float) -> None:
    """Draw what each class adds to the pixels, the boundary, and the rare class's scores over all weights."""
    (boundary,), *scores = gaussian_scores(distance, share, np.array([2.0**exponent]))
    x = np.linspace(-4.0, 9.0, 300)
    common = (1.0 - share) * np.exp(-(x**2) / 2)
    rare = share * np.exp(-((x - distance) ** 2) / 2)
    left, right = figure.subplots(1, 2)
    left.fill_between(x, common, color=COMMON, alpha=0.5, label="common")
    left.fill_between(x, rare, color=RARE, alpha=0.7, label="rare")
    left.plot(x, 2.0**exponent * rare, color=RARE, linestyle="--", label="rare, weighted")
    left.axvline(boundary, color=CHOSEN)
    left.set(yscale="log", ylim=(1e-4, 2.0 + 2.0**exponent * share), xlim=(-4.0, 9.0))
    left.set(xlabel="feature of a pixel", ylabel="pixels (log scale)", title=f"boundary at {boundary:.2f}")
    left.legend(fontsize=8, loc="upper right")
    _, *curves = gaussian_scores(distance, share, 2.0**EXPONENTS)
    draw_scores(right, EXPONENTS, curves, exponent)
    right.set_title(said([float(value[0]) for value in scores]))


def draw_scores(axes: Axes, exponents: np.ndarray, curves, chosen: float) -> None:
    """Draw precision, recall and IoU over the binary logarithm of the weight, and the one that is chosen."""
    for name, values, colour, dash in zip(SCORES, curves, (COMMON, RARE, "#009e73"), ("--", "-", ":"), strict=True):
        axes.plot(exponents, values, dash, label=name, color=colour)
    axes.axvline(chosen, color=CHOSEN)
    axes.set(ylim=(0.0, 1.02), xlabel="log2 of the weight", ylabel="score of the rare class")
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))


def said(scores: Sequence[float]) -> str:
    """Put precision, recall and IoU into words."""
    return ", ".join(f"{name} {value:.2f}" for name, value in zip(SCORES, scores, strict=True))


def weight_slider(start: float = 0.0) -> ipywidgets.FloatSlider:
    """Make the slider of the weight's binary logarithm."""
    low, high = float(EXPONENTS[0]), float(EXPONENTS[-1])
    return ipywidgets.FloatSlider(start, min=low, max=high, step=0.25, description="log2 weight")


def two_gaussians(distance: float = 2.0, share: float = 0.02) -> Explorer:
    """Move the weight of a rare class and see the boundary between two Gaussians go, and what it costs.

    distance: between the classes' means, in standard deviations; share: of the rare class, 0 to 1. Topic 05.

    >>> explorer = two_gaussians()
    >>> explorer.controls["exponent"].value = 4.0
    >>> sorted(explorer.values)
    ['distance', 'exponent', 'share']
    """
    shares = sorted({0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.002, share})
    controls = {
        "exponent": weight_slider(),
        "distance": ipywidgets.FloatSlider(distance, min=0.5, max=5.0, step=0.25, description="distance"),
        "share": ipywidgets.SelectionSlider(options=shares, value=share, description="rare share"),
    }
    return Explorer(draw_gaussians, controls, size=(9.5, 3.0), stills=({"exponent": 0.0}, {"exponent": 5.5}))


def reweighted(p: np.ndarray, exponent: float) -> np.ndarray:
    """Decide each pixel as if the network had been trained with the target's weight 2 ** exponent, others 1."""
    w = np.ones(len(CLASSES))
    w[TARGET] = 2.0**exponent
    return (p * w).argmax(axis=-1).astype(np.uint8)


def target_scores(y: np.ndarray, p: np.ndarray, exponent: float) -> tuple[float, float, float]:
    """Precision, recall and IoU of the target under its weight 2 ** exponent."""
    n = confusion_matrix(y, reweighted(p, exponent), len(CLASSES))
    precision, recall = precision_recall(n)
    return float(precision[TARGET]), float(recall[TARGET]), float(iou(n)[TARGET])


def trained_masks(frames: Mapping[str, tuple[RGBDFrame, Float[np.ndarray, "H W C"]]]) -> Explorer:
    """Weigh the target in a trained network's answers, and see masks grow until they bleed.

    frames: title -> (frame with labels, the network's class probabilities). A weight w_c moves the optimum of training
    from p_c to one in proportion to w_c p_c, so that multiplying the probabilities of a network trained without weights
    shows what one trained with them tends to. Raises ValueError without frames, or for one without labels. Topic 05.
    """
    if not frames:
        raise ValueError("frames: expected at least one frame with its probabilities, got none")
    for name, (frame, _) in frames.items():
        if frame.labels is None:
            raise ValueError(f"frames: expected frames with labels, got {name!r} without")
    curves = {
        name: np.array([target_scores(frame.labels, p, exponent) for exponent in EXPONENTS]).T
        for name, (frame, p) in frames.items()
    }

    def draw(figure: Figure, exponent: float, name: str) -> None:
        frame, p = frames[name]
        mask, scores = figure.subplots(1, 2, width_ratios=[1.3, 1])
        title = f"target weighs {2.0**exponent:.3g}; black: the true outline"
        labels = reweighted(p, exponent)
        pale = overlay(170 + frame.rgb // 3, labels, 0.4)  # so that the target stands out on a dark table, too
        pale[labels == TARGET] = PALETTE[TARGET]
        show(mask, pale, title)
        mask.contour(frame.labels == TARGET, levels=[0.5], colors="black", linewidths=1.4)
        draw_scores(scores, EXPONENTS, curves[name], exponent)
        scores.set_title(said(target_scores(frame.labels, p, exponent)))

    names = ipywidgets.ToggleButtons(options=list(frames), description="frame")
    stills = ({"exponent": 0.0}, {"exponent": 4.75})
    return Explorer(draw, {"exponent": weight_slider(), "name": names}, size=(10.0, 3.6), dpi=72, stills=stills)
