"""The references of topic 04 are the kit's own scores."""

import numpy as np

from labkit import metrics
from labkit.course.questions.question import of_topic

QUESTIONS = of_topic("04_iou")


def boundary_band(mask, width):
    """The band as the kit counts it: the pixels that the count loses when the mask loses them."""
    labels = mask.astype(np.uint8)
    whole = metrics.boundary_counts(labels, labels, 2, width)[0][1]
    band = np.zeros_like(mask)
    for v, u in np.argwhere(mask):
        without = labels.copy()
        without[v, u] = 0  # its neighbours may join the band for that, but none leaves it
        band[v, u] = metrics.boundary_counts(without, labels, 2, width)[0][1] < whole
    return band


KIT = {
    "confusion_matrix": metrics.confusion_matrix,
    "iou": metrics.iou,
    "precision_recall": metrics.precision_recall,
    "mean_iou": lambda n_frames: metrics.mean_iou(n_frames.sum(axis=0)),
    "boundary_band": boundary_band,
}
