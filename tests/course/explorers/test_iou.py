"""The explorers of topic 04: what the controls change, and that the pictures hold what the scores say."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from scenes import random_frame

from labkit.course.explorers import iou as widgets
from labkit.metrics import confusion_matrix, iou

OUTCOMES = {name: np.array(colour) for name, colour in widgets.OUTCOMES.items()}


def painted(image, outcome):
    return np.count_nonzero((image == OUTCOMES[outcome]).all(axis=-1))


def labels(seed):
    return random_frame(seed).labels


def test_the_error_image_paints_as_many_pixels_as_the_matrix_counts():
    y_true, y_pred = labels(0), labels(1)
    y_true[:3] = 255
    n = confusion_matrix(y_true, y_pred, 4)
    for c in range(4):
        image = widgets.error_image(y_true, y_pred, c)
        assert painted(image, "right (TP)") == n[c, c]
        assert painted(image, "too much (FP)") == n[:, c].sum() - n[c, c]
        assert painted(image, "missed (FN)") == n[c].sum() - n[c, c]


def test_the_picture_shines_through_where_the_class_is_not():
    rgb = np.full((24, 32, 3), 200, np.uint8)
    image = widgets.error_image(labels(0), labels(0), 2, rgb)
    assert (image[labels(0) != 2] == 70).all()


@pytest.mark.parametrize("radius", [2, 5, 9, 14])
def test_a_slid_mask_loses_its_iou_and_hardly_its_accuracy(radius):
    scores = np.array([widgets.slide_scores(radius, shift) for shift in range(25)])
    assert (np.diff(scores, axis=0) <= 0.0).all() and scores[0].tolist() == [1.0, 1.0]
    share = widgets.toy_object(radius).mean()
    assert (scores[:, 0] >= 1.0 - 2.0 * share - 1e-12).all()


def test_the_title_tells_the_scores_where_the_slider_stands():
    accuracy, score = widgets.slide_scores(5, 7)
    assert f"accuracy {accuracy:.3f}, IoU {score:.3f}" in widgets.sliding_mask().figure(shift=7).axes[1].get_title()


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


def test_the_cells_start_at_the_most_frequent_mistake():
    y_true, y_pred = np.array([[1, 1, 3, 3, 3]]), np.array([[1, 2, 0, 0, 3]])
    explorer = widgets.confusion_cells(np.zeros((1, 5, 3), np.uint8), y_true, y_pred)
    assert explorer.values == {"true": "obstacle", "predicted": "background"}


def test_the_matrix_shows_every_count():
    n = confusion_matrix(labels(4), labels(5), 4)
    axes = Figure().subplots()
    widgets.draw_matrix(axes, n)
    assert [text.get_text() for text in axes.texts] == [f"{count:,}" for count in n.ravel()]
    assert np.nanmax(iou(n)) < 1.0
