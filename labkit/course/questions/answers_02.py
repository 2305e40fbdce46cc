"""Answers to the questions of topic 02: right ones written differently, and wrong ones that students really give."""

import numpy as np
import torch

# ------------------------------------------------------------------------------------- costs from probabilities


def unary_torch(p, floor):
    """Clamp, then take the logarithm, in torch."""
    return -torch.log(torch.clamp(torch.as_tensor(p), min=floor)).numpy()


def unary_loops(p, floor):
    """Probability by probability."""
    psi = np.zeros(p.shape)
    for index in np.ndindex(*p.shape):
        psi[index] = -np.log(p[index] if p[index] > floor else floor)
    return psi


def unary_float32(p, floor):
    """In single precision, and with the cost cut off instead of the probability."""
    return np.minimum(-np.log(np.maximum(p.astype(np.float32), 1e-30)), np.float32(-np.log(floor)))


def softmaxed_again(p, floor):
    """Take the probabilities for logits."""
    e = np.exp(p)
    return -np.log(np.maximum(e / e.sum(axis=-1, keepdims=True), floor))


# --------------------------------------------------------------------------------- weights of the pairs to the right


def weights_loops(image, lam, sigma_I, sigma_p):
    """Pair by pair."""
    H, W, channels = image.shape
    w = np.zeros((H, W - 1))
    for v in range(H):
        for u in range(W - 1):
            squared = sum((float(image[v, u, k]) - float(image[v, u + 1, k])) ** 2 for k in range(channels))
            w[v, u] = lam * np.exp(-squared / (2 * sigma_I**2)) * np.exp(-1 / (2 * sigma_p**2))
    return w


def weights_einsum(image, lam, sigma_I, sigma_p):
    """With the colours divided by sigma_I first."""
    scaled = image.astype(float) / sigma_I
    d = scaled[:, 1:] - scaled[:, :-1]
    return lam * np.exp(-0.5 * (np.einsum("ijk,ijk->ij", d, d) + sigma_p**-2))


def weights_torch(image, lam, sigma_I, sigma_p):
    """In single precision."""
    x = torch.from_numpy(image.astype(np.float32))
    squared = (x[:, 1:] - x[:, :-1]).pow(2).sum(dim=2)
    return (lam * torch.exp(-squared / (2 * sigma_I**2) - 1 / (2 * sigma_p**2))).numpy()


def gaussian(squared, lam, sigma_I, sigma_p):
    """The formula for given squared differences, out of which wrong answers are made."""
    return lam * np.exp(-squared / (2.0 * sigma_I**2) - 1.0 / (2.0 * sigma_p**2))


def squares_right(image, axis=1):
    """Squared colour differences of neighbours."""
    return (np.diff(image.astype(np.float64), axis=axis) ** 2).sum(axis=2)


def wrapped_bytes(image, lam, sigma_I, sigma_p):
    """Subtract and square bytes."""
    return gaussian((np.diff(image, axis=1) ** 2).sum(axis=2, dtype=float), lam, sigma_I, sigma_p)


def converted_late(image, lam, sigma_I, sigma_p):
    """Subtract bytes, and square floats."""
    return gaussian((np.diff(image, axis=1).astype(float) ** 2).sum(axis=2), lam, sigma_I, sigma_p)


def pairs_below(image, lam, sigma_I, sigma_p):
    """The pairs of the other direction."""
    return gaussian(squares_right(image, axis=0), lam, sigma_I, sigma_p)


def without_the_2(image, lam, sigma_I, sigma_p):
    """A Gaussian without the 2 in its exponent."""
    return lam * np.exp(-squares_right(image) / sigma_I**2 - 1.0 / sigma_p**2)


def sigma_not_squared(image, lam, sigma_I, sigma_p):
    """An exponent that has a unit."""
    return lam * np.exp(-squares_right(image) / (2.0 * sigma_I) - 1.0 / (2.0 * sigma_p))


def mean_of_channels(image, lam, sigma_I, sigma_p):
    """A third of the squared length."""
    return gaussian(squares_right(image) / image.shape[2], lam, sigma_I, sigma_p)


def brightness_only(image, lam, sigma_I, sigma_p):
    """Channels added before the difference is squared."""
    return gaussian(np.diff(image.sum(axis=2, dtype=float), axis=1) ** 2, lam, sigma_I, sigma_p)


def without_distance(image, lam, sigma_I, sigma_p):
    """sigma_p forgotten."""
    return lam * np.exp(-squares_right(image) / (2.0 * sigma_I**2))


# --------------------------------------------------------------------------------------------- energy of a labelling


def energy_loops(y, psi, w_right, w_down):
    """Pixel by pixel; each asks the neighbours to its right and below."""
    H, W = y.shape
    total = 0.0
    for v in range(H):
        for u in range(W):
            total += psi[v, u, y[v, u]]
            if u < W - 1 and y[v, u] != y[v, u + 1]:
                total += w_right[v, u]
            if v < H - 1 and y[v, u] != y[v + 1, u]:
                total += w_down[v, u]
    return total


def energy_einsum(y, psi, w_right, w_down):
    """With one-hot labels: the product of two of them is 1 where they agree."""
    Y = np.eye(psi.shape[2])[y]
    agree_right = np.einsum("ijc,ijc->ij", Y[:, 1:], Y[:, :-1])
    agree_down = np.einsum("ijc,ijc->ij", Y[1:], Y[:-1])
    return (Y * psi).sum() + (w_right * (1 - agree_right)).sum() + (w_down * (1 - agree_down)).sum()


def energy_torch(y, psi, w_right, w_down):
    """In torch."""
    y, psi = torch.as_tensor(y.astype(np.int64)), torch.as_tensor(psi)
    total = psi.gather(2, y[..., None]).sum()
    total += torch.as_tensor(w_right)[y[:, 1:] != y[:, :-1]].sum()
    return float(total + torch.as_tensor(w_down)[y[1:] != y[:-1]].sum())


def energy_float32(y, psi, w_right, w_down):
    """In single precision."""
    unary = np.take_along_axis(psi.astype(np.float32), y[..., None].astype(int), axis=2).sum()
    right = (w_right.astype(np.float32) * (np.diff(y.astype(int), axis=1) != 0)).sum()
    return unary + right + (w_down.astype(np.float32) * (np.diff(y.astype(int), axis=0) != 0)).sum()


def unary_part(y, psi):
    """What the pixels cost on their own."""
    return np.take_along_axis(psi, y[..., None].astype(int), axis=2).sum()


def pair_part(y, w_right, w_down):
    """What disagreement costs."""
    return w_right[y[:, 1:] != y[:, :-1]].sum() + w_down[y[1:] != y[:-1]].sum()


def spins(y, psi, w_right, w_down):
    """Agreement is rewarded by w, disagreement costs w, as for spins of +1 and -1."""
    right, down = np.where(y[:, 1:] == y[:, :-1], -1, 1), np.where(y[1:] == y[:-1], -1, 1)
    return unary_part(y, psi) + (w_right * right).sum() + (w_down * down).sum()


def label_steps(y, psi, w_right, w_down):
    """Labels subtracted as if they were numbers."""
    right, down = np.abs(np.diff(y.astype(float), axis=1)), np.abs(np.diff(y.astype(float), axis=0))
    return unary_part(y, psi) + (w_right * right).sum() + (w_down * down).sum()


def agreement_charged(y, psi, w_right, w_down):
    """The weight paid where neighbours agree."""
    return unary_part(y, psi) + w_right.sum() + w_down.sum() - pair_part(y, w_right, w_down)


def pairs_twice(y, psi, w_right, w_down):
    """Each pair counted from both ends."""
    return unary_part(y, psi) + 2.0 * pair_part(y, w_right, w_down)


def rows_only(y, psi, w_right, w_down):
    """No pairs downward."""
    return unary_part(y, psi) + w_right[y[:, 1:] != y[:, :-1]].sum()


# --------------------------------------------------------------------------------- costs of the classes at one pixel


def icm_by_energies(y, psi, w_right, w_down, v, u):
    """The whole energy with each class at the pixel, less what does not touch the pixel."""
    costs = []
    for c in range(psi.shape[2]):
        changed = y.copy()
        changed[v, u] = c
        costs.append(energy_loops(changed, psi, w_right, w_down))
    alone_r, alone_d = w_right.copy(), w_down.copy()
    alone_r[v, max(u - 1, 0) : u + 1] = 0.0
    alone_d[max(v - 1, 0) : v + 1, u] = 0.0
    rest = energy_loops(y, psi, alone_r, alone_d) - psi[v, u, y[v, u]]
    return np.array(costs) - rest


def icm_loop(y, psi, w_right, w_down, v, u):
    """Neighbour by neighbour, class by class, in single precision."""
    costs = psi[v, u].astype(np.float32)
    for b, a in ((v, u + 1), (v, u - 1), (v + 1, u), (v - 1, u)):
        if 0 <= b < y.shape[0] and 0 <= a < y.shape[1]:
            w = w_right[v, min(u, a)] if b == v else w_down[min(v, b), u]
            for c in range(len(costs)):
                costs[c] += w if c != y[b, a] else 0.0
    return costs


def icm_padded(y, psi, w_right, w_down, v, u):
    """With a ring of pixels around the image that cost nothing."""
    Y = np.pad(np.eye(psi.shape[2])[y], ((1, 1), (1, 1), (0, 0)))
    right, down = np.pad(w_right, ((0, 0), (1, 1))), np.pad(w_down, ((1, 1), (0, 0)))
    weights = np.array([right[v, u], right[v, u + 1], down[v, u], down[v + 1, u]])
    near = np.stack([Y[v + 1, u], Y[v + 1, u + 2], Y[v, u + 1], Y[v + 2, u + 1]])
    return torch.from_numpy(psi[v, u] + weights @ (1.0 - near)).numpy()


def padded_weights(w_right, w_down, v, u):
    """Weights of the pairs to the left, right, top and bottom of a pixel, 0 outside the image."""
    right, down = np.pad(w_right, ((0, 0), (1, 1))), np.pad(w_down, ((1, 1), (0, 0)))
    return right[v, u], right[v, u + 1], down[v, u], down[v + 1, u]


def charged(weights, y, psi, v, u):
    """psi of a pixel and these weights for the neighbours to the left, right, top and bottom."""
    Y = np.pad(np.eye(psi.shape[2])[y], ((1, 1), (1, 1), (0, 0)))
    near = np.stack([Y[v + 1, u], Y[v + 1, u + 2], Y[v, u + 1], Y[v + 2, u + 1]])
    return psi[v, u] + np.array(weights) @ (1.0 - near)


def charged_for_agreeing(y, psi, w_right, w_down, v, u):
    """Every class pays for the neighbours that have it."""
    weights = np.array(padded_weights(w_right, w_down, v, u))
    return psi[v, u] + weights.sum() - (charged(weights, y, psi, v, u) - psi[v, u])


def own_weights(y, psi, w_right, w_down, v, u):
    """The weights stored at the pixel, also for the pairs behind it."""
    _, right, _, down = padded_weights(w_right, w_down, v, u)
    return charged((right, right, down, down), y, psi, v, u)


def closed_to_a_ring(y, psi, w_right, w_down, v, u):
    """Index -1 is the last row or column, so that the border has neighbours on the other side."""
    H, W = y.shape
    right, down = np.pad(w_right, ((0, 0), (0, 1)), mode="edge"), np.pad(w_down, ((0, 1), (0, 0)), mode="edge")
    weights = (right[v, u - 1], right[v, u], down[v - 1, u], down[v, u])
    near = (y[v, u - 1], y[v, (u + 1) % W], y[v - 1, u], y[(v + 1) % H, u])
    classes = np.arange(psi.shape[2])
    return psi[v, u] + sum(w * (classes != label) for w, label in zip(weights, near, strict=True))


def directions_exchanged(y, psi, w_right, w_down, v, u):
    """w_down for neighbours of one row."""
    left, right, up, down = padded_weights(w_right, w_down, v, u)
    return charged((up, down, left, right), y, psi, v, u)


def ahead_only(y, psi, w_right, w_down, v, u):
    """Only the pairs that the energy's loop visits at this pixel."""
    _, right, _, down = padded_weights(w_right, w_down, v, u)
    return charged((0.0, right, 0.0, down), y, psi, v, u)


def neighbours_only(y, psi, w_right, w_down, v, u):
    """No unary term."""
    return charged(padded_weights(w_right, w_down, v, u), y, np.zeros_like(psi), v, u)


# --------------------------------------------------------------------------------------------- arcs to the terminals


def capacities_by_difference(psi):
    """Only the difference of a pixel's two costs matters to a cut."""
    difference = psi[..., 1] - psi[..., 0]
    return np.maximum(difference, 0), np.maximum(-difference, 0), np.minimum(psi[..., 0], psi[..., 1]).sum()


def capacities_loops(psi):
    """Pixel by pixel, in single precision."""
    H, W, _ = psi.shape
    source, sink, constant = np.zeros((H, W), np.float32), np.zeros((H, W), np.float32), 0.0
    for v in range(H):
        for u in range(W):
            low = min(psi[v, u])
            source[v, u], sink[v, u] = psi[v, u, 1] - low, psi[v, u, 0] - low
            constant += low
    return source, sink, constant


def capacities_torch(psi):
    """In torch."""
    psi = torch.as_tensor(psi)
    lowest = psi.amin(dim=2, keepdim=True)
    excess = psi - lowest
    return excess[..., 1].numpy(), excess[..., 0].numpy(), float(lowest.sum())


def terminals(source, sink, constant):
    """Two (H, W) capacities and a number, as the question asks for them."""
    return source, sink, float(constant)


def source_and_sink_exchanged(psi):
    """A pixel that wants label 0 is bound to the sink."""
    lowest = psi.min(axis=2)
    return terminals(psi[..., 0] - lowest, psi[..., 1] - lowest, lowest.sum())


def with_constant(constant):
    """Right capacities, and a constant that is made of the pixels' least costs."""

    def answer(psi):
        lowest = psi.min(axis=2)
        return terminals(psi[..., 1] - lowest, psi[..., 0] - lowest, constant(lowest))

    return answer


def one_minimum_for_all(psi):
    """Right as a cut, but both arcs of a pixel stay."""
    return terminals(psi[..., 1] - psi.min(), psi[..., 0] - psi.min(), psi.min() * psi[..., 0].size)


# --------------------------------------------------------------------------------------- a lower bound from the rows


def bound_loops(psi, w_right):
    """Row by row, class by class."""
    H, W, C = psi.shape
    total = 0.0
    for v in range(H):
        best = list(psi[v, 0])
        for u in range(1, W):
            best = [
                psi[v, u, c] + min(best[k] + (w_right[v, u - 1] if k != c else 0.0) for k in range(C)) for c in range(C)
            ]
        total += min(best)
    return total


def bound_enumerated(psi, w_right):
    """All C^W labellings of each row."""
    H, W, C = psi.shape
    y = np.indices((C,) * W).reshape(W, -1)
    total = 0.0
    for v in range(H):
        costs = psi[v][np.arange(W)[:, None], y].sum(axis=0)
        total += (costs + (w_right[v][:, None] * (y[1:] != y[:-1])).sum(axis=0)).min()
    return total


def bound_torch(psi, w_right):
    """From right to left, in single precision."""
    psi, w = torch.as_tensor(psi, dtype=torch.float32), torch.as_tensor(w_right, dtype=torch.float32)
    best = psi[:, -1]
    for u in range(psi.shape[1] - 2, -1, -1):
        pair = w[:, u, None, None] * (1 - torch.eye(psi.shape[2]))
        best = psi[:, u] + (best[:, None, :] + pair).amin(dim=2)
    return float(best.amin(dim=1).sum())


def row_minima(psi, w_right):
    """The least cost of each row by the class of its last pixel, (H, C)."""
    best = psi[:, 0]
    for u in range(1, psi.shape[1]):
        best = psi[:, u] + np.minimum(best, best.min(axis=1, keepdims=True) + w_right[:, u - 1, None])
    return best


def energy_of_cheapest_classes(psi, w_right):
    """The energy of one labelling: above the minimum if anything."""
    y = psi.argmin(axis=2)
    return float(psi.min(axis=2).sum() + w_right[y[:, 1:] != y[:, :-1]].sum())


def never_looking_back(psi, w_right):
    """Walk along each row and take the cheapest class at each pixel."""
    total = 0.0
    for row, weights in zip(psi, w_right, strict=True):
        label = row[0].argmin()
        total += row[0, label]
        for costs, w in zip(row[1:], weights, strict=True):
            now = costs + w * (np.arange(len(costs)) != label)
            label = now.argmin()
            total += now[label]
    return total


def switching_for_free(psi, w_right):
    """The pixels' cheapest costs: a bound, but a weak one."""
    return psi.min(axis=2).sum()


def rows_end_alike(psi, w_right):
    """The minimum taken after the sum over the rows."""
    return row_minima(psi, w_right).sum(axis=0).min()


def next_pairs_weight(psi, w_right):
    """The weight of the pair ahead, charged for the pair behind."""
    return row_minima(psi, np.roll(w_right, -1, axis=1)).min(axis=1).sum()


def last_pixel_left_out(psi, w_right):
    """A loop that ends one column too early."""
    return row_minima(psi[:, : max(psi.shape[1] - 1, 1)], w_right).min(axis=1).sum()
