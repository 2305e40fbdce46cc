"""The node's peers in the tests of both ROS: processes that are gone afterwards, and a camera that listens."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from labkit.frame import RGBDFrame
from labkit.learning.network import load_model, weights_path
from labkit.node import convert
from labkit.node.actors import Camera
from labkit.node.messages import (
    ROS_TOPICS,
    CameraInfo,
    CompressedImage,
    Detection,
    Detections,
    Diagnostics,
    Header,
    Image,
    JointState,
    PointCloud2,
    Pose,
    PoseArray,
    Transform,
    Transforms,
)
from labkit.pipeline import Pipeline

ROOT = Path(__file__).parents[1]
PATIENCE = 120.0  # seconds: a node that starts beside a whole suite compiles slowly
MS = 1_000_000
KINDS = {"mask": Image, "cloud": PointCloud2, "grasp": Pose, "diagnostics": Diagnostics}
GRASP = Pose(Header(5, "base_link"), (1.0, 2.0, 3.0), (0.0, 0.6, 0.0, 0.8))
MESSAGES = [
    convert.encode_image(np.arange(24, dtype=np.uint8).reshape(2, 4, 3), "rgb8", Header(10**18 + 1, "camera")),
    CameraInfo(Header(5, "camera"), 2, 4, (9.0, 0.0, 2.0, 0.0, 8.0, 1.0, 0.0, 0.0, 1.0), (0.1,) * 5),
    convert.encode_cloud(np.eye(3), Header(5, "base_link")),
    CompressedImage(Header(5, "camera"), "rgb8; jpeg compressed bgr8", b"bytes of a file"),
    GRASP,
    PoseArray(GRASP.header, (GRASP,) * 2),
    Detections(GRASP.header, (Detection("target 1", 0.5, GRASP, (0.1, 0.2, 0.3), (0.04, 0.05, 0.06)),)),
    Transforms((Transform(Header(5, "base_link"), "camera", (1.0, 2.0, 3.0), (0.0, 0.6, 0.0, 0.8)),)),
    JointState(Header(5, "base_link"), ("left", "right"), (0.02, 0.02)),
    Diagnostics(Header(5), "node", 1, "words", {"answered": "3"}),
]


def wait_for(condition, what: str):
    """Poll until something is there; the test fails, and says what was missing, if it never comes."""
    deadline = time.monotonic() + PATIENCE
    while not (found := condition()):
        assert time.monotonic() < deadline, f"waited in vain for {what}"
        time.sleep(0.005)
    return found


@contextlib.contextmanager
def variables(**ours: str):
    """Environment variables for a while."""
    before = {name: os.environ.get(name) for name in ours}
    os.environ.update(ours)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name, None) if value is None else os.environ.__setitem__(name, value)


@contextlib.contextmanager
def process(*command, **options):
    """A process of this Python that is gone afterwards."""
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    environment = os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": path}
    with subprocess.Popen([sys.executable, *map(str, command)], env=environment, text=True, **options) as started:
        try:
            yield started
        finally:
            started.kill()


class Peer:
    """Camera and listener of this process.

    transport: an edge to ROS. heard_from: function of it and a topic, whether anybody publishes there.
    """

    def __init__(self, transport, heard_from, topics=ROS_TOPICS):
        self.transport, self.heard_from, self.topics = transport, heard_from, topics
        self.camera, self.heard = Camera(transport, topics=topics), {name: [] for name in KINDS}
        for name, kind in KINDS.items():
            transport.subscribe(getattr(topics, name), kind, self.heard[name].append)

    def connected(self) -> bool:
        """Whether the node listens to all that the camera says, and this process to all that the node says."""
        topics = self.topics
        spoken = map(self.transport.wanted, (topics.rgb, topics.depth, topics.info, topics.tf))
        listened = all(self.heard_from(self.transport, getattr(topics, name)) for name in KINDS)
        return all(spoken) and listened and self.told() and "nobody publishes it" not in self.told().values()

    def answer(self, name: str, stamp: int):
        """The message of a stamp, once it is there."""
        return wait_for(lambda: next((m for m in self.heard[name] if m.header.stamp == stamp), None), f"{name} {stamp}")

    def ask(self, frame, stamp: int):
        """Publish a frame and wait for its mask."""
        self.camera.publish(frame, stamp)
        return self.answer("mask", stamp)

    def told(self) -> dict[str, str]:
        """What the node's last diagnostics say."""
        return self.heard["diagnostics"][-1].values if self.heard["diagnostics"] else {}

    def counted(self) -> dict[str, int]:
        """The node's own counts, as it told them last."""
        told = self.told()
        return {name: int(told.get(name, -1)) for name in ("answered", "dropped", "lost", "skipped", "failed")}

    @contextlib.contextmanager
    def node(self, *command):
        """The node in a process, connected; SIGINT ends it with status 0, unless it has ended before."""
        self.heard["diagnostics"].clear()
        with process(*command, stderr=subprocess.PIPE) as started:
            wait_for(lambda: self.connected() or started.poll() is not None, "the node")
            yield started
            if started.poll() is None:
                started.send_signal(signal.SIGINT)
                started.said = started.communicate(timeout=PATIENCE)[1]
                assert started.returncode == 0, started.said

    def compare_with_the_pipeline(self, frame, **options):
        """Over loopback the node says what the pipeline finds, and carries stamp and frames through."""
        expected = Pipeline(load_model(weights_path("smallsegnet")), crf=False, **options).run(frame)
        stamp = 1_700_000_000_123_456_789
        mask, cloud = self.ask(frame, stamp), self.answer("cloud", stamp)
        assert np.mean(convert.decode_image(mask) != expected.labels) < 1e-3
        assert mask.encoding == "mono8" and mask.header.frame_id == "camera_optical_frame"
        assert cloud.header.frame_id == "base_link" and len(expected.clouds) > 0
        found, whole = convert.decode_cloud(cloud), np.concatenate(expected.clouds)
        assert abs(len(found) - len(whole)) < 0.05 * len(whole)
        assert np.allclose(found.mean(axis=0), whole.mean(axis=0), atol=2e-3)


def small(frame) -> RGBDFrame:
    """A corner of a frame, which is answered in a few milliseconds."""
    return RGBDFrame(frame.rgb[:24, :32], frame.depth[:24, :32], frame.K, frame.T_base_cam)
