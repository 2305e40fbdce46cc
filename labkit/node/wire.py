"""The kit's messages as ROS's and back, for rospy and for bags alike: both name the fields of a message the same way.

How a message class is found, and how times, bytes and numbers are held, differs; that is what a Maker knows.
"""

from abc import ABC, abstractmethod

from labkit.node.messages import (
    NANOSECONDS,
    CameraInfo,
    Diagnostics,
    Header,
    Image,
    JointState,
    Message,
    PointCloud2,
    PointField,
    Pose,
    Transform,
    Transforms,
)

TYPES = {
    Image: "sensor_msgs/Image",
    CameraInfo: "sensor_msgs/CameraInfo",
    PointCloud2: "sensor_msgs/PointCloud2",
    Pose: "geometry_msgs/PoseStamped",
    Transforms: "tf2_msgs/TFMessage",
    JointState: "sensor_msgs/JointState",
    Diagnostics: "diagnostic_msgs/DiagnosticArray",
}
KINDS = {name: kind for kind, name in TYPES.items()}
DIAGNOSED_BY = "labkit"  # the hardware_id of diagnostics: who says it


class Maker(ABC):
    """Makes messages of one library."""

    @abstractmethod
    def __call__(self, name: str, /, **fields):
        """A message of ROS type `name`, such as "sensor_msgs/Image"."""

    @abstractmethod
    def header(self, header: Header):
        """A std_msgs/Header."""

    @abstractmethod
    def data(self, data):
        """Bytes as the library holds uint8[]."""

    @abstractmethod
    def numbers(self, values):
        """Numbers as the library holds float64[]."""


def to_ros(message: Message, make: Maker):
    """Translate a message of the kit to one of ROS."""
    name = TYPES[type(message)]
    if isinstance(message, Transforms):
        return make(name, transforms=[_transform(one, make) for one in message.transforms])
    header = make.header(message.header)
    match message:
        case Image():
            layout = {key: getattr(message, key) for key in ("height", "width", "encoding", "is_bigendian", "step")}
            return make(name, header=header, data=make.data(message.data), **layout)
        case CameraInfo():
            return _camera_info(message, header, make)
        case PointCloud2():
            names = ("height", "width", "is_bigendian", "point_step", "row_step", "is_dense")
            layout = {key: getattr(message, key) for key in names}
            fields = [
                make("sensor_msgs/PointField", name=f.name, offset=f.offset, datatype=f.datatype, count=f.count)
                for f in message.fields
            ]
            return make(name, header=header, fields=fields, data=make.data(message.data), **layout)
        case Pose():
            position, orientation = (
                _vector("Point", message.position, make),
                _vector("Quaternion", message.orientation, make),
            )
            pose = make("geometry_msgs/Pose", position=position, orientation=orientation)
            return make(name, header=header, pose=pose)
        case JointState():
            values, none = make.numbers(message.position), make.numbers(())
            return make(name, header=header, name=list(message.name), position=values, velocity=none, effort=none)
        case Diagnostics():
            values = [make("diagnostic_msgs/KeyValue", key=key, value=text) for key, text in message.values.items()]
            told = {"level": message.level, "name": message.name, "message": message.message, "values": values}
            status = make("diagnostic_msgs/DiagnosticStatus", hardware_id=DIAGNOSED_BY, **told)
            return make(name, header=header, status=[status])


def _vector(name: str, values, make: Maker):
    return make(f"geometry_msgs/{name}", **dict(zip("xyzw", map(float, values), strict=False)))


def _transform(one: Transform, make: Maker):
    moved = make(
        "geometry_msgs/Transform",
        translation=_vector("Vector3", one.translation, make),
        rotation=_vector("Quaternion", one.rotation, make),
    )
    header = make.header(one.header)
    return make("geometry_msgs/TransformStamped", header=header, child_frame_id=one.child_frame_id, transform=moved)


def _camera_info(message: CameraInfo, header, make: Maker):
    K = message.K
    region = make("sensor_msgs/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
    return make(
        TYPES[CameraInfo],
        header=header,
        height=message.height,
        width=message.width,
        distortion_model="plumb_bob",
        D=make.numbers(message.D),
        K=make.numbers(K),
        R=make.numbers((1, 0, 0, 0, 1, 0, 0, 0, 1)),
        P=make.numbers((*K[0:3], 0, *K[3:6], 0, *K[6:9], 0)),
        binning_x=0,
        binning_y=0,
        roi=region,
    )


def from_ros(name: str, raw) -> Message:
    """Translate a message of ROS type `name` to the kit's; raises ValueError for a type that the kit does not use."""
    kind = KINDS.get(name)
    if kind is None:
        raise ValueError(f"type: expected one of {', '.join(KINDS)}, got {name}")
    if kind is Transforms:
        return Transforms(tuple(_read_transform(one) for one in raw.transforms))
    header = _read_header(raw.header)
    if kind is Image:
        return Image(header, raw.height, raw.width, raw.encoding, raw.is_bigendian, raw.step, _bytes(raw.data))
    if kind is CameraInfo:
        K, D = (getattr(raw, key, None) for key in "KD")  # ROS 2 writes them small
        K, D = raw.k if K is None else K, raw.d if D is None else D
        return CameraInfo(header, raw.height, raw.width, tuple(map(float, K)), tuple(map(float, D)))
    if kind is PointCloud2:
        fields = tuple(PointField(f.name, f.offset, f.datatype, f.count) for f in raw.fields)
        shape = (raw.height, raw.width, fields, bool(raw.is_bigendian), raw.point_step, raw.row_step)
        return PointCloud2(header, *shape, _bytes(raw.data), bool(raw.is_dense))
    if kind is Pose:
        return Pose(header, _read_vector(raw.pose.position, "xyz"), _read_vector(raw.pose.orientation, "xyzw"))
    if kind is JointState:
        return JointState(header, tuple(raw.name), tuple(map(float, raw.position)))
    if len(raw.status) != 1:
        raise ValueError(f"status: expected the diagnostics of one node, got {len(raw.status)}")
    status = raw.status[0]
    values = {pair.key: pair.value for pair in status.values}
    return Diagnostics(header, status.name, int(status.level), status.message, values)


def _read_header(raw) -> Header:
    stamp = raw.stamp
    if hasattr(stamp, "nsecs"):
        return Header(stamp.secs * NANOSECONDS + stamp.nsecs, raw.frame_id)
    return Header(stamp.sec * NANOSECONDS + stamp.nanosec, raw.frame_id)


def _read_transform(raw) -> Transform:
    moved = raw.transform
    translation, rotation = _read_vector(moved.translation, "xyz"), _read_vector(moved.rotation, "xyzw")
    return Transform(_read_header(raw.header), raw.child_frame_id, translation, rotation)


def _read_vector(raw, names: str) -> tuple[float, ...]:
    return tuple(float(getattr(raw, name)) for name in names)


def _bytes(data):
    return data if isinstance(data, bytes | bytearray) else memoryview(data)
