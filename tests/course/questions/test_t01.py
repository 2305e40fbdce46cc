"""The references of topic 01 are the kit's own, OpenCV's and the simulator's."""

import cv2
import numpy as np
import pytest

from data_gen import sample_scene
from labkit import labels, metrics
from labkit.course.questions.question import of_topic
from labkit.course.widgets.labels import class_of_body, raw_segmentation
from labkit.sim.world import World

QUESTIONS = of_topic("01_labels")


def class_shares(y, C):
    n = np.diagonal(metrics.confusion_matrix(y, np.where(y == 255, 0, y), C))
    return n / n.sum()


def resize_labels(y, height, width):
    return cv2.resize(y, (width, height), interpolation=cv2.INTER_NEAREST_EXACT)


KIT = {
    "one_hot": labels.one_hot,
    "from_one_hot": labels.from_one_hot,
    "class_shares": class_shares,
    "resize_labels": resize_labels,
}


@pytest.mark.parametrize("name", KIT)
def test_the_reference_is_the_kits_function(name):
    question = QUESTIONS[name]
    drawn = [question.inputs(np.random.default_rng(seed)) for seed in range(40)]
    for arguments in (*question.by_hand, *drawn):
        np.testing.assert_allclose(question.reference(*arguments), KIT[name](*arguments), rtol=1e-12)


def test_the_simulators_mask_is_decoded_to_its_labels():
    with World(sample_scene(600002, "test")) as world:
        raw, table, frame = raw_segmentation(world, (160, 120)), class_of_body(world), world.render((160, 120))
        assert raw.max() > 1 << 24  # the robot has links
        decoded = QUESTIONS["labels_from_segmentation"].reference(raw, table)
    np.testing.assert_array_equal(decoded, frame.labels)
    assert np.unique(decoded).tolist() == [0, 1, 2, 3]


def test_every_blank_has_the_kits_function_beside_it():
    assert QUESTIONS.keys() == KIT.keys() | {"labels_from_segmentation"}
