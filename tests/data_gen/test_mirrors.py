"""Rays that are followed: what a mirror sends back, what glass lets through, and what is known of it."""

import numpy as np
import pytest

from data_gen.mirrors import GLASS, KINDS, SILVER, ball, box, follow, mirror, photographed, rectangle, tube

GRAY, WHITE = np.full((100, 100, 3), 50.0, np.float32), np.full((100, 100, 3), 200.0, np.float32)
X, Y, Z = np.eye(3)
DOWN = np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, -1.0]])  # a ray from 1 m over the table, straight down


def test_a_mirror_shows_what_is_before_it_as_far_behind_it():
    """Down to a mirror on the table, up to a ceiling 2 m over it: the mirror is 1 m away, what it shows 3 m."""
    surfaces = [rectangle((0, 0, 2), X, Y, (1, 1), picture=WHITE), rectangle((0, 0, 0), X, Y, (0.1, 0.1), back=SILVER)]
    colour, near, whole, which = follow(surfaces, *DOWN)
    assert (near[0], whole[0], which[0]) == (1.0, 3.0, 1) and colour[0] == pytest.approx(3 * [SILVER * 200.0])


def test_glass_shows_what_is_behind_it_and_a_little_of_what_is_before_it():
    """Head-on GLASS of the light comes back; almost along the pane nearly all of it (Schlick)."""
    pane = rectangle((0, 0, 0.5), X, Y, (50, 50), back=GLASS, through=True)
    surfaces = [rectangle((0, 0, s), X, Y, (50, 50), picture=picture) for s, picture in ((2, WHITE), (0, GRAY))]
    colour, near, whole, _ = follow([*surfaces, pane], *DOWN)
    assert (near[0], whole[0]) == (0.5, 1.0) and colour[0, 0] == pytest.approx(GLASS * 200.0 + (1.0 - GLASS) * 50.0)
    flat = np.array([[-8.0, 0.0, 1.0]]), np.array([[1.0, 0.0, -0.08]])
    assert follow([*surfaces, pane], *flat)[0][0, 0] > 130.0


def test_rays_meet_balls_boxes_and_tubes_where_they_are():
    def paint(Q):
        return np.zeros(Q.shape)

    side = np.array([[1.0, 0.0, 0.03]]), np.array([[-1.0, 0.0, 0.0]])
    assert ball((0, 0, 0.03), 0.03, paint=paint).meet(*side) == pytest.approx(0.97)
    assert box((0, 0, 0.05), (0.05, 0.05, 0.05), np.pi / 4.0, GRAY).meet(*side) == pytest.approx(1.0 - 0.05 * 2**0.5)
    cup = tube((0, 0, 0), 0.04, 0.1, back=GLASS, through=True)
    assert cup.meet(*side) == pytest.approx(0.96) and np.isinf(cup.meet(*DOWN)).all()
    assert cup.meet(np.zeros((1, 3)) + 0.03 * Z, np.array([[0.0, 1.0, 0.0]])) == pytest.approx(0.04), "from inside"


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_met_above_the_table(kind):
    rng = np.random.default_rng(0)
    points = rng.uniform((-0.2, -0.2, 0.3), (0.2, 0.2, 0.6), (500, 3))
    surface = mirror(kind, rng, 0.0)
    rays = (0.0, 0.0, 0.02) - points
    distance = surface.meet(points, rays)
    met = np.isfinite(distance)
    height = (points + distance[:, None] * rays)[met, 2]
    assert met.sum() > 20 and (height > -1e-9).all() and (height < 0.3).all()


def test_one_seed_gives_the_same_views():
    one, other = (photographed("pane", 3, size=(80, 60), count=3) for _ in range(2))
    assert all(np.array_equal(a.rgb, b.rgb) for a, b in zip(one.views, other.views, strict=True))
    assert len(one.views) == 3 and 0.01 < one.there.mean() < 0.3 and (one.seen[one.there] > one.depth[one.there]).all()
