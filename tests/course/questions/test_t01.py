"""The references of topic 01 are the kit's own, OpenCV's and the simulator's."""

import cv2
import numpy as np

from labkit import labels, metrics
from labkit.course.questions.question import of_topic

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
