"""labkit.metrics against loops written from the definitions, scikit-learn and SciPy."""

import numpy as np
import pytest
import sklearn.metrics
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import ndimage, stats

from labkit import metrics

C = 4
DTYPES = (np.int8, np.uint8, np.int32, np.int64)
untimed = settings(deadline=None)


@st.composite
def label_pairs(draw, min_dims=0, max_dims=3):
    """Draw true and predicted labels of one shape, each of its own dtype; some true ones are 255 where that fits."""
    shape = draw(hnp.array_shapes(min_dims=min_dims, max_dims=max_dims, min_side=0, max_side=7))
    true_dtype, pred_dtype = draw(st.tuples(st.sampled_from(DTYPES), st.sampled_from(DTYPES)))
    classes = [*range(C), 255] if np.iinfo(true_dtype).max >= 255 else list(range(C))
    y_true = draw(hnp.arrays(true_dtype, shape, elements=st.sampled_from(classes)))
    y_pred = draw(hnp.arrays(pred_dtype, shape, elements=st.integers(0, C - 1)))
    return y_true, y_pred


image_pairs = label_pairs(min_dims=2, max_dims=2)


def counted_by_hand(y_true, y_pred, num_classes, ignore=255):
    n = np.zeros((num_classes, num_classes), np.int64)
    np.add.at(n, (y_true[y_true != ignore], y_pred[y_true != ignore]), 1)
    return n


def random_labels(seed, shape=(48, 64), share_ignored=0.1):
    rng = np.random.default_rng(seed)
    y_true = rng.choice(C, size=shape, p=[0.5, 0.3, 0.05, 0.15]).astype(np.uint8)
    y_pred = np.where(rng.random(shape) < 0.7, y_true, rng.integers(0, C, shape)).astype(np.uint8)
    y_true[rng.random(shape) < share_ignored] = 255
    return y_true, y_pred


# Confusion matrix


@untimed
@given(label_pairs())
def test_confusion_matrix_is_the_count_by_hand_for_every_shape_dtype_and_memory_layout(pair):
    expected = counted_by_hand(*pair, C)
    for y_true, y_pred in (pair, [y.T for y in pair], [y[..., ::-1] if y.ndim else y for y in pair]):
        n = metrics.confusion_matrix(y_true, y_pred, C)
        assert n.dtype == np.int64
        np.testing.assert_array_equal(n, expected)


def test_what_is_predicted_at_an_ignored_pixel_changes_no_count():
    # Mistake 21: the loss leaves 255 out, and so must the metric, whatever stands in the prediction there.
    y_true, y_pred = random_labels(0)
    for anything in (0, 3, 255, -1, 256):
        other = np.where(y_true == 255, anything, y_pred.astype(int))
        np.testing.assert_array_equal(
            metrics.confusion_matrix(y_true, other, C), metrics.confusion_matrix(y_true, y_pred, C)
        )


@pytest.mark.parametrize("ignore", [-100, -1, 0, 3, 7, 1000])
def test_any_label_can_be_the_one_to_ignore(ignore):
    y_true, y_pred = np.array([0, 1, 2, 3, ignore]), np.array([0, 0, 2, 1, 2])
    n = metrics.confusion_matrix(y_true, y_pred, C, ignore=ignore)
    np.testing.assert_array_equal(n, counted_by_hand(y_true, y_pred, C, ignore))


def test_without_a_label_to_ignore_every_label_must_be_a_class():
    y = np.array([[0, 255]], np.uint8)
    assert metrics.confusion_matrix(y[:, :1], y[:, :1], C, ignore=None)[0, 0] == 1
    with pytest.raises(ValueError, match=r"y_true: expected labels 0 to 3, got \[255\]"):
        metrics.confusion_matrix(y, y, C, ignore=None)


# Scores


@pytest.mark.parametrize("seed", range(3))
def test_counts_and_scores_agree_with_scikit_learn(seed):
    y_true, y_pred = random_labels(seed)
    n = metrics.confusion_matrix(y_true, y_pred, C)
    precision, recall = metrics.precision_recall(n)
    pair = y_true[y_true != 255], y_pred[y_true != 255]
    np.testing.assert_array_equal(n, sklearn.metrics.confusion_matrix(*pair, labels=range(C)))
    np.testing.assert_allclose(metrics.iou(n), sklearn.metrics.jaccard_score(*pair, average=None), rtol=1e-14)
    assert metrics.mean_iou(n) == pytest.approx(sklearn.metrics.jaccard_score(*pair, average="macro"), rel=1e-14)
    assert metrics.pixel_accuracy(n) == pytest.approx(sklearn.metrics.accuracy_score(*pair), rel=1e-14)
    np.testing.assert_allclose(precision, sklearn.metrics.precision_score(*pair, average=None), rtol=1e-14)
    np.testing.assert_allclose(recall, sklearn.metrics.recall_score(*pair, average=None), rtol=1e-14)


@pytest.mark.parametrize(
    ("n", "iou", "mean", "accuracy"),
    [
        # Mistake 17: an absent class scores neither 0 nor 1, and leaves the mean alone.
        ([[6, 2, 0], [0, 4, 0], [0, 0, 0]], [3 / 4, 2 / 3, np.nan], (3 / 4 + 2 / 3) / 2, 10 / 12),
        ([[3, 1], [0, 0]], [0.75, 0.0], 0.375, 0.75),  # only predicted
        # Mistake 20: a small class has the voice of a large one in the mean, and none in the accuracy.
        ([[9900, 0], [100, 0]], [0.99, 0.0], 0.495, 0.99),
        (np.full((2, 2), 200, np.uint8), [1 / 3, 1 / 3], 1 / 3, 0.5),  # counts whose sums do not fit their dtype
        (np.zeros((2, 2), int), [np.nan, np.nan], np.nan, np.nan),
    ],
)
def test_scores_of_a_few_matrices(n, iou, mean, accuracy):
    n = np.array(n)
    np.testing.assert_allclose(metrics.iou(n), iou)
    assert metrics.mean_iou(n) == pytest.approx(mean, nan_ok=True)
    assert metrics.pixel_accuracy(n) == pytest.approx(accuracy, nan_ok=True)


# Boundaries


def band(y, c, width):
    """What repeated 3x3 erosion takes off the pixels of class c: the recipe of the paper's own code."""
    return (y == c) & ~ndimage.binary_erosion(y == c, np.ones((3, 3)), iterations=width)


def assert_counts_are_those_of_the_bands(y_true, y_pred, width):
    intersection, union = metrics.boundary_counts(y_true, y_pred, C, width)
    y_pred = np.where(y_true == 255, -1, y_pred.astype(int))
    for c in range(C):
        true, pred = band(y_true, c, width), band(y_pred, c, width)
        assert intersection[c] == np.count_nonzero(true & pred)
        assert union[c] == np.count_nonzero(true | pred)


@untimed
@given(image_pairs, st.integers(1, 4))
def test_boundary_counts_are_those_of_the_bands_that_erosion_takes_off(pair, width):
    assert_counts_are_those_of_the_bands(*pair, width)


def blobs(seed, shape=(60, 90)):
    """Draw a label image with regions, the largest of a few smoothed noises, as a scene has them."""
    noise = np.random.default_rng(seed).normal(size=(C, *shape))
    return np.stack([ndimage.gaussian_filter(channel, 6) for channel in noise]).argmax(axis=0).astype(np.uint8)


@pytest.mark.parametrize("width", [1, 3, 8])
def test_boundary_counts_of_large_regions_are_those_of_the_bands(width):
    assert_counts_are_those_of_the_bands(blobs(0), np.roll(blobs(0), 2, axis=1), width)


def test_a_batch_is_counted_image_by_image():
    y_true = np.stack([blobs(seed) for seed in range(4)]).reshape(2, 2, 60, 90)
    y_pred = np.roll(y_true, 3, axis=-1)
    each = [
        metrics.boundary_counts(t, p, C) for t, p in zip(*(y.reshape(4, 60, 90) for y in (y_true, y_pred)), strict=True)
    ]
    intersection, union = np.sum(each, axis=0)
    np.testing.assert_array_equal(metrics.boundary_counts(y_true, y_pred, C), (intersection, union))
    np.testing.assert_array_equal(metrics.boundary_iou(y_true, y_pred, C), intersection / union)
    assert np.isnan(metrics.boundary_iou(y_true[:, :0], y_pred[:, :0], C)).all()


@untimed
@given(image_pairs)
def test_a_width_that_reaches_every_pixel_gives_the_plain_iou(pair):
    plain = metrics.iou(metrics.confusion_matrix(*pair, C))
    np.testing.assert_array_equal(metrics.boundary_iou(*pair, C, width=100), plain)


def test_a_prediction_that_is_right_wherever_it_is_judged_scores_1():
    y_true = blobs(1)
    y_pred = y_true.copy()
    y_true[ndimage.binary_dilation(y_true == 2) & (y_true != 2)] = 255  # an unsure ring around class 2
    y_pred[y_true == 255] = 2
    assert np.count_nonzero(y_true == 255) > 50
    np.testing.assert_array_equal(metrics.boundary_iou(y_true, y_pred, C), np.ones(C))


def test_the_default_width_is_two_hundredths_of_the_diagonal():
    y_true, y_pred = blobs(2, (120, 160)), blobs(3, (120, 160))
    np.testing.assert_array_equal(
        metrics.boundary_counts(y_true, y_pred, C), metrics.boundary_counts(y_true, y_pred, C, width=4)
    )
    tiny = np.array([[0, 1], [1, 1]])
    np.testing.assert_array_equal(metrics.boundary_iou(tiny, tiny, 2), [1.0, 1.0])


# Lift rates


@given(st.integers(0, 30), st.integers(0, 30))
def test_a_paired_difference_agrees_with_the_coin_and_changes_sign(gained, lost):
    low, high, p = metrics.paired_difference(gained, lost, 60)
    if gained + lost:
        assert p == pytest.approx(stats.binomtest(gained, gained + lost).pvalue)
    assert low <= (gained - lost) / 60 + 1e-12 and (gained - lost) / 60 <= high + 1e-12
    assert metrics.paired_difference(lost, gained, 60) == pytest.approx((-high, -low, p))
    assert p >= 0.05 or low > 0 or high < 0  # where p tells a difference, so does the interval


def test_the_interval_of_a_paired_difference_holds_the_truth_as_often_as_it_says():
    """Where few trials differ, too: the mean of +1, -1 and 0 with 1.96 of its deviations holds it less often."""
    rng, n = np.random.default_rng(0), 40
    for only_first, only_second in ((0.1, 0.0), (0.1, 0.02), (0.05, 0.05), (0.3, 0.1)):
        counts = rng.multinomial(n, [only_first, only_second, 1 - only_first - only_second], 3000)
        ends = np.array([metrics.paired_difference(int(a), int(b), n)[:2] for a, b, _ in counts])
        truth = only_first - only_second
        assert ((ends[:, 0] <= truth) & (truth <= ends[:, 1])).mean() > 0.94


@untimed
@given(st.integers(1, 2000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))), st.floats(0.5, 0.999))
def test_wilson_interval_agrees_with_scipy_and_holds_the_rate(result, confidence):
    low, high = metrics.wilson_interval(*result, confidence)
    peer = stats.binomtest(*result).proportion_ci(confidence, method="wilson")
    assert (low, high) == pytest.approx((peer.low, peer.high), abs=1e-9)
    assert 0.0 <= low <= result[0] / result[1] <= high <= 1.0


# ---------------------------------------------------------------------------------------------------- calibration


@pytest.mark.parametrize("bins", [1, 4, 10])
def test_reliability_counts_are_those_of_a_loop(bins):
    rng = np.random.default_rng(5)
    p = np.concatenate([rng.random((3, 40)), [[0.0, 1.0] * 20]]).astype(np.float32)
    true = rng.random(p.shape) < p
    expected = np.zeros((bins, 3))
    for probability, hit in zip(p.ravel(), true.ravel(), strict=True):
        expected[min(int(probability * np.float32(bins)), bins - 1)] += (1, probability, hit)
    counts = metrics.reliability_counts(p, true, bins)
    np.testing.assert_allclose(counts, expected)
    parts = [metrics.reliability_counts(p[rows], true[rows], bins) for rows in (slice(0, 2), slice(2, 4))]
    np.testing.assert_allclose(sum(parts), counts)
    assert not metrics.reliability_counts(p[:0], true[:0]).any()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("bins", [7, 10, 100, 1000])
def test_a_probability_at_the_edge_of_two_bins_is_in_the_upper_one(bins, dtype):
    """Also where p * bins is rounded down, as 0.29 * 100 is."""
    edges = np.array([k / bins for k in range(bins + 1)], dtype)
    counts = metrics.reliability_counts(edges, edges > 2.0, bins)[:, 0]
    np.testing.assert_array_equal(counts, [1.0] * (bins - 1) + [2.0])
    below = np.nextafter(edges[1:-1], dtype(0.0))
    np.testing.assert_array_equal(metrics.reliability_counts(below, below > 2.0, bins)[:, 0], [1.0] * (bins - 1) + [0])


# ---------------------------------------------------------------------------------------------------- what is refused

ONE, Y = np.array([0, 1]), np.zeros((3, 4), int)
LABELS = [[0, 4], [0, -1], [0, 256], np.array([0, 254], np.uint8), np.array([0, 2**63], np.uint64), [0.0, 1.0]]
PREDICTED = [[0, 4], [0, -1], [0, 256], np.array([0, 255], np.uint8), [True, False], [[0, 0]], [0, 0, 0]]
NO_COUNTS = [np.zeros((2, 3), int), np.zeros(4, int), np.array([[1, -1], [0, 1]]), np.array([[np.nan]]), [["a"]]]
SCORES = metrics.iou, metrics.mean_iou, metrics.pixel_accuracy, metrics.precision_recall
REFUSED = [  # the argument that the error names, the function, its arguments
    *(("y_true", metrics.confusion_matrix, (np.asarray(y), ONE, C)) for y in LABELS),
    *(("y_pred", metrics.confusion_matrix, (ONE, np.asarray(y), C)) for y in PREDICTED),
    *(("num_classes", metrics.confusion_matrix, (ONE, ONE, classes)) for classes in (0, 256, 2.0)),
    ("y_pred", metrics.confusion_matrix, (np.array([0, 255]), np.array([-1, -1]), C)),  # also where it is ignored
    *(("n", score, (np.asarray(n),)) for score in SCORES for n in NO_COUNTS),
    ("y_true", metrics.boundary_iou, (Y + 4, Y, C)),
    ("y_true", metrics.boundary_iou, (Y[0], Y[0], C)),
    ("y_pred", metrics.boundary_iou, (Y, Y + 255, C)),
    ("y_pred", metrics.boundary_iou, (Y, Y.T, C)),
    ("width", metrics.boundary_iou, (Y, Y, C, 0)),
    ("gained", metrics.paired_difference, (-1, 0, 10)),
    ("lost", metrics.paired_difference, (1, -1, 10)),
    ("trials", metrics.paired_difference, (8, 3, 10)),
    ("trials", metrics.paired_difference, (0, 0, 0)),
    ("trials", metrics.wilson_interval, (0, 0)),
    ("successes", metrics.wilson_interval, (-1, 10)),
    ("successes", metrics.wilson_interval, (11, 10)),
    ("confidence", metrics.wilson_interval, (5, 10, 95)),
    ("p", metrics.reliability_counts, (2.0 * np.eye(2), np.eye(2) > 0)),
    ("true", metrics.reliability_counts, (np.eye(2), np.array([False]))),
    *(("bins", metrics.reliability_counts, (np.eye(2), np.eye(2) > 0, bins)) for bins in (0, -1, 2.5)),
]


@pytest.mark.bad_input
@pytest.mark.parametrize(("name", "function", "arguments"), REFUSED)
def test_what_is_refused_is_named(name, function, arguments):
    with pytest.raises(ValueError, match=f"^{name}: expected"):
        function(*arguments)
