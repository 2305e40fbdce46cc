"""`labkit node sim | bag | ros`: the segmentation node on a simulated scene, on a recording, and on ROS."""

import inspect
import threading
from dataclasses import dataclass, fields, replace
from functools import partial
from itertools import repeat
from pathlib import Path
from typing import Annotated, get_args, get_type_hints

import typer
from typer.core import TyperGroup

from labcli.commands.options import Gripper, Model, Refine

KINDS = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}
SIMULATED_RATE = 5.0  # frames per second of `ros --sim`
Seed = Annotated[int, typer.Option(help="Seed of the simulated scene.", min=0)]


@dataclass(frozen=True)
class Settings:
    """The options of every way to run the node, as they were typed."""

    model: Model = "unet_rgbd"
    engine: Annotated[str, typer.Option(help="Runtime for the network: torch, opencv or onnxruntime.")] = "torch"
    mirror: Annotated[
        bool | None,
        typer.Option(
            "--mirror/--no-mirror",
            help="Also use the mirror image; by default only a network with canonical views does.",
        ),
    ] = None
    crf: Refine = None
    anything: Annotated[
        bool, typer.Option("--anything", help="Every object on the table is a target, whatever its class.")
    ] = False
    gripper: Gripper = ""
    workspace: Annotated[
        str,
        typer.Option(
            help="What the arm can reach: from and to in x, y and z, z from the table; the Panda's by default."
        ),
    ] = ""
    target: Annotated[int, typer.Option(help="The class to grasp.")] = 2
    table_z: Annotated[
        float | None, typer.Option(help="Height of the table in the base frame, metres; 0 by default.")
    ] = None
    camera_pose: Annotated[
        str | None,
        typer.Option(help='Pose of the camera: "x y z qx qy qz qw", or T_base_cam=FILE; by default from /tf.'),
    ] = None
    base_frame: Annotated[str, typer.Option(help="The base frame's name.")] = "base_link"
    slop: Annotated[float, typer.Option(help="Largest difference between the stamps of a frame, seconds.")] = 0.02
    depth_scale: Annotated[
        float | None,
        typer.Option(
            help="Metres per unit of 16-bit depth; by default 0.001, without grasps if the objects fit another unit."
        ),
    ] = None
    topic: Annotated[
        list[str] | None, typer.Option(help="Rename a topic: rgb=/my/image/compressed, mask=/my/mask ...")
    ] = None

    def __post_init__(self):
        """Raise ValueError for a value of another type, such as a ROS parameter may have; a whole number is a float."""
        for name, kind in get_type_hints(type(self)).items():
            kinds, value = get_args(kind) or (kind,), getattr(self, name)
            fits = name == "topic" or type(value) in kinds or (type(value) is int and float in kinds)
            if not fits:
                expected = " or ".join(KINDS[one] for one in kinds if one in KINDS)
                raise ValueError(f"{name}: expected {expected}, got {value!r}")

    def pipeline(self, table_z: float | None = None):
        """The Pipeline that is asked for; table_z: the height of the table, if none is asked for."""
        from labcli.perceive import read_gripper, read_workspace
        from labkit.learning.engines import open_engine
        from labkit.learning.network import load_model, weights_path
        from labkit.learning.things import instance_finder
        from labkit.pipeline import Pipeline

        path = weights_path(self.model)
        model = path if path.suffix == ".onnx" else load_model(path)
        height = table_z if self.table_z is None else self.table_z
        planning = {"workspace": read_workspace(self.workspace)} if self.workspace else {}
        planning |= {"gripper": read_gripper(self.gripper), "unit_known": self.depth_scale is not None}
        if self.anything:
            return Pipeline(
                None,
                height,
                self.target,
                find_objects=instance_finder(open_engine(model, self.engine), self.mirror is not False),
                **planning,
            )
        how = {"flip_tta": self.mirror, "engine": self.engine, "crf": self.crf}
        return Pipeline(model, height, self.target, **how, **planning)

    def node(self, topics=None) -> dict:
        """The options of SegmentationNode; topics: their names where they are not renamed, a node.messages.Topics.

        Raises ValueError for a pose that is none, and for a renaming of a topic that there is not.

        >>> options = Settings(topic=["rgb=/left/image"], camera_pose="0.5 0 0.8 1 0 0 0").node()
        >>> options["topics"].rgb, options["T_base_cam"][:3, 3].tolist()
        ('/left/image', [0.5, 0.0, 0.8])
        """
        from labcli.poses import read_pose
        from labkit.node.messages import DEFAULT_TOPICS
        from labkit.support.validation import require

        topics = topics or DEFAULT_TOPICS
        for name, _, given in (item.partition("=") for item in self.topic or ()):
            known = name in vars(topics) and given
            require("topic", known, f"NAME=TOPIC with NAME of {', '.join(vars(topics))}", f"{name}={given}")
            topics = replace(topics, **{name: given})
        T_base_cam, said = read_pose(self.camera_pose).in_base() if self.camera_pose else (None, ())
        for sentence in said:
            typer.echo(sentence, err=True)
        given = {"base_frame": self.base_frame, "slop": self.slop, "depth_scale": self.depth_scale or 0.001}
        return given | {"T_base_cam": T_base_cam, "topics": topics}


@dataclass(frozen=True)
class RosSettings(Settings):
    """The options on ROS. On ROS 2 each but --topic is also a parameter of the same name, which wins."""

    qos_inputs: Annotated[str, typer.Option(help="QoS to request from cameras: best_effort or reliable.")] = (
        "best_effort"
    )
    qos_outputs: Annotated[str, typer.Option(help="QoS to offer: reliable or best_effort.")] = "reliable"
    qos_depth: Annotated[int, typer.Option(help="Messages kept for a slow reader.")] = 10
    max_age: Annotated[float, typer.Option(help="Seconds; an older frame gets a mask and a warning, and no grasp.")] = (
        1.0
    )
    on_demand: Annotated[
        bool, typer.Option("--on-demand", help="Answer one frame for each call of segmentation/answer; ROS 2.")
    ] = False

    def node(self, topics=None) -> dict:
        """The options of SegmentationNode, as `Settings.node`."""
        return super().node(topics) | {"queue": self.qos_depth, "on_demand": self.on_demand, "max_age": self.max_age}


def with_settings(kind: type):
    """Give a command the fields of a dataclass as its options; its first parameter gets them as one object."""

    def decorate(command):
        options = {field.name: field.default for field in fields(kind)}
        hints = get_type_hints(kind, include_extras=True)

        def run(**given):
            return command(kind(**{name: given.pop(name) for name in options}), **given)

        by_name = inspect.Parameter.KEYWORD_ONLY
        _, *own = (p.replace(kind=by_name) for p in inspect.signature(command).parameters.values())
        own += [inspect.Parameter(name, by_name, default=options[name], annotation=hints[name]) for name in options]
        run.__name__, run.__doc__ = command.__name__, command.__doc__
        run.__signature__ = inspect.Signature(own)  # which typer reads, and the annotations
        run.__annotations__ = {p.name: p.annotation for p in own}
        return run

    return decorate


class Ways(TyperGroup):
    """The ways to run the node, each with options of its own behind it."""

    def parse_args(self, ctx, args):
        if args and args[0].startswith("-") and args[0] != "--help":
            raise ValueError(f"node: expected sim, bag or ros first, as in `labkit node ros --sim`, got {args[0]}")
        return super().parse_args(ctx, args)


app = typer.Typer(cls=Ways, help="Run the segmentation node: on a scene, a bag, or ROS.", no_args_is_help=True)


@app.command()
@with_settings(Settings)
def sim(settings: Settings, seed: Seed = 0) -> None:
    """Rehearse in this process: a simulated camera, the node and an arm; one line reports the result."""
    from data_gen import sample_scene
    from labkit.node.rehearsal import camera_to_lift

    spec = sample_scene(seed, "test")
    typer.echo(camera_to_lift(spec, settings.pipeline(spec.table.z)))


@app.command()
@with_settings(Settings)
def bag(
    settings: Settings,
    source: Annotated[Path, typer.Argument(metavar="IN", help="The bag to read: NAME.bag, or a ROS 2 folder.")],
    out: Annotated[Path, typer.Argument(metavar="OUT", help="The bag to write, of either kind.")],
    storage: Annotated[str, typer.Option(help="Storage for ROS 2: mcap or sqlite3.")] = "mcap",
    probabilities: Annotated[
        bool, typer.Option("--probabilities", help="Also write class probabilities to OUT.")
    ] = False,
) -> None:
    """Process the frames of a ROS 1 or ROS 2 bag, and write another bag; exit status 1 if no frame was answered."""
    from labros.bags import answer_bag

    options = settings.node()
    counts = answer_bag(source, out, settings.pipeline(), probabilities=probabilities, storage=storage, **options)
    bad = f"{counts.lost} lost, {counts.failed} unusable, {counts.skipped} malformed messages"
    reasons = ", ".join(f"{reason} ({n})" for reason, n in counts.reasons.most_common(5))
    typer.echo(f"wrote {out}: {counts.answered} frames answered, {bad}" + (f": {reasons}" if reasons else ""))
    raise typer.Exit(0 if counts.answered else 1)


@app.command(context_settings={"ignore_unknown_options": True})
@with_settings(RosSettings)
def ros(
    settings: RosSettings,
    arguments: Annotated[
        list[str] | None, typer.Argument(metavar="[--ros-args ...]", help="Arguments for ROS itself, after all others.")
    ] = None,
    ros1: Annotated[bool, typer.Option("--ros1", help="On ROS 1 instead of ROS 2.")] = False,
    lifecycle: Annotated[
        bool, typer.Option("--lifecycle", help="Let other programs configure and activate the node; ROS 2.")
    ] = False,
    simulated: Annotated[bool, typer.Option("--sim", help="With a simulated camera.")] = False,
    seed: Seed = 0,
) -> None:
    """Run the node on ROS 2, or ROS 1, until SIGINT."""
    from labros.ros import check_ros_installed, run

    if (lifecycle or settings.on_demand) and ros1:
        raise ValueError("node: expected --lifecycle and --on-demand without --ros1, for they are ROS 2's")
    if arguments and arguments[0] != "--ros-args":
        raise ValueError(
            f"node: expected options of `labkit node ros --help`, and ROS's behind --ros-args, got {arguments[0]}"
        )
    version = 1 if ros1 else 2
    settings.node(), check_ros_installed(version)  # what is wrong or missing is said before anything else happens
    frame = None
    if simulated:
        from data_gen import render, sample_scene

        frame = render(sample_scene(seed, "test"), (320, 240))
    build = partial(node_on_ros, settings, version, frame)
    run(build, version=version, arguments=arguments or [], lifecycle=lifecycle)


def warm_up(pipeline) -> None:
    """Compile and run all that a frame needs once, so that the first frame is answered as fast as the others."""
    import numpy as np

    from labkit.frame import RGBDFrame

    depth = np.full((480, 640), 0.8, np.float32)
    labels = np.zeros(depth.shape, np.uint8)
    middle = np.s_[220:260, 290:350]
    depth[middle], labels[middle] = 0.76, pipeline.target_class
    T_base_cam = np.diag([1.0, -1.0, -1.0, 1.0])
    T_base_cam[:3, 3] = (0.5, 0.0, 0.8 + (pipeline.table_z or 0.0))
    K = np.array([[600.0, 0.0, 319.5], [0.0, 600.0, 239.5], [0.0, 0.0, 1.0]])
    frame = RGBDFrame(np.full((480, 640, 3), 128, np.uint8), depth, K, T_base_cam)
    pipeline.run(frame)
    pipeline.locate(frame, labels)


def node_on_ros(settings: RosSettings, version: int, frame, transport, stop: threading.Event):
    """Build the node on a transport of ROS, beside it a camera that sees `frame`, if there is one, until `stop`."""
    from labkit.node.actors import Camera
    from labkit.node.messages import ROS_TOPICS
    from labkit.node.segmentation import SegmentationNode

    if version == 2:
        parameters = {field.name: getattr(settings, field.name) for field in fields(settings) if field.name != "topic"}
        settings = replace(settings, **transport.parameters(parameters))  # for topics ROS has remappings
        transport.quality(settings.qos_inputs, settings.qos_outputs, settings.qos_depth)
    options = settings.node(ROS_TOPICS)
    if frame is not None:
        camera = Camera(transport, base_frame=settings.base_frame, topics=options["topics"])
        threading.Thread(target=camera.run, args=(repeat(frame), SIMULATED_RATE, stop), daemon=True).start()
    pipeline = settings.pipeline(frame and frame.table_z)
    warm_up(pipeline)
    return SegmentationNode(pipeline, transport, **options)
