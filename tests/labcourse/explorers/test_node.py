"""Explorers of topic 08: journeys of frames against a node that is simulated step by step, pairs, and redraws."""

import numpy as np
import pytest

from labcourse.explorers import node as widgets


def simulate(rate, network_ms, seconds=0.6):
    """The same node in steps of a tenth of a millisecond: one slot, and whoever is free takes what is in it."""
    waiting, until, answered = None, 0.0, []
    taken = round(seconds * rate)  # the camera goes on after these
    arrivals = {round(10 * (k * 1000 / rate + widgets.TRANSPORT_MS)): k for k in range(2 * taken)}
    for tick in range(round(10 * (1000 * seconds + 4 * network_ms + 100))):
        waiting = arrivals.get(tick, waiting)
        if waiting is not None and tick >= until - 1e-6:
            until = tick + 10 * network_ms
            answered.append(waiting)
            waiting = None
    return [k for k in answered if k < taken]


@pytest.mark.parametrize(
    "rate, network_ms", [(10, 20), (10, 150), (30, 90), (25, 40), (50, 7), (15, 290), (20, 50), (15, 200)]
)
def test_the_newest_frame_is_taken_whenever_the_node_is_free(rate, network_ms):
    found = widgets.journeys(rate, network_ms)
    assert [k for k, journey in enumerate(found) if journey.end is not None] == simulate(rate, network_ms)
    for journey in found:
        assert journey.end is None or journey.end - journey.begin == pytest.approx(network_ms)


@pytest.mark.parametrize(
    "network, speed, said",
    [
        (20, 100, "error 2.8 mm: the jaws still fit"),
        (20, 0, "error 0.0 mm"),
        (20, 300, "8.4 mm"),
        (300, 300, "hits it"),
    ],
)
def test_the_lag_explorer_says_what_the_age_costs(network, speed, said):
    line, above = widgets.lag_explorer().figure(network=network, speed=speed).axes
    assert said in above.get_title() and (network != 20 or "28 ms old" in line.get_title())


def test_pairs_appear_with_slop_and_none_is_wider():
    a, b = widgets.two_streams(12.0, 0.2)
    counts = [len(widgets.synchronised(a, b, slop)) for slop in (0, 3_000, 12_000)]
    assert counts[0] < counts[1] < counts[2]
    assert all(abs(i - j) <= 3_000 for i, j in widgets.synchronised(a, b, 3_000))
    pairs = np.array(widgets.synchronised(a, b, 12_000))
    assert len(np.unique(pairs[:, 0])) == len(pairs) == len(np.unique(pairs[:, 1]))
