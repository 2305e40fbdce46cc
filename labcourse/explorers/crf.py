"""Explorers of topic 02: the Gibbs distribution of four pixels, "you are the solver", lam on a prediction; a cut."""

from functools import lru_cache

import ipywidgets
import numpy as np
from jaxtyping import Float, Integer, UInt8
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from labcourse.explorers.explorer import Explorer, show
from labkit.crf import PottsCRF, solve, unary_from_probabilities
from labkit.crf.energy import pair_slices
from labkit.crf.exact import enumerate_labellings
from labkit.labels import PALETTE, SURFACE, TARGET, colorize, overlay
from labkit.metrics import confusion_matrix, iou

# The two classes of the toys, in the kit's colours: the table and what lies on it.
TABLE, THING = (tuple(PALETTE[c] / 255) for c in (SURFACE, TARGET))
UNARY_COLOUR, PAIRWISE_COLOUR = "0.55", "0.15"
LAMS = (0.0, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
SIGMAS = (5.0, 15.0, 50.0, 200.0)

# "You are the solver": a bright thing on a dark table. The network misses a pixel of it and sees three where none are.
TOY_IMAGE = np.array(
    [[60, 64, 58, 61, 63], [59, 170, 178, 66, 60], [62, 175, 172, 181, 64], [61, 63, 59, 174, 58]], np.uint8
)
TOY_P = np.array(
    [
        [0.10, 0.30, 0.20, 0.78, 0.72],
        [0.25, 0.70, 0.38, 0.35, 0.20],
        [0.15, 0.80, 0.65, 0.58, 0.30],
        [0.60, 0.20, 0.25, 0.55, 0.10],
    ]
)


def toy_model(lam: float) -> PottsCRF:
    """Build the model of "you are the solver": two classes on 4 x 5 pixels.

    >>> toy_model(0.0).energy(np.zeros((4, 5), int)) < toy_model(0.0).energy(np.ones((4, 5), int))
    True
    """
    psi = unary_from_probabilities(np.stack([1.0 - TOY_P, TOY_P], axis=-1))
    return PottsCRF.from_image(psi, TOY_IMAGE, lam, sigma_I=40.0)


def energy_terms(crf: PottsCRF, y: Integer[np.ndarray, "H W"]) -> tuple[float, float]:
    """Split a labelling's energy into its unary and its pairwise part.

    >>> crf = PottsCRF(np.array([[[0.0, 1.0], [1.0, 0.25]]]), np.array([[[0.5, 0.0]], [[0.0, 0.0]]]))
    >>> energy_terms(crf, np.array([[0, 1]]))
    (0.25, 0.5)
    """
    unary = PottsCRF(crf.unary, np.zeros_like(crf.weights)).energy(y)
    return unary, crf.energy(y) - unary


def draw_labels(
    axes: Axes, y: Integer[np.ndarray, "H W"], numbers: Float[np.ndarray, "H W"] | None = None, crf=None
) -> None:
    """Draw a small labelling of two classes, numbers in its pixels, and black lines where neighbours pay (with crf)."""
    colours = np.array([TABLE, THING])[y]
    axes.imshow(0.45 + 0.55 * colours)
    axes.set_axis_off()
    for (v, u), number in np.ndenumerate(numbers if numbers is not None else np.empty((0, 0))):
        axes.text(u, v, f"{number:.2f}".lstrip("0"), ha="center", va="center", fontsize=9)
    if crf is None:
        return
    for w, (down, right) in zip(crf.weights, crf.offsets, strict=True):
        p, q = pair_slices((down, right))
        for v, u in np.argwhere(y[p] != y[q]):
            along = ([u + 0.5, u + 0.5], [v - 0.5, v + 0.5]) if right else ([u - 0.5, u + 0.5], [v + 0.5, v + 0.5])
            axes.plot(*along, color="black", linewidth=0.5 + 6.0 * w[v, u], solid_capstyle="butt")


def draw_energies(axes: Axes, terms: dict[str, tuple[float, float]], limit: float | None = None) -> None:
    """Draw energies as stacked bars, unary and pairwise: name -> (unary, pairwise)."""
    names = list(terms)
    unary, pairwise = np.array(list(terms.values())).T
    axes.barh(names, unary, color=UNARY_COLOUR, label="unary")
    axes.barh(names, pairwise, left=unary, color=PAIRWISE_COLOUR, label="pairwise")
    for name, total in zip(names, unary + pairwise, strict=True):
        axes.text(total, name, f" {total:.2f}", va="center", fontsize=9)
    axes.invert_yaxis()
    axes.set(xlim=(0.0, limit or 1.2 * (unary + pairwise).max()), xlabel="energy")
    axes.legend(fontsize=8, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
    axes.spines[["top", "right"]].set_visible(False)


# ---------------------------------------------------------------------------------------------- three explorers


def gibbs(psi: Float[np.ndarray, "2 2 2"]) -> Explorer:
    """Show the probabilities of all sixteen labellings of 2 x 2 pixels, under a weight that all four pairs share."""

    def draw(figure: Figure, w: float) -> None:
        weights = np.zeros((2, 2, 2))
        weights[0, :, 0] = weights[1, 0, :] = w
        ((labellings, energies),) = enumerate_labellings(PottsCRF(psi, weights))
        p = np.exp(-energies)
        p /= p.sum()
        bars, icons = figure.subplots(2, 1, sharex=True, height_ratios=(5.0, 1.0))
        bars.bar(range(16), p, color=["black" if n == p.argmax() else "0.6" for n in range(16)])
        bars.set(xlim=(-0.6, 15.6), ylim=(0.0, 1.0), xticks=[], ylabel="p(y)")
        bars.spines[["top", "right"]].set_visible(False)
        bars.set_title(f"w = {w:.1f}: the likeliest labelling has {p.max():.2f}, Z = {np.exp(-energies).sum():.3f}")
        n, v, u = np.indices(labellings.shape)
        colours = np.array([TABLE, THING])[labellings.ravel()]
        icons.scatter(n + 0.26 * (u - 0.5), 0.8 * (0.5 - v), s=90, marker="s", c=colours)
        icons.set_ylim(-0.9, 0.9)
        icons.set_axis_off()

    w = ipywidgets.FloatSlider(0.0, min=0.0, max=3.0, step=0.1, description="w")
    return Explorer(draw, {"w": w}, size=(8.0, 2.6), stills=({"w": 0.0}, {"w": 0.2}, {"w": 1.5}))


def you_are_the_solver() -> Explorer:
    """Give each of 20 pixels a button that changes its label, and show what that does to the energy.

    Controls: pixel_v_u for each pixel, lam, and reveal, which shows a minimum cut beside. Buttons carry the network's
    probability that the pixel belongs to the thing.
    """
    H, W = TOY_P.shape
    pixels = {
        f"pixel_{v}_{u}": ipywidgets.ToggleButton(
            False, description=f"{TOY_P[v, u]:.2f}", layout=ipywidgets.Layout(width="52px", height="40px")
        )
        for v, u in np.ndindex(H, W)
    }
    lam = ipywidgets.FloatSlider(2.0, min=0.0, max=3.0, step=0.1, description="lam")
    reveal = ipywidgets.ToggleButton(False, description="show the cut", icon="scissors")

    def draw(figure: Figure, lam: float, reveal: bool, **values: bool) -> None:
        y = np.array([values[name] for name in pixels]).reshape(H, W).astype(np.uint8)
        for button in pixels.values():
            button.button_style = "warning" if button.value else "primary"  # orange as the thing, blue as the table
        crf = toy_model(lam)
        shown = {"you": y}
        if reveal:
            shown["the cut"] = solve(crf, "min_cut").labels
        axes = figure.subplots(1, len(shown) + 1, width_ratios=[1.0] * len(shown) + [1.2])
        for axis, (name, labels) in zip(axes, shown.items(), strict=False):
            draw_labels(axis, labels, TOY_P, crf)
            axis.set_title(f"{name}: {crf.energy(labels):.2f}")
        shown["network alone"] = crf.unary.argmin(axis=2)
        draw_energies(axes[-1], {name: energy_terms(crf, labels) for name, labels in shown.items()}, 30.0)

    stills = ({"lam": 0.0, "reveal": True}, {"lam": 2.0, "reveal": True})
    explorer = Explorer(draw, pixels | {"lam": lam, "reveal": reveal}, size=(8.0, 2.6), stills=stills)
    grid = ipywidgets.GridBox(
        list(pixels.values()), layout=ipywidgets.Layout(grid_template_columns=f"repeat({W}, 56px)")
    )
    explorer.widget.children = [lam, ipywidgets.HBox([grid, reveal]), explorer.picture]
    return explorer


def lam_slider(
    probabilities: Float[np.ndarray, "H W 4"], image: UInt8[np.ndarray, "H W 3"], y_true: Integer[np.ndarray, "H W"]
) -> Explorer:
    """Refine a network's prediction under a lam and a sigma_I to choose: labels, the energy's parts, the target's IoU.

    Labels come from expansion moves on 8 neighbours, and are computed once for each choice.
    """
    psi = unary_from_probabilities(probabilities, floor=1e-4)

    @lru_cache
    def refined(lam: float, sigma_I: float) -> tuple[np.ndarray, tuple[float, float]]:
        crf = PottsCRF.from_image(psi, image, lam, sigma_I, connectivity=8)
        labels = solve(crf, "expansion").labels
        return labels, energy_terms(crf, labels)

    def draw(figure: Figure, lam: float, sigma_I: float) -> None:
        labels, terms = refined(lam, sigma_I)
        seen, painted, bars = figure.subplots(1, 3)
        show(seen, overlay(image, labels, 0.4), "over the image")
        show(painted, colorize(labels), f"labels, lam = {lam:g}")
        bars.bar(["unary", "pairwise"], terms, color=[UNARY_COLOUR, PAIRWISE_COLOUR])
        bars.spines[["top", "right"]].set_visible(False)
        score = iou(confusion_matrix(y_true, labels, 4))[TARGET]
        changed = np.mean(labels != psi.argmin(axis=2))
        bars.set(ylabel="energy", title=f"target IoU {score:.3f}\nchanged pixels {changed:.1%}")

    lams, sigmas = ([(f"{value:g}", value) for value in values] for values in (LAMS, SIGMAS))
    lam = ipywidgets.SelectionSlider(options=lams, value=0.0, description="lam")
    sigma = ipywidgets.SelectionSlider(options=sigmas, value=15.0, description="sigma_I")
    stills = ({"lam": 0.0, "sigma_I": 15.0}, {"lam": 2.0, "sigma_I": 15.0}, {"lam": 32.0, "sigma_I": 200.0})
    return Explorer(draw, {"lam": lam, "sigma_I": sigma}, size=(9.0, 2.7), stills=stills)


# -------------------------------------------------------------------------------------------------------- a cut


def draw_cut(axes: Axes, psi: Float[np.ndarray, "n 2"], w: Float[np.ndarray, "m"], y: Integer[np.ndarray, "n"]) -> None:
    """Draw the graph of a row of n pixels between source and sink, and in red the arcs that a labelling cuts.

    psi: costs of the two classes. w: weights of the n - 1 pairs. Class 0 is the source's side. The title is the sum of
    what is cut.
    """
    n, cut = len(psi), 0.0
    source, sink = ((n - 1) / 2, 1.0), ((n - 1) / 2, -1.0)
    arcs = [(source, (p, 0.0), psi[p, 1], y[p] == 1) for p in range(n)]
    arcs += [((p, 0.0), sink, psi[p, 0], y[p] == 0) for p in range(n)]
    arcs += [((p, 0.0), (p + 1, 0.0), w[p], y[p] < y[p + 1]) for p in range(n - 1)]
    arcs += [((p + 1, 0.0), (p, 0.0), w[p], y[p + 1] < y[p]) for p in range(n - 1)]
    for start, end, capacity, is_cut in arcs:
        cut += capacity if is_cut else 0.0
        colour, between = "crimson" if is_cut else "0.45", start[1] == end[1]
        arrow = {"arrowstyle": "-|>", "color": colour, "linestyle": "--" if is_cut else "-", "linewidth": 1.8}
        arrow |= {"shrinkA": 13, "shrinkB": 13, "connectionstyle": f"arc3,rad={-0.4 if between else 0}"}
        axes.annotate("", end, start, arrowprops=arrow, zorder=0)
        middle = np.add(start, end) / 2 + (0.0, between * 0.3 * (end[0] - start[0]))
        axes.text(*middle, f"{capacity:g}", ha="center", va="center", color=colour, backgroundcolor="white", fontsize=9)
    nodes = [(source, TABLE, "s"), (sink, THING, "t")] + [((p, 0.0), (TABLE, THING)[y[p]], str(y[p])) for p in range(n)]
    for place, colour, name in nodes:
        axes.scatter(*place, s=420, color=[colour], edgecolor="black", zorder=2)
        axes.text(*place, name, ha="center", va="center", zorder=3)
    axes.set(xlim=(-0.6, n - 0.4), ylim=(-1.3, 1.3), title=f"labels {' '.join(map(str, y))}: cut {cut:g}")
    axes.set_axis_off()
