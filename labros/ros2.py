"""The edge to ROS 2: a transport over rclpy (topic 08).

rclpy comes from a sourced ROS 2, or from the unofficial wheels of `make ros2` (docs/ros2.md). Messages travel as bytes,
which `RosCodec` reads and writes: that is faster than rclpy's own classes, and a message that cannot be read is an
error of one message and not of a thread.
"""

import importlib.util
import logging
import os
import threading
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from labkit.node.bus import Transport
from labkit.node.messages import Message, Point, Transforms
from labkit.support.validation import require
from labros import ros2_types
from labros.wire import TYPES, RosCodec

logger = logging.getLogger(__name__)
STATIC = "tf_static"  # the last part of the topic whose messages a late listener must get, too
RELIABILITIES = ("reliable", "best_effort")
SILENT = "nobody publishes it"
SETTINGS = Path(__file__).parent / "share/fastdds.xml"
FAST_DDS_3, FAST_DDS_2 = "FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE"  # Kilted's and Jazzy's
MISSING = "rclpy is missing; ROS 2: source a distribution's setup file, or `make ros2` for wheels in .venv-ros2"


def import_ros(module: str):
    """Import a module of ROS 2; raises ModuleNotFoundError that says where to get it."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(f"{MISSING} ({error})") from error


def set_up_shared_memory() -> None:
    """Have Fast DDS share enough memory for images, here and in processes that are started from here.

    It finds the file by an environment variable. Settings that the user chose are left alone.
    """
    if not {FAST_DDS_3, FAST_DDS_2, "FASTDDS_BUILTIN_TRANSPORTS"} & os.environ.keys():
        os.environ[FAST_DDS_2 if os.environ.get("ROS_DISTRO") == "jazzy" else FAST_DDS_3] = str(SETTINGS)


class Ros2Transport(Transport):
    """A node of ROS 2 as a transport.

    name: the node's. arguments: what stood behind --ros-args, that words included: namespace, remappings, parameters.
    lifecycle: whether the node is one that `Managed` can steer. A process may hold several transports. Use one as a
    context manager, or call `close`.
    """

    def __init__(self, name: str, arguments=(), lifecycle: bool = False):
        rclpy = import_ros("rclpy")
        set_up_shared_memory()
        self.quality()
        self._wire = RosCodec(ros1=False)
        self._publishers, self._readers, self._services, self._numbers = {}, {}, {}, {}
        self._lost, self._refused = Counter(), {}
        self._optional = set()  # topics that nobody need publish
        self._publishing, self._closed = threading.Lock(), False
        self._context = rclpy.Context()
        self._context.init([name, *arguments])
        create = import_ros("rclpy.lifecycle").LifecycleNode if lifecycle else rclpy.create_node
        self.node = create(name, context=self._context)
        self._executor = import_ros("rclpy.executors").SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    @classmethod
    def open(cls, name: str, stop: threading.Event, arguments=(), lifecycle: bool = False) -> "Ros2Transport":
        """Join ROS, which needs no master; ROS sets `stop` when it ends the node."""
        transport = cls(name, arguments, lifecycle)
        transport._context.on_shutdown(stop.set)
        return transport

    def close(self) -> None:
        """Leave ROS."""
        with self._publishing:
            self._closed = True
        self._executor.shutdown()
        self._thread.join()
        self.node.destroy_node()
        self._context.try_shutdown()

    def forget(self) -> None:
        """Take back what was advertised, subscribed to and served."""
        with self._publishing:
            for made, destroy in (
                (self._publishers, self.node.destroy_publisher),
                (self._readers, self.node.destroy_subscription),
                (self._services, self.node.destroy_service),
            ):
                for each in made.values():
                    destroy(each)
                made.clear()
            self._refused.clear()

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except Exception as error:  # how rclpy says that the context is gone
            if self._context.ok():
                logger.exception("the thread of ROS ended: %s", error)

    # ------------------------------------------------------------------------------------------ messages

    def quality(self, inputs: str = "best_effort", outputs: str = "reliable", depth: int = 10) -> None:
        """Set the quality of service of the topics to come.

        inputs: what to ask of those who publish, outputs: what to offer to those who listen; "reliable" (what is lost
        is sent again) or "best_effort" (the newest, as sensors send). depth: messages kept for a slow reader. ROS
        parameters override a topic's: "qos_overrides.TOPIC.subscription.reliability" and so on. Raises ValueError for
        another reliability or depth.
        """
        for option, value in (("inputs", inputs), ("outputs", outputs)):
            require(f"qos_{option}", value in RELIABILITIES, f"one of {', '.join(RELIABILITIES)}", repr(value))
        require("qos_depth", depth >= 1, "at least one message", depth)
        self._inputs, self._outputs, self._depth = inputs, outputs, depth

    def advertise(self, topic: str, kind: type) -> None:
        """Offer messages of the class `kind`; those of vision_msgs only where it is installed, since few have it."""
        if TYPES[kind].startswith("vision_msgs") and importlib.util.find_spec("vision_msgs") is None:
            return
        events = import_ros("rclpy.event_handler").PublisherEventCallbacks(
            incompatible_qos=self._refuse(topic, "listener")
        )
        self._publishers[topic] = self.node.create_publisher(
            self._class(kind), topic, event_callbacks=events, **self._qos(topic, self._outputs)
        )
        ros2_types.reset_error()

    def publish(self, topic: str, message: Message) -> None:
        """Send a message to all who listen."""
        self.publish_bytes(topic, bytes(self._wire.encode(message)))

    def publish_bytes(self, topic: str, data: bytes) -> None:
        """Send the bytes of a message of the topic's class, whatever they are."""
        with self._publishing:
            if self._context.ok() and not self._closed:  # afterwards nobody is left
                self._publishers[topic].publish(data)

    def subscribe(self, topic: str, kind: type, callback: Callable[[Message | ValueError], None]) -> None:
        """Call `callback` in the thread of ROS with every message, or with the error if it cannot be read."""
        name = TYPES[kind]
        if kind is Point or topic.endswith(STATIC):  # a point comes only where a person clicks
            self._optional.add(topic)

        def receive(data: bytes, info: dict) -> None:
            self._count_lost(topic, info)
            callback(self._wire.decode_or_error(name, data))

        events = import_ros("rclpy.event_handler").SubscriptionEventCallbacks(
            incompatible_qos=self._refuse(topic, "publisher")
        )
        # Transforms are small, and each is needed: nobody sends them with less than reliability.
        qos = self._qos(topic, "reliable" if kind is Transforms else self._inputs)
        self._readers[topic] = self.node.create_subscription(
            self._class(kind), topic, receive, raw=True, event_callbacks=events, **qos
        )
        ros2_types.reset_error()

    def wanted(self, topic: str) -> bool:
        """Whether any node listens."""
        offered = self._context.ok() and topic in self._publishers
        return offered and self._publishers[topic].get_subscription_count() > 0

    def _class(self, kind: type) -> type:
        return ros2_types.message_class(TYPES[kind], self._wire.store.hash_rihs01(TYPES[kind]))

    def _count_lost(self, topic: str, info: dict) -> None:
        """Publishers number their messages: a gap is what the network lost, or what came too fast for this process."""
        number, publisher = info.get("publication_sequence_number"), info.get("publisher_gid", {}).get("data")
        if number is not None:  # some middlewares do not tell
            last = self._numbers.get((topic, publisher), number - 1)
            self._numbers[topic, publisher] = number
            self._lost[topic] += max(0, number - last - 1)

    def _qos(self, topic: str, reliability: str) -> dict:
        qos = import_ros("rclpy.qos")
        static = topic.rpartition("/")[2] == STATIC
        durability = qos.DurabilityPolicy.TRANSIENT_LOCAL if static else qos.DurabilityPolicy.VOLATILE
        profile = qos.QoSProfile(
            depth=100 if topic.startswith("/tf") else self._depth,
            reliability=qos.ReliabilityPolicy.get_from_short_key(reliability),
            durability=durability,
        )
        overriding = import_ros("rclpy.qos_overriding_options").QoSOverridingOptions.with_default_policies()
        return {"qos_profile": profile, "qos_overriding_options": overriding}

    def resolve(self, topic: str) -> str:
        """Give the name that a topic has after remapping."""
        return self.node.resolve_topic_name(topic)

    def serve(self, name: str, request: Callable[[Callable[[bool, str], None]], None]) -> None:
        """Offer a service of the type std_srvs/Trigger, if that is installed."""
        try:
            kind = importlib.import_module("std_srvs.srv").Trigger
        except ModuleNotFoundError:
            logger.warning("no service %s, for std_srvs is missing", name)
            return
        service = self._services[name] = self.node.create_service(kind, name, lambda _, response: response)
        send = service.send_response

        def send_later(response, caller) -> None:
            """Not when the callback returns, as rclpy does; to wait in the callback would hold up all messages."""

            def reply(success: bool, message: str) -> None:
                response.success, response.message = success, message
                with self._publishing:
                    if self._context.ok() and not self._closed:
                        send(response, caller)

            request(reply)

        service.send_response = send_later

    # ------------------------------------------------------------------------------- time, troubles, parameters

    def now(self) -> int:
        """The time of ROS: the simulator's with use_sim_time, else this machine's; nanoseconds."""
        return self.node.get_clock().now().nanoseconds

    def on_restart(self, callback: Callable[[], None]) -> None:
        """Call `callback` whenever the time of /clock is set back, or begins to be followed."""
        clock, duration = import_ros("rclpy.clock"), import_ros("rclpy.duration")
        threshold = clock.JumpThreshold(
            min_forward=None, min_backward=duration.Duration(nanoseconds=-1), on_clock_change=True
        )
        self._jumps = self.node.get_clock().create_jump_callback(threshold, post_callback=lambda jump: callback())

    def troubles(self) -> dict[str, str]:
        """Topics that nobody publishes, messages that were lost on the way, and peers that cannot be talked to."""
        awaited = {topic: reader for topic, reader in self._readers.items() if topic not in self._optional}
        silent = {topic: SILENT for topic, reader in awaited.items() if not reader.get_publisher_count()}
        lost = {topic: f"{count} messages lost on the way" for topic, count in tuple(self._lost.items()) if count}
        return silent | lost | self._refused

    def _refuse(self, topic: str, peer: str):
        """Say in words that a peer's quality of service does not fit."""
        does, ours, option = (
            ("offers less than this node asks for", self._inputs, "qos_inputs")
            if peer == "publisher"
            else ("asks for more than this node offers", self._outputs, "qos_outputs")
        )

        def say(event) -> None:
            policy = import_ros("rclpy.qos").qos_policy_name_from_kind(event.last_policy_kind).lower()
            told = f"no messages pass, for a {peer} {does}: {policy}, here {ours} (see {option})"
            self._refused[topic] = told
            logger.warning("%s: %s", topic, told)

        return say

    def parameters(self, defaults: dict) -> dict:
        """Declare ROS parameters that are fixed at the start, with these defaults; returns their values."""
        descriptor = import_ros("rcl_interfaces.msg").ParameterDescriptor(read_only=True, dynamic_typing=True)
        found = {}
        for name, default in defaults.items():
            if not self.node.has_parameter(name):
                self.node.declare_parameter(name, default, descriptor)
            found[name] = self.node.get_parameter(name).value
        return found


class Managed:
    """The segmentation node as a lifecycle node: whoever configures it has it built, and it answers while it is active.

    transport: a Ros2Transport made with lifecycle=True. build: as in `labros.ros.run`; what it raises is logged,
    and the node stays unconfigured. Cleaning up takes everything back that configuring made.
    """

    def __init__(self, transport: Ros2Transport, build):
        lifecycle = import_ros("rclpy.lifecycle")
        self.transport, self.node = transport, None
        managed, done = self, lifecycle.TransitionCallbackReturn

        class Steps(lifecycle.ManagedEntity):
            def on_configure(self, state):
                try:
                    managed.start(build)
                except Exception as error:  # rclpy would swallow it
                    logger.error("not configured: %s", error)
                    managed.transport.forget()
                    return done.FAILURE
                return done.SUCCESS

            def on_activate(self, state):
                managed.node.active = True
                return done.SUCCESS

            def on_deactivate(self, state):
                managed.node.active = False
                return done.SUCCESS

            def on_cleanup(self, state):
                managed.clean_up()
                return done.SUCCESS

            on_shutdown = on_cleanup

        transport.node.add_managed_entity(Steps())

    def start(self, build) -> None:
        """Build the node and let it spin in a thread of its own, inactive."""
        self._stop = threading.Event()
        self.node = build(self.transport, self._stop)
        self.node.active = False
        self._spinning = threading.Thread(target=self.node.spin, args=(self._stop,))
        self._spinning.start()

    def clean_up(self):
        """End the node, if there is one; returns what became of the frames, or None."""
        if self.node is None:
            return None
        node, self.node = self.node, None
        self._stop.set()
        self._spinning.join()
        self.transport.forget()
        return node.counts
