"""labkit.instance_metrics against loops written from the papers' definitions, and pairs by trying all permutations."""

from itertools import permutations

import numpy as np
import pytest

from labkit.instance_metrics import InstanceScores, edge, near, pool, score_instances, shared_pixels


def blobs(seed: int, most: int = 4, shape=(40, 56)) -> np.ndarray:
    """Up to `most` rectangles, the later ones over the earlier ones, under numbers in no order."""
    rng = np.random.default_rng(seed)
    image = np.zeros(shape, np.int32)
    for number in rng.permutation(np.arange(1, 90))[: rng.integers(1, most + 1)]:
        v, u = rng.integers(0, (30, 44))
        h, w = rng.integers(4, 22, 2)
        image[v : v + h, u : u + w] = number
    return image


def moved(image: np.ndarray, seed: int) -> np.ndarray:
    """The same things, shifted a little each, one of them cut in two, under other numbers."""
    rng = np.random.default_rng(seed)
    out = np.zeros_like(image)
    for number in np.unique(image[image > 0]):
        mask = np.roll(image == number, rng.integers(-3, 4, 2), (0, 1))
        out[mask] = number + 200
    u = np.nonzero(out == out.max())[1]
    out[:, int(np.median(u)) :][out[:, int(np.median(u)) :] == out.max()] = 7
    return out


def masks(image: np.ndarray) -> list[np.ndarray]:
    return [image == number for number in np.unique(image) if number]


def f(a: float, b: float) -> float:
    return 2 * a * b / (a + b) if a + b else 0.0


def by_hand(true: np.ndarray, found: np.ndarray):
    """Overlap and boundary, as written in the papers: the best of all assignments, the nearest of all edge pixels."""
    T, P = masks(true), masks(found)
    F = np.array([[f((t & p).sum() / p.sum(), (t & p).sum() / t.sum()) for p in P] for t in T])
    small, transposed = (F, False) if F.shape[0] <= F.shape[1] else (F.T, True)
    best = max(
        permutations(range(small.shape[1]), small.shape[0]), key=lambda way: sum(small[i, j] for i, j in enumerate(way))
    )
    pairs = [(j, i) if transposed else (i, j) for i, j in enumerate(best)]
    pairs = [pair for pair in pairs if F[pair] > 0.0]
    shared = sum((T[i] & P[j]).sum() for i, j in pairs)
    overlap = shared / sum(p.sum() for p in P), shared / sum(t.sum() for t in T)
    radius = int(np.ceil(0.003 * np.hypot(*true.shape)))
    lines = [[np.argwhere(outline(mask)) for mask in side] for side in (T, P)]

    def close(a, b):
        return sum(((b - pixel) ** 2).sum(axis=1).min(initial=9e9) <= radius**2 for pixel in a)

    right = sum(close(lines[1][j], lines[0][i]) for i, j in pairs)
    seen = sum(close(lines[0][i], lines[1][j]) for i, j in pairs)
    boundary = right / sum(map(len, lines[1])), seen / sum(map(len, lines[0]))
    return [(*two, f(*two)) for two in (overlap, boundary)], sum(F[pair] > 0.75 for pair in pairs)


def outline(mask: np.ndarray) -> np.ndarray:
    """Pixel by pixel: one of the three neighbours right and below, where there are any, is on the other side."""
    out = np.zeros(mask.shape, bool)
    for v, u in np.ndindex(mask.shape):
        for dv, du in ((0, 1), (1, 0), (1, 1)):
            w = min(v + dv, mask.shape[0] - 1), min(u + du, mask.shape[1] - 1)
            out[v, u] |= mask[v, u] != mask[w]
    return out


@pytest.mark.parametrize("seed", range(30))
def test_scores_are_those_of_the_papers(seed):
    true = blobs(seed)
    found = moved(true, seed) if seed % 2 else blobs(seed + 1000)
    scores = score_instances(true, found)
    (overlap, boundary), detected = by_hand(true, found)
    assert scores.overlap == pytest.approx(overlap) and scores.boundary == pytest.approx(boundary)
    assert scores.detected == detected
    assert (scores.true, scores.found) == (len(masks(true)), len(masks(found)))
    iou = [max((t & p).sum() / (t | p).sum() for p in masks(found)) for t in masks(true)]
    assert scores.iou == pytest.approx(iou)
    assert scores.over(0.5) == sum(np.array(iou) > 0.5) and scores.over(0.75) == sum(np.array(iou) > 0.75)
    assert scores.foreground == (((true > 0) & (found > 0)).sum(), ((true > 0) | (found > 0)).sum())


def test_greedy_pairs_would_be_others():
    """Of all pairs 1 and 6 are the most alike, and yet the best pairs are 1 with 5 and 2 with 6."""
    true = np.array([[1] * 10 + [2] * 8])
    found = np.array([[5] * 3 + [6] * 12 + [0] * 3])  # F: 1-5 6/13, 1-6 14/22, 2-5 0, 2-6 10/20
    assert score_instances(true, found).overlap[0] == (3 + 5) / 15


def test_a_radius_grows_with_the_picture():
    for shape, radius in (((480, 640), 3), ((240, 320), 2), ((10, 10), 1)):
        line = np.zeros(shape, bool)
        line[5, 5] = True
        assert np.hypot(*(np.argwhere(near(line)) - 5).T).max() == radius


def test_edges_of_a_square_by_hand():
    mask = np.zeros((6, 6), bool)
    mask[2:4, 2:4] = True
    expected = ["......", ".###..", ".#.#..", ".###..", "......", "......"]
    assert np.array_equal(edge(mask), np.array([[c == "#" for c in row] for row in expected]))
    assert not edge(np.ones((4, 4), bool)).any(), "the picture's border is no edge"


def test_numbers_mean_nothing_and_a_perfect_answer_is_perfect():
    true = blobs(3)
    other = np.where(true > 0, 300 - true, 0)
    scores = score_instances(true, other)
    assert scores.overlap == scores.boundary == (1.0, 1.0, 1.0) and scores.over(0.75) == scores.true == scores.detected
    one, two = (score_instances(image, blobs(4)) for image in (true, other))
    assert (one.overlap, one.boundary, sorted(one.iou)) == (two.overlap, two.boundary, sorted(two.iou))


def test_nothing_found_nothing_true_and_neither():
    true, nothing = blobs(1), np.zeros((40, 56), int)
    assert score_instances(true, nothing).overlap == score_instances(true, nothing).boundary == (1.0, 0.0, 0.0)
    assert score_instances(nothing, true).overlap == score_instances(nothing, true).boundary == (0.0, 1.0, 0.0)
    assert score_instances(nothing, nothing).overlap == (1.0, 1.0, 1.0)
    assert np.isnan(pool([score_instances(nothing, nothing)]).foreground_iou)


def test_ignored_pixels_belong_to_nothing_in_either_image():
    true, found = blobs(1), moved(blobs(1), 1)
    cut = np.zeros(true.shape, bool)
    cut[:, 20:] = True
    expected = score_instances(np.where(cut, 0, true), np.where(cut, 0, found))
    assert score_instances(np.where(cut, 255, true), found, ignore=255) == expected
    assert score_instances(np.where(cut, 255, true), found).true == expected.true + 1, "else 255 is a thing"


def test_shared_pixels_are_counted_thing_by_thing():
    true, found = blobs(5), blobs(6)
    shared, of_true, of_found = shared_pixels(true, found)
    T, P = masks(true), masks(found)
    assert shared.tolist() == [[(t & p).sum() for p in P] for t in T]
    assert of_true.tolist() == [t.sum() for t in T] and of_found.tolist() == [p.sum() for p in P]


def test_things_are_counted_over_all_pictures_and_precisions_averaged():
    one = InstanceScores(2, 1, (0.9, 0.0), 1, (1.0, 0.5, 0.6), (1.0, 0.4, 0.5), (50, 100))
    two = InstanceScores(1, 3, (0.6,), 0, (0.5, 1.0, 0.7), (0.2, 0.8, 0.3), (10, 20))
    scores = pool([one, two])
    assert (scores.true, scores.found, scores.over_half, scores.over_three_quarters, scores.detected) == (3, 4, 2, 1, 1)
    assert scores.overlap == pytest.approx((0.75, 0.75, 0.65)) and scores.boundary == pytest.approx((0.6, 0.6, 0.4))
    assert scores.foreground_iou == 60 / 120


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("true", "found", "says"),
    [
        (np.zeros((3, 4), int), np.zeros((4, 3), int), r"found: expected shape \(3, 4\), got \(4, 3\)"),
        (np.zeros(3, int), np.zeros(3, int), "true: expected shape"),
        (np.zeros((3, 4)), np.zeros((3, 4), int), "true: expected whole numbers of at least 0, got float64"),
        (np.zeros((3, 4), int), np.full((3, 4), -1), "found: expected whole numbers of at least 0, got int64 from -1"),
    ],
)
def test_images_that_are_no_numbers_of_things_are_named(true, found, says):
    with pytest.raises(ValueError, match=says):
        score_instances(true, found)


@pytest.mark.bad_input
def test_a_threshold_under_a_half_and_no_pictures_are_refused():
    with pytest.raises(ValueError, match=r"least: expected 0\.5 or more"):
        score_instances(blobs(1), blobs(2)).over(0.3)
    with pytest.raises(ValueError, match="scores: expected at least one picture's"):
        pool([])
