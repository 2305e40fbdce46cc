"""Bags of ROS 1 and ROS 2 through `rosbags`, without ROS: the node answers what a bag holds and writes another.

A bag is a file NAME.bag in ROS 1. In ROS 2 it is a folder, as `ros2 bag record` writes it, with messages in a file of
MCAP or of SQLite; either file is read on its own, too (topic 08).
"""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from rosbags import rosbag1, rosbag2
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.typesys import Stores, get_typestore
from tqdm.auto import tqdm

from labkit.node.bus import Transport
from labkit.node.diagnostics import Counts
from labkit.node.messages import DEFAULT_TOPICS, Message, Topics, Transforms
from labkit.node.segmentation import SegmentationNode
from labkit.node.transforms import TransformTree
from labkit.pipeline import Pipeline
from labkit.support.validation import require
from labros.wire import TYPES, RosCodec

STORAGES = {"mcap": rosbag2.StoragePlugin.MCAP, "sqlite3": rosbag2.StoragePlugin.SQLITE3}
FOREVER = QosTime(0, 0)
KEPT = (QosHistory.KEEP_LAST, 10, QosReliability.RELIABLE)
ALWAYS = (FOREVER, FOREVER, QosLiveliness.AUTOMATIC, FOREVER, False)  # deadline, lifespan, liveliness and its lease


class BagWriter(Transport):
    """A transport that writes what is published to a bag, at each message's own stamp; a context manager.

    path: NAME.bag for ROS 1, else a new folder for ROS 2. wants: topics to write that are made only if wanted. storage:
    of ROS 2, "mcap" or "sqlite3". Raises FileExistsError rather than write over anything, ValueError for another
    storage.
    """

    def __init__(self, path, wants=(), storage: str = "mcap"):
        require("storage", storage in STORAGES, f"one of {', '.join(STORAGES)}", repr(storage))
        self.path, self.wants = Path(path), frozenset(wants)
        if self.path.exists():
            raise FileExistsError(17, "it is there already", str(self.path))
        self.path.parent.mkdir(parents=True, exist_ok=True)
        ros1 = self.path.suffix == ".bag"
        self._wire = RosCodec(ros1)
        newest = {"version": 9, "storage_plugin": STORAGES[storage]}
        self._writer = rosbag1.Writer(self.path) if ros1 else rosbag2.Writer(self.path, **newest)
        self._connections, self.callbacks = {}, {}
        self._writer.open()

    def close(self) -> None:
        """Finish the bag."""
        self._writer.close()

    def advertise(self, topic: str, kind: type) -> None:
        """Prepare a topic, so that it is in the bag even without messages."""
        if topic not in self._connections and self._wire.knows(kind):
            # What `ros2 bag play` shall offer: static transforms also to those who come late.
            durability = QosDurability.TRANSIENT_LOCAL if topic.endswith("/tf_static") else QosDurability.VOLATILE
            qos = {} if self._wire.ros1 else {"offered_qos_profiles": [Qos(*KEPT, durability, *ALWAYS)]}
            self._connections[topic] = self._writer.add_connection(
                topic, TYPES[kind], typestore=self._wire.store, **qos
            )

    def publish(self, topic: str, message: Message) -> None:
        """Write a message."""
        self.advertise(topic, type(message))
        first = message.transforms[0] if isinstance(message, Transforms) else message
        self._writer.write(self._connections[topic], first.header.stamp, self._wire.encode(message))

    def subscribe(self, topic: str, kind: type, callback: Callable[[Message | ValueError], None]) -> None:
        """Keep the callback for `process`; nothing comes out of a bag that is written."""
        self.callbacks[topic] = callback

    def wanted(self, topic: str) -> bool:
        """Whether a topic that is made only on demand is to be written."""
        return topic in self.wants


def answer_bag(
    source,
    out,
    pipeline: Pipeline,
    *,
    topics: Topics = DEFAULT_TOPICS,
    probabilities: bool = False,
    storage: str = "mcap",
    progress: bool = True,
    **options,
) -> Counts:
    """Answer every frame of a bag and write the results to another; returns what became of messages and frames.

    source, out: bags of ROS 1 or ROS 2, told by their names. probabilities: write those, too. storage: as in BagWriter.
    options: those of SegmentationNode. Transforms may stand anywhere in the bag. Raises FileNotFoundError,
    FileExistsError, or ValueError if the bag cannot be read or lacks one of the camera's topics.
    """
    needed = [topics.rgb, topics.depth, topics.info]
    with closing(_open(Path(source))) as reader:
        there = {connection.topic for connection in reader.connections}
        if missing := [topic for topic in needed if topic not in there]:
            found = ", ".join(sorted(there)) or "none"
            raise ValueError(f"topics: expected {', '.join(missing)} in {source}, got {found}")
        with BagWriter(out, {topics.probabilities} if probabilities else (), storage) as writer:
            # All transforms come first, for an image may ask for one that was recorded after it; then none will come.
            tree = TransformTree(seconds=float("inf"))
            node = SegmentationNode(pipeline, writer, topics=topics, tree=tree, patience=0.0, **options)
            for wanted in ([topics.tf, topics.tf_static], needed):
                chosen = [c for c in reader.connections if c.topic in wanted and c.topic in writer.callbacks]
                total = sum(c.msgcount for c in chosen)
                with tqdm(_messages(reader, chosen), total=total, unit="message", disable=not progress) as bar:
                    for topic, message in bar:
                        writer.callbacks[topic](message)
                        node.spin_once()
            node.flush()
        return node.counts


def _open(source: Path) -> AnyReader:
    if not source.exists():
        raise FileNotFoundError(2, "no such bag", str(source))
    try:
        reader = AnyReader([source], default_typestore=get_typestore(Stores.ROS2_HUMBLE))
        reader.open()
        return reader
    except Exception as error:  # rosbags raises a dozen types for files that are damaged, or no bags
        reason = (str(error).strip().splitlines() or [type(error).__name__])[0]
        raise ValueError(f"bag: {source} cannot be read (truncated, or not a bag?): {reason}") from error


def _messages(reader: AnyReader, connections):
    """Topic and message, in the order of recording; the error in place of a message that cannot be read."""
    wire = RosCodec(ros1=not reader.is2)
    for connection, _, data in reader.messages(connections) if connections else ():
        yield connection.topic, wire.decode_or_error(connection.msgtype, data)
