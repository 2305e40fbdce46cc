"""Votes that meet or miss; and pointing at a thing: its own mask and grasp, or the words that there is none."""

import numpy as np
import pytest
from scenes import box, scene

from labcourse.explorers.things import pick_a_thing, votes_that_meet
from labkit.pipeline import Pipeline
from labkit.sim.world import World


def test_the_thing_under_the_pixel_is_shown_with_its_grasp_and_the_table_with_a_reason():
    with World(scene(box("left", 0.5, 0.08), box("right", 0.55, -0.09, (0.04, 0.05, 0.1)))) as world:
        frame = world.render()
    v, u = (int(x.mean()) for x in np.nonzero(frame.instances == 1))
    explorer = pick_a_thing(frame, Pipeline(find_objects=lambda frame: frame.instances), at=(u, v))
    (axes,) = explorer.figure().axes
    assert axes.get_title().startswith(f"{np.count_nonzero(frame.instances == 1)} pixels; best grasp")
    assert len(axes.patches) == 2 and explorer.still().startswith(b"\x89PNG")
    v, u = (int(x[0]) for x in np.nonzero((frame.instances == 0) & (frame.labels == 1)))
    (axes,) = explorer.figure(u=u, v=v).axes
    assert axes.get_title().startswith("0 pixels; no grasp: no thing was found") and not axes.patches


def test_a_second_pair_of_sliders_parts_what_was_found_as_one():
    with World(scene(box("left", 0.5, 0.08), box("right", 0.55, -0.09, (0.04, 0.05, 0.1)))) as world:
        frame = world.render()
    (u, v), (not_u, not_v) = ((int(x.mean()) for x in np.nonzero(frame.instances == k)[::-1]) for k in (1, 2))
    sizes = [np.count_nonzero(frame.instances == k) for k in (1, 2)]
    explorer = pick_a_thing(frame, Pipeline(find_objects=lambda frame: (frame.instances > 0).astype(int)), at=(u, v))
    both, one = (
        explorer.figure(part=part, not_u=not_u, not_v=not_v).axes[0].get_title().partition(" pixels")[0]
        for part in (False, True)
    )
    assert int(both) == sum(sizes) and int(one) == sizes[0]
    (axes,) = explorer.figure(part=True, not_u=0, not_v=0).axes
    assert axes.get_title() and "(0, 0) is not on the thing" in axes.get_title()


@pytest.mark.parametrize(
    "side, sigma, found",
    [(36, 0.0, 2), (36, 14.0, 2), (36, 16.0, 1), (10, 0.0, 1), (12, 4.0, 1), (14, 4.0, 2)],
)
def test_two_squares_are_parted_until_their_votes_meet(side, sigma, found):
    """A spread of half of their distance makes one peak of two, and as near as 10 pixels none is looked for."""
    left, right = votes_that_meet().figure(side=side, sigma=sigma).axes
    assert left.get_title().startswith(f"{found} thing") and f"{found} peak" in right.get_title()
    if sigma == 0.0 and found == 2:
        assert left.get_title().endswith("certainty 1.00, 1.00")


def test_a_certainty_warns_before_two_squares_become_one():
    surest = [votes_that_meet().figure(side=36, sigma=sigma).axes[0].get_title() for sigma in (4.0, 14.0)]
    assert surest == ["2 things found, certainty 0.94, 0.96", "2 things found, certainty 0.25, 0.25"]
