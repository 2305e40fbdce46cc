"""Plans for hands of other sizes, against a jaw of two fingers and a palm that flies freely in PyBullet."""

import dataclasses

import numpy as np
import pybullet
import pytest
from at_night import others_at_night
from scipy.spatial.transform import Rotation

from labkit.geometry import back_project_to_base
from labkit.grasp import Gripper, plan_grasps
from labkit.labels import OBSTACLE, TARGET
from labkit.sim.spec import Camera, ObjectSpec, Part, SceneSpec
from labkit.sim.world import TIME_STEP, World

TURN = tuple(Rotation.from_euler("z", 0.4).as_quat())
SHAPES = {
    "block": (Part("box", (0.07, 0.035, 0.04)),),
    "tee": (Part("box", (0.075, 0.024, 0.03)), Part("box", (0.024, 0.045, 0.03), (0.0, 0.034, 0.0))),
    "can": (Part("cylinder", (0.026, 0.06)),),
    "cube": (Part("box", (0.06, 0.06, 0.05)),),
}


def scaled(factor: float) -> Gripper:
    return Gripper(**{name: factor * value for name, value in dataclasses.asdict(Gripper()).items()})


class Jaw:
    """A gripper in a World: the hull of each finger as Gripper describes it, on sliders, below palm and body."""

    def __init__(self, world: World, gripper: Gripper):
        self.client, self.gripper = world.client, gripper
        tip = gripper.tips_below_grasp
        palm, body = tip - gripper.palm_above_tips, tip - gripper.body_above_tips
        deep = 0.5 * gripper.body_above_tips
        half = [[gripper.palm_width / 2, gripper.palm_length / 2, (palm - body) / 2],
                [gripper.body_width / 2, gripper.palm_length / 2, deep / 2]]  # fmt: skip
        hand = self.client.createCollisionShapeArray(
            [pybullet.GEOM_BOX] * 2, halfExtents=half,
            collisionFramePositions=[[0, 0, (palm + body) / 2], [0, 0, body - deep / 2]],
        )  # fmt: skip
        corners = [
            (x, y, z)
            for x in (-gripper.finger_width / 2, gripper.finger_width / 2)
            for thickness, heights in ((gripper.tip_thickness, (tip,)),
                                       (gripper.root_thickness, (tip - gripper.root_above_tips, palm)))
            for y in (0.0, thickness)
            for z in heights
        ]  # fmt: skip
        fingers = [
            self.client.createCollisionShape(
                pybullet.GEOM_MESH, vertices=[(x, side * y, z) for x, y, z in corners], indices=[]
            )
            for side in (1, -1)
        ]
        # The base stands still at the grasp; its first link is the hand, on a lift along the approach.
        still = [[0, 0, 0]] * 3, [[0, 0, 0, 1]] * 3
        self.body = self.client.createMultiBody(
            0.0, -1, -1, (0, 0, 2), (0, 0, 0, 1), linkMasses=[1.0, 0.1, 0.1],
            linkCollisionShapeIndices=[hand, *fingers], linkVisualShapeIndices=[-1] * 3,
            linkPositions=still[0], linkOrientations=still[1],
            linkInertialFramePositions=still[0], linkInertialFrameOrientations=still[1], linkParentIndices=[0, 1, 1],
            linkJointTypes=[pybullet.JOINT_PRISMATIC] * 3, linkJointAxis=[[0, 0, -1], [0, 1, 0], [0, -1, 0]],
        )  # fmt: skip

    def put(self, grasp) -> None:
        """Open the jaw as a grasp says, and put it there."""
        quaternion = Rotation.from_matrix(grasp.T_base_grasp[:3, :3]).as_quat()
        self.client.resetBasePositionAndOrientation(self.body, grasp.T_base_grasp[:3, 3], quaternion)
        for joint, value in enumerate((0.0, grasp.width / 2, grasp.width / 2)):
            self.client.resetJointState(self.body, joint, value)

    def air(self, bodies) -> float:
        """How far the jaw is from the nearest of some bodies, metres; negative where it is in one."""
        points = [self.client.getClosestPoints(self.body, body, 0.05) for body in bodies]
        return min(point[8] for of_body in points for point in of_body)

    def close_and_lift(self, world: World, height: float, seconds: float = 1.0) -> None:
        for rise in np.clip(np.linspace(-height, height, round(2 * seconds / TIME_STEP)), 0.0, None):
            self.client.setJointMotorControl2(self.body, 0, pybullet.POSITION_CONTROL, rise, force=1000)
            for finger in (1, 2):
                self.client.setJointMotorControl2(
                    self.body, finger, pybullet.VELOCITY_CONTROL, targetVelocity=-0.1, force=20
                )
            world.step()


def seen_from_all_sides(world: World, distance: float):
    """Points of target and scene from six cameras, so that nothing but undersides is hidden."""
    views = [(a, 0.7) for a in (0.3, 1.87, 3.44, 5.01)] + [(0.3, 1.5)]
    target, scene = [], []
    for azimuth, elevation in views:
        camera = Camera.looking_at((0.55, 0.0, 0.02), distance, azimuth, elevation, fov_y=0.5)
        frame = world.render((320, 240), camera)
        points = back_project_to_base(frame.depth, frame.K, frame.T_base_cam)
        target.append(points[frame.labels == TARGET])
        scene.append(points[frame.labels > 0])
    return np.vstack(target), np.vstack(scene)


@pytest.mark.parametrize("factor", others_at_night([0.5, 1.0, 2.0], by_day=(0.5, 2.0)))
@pytest.mark.parametrize("shape", others_at_night(SHAPES, by_day=("tee", "can")))
def test_planned_jaws_of_any_size_clear_everything_and_lift_the_target(shape, factor):
    gripper = scaled(factor)

    def thing(name, class_id, x, y, parts):
        low = min(part.position[2] - part.size[-1] / 2 for part in parts)
        at = (0.55 + factor * x, factor * y, -factor * low + 0.0005)
        return ObjectSpec(name, name, class_id, at, TURN, scale=factor, parts=parts, mass=0.1)

    spec = SceneSpec(
        (
            thing("target", TARGET, 0.0, 0.0, SHAPES[shape]),
            thing("beside", OBSTACLE, 0.02, 0.085, (Part("box", (0.1, 0.03, 0.05)),)),
            thing("post", OBSTACLE, -0.02, -0.1, (Part("box", (0.03, 0.03, 0.12)),)),
        ),
        Camera.looking_at((0.55, 0.0, 0.0), 0.9, 0.0, 0.8),
        robot=False,
    )
    with World(spec) as world:
        target, scene = seen_from_all_sides(world, 0.5 + 0.4 * factor)
        grasps = plan_grasps([target], scene, 0.0, gripper=gripper).grasps
        assert len(grasps) >= 3
        jaw = Jaw(world, gripper)
        for grasp in grasps:
            jaw.put(grasp)
            assert grasp.width <= gripper.max_opening
            assert jaw.air(world.bodies.values()) > -0.0005 and jaw.air([world.table]) > 0.003
        jaw.put(grasps[0])
        before = world.pose("target")[2, 3]
        jaw.close_and_lift(world, 0.1)
        assert world.pose("target")[2, 3] > before + 0.08
