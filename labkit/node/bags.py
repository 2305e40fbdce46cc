"""Bags of ROS 1 and ROS 2 through `rosbags`, without ROS: the node answers what a bag holds and writes another.

A bag is a file NAME.bag in ROS 1, and a folder in ROS 2.
"""

from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from rosbags import rosbag1, rosbag2
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from tqdm.auto import tqdm

from labkit.node.messages import DEFAULT_TOPICS, NANOSECONDS, Header, Message, Topics, Transforms
from labkit.node.segmentation import Counts, SegmentationNode
from labkit.node.transforms import TransformTree
from labkit.node.wire import TYPES, Maker, from_ros, to_ros
from labkit.pipeline import Pipeline


class _Maker(Maker):
    """Makes messages of rosbags' types."""

    def __init__(self, ros1: bool):
        self.ros1 = ros1
        self.store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
        if ros1:  # the one type that rosbags' store of ROS 1 lacks
            self.store.register(
                get_types_from_msg("geometry_msgs/TransformStamped[] transforms", full_name(TYPES[Transforms]))
            )

    def __call__(self, name: str, /, **fields):
        if not self.ros1 and name == "sensor_msgs/CameraInfo":
            fields = {key.lower(): value for key, value in fields.items()}
        return self.store.types[full_name(name)](**fields)

    def header(self, header: Header):
        seconds, nanoseconds = divmod(header.stamp, NANOSECONDS)
        stamp = self.store.types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)
        number = {"seq": 0} if self.ros1 else {}
        return self("std_msgs/Header", stamp=stamp, frame_id=header.frame_id, **number)

    def data(self, data):
        return np.frombuffer(data, np.uint8)

    def numbers(self, values):
        return np.array(values, np.float64)


def full_name(name: str) -> str:
    """The name by which ROS 2 and rosbags know a type.

    >>> full_name("sensor_msgs/Image")
    'sensor_msgs/msg/Image'
    """
    package, _, kind = name.partition("/")
    return f"{package}/msg/{kind}"


class BagWriter:
    """A transport that writes what is published to a bag, at each message's own stamp; a context manager.

    path: NAME.bag for ROS 1, else a new folder for ROS 2. wants: topics to write that are made only if wanted. Raises
    FileExistsError rather than write over anything.
    """

    def __init__(self, path, wants=()):
        self.path, self.wants = Path(path), frozenset(wants)
        if self.path.exists():
            raise FileExistsError(17, "it is there already", str(self.path))
        self.path.parent.mkdir(parents=True, exist_ok=True)
        ros1 = self.path.suffix == ".bag"
        self._make = _Maker(ros1)
        self._writer = rosbag1.Writer(self.path) if ros1 else rosbag2.Writer(self.path, version=8)
        self._connections = {}

    def __enter__(self) -> "BagWriter":
        self._writer.open()
        return self

    def __exit__(self, *_):
        self._writer.close()

    def advertise(self, topic: str, kind: type) -> None:
        """Prepare a topic, so that it is in the bag even without messages."""
        if topic not in self._connections:
            store = self._make.store
            self._connections[topic] = self._writer.add_connection(topic, full_name(TYPES[kind]), typestore=store)

    def publish(self, topic: str, message: Message) -> None:
        """Write a message."""
        self.advertise(topic, type(message))
        raw, store = to_ros(message, self._make), self._make.store
        serialize = store.serialize_ros1 if self._make.ros1 else store.serialize_cdr
        first = message.transforms[0] if isinstance(message, Transforms) else message
        self._writer.write(
            self._connections[topic], first.header.stamp, serialize(raw, full_name(TYPES[type(message)]))
        )

    def subscribe(self, topic: str, kind: type, callback: Callable[[Message], None]) -> None:
        """Nothing comes out of a bag that is written."""

    def wanted(self, topic: str) -> bool:
        """Whether a topic that is made only on demand is to be written."""
        return topic in self.wants


class _Between(BagWriter):
    """A transport between two bags: messages of the one are delivered, those of the node written to the other."""

    def __init__(self, path, wants=()):
        super().__init__(path, wants)
        self.callbacks = {}

    def subscribe(self, topic, kind, callback):
        self.callbacks[topic] = callback


def process(
    source,
    out,
    pipeline: Pipeline,
    *,
    topics: Topics = DEFAULT_TOPICS,
    probabilities: bool = False,
    progress: bool = True,
    **options,
) -> Counts:
    """Answer every frame of a bag and write the results to another; returns what became of messages and frames.

    source, out: bags of ROS 1 or ROS 2, told by their names. probabilities: write those, too. options: those of
    SegmentationNode. Transforms may stand anywhere in the bag. Raises FileNotFoundError, FileExistsError, or ValueError
    if the bag cannot be read or lacks one of the camera's topics.
    """
    needed = [topics.rgb, topics.depth, topics.info]
    with _reader(Path(source)) as reader:
        there = {connection.topic for connection in reader.connections}
        if missing := [topic for topic in needed if topic not in there]:
            found = ", ".join(sorted(there)) or "none"
            raise ValueError(f"topics: expected {', '.join(missing)} in {source}, got {found}")
        with _Between(out, {topics.probabilities} if probabilities else ()) as between:
            # All transforms come first, for an image may ask for one that was recorded after it; then none will come.
            tree = TransformTree(seconds=float("inf"))
            node = SegmentationNode(pipeline, between, topics=topics, tree=tree, patience=0.0, **options)
            for wanted in ([topics.tf, topics.tf_static], needed):
                chosen = [c for c in reader.connections if c.topic in wanted and c.topic in between.callbacks]
                total = sum(c.msgcount for c in chosen)
                with tqdm(_messages(reader, chosen), total=total, unit="message", disable=not progress) as bar:
                    for topic, message in bar:
                        if isinstance(message, Exception):
                            node.skip(topic, message)
                        else:
                            between.callbacks[topic](message)
                        node.spin_once()
        return node.counts


@contextmanager
def _reader(source: Path):
    if not source.exists():
        raise FileNotFoundError(2, "no such bag", str(source))
    try:
        reader = AnyReader([source], default_typestore=get_typestore(Stores.ROS2_HUMBLE))
        reader.open()
    except Exception as error:  # rosbags raises a dozen types for files that are damaged, or no bags
        reason = (str(error).strip().splitlines() or [type(error).__name__])[0]
        raise ValueError(f"bag: {source} cannot be read (truncated, or not a bag?): {reason}") from error
    try:
        yield reader
    finally:
        reader.close()


def _messages(reader: AnyReader, connections):
    """Topic and message, in the order of recording; the error in place of a message that cannot be read."""
    for connection, _, data in reader.messages(connections) if connections else ():
        try:
            raw = reader.deserialize(data, connection.msgtype)
            message = from_ros(connection.msgtype.replace("/msg/", "/"), raw)
        except Exception as error:  # whatever bytes a damaged message holds, the next one may be fine
            message = ValueError(f"message: expected a {connection.msgtype}: {type(error).__name__}: {error}")
        yield connection.topic, message
