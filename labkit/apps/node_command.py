"""What `labkit node` does: turn the command's words into a pipeline and a node, and say in a line what happened."""

import re
import threading
from dataclasses import asdict, dataclass, fields, replace
from itertools import repeat
from typing import get_args, get_type_hints

from labkit.node import ros
from labkit.node.actors import Camera
from labkit.node.bags import process
from labkit.node.convert import rigid
from labkit.node.messages import DEFAULT_TOPICS, ROS_TOPICS, Topics
from labkit.node.segmentation import Counts, SegmentationNode
from labkit.pipeline import Pipeline
from labkit.support.validation import require

SIMULATED_RATE = 5.0  # frames per second of --ros --sim
KINDS = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}


@dataclass(frozen=True)
class Settings:
    """The options that --sim, --ros and --bag share, as they were typed; `labkit node --help` explains them.

    With --ros each is also a ROS parameter of the same name, which wins.
    """

    model: str = "unet_rgbd"
    engine: str = "torch"
    crf: bool | None = None
    target: int = 2
    table_z: float | None = None
    camera_pose: str | None = None
    base_frame: str = "base_link"
    mirror: bool | None = None
    slop: float = 0.02
    depth_scale: float = 0.001
    qos_inputs: str = "best_effort"
    qos_outputs: str = "reliable"
    qos_depth: int = 10
    on_demand: bool = False
    renamed: tuple[str, ...] = ()

    def __post_init__(self):
        """Raise ValueError for a value of another type, such as a ROS parameter may have; a whole number is a float."""
        for name, kind in get_type_hints(Settings).items():
            kinds, value = get_args(kind) or (kind,), getattr(self, name)
            fits = name == "renamed" or type(value) in kinds or (type(value) is int and float in kinds)
            require(name, fits, " or ".join(KINDS[one] for one in kinds if one in KINDS), repr(value))

    def pipeline(self, table_z: float | None = None) -> Pipeline:
        """The pipeline that is asked for; table_z: the height of the table, if none is asked for."""
        from labkit.learning.network import load_model, weights_path

        path = weights_path(self.model)
        model = path if path.suffix == ".onnx" else load_model(path)
        height = table_z if self.table_z is None else self.table_z
        return Pipeline(model, height, self.target, mirror=self.mirror, engine=self.engine, crf=self.crf)

    def node(self, topics: Topics = DEFAULT_TOPICS) -> dict:
        """The options of SegmentationNode; topics: their names where they are not renamed."""
        given = {"base_frame": self.base_frame, "slop": self.slop, "depth_scale": self.depth_scale}
        given["queue"] = self.qos_depth
        return given | {"T_base_cam": self.T_base_cam(), "topics": self.topics(topics)}

    def T_base_cam(self):
        """The camera's pose as a matrix, or None; raises ValueError if it is not seven numbers with a unit quaternion.

        >>> Settings(camera_pose="0.5 0 0.8 1 0 0 0").T_base_cam()[:3, 3].tolist()
        [0.5, 0.0, 0.8]
        """
        if not self.camera_pose:
            return None
        numbers = numbers_of(self.camera_pose)
        require("camera_pose", len(numbers) == 7, "seven numbers, x y z qx qy qz qw", repr(self.camera_pose))
        return rigid(numbers[:3], numbers[3:])

    def topics(self, default: Topics = DEFAULT_TOPICS) -> Topics:
        """The names of the topics; raises ValueError for a renaming of one that there is not.

        >>> Settings(renamed=("rgb=/left/image",)).topics().rgb
        '/left/image'
        """
        known = [field.name for field in fields(Topics)]
        named = [item.partition("=") for item in self.renamed]
        for name, _, topic in named:
            require("topic", name in known and topic, f"NAME=TOPIC with NAME of {', '.join(known)}", f"{name}={topic}")
        return replace(default, **{name: topic for name, _, topic in named})


def numbers_of(text: str) -> list[float]:
    """The numbers of a text that holds nothing else; none if it does.

    >>> numbers_of("[1, 2.5; 3]"), numbers_of("camera.json")
    ([1.0, 2.5, 3.0], [])
    """
    try:
        return [float(word) for word in re.split(r"[\s,;]+", text.strip(" \t\r\n[]"))]
    except ValueError:
        return []


def rehearse(settings: Settings, seed: int) -> str:
    """Let a simulated camera, the node and an arm work on a scene in this process; a line on what came of it."""
    from data_gen import sample_scene
    from labkit.node.rehearsal import camera_to_lift

    spec = sample_scene(seed, "test")
    return camera_to_lift(spec, settings.pipeline(spec.table.z))


def run_on_ros(
    settings: Settings, version: int = 2, arguments=(), seed: int | None = None, lifecycle: bool = False
) -> Counts | None:
    """Run on ROS until SIGINT. version: 2 or 1. arguments: ROS's own. seed: of a scene for a simulated camera.

    lifecycle: as a node of ROS 2 that others configure and activate.
    """
    settings.node(), ros.require(version)  # what is wrong or missing is said before anything else happens
    frame = None
    if seed is not None:
        from data_gen import render, sample_scene

        frame = render(sample_scene(seed, "test"), (320, 240))

    def build(transport, stop: threading.Event) -> SegmentationNode:
        chosen = settings
        if version == 2:
            parameters = asdict(settings)
            del parameters["renamed"]  # ROS has remappings
            chosen = replace(settings, **transport.parameters(parameters))
            transport.quality(chosen.qos_inputs, chosen.qos_outputs, chosen.qos_depth)
        options = chosen.node(ROS_TOPICS) | {"on_demand": chosen.on_demand}
        if frame is not None:
            camera = Camera(transport, base_frame=chosen.base_frame, topics=options["topics"])
            threading.Thread(target=camera.run, args=(repeat(frame), SIMULATED_RATE, stop), daemon=True).start()
        return SegmentationNode(chosen.pipeline(frame and frame.table_z), transport, **options)

    return ros.run(build, version=version, arguments=arguments, lifecycle=lifecycle)


def answer_bag(settings: Settings, bag, out, probabilities: bool, storage: str = "mcap") -> tuple[str, bool]:
    """Answer the frames of a bag; a line, and whether any frame was answered."""
    options = {"probabilities": probabilities, "storage": storage} | settings.node()
    counts = process(bag, out, settings.pipeline(), **options)
    bad = f"{counts.lost} lost, {counts.failed} unusable, {counts.skipped} malformed messages"
    reasons = ", ".join(f"{reason} ({n})" for reason, n in counts.reasons.most_common(5))
    line = f"wrote {out}: {counts.answered} frames answered, {bad}" + (f": {reasons}" if reasons else "")
    return line, counts.answered > 0
