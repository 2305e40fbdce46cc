"""The arm that acts in a World: plan, move, grasp, lift (topic 07). It moves by its motors alone.

No joint is set, no constraint made, no object touched but by the fingers' friction. The simulator's true poses are read
in one place, `_Witness`, and only to score a lift. Metres, radians, base frame.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from labkit.labels import CLASSES, TARGET
from labkit.sim.client import pybullet
from labkit.sim.kinematics import FINGER_MAX_EFFORT, MAX_EFFORT
from labkit.sim.planning import MotionPlan, plan_grasp, straight_up, trajectory
from labkit.sim.world import TIME_STEP, World
from labkit.support.validation import check_finite, check_shape, require

ARM_JOINTS = tuple(range(7))
FINGER_JOINTS = (9, 10)

POSITION_GAIN = 0.3  # share of a joint's position error that its motor makes good in one step
LINE_SPEED = 0.3  # m/s of the hand down to the grasp and up
SETTLE_SECONDS = 0.05  # after each motion
BLOCKED = 0.02  # rad, an arm this far from where it was sent is held up by something
FINGER_SPEED = 0.1  # m/s of each finger, half its limit
CENTRING = 4000.0  # N/m, how much force a finger gives up for being ahead of the other
CLOSING_SECONDS = 1.0  # at most
STALLED = 0.002  # m/s: fingers slower than this for STALLED_STEPS have met something
STALLED_STEPS = 10
CLOSED = 0.002  # m, jaws no wider than this hold nothing
HOLD_SECONDS = 1.0
LIFTED = 0.10  # m


@dataclass(frozen=True)
class LiftResult:
    """What became of a grasp: success means a target is 10 cm up and still held one simulated second later.

    reason: in words, "lifted" on success. name, class_id: the object that is up, or None. height: how far it rose,
    metres. seconds: simulated time.
    """

    success: bool
    reason: str
    name: str | None = None
    class_id: int | None = None
    height: float = 0.0
    seconds: float = 0.0


class Panda:
    """The Franka Panda of a World.

    A grasp is a `labkit.grasp.Grasp` or anything with its T_base_grasp, (4, 4), and width, the distance of the pads to
    come down with. `scene`, where a method takes one, is the points (M, 3) that the camera saw. Raises ValueError if
    the world has no robot.

    >>> from labkit.sim.kinematics import forward_kinematics
    >>> from labkit.sim.spec import Camera, SceneSpec
    >>> with World(SceneSpec(objects=(), camera=Camera.looking_at((0.5, 0, 0), 0.9, 0.3, 0.8))) as world:
    ...     T = forward_kinematics(Panda(world).q)
    >>> float(T[2, 3].round(3))
    0.442
    """

    def __init__(self, world: World):
        require("world", world.robot is not None, "a scene with a robot", "a spec with robot=False")
        self.world = world
        self._target = self.q  # the joint angles last sent to the motors
        self._opening = self.opening  # what the hand is to keep to while open, metres
        self._gripping = False
        self._steps = 0

    @property
    def q(self) -> Float[np.ndarray, "7"]:
        """The arm's joint angles now, rad."""
        return self._joint_state(ARM_JOINTS, 0)

    @property
    def opening(self) -> float:
        """The distance of the pads now, metres."""
        return float(self._joint_state(FINGER_JOINTS, 0).sum())

    def _joint_state(self, joints: Sequence[int], field: int) -> np.ndarray:
        states = self.world.client.getJointStates(self.world.robot, joints)
        return np.array([state[field] for state in states])

    def plan(self, grasp: Any, scene: Float[np.ndarray, "M 3"] | None = None) -> MotionPlan | str:
        """Plan a motion from here to a grasp and up; the reason in words if there is none.

        The height of the table comes from the scene's calibration, nothing else from the simulator.
        """
        if not hasattr(grasp, "T_base_grasp"):
            raise ValueError(f"grasp: expected a Grasp, such as perception.plan.grasps[0], got {type(grasp).__name__}")
        table_z = self.world.spec.table.z
        return plan_grasp(grasp.T_base_grasp, grasp.width, self.q, _points(scene), table_z, self.opening / 2)

    def execute(self, plan: MotionPlan) -> str | None:
        """Move by a plan: over, down, close until the fingers stall, and up; None, or what the arm felt go wrong.

        An arm that is held up on its way over goes back; held up on its way down (the palm may rest on the object), it
        closes there. Raises ValueError if the plan does not begin where the arm is.
        """
        off = np.abs(plan.transit[0][0] - self.q).max()
        require("plan", off <= 0.05, "one that begins at the arm's joints", f"one that is {off:.2f} rad off")
        self._opening, self._gripping = plan.opening, False
        if not all(self._follow_or_back_off(leg) for leg in plan.transit):
            return "blocked on the way over"
        arrived = self._follow(plan.descent, LINE_SPEED)
        self._close()
        empty = self.opening < CLOSED
        lift = plan.lift if arrived else straight_up(self.q)
        self._follow(np.vstack([self.q, plan.lift[-1]]) if lift is None else lift, LINE_SPEED)
        if not arrived:
            return "blocked on the way down"
        return "missed" if empty else None

    def lift(self, grasp: Any, scene: Float[np.ndarray, "M 3"] | None = None) -> LiftResult:
        """Try to lift: plan, execute, hold for a second, and ask the simulator what is up.

        grasp: a grasp, a GraspPlan (`perception.plan`) or grasps from best to worst, of which the first with a path is
        tried, or a MotionPlan of `plan`. Success is a target 10 cm up, still so and in contact one simulated second
        later. Raises ValueError for anything else.
        """
        plan = self._first_plan(grasp, scene)
        if isinstance(plan, str):
            return LiftResult(False, plan)
        witness, start = _Witness(self.world), self._steps
        felt = self.execute(plan)
        up = witness.held()
        self._wait(HOLD_SECONDS)
        held = {name: height for name, height in witness.held().items() if name in up}
        seconds = (self._steps - start) * TIME_STEP
        if not held:
            return LiftResult(False, felt or "slipped", seconds=seconds)
        # An obstacle that came up, alone or with a target, is a failure, and is the one to name.
        name = max(held, key=lambda name: (witness.class_of(name) != TARGET, held[name]))
        class_id = witness.class_of(name)
        reason = "lifted" if class_id == TARGET else f"lifted {CLASSES[class_id]}"
        return LiftResult(class_id == TARGET, reason, name, class_id, held[name], seconds)

    def _first_plan(self, grasp, scene) -> MotionPlan | str:
        if isinstance(grasp, MotionPlan):
            return grasp
        plan = getattr(grasp, "reason", "") or "no grasp"  # of a GraspPlan without grasps
        grasps = getattr(grasp, "grasps", grasp)
        for candidate in grasps if isinstance(grasps, Sequence) else [grasps]:
            plan = self.plan(candidate, scene)
            if isinstance(plan, MotionPlan):
                break
        return plan

    def _follow(self, path: Float[np.ndarray, "N 7"], line_speed: float = np.inf) -> bool:
        """Send the motors along a path, from rest to rest; stop and say False where something holds the arm up."""
        for q in trajectory(path, TIME_STEP, line_speed):
            self._step(q)
            if np.abs(self.q - q).max() > BLOCKED:
                self._target = self.q
                self._wait(SETTLE_SECONDS)
                return False
        self._wait(SETTLE_SECONDS)
        return True

    def _follow_or_back_off(self, leg: Float[np.ndarray, "N 7"]) -> bool:
        """Follow a leg; where something holds the arm up, return to the leg's beginning and say False."""
        arrived = self._follow(leg)
        if not arrived:
            nearest = np.abs(leg - self.q).max(axis=1).argmin()
            self._follow(np.vstack([self.q, leg[nearest::-1]]), LINE_SPEED)
        return arrived

    def _wait(self, seconds: float) -> None:
        """Stand still."""
        for _ in range(round(seconds / TIME_STEP)):
            self._step(self._target)

    def _close(self) -> None:
        """Close the jaws until they have met something, or each other."""
        self._gripping = True
        still = 0
        for _ in range(round(CLOSING_SECONDS / TIME_STEP)):
            self._step(self._target)
            moving = np.abs(self._joint_state(FINGER_JOINTS, 1)).max() > STALLED
            still = 0 if moving else still + 1
            if still == STALLED_STEPS:
                break

    def _step(self, q: Float[np.ndarray, "7"]) -> None:
        """One step of the simulation, at whose end the arm is to be at q; forces are limited to the URDF's efforts."""
        client, robot = self.world.client, self.world.robot
        client.setJointMotorControlArray(
            robot,
            ARM_JOINTS,
            pybullet.POSITION_CONTROL,
            targetPositions=self._target,  # where the arm should be now; the velocity then takes it to q
            targetVelocities=(q - self._target) / TIME_STEP,
            forces=MAX_EFFORT,
            positionGains=[POSITION_GAIN] * 7,
            velocityGains=[1.0] * 7,
        )
        fingers = self._joint_state(FINGER_JOINTS, 0)
        # The real fingers share one motor and stay symmetric. Here each has its own, and two equal forces would let
        # them drift together to one side: so the finger that is further in gives up some of its force.
        ahead = np.maximum(fingers.mean() - fingers, 0.0)
        forces = FINGER_MAX_EFFORT - np.minimum(CENTRING * ahead, FINGER_MAX_EFFORT)
        for joint, force in zip(FINGER_JOINTS, forces, strict=True):
            client.setJointMotorControl2(
                robot,
                joint,
                pybullet.POSITION_CONTROL,
                targetPosition=0.0 if self._gripping else self._opening / 2,
                force=force if self._gripping else FINGER_MAX_EFFORT,
                maxVelocity=FINGER_SPEED,
            )
        self._target = q
        self._steps += 1
        self.world.step()


def _points(scene) -> Float[np.ndarray, "M 3"]:
    return np.zeros((0, 3)) if scene is None else check_finite("scene", check_shape("scene", scene, (None, 3)))


class _Witness:
    """What the simulator knows about the objects, for scoring a lift only."""

    def __init__(self, world: World):
        self.world = world
        self.before = self._heights()

    def _heights(self) -> dict[str, float]:
        """Height of each object's centre of mass, metres."""
        position = self.world.client.getBasePositionAndOrientation
        return {name: position(body)[0][2] for name, body in self.world.bodies.items()}

    def held(self) -> dict[str, float]:
        """How far each object has risen, of those that are up and touch a finger; metres."""
        rise = {name: height - self.before[name] for name, height in self._heights().items()}
        return {name: up for name, up in rise.items() if up >= LIFTED and self._touches_finger(name)}

    def _touches_finger(self, name: str) -> bool:
        contacts = self.world.client.getContactPoints
        body, robot = self.world.bodies[name], self.world.robot
        return any(contacts(robot, body, linkIndexA=finger) for finger in FINGER_JOINTS)

    def class_of(self, name: str) -> int:
        return next(thing.class_id for thing in self.world.spec.objects if thing.name == name)
