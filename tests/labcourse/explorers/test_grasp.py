"""The explorers of topic 07: what the controls change, and that the pictures hold what geometry says."""

import numpy as np
import pytest

from labcourse.explorers import grasp as widgets
from labkit.grasp import principal_axis_grasp
from labkit.sim.world import World


def stick(length=0.1, breadth=0.02, yaw=0.6):
    """A grid of points, long in the direction `yaw`, on a table's corner."""
    a, b = np.meshgrid(np.linspace(-0.5, 0.5, 41) * length, np.linspace(-0.5, 0.5, 11) * breadth)
    x, y = a * np.cos(yaw) - b * np.sin(yaw), a * np.sin(yaw) + b * np.cos(yaw)
    return np.stack([x.ravel() + 0.5, y.ravel() - 0.1, np.full(x.size, 0.03)], axis=1)


def test_widths_equal_those_of_every_pair_of_points():
    P = np.random.default_rng(0).normal(size=(30, 3))
    for yaw, width in zip((0.0, 0.7, 2.0), widths_at(P, 0.0, 0.7, 2.0), strict=True):
        d = np.array([np.cos(yaw), np.sin(yaw)])
        assert np.isclose(width, max((p - q)[:2] @ d for p in P for q in P))


def widths_at(P, *yaws):
    return widgets.widths(P, np.array(yaws))


def test_a_stick_is_narrowest_across_where_the_principal_axis_grasp_closes():
    P = stick()
    yaws = np.radians(np.arange(0.0, 180.0))
    best = yaws[widgets.widths(P, yaws).argmin()]
    closing = principal_axis_grasp(P).T_base_grasp[:2, 1]
    assert abs(closing @ [np.cos(best), np.sin(best)]) > np.cos(np.radians(2.0))


@pytest.mark.parametrize("degrees", [0, 34, 90, 124])
def test_the_drawn_jaws_stand_apart_as_the_title_says_with_the_cloud_between(degrees):
    P = stick()
    above, opening = widgets.jaws_at_a_yaw(P).figure(yaw=degrees).axes
    width = widths_at(P, np.radians(degrees))[0] + widgets.AIR
    assert f"open {1000 * width:.0f} mm" in opening.get_title()
    d = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    left, right = (jaw.get_xy() @ d for jaw in above.patches)
    assert np.isclose(right.min() - left.max(), width)
    assert left.max() < (P[:, :2] @ d).min() and right.min() > (P[:, :2] @ d).max()


def test_a_ball_shows_its_camera_a_centroid_two_thirds_of_the_radius_off():
    """Pixels sample the disc that a far camera sees evenly; over it the mean of sqrt(r^2 - rho^2) is 2 r / 3."""
    clouds, centre = widgets.views("ball")
    for elevation, cloud in zip(widgets.ELEVATIONS, clouds, strict=True):
        ray = np.array([np.cos(np.radians(elevation)), 0.0, np.sin(np.radians(elevation))])
        offset = cloud.mean(axis=0) - centre
        assert np.isclose(offset @ ray, 2 / 3 * widgets.RADIUS, rtol=0.06)
        assert np.linalg.norm(offset - offset @ ray * ray) < 0.001
        assert np.allclose(np.linalg.norm(cloud - centre, axis=1), widgets.RADIUS, atol=0.002)


@pytest.mark.parametrize("friction", [0.2, 0.4, 0.8])
def test_a_can_holds_inside_the_friction_cone_and_slips_outside(friction):
    """The offset at which the contact's angle is the cone's: half a pad, and radius times the sine of the cone."""
    limit = 0.0174 / 2 + widgets.CAN_RADIUS * np.sin(np.arctan(friction))
    assert np.isclose(np.tan(widgets.contact_angle(limit)), friction)
    assert widgets.lift_can(limit - 0.002, friction)[0].success
    assert widgets.lift_can(limit + 0.002, friction)[0].reason in ("slipped", "missed")


def test_two_pads_carry_twice_the_friction_of_their_force():
    friction, force = 0.2, 20.0  # N, the effort of a finger
    limit = 2.0 * friction * force / 9.81
    assert widgets.lift_can(0.0, friction, 0.8 * limit)[0].success
    assert not widgets.lift_can(0.0, friction, 1.05 * limit)[0].success


def test_a_can_9_mm_off_meets_the_pads_with_a_facet_that_leans_by_half_a_32nd_of_a_turn(monkeypatch):
    """Lesson 07, mechanics: the simulated can is a prism, so it slips where a circle of the same radius would hold."""
    leans = []

    def step_and_look(self, *arguments):
        step(self, *arguments)
        for contact in self.client.getContactPoints(self.robot, self.bodies["can"]):
            if contact[9] > 5.0:  # the normal force, N
                leans.append(np.degrees(np.arccos(abs(contact[7][1]))))

    step = World.step
    monkeypatch.setattr(World, "step", step_and_look)
    assert widgets.lift_can(0.009, 0.1)[0].reason == "slipped"
    assert abs(np.median(leans) - 360 / 32 / 2) < 0.2 and np.degrees(widgets.contact_angle(0.009)) < 0.7
    assert widgets.lift_can(0.009, 0.1, 0.03)[0].success


@pytest.mark.parametrize("offset, friction, said", [(8, 0.1, "inside, it holds"), (20, 0.2, "outside, it slips")])
def test_the_drawn_cones_say_whether_the_line_of_force_is_inside(offset, friction, said):
    above, curve = widgets.friction_cones().figure(offset=offset, friction=friction).axes
    assert said in curve.get_title()
    (line,) = above.lines
    contacts = np.column_stack(line.get_data())
    assert np.allclose(np.hypot(*(contacts - [offset, 0.0]).T), 1000 * widgets.CAN_RADIUS)
    assert np.isclose(*contacts[:, 0])
