"""Questions of topic 08: what a segmentation node does to messages."""

import numpy as np

from labcourse.kinds import Kind, array


def ascending_stamps(axis: str, says: str, least: int = 1) -> Kind:
    """The kind of the stamps of a stream, at least so many."""

    def ascending(rng, numbers):
        return np.sort(numbers) + np.arange(len(numbers))

    said = (says, "nanoseconds", "0 or more", "ascending, none twice")
    return array(axis, 0, dtype="int64", form=ascending, lengths={axis: (least, None)}, says=said)
