"""What `labkit node` does: turn the command's words into a pipeline and a node, and say in a line what happened."""

import re
from dataclasses import dataclass, fields, replace

from labkit.node import ros, ros1
from labkit.node.bags import process
from labkit.node.convert import rigid
from labkit.node.messages import DEFAULT_TOPICS, Topics
from labkit.node.rehearsal import camera_to_lift
from labkit.node.segmentation import Counts
from labkit.pipeline import Pipeline


@dataclass(frozen=True)
class Settings:
    """The options that --sim, --ros and --bag share, as they were typed; `labkit node --help` explains them."""

    model: str = "unet"
    engine: str = "torch"
    crf: bool = False
    target: int = 2
    table_z: float = 0.0
    camera_pose: str | None = None
    base_frame: str = "base_link"
    renamed: tuple[str, ...] = ()
    mirror: bool = True

    def pipeline(self, table_z: float | None = None) -> Pipeline:
        """The pipeline that is asked for; table_z: the height of the table, if it is known better."""
        from labkit.network import load_model, weights_path

        path = weights_path(self.model)
        model = path if path.suffix == ".onnx" else load_model(path)
        height = self.table_z if table_z is None else table_z
        return Pipeline(model, height, self.target, mirror=self.mirror, engine=self.engine, crf=self.crf)

    def node(self) -> dict:
        """The options of SegmentationNode."""
        return {"T_base_cam": self.T_base_cam(), "base_frame": self.base_frame, "topics": self.topics()}

    def T_base_cam(self):
        """The camera's pose as a matrix, or None; raises ValueError if it is not seven numbers with a unit quaternion.

        >>> Settings(camera_pose="0.5 0 0.8 1 0 0 0").T_base_cam()[:3, 3].tolist()
        [0.5, 0.0, 0.8]
        """
        if self.camera_pose is None:
            return None
        words = re.split(r"[\s,]+", self.camera_pose.strip())
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            numbers = []
        if len(numbers) != 7:
            raise ValueError(f"camera_pose: expected seven numbers, x y z qx qy qz qw, got {self.camera_pose!r}")
        return rigid(numbers[:3], numbers[3:])

    def topics(self) -> Topics:
        """The names of the topics; raises ValueError for a renaming of one that there is not.

        >>> Settings(renamed=("rgb=/left/image",)).topics().rgb
        '/left/image'
        """
        known = [field.name for field in fields(Topics)]
        named = [item.partition("=") for item in self.renamed]
        for name, _, topic in named:
            if name not in known or not topic:
                raise ValueError(f"topic: expected NAME=TOPIC with NAME of {', '.join(known)}, got {name}={topic}")
        return replace(DEFAULT_TOPICS, **{name: topic for name, _, topic in named})


def rehearse(settings: Settings, spec) -> str:
    """Camera, node and arm on a simulated scene; a line."""
    return camera_to_lift(spec, settings.pipeline(spec.table.z))


def run_on_ros(settings: Settings) -> Counts | None:
    """Run on ROS until SIGINT."""
    options = settings.node()
    ros1.ros("rospy")  # what is missing is said before the weights are loaded
    return ros.run(settings.pipeline(), **options)


def answer_bag(settings: Settings, bag, out, probabilities: bool) -> tuple[str, bool]:
    """Answer the frames of a bag; a line, and whether any frame was answered."""
    counts = process(bag, out, settings.pipeline(), probabilities=probabilities, **settings.node())
    bad = f"{counts.lost} lost, {counts.failed} unusable, {counts.skipped} malformed messages"
    reasons = ", ".join(f"{reason} ({n})" for reason, n in counts.reasons.most_common(5))
    line = f"wrote {out}: {counts.answered} frames answered, {bad}" + (f": {reasons}" if reasons else "")
    return line, counts.answered > 0
