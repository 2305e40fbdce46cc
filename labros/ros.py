"""The node as a process of ROS 2 or ROS 1, and `run_ros_node` (topic 08)."""

import logging
import signal
import threading
from collections.abc import Callable
from contextlib import contextmanager

from labkit.node.bus import Transport
from labkit.node.diagnostics import Counts
from labkit.node.messages import ROS_TOPICS
from labkit.node.segmentation import SegmentationNode
from labkit.pipeline import Pipeline
from labros import ros1, ros2

logger = logging.getLogger(__name__)


@contextmanager
def stopped_by_signals():
    """An event that SIGINT and SIGTERM set, instead of ending the process."""
    stop = threading.Event()
    before = {number: signal.signal(number, lambda *_: stop.set()) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def run(
    build: Callable[[Transport, threading.Event], SegmentationNode],
    name: str = "segmentation_node",
    *,
    version: int = 2,
    arguments=(),
    lifecycle: bool = False,
) -> Counts | None:
    """Run a node on ROS until a signal or ROS ends it.

    build: function of the transport, and of an event that is set at the end, to the node. version: of ROS, 1 or 2.
    arguments: ROS's own, such as those behind --ros-args. Returns what became of the frames, or None if a signal came
    before ROS did. lifecycle: of ROS 2, as `labros.ros2.Managed` says.
    """
    edge = ros1.Ros1Transport if version == 1 else ros2.Ros2Transport
    with stopped_by_signals() as stop:
        transport = edge.open(name, stop, arguments, *([True] if lifecycle else []))
        if transport is None:
            return None
        with transport:
            log_to_terminal()
            if lifecycle:
                managed = ros2.Managed(transport, build)
                stop.wait()
                return managed.clean_up()
            node = build(transport, stop)
            logger.info("%s listens to %s", name, node.topics.rgb)
            node.spin(stop)
            return node.counts


def log_to_terminal() -> None:
    """Write the kit's messages to standard error; rospy has taken over the root logger by now."""
    for room in ("labkit", "labros"):
        kit = logging.getLogger(room)
        kit.setLevel(logging.INFO)
        kit.propagate = False
        if not kit.handlers:
            kit.addHandler(logging.StreamHandler())


def run_ros_node(
    weights_path,
    num_classes: int,
    target_class: int,
    *,
    table_z: float | None = None,
    crf: bool | None = None,
    version: int = 2,
    **options,
) -> Counts | None:
    """Run the node until SIGINT: a network's weights, its number of classes, and the class to grasp.

    The version that tutorials print ignores the target class, depth, intrinsics and the camera's pose, and publishes a
    mask alone; this one uses all of them. weights_path: as in `labkit.network.load_model`. table_z: height of the table
    in the base frame, metres. crf: as in Pipeline. version: of ROS, 2 or 1. options: those of SegmentationNode,
    T_base_cam and topics among them. Raises FileNotFoundError or ValueError for weights that cannot be used,
    ModuleNotFoundError without ROS.
    """
    from labkit.learning.network import load_model  # torch takes its time to import

    check_ros_installed(version)
    pipeline = Pipeline(load_model(weights_path, num_classes), table_z, target_class, crf=crf)
    options = {"topics": ROS_TOPICS} | options
    return run(lambda transport, _: SegmentationNode(pipeline, transport, **options), version=version)


def check_ros_installed(version: int) -> None:
    """Raise ModuleNotFoundError, which says what to install, if this version of ROS is missing."""
    ros1.import_ros("rospy") if version == 1 else ros2.import_ros("rclpy")
