"""CRF inference: cuts, moves and the dense CRF beside PyMaxflow, GCO and pydensecrf2.

Times are CPU seconds of one thread, the fastest of three calls in turn, medians over seeds. Instances: smooth random
label fields, logits = 2 snr onehot + 0.75 white + 0.45 correlated noise, RGB in 0..1, sigma_I = 0.12, sigma_p = 1;
easy: snr 0.55 (two classes: 0.45), lam 1.2; hard: snr 0.22 (0.15), lam 3 (4). "From the image" counts everything from
image and unary costs to labels; the peers get their weights from NumPy and take them as they are (GCO, cut) or rounded
to 1/1000 (PyMaxflow's expansion, which starts from the cheapest classes). Energies are labkit's over the peer's.
The dense CRF's lattice is a page of NumPy and sparse matrices, which can be read; the peer's is C++.
"""

import os
import time

import gco
import maxflow
import numpy as np
import pydensecrf.densecrf as peer_dense
from scipy.ndimage import gaussian_filter

from bench.measure import in_turns, table
from labkit.crf import PottsCRF, dense_crf, solve
from labkit.crf.energy import OFFSETS, pair_slices
from labkit.crf.exact import grid_max_flow

SEEDS = int(os.environ.get("LABKIT_BENCH_SEEDS", "8"))
QVGA, VGA = (240, 320), (480, 640)
SIGMA_I = 0.12


def label_field(seed: int, size: tuple[int, int], C: int, snr: float):
    """Draw a labelling of smooth regions, noisy costs of each class, and an image of the regions in [0, 1]."""
    rng = np.random.default_rng(seed)
    y = np.stack([gaussian_filter(rng.normal(size=size), 12.0) for _ in range(C)]).argmax(axis=0)
    correlated = np.stack([gaussian_filter(rng.normal(size=size), 3.0) for _ in range(C)], axis=-1)
    correlated /= correlated.std()
    z = 2.0 * snr * np.eye(C)[y] + 0.75 * rng.normal(size=(*size, C)) + 0.45 * correlated
    image = np.clip(rng.random((C, 3))[y] + 0.05 * rng.normal(size=(*size, 3)), 0.0, 1.0)
    return np.log(np.exp(z).sum(axis=-1, keepdims=True)) - z, image, y


def costs(seed: int, size: tuple[int, int], C: int, hard: bool):
    """Draw unary costs and an image, easy or hard; with the weight lam that goes with them."""
    snr, lam = ((0.15, 4.0) if hard else (0.45, 1.2)) if C == 2 else ((0.22, 3.0) if hard else (0.55, 1.2))
    psi, image, _ = label_field(seed, size, C, snr)
    return psi, image, lam


def model(psi, image, lam, connectivity: int = 4) -> PottsCRF:
    """Build labkit's model."""
    return PottsCRF.from_image(psi, image, lam, SIGMA_I, 1.0, connectivity)


def cpu_ms(ways: dict) -> list[float]:
    """CPU milliseconds of each way, the fastest of three calls, after one that loads what is compiled."""
    return [float(times[0]) for times in in_turns(ways, 1, time.process_time, best_of=3).values()]


def numpy_weights(image, lam, connectivity: int = 4) -> list:
    """The weights as a user of a peer computes them: for each direction the offset and one weight for each pair."""
    image, weights = image / SIGMA_I, []
    for offset in OFFSETS[connectivity]:
        p, q = pair_slices(offset)
        d = image[p] - image[q]
        square = d[..., 0] * d[..., 0] + d[..., 1] * d[..., 1] + d[..., 2] * d[..., 2]
        weights.append((offset, lam * np.exp(-0.5 * (square + offset[0] ** 2 + offset[1] ** 2))))
    return weights


def peer_cut(graph_type, source, sink, weights):
    """Cut in two classes with PyMaxflow; weights: one array (H, W) for each offset. Value, and 1 on the sink's side."""
    graph = graph_type(source.size, source.size * len(weights))
    nodes = graph.add_grid_nodes(source.shape)
    for offset, w in weights:
        structure = np.zeros((3, 3))
        structure[1 + offset[0], 1 + offset[1]] = 1
        graph.add_grid_edges(nodes, weights=w, structure=structure, symmetric=True)
    graph.add_grid_tedges(nodes, source, sink)
    return graph.maxflow(), graph.get_grid_segments(nodes)


def peer_cut_from_image(psi, image, lam, connectivity: int):
    """Compute the weights, and cut."""
    weights = []
    for offset, w in numpy_weights(image, lam, connectivity):
        whole = np.zeros(psi.shape[:2])
        whole[pair_slices(offset)[0]] = w
        weights.append((offset, whole))
    return peer_cut(maxflow.GraphFloat, psi[..., 1], psi[..., 0], weights)[1]


def peer_expansion(psi, image, lam):
    """Expand with PyMaxflow until a round changes nothing; the graph has one add_edges for each direction."""
    H, W, C = psi.shape
    unary, y = np.rint(1000.0 * psi).astype(np.int32), psi.argmin(axis=2)
    nodes = np.arange(H * W).reshape(H, W)
    pairs = [(*pair_slices(offset), np.rint(1000.0 * w).astype(np.int32)) for offset, w in numpy_weights(image, lam)]
    unchanged = alpha = 0
    while unchanged < C:
        graph = maxflow.GraphInt(H * W, H * W * len(pairs))
        ids = graph.add_grid_nodes((H, W))
        is_alpha = y == alpha
        keep = np.where(is_alpha, 0, np.take_along_axis(unary, y[..., None], axis=2)[..., 0])
        take = np.where(is_alpha, 0, unary[..., alpha])
        for p, q, w in pairs:
            same = y[p] == y[q]
            keep[p] += np.where(same | is_alpha[p], 0, w)
            keep[q] += np.where(is_alpha[p] & ~same, w, 0)
            back = np.where(is_alpha[p] | is_alpha[q], 0, w)
            graph.add_edges(nodes[p].ravel(), nodes[q].ravel(), np.where(same, back, 0).ravel(), back.ravel())
        graph.add_grid_tedges(ids, take, keep)
        graph.maxflow()
        takes = graph.get_grid_segments(ids) & ~is_alpha
        y[takes] = alpha
        unchanged = 0 if takes.any() else unchanged + 1
        alpha = (alpha + 1) % C
    return y


def gco_expansion(psi, image, lam):
    """Expand with GCO's grid graph (4 neighbours)."""
    (_, right), (_, down) = numpy_weights(image, lam)
    labels = gco.cut_grid_graph(psi, 1.0 - np.eye(psi.shape[2]), down, right, n_iter=-1, algorithm="expansion")
    return labels.reshape(psi.shape[:2])


def cut_ways(seed: int, hard: bool, connectivity: int) -> tuple[PottsCRF, dict]:
    """The ways to cut one instance in two: from integers to the value of the cut, and from the image to labels."""
    psi, image, lam = costs(seed, QVGA, 2, hard)
    crf = model(psi, image, lam, connectivity)
    source, sink, w = (np.rint(2.0**20 * part).astype(np.int32) for part in (psi[..., 1], psi[..., 0], crf.weights))
    listed = list(zip(crf.offsets, w, strict=True))
    straight = np.minimum(source, sink).sum(dtype=np.int64)
    return crf, {
        "labkit, integers": lambda: straight + grid_max_flow(source - sink, w, crf.offsets)[0],
        "PyMaxflow, integers": lambda: peer_cut(maxflow.GraphInt, source, sink, listed)[0],
        "labkit, image": lambda: solve(model(psi, image, lam, connectivity), "min_cut").labels,
        "PyMaxflow, image": lambda: peer_cut_from_image(psi, image, lam, connectivity).astype(np.uint8),
    }


def cut_table(seeds: int) -> str:
    """Compare the cut in two classes."""
    rows = []
    for connectivity in (4, 8):
        for hard in (False, True):
            times, same = [], True
            for seed in range(seeds):
                crf, ways = cut_ways(seed, hard, connectivity)
                times.append(cpu_ms(ways))
                value, peer_value, y, peer_y = (way() for way in ways.values())
                same &= value == peer_value and np.isclose(crf.energy(y), crf.energy(peer_y), 1e-6)
            own, peer, whole, peer_whole = np.array(times).T
            case = f"{connectivity} neighbours, {'hard' if hard else 'easy'}"
            asked = 0.9 if hard and connectivity == 4 else 0.8
            rows.append([case, *against(own, peer), *against(whole, peer_whole), asked, same])
    header = "binary cut, 320x240, CPU ms | from integers | PyMaxflow | ratio | from the image | PyMaxflow | ratio"
    return table(header + " | asked | same value", rows)


def against(own, peer) -> list[str]:
    """Cells: labkit's median, the peer's, and the median of their ratios."""
    return [f"{np.median(own):.1f}", f"{np.median(peer):.1f}", f"{np.median(own / peer):.2f}"]


def expansion_ways(seed: int, size: tuple[int, int], hard: bool) -> tuple[PottsCRF, dict]:
    """The ways to expand on one instance, from the image to labels."""
    psi, image, lam = costs(seed, size, 5, hard)
    return model(psi, image, lam), {
        "labkit": lambda: solve(model(psi, image, lam), "expansion").labels,
        "PyMaxflow": lambda: peer_expansion(psi, image, lam),
        "GCO": lambda: gco_expansion(psi, image, lam),
    }


def expansion_table(seeds: int) -> str:
    """Compare expansion."""
    rows = []
    for size in (QVGA, VGA):
        for hard in (False, True):
            times, energies = [], []
            for seed in range(seeds):
                crf, ways = expansion_ways(seed, size, hard)
                times.append(cpu_ms(ways))
                energies.append([crf.energy(way()) for way in ways.values()])
            own, *peers = np.array(times).T
            E, *others = np.array(energies).T
            for name, peer, other in zip(("PyMaxflow", "GCO"), peers, others, strict=True):
                case = f"{size[1]}x{size[0]}, {'hard' if hard else 'easy'}, {name}"
                excess = [f"{100.0 * (E.mean() / other.mean() - 1.0):+.4f}", f"{100.0 * (E / other - 1.0).max():+.4f}"]
                rows.append([case, *against(own, peer), *excess])
    header = "expansion from the image, C = 5, CPU ms | labkit | peer | ratio (asked: 0.6) | mean energy, %"
    return table(header + " | worst, % (asked: 0.01)", rows)


def dense_ways(seed: int, size: tuple[int, int], C: int) -> dict:
    """The ways to run ten iterations of the dense CRF."""
    psi, image, _ = label_field(seed, size, C, 0.55)
    image = (255.0 * image).astype(np.uint8)
    return {"labkit": lambda: dense_crf(psi, image), "pydensecrf2": lambda: peer_dense_crf(psi, image)}


def dense_table(seeds: int) -> str:
    """Compare the dense CRF."""
    rows = []
    for size, C in ((QVGA, 5), (VGA, 5), (QVGA, 21)):
        times, agree = [], []
        for seed in range(seeds):
            ways = dense_ways(seed, size, C)
            times.append(cpu_ms(ways))
            ours, theirs = (way().argmax(axis=2) for way in ways.values())
            agree.append(100.0 * (ours == theirs).mean())
        rows.append([f"{size[1]}x{size[0]}, C = {C}", *against(*np.array(times).T), f"{min(agree):.3f}"])
    header = (
        "dense CRF, CPU ms | labkit | pydensecrf2 | ratio (asked: 1.2) | same labels, %, at the least (asked: 99.9)"
    )
    return table(header, rows)


def peer_dense_crf(psi, image):
    """Run pydensecrf2 with the kernels that are labkit's defaults."""
    H, W, C = psi.shape
    crf = peer_dense.DenseCRF2D(W, H, C)
    crf.setUnaryEnergy(np.ascontiguousarray(psi.transpose(2, 0, 1).reshape(C, -1), np.float32))
    crf.addPairwiseGaussian(sxy=3, compat=3)
    crf.addPairwiseBilateral(sxy=60, srgb=10, rgbim=image, compat=10)
    return np.array(crf.inference(10)).reshape(C, H, W).transpose(1, 2, 0)


def main(seeds: int = SEEDS) -> str:
    """Measure all tables and return them in Markdown."""
    return "\n\n".join([cut_table(seeds), expansion_table(seeds), dense_table(seeds)])


if __name__ == "__main__":
    print(main())
