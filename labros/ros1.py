"""The edge to ROS 1: a transport over rospy (topic 08).

rospy comes from Debian, not from pip. Its folder is appended to the module path when it is first needed, after the
environment's own packages; put first, it would bring the system's NumPy and OpenCV.
"""

import functools
import importlib
import logging
import socket
import sys
import threading
import xmlrpc.client
from collections.abc import Callable

from labkit.node.bus import Transport
from labkit.node.messages import Message
from labros.wire import TYPES, RosCodec

logger = logging.getLogger(__name__)
DIST_PACKAGES = "/usr/lib/python3/dist-packages"
BUFFER = 2**24  # bytes; rospy's default holds a small part of an image, and then lags behind by whole frames
QUEUE = 10  # messages to a slow listener
CHECK_SECONDS = 0.5  # how often the master is asked whether it still knows us


def import_ros(module: str):
    """Import a module of ROS 1; raises ModuleNotFoundError that says what to install."""
    if importlib.util.find_spec(module.partition(".")[0]) is None and DIST_PACKAGES not in sys.path:
        sys.path.append(DIST_PACKAGES)
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(f"{error.name} is missing; ROS 1 on Debian: apt install python3-rospy") from error


class Ros1Transport(Transport):
    """A node of ROS 1 as a transport: what it publishes and subscribes goes over TCP to and from other nodes.

    A process holds one. Unlike rospy alone it survives a master that is started anew, to which every node is unknown:
    it registers again, so that nodes that come later find it. Use it as a context manager, or call `close`.
    """

    def __init__(self, name: str, arguments=()):
        self._rospy, self._time_limit = import_ros("rospy"), socket.getdefaulttimeout()
        self._rospy.init_node(name, argv=[name, *arguments], disable_signals=True)
        self._wire = RosCodec(ros1=True)
        self._publishers, self._subscribers = {}, {}
        self._closing = threading.Event()
        self._keeper = threading.Thread(target=self._keep_registered, daemon=True)
        self._keeper.start()

    @classmethod
    def open(cls, name: str, stop: threading.Event, arguments=()) -> "Ros1Transport | None":
        """Join ROS as soon as a master answers; None if `stop` is set before. ROS sets it when it ends the node."""
        uri = import_ros("rosgraph").get_master_uri()
        said = False
        while not stop.is_set():
            try:
                xmlrpc.client.ServerProxy(uri).getPid("/labkit")
                break
            except OSError:
                if not said:
                    logger.warning("waiting for the ROS master at %s", uri)
                said = True
                stop.wait(CHECK_SECONDS)
        else:
            return None
        transport = cls(name, arguments)
        import_ros("rospy").on_shutdown(stop.set)  # `rosnode kill`, or another node took this one's name
        return transport

    def close(self) -> None:
        """Leave ROS."""
        self._closing.set()
        self._keeper.join()
        for hook in self._rospy.core._shutdown_hooks:
            # rospy closes its server's socket and lets it go on: it would poll what is closed with all of a core.
            node = getattr(hook, "__self__", None)
            if server := getattr(node, "server", None):
                node.is_shutdown = True
                server.shutdown()
        self._rospy.signal_shutdown("done")
        socket.setdefaulttimeout(self._time_limit)  # rospy sets one for all sockets of the process

    def advertise(self, topic: str, kind: type) -> None:
        """Tell the master that messages of the class `kind` come from here."""
        if self._wire.knows(kind):
            self._publishers[topic] = self._rospy.Publisher(topic, self._message_class(TYPES[kind]), queue_size=QUEUE)

    def publish(self, topic: str, message: Message) -> None:
        """Send a message to all who listen; they get it from a thread of rospy's, so this does not wait for them."""
        if self._rospy.is_shutdown():  # nobody is left
            return
        raw = self._message_class(TYPES[type(message)])()
        raw._buff = self._wire.encode(message)
        self._publishers[topic].publish(raw)

    def subscribe(self, topic: str, kind: type, callback: Callable[[Message | ValueError], None]) -> None:
        """Call `callback` in a thread of rospy's with every message, or with the error if it cannot be read."""
        name = TYPES[kind]

        def receive(raw) -> None:
            callback(self._wire.decode_or_error(name, raw._buff))

        cls = self._message_class(name)
        self._subscribers[topic] = self._rospy.Subscriber(topic, cls, receive, buff_size=BUFFER, tcp_nodelay=True)

    def wanted(self, topic: str) -> bool:
        """Whether any node listens."""
        return topic in self._publishers and self._publishers[topic].get_num_connections() > 0

    def resolve(self, topic: str) -> str:
        """Give the name that a topic has after remapping."""
        return self._rospy.resolve_name(topic)

    def now(self) -> int:
        """The time of ROS: the simulator's with use_sim_time, else this machine's; nanoseconds."""
        return self._rospy.Time.now().to_nsec()

    @functools.cache  # noqa: B019 - a process holds one transport
    def _message_class(self, name: str) -> type:
        """A class of rospy that sends and receives a type's bytes as they are; `RosCodec` writes and reads them."""
        text, checksum = self._wire.store.generate_msgdef(name, ros_version=1)
        told = {"_type": name.replace("/msg/", "/"), "_md5sum": checksum, "_full_text": text}
        return type(name.rpartition("/")[2], (self._rospy.AnyMsg,), told)

    def _keep_registered(self) -> None:
        name, uri = self._rospy.get_name(), self._rospy.get_node_uri()
        master = xmlrpc.client.ServerProxy(import_ros("rosgraph").get_master_uri())
        itself = xmlrpc.client.ServerProxy(uri)
        while not self._closing.wait(CHECK_SECONDS) and not self._rospy.is_shutdown():
            try:
                # Topic by topic: a new master may have heard of some already, from rospy, if they are new, too.
                _, _, (published, subscribed, _) = master.getSystemState(name)
                publishers = _unknown(name, self._publishers, published)
                subscribers = _unknown(name, self._subscribers, subscribed)
                if publishers or subscribers:
                    logger.warning("the ROS master does not know %s (was it restarted?); registering again", name)
                for publisher in publishers:
                    master.registerPublisher(name, publisher.resolved_name, publisher.type, uri)
                for subscriber in subscribers:
                    topic = subscriber.resolved_name
                    _, _, sources = master.registerSubscriber(name, topic, subscriber.type, uri)
                    itself.publisherUpdate("/master", topic, sources)
            except Exception as error:  # the master is away, or went in the middle of a word: nodes go on without it
                logger.debug("the ROS master: %s", error)


def _unknown(name: str, edges: dict, state: list) -> list:
    """Those publishers or subscribers of a node that are missing in a master's list of topics, each with its nodes."""
    known = {topic for topic, nodes in state if name in nodes}
    return [edge for edge in tuple(edges.values()) if edge.resolved_name not in known]
