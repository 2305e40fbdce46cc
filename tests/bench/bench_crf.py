"""CRF inference: cuts, moves and certificates beside PyMaxflow, GCO and pydensecrf2.

Times are CPU seconds of one thread, medians over seeds, the ways in turn on each seed. Instances: smooth random label
fields, logits = 2 snr onehot + 0.75 white + 0.45 correlated noise, RGB in 0..1, sigma_I = 0.12, sigma_p = 1; easy: snr
0.55 (two classes: 0.45), lam 1.2; hard: snr 0.22 (0.15), lam 3 (4). Cuts start from the same integers and end with
labels; expansion starts from the model alone, PyMaxflow's from the cheapest classes; that one builds its graph with one
add_edges for each direction. Energies are labkit's over the peer's.
"""

import os
import subprocess
import sys
import time

import numpy as np
from scipy.ndimage import gaussian_filter

from labkit.crf import PottsCRF, dense_crf, solve
from labkit.crf.energy import pair_slices
from labkit.crf.exact import grid_max_flow
from labkit.crf.integers import quantise

try:
    import maxflow
except ImportError:
    maxflow = None
try:
    import gco
except ImportError:
    gco = None
try:
    import pydensecrf.densecrf as peer_dense
except ImportError:
    peer_dense = None

SEEDS = int(os.environ.get("LABKIT_BENCH_SEEDS", "8"))
QVGA, VGA = (240, 320), (480, 640)


def label_field(seed: int, size: tuple[int, int], C: int, snr: float):
    """Draw a labelling of smooth regions, noisy costs of each class, and an image of the regions in [0, 1]."""
    rng = np.random.default_rng(seed)
    y = np.stack([gaussian_filter(rng.normal(size=size), 12.0) for _ in range(C)]).argmax(axis=0)
    correlated = np.stack([gaussian_filter(rng.normal(size=size), 3.0) for _ in range(C)], axis=-1)
    correlated /= correlated.std()
    z = 2.0 * snr * np.eye(C)[y] + 0.75 * rng.normal(size=(*size, C)) + 0.45 * correlated
    image = np.clip(rng.random((C, 3))[y] + 0.05 * rng.normal(size=(*size, 3)), 0.0, 1.0)
    return np.log(np.exp(z).sum(axis=-1, keepdims=True)) - z, image, y


def instance(seed: int, size: tuple[int, int], C: int, hard: bool, connectivity: int = 4) -> PottsCRF:
    """Build an easy or a hard model."""
    snr, lam = ((0.15, 4.0) if hard else (0.45, 1.2)) if C == 2 else ((0.22, 3.0) if hard else (0.55, 1.2))
    psi, image, _ = label_field(seed, size, C, snr)
    return PottsCRF.from_image(psi, image, lam, 0.12, 1.0, connectivity)


def timed(way, *arguments, **options):
    """Call and return the result and the CPU seconds of it."""
    start = time.process_time()
    result = way(*arguments, **options)
    return result, time.process_time() - start


def own_cut(integer, offsets):
    """Cut in two classes with labkit, from integers to labels: value and labels."""
    straight = integer.unary.min(axis=2).sum(dtype=np.int64)
    flow, source_side = grid_max_flow(integer.unary[..., 1] - integer.unary[..., 0], integer.weights, offsets)
    return int(straight) + flow, source_side == 0


def peer_cut(integer, offsets):
    """Cut in two classes with PyMaxflow, from integers to labels: value and labels."""
    H, W, _ = integer.unary.shape
    graph = maxflow.GraphInt(H * W, H * W * len(offsets))
    nodes = graph.add_grid_nodes((H, W))
    for w, offset in zip(integer.weights, offsets, strict=True):
        structure = np.zeros((3, 3))
        structure[1 + offset[0], 1 + offset[1]] = 1
        graph.add_grid_edges(nodes, weights=w, structure=structure, symmetric=True)
    graph.add_grid_tedges(nodes, integer.unary[..., 1], integer.unary[..., 0])
    return graph.maxflow(), graph.get_grid_segments(nodes)


def peer_expansion(crf: PottsCRF):
    """Expand with PyMaxflow until a round changes nothing."""
    H, W, C = crf.shape
    integer = quantise(crf)
    unary, y = integer.unary, crf.unary.argmin(axis=2)
    nodes = np.arange(H * W).reshape(H, W)
    pairs = [(*pair_slices(offset), w) for offset, w in zip(crf.offsets, integer.weights, strict=True)]
    unchanged = alpha = 0
    while unchanged < C:
        graph = maxflow.GraphInt(H * W, H * W * len(pairs))
        ids = graph.add_grid_nodes((H, W))
        is_alpha = y == alpha
        keep = np.where(is_alpha, 0, np.take_along_axis(unary, y[..., None], axis=2)[..., 0])
        take = np.where(is_alpha, 0, unary[..., alpha])
        for p, q, w in pairs:
            w = w[p]
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


def gco_expansion(crf: PottsCRF):
    """Expand with GCO's grid graph (4 neighbours)."""
    H, W, C = crf.shape
    right, down = np.ascontiguousarray(crf.weights[0][:, :-1]), np.ascontiguousarray(crf.weights[1][:-1])
    labels = gco.cut_grid_graph(crf.unary, 1.0 - np.eye(C), down, right, n_iter=-1, algorithm="expansion")
    return labels.reshape(H, W)


def table(header: str, rows: list[str]) -> str:
    """Put rows under a header in Markdown."""
    return "\n".join([f"| {header} |", "|---" * (header.count("|") + 1) + "|", *(f"| {row} |" for row in rows)])


def cut_table(seeds: int) -> str:
    """Compare the cut in two classes."""
    rows = []
    for connectivity in (4, 8):
        for hard in (False, True):
            own, peer, same = [], [], True
            for seed in range(-1, seeds):  # the first only loads what is compiled
                crf = instance(seed % seeds, QVGA, 2, hard, connectivity)
                integer = quantise(crf)
                (value, _), seconds = timed(own_cut, integer, crf.offsets)
                (peer_value, _), peer_seconds = timed(peer_cut, integer, crf.offsets) if maxflow else ((value, 0), 0)
                same &= value == peer_value
                if seed >= 0:
                    own.append(seconds)
                    peer.append(peer_seconds)
            name = f"{connectivity} neighbours, {'hard' if hard else 'easy'}"
            rows.append(f"{name} | {1e3 * np.median(own):.1f} | {against(own, peer, maxflow, 1e3)} | {same}")
    return table("binary cut, 320x240, ms | labkit | PyMaxflow | ratio (asked: 0.8) | same cut value", rows)


def against(own, peer, installed, unit: float = 1.0) -> str:
    """Write a peer's median and labkit's time relative to it."""
    if not installed:
        return "not installed | "
    return f"{unit * np.median(peer):.{1 if unit > 1 else 2}f} | {np.median(np.divide(own, peer)):.2f}"


def expansion_table(seeds: int) -> str:
    """Compare expansion."""
    rows = []
    for size in (QVGA, VGA):
        for hard in (False, True):
            runs = {"labkit": [], "PyMaxflow": [], "GCO": []}
            for seed in range(seeds):
                crf = instance(seed, size, 5, hard)
                result, seconds = timed(solve, crf, "expansion")
                runs["labkit"].append((seconds, result.energy))
                for name, peer, way in (("PyMaxflow", maxflow, peer_expansion), ("GCO", gco, gco_expansion)):
                    if peer:
                        y, seconds = timed(way, crf)
                        runs[name].append((seconds, crf.energy(y)))
            own = np.array(runs["labkit"])
            for name in ("PyMaxflow", "GCO"):
                case = f"{size[1]}x{size[0]}, {'hard' if hard else 'easy'}, {name} | {np.median(own[:, 0]):.2f}"
                if not runs[name]:
                    rows.append(f"{case} | not installed | | |")
                    continue
                peer = np.array(runs[name])
                excess = 100.0 * (own[:, 1] / peer[:, 1] - 1.0)
                mean = 100.0 * (own[:, 1].mean() / peer[:, 1].mean() - 1.0)
                rows.append(f"{case} | {against(own[:, 0], peer[:, 0], True)} | {mean:+.4f} | {excess.max():+.4f}")
    header = "expansion, C = 5, s | labkit | peer | ratio (asked: 0.7) | mean energy, % | worst, % (asked: 0.01)"
    return table(header, rows)


def default_table(seeds: int) -> str:
    """Measure the default method's certificate and time."""
    rows = []
    for size in (QVGA, VGA):
        for connectivity in (4, 8):
            for hard in (False, True):
                found = [timed(solve, instance(seed, size, 5, hard, connectivity)) for seed in range(seeds)]
                gaps = [100.0 * result.gap for result, _ in found]
                limit = ("1 s" if size == QVGA else "4 s") if not hard else ""
                rows.append(
                    f"{size[1]}x{size[0]}, {connectivity} neighbours, {'hard' if hard else 'easy'} | "
                    f"{np.median([s for _, s in found]):.2f} | {limit} | {np.median(gaps):.4f} | {max(gaps):.4f} | "
                    f"{0.3 if hard else 0.02}"
                )
    return table("default method, C = 5 | CPU s | asked | gap, % | largest gap, % | asked", rows)


def dense_table(seeds: int) -> str:
    """Compare the dense CRF, 10 iterations."""
    rows = []
    for size, C in ((QVGA, 5), (VGA, 5), (QVGA, 21)):
        own, peer, agree = [], [], []
        for seed in range(-1, seeds):
            psi, image, _ = label_field(seed % seeds, size, C, 0.55)
            image = (255.0 * image).astype(np.uint8)
            q, seconds = timed(dense_crf, psi, image)
            if peer_dense:
                peer_q, peer_seconds = timed(peer_dense_crf, psi, image)
            if seed >= 0:
                own.append(seconds)
                peer.append(peer_seconds if peer_dense else 0.0)
                agree.append(100.0 * (q.argmax(axis=2) == peer_q.argmax(axis=2)).mean() if peer_dense else np.nan)
        rows.append(
            f"{size[1]}x{size[0]}, C = {C} | {np.median(own):.2f} | {against(own, peer, peer_dense)} | {min(agree):.3f}"
        )
    return table(
        "dense CRF, s | labkit | pydensecrf2 | ratio (asked: 1.2) | same labels, %, at the least (asked: 99.9)", rows
    )


def peer_dense_crf(psi, image):
    """Run pydensecrf2 with the kernels that are labkit's defaults."""
    H, W, C = psi.shape
    crf = peer_dense.DenseCRF2D(W, H, C)
    crf.setUnaryEnergy(np.ascontiguousarray(psi.transpose(2, 0, 1).reshape(C, -1), np.float32))
    crf.addPairwiseGaussian(sxy=3, compat=3)
    crf.addPairwiseBilateral(sxy=60, srgb=10, rgbim=image, compat=10)
    return np.array(crf.inference(10)).reshape(C, H, W).transpose(1, 2, 0)


def growth_table() -> str:
    """Show how the default method's time and gap grow with the image and with the number of classes."""
    rows = []
    cases = [((120, 160), 5), (QVGA, 5), (VGA, 5), ((960, 1280), 5), (QVGA, 2), (QVGA, 10), (QVGA, 21)]
    for (H, W), C in cases:
        crf = instance(0, (H, W), C, hard=False)
        result, seconds = timed(solve, crf)
        cost = 1e9 * seconds / (H * W * C)
        rows.append(f"{W}x{H} | {C} | {seconds:.3f} | {cost:.0f} | {result.iterations} | {100.0 * result.gap:.4f}")
    header = "default method, easy, 4 neighbours | C | CPU s | ns a pixel and class | sweeps and moves | gap, %"
    return table(header, rows)


def memory_table() -> str:
    """Measure the peak of resident memory while solving, in a process of its own; the model's own arrays are added."""
    if not os.path.exists("/proc/self/clear_refs"):
        return ""
    rows = []
    pairs = VGA[0] * VGA[1] * 5
    model = 8.0 * (1.0 + 2.0 / 5.0)  # float64: unary, and two weights for five classes
    for method in ("expansion", "trws", "trws+expansion"):
        # Every array is mapped and unmapped on its own, so that freed ones do not hide new ones.
        done = subprocess.run(
            [sys.executable, "-m", "tests.bench.bench_crf", method],
            env={**os.environ, "MALLOC_MMAP_THRESHOLD_": "65536"},
            capture_output=True,
            text=True,
            check=True,
        )
        each = float(done.stdout) / pairs
        rows.append(f"{method} | {each:.1f} | {each + model:.1f} | 60")
    header = "peak memory, bytes a pixel and class, 640x480, C = 5 | solver | with the model | asked"
    return table(header, rows)


def peak_bytes(method: str) -> int:
    """Solve once and return by how much the resident memory rose at its peak."""

    def status(field):
        with open("/proc/self/status") as lines:
            return next(int(line.split()[1]) for line in lines if line.startswith(field)) * 1024

    solve(instance(0, (20, 30), 5, hard=False), method)
    crf = instance(0, VGA, 5, hard=False)
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")  # the peak is counted from now on
    before = status("VmRSS")
    solve(crf, method)
    return status("VmHWM") - before


def main(seeds: int = SEEDS) -> str:
    """Measure all tables and return them in Markdown."""
    for C, connectivity in ((2, 4), (5, 4), (5, 8)):  # load what is compiled
        solve(instance(0, (20, 30), C, False, connectivity))
    tables = [cut_table(seeds), expansion_table(seeds), default_table(seeds), dense_table(seeds)]
    return "\n\n".join([*tables, memory_table(), growth_table()])


if __name__ == "__main__":
    print(peak_bytes(sys.argv[1]) if len(sys.argv) > 1 else main())
