"""What the segmentation node publishes about a frame: mask, clouds, grasps, and how it is (topic 08)."""

import numpy as np

from labkit.grasp import Grasp
from labkit.labels import overlay
from labkit.node import convert
from labkit.node.messages import (
    Detection,
    Detections,
    Diagnostics,
    Header,
    Image,
    JointState,
    PointCloud2,
    Pose,
    PoseArray,
    Topics,
)
from labkit.pipeline import Perception

KINDS = {
    "mask": Image,
    "probabilities": Image,
    "overlay": Image,
    "cloud": PointCloud2,
    "scene": PointCloud2,
    "gripper": JointState,
    "grasp": Pose,
    "grasps": PoseArray,
    "scores": PointCloud2,
    "detections": Detections,
    "diagnostics": Diagnostics,
}
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")


class Outputs:
    """The node's outgoing topics; what is large, or few can read, is made only if anybody wants it.

    topics: their names. base_frame: the name of the frame that clouds and grasps are in.
    """

    def __init__(self, transport, topics: Topics, base_frame: str):
        self.transport, self.topics, self.base_frame = transport, topics, base_frame
        for output, kind in KINDS.items():
            transport.advertise(getattr(topics, output), kind)

    def publish(self, header: Header, perception: Perception) -> None:
        """Publish what was perceived; header: of the colour image, whose stamp all results carry."""
        base = Header(header.stamp, self.base_frame)
        self._images(header, perception)
        self._clouds(base, perception)
        self._grasps(base, perception)

    def report(self, header: Header, message: str, level: int, values: dict[str, str]) -> None:
        """Publish how the node is; the transport's own troubles stand last."""
        values = values | self.transport.troubles()
        self._send("diagnostics", Diagnostics(header, "segmentation", level, message, values))

    def _send(self, output: str, message) -> None:
        self.transport.publish(getattr(self.topics, output), message)

    def _wanted(self, output: str) -> bool:
        return self.transport.wanted(getattr(self.topics, output))

    def _images(self, header: Header, perception: Perception) -> None:
        self._send("mask", convert.encode_image(perception.labels, "mono8", header))
        if self._wanted("probabilities") and perception.probabilities is not None:
            p = perception.probabilities.astype(np.float32, copy=False)
            self._send("probabilities", convert.encode_image(p, f"32FC{p.shape[-1]}", header))
        if self._wanted("overlay"):
            painted = overlay(perception.frame.rgb, perception.labels)
            self._send("overlay", convert.encode_image(painted, "rgb8", header))

    def _clouds(self, base: Header, perception: Perception) -> None:
        points = np.concatenate([np.zeros((0, 3), np.float32), *perception.clouds])
        pixels = np.concatenate([np.zeros(0, np.intp), *perception.pixels])
        colours = convert.pack_rgb(perception.frame.rgb.reshape(-1, 3)[pixels])
        self._send("cloud", convert.encode_cloud(points, base, rgb=colours))
        if self._wanted("scene"):
            self._send("scene", convert.encode_cloud(perception.scene, base))

    def _grasps(self, base: Header, perception: Perception) -> None:
        grasps = perception.plan.grasps
        poses = tuple(convert.encode_pose(grasp.T_base_grasp, base) for grasp in grasps)
        self._send("grasps", PoseArray(base, poses))
        at = np.reshape([pose.position for pose in poses], (-1, 3))
        more = {name: np.array([getattr(grasp, name) for grasp in grasps]) for name in ("score", "width", "target")}
        self._send("scores", convert.encode_cloud(at, base, **more))
        if self._wanted("detections"):
            found = (_detection(pose, grasp, perception) for pose, grasp in zip(poses, grasps, strict=True))
            self._send("detections", Detections(base, tuple(found)))
        if grasps:
            if self._wanted("gripper"):
                self._send("gripper", JointState(base, FINGERS, (grasps[0].width / 2.0,) * 2))
            self._send("grasp", poses[0])


def _detection(pose: Pose, grasp: Grasp, perception: Perception) -> Detection:
    cloud = perception.clouds[grasp.target].astype(float)
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    box = tuple(0.5 * (low + high)), tuple(high - low)
    return Detection(f"target {grasp.target + 1}", float(grasp.score), pose, *box)
