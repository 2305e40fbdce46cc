"""Schematics of topic 02: the factor graph of four pixels, the cut of two, and the rows and columns of the bound."""

from style import COLD, HOT, INK, SOFT, arrow, line, node, schematic, word


@schematic("02_factor_graph", width=16, height=6.6)
def factor_graph(axes) -> None:
    """Four pixels, their unary factors, the four pairs; beside it, what each kind of factor charges."""
    place = {"1": (2.2, 4.6), "2": (5.6, 4.6), "3": (2.2, 1.6), "4": (5.6, 1.6)}
    for a, b in ("12", "34", "13", "24"):
        middle = tuple((p + q) / 2 for p, q in zip(place[a], place[b], strict=True))
        line(axes, place[a], place[b])
        node(axes, middle, radius=0.24, square=True, colour=INK)
        beside = (0.0, 0.55) if a + b in ("12", "34") else (0.72, 0.0)
        word(axes, (middle[0] + beside[0], middle[1] + beside[1]), f"$w_{{{a}{b}}}$")
    for name, (x, y) in place.items():
        out = -1 if name in "13" else 1
        line(axes, (x, y), (x + 1.35 * out, y + 0.55))
        node(axes, (x + 1.35 * out, y + 0.55), radius=0.24, square=True, colour=COLD)
        word(axes, (x + 1.35 * out, y + 1.1), rf"$\psi_{name}$", colour=COLD)
        node(axes, (x, y), f"$y_{name}$", radius=0.6)
    left = 8.9
    node(axes, (left, 5.4), "$y$", radius=0.45)
    word(axes, (left + 0.8, 5.4), "a pixel's label: what we look for", ha="left")
    node(axes, (left, 3.9), radius=0.24, square=True, colour=COLD)
    word(axes, (left + 0.8, 4.1), r"unary factor $\psi_i(y_i)$:", ha="left", colour=COLD)
    word(axes, (left + 0.8, 3.55), "one line, one label", ha="left")
    node(axes, (left, 2.3), radius=0.24, square=True)
    word(axes, (left + 0.8, 2.5), r"pairwise factor $w_{ij}\,[y_i \neq y_j]$:", ha="left")
    word(axes, (left + 0.8, 1.95), "two lines, two labels", ha="left")
    word(axes, (left - 0.45, 0.8), "energy $E(y)$ = the sum of all squares", ha="left", colour=SOFT)


@schematic("02_cut", width=16, height=7.4)
def cut(axes) -> None:
    """Two pixels between source and sink: each arc with its capacity, and the cut of the labels 0, 1."""
    s, t, p, q = (4.0, 6.5), (4.0, 0.9), (1.8, 3.7), (6.2, 3.7)
    arrow(axes, s, p, r"$\psi_i(1)$", gap=0.6)
    arrow(axes, s, q, r"$\psi_j(1)$", gap=0.6, colour=HOT, dashed=True, width=2.2)
    arrow(axes, p, t, r"$\psi_i(0)$", gap=0.6, colour=HOT, dashed=True, width=2.2)
    arrow(axes, q, t, r"$\psi_j(0)$", gap=0.6)
    arrow(axes, p, q, "$w$", gap=0.6, bend=-0.3, colour=HOT, dashed=True, width=2.2)
    arrow(axes, q, p, "$w$", gap=0.6, bend=-0.3)
    node(axes, s, "s", colour=COLD)
    node(axes, t, "t", colour=HOT)
    node(axes, p, "0", colour=COLD)
    node(axes, q, "1", colour=HOT)
    word(axes, (0.75, 3.7), "i")
    word(axes, (7.25, 3.7), "j")
    left = 8.6
    word(axes, (left, 6.6), "s, the source: its side means label 0", ha="left", colour=COLD)
    word(axes, (left, 0.9), "t, the sink: its side means label 1", ha="left", colour=HOT)
    arrow(axes, (left, 5.3), (left + 1.1, 5.3))
    word(axes, (left + 1.4, 5.3), "an arc, with its capacity", ha="left")
    arrow(axes, (left, 4.5), (left + 1.1, 4.5), colour=HOT, dashed=True, width=2.2)
    word(axes, (left + 1.4, 4.5), "an arc that is cut: it leads", ha="left")
    word(axes, (left + 1.4, 3.95), "from s's side to t's side", ha="left")
    word(axes, (left, 2.9), r"this cut: $\psi_i(0) + \psi_j(1) + w$", ha="left")
    word(axes, (left, 2.25), "the energy of the labels 0, 1", ha="left", colour=SOFT)


@schematic("02_bound", width=16, height=5.2)
def bound(axes) -> None:
    """A grid of pixels as its rows plus its columns, each with a share of the unary costs."""
    for left, name, across, down in (
        (0.9, r"$E(y)$: costs $\psi$", True, True),
        (6.3, r"rows: costs $\theta$", True, False),
        (11.7, r"columns: costs $\psi - \theta$", False, True),
    ):
        places = {(v, u): (left + 1.35 * u, 4.4 - 1.2 * v) for v in range(3) for u in range(3)}
        for (v, u), at in places.items():
            if across and u < 2:
                line(axes, at, places[v, u + 1])
            if down and v < 2:
                line(axes, at, places[v + 1, u])
            node(axes, at, radius=0.3, colour=INK if across and down else COLD if across else HOT)
        word(axes, (left + 1.35, 1.15), name)
    word(axes, (5.0, 3.2), "=", size=16)
    word(axes, (10.4, 3.2), "+", size=16)
    word(axes, (8.0, 0.4), r"$\min E \;\geq\;$ the sum of the rows' minima + the sum of the columns' minima")
