"""The explorers of topic 04: what the controls change, and that the pictures hold what the scores say."""

import numpy as np
import pytest
from scenes import random_frame

from labcourse.explorers import iou as widgets
from labkit.metrics import confusion_matrix

OUTCOMES = {name: np.array(colour) for name, colour in widgets.OUTCOMES.items()}


def painted(image, outcome):
    return np.count_nonzero((image == OUTCOMES[outcome]).all(axis=-1))


def labels(seed):
    return random_frame(seed).labels.copy()


def test_the_error_image_paints_as_many_pixels_as_the_matrix_counts():
    y_true, y_pred = labels(0), labels(1)
    y_true[:3] = 255
    n = confusion_matrix(y_true, y_pred, 4)
    for c in range(4):
        image = widgets.error_image(y_true, y_pred, c)
        assert painted(image, "right (TP)") == n[c, c]
        assert painted(image, "too much (FP)") == n[:, c].sum() - n[c, c]
        assert painted(image, "missed (FN)") == n[c].sum() - n[c, c]


@pytest.mark.parametrize("radius", [2, 5, 9, 14])
def test_a_slid_mask_loses_its_iou_and_hardly_its_accuracy(radius):
    scores = np.array([widgets.slide_scores(radius, shift) for shift in range(25)])
    assert (np.diff(scores, axis=0) <= 0.0).all() and scores[0].tolist() == [1.0, 1.0]
    share = widgets.toy_object(radius).mean()
    assert (scores[:, 0] >= 1.0 - 2.0 * share - 1e-12).all()


def test_the_pixels_of_the_chosen_cell_light_up():
    y_true, y_pred = labels(2), labels(3)
    n = confusion_matrix(y_true, y_pred, 4)
    explorer = widgets.confusion_cells(np.zeros((24, 32, 3), np.uint8), y_true, y_pred)
    for i, j in ((2, 3), (0, 1), (3, 3)):
        matrix, picture = explorer.figure(true=widgets.CLASSES[i], predicted=widgets.CLASSES[j]).axes
        lit = (np.asarray(picture.images[0].get_array()) == widgets.LIT).all(axis=-1)
        np.testing.assert_array_equal(lit, (y_true == i) & (y_pred == j))
        assert picture.get_title().startswith(f"n[{i}, {j}] = {n[i, j]}:")
        assert matrix.patches[0].get_xy() == (j - 0.5, i - 0.5)
