"""The arm: its kinematics against PyBullet, its planner against PyBullet's collision checks, and honest lifts."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pybullet
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import box, scene
from scipy.spatial.transform import Rotation

from labkit.grasp import Grasp, GraspPlan
from labkit.labels import OBSTACLE, TARGET
from labkit.sim import collision, kinematics, planning
from labkit.sim.client import Client
from labkit.sim.kinematics import HOME, LOWER, MAX_EFFORT, MAX_VELOCITY, UPPER
from labkit.sim.panda import ARM_JOINTS, FINGER_JOINTS, Panda
from labkit.sim.shapes import data_path
from labkit.sim.spec import ObjectSpec
from labkit.sim.world import World

Q_HOME = np.array(HOME[:7])
NOTHING = np.zeros((0, 3))
CUBE = (0.04, 0.04, 0.04)


def top_down(x: float, y: float, z: float, yaw: float = 0.0, tilt=(0.0, 0.0)) -> np.ndarray:
    """T_base_grasp of a hand that points down, turned by yaw, then tilted about its own x and y."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("z", yaw).as_matrix() @ np.diag([1.0, -1.0, -1.0])
    T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec([*tilt, 0.0]).as_matrix()
    T[:3, 3] = x, y, z
    return T


def grasp(T: np.ndarray, width: float = 0.07) -> SimpleNamespace:
    return SimpleNamespace(T_base_grasp=T, width=width, score=0.0)


def thing(x: float, y: float, yaw: float = 0.0, sides=CUBE, **rest) -> ObjectSpec:
    orientation = tuple(Rotation.from_euler("z", yaw).as_quat())
    return replace(box("thing", x, y, sides), **{"orientation": orientation, "mass": 0.1} | rest)


def world_of(*things: ObjectSpec) -> World:
    return World(scene(*things))


@pytest.fixture(scope="module")
def oracle():
    """A simulation with nothing but the arm, for asking PyBullet where links are and what touches; never stepped."""
    client = Client()
    robot = client.loadURDF(
        str(data_path() / kinematics.PANDA_URDF), useFixedBase=True, flags=pybullet.URDF_USE_SELF_COLLISION
    )

    def put(q, finger=0.04):
        for joint, value in zip((*ARM_JOINTS, *FINGER_JOINTS), (*q, finger, finger), strict=True):
            client.resetJointState(robot, joint, value)

    yield SimpleNamespace(client=client, robot=robot, put=put)
    client.close()


def joints(rng: np.random.Generator, n: int) -> np.ndarray:
    return rng.uniform(LOWER, UPPER, (n, 7))


# Kinematics


def test_constants_are_the_urdfs():
    root = ElementTree.parse(data_path() / kinematics.PANDA_URDF).getroot()
    joint = {j.get("name"): j for j in root.iter("joint")}
    arm = [joint[f"panda_joint{i}"] for i in range(1, 8)]
    assert [float(j.find("safety_controller").get("soft_lower_limit")) for j in arm] == LOWER.tolist()
    assert [float(j.find("safety_controller").get("soft_upper_limit")) for j in arm] == UPPER.tolist()
    assert [float(j.find("limit").get("velocity")) for j in arm] == MAX_VELOCITY.tolist()
    assert [float(j.find("limit").get("effort")) for j in arm] == MAX_EFFORT.tolist()
    finger = joint["panda_finger_joint1"].find("limit")
    assert float(finger.get("upper")) == kinematics.FINGER_MAX
    assert float(finger.get("effort")) == kinematics.FINGER_MAX_EFFORT
    assert float(finger.get("velocity")) == kinematics.FINGER_MAX_VELOCITY


def test_forward_kinematics_agrees_with_pybullet(oracle):
    names = [oracle.client.getJointInfo(oracle.robot, i)[1].decode() for i in range(12)]
    assert names[8] == "panda_hand_joint" and names[11] == "panda_grasptarget_hand"
    for q in [Q_HOME, *joints(np.random.default_rng(0), 30)]:
        oracle.put(q)
        ours = [*kinematics.link_frames(q)[1:8], kinematics.link_frames(q)[8], kinematics.forward_kinematics(q)]
        for link, T in zip((*range(7), 8, 11), ours, strict=True):
            position, quaternion = oracle.client.getLinkState(oracle.robot, link, computeForwardKinematics=True)[4:6]
            assert np.allclose(T[:3, 3], position, atol=1e-6)
            assert np.allclose(T[:3, :3], Rotation.from_quat(quaternion).as_matrix(), atol=1e-6)


def test_jaws_close_along_y_of_the_grasp_frame(oracle):
    def fingers(opening):
        oracle.put(Q_HOME, opening)
        state = oracle.client.getLinkState
        return np.array([state(oracle.robot, f, computeForwardKinematics=True)[4] for f in FINGER_JOINTS])

    y = kinematics.forward_kinematics(Q_HOME)[:3, 1]
    assert np.allclose(fingers(0.03) - fingers(0.0), [0.03 * y, -0.03 * y], atol=1e-6)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_jacobian_is_the_derivative_of_forward_kinematics(seed):
    q, h = joints(np.random.default_rng(seed), 1)[0], 1e-6
    J = kinematics.jacobian(kinematics.link_frames(q))
    for joint in range(7):
        ahead, behind = (kinematics.forward_kinematics(q + s * h * np.eye(7)[joint]) for s in (1, -1))
        turn = Rotation.from_matrix(ahead[:3, :3] @ behind[:3, :3].T).as_rotvec()
        assert np.allclose(J[:, joint], np.concatenate([ahead[:3, 3] - behind[:3, 3], turn]) / (2 * h), atol=1e-7)


def assert_solves(q: np.ndarray | None, T: np.ndarray):
    assert q is not None
    assert (q >= LOWER).all() and (q <= UPPER).all()
    reached = kinematics.forward_kinematics(q)
    assert np.linalg.norm(reached[:3, 3] - T[:3, 3]) < 0.001
    assert np.degrees(Rotation.from_matrix(reached[:3, :3].T @ T[:3, :3]).magnitude()) < 0.5


@given(
    st.floats(0.35, 0.68), st.floats(-0.3, 0.3), st.floats(0.0, 0.25), st.floats(-3.1, 3.1),
    st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2)),
)  # fmt: skip
@settings(max_examples=80, deadline=None)
def test_inverse_kinematics_round_trip_over_the_table(x, y, z, yaw, tilt):
    T = top_down(x, y, z, yaw, tilt)
    turned = T @ np.diag([-1.0, -1.0, 1.0, 1.0])
    solutions = [kinematics.inverse_kinematics(pose) for pose in (T, turned)]
    assert solutions[0] is not None or solutions[1] is not None
    for q, pose in zip(solutions, (T, turned), strict=True):
        if q is not None:
            assert_solves(q, pose)


def test_inverse_kinematics_finds_nearly_every_pose_that_joints_within_limits_reach():
    found = 0
    for q in joints(np.random.default_rng(1), 40):
        T = kinematics.forward_kinematics(q)
        solution = kinematics.inverse_kinematics(T)
        if solution is not None:
            assert_solves(solution, T)
            found += 1
    assert found >= 38
    for far in ((1.2, 0.0, 0.1), (0.0, -0.9, 0.2), (0.5, 0.0, 1.5)):
        assert kinematics.inverse_kinematics(top_down(*far)) is None


def test_inverse_kinematics_stays_near_where_it_starts():
    q = np.array([0.3, 0.2, 0.4, -2.0, -0.3, 2.2, 0.9])
    T = kinematics.forward_kinematics(q)
    T[:3, 3] += 0.01, -0.01, 0.01
    assert np.abs(kinematics.inverse_kinematics(T, q) - q).max() < 0.1


# Collision checks and planning


def test_self_collision_agrees_with_pybullet(oracle):
    left_out = {(4, 6), (6, 8), (9, 10)}  # links 5 and 7, link 7 and hand, the fingers: the real arm's never collide
    seen = {True: 0, False: 0}
    for q in joints(np.random.default_rng(2), 250):
        oracle.put(q)
        oracle.client.performCollisionDetection()
        contacts = oracle.client.getContactPoints(oracle.robot, oracle.robot)
        touching = [c[8] for c in contacts if c[3] < c[4] and (c[3], c[4]) not in left_out]
        ours = collision.first_contact(q[None], 0.04, NOTHING, -10.0, collision.Margin())
        deep = min(touching, default=0.0) < -0.003
        if deep:
            assert ours is not None
        if ours is not None:
            nearest = oracle.client.getClosestPoints(oracle.robot, oracle.robot, 0.02)
            assert any(c[3] < c[4] and (c[3], c[4]) not in left_out and c[4] - c[3] > 1 for c in nearest)
        seen[deep] += 1
    assert min(seen.values()) > 10


def test_points_near_the_arm_agree_with_pybullet(oracle):
    """Where a ball touches the arm, the arm grown by its radius holds its centre; held by the bare arm, it touches."""
    radius, rng = 0.02, np.random.default_rng(3)
    shape = oracle.client.createCollisionShape(pybullet.GEOM_SPHERE, radius=radius)
    ball = oracle.client.createMultiBody(0.0, shape)
    hits = 0
    oracle.put(Q_HOME)
    for point in rng.uniform((-0.2, -0.2, 0.0), (0.3, 0.2, 0.9), (300, 3)):
        oracle.client.resetBasePositionAndOrientation(ball, point, (0, 0, 0, 1))
        depths = [c[8] for c in oracle.client.getClosestPoints(oracle.robot, ball, 0.0) if c[3] >= 0]
        touches = min(depths, default=0.0) < -0.0005
        grown = collision.first_contact(Q_HOME[None], 0.04, point[None], -10.0, collision.Margin(radius, radius))
        bare = collision.first_contact(Q_HOME[None], 0.04, point[None], -10.0, collision.Margin(0.0, 0.0))
        if touches:
            assert grown is not None
        if bare is not None:
            assert touches
        hits += touches
    oracle.client.removeBody(ball)
    assert 30 < hits < 270


def test_points_on_the_robot_itself_are_not_in_its_way():
    frames = collision.hull_frames(Q_HOME[None], 0.04)
    on_hand = collision.hulls()["hand"].corners @ frames["hand"][0, :3, :3].T + frames["hand"][0, :3, 3]
    elsewhere = np.array([[0.5, 0.2, 0.1]])
    kept = collision.without_robot(np.vstack([on_hand, elsewhere]), Q_HOME, 0.04)
    assert np.array_equal(kept, elsewhere)
    assert isinstance(planning.plan_grasp(top_down(0.5, 0, 0.02), 0.05, Q_HOME, on_hand, 0.0), planning.MotionPlan)


def wall(x: float, height: float, half_width: float = 0.4) -> np.ndarray:
    y, z = np.meshgrid(np.arange(-half_width, half_width, 0.004), np.arange(0.0, height, 0.004))
    return np.column_stack([np.full(y.size, x), y.ravel(), z.ravel()])


def test_a_wall_is_avoided_by_a_raised_waypoint(oracle):
    plan = planning.plan_grasp(top_down(0.5, 0.05, 0.02), 0.06, Q_HOME, wall(0.24, 0.45), 0.0)
    assert isinstance(plan, planning.MotionPlan)
    assert len(plan.transit) > 1
    half = (0.001, 0.4, 0.225)
    shape = oracle.client.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half)
    body = oracle.client.createMultiBody(0.0, shape, basePosition=(0.24, 0.0, 0.225))

    def clear(path):
        distances = []
        for q in path:
            oracle.put(q, plan.opening / 2)
            distances += [c[8] for c in oracle.client.getClosestPoints(oracle.robot, body, 0.1)]
        return min(distances, default=1.0) > 0.0

    assert clear(np.vstack([*plan.transit, plan.descent, plan.lift]))
    assert not clear(planning.straight_joints(Q_HOME, plan.descent[0]))
    oracle.client.removeBody(body)


def test_an_object_in_the_finger_s_way_is_a_reason_and_one_between_the_jaws_is_not():
    T = top_down(0.5, 0.0, 0.02)
    ball = 0.01 * Rotation.random(300, rng=np.random.default_rng(0)).apply([0.0, 0.0, 1.0]) + T[:3, 3]
    assert isinstance(planning.plan_grasp(T, 0.06, Q_HOME, ball, 0.0), planning.MotionPlan)
    beside = planning.plan_grasp(T, 0.06, Q_HOME, ball + 0.037 * T[:3, 1], 0.0)
    assert "finger would touch something in the scene" in beside


@pytest.mark.parametrize(
    ("x", "z", "width", "points", "reason"),
    [
        (1.3, 0.02, 0.05, NOTHING, "out of reach"),
        (0.5, 0.003, 0.05, NOTHING, "would touch the table"),
        (0.5, 0.02, 0.09, NOTHING, "too wide for the jaws"),
        (0.5, 0.02, 0.06, wall(0.35, 0.6), "no path: link"),
    ],
)
def test_no_plan_is_a_reason_in_words(x, z, width, points, reason):
    assert reason in planning.plan_grasp(top_down(x, 0.0, z), width, Q_HOME, points, 0.0)


def test_plan_ends_on_the_grasp_and_moves_straight_down_and_up():
    T = top_down(0.52, -0.11, 0.03, 0.7)
    plan = planning.plan_grasp(T, 0.06, Q_HOME, NOTHING, 0.0)
    assert repr(plan) == "MotionPlan(to (0.520, -0.110, 0.030) in 1 leg(s), down, and up)"
    assert np.array_equal(plan.transit[0][0], Q_HOME)
    assert np.array_equal(plan.transit[-1][-1], plan.descent[0]) and np.array_equal(plan.descent[-1], plan.lift[0])
    for path, low, high in ((plan.descent, 0.03, 0.13), (plan.lift, 0.03, 0.03 + planning.LIFT)):
        dense = np.vstack([np.linspace(a, b, 5) for a, b in pairwise(path)])
        p = kinematics.forward_kinematics(dense)[:, :3, 3]
        assert np.abs(p[:, :2] - T[:2, 3]).max() < 0.001
        assert p[:, 2].min() == pytest.approx(low, abs=0.001) and p[:, 2].max() == pytest.approx(high, abs=0.001)


@given(st.integers(0, 2**32 - 1), st.integers(2, 6), st.floats(0.05, 1.0))
@settings(max_examples=40, deadline=None)
def test_trajectory_keeps_to_the_speeds_and_ends_where_the_path_does(seed, rows, line_speed):
    path, dt = joints(np.random.default_rng(seed), rows), 1.0 / 240.0
    q = planning.trajectory(path, dt, line_speed)
    velocity = np.diff(q, axis=0, prepend=path[:1]) / dt
    assert np.allclose(q[-1], path[-1])
    assert (np.abs(velocity) <= planning.SPEED_SHARE * MAX_VELOCITY * (1 + 1e-9)).all()
    assert np.abs(velocity[[0, -1]]).max() < 0.1


# The arm in a world


def forbid(world: World, *names: str) -> None:
    """Make functions of a world's client fail the test."""

    def called(*_, **__):
        raise AssertionError("the arm may not do this")

    for name in names:
        setattr(world.client, name, called)


FORCES_AND_TELEPORTS = (
    "resetJointState", "resetJointStatesMultiDof", "resetBasePositionAndOrientation", "resetBaseVelocity",
    "createConstraint", "applyExternalForce", "applyExternalTorque", "changeDynamics", "setGravity",
)  # fmt: skip


def test_planning_asks_nothing_of_the_simulator_but_the_joints():
    with world_of(thing(0.5, 0.0)) as world:
        panda = Panda(world)
        truth = [name for name in dir(pybullet) if name.startswith(("get", "ray", "calculate", "step", "perform"))]
        forbid(world, *(set(truth) - {"getJointStates"}))
        assert isinstance(panda.plan(grasp(top_down(0.5, 0.0, 0.02)), wall(0.9, 0.1)), planning.MotionPlan)


def test_lifts_a_cube_six_times_of_six_within_every_limit():
    rng = np.random.default_rng(4)
    fastest, strongest, hand_force = np.zeros(9), np.zeros(9), 0.0

    def observe(world):
        nonlocal fastest, strongest, hand_force
        states = world.client.getJointStates(world.robot, (*ARM_JOINTS, *FINGER_JOINTS))
        fastest = np.maximum(fastest, [abs(state[1]) for state in states])
        strongest = np.maximum(strongest, [abs(state[3]) for state in states])
        for finger in FINGER_JOINTS:
            contacts = world.client.getContactPoints(bodyA=world.robot, linkIndexA=finger)
            hand_force = max(hand_force, sum(contact[9] for contact in contacts))

    for _ in range(6):
        x, y, yaw = rng.uniform((0.4, -0.25, -np.pi), (0.66, 0.25, np.pi))
        with world_of(thing(x, y, yaw)) as world:
            forbid(world, *FORCES_AND_TELEPORTS)
            world.observers.append(observe)
            result = Panda(world).lift(grasp(top_down(x, y, 0.02, yaw)))
            assert result.success and result.reason == "lifted" and result.name == "thing"
            assert result.class_id == TARGET and result.height == pytest.approx(planning.LIFT, abs=0.01)
            assert world.pose("thing")[2, 3] > 0.02 + 0.10
    assert (fastest[:7] <= MAX_VELOCITY).all() and (fastest[7:] <= kinematics.FINGER_MAX_VELOCITY).all()
    assert (strongest[:7] <= MAX_EFFORT).all() and (strongest[7:] <= kinematics.FINGER_MAX_EFFORT + 1e-9).all()
    assert 10.0 < hand_force <= 70.0


def test_an_object_off_the_middle_is_pushed_to_it_and_lifted():
    with world_of(thing(0.5, 0.0)) as world:
        panda = Panda(world)
        assert np.allclose(panda.q, Q_HOME, atol=1e-3) and panda.opening == pytest.approx(0.08, abs=1e-3)
        T = top_down(0.5, 0.01, 0.02)
        assert panda.lift(grasp(T)).success
        in_hand = np.linalg.inv(kinematics.forward_kinematics(panda.q)) @ world.pose("thing")
        assert abs(in_hand[1, 3]) < 0.002


@pytest.mark.parametrize(
    ("rest", "reason", "class_id"),
    [
        ({"friction": 0.03, "mass": 0.5}, "slipped", None),
        ({"mass": 15.0}, "slipped", None),
        ({"class_id": OBSTACLE}, "lifted obstacle", OBSTACLE),
        ({"sides": (0.04, 0.04, 0.1), "mass": 0.3}, "lifted", TARGET),  # so tall that it stops the palm
    ],
)
def test_only_the_lift_of_a_target_is_a_success(rest, reason, class_id):
    with world_of(thing(0.5, 0.0, **rest)) as world:
        result = Panda(world).lift(grasp(top_down(0.5, 0.0, 0.03 if "sides" in rest else 0.02)))
    assert (result.success, result.reason, result.class_id) == (reason == "lifted", reason, class_id)


def test_closing_on_nothing_and_not_reaching_are_told_apart():
    with world_of(thing(0.5, 0.2)) as world:
        panda = Panda(world)
        unreachable = grasp(top_down(1.2, 0.0, 0.02))
        assert panda.lift(unreachable).reason == "out of reach" and panda.lift([]).reason == "no grasp"
        assert panda.lift(GraspPlan(reason="too flat")).reason == "too flat"
        assert np.allclose(panda.q, Q_HOME, atol=1e-3)
        second = Grasp(top_down(0.5, -0.1, 0.02), 0.07)
        assert panda.lift(GraspPlan((Grasp(unreachable.T_base_grasp, 0.07), second))).reason == "missed"
        assert panda.lift(grasp(top_down(0.5, 0.2, 0.02))).success  # the jaws open again for another try


def test_what_is_in_the_way_of_a_blind_arm_makes_it_go_back():
    with world_of(thing(0.36, 0.0, sides=(0.08, 0.3, 0.6), mass=60.0, class_id=OBSTACLE)) as world:
        panda = Panda(world)
        result = panda.lift(grasp(top_down(0.6, 0.0, 0.02)))
        assert result.reason == "blocked on the way over"
        assert np.allclose(panda.q, Q_HOME, atol=0.01)


def test_same_scene_same_lift_and_another_world_is_left_alone():
    cube = thing(0.5, 0.1, 0.3)
    with world_of(cube) as world, world_of(cube) as other:
        bytes_before = other.render((64, 48)).depth.tobytes(), other.pose("thing").tobytes()
        result = Panda(world).lift(grasp(top_down(0.5, 0.1, 0.02, 0.3)))
        assert result.success
        assert (other.render((64, 48)).depth.tobytes(), other.pose("thing").tobytes()) == bytes_before
        again = Panda(other).lift(grasp(top_down(0.5, 0.1, 0.02, 0.3)))
        assert again == result and other.pose("thing").tobytes() == world.pose("thing").tobytes()


# Bad input


STRETCHED, STALE = np.diag([1.0, 1.0, 2.0, 1.0]), Q_HOME + 0.3
AIM = top_down(0.5, 0.0, 0.02)


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("argument", "call"),
    [
        ("T_base_grasp", lambda panda: planning.plan_grasp(STRETCHED, 0.05, Q_HOME, NOTHING, 0.0)),
        ("q", lambda panda: planning.plan_grasp(AIM, 0.05, np.zeros(6), NOTHING, 0.0)),
        ("points", lambda panda: planning.plan_grasp(AIM, 0.05, Q_HOME, np.full((2, 3), np.nan), 0.0)),
        ("scene", lambda panda: panda.plan(grasp(AIM), np.zeros((4, 2)))),
        ("grasp", lambda panda: panda.lift(SimpleNamespace(plan=GraspPlan(), clouds=[]))),  # a Perception, not its plan
        ("plan", lambda panda: panda.execute(planning.plan_grasp(AIM, 0.05, STALE, NOTHING, 0.0))),
        ("world", lambda panda: Panda(World(replace(scene(), robot=False)))),
    ],
)
def test_bad_input_is_named(argument, call):
    with world_of() as world, pytest.raises(ValueError, match=f"^{argument}: "):
        call(Panda(world))
