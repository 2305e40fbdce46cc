"""Wrong answers that readers of the lessons gave: each is refused, and told what is wrong with it.

ACCEPTED were right by mistake once; NAMED are told by a hint alone, without a look at their program. Those that are
among a question's listed mistakes are tried by test_questions.
"""

import numpy as np
import pytest

from labkit.course.checker.run import judge
from labkit.course.topics import find

pytestmark = pytest.mark.bad_input  # without the shape checks, as outside the suite


def shifted_by_the_mean(z):
    e = np.exp(z - z.mean(axis=-1, keepdims=True))
    return e / e.sum(axis=-1, keepdims=True)


def counted_in_two_bytes(y_true, y_pred, num_classes, ignore):
    n = np.zeros((num_classes, num_classes), np.uint16)
    counted = y_true != ignore
    np.add.at(n, (y_true[counted], y_pred[counted]), 1)
    return n


def with_a_finite_penalty(features, mean, covariance, allowed):
    off = features - mean
    squared = (off @ np.linalg.inv(covariance) * off).sum(axis=1)
    return (squared + 1e9 * ~allowed).argmin() + 1 if allowed.any() else 0


def of_most_density(features, mean, covariance, allowed):
    off = features - mean
    density = np.exp(-(off @ np.linalg.inv(covariance) * off).sum(axis=1) / 2)
    return np.where(allowed, density, -1.0).argmax() + 1 if allowed.any() else 0


def nearest_of_its_suitors(a, b, slop):
    """Of those of a whose nearest is a stamp of b, the nearest to it; where any of a might be nearer."""
    if len(b) == 0:
        return np.full(len(a), -1)
    apart = np.abs(a[:, None] - b)
    best = apart.argmin(axis=1)
    suitors = np.where(np.arange(len(b)) == best[:, None], apart, np.iinfo(np.int64).max)
    chosen = suitors.argmin(axis=0)[best] == np.arange(len(a))
    return np.where(chosen & (apart.min(axis=1) <= slop), best, -1)


def no_small_turn(stamps, positions, quaternions, t):
    i = int(np.clip(np.searchsorted(stamps, t) - 1, 0, len(stamps) - 2))
    p, q = find("08_node.pose_at").reference(stamps, positions, quaternions, t)
    still = np.isclose(abs(quaternions[i] @ quaternions[i + 1]), 1.0) and stamps[0] <= t <= stamps[-1]
    return p, quaternions[i] if still else q


def blob_of_doubles(bgr, multiple):
    return find("09_other_stacks.make_blob").reference(bgr, multiple).astype(float)


def stamps_instead_of_numbers(a, b, slop):
    j = find("08_node.pair_stamps").reference(a, b, slop)
    return np.where(j < 0, -1, b[j]) if len(b) else j


def gradient_by_one_maximum(z, y):
    e = np.exp(z - z.max())
    p = e / e.sum(axis=-1, keepdims=True)
    return np.where(y[..., None] == 255, 0.0, p - (y[..., None] == np.arange(z.shape[-1])))


def signs_by_the_first(stamps, positions, quaternions, t):
    """All quaternions on the side of the first, where neighbours should be on one side."""
    signs = np.where(quaternions @ quaternions[0] < 0.0, -1.0, 1.0)
    if not stamps[0] <= t <= stamps[-1]:
        return np.full(3, np.nan), np.full(4, np.nan)
    i = min(int(np.searchsorted(stamps, t, side="right")) - 1, len(stamps) - 2)
    share = (t - stamps[i]) / (stamps[i + 1] - stamps[i])
    a, b = (signs[:, None] * quaternions)[i : i + 2]
    angle = max(np.arccos(np.clip(a @ b, -1.0, 1.0)), 1e-6)
    q = np.sin((1 - share) * angle) * a + np.sin(share * angle) * b
    return (1 - share) * positions[i] + share * positions[i + 1], q / np.linalg.norm(q)


def by_a_number(base, order):
    def answer(rgb, palette):
        weights = np.array([base**2, base, 1])[::order]
        same = (rgb @ weights)[..., None] == palette @ weights
        return np.where(same.any(axis=-1), same.argmax(axis=-1), 255)

    return answer


def classes_of_the_labels(y, psi, weights, v, u):
    return find("02_crf.icm_costs").reference(y, psi[..., : y.max() + 1], weights, v, u)


def twelve_links(segmentation, class_of_body):
    labels = np.zeros(segmentation.shape, np.uint8)
    for link in range(-1, 12):
        seen = segmentation >> 24 == link + 1
        labels[seen] = class_of_body[segmentation[seen] & 0xFFFFFF]
    return labels


def as_tall_as_seen(P, table_z, palm, tips, clearance):
    """The top is taken for the table plus how tall the object looks, though its foot may be hidden."""
    return max(table_z + np.ptp(P[:, 2]) - palm, P[:, 2].min(), table_z + clearance) + tips


ACCEPTED = [
    ("01_labels.labels_from_segmentation", twelve_links),
    *(("01_labels.labels_from_colours", by_a_number(base, order)) for base in (10, 16, 255) for order in (1, -1)),
    ("02_crf.icm_costs", classes_of_the_labels),
    ("07_grasp.grasp_height", as_tall_as_seen),
    ("03_gradient.cross_entropy_grad", gradient_by_one_maximum),
    ("03_gradient.softmax", shifted_by_the_mean),
    ("04_iou.confusion_matrix", counted_in_two_bytes),
    ("09_other_stacks.choose_region", with_a_finite_penalty),
    ("09_other_stacks.choose_region", of_most_density),
    ("09_other_stacks.make_blob", blob_of_doubles),
    ("08_node.pair_stamps", nearest_of_its_suitors),
    ("08_node.pose_at", no_small_turn),
    ("08_node.pose_at", signs_by_the_first),
]


@pytest.mark.parametrize("name, answer", ACCEPTED)
def test_what_was_accepted_by_mistake_is_refused(name, answer):
    for seed in (0, 1, 2, 16):
        assert not judge(find(name), answer, seed).passed


def centroid_v_u(pieces):
    area, centroid, box = find("09_other_stacks.measure_pieces").reference(pieces)
    return area, centroid[:, ::-1], box


def in_metres(T_base_grasp, middle):
    return tuple(mm / 1000.0 for mm in find("07_grasp.slip_across").reference(T_base_grasp, middle))


def means_exchanged(z, y, w):
    return find("05_class_weights.two_means").reference(z, y, w)[::-1]


def plane_with_the_old_d(P, sigma):
    n, d = find("06_back_projection.fit_plane").reference(P, sigma)
    return n, -d if P[0, 2] == 1.0 else d  # n was turned in one case


def planes_up_to_the_largest(y, C):
    return np.stack([y == c for c in range(y.max() + 1)], axis=-1).astype(int)


NAMED = [
    ("08_node.pair_stamps", stamps_instead_of_numbers, "not a stamp"),
    ("01_labels.one_hot", planes_up_to_the_largest, "nothing to stack"),
    ("09_other_stacks.measure_pieces", centroid_v_u, "Output 2 of 3"),
    ("07_grasp.slip_across", in_metres, "1000"),
    ("05_class_weights.two_means", means_exchanged, "Outputs 1 and 2 are exchanged"),
    ("06_back_projection.fit_plane", plane_with_the_old_d, "n . m = d"),
]


@pytest.mark.parametrize("name, answer, says", NAMED)
def test_what_was_only_counted_is_named(name, answer, says):
    assert says in judge(find(name), answer, seed=0).hint
