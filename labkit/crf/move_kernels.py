"""The two-class problems inside expansion and swap moves, written into the arcs of a grid, compiled by numba.

In both, staying on the source's side means to keep the label. Arrays have the ring of one pixel that the maximum flow
asks for; weights[n, d] belongs to pixel n and pixel n + step[d]; pixels of the ring have label RING and weight 0.
"""

import numpy as np
from numba import njit

RING = 255


@njit(cache=True)
def expansion_move(unary, weights, labels, step, alpha, capacity, excess):
    """Ask of each pixel: keep your label, or take `alpha`? Fill capacity and excess.

    With x = 1 for taking alpha, two pixels of one label disagree if x_p != x_q: an arc both ways. Two pixels of
    different labels disagree unless both take alpha: w (1 - x_p x_q) = w (1 - x_p) + w x_p (1 - x_q), which is a cost
    of keeping p and an arc from q to p. Beside a pixel of label alpha, keeping costs w.
    """
    K = len(step)
    capacity[:] = 0
    for n in range(len(labels)):
        excess[n] = 0 if labels[n] == alpha or labels[n] == RING else unary[n, alpha] - unary[n, labels[n]]
    for n in range(len(labels)):
        for d in range(K // 2):
            w = weights[n, d]
            if w == 0:
                continue
            m = n + step[d]
            if labels[n] == labels[m]:
                if labels[n] != alpha:
                    capacity[n, d] = w
                    capacity[m, K - 1 - d] = w
            elif labels[n] == alpha:
                excess[m] -= w
            elif labels[m] == alpha:
                excess[n] -= w
            else:
                excess[n] -= w
                capacity[m, K - 1 - d] = w


@njit(cache=True)
def swap_move(unary, weights, labels, step, alpha, beta, capacity, excess):
    """Ask each pixel labelled alpha (the source's side) or beta which of the two it takes. Fill capacity and excess.

    A plain minimum cut between these pixels; the others are left out, as whatever they disagree about stays. Returns
    the value of the cut that stands for the present labels.
    """
    K = len(step)
    capacity[:] = 0
    present = np.int64(0)
    for n in range(len(labels)):
        takes_part = labels[n] in (alpha, beta)
        excess[n] = unary[n, beta] - unary[n, alpha] if takes_part else 0
        present += max(excess[n], 0) if labels[n] == beta else max(-excess[n], 0)
        for d in range(K // 2):
            other = labels[n + step[d]] if weights[n, d] > 0 else RING
            if takes_part and other in (alpha, beta):
                capacity[n, d] = weights[n, d]
                capacity[n + step[d], K - 1 - d] = weights[n, d]
                if other != labels[n]:
                    present += weights[n, d]
    return present
