"""The edge to ROS 1: a transport over rospy, and the text's `run_ros_node`.

rospy comes from Debian, not from pip. Its folder is appended to the module path when it is first needed, after the
environment's own packages; put first, it would bring the system's NumPy and OpenCV.
"""

import importlib
import logging
import signal
import sys
import threading
import xmlrpc.client
from collections.abc import Callable
from contextlib import contextmanager

from labkit.node.messages import NANOSECONDS, Header, Message
from labkit.node.segmentation import Counts, SegmentationNode
from labkit.node.wire import TYPES, Maker, from_ros, to_ros
from labkit.pipeline import Pipeline

logger = logging.getLogger(__name__)
DIST_PACKAGES = "/usr/lib/python3/dist-packages"
PACKAGES = ("rospy", "sensor_msgs", "geometry_msgs", "tf2_msgs", "diagnostic_msgs")
BUFFER = 2**24  # bytes; rospy's default holds a small part of an image, and then lags behind by whole frames
QUEUE = 10  # messages to a slow listener
CHECK_SECONDS = 0.5  # how often the master is asked whether it still knows us


def ros(module: str):
    """Import a module of ROS; raises ModuleNotFoundError that says what to install."""
    if importlib.util.find_spec(module.partition(".")[0]) is None and DIST_PACKAGES not in sys.path:
        sys.path.append(DIST_PACKAGES)
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        packages = " ".join(f"python3-{package.replace('_', '-')}" for package in PACKAGES)
        raise ModuleNotFoundError(f"{error.name} is missing; ROS 1 on Debian: apt install {packages}") from error


class _Maker(Maker):
    """Makes messages of rospy's classes."""

    def __call__(self, name: str, /, **fields):
        return message_class(name)(**fields)

    def header(self, header: Header):
        stamp = ros("genpy").Time(*divmod(header.stamp, NANOSECONDS))
        return self("std_msgs/Header", stamp=stamp, frame_id=header.frame_id)

    def data(self, data):
        return bytes(data)

    def numbers(self, values):
        return list(map(float, values))


def message_class(name: str):
    """The class of a ROS type such as "sensor_msgs/Image"."""
    package, _, kind = name.partition("/")
    return getattr(ros(f"{package}.msg"), kind)


class RosTransport:
    """A node of ROS as a transport: what is published and subscribed goes over TCP to and from other nodes.

    A process holds one. Unlike rospy alone it survives a master that is started anew, to which every node is unknown:
    it registers again, so that nodes that come later find it. Use it as a context manager, or call `close`.
    """

    def __init__(self, name: str):
        self._rospy = ros("rospy")
        self._rospy.init_node(name, disable_signals=True)
        self._make = _Maker()
        self._publishers, self._subscribers = {}, {}
        self._closing = threading.Event()
        self._keeper = threading.Thread(target=self._keep_registered, daemon=True)
        self._keeper.start()

    def __enter__(self) -> "RosTransport":
        return self

    def __exit__(self, *_):
        self.close()

    def close(self) -> None:
        """Leave ROS."""
        self._closing.set()
        self._keeper.join()
        self._rospy.signal_shutdown("done")

    def advertise(self, topic: str, kind: type) -> None:
        """Tell the master that messages of the class `kind` come from here."""
        cls = message_class(TYPES[kind])
        self._publishers[topic] = self._rospy.Publisher(topic, cls, queue_size=QUEUE)

    def publish(self, topic: str, message: Message) -> None:
        """Send a message to all who listen; they get it from a thread of rospy's, so this does not wait for them."""
        if not self._rospy.is_shutdown():  # afterwards nobody is left
            self._publishers[topic].publish(to_ros(message, self._make))

    def subscribe(self, topic: str, kind: type, callback: Callable[[Message], None]) -> None:
        """Call `callback` in a thread of rospy's with every message that comes."""
        name = TYPES[kind]
        self._subscribers[topic] = self._rospy.Subscriber(
            topic,
            message_class(name),
            lambda raw: callback(from_ros(name, raw)),
            buff_size=BUFFER,
            tcp_nodelay=True,
        )

    def wanted(self, topic: str) -> bool:
        """Whether any node listens."""
        return self._publishers[topic].get_num_connections() > 0

    def _keep_registered(self) -> None:
        name, uri = self._rospy.get_name(), self._rospy.get_node_uri()
        master = xmlrpc.client.ServerProxy(ros("rosgraph").get_master_uri())
        itself = xmlrpc.client.ServerProxy(uri)
        while not self._closing.wait(CHECK_SECONDS):
            try:
                known, _, _ = master.lookupNode(name, name)
                if known == 1:
                    continue
                logger.warning("the ROS master does not know %s (was it restarted?); registering again", name)
                for publisher in tuple(self._publishers.values()):
                    master.registerPublisher(name, publisher.resolved_name, publisher.type, uri)
                for subscriber in tuple(self._subscribers.values()):
                    topic = subscriber.resolved_name
                    _, _, sources = master.registerSubscriber(name, topic, subscriber.type, uri)
                    itself.publisherUpdate("/master", topic, sources)
            except (OSError, xmlrpc.client.Error):
                continue  # the master is away: nodes that know each other go on without it


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


def wait_for_master(stop: threading.Event) -> bool:
    """Wait until a ROS master answers; False if `stop` was set before."""
    uri = ros("rosgraph").get_master_uri()
    said = False
    while not stop.is_set():
        try:
            xmlrpc.client.ServerProxy(uri).getPid("/labkit")
            return True
        except OSError:
            if not said:
                logger.warning("waiting for the ROS master at %s", uri)
            said = True
            stop.wait(CHECK_SECONDS)
    return False


def run(pipeline: Pipeline, name: str = "segmentation_node", **options) -> Counts | None:
    """Run the node on ROS until a signal or ROS ends it; what became of the frames, None if no master ever came.

    options: those of SegmentationNode.
    """
    with stopped_by_signals() as stop:
        if not wait_for_master(stop):
            return None
        with RosTransport(name) as transport:
            log_to_terminal()
            ros("rospy").on_shutdown(stop.set)  # `rosnode kill`, or another node took this one's name
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
    """Run the text's node (section 6) until SIGINT: a network's weights, its number of classes, and what to grasp.

    The text's version ignores the target class, depth, intrinsics and the camera's pose, and publishes a mask alone;
    this one uses all of them. weights_path: as in `labkit.network.load_model`. table_z: height of the table in the base
    frame, metres. crf: refine the labels. options: those of SegmentationNode, T_base_cam and topics among them. Raises
    FileNotFoundError or ValueError for weights that cannot be used, ModuleNotFoundError without ROS.
    """
    from labkit.network import load_model

    if target_class not in range(num_classes):
        raise ValueError(f"target_class: expected 0 to {num_classes - 1}, got {target_class!r}")
    ros("rospy")  # said before the weights are loaded
    pipeline = Pipeline(load_model(weights_path, num_classes), table_z, target_class, crf=crf)
    return run(pipeline, **options)
