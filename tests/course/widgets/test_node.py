"""Explorers of topic 08: journeys of frames against a node that is simulated step by step, pairs, and redraws."""

import numpy as np
import pytest

from labkit.course.widgets import node as widgets


def simulate(rate, network_ms, seconds=0.6):
    """The same node in steps of a tenth of a millisecond: one slot, and whoever is free takes what is in it."""
    waiting, until, answered = None, 0.0, []
    arrivals = {round(10 * (k * 1000 / rate + widgets.TRANSPORT_MS)): k for k in range(round(seconds * rate))}
    for tick in range(round(10 * (1000 * seconds + 4 * network_ms + 100))):
        waiting = arrivals.get(tick, waiting)
        if waiting is not None and tick >= until - 1e-6:
            until = tick + 10 * network_ms
            answered.append(waiting)
            waiting = None
    return answered


@pytest.mark.parametrize("rate, network_ms", [(10, 20), (10, 150), (30, 90), (25, 40), (50, 7), (15, 290), (20, 50)])
def test_the_newest_frame_is_taken_whenever_the_node_is_free(rate, network_ms):
    found = widgets.journeys(rate, network_ms)
    assert [k for k, journey in enumerate(found) if journey.end is not None] == simulate(rate, network_ms)
    for journey in found:
        assert journey.end is None or journey.end - journey.begin == pytest.approx(network_ms)


def test_a_slower_network_means_older_answers_and_more_superseded_frames():
    ways = [widgets.journeys(30, network) for network in (10, 60, 200)]
    lost = [sum(journey.end is None for journey in way) for way in ways]
    ages = [max(j.end - j.taken for j in way if j.end is not None) for way in ways]
    assert lost[0] == 0 and lost == sorted(lost) and lost[2] > lost[1]
    assert ages == sorted(ages) and ages[2] > 200


def test_the_lag_explorer_says_what_the_age_costs():
    shown, said = widgets.lag_explorer(), []
    draw = shown.draw

    def listening(figure, **values):
        draw(figure, **values)
        said.append([axes.get_title() for axes in figure.axes])

    shown.draw = listening
    first = shown.png
    shown.controls["network"].value = 20
    assert shown.png != first
    shown.controls["speed"].value = 0
    shown.controls["speed"].value = 300
    shown.controls["network"].value = 300
    assert "28 ms old" in said[0][0] and "error 2.8 mm: the jaws still fit" in said[0][1]
    assert "error 0.0 mm" in said[1][1] and "error 8.4 mm" in said[2][1]
    assert "a finger hits it" in said[3][1]


def test_pairs_appear_with_slop_and_none_is_wider():
    a, b = widgets.two_streams(12.0, 0.2)
    counts = [len(widgets.synchronised(a, b, slop)) for slop in (0, 3_000, 12_000)]
    assert counts[0] < counts[1] < counts[2]
    assert all(abs(i - j) <= 3_000 for i, j in widgets.synchronised(a, b, 3_000))
    pairs = np.array(widgets.synchronised(a, b, 12_000))
    assert len(np.unique(pairs[:, 0])) == len(pairs) == len(np.unique(pairs[:, 1]))


def test_the_sync_explorer_redraws():
    shown = widgets.sync_explorer()
    pictures = {shown.png}
    for name, value in (("slop", 0.0), ("jitter", 25.0), ("lost", 0.5), ("slop", 30.0)):
        shown.controls[name].value = value
        pictures.add(shown.png)
    assert len(pictures) >= 4
