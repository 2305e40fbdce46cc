"""The node as a process of ROS, and the text's `run_ros_node` (topic 08)."""

import logging
import signal
import threading
from contextlib import contextmanager

from labkit.node.ros1 import Ros1Transport, ros
from labkit.node.segmentation import Counts, SegmentationNode
from labkit.pipeline import Pipeline

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


def run(pipeline: Pipeline, name: str = "segmentation_node", **options) -> Counts | None:
    """Run the node on ROS until a signal or ROS ends it.

    options: those of SegmentationNode. Returns what became of the frames, or None if a signal came before ROS did.
    """
    with stopped_by_signals() as stop:
        transport = Ros1Transport.open(name, stop)
        if transport is None:
            return None
        with transport:
            log_to_terminal()
            node = SegmentationNode(pipeline, transport, **options)
            logger.info("%s listens to %s", name, node.topics.rgb)
            node.spin(stop)
            return node.counts


def log_to_terminal() -> None:
    """Write the kit's messages to standard error; rospy has taken over the root logger by now."""
    kit = logging.getLogger("labkit")
    kit.setLevel(logging.INFO)
    kit.propagate = False
    if not kit.handlers:
        kit.addHandler(logging.StreamHandler())


def run_ros_node(
    weights_path, num_classes: int, target_class: int, *, table_z: float = 0.0, crf: bool = False, **options
) -> Counts | None:
    """Run the text's node until SIGINT: a network's weights, its number of classes, and the class to grasp.

    The text's version ignores the target class, depth, intrinsics and the camera's pose, and publishes a mask alone;
    this one uses all of them. weights_path: as in `labkit.network.load_model`. table_z: height of the table in the base
    frame, metres. crf: refine the labels. options: those of SegmentationNode, T_base_cam and topics among them. Raises
    FileNotFoundError or ValueError for weights that cannot be used, ModuleNotFoundError without ROS.
    """
    from labkit.network import load_model  # torch takes its time to import

    ros("rospy")  # what is missing is said before the weights are loaded
    pipeline = Pipeline(load_model(weights_path, num_classes), table_z, target_class, crf=crf)
    return run(pipeline, **options)
