"""What travels between nodes: plain dataclasses with the fields of ROS's messages of the same names.

A stamp is a whole number of nanoseconds, because a float cannot hold today's time to the nanosecond. Nothing here knows
ROS: `labros.ros` and `labros.bags` translate at their edges.
"""

from dataclasses import dataclass, field

Buffer = bytes | bytearray | memoryview
NANOSECONDS = 1_000_000_000  # in a second


@dataclass(frozen=True)
class Header:
    """When and where: stamp in nanoseconds, frame_id the name of the coordinate frame that the numbers refer to."""

    stamp: int = 0
    frame_id: str = ""


@dataclass(frozen=True, eq=False)
class Image:
    """An image as bytes: row r begins at byte r * step; what is behind its last pixel is padding.

    encoding says what a pixel is ("rgb8", "16UC1", ...); is_bigendian how numbers of more than one byte are laid out.
    """

    header: Header
    height: int
    width: int
    encoding: str
    is_bigendian: int
    step: int
    data: Buffer


@dataclass(frozen=True, eq=False)
class CompressedImage:
    """An image as a file's bytes (JPEG, PNG); format says what it was before: "rgb8; jpeg compressed bgr8"."""

    header: Header
    format: str
    data: Buffer


@dataclass(frozen=True)
class CameraInfo:
    """Calibration of a camera: K row by row, D the distortion (empty or zeros for a rectified image)."""

    header: Header
    height: int
    width: int
    K: tuple[float, ...]
    D: tuple[float, ...] = ()


@dataclass(frozen=True)
class PointField:
    """Where in a point's bytes a number stands; datatype 7 is float32, 8 is float64."""

    name: str
    offset: int
    datatype: int = 7
    count: int = 1


@dataclass(frozen=True, eq=False)
class PointCloud2:
    """Points as bytes: point_step for each, in which `fields` say what is where; height is 1 if they have no order."""

    header: Header
    height: int
    width: int
    fields: tuple[PointField, ...]
    is_bigendian: bool
    point_step: int
    row_step: int
    data: Buffer
    is_dense: bool = True


@dataclass(frozen=True)
class Pose:
    """A pose in the header's frame: position in metres, orientation as a quaternion (x, y, z, w). ROS: PoseStamped."""

    header: Header
    position: tuple[float, ...]
    orientation: tuple[float, ...]


@dataclass(frozen=True)
class Point:
    """A place in the header's frame, metres. ROS: PointStamped."""

    header: Header
    point: tuple[float, ...]


@dataclass(frozen=True)
class PoseArray:
    """Several poses in the header's frame; the poses' own headers do not travel."""

    header: Header
    poses: tuple[Pose, ...]


@dataclass(frozen=True)
class Detection:
    """A grasp of one thing: the thing's name, how good the grasp is, its pose, and the thing's box.

    score: 0 to 1. centre, size: of a box along the header's axes, metres.
    """

    name: str
    score: float
    grasp: Pose
    centre: tuple[float, ...]
    size: tuple[float, ...]


@dataclass(frozen=True)
class Detections:
    """Grasps with what they hold, in the header's frame. ROS 2: vision_msgs/Detection3DArray; ROS 1's is another."""

    header: Header
    detections: tuple[Detection, ...]


@dataclass(frozen=True)
class Transform:
    """Where the frame child_frame_id stands in the header's frame: it maps the child's coordinates to the parent's.

    translation in metres, rotation as a quaternion (x, y, z, w). ROS: TransformStamped.
    """

    header: Header
    child_frame_id: str
    translation: tuple[float, ...]
    rotation: tuple[float, ...]


@dataclass(frozen=True)
class Transforms:
    """Several transforms at once, as the topics /tf and /tf_static carry them. ROS: TFMessage."""

    transforms: tuple[Transform, ...]


@dataclass(frozen=True)
class JointState:
    """Joints by name and where they are, or are to be: radians, or metres for a sliding one."""

    header: Header
    name: tuple[str, ...]
    position: tuple[float, ...]


@dataclass(frozen=True)
class Diagnostics:
    """How a node is: level 0 fine, 1 a warning, 2 an error, 3 stale; values by name, in words. ROS: DiagnosticArray."""

    header: Header
    name: str
    level: int
    message: str
    values: dict[str, str] = field(default_factory=dict)


Message = (
    Image
    | CompressedImage
    | CameraInfo
    | PointCloud2
    | Pose
    | Point
    | PoseArray
    | Detections
    | Transforms
    | JointState
    | Diagnostics
)


@dataclass(frozen=True)
class Topics:
    """The names under which messages travel; each can be changed. Without the leading slash they follow a namespace.

    rgb and depth carry a CompressedImage if the name ends in "/compressed" or "/compressedDepth". answer is a service.
    """

    rgb: str = "/camera/rgb/image_raw"
    depth: str = "/camera/depth/image_raw"
    info: str = "/camera/camera_info"
    tf: str = "/tf"
    tf_static: str = "/tf_static"
    mask: str = "/segmentation/mask"
    probabilities: str = "/segmentation/probabilities"
    overlay: str = "/segmentation/overlay"
    cloud: str = "/segmentation/target_cloud"
    grasp: str = "/segmentation/grasp"
    grasps: str = "/segmentation/grasps"
    scores: str = "/segmentation/grasp_scores"
    detections: str = "/segmentation/grasp_detections"
    gripper: str = "/segmentation/gripper"
    scene: str = "/segmentation/scene_cloud"
    clicked: str = "/clicked_point"
    answer: str = "/segmentation/answer"
    diagnostics: str = "/diagnostics"


DEFAULT_TOPICS = Topics()
SHARED = ("tf", "tf_static", "clicked", "diagnostics")  # one for all robots, whatever namespace each has
ROS_TOPICS = Topics(**{name: topic if name in SHARED else topic[1:] for name, topic in vars(DEFAULT_TOPICS).items()})
