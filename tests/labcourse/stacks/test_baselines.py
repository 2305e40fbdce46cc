"""The other stacks' methods, each against an independent one: OpenCV, SciPy, scikit-learn, NumPy, brute force."""

import cv2
import numpy as np
import pytest
import torch
from notebooks import ROOT, prose
from scipy import ndimage
from sklearn.cluster import KMeans

import data_gen
from labcourse.stacks import regions
from labcourse.stacks.small_fcn import SmallFCN, train_small_fcn
from labcourse.stacks.threshold import BROWN, HSVRange, fit_hsv, hsv_mask, things_on_table
from labkit.labels import OBSTACLE, SURFACE, TARGET
from labkit.learning.engines import open_shipped
from labkit.pipeline import Pipeline


@pytest.fixture(scope="module")
def frames():
    """Two scenes with different tables, small."""
    return [data_gen.render(data_gen.sample_scene(seed, "train"), (160, 120)) for seed in (630_000, 630_003)]


def iou_of(a, b):
    return np.count_nonzero(a & b) / np.count_nonzero(a | b)


@pytest.fixture(scope="module")
def twenty_scenes():
    """Twenty test scenes of which lessons 09 speak; rendering them is most of their tests' time."""
    return [data_gen.render(data_gen.sample_scene(seed, "test"), (320, 240)) for seed in range(600_016, 600_036)]


@pytest.mark.nightly
def test_in_how_many_of_twenty_scenes_a_tables_range_holds(twenty_scenes):
    """In other light and on the next table, as the lesson on colour says."""
    tables = [frame.labels == SURFACE for frame in twenty_scenes]
    ranges = [fit_hsv([frame.rgb], [table]) for frame, table in zip(twenty_scenes, tables, strict=True)]

    def holds(lit, shift=0):
        pairs = zip(ranges, np.roll(np.arange(20), -shift), strict=True)
        return sum(iou_of(hsv_mask(lit(twenty_scenes[i].rgb), own), tables[i]) >= 0.9 for own, i in pairs)

    half, quarter = holds(lambda rgb: rgb // 2), holds(lambda rgb: rgb // 4)
    yellow = holds(lambda rgb: (rgb * np.array([1.0, 0.9, 0.55])).astype(np.uint8))
    said = prose(ROOT / "lessons/09_other_stacks_colour.ipynb")
    assert f"Of twenty tables, {half} keep an IoU of 0.9 at half the light, and {quarter} at a quarter." in said
    assert f"Under the yellow lamp {yellow} do." in said
    assert f"If each range is used on the next table of the twenty, {holds(np.copy, shift=1)} keep it." in said


@pytest.mark.nightly
def test_how_many_labels_of_twenty_scenes_are_right_by_luck(twenty_scenes):
    """Where scores in NCHW order are read as NHWC."""
    engine = open_shipped("unet")
    logits = [engine.logits(frame.rgb) for frame in twenty_scenes]
    right = [np.mean(z.reshape(240, 320, 4).argmax(axis=2) == z.argmax(axis=0)) for z in logits]
    said = f"(On twenty such scenes it was {100 * min(right):.0f} to {100 * max(right):.0f} % of all."
    assert said in prose(ROOT / "lessons/09_other_stacks.ipynb")


# ------------------------------------------------------------------------------------ HSV thresholds (Java)


@pytest.mark.parametrize(
    ("low", "high"),
    [
        ((5, 50, 50), (20, 255, 255)),
        ((0, 0, 90), (179, 120, 200)),
        ((60, 3, 3), (60, 250, 250)),
        ((170, 0, 0), (9, 255, 255)),  # round through red
    ],
)
def test_a_mask_is_all_colours_within_the_bounds(low, high):
    rgb = np.random.default_rng(0).integers(0, 256, (90, 100, 3), dtype=np.uint8)
    h, s, v = cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV).transpose(2, 0, 1)
    hue = (low[0] <= h) & (h <= high[0]) if low[0] <= high[0] else (h >= low[0]) | (h <= high[0])
    inside = hue & (low[1] <= s) & (s <= high[1]) & (low[2] <= v) & (v <= high[2])
    assert np.array_equal(hsv_mask(rgb, HSVRange(low, high)), inside) and inside.any()


def test_fitting_finds_the_colours_that_made_the_mask(frames):
    for true in (HSVRange((20, 40, 60), (80, 199, 219)), HSVRange((150, 0, 40), (12, 255, 255))):
        images = [np.random.default_rng(i).integers(0, 256, (60, 80, 3), dtype=np.uint8) for i in range(2)]
        masks = [hsv_mask(rgb, true) for rgb in images]
        found = fit_hsv(images, masks)
        for rgb, mask in zip(images, masks, strict=True):
            assert iou_of(hsv_mask(rgb, found), mask) > 0.98
        assert found.wraps == true.wraps


def test_no_single_channel_of_the_fit_can_be_better(frames):
    """Brute force over all intervals of one channel, the two others as fitted."""
    rgb, mask = frames[0].rgb[::2, ::2], frames[0].labels[::2, ::2] == SURFACE
    found = fit_hsv([rgb], [mask])
    best = iou_of(hsv_mask(rgb, found), mask)
    for channel, top, step in ((0, 180, 3), (1, 256, 4), (2, 256, 4)):
        for low in range(0, top, step):
            for high in range(step - 1, top, step):
                if channel > 0 and low > high:
                    continue
                lower, upper = list(found.lower), list(found.upper)
                lower[channel], upper[channel] = low, high
                inside = hsv_mask(rgb, HSVRange(tuple(lower), tuple(upper)))
                assert not inside.any() or iou_of(inside, mask) <= best + 1e-12


def test_things_on_the_table_are_found_but_not_told_apart(frames):
    y = frames[0].labels
    things = things_on_table(y == SURFACE)
    on_table = (y == TARGET) | (y == OBSTACLE)
    assert iou_of(things, on_table) > 0.6
    assert things[y == TARGET].mean() > 0.7
    assert not things_on_table(np.zeros((5, 6), bool)).any()


# ----------------------------------------------------------------------------- regions (Mathematica)


def test_kmeans_ends_where_lloyds_algorithm_ends():
    rng = np.random.default_rng(3)
    X = np.concatenate([rng.normal(c, 1.0, (200, 3)) for c in ((0, 0, 0), (6, 0, 0), (0, 7, 2), (5, 5, 5))])
    means, labels = regions.kmeans(X, 4, seed=1)
    reference = KMeans(4, init=means, n_init=1, algorithm="lloyd").fit(X)
    assert np.allclose(reference.cluster_centers_, means, atol=1e-9), "a fixed point of scikit-learn's too"
    assert np.array_equal(reference.labels_, labels)
    free = KMeans(4, n_init=10, random_state=0).fit(X)
    assert ((X - means[labels]) ** 2).sum() <= 1.001 * free.inertia_
    assert np.array_equal(regions.kmeans(X, 4, seed=1)[0], means)


def test_an_image_of_k_colours_falls_apart_into_them():
    colours = np.array([[200, 30, 30], [30, 30, 200], [240, 240, 240]], np.uint8)
    true = np.repeat(np.repeat(np.array([[0, 1, 1], [0, 2, 1]]), 40, axis=0), 30, axis=1)
    found = regions.segment_kmeans(colours[true], 3)
    assert found.dtype == np.uint8 and (np.diff(np.bincount(found.ravel())) <= 0).all(), "largest first"
    assert all(len(np.unique(found[true == c])) == 1 for c in range(3)) and len(np.unique(found)) == 3


@pytest.mark.parametrize("connectivity", [4, 8])
def test_components_are_scipys(connectivity):
    image = np.random.default_rng(5).integers(0, 3, (23, 31))
    pieces = regions.components(image, connectivity)
    structure = ndimage.generate_binary_structure(2, connectivity // 4)
    total = 0
    for value in np.unique(image):
        reference, n = ndimage.label(image == value, structure)
        pairs = np.unique(np.stack([reference[image == value], pieces[image == value]]), axis=1)
        assert len(pairs[0]) == n == len(np.unique(pairs[1])), "one piece for one piece"
        total += n
    first = [np.flatnonzero(pieces.ravel() == i)[0] for i in range(1, total + 1)]
    assert pieces.max() == total and first == sorted(first), "numbered in reading order"


def test_measurements_are_those_of_each_pieces_pixels():
    image = np.random.default_rng(6).integers(0, 2, (20, 27))
    pieces = ndimage.label(np.kron(image, np.ones((3, 2), int)))[0]
    found = regions.region_properties(pieces)
    for i in range(pieces.max()):
        v, u = np.nonzero(pieces == i + 1)
        box = [u.min(), v.min(), u.max(), v.max()]
        assert found.area[i] == len(u) and found.box[i].tolist() == box
        assert np.allclose(found.centroid[i], (u.mean(), v.mean()))
        assert np.isclose(found.extent[i], len(u) / ((box[2] - box[0] + 1) * (box[3] - box[1] + 1)))
        assert found.at_border[i] == (0 in box[:2] or box[2] == 53 or box[3] == 59)
        low, high = np.linalg.eigvalsh(np.cov(np.stack([u, v]), bias=True) + np.eye(2) / 12)
        assert np.isclose(found.elongation[i], np.sqrt(high / low))


def test_the_region_that_looks_most_like_the_wanted_ones_is_chosen():
    rng = np.random.default_rng(0)
    sizes = zip(rng.integers(8, 12, 12), rng.integers(14, 20, 12), strict=True)
    v, u = np.mgrid[-20:40, -30:50]
    typical = regions.learn_typical([(v >= 0) & (v < h) & (u >= 0) & (u < w) for h, w in sizes])
    image = np.zeros((60, 80), int)
    image[5:15, 10:27] = 2  # as wanted
    image[30:58, 40:78] = 1  # too large
    image[40:43, 5:30] = 3  # too thin
    pieces = regions.components(image)
    m = regions.region_properties(pieces)
    assert regions.choose_region(m, typical, ~m.at_border) == pieces[10, 15]
    assert regions.choose_region(m, typical, np.zeros(len(m.area), bool)) == 0
    without = ~m.at_border & (np.arange(1, len(m.area) + 1) != pieces[10, 15])
    assert regions.choose_region(m, typical, without) in (pieces[31, 41], pieces[41, 6])


def test_pieces_are_painted_apart():
    pieces = np.arange(12).reshape(3, 4)
    painted = regions.colorize_regions(pieces).reshape(12, 3).astype(int)
    apart = np.linalg.norm(painted[:, None] - painted[None], axis=2) + 1000 * np.eye(12)
    assert (painted[0] == 0).all() and apart.min() > 20
    assert np.linalg.norm(np.diff(painted, axis=0), axis=1).min() > 80


def test_the_small_fcn_is_the_listings_and_learns(frames):
    model = SmallFCN()
    kinds = [type(layer).__name__ for layer in model.layers]
    assert kinds == ["Conv2d", "ReLU", "Conv2d", "ReLU", "Conv2d"]
    assert sum(p.numel() for p in model.parameters()) == (27 + 1) * 16 + (16 * 9 + 1) * 32 + (32 + 1) * 4 == 5220
    x = torch.rand(1, 3, 21, 21, requires_grad=True)
    assert model(x).shape == (1, 4, 21, 21), "errata: the listing's decoder for one class takes a vector of 4 numbers"
    model(x)[0, :, 10, 10].sum().backward()
    v, u = np.nonzero(x.grad[0].abs().sum(dim=0).numpy())
    assert (v.min(), v.max(), u.min(), u.max()) == (8, 12, 8, 12), "a pixel sees 5x5 pixels"
    images, labels = [f.rgb for f in frames], [f.labels for f in frames]
    trained, losses = train_small_fcn(images, labels, steps=60, crop=64)
    assert np.mean(losses[-10:]) < 0.75 * np.mean(losses[:10]) and not trained.training
    again, _ = train_small_fcn(images, labels, steps=60, crop=64)
    assert all(torch.equal(a, b) for a, b in zip(trained.parameters(), again.parameters(), strict=True))
    right = np.mean(Pipeline(trained, flip_tta=False).run(frames[0]).labels == frames[0].labels)
    assert right > np.mean(Pipeline(SmallFCN(), flip_tta=False).run(frames[0]).labels == frames[0].labels)


# ----------------------------------------------------------------------------------------------- bad input


@pytest.mark.bad_input
def test_what_does_not_fit_is_named():
    rgb, mask = np.zeros((4, 5, 3), np.uint8), np.zeros((4, 5), bool)
    cases = [
        (lambda: HSVRange((0, 0, 0), (180, 255, 255)), "upper: expected hue 0..179"),
        (lambda: HSVRange((0, 9, 0), (9, 8, 255)), "lower: expected saturation and value at most"),
        (lambda: hsv_mask(rgb.astype(float), BROWN), "rgb: expected uint8"),
        (lambda: fit_hsv([rgb], [mask]), "masks: expected some true pixels"),
        (lambda: fit_hsv([rgb], [mask[:3]]), "masks: expected the size of images"),
        (lambda: things_on_table(rgb), "table: expected shape"),
        (lambda: regions.kmeans(np.ones((9, 2)), 2), "k: expected 1 to 1"),
        (lambda: regions.kmeans(np.full((9, 2), np.nan), 2), "X: expected finite"),
        (lambda: regions.components(mask, 6), "connectivity: expected 4 or 8, got 6"),
        (lambda: regions.region_properties(mask - 1.0), "pieces: expected integers"),
        (lambda: regions.region_properties(2 * (np.arange(20).reshape(4, 5) > 3)), "none of 1"),
        (lambda: regions.learn_typical([mask]), "masks: expected at least five"),
        (lambda: train_small_fcn([], []), "labels: expected one for each"),
        (lambda: train_small_fcn([rgb], [np.full((4, 5), 7)]), "labels: expected labels 0 to 3"),
    ]
    for call, says in cases:
        with pytest.raises(ValueError, match=says):
            call()
