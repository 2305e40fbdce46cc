"""What the tests of the questions' references share."""

import numpy as np

from labkit.course.topics import find


def drawn(name: str, seed: int):
    """The reference of a question, and random arguments."""
    return find(name).reference, find(name).inputs(np.random.default_rng(seed))


def assert_reference_is(name: str, function, seeds=range(3)) -> None:
    """Whether the reference of a question gives what another function gives, by hand and on random arguments."""
    question = find(name)
    for arguments in (*question.by_hand, *(drawn(name, seed)[1] for seed in seeds)):
        np.testing.assert_allclose(question.reference(*arguments), function(*arguments))
