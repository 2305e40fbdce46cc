"""The kit's messages as the bytes of ROS 1 and ROS 2, and back: what bags hold and what travels between nodes.

`rosbags` knows every message type of ROS by its definition and needs no ROS. So one module serves bags and both
middlewares, and no edge needs message classes of its own.
"""

from dataclasses import fields

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from labkit.node.messages import (
    NANOSECONDS,
    CameraInfo,
    CompressedImage,
    Detection,
    Detections,
    Diagnostics,
    Header,
    Image,
    JointState,
    Message,
    Point,
    PointCloud2,
    PointField,
    Pose,
    PoseArray,
    Transform,
    Transforms,
)
from labkit.support.validation import require

TYPES = {
    Image: "sensor_msgs/msg/Image",
    CompressedImage: "sensor_msgs/msg/CompressedImage",
    CameraInfo: "sensor_msgs/msg/CameraInfo",
    PointCloud2: "sensor_msgs/msg/PointCloud2",
    Pose: "geometry_msgs/msg/PoseStamped",
    Point: "geometry_msgs/msg/PointStamped",
    PoseArray: "geometry_msgs/msg/PoseArray",
    Detections: "vision_msgs/msg/Detection3DArray",
    Transforms: "tf2_msgs/msg/TFMessage",
    JointState: "sensor_msgs/msg/JointState",
    Diagnostics: "diagnostic_msgs/msg/DiagnosticArray",
}
KINDS = {name: kind for kind, name in TYPES.items()}
VISION = {  # the types of vision_msgs 4 that rosbags lacks; ROS 1 has others of these names
    "ObjectHypothesis": "string class_id\nfloat64 score",
    "ObjectHypothesisWithPose": "ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose",
    "BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size",
    "Detection3D": "std_msgs/Header header\nObjectHypothesisWithPose[] results\nBoundingBox3D bbox\nstring id",
    "Detection3DArray": "std_msgs/Header header\nDetection3D[] detections",
}
DIAGNOSED_BY = "labkit"  # the hardware_id of diagnostics: who says it


class RosCodec:
    """Translates between messages and bytes, for one of the two generations of ROS.

    >>> wire = RosCodec(ros1=False)
    >>> pose = Pose(Header(5, "base_link"), (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))
    >>> wire.decode("geometry_msgs/msg/PoseStamped", wire.encode(pose)) == pose
    True
    """

    def __init__(self, ros1: bool):
        self.ros1 = ros1
        self.store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
        if ros1:  # the one type that rosbags' store of ROS 1 lacks
            definition = "geometry_msgs/TransformStamped[] transforms"
            self.store.register(get_types_from_msg(definition, TYPES[Transforms]))
        else:
            for kind, definition in VISION.items():
                self.store.register(get_types_from_msg(definition, f"vision_msgs/msg/{kind}"))

    def knows(self, kind: type) -> bool:
        """Whether this generation of ROS has messages of a class of the kit's."""
        return TYPES[kind] in self.store.fielddefs

    def encode(self, message: Message) -> memoryview:
        """Write a message as the bytes of its ROS type."""
        name = TYPES[type(message)]
        raw = self._build(name, _by_ros_names(message))
        return self.store.serialize_ros1(raw, name) if self.ros1 else self.store.serialize_cdr(raw, name)

    def decode(self, name: str, data) -> Message:
        """Read the bytes of a ROS type such as "sensor_msgs/msg/Image".

        Raises ValueError for a type that the kit does not use, and for bytes that do not hold such a message.
        """
        require("type", name in KINDS, f"one of {', '.join(KINDS)}", name)
        try:
            raw = self.store.deserialize_ros1(data, name) if self.ros1 else self.store.deserialize_cdr(data, name)
            return _read(KINDS[name], raw)
        except Exception as error:  # rosbags raises a dozen types for bytes that are damaged
            raise ValueError(f"message: expected a {name}: {type(error).__name__}: {error}") from error

    def decode_or_error(self, name: str, data) -> Message | ValueError:
        """Read a message, or return the ValueError that says why it cannot be read: a Transport delivers either."""
        try:
            return self.decode(name, data)
        except ValueError as error:
            return error

    def _build(self, name: str, given):
        """Make a message of rosbags' class; a field that is not given is 0 or empty."""
        if isinstance(given, tuple):
            given = dict(zip("xyzw", map(float, given), strict=False))
        elif isinstance(given, Header):
            seconds, nanoseconds = divmod(given.stamp, NANOSECONDS)
            given = {"stamp": {"sec": seconds, "nanosec": nanoseconds}, "frame_id": given.frame_id}
        elif not isinstance(given, dict):
            given = vars(given)
        _, fields = self.store.fielddefs[name]
        # ROS 2 calls K and D of a CameraInfo k and d.
        values = {key: self._value(kind, given.get(key, given.get(key.upper()))) for key, kind in fields}
        return self.store.types[name](**values)

    def _value(self, kind, value):
        node, detail = kind
        if node == Nodetype.BASE:
            return ("" if detail[0] == "string" else 0) if value is None else value
        if node == Nodetype.NAME:
            return self._build(detail, {} if value is None else value)
        (inner, element), length = detail
        if inner == Nodetype.NAME:
            return [self._build(element, one) for one in value or ()]
        if element[0] == "string":
            return list(value or ())
        if value is None:
            return np.zeros(length, element[0])
        return np.frombuffer(value, np.uint8) if element[0] == "uint8" else np.array(value, element[0])


def _by_ros_names(message: Message) -> dict:
    """Give a message's content under the names that ROS has for it."""
    match message:
        case CameraInfo(K=K):
            P = (*K[0:3], 0, *K[3:6], 0, *K[6:9], 0)
            return vars(message) | {"distortion_model": "plumb_bob", "R": np.eye(3).ravel(), "P": P}
        case Pose():
            return {"header": message.header, "pose": vars(message)}
        case Detections():
            return vars(message) | {"detections": [_detection(message.header, one) for one in message.detections]}
        case Transforms():
            return {"transforms": [vars(one) | {"transform": vars(one)} for one in message.transforms]}
        case Diagnostics():
            values = [{"key": key, "value": text} for key, text in message.values.items()]
            status = {"level": message.level, "name": message.name, "message": message.message, "values": values}
            return {"header": message.header, "status": [status | {"hardware_id": DIAGNOSED_BY}]}
        case _:
            return vars(message)


def _detection(header: Header, one: Detection) -> dict:
    hypothesis = {"class_id": one.name, "score": one.score}
    box = {"center": {"position": one.centre, "orientation": (0.0, 0.0, 0.0, 1.0)}, "size": one.size}
    results = [{"hypothesis": hypothesis, "pose": {"pose": vars(one.grasp)}}]
    return {"header": header, "results": results, "bbox": box, "id": one.name}


def _read(kind: type, raw):
    """Translate a message of rosbags' class to one of the kit's."""
    if kind is Transforms:
        return Transforms(tuple(_read_transform(one) for one in raw.transforms))
    if kind is Pose:
        return _read_pose(_plain(raw.header), raw.pose)
    if kind is PoseArray:
        header = _plain(raw.header)
        return PoseArray(header, tuple(_read_pose(header, one) for one in raw.poses))
    if kind is Detections:
        header = _plain(raw.header)
        return Detections(header, tuple(_read_detection(header, one) for one in raw.detections))
    if kind is Diagnostics:
        require("status", len(raw.status) == 1, "the diagnostics of one node", len(raw.status))
        status = raw.status[0]
        values = {pair.key: pair.value for pair in status.values}
        return Diagnostics(_plain(raw.header), status.name, int(status.level), status.message, values)
    return kind(*(_plain(getattr(raw, f.name, getattr(raw, f.name.lower(), None))) for f in fields(kind)))


def _read_pose(header: Header, raw) -> Pose:
    return Pose(header, _plain(raw.position), _plain(raw.orientation))


def _read_detection(header: Header, raw) -> Detection:
    (best, *_), box = raw.results, raw.bbox
    grasp = _read_pose(header, best.pose.pose)
    return Detection(raw.id, best.hypothesis.score, grasp, _plain(box.center.position), _plain(box.size))


def _read_transform(raw) -> Transform:
    moved = raw.transform
    return Transform(_plain(raw.header), raw.child_frame_id, _plain(moved.translation), _plain(moved.rotation))


def _plain(value):
    """What the kit's dataclasses hold in place of a field of rosbags' messages."""
    if isinstance(value, np.ndarray):
        return memoryview(value) if value.dtype == np.uint8 else tuple(value.tolist())
    if isinstance(value, list):
        return tuple(map(_plain, value))
    match getattr(value, "__msgtype__", "").rpartition("/")[2]:
        case "Header":
            return Header(value.stamp.sec * NANOSECONDS + value.stamp.nanosec, value.frame_id)
        case "PointField":
            return PointField(value.name, value.offset, value.datatype, value.count)
        case "Point" | "Vector3":
            return float(value.x), float(value.y), float(value.z)
        case "Quaternion":
            return float(value.x), float(value.y), float(value.z), float(value.w)
        case _:
            return value
