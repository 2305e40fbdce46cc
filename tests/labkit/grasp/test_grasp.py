"""The grasp planner: measured against PyBullet's gripper, and against brute force on scenes whose answer is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from labkit.grasp import Gripper, plan_grasps, principal_axis_grasp
from labkit.grasp.surroundings_kernels import hidden_points
from labkit.sim.client import Client
from labkit.sim.collision import hulls
from labkit.sim.kinematics import HAND_TO_GRASP, PANDA_URDF
from labkit.sim.shapes import data_path

TABLE = 0.02
SPACING = 0.003
YAWS = (0.0, 0.25, 0.5, 0.785)


def box(size, centre=(0.5, 0.0), yaw=0.0, sides=("x", "-x", "y", "-y")):
    """Points on the top and the sides of a box that stands on the table; `sides` in the box's own frame."""
    length, width, height = size
    x, y, z = (np.linspace(-s / 2, s / 2, int(s / SPACING) + 2) for s in size)
    faces = [np.stack(np.meshgrid(x, y, [height / 2]), -1)]
    for side in sides:
        at = -1.0 if side[0] == "-" else 1.0
        grid = ([at * length / 2], y, z) if side[-1] == "x" else (x, [at * width / 2], z)
        faces.append(np.stack(np.meshgrid(*grid), -1))
    points = np.vstack([face.reshape(-1, 3) for face in faces])
    return Rotation.from_euler("z", yaw).apply(points) + np.array([*centre, TABLE + height / 2])


def ring(radius, height, wall, centre=(0.5, 0.0)):
    """Points on a cup without a bottom: the walls inside and outside, and the rim between them."""
    angle = np.linspace(0.0, 2.0 * np.pi, int(2.0 * np.pi * radius / SPACING), endpoint=False)
    z = np.linspace(0.0, height, int(height / SPACING))
    rows = [(r, h) for r in (radius, radius - wall) for h in z] + [(radius - wall / 2, height)]
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.vstack([np.column_stack([r * circle + centre, np.full(len(angle), TABLE + h)]) for r, h in rows])


def table(centre=(0.5, 0.0), half=0.25):
    x, y = np.meshgrid(np.arange(-half, half, 0.005), np.arange(-half, half, 0.005))
    return np.column_stack([x.ravel() + centre[0], y.ravel() + centre[1], np.full(x.size, TABLE)])


def scene(*clouds):
    return np.vstack([*clouds, table()])


def closing(grasp):
    """The angle of the closing direction, in degrees, modulo 180."""
    y = grasp.T_base_grasp[:3, 1]
    return np.degrees(np.arctan2(y[1], y[0])) % 180.0


def angle_between(a, b):
    return abs((a - b + 90.0) % 180.0 - 90.0)


def hand_contents(grasp, points):
    """How many points lie half a millimetre or more within the hulls of palm and fingers, without maps and margins.

    The planner's map has cells of 4 mm: under the slanted root of a finger a point may graze the hull.
    """
    T_hand_base = np.linalg.inv(grasp.T_base_grasp)
    P_hand = points @ T_hand_base[:3, :3].T + T_hand_base[:3, 3] + (0.0, 0.0, HAND_TO_GRASP)
    open_by = {"hand": 0.0, "left finger": grasp.width / 2, "right finger": -grasp.width / 2}
    return sum(hulls()[name].holds(P_hand - (0.0, off, 0.0), -0.0005).sum() for name, off in open_by.items())


def tips(grasp):
    return grasp.T_base_grasp[2, 3] - Gripper().tips_below_grasp


# The gripper --------------------------------------------------------------------------------------------------------


def panda():
    """Vertices of the hand's and of one finger's collision shape in the hand's frame, and the finger's travel."""
    client = Client()
    robot = client.loadURDF(str(data_path() / PANDA_URDF), useFixedBase=True)
    links = {client.getJointInfo(robot, j)[12].decode(): j for j in range(client.getNumJoints(robot))}
    shapes = {}
    for name in ("panda_hand", "panda_leftfinger"):
        vertices = np.array(client.getMeshData(robot, links[name])[1])  # in the frame of the link's inertia
        shapes[name] = vertices + client.getDynamicsInfo(robot, links[name])[3]
    to_finger = np.array(client.getJointInfo(robot, links["panda_leftfinger"])[14])
    to_finger += client.getDynamicsInfo(robot, links["panda_hand"])[3]
    shapes["panda_leftfinger"] = shapes["panda_leftfinger"] + to_finger
    to_grasp = np.array(client.getJointInfo(robot, links["panda_grasptarget"])[14])
    to_grasp += client.getDynamicsInfo(robot, links["panda_hand"])[3]
    travel = client.getJointInfo(robot, links["panda_leftfinger"])[9]
    client.close()
    return shapes["panda_hand"], shapes["panda_leftfinger"], to_grasp, travel


def test_gripper_has_the_measures_of_the_urdf_and_its_model_holds_the_whole_hand():
    hand, finger, to_grasp, travel = panda()
    gripper, above_tips = Gripper(), finger[:, 2].max() - finger[:, 2]
    flat = finger[(abs(finger[:, 1]) < 2e-4) & (above_tips > 0.002)]
    measured = {
        "tips_below_grasp": finger[:, 2].max() - to_grasp[2],
        "finger_width": np.ptp(finger[:, 0]),
        "palm_above_tips": finger[:, 2].max() - hand[:, 2].max(),
        "tip_thickness": finger[above_tips < 0.001, 1].max(),
        "root_thickness": finger[:, 1].max(),
        "pad_width": np.ptp(flat[:, 0]),
    }
    assert {name: getattr(gripper, name) for name in measured} == pytest.approx(measured, abs=2e-4)
    slope = (gripper.root_thickness - gripper.tip_thickness) / gripper.root_above_tips
    assert (finger[:, 1] <= np.minimum(gripper.tip_thickness + slope * above_tips, gripper.root_thickness) + 1e-4).all()
    low = finger[:, 2].max() - hand[:, 2] < gripper.body_above_tips
    assert (2 * abs(hand[:, 0]) <= np.where(low, gripper.palm_width, gripper.body_width) + 1e-4).all()
    assert gripper.palm_length >= 2 * abs(hand[:, 1]).max()
    assert gripper.max_opening == pytest.approx(2 * travel, abs=1e-6)


# What a good grasp is -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("yaw", [0.0, 0.3, 0.8, 1.4, 2.2, 2.9])
def test_closes_across_the_short_side_of_a_box(yaw):
    target = box((0.075, 0.03, 0.04), centre=(0.52, -0.04), yaw=yaw)
    best, *others = plan_grasps([target], scene(target), TABLE).grasps
    assert angle_between(closing(best), np.degrees(yaw) + 90.0) < 4.0
    assert np.linalg.norm(best.T_base_grasp[:2, 3] - (0.52, -0.04)) < 0.006
    assert 0.034 < best.width <= Gripper().max_opening
    scores = [grasp.score for grasp in (best, *others)]
    assert others and scores == sorted(scores, reverse=True) and scores[-1] > 0.0 and scores[0] <= 1.0
    for grasp in (best, *others):
        np.testing.assert_allclose(grasp.T_base_grasp[:3, 2], (0.0, 0.0, -1.0))
        assert Rotation.from_matrix(grasp.T_base_grasp[:3, :3]).as_matrix() == pytest.approx(grasp.T_base_grasp[:3, :3])


def test_walls_on_both_sides_turn_the_grasp():
    target = box((0.05, 0.035, 0.05))  # alone, it is held across y
    walls = [box((0.12, 0.01, 0.05), centre=(0.5, y)) for y in (-0.035, 0.035)]
    alone = plan_grasps([target], scene(target), TABLE).grasps[0]
    between = plan_grasps([target], scene(target, *walls), TABLE).grasps[0]
    assert angle_between(closing(alone), 90.0) < 4.0
    assert angle_between(closing(between), 0.0) < 15.0


def test_a_wide_cup_is_held_by_its_rim():
    cup = ring(radius=0.06, height=0.06, wall=0.005)
    best = plan_grasps([cup], scene(cup), TABLE).grasps[0]
    offset = best.T_base_grasp[:2, 3] - (0.5, 0.0)
    assert np.linalg.norm(offset) == pytest.approx(0.0575, abs=0.008)
    assert angle_between(closing(best), np.degrees(np.arctan2(offset[1], offset[0]))) < 25.0
    assert best.width < 0.04


def test_prefers_jaws_that_come_down_where_the_camera_looked():
    target = box((0.04, 0.04, 0.05), sides=("-y",))  # the camera looks along y: the far side is in shadow
    ground = table()
    shadow = (abs(ground[:, 0] - 0.5) < 0.03) & (ground[:, 1] > -0.02) & (ground[:, 1] < 0.08)
    seen = np.vstack([target, ground[~shadow]])
    best = plan_grasps([target], seen, TABLE, camera_position=np.array([0.5, -0.6, 0.5])).grasps[0]
    assert angle_between(closing(best), 0.0) < 20.0


def test_low_obstacles_may_stand_under_the_palm_and_high_ones_may_not():
    target = box((0.05, 0.03, 0.03))

    def best(height):
        posts = [box((0.02, 0.02, height), centre=(0.5, y)) for y in (-0.09, 0.09)]
        return plan_grasps([target], scene(target, *posts), TABLE).grasps[0]

    assert angle_between(closing(best(0.035)), 90.0) < 4.0
    assert angle_between(closing(best(0.09)), 90.0) > 10.0


def test_several_targets_are_told_apart_and_one_without_a_grasp_hides_no_other():
    sizes = ((0.05, 0.03, 0.04), (0.12, 0.11, 0.05), (0.05, 0.03, 0.04))
    targets = [box(size, (0.5, y), 0.4) for size, y in zip(sizes, (-0.12, 0.0, 0.13), strict=True)]
    plan = plan_grasps(targets, scene(*targets), TABLE)
    assert {grasp.target for grasp in plan.grasps} == {0, 2} and plan.reason == ""
    for grasp in plan.grasps:
        others = [np.linalg.norm(target[:, :2] - grasp.T_base_grasp[:2, 3], axis=1).min() for target in targets]
        assert np.argmin(others) == grasp.target


def test_tall_things_are_held_as_low_as_the_palm_lets():
    post = box((0.03, 0.03, 0.15))
    best = plan_grasps([post], scene(post), TABLE).grasps[0]
    top = TABLE + 0.15
    assert top - 0.047 < tips(best) < top - 0.03


# No candidate -------------------------------------------------------------------------------------------------------


TOO_WIDE = "too wide for the gripper in every direction"
BLOCK = box((0.05, 0.05, 0.04))
# At a corner of a wide box the jaws would fit, and squeeze it out: the two faces there are at right angles.
HOPELESS = [((box((edge, edge, 0.05), yaw=yaw),), TOO_WIDE) for edge in (0.085, 0.1, 0.11, 0.13) for yaw in YAWS]
HOPELESS += [((table(half=0.02) + np.array([0.0, 0.0, h]),), "too flat") for h in (0.0, 0.003, 0.007)]
HOPELESS += [
    ((BLOCK, ring(0.055, 0.04, wall=0.01)), "no room for the fingers beside the target"),
    (
        (box((0.03, 0.03, 0.03)), ring(0.08, 0.12, wall=0.01)),
        "no room for the palm: something beside the target is too high",
    ),
]


@pytest.mark.parametrize(("clouds", "reason"), HOPELESS)
def test_where_nothing_can_be_held_there_is_a_reason(clouds, reason):
    plan = plan_grasps([clouds[0]], scene(*clouds), TABLE)
    assert plan.grasps == () and reason in plan.reason


@pytest.mark.parametrize("yaw", YAWS)
def test_what_just_fits_is_held_by_its_faces(yaw):
    target = box((0.07, 0.07, 0.05), yaw=yaw)
    plan = plan_grasps([target], scene(target), TABLE)
    off = [min(angle_between(closing(g), np.degrees(yaw) + turn) for turn in (0.0, 90.0)) for g in plan.grasps]
    assert off and max(off) < 12.0


def test_no_target_is_a_reason():
    nothing = np.zeros((0, 3))
    assert plan_grasps([], table(), TABLE).reason == "no target points"
    assert plan_grasps([nothing, nothing], table(), TABLE).reason == "no target points"
    assert plan_grasps([], nothing, TABLE).grasps == ()
    wide = box((0.12, 0.11, 0.05))
    plan = plan_grasps([wide, nothing, wide], scene(wide), TABLE)
    assert plan.reason == f"{TOO_WIDE}; no target points"
    point = np.array([[0.5, 0.0, TABLE + 0.03]])  # hardly anything, and no error
    best = plan_grasps([point], scene(point), TABLE).grasps[0]
    np.testing.assert_allclose(best.T_base_grasp[:2, 3], (0.5, 0.0), atol=0.005)


# What must hold in every scene --------------------------------------------------------------------------------------

sizes = st.tuples(st.floats(0.02, 0.07), st.floats(0.02, 0.07), st.floats(0.02, 0.1))
yaws = st.floats(0.0, np.pi)
clutter = st.lists(st.tuples(sizes, st.floats(0.05, 0.12), st.floats(0.0, 2 * np.pi), yaws), max_size=4)


@settings(max_examples=25, deadline=None)
@given(size=sizes, yaw=yaws, others=clutter)
def test_no_point_is_within_the_hand_and_tips_stay_above_the_table(size, yaw, others):
    target = box(size, yaw=yaw)
    around = [box(s, (0.5 + r * np.cos(t), r * np.sin(t)), turn) for s, r, t, turn in others]
    seen = scene(target, *around)
    for grasp in plan_grasps([target], seen, TABLE, camera_position=np.array([1.0, 0.2, 0.7])).grasps:
        assert tips(grasp) > TABLE + 0.003
        assert 0.0 < grasp.width <= Gripper().max_opening
        assert hand_contents(grasp, seen) == 0


@settings(max_examples=25, deadline=None)
@given(yaw=yaws, x=st.floats(-0.1, 0.1), y=st.floats(-0.1, 0.1))
def test_grasp_turns_and_moves_with_the_scene(yaw, x, y):
    def best(turn, shift):
        target = box((0.07, 0.03, 0.04)) - (0.5, 0.0, 0.0)
        wall = box((0.03, 0.03, 0.06), centre=(0.57, 0.0)) - (0.5, 0.0, 0.0)
        R = Rotation.from_euler("z", turn)
        moved = [R.apply(cloud) + shift for cloud in (target, wall, table() - (0.5, 0.0, 0.0))]
        return plan_grasps([moved[0]], np.vstack(moved), TABLE).grasps[0]

    still, moved = best(0.0, (0.5, 0.0, 0.0)), best(yaw, (0.5 + x, y, 0.0))
    assert angle_between(closing(moved), closing(still) + np.degrees(yaw)) < 12.0
    offset = Rotation.from_euler("z", yaw).inv().apply(moved.T_base_grasp[:3, 3] - (0.5 + x, y, 0.0))
    np.testing.assert_allclose(offset, still.T_base_grasp[:3, 3] - (0.5, 0.0, 0.0), atol=0.012)
    assert moved.width == pytest.approx(still.width, abs=0.01)


def test_the_order_of_points_does_not_matter():
    target, other = box((0.07, 0.03, 0.04), yaw=0.4), box((0.03, 0.03, 0.06), centre=(0.57, 0.02))
    rng = np.random.default_rng(0)
    plans = [plan_grasps([rng.permutation(target)], rng.permutation(scene(target, other)), TABLE) for _ in range(3)]
    for plan in plans[1:]:
        np.testing.assert_allclose(plan.grasps[0].T_base_grasp, plans[0].grasps[0].T_base_grasp, atol=1e-9)


# Shadows ------------------------------------------------------------------------------------------------------------


def test_hidden_points_lie_on_the_rays_that_graze_a_wall():
    camera, top = np.array([1.0, 0.0, 0.6]), 0.08
    y = np.arange(-0.2, 0.2, 0.002)
    wall = np.column_stack([np.full(len(y), 0.55), y, np.full(len(y), top)])
    before = table()[table()[:, 0] > 0.55]  # of the table behind the wall the camera sees nothing here
    hidden = hidden_points(np.vstack([wall, before]), (0.5, 0.0), 0.1, 0.004, camera)
    hidden = hidden[hidden[:, 2] > 0.001]
    behind = hidden[:, 0] < 0.54
    assert behind.sum() > 500
    share = (camera[0] - hidden[behind, 0]) / (camera[0] - 0.55)  # along the ray, from the camera over the wall's top
    np.testing.assert_allclose(hidden[behind, 2], camera[2] - share * (camera[2] - top), atol=0.004)


@settings(max_examples=10, deadline=None)
@given(height=st.floats(0.06, 0.1), azimuth=st.floats(0.0, 2 * np.pi), elevation=st.floats(0.4, 1.1))
def test_nothing_taller_can_hide_than_the_bound_says(height, azimuth, elevation):
    """March along rays to places behind a block: the highest that the block covers is no higher than the bound."""
    outward = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    camera = 0.9 * np.array(outward) + (0.5, 0.0, TABLE)

    def covered(P):
        ray = camera + np.linspace(0.6, 1.0, 200)[:, None, None] * (P - camera)
        within = (abs(ray[..., :2] - (0.5, 0.0)) < 0.02).all(axis=-1) & (ray[..., 2] < TABLE + height)
        return within.any(axis=0)

    ground = np.stack(np.meshgrid(np.arange(0.33, 0.67, 0.003), np.arange(-0.17, 0.17, 0.003)), -1).reshape(-1, 2)
    ground = np.column_stack([ground, np.full(len(ground), TABLE)])
    dark = covered(ground)
    seen = np.vstack([box((0.04, 0.04, height)), ground[~dark]])
    hidden = hidden_points(seen, (0.5, 0.0), 0.17, 0.004, camera)
    lit = cKDTree(np.vstack([ground[~dark], box((0.04, 0.04, height))])[:, :2])
    deep = dark & (lit.query(ground[:, :2])[0] > 0.006) & (abs(ground[:, :2] - (0.5, 0.0)) < 0.16).all(axis=1)
    assert deep.any()
    for place in ground[deep][::7]:
        column = np.column_stack([np.broadcast_to(place[:2], (40, 2)), np.linspace(TABLE, TABLE + height, 40)])
        highest = column[covered(column), 2].max(initial=TABLE)
        near = np.linalg.norm(hidden[:, :2] - place[:2], axis=1) < 0.006
        assert hidden[near, 2].max(initial=TABLE + 0.004) > highest - 0.012


# The simple entrance -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("yaw", [0.0, 0.7, 2.0])
def test_principal_axis_grasp_is_at_the_centroid_across_the_long_direction(yaw):
    target = box((0.09, 0.03, 0.04), yaw=yaw)
    grasp = principal_axis_grasp(target, TABLE)
    np.testing.assert_allclose(grasp.T_base_grasp[:2, 3], target[:, :2].mean(axis=0), atol=1e-12)
    assert angle_between(closing(grasp), np.degrees(yaw) + 90.0) < 1.0
    assert tips(grasp) >= TABLE
    assert grasp.width == Gripper().max_opening


# Bad input ----------------------------------------------------------------------------------------------------------


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"targets": [np.full((5, 3), np.nan)]}, r"targets\[0\]: expected finite"),
        ({"targets": [np.zeros((5, 3)), np.zeros((5, 2))]}, r"targets\[1\]: expected shape"),
        ({"targets": [1000.0 * box((0.05, 0.03, 0.04))]}, r"targets\[0\]: expected metres"),
        ({"scene": np.full((5, 3), np.inf)}, "scene: expected finite"),
        ({"scene": 1000.0 * table()}, "scene: expected metres"),
        ({"table_z": 20.0}, "table_z: expected metres"),
        ({"camera_position": np.zeros(2)}, "camera_position: expected shape"),
        ({"camera_position": np.array([400.0, 0.0, 900.0])}, "camera_position: expected metres"),
    ],
)
def test_bad_arguments_are_named(changed, says):
    good = {"targets": [box((0.05, 0.03, 0.04))], "scene": table(), "table_z": TABLE}
    with pytest.raises(ValueError, match=f"^{says}"):
        plan_grasps(**{**good, **changed})


GRIPPERS = {"max_opening": 140, "palm_length": 0.0, "finger_width": np.nan, "tips_below_grasp": -0.01}
GRIPPERS |= {"tip_thickness": 0.03, "pad_width": 0.03, "root_above_tips": 0.05}  # with the Panda's other measures


@pytest.mark.bad_input
def test_measures_that_no_gripper_has_are_named_and_an_empty_cloud_has_no_grasp():
    for name, measure in GRIPPERS.items():
        with pytest.raises(ValueError, match=f"^{name}: expected"):
            Gripper(**{name: measure})
    with pytest.raises(ValueError, match="cloud"):
        principal_axis_grasp(np.zeros((0, 3)))
