"""The node's neighbours (topic 08): a camera that publishes frames, and an arm that executes grasps."""

import threading
import time
from collections.abc import Iterable

from labkit.frame import RGBDFrame
from labkit.geometry.depth_units import whole_units
from labkit.node import convert
from labkit.node.messages import (
    DEFAULT_TOPICS,
    CameraInfo,
    Header,
    Image,
    JointState,
    PointCloud2,
    Pose,
    Topics,
    Transform,
    Transforms,
)
from labkit.node.sync import Synchronizer
from labkit.support.validation import require


class Camera:
    """Publish frames as a camera's driver does: the pose, the calibration, depth, and colour, all of one stamp.

    depth: "32FC1" for metres, "16UC1" for millimetres, in which what is further than 65.535 m is no reading. frame_id
    names the optical frame (x right, y down, z forward).

    >>> import numpy as np
    >>> from labkit.node.bus import Bus
    >>> bus, seen = Bus(), []
    >>> bus.subscribe("/camera/rgb/image_raw", object, seen.append)
    >>> rgb, depth = np.zeros((2, 3, 3), np.uint8), np.ones((2, 3), np.float32)
    >>> Camera(bus).publish(RGBDFrame(rgb, depth, np.diag([9.0, 9.0, 1.0]), np.eye(4)), stamp=7)
    >>> seen[0].header
    Header(stamp=7, frame_id='camera_optical_frame')
    """

    def __init__(
        self,
        transport,
        *,
        frame_id: str = "camera_optical_frame",
        base_frame: str = "base_link",
        topics: Topics = DEFAULT_TOPICS,
        depth: str = "32FC1",
    ):
        require("depth", depth in convert.DEPTH, f"one of {', '.join(convert.DEPTH)}", repr(depth))
        self.transport, self.topics, self.depth = transport, topics, depth
        self.frame_id, self.base_frame = frame_id, base_frame
        for topic, kind in (
            (topics.tf, Transforms),
            (topics.info, CameraInfo),
            (topics.depth, Image),
            (topics.rgb, Image),
        ):
            transport.advertise(topic, kind)

    def publish(self, frame: RGBDFrame, stamp: int | None = None) -> None:
        """Publish one frame; stamp in nanoseconds, default now."""
        header = Header(self.transport.now() if stamp is None else stamp, self.frame_id)
        pose = convert.encode_pose(frame.T_base_cam, Header(header.stamp, self.base_frame))
        where = Transform(pose.header, self.frame_id, pose.position, pose.orientation)
        depth = frame.depth
        if self.depth == "16UC1":
            depth = whole_units(depth, 0.001)
        width, height = frame.size
        publish, topics = self.transport.publish, self.topics
        publish(topics.tf, Transforms((where,)))
        publish(topics.info, CameraInfo(header, height, width, tuple(frame.K.ravel().tolist())))
        publish(topics.depth, convert.encode_image(depth, self.depth, header))
        publish(topics.rgb, convert.encode_image(frame.rgb, "rgb8", header))

    def run(self, frames: Iterable[RGBDFrame], rate: float = 30.0, stop: threading.Event | None = None) -> int:
        """Publish frames `rate` times a second until they end or `stop` is set; returns how many it were.

        A frame that comes late is published at once, and the next ones keep their places in time.
        """
        require("rate", rate > 0.0, "frames a second, above 0", rate)
        stop = stop or threading.Event()
        start, count = time.monotonic(), 0
        for count, frame in enumerate(frames, start=1):
            self.publish(frame)
            if stop.wait(max(0.0, start + count / rate - time.monotonic())):
                break
        return count


class Arm:
    """Subscribe to grasps, openings and the scene's points, and execute the first grasp in a World with its Panda.

    Messages may arrive in any thread; the simulation is moved only by the caller of `act`.
    """

    def __init__(self, transport, world, topics: Topics = DEFAULT_TOPICS):
        self.world = world
        self._sync = Synchronizer(("grasp", "gripper", "scene"), slop=0)
        self._together: dict | None = None
        self._news = threading.Condition()
        for stream, kind in (("grasp", Pose), ("gripper", JointState), ("scene", PointCloud2)):
            transport.subscribe(getattr(topics, stream), kind, self._receiver(stream))

    def _receiver(self, stream: str):
        def receive(message) -> None:
            with self._news:
                together = self._sync.add(stream, message.header.stamp, message)
                if together is not None:
                    self._together = together
                    self._news.notify_all()

        return receive

    def act(self, timeout: float = 10.0):
        """Wait for a grasp, execute it and lift; a LiftResult, whose reason is "no grasp" if none came in time."""
        from labkit.grasp import Grasp  # numba
        from labkit.sim.panda import LiftResult, Panda  # PyBullet, for whoever has an arm

        with self._news:
            self._news.wait_for(lambda: self._together is not None, timeout)
            together, self._together = self._together, None
        if together is None:
            return LiftResult(False, "no grasp")
        grasp = Grasp(convert.decode_pose(together["grasp"]), sum(together["gripper"].position))
        return Panda(self.world).lift(grasp, convert.decode_cloud(together["scene"]))
