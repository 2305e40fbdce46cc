"""Paper questions on energies, cuts and probabilities (topic 02)."""

import numpy as np

from labcourse.exam.paper import Paper, again, blank, captioned, named, names, question, table
from labcourse.questions.t02_crf.icm_costs import icm_costs
from labcourse.questions.t02_crf.terminal_capacities import terminal_capacities
from labkit.crf.energy import PottsCRF
from labkit.crf.exact import brute_force, grid_max_flow, log_partition

NAMES = ("p", "q")


def potts(psi, lam, connectivity=4):
    """A Potts model in which each pair of neighbours that disagrees costs lam."""
    H, W, _ = psi.shape
    weights = np.zeros((connectivity // 2, H, W))
    weights[0, :, :-1] = weights[1, :-1] = lam
    if connectivity == 8:
        weights[2, :-1, :-1] = weights[3, :-1, 1:] = lam
    return PottsCRF(psi.astype(float), weights)


@question(points=4, minutes=6)
def energy_2x3(rng):
    """Compute the Potts energy of a 2x3 labelling."""
    psi, lam = rng.integers(0, 15, (2, 3, 2)), int(rng.integers(2, 9))
    y = rng.integers(0, 2, (2, 3))
    crf = potts(psi, lam)
    pairs = int((np.diff(y, axis=0) != 0).sum() + (np.diff(y, axis=1) != 0).sum())
    again(not 2 <= pairs <= 5)
    unary = int(np.take_along_axis(psi, y[..., None], -1).sum())
    return Paper(
        {"psi": psi, "lam": lam, "y": y.astype(np.uint8)},
        "<p>Each of six pixels gets one of two classes. These are their costs ψ, and a labelling y:</p><p>"
        + captioned(table(psi[..., 0]), "ψ of class 0")
        + captioned(table(psi[..., 1]), "ψ of class 1")
        + captioned(names(y), "y")
        + f"</p><p>Each pair of neighbours (right or below) with different labels costs λ = {lam}. "
        "Compute the energy of y.</p>",
        {"E(y)": crf.energy(y)},
        f"Unary costs sum to {unary}; {pairs} of 7 pairs disagree: {unary} + {pairs} · {lam}.",
        {
            "counted each pair from both ends": unary + 2 * pairs * lam,
            "counted pairs that agree": unary + (7 - pairs) * lam,
            "took diagonal neighbours for pairs, too": potts(psi, lam, 8).energy(y),
        },
    )


@question(points=3, minutes=5)
def one_pixel(rng):
    """Relabel one pixel while its neighbours stay."""
    psi, lam = rng.integers(0, 12, 3), int(rng.integers(2, 8))
    y = rng.integers(0, 3, (3, 3))
    unary = np.zeros((3, 3, 3))
    unary[1, 1] = psi
    weights = np.full((4, 3, 3), float(lam))
    weights[2:] = 0
    costs = icm_costs(y, unary, weights, 1, 1)
    again(len(set(costs.tolist())) < 3 or costs.argmin() == psi.argmin())
    around = [int(y[0, 1]), int(y[1, 0]), int(y[1, 2]), int(y[2, 1])]
    agree = psi + lam * np.array([around.count(c) for c in range(3)])
    return Paper(
        {"psi": psi, "lam": lam},
        f"<p>The four neighbours of a pixel have the labels {named(around)}. At the pixel itself, classes 0, 1 "
        f"and 2 cost ψ = {', '.join(map(str, psi))}; each neighbour with another label costs λ = {lam}.</p>"
        "<p>What does each class cost here, and which one does ICM choose?</p>",
        {"costs": costs, "class": int(costs.argmin())},
        "ψ of the class, and λ for each of the four neighbours that has another label.",
        {"paid for agreement": agree, "looked at ψ alone": {"class": int(psi.argmin())}},
    )


@question(points=4, minutes=6)
def two_pixels(rng):
    """Find the best labelling of two pixels, and when they agree."""
    psi, w = rng.integers(1, 12, (1, 2, 2)), int(rng.integers(1, 9))
    best = brute_force(potts(psi, w))
    energies = [potts(psi, w).energy(np.array([[a, b]])) for a in (0, 1) for b in (0, 1)]
    apart = psi[0].argmin(axis=-1)
    again(apart[0] == apart[1] or len(set(energies)) < 4)
    free = int(psi.min(axis=-1).sum())
    together = int(psi[0].sum(axis=0).min())
    return Paper(
        {"psi": psi, "w": w},
        "<p>Two neighbouring pixels p and q each get one of two classes. The table says what each class costs; "
        f"different labels cost w = {w}.</p>{table(psi[0].T, NAMES, ['class 0', 'class 1'])}"
        "<p>Which labelling (y<sub>p</sub>, y<sub>q</sub>) costs least, and how much? "
        "At which w do the best equal and the best different labelling cost the same?</p>",
        {"least energy": best.energy, "labels": best.labels[0].astype(int), "w of a tie": together - free},
        f"Four labellings: 00, 01, 10, 11 cost {', '.join(f'{e:g}' for e in energies)}. "
        f"Different labels cost {free} + w, equal ones at least {together}.",
        {"left the pair out": free},
    )


@question(points=3, minutes=6)
def augment(rng):
    """Push one augmenting path, and name the cut."""
    source, pair, sink = (int(x) for x in rng.integers(2, 13, 3))
    again(len({source, pair, sink}) < 3)
    weights = np.zeros((2, 1, 2), np.int64)
    weights[0, 0, 0] = pair
    flow, side = grid_max_flow(np.array([[source, -sink]]), weights, ((0, 1), (1, 0)))
    place = ["source → p", "p → q", "q → sink"][[source, pair, sink].index(flow)]
    return Paper(
        {"source": source, "pair": pair, "sink": sink, "cut": np.uint8([source, pair, sink].index(flow))},
        f"<p>In a graph these capacities are left: source → p with capacity {source}, p → q and q → p with capacity "
        f"{pair} each, q → sink with capacity {sink}.</p><p>Push as much as you can along source → p → q → sink. "
        "How much is it? Write what is then left on source → p, p → q, q → p and q → sink. Which arc is now full, so "
        "that the cut goes through it?</p>",
        {
            "flow": flow,
            "left": np.array([source - flow, pair - flow, pair + flow, sink - flow]),
            "cut": place,
        },
        "The smallest capacity is the bottleneck. The reverse arc gains what was pushed. The source still reaches "
        f"{' and '.join(name for name, near in zip(NAMES, side[0], strict=True) if near) or 'neither p nor q'}.",
        {
            "did not give the reverse arc what was pushed": {
                "left": np.array([source - flow, pair - flow, pair, sink - flow])
            }
        },
    )


@question(points=3, minutes=5)
def terminals(rng):
    """Turn costs into arcs from the source and to the sink."""
    psi = rng.integers(0, 13, (1, 3, 2))
    again((psi[..., 0] == psi[..., 1]).any() or len(set((psi[..., 1] > psi[..., 0]).ravel().tolist())) < 2)
    to_sink_side, to_source_side, constant = terminal_capacities(psi.astype(float), np.full((1, 3), -1), 1e3)
    return Paper(
        {"psi": psi},
        "<p>Each of three pixels gets one of two classes: class 0 if it stays on the source's side. The table says "
        "what each class costs.</p>"
        + table(psi[0].T, [f"pixel {i}" for i in range(3)], ["class 0", "class 1"])
        + "<p>Subtract from each pixel its smaller cost. Write the capacities source → pixel and pixel → sink, and "
        "the constant "
        "that must be added to a cut to get the energy.</p>" + blank(2, 3, left=["source →", "→ sink"]),
        {"source →": to_sink_side[0], "→ sink": to_source_side[0], "constant": constant},
        "A pixel of class 1 is cut from the source, so that arc carries the cost of class 1; one arc of each pixel "
        "is 0.",
        {"exchanged source and sink": to_source_side[0], "forgot the constant": {"constant": 0}},
    )


@question(points=4, minutes=6)
def gibbs(rng):
    """Turn energies into probabilities."""
    k, m = rng.integers(2, 7, 2), int(rng.integers(2, 7))
    psi = np.log([[[1.0, k[0]], [k[1], 1.0]]])
    crf = potts(psi, np.log(m))
    ys = [(0, 0), (0, 1), (1, 0), (1, 1)]
    Z = np.exp(log_partition(crf))
    p = np.array([np.exp(-crf.energy(np.array([y]))) / Z for y in ys])
    worth = np.array([1 / k[1], 1 / m, 1 / (k[0] * k[1] * m), 1 / k[0]])
    return Paper(
        {"k": k, "m": m},
        f"<p>The pixels p and q are neighbours. At p, class 0 costs 0 and class 1 costs ln {k[0]}; at q, class 0 costs "
        f"ln {k[1]} and class 1 costs 0. Different labels cost ln {m}.</p><p>"
        "Give exp(−E) of the four labellings 00, 01, 10 and 11, and the probability of 01 under "
        "p(y) = exp(−E(y)) / Z.</p>",
        {"exp(−E)": worth, "p(01)": p[1]},
        "exp turns sums of logarithms into products: exp(−ln a − ln b) = 1/(ab). Z is the sum of the four.",
        {"forgot to divide by Z": {"p(01)": worth[1]}},
    )
