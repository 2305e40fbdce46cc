"""The segmentation node: the data flow of topic 08 around a Pipeline, over any transport."""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from jaxtyping import Float

from labkit.frame import RGBDFrame
from labkit.geometry import invert_transform, project, transform_points
from labkit.grasp import GraspPlan
from labkit.node import convert
from labkit.node.diagnostics import OK, STALE_AFTER, WARN, Counts, Health
from labkit.node.messages import (
    DEFAULT_TOPICS,
    NANOSECONDS,
    CameraInfo,
    CompressedImage,
    Header,
    Image,
    Message,
    Point,
    Topics,
    Transforms,
)
from labkit.node.outputs import Outputs
from labkit.node.sync import Synchronizer
from labkit.node.transforms import TransformTree
from labkit.notices import notices
from labkit.pipeline import Perception, Pipeline
from labkit.support.validation import check_finite, check_shape, check_T, require

logger = logging.getLogger(__name__)
INPUTS = ("rgb", "depth", "info")
HEARTBEAT = 1.0  # seconds between diagnostics where nothing else happens


class SegmentationNode:
    """Colour, depth, calibration and the camera's pose in; mask, target cloud and grasp out.

    pipeline: what perceives. transport: a Bus, or an edge to ROS or to a bag. T_base_cam: where the camera stands; None
    takes it from the transforms on /tf and /tf_static at the image's stamp, waiting up to `patience` seconds for them.
    base_frame: the base's name in messages. slop: how far the stamps of one frame may lie apart, seconds. depth_scale:
    metres per unit of 16-bit depth. queue: messages of each topic that wait for the others of their frame. on_demand:
    answer only the frames that `request` asks for. max_age: seconds; an older frame gets its mask, no grasp, and a
    warning, for the world may have moved since. Raises ValueError for an argument that does not fit.

    Messages may come from any thread, which only checks them; frames are perceived by the thread that calls `spin` or
    `spin_once`. One frame waits: a newer one takes its place, and the old one is counted as dropped. Whatever is
    malformed or does not fit together is logged with the reason and skipped; a transport delivers a ValueError in place
    of a message that it cannot read. Every result carries the colour image's stamp. Probabilities, an overlay for
    people to look at, the planner's scene and the gripper's opening are published if anybody wants them. All grasps
    come as poses, the best first, as a cloud of the same order that holds their scores, widths and targets, and, where
    ROS 2 has vision_msgs, as detections with the box of what they hold. While `active` is False frames are let go, and
    nobody counts them. A point on the topic `clicked`, such as RViz's Publish Point sends, says which thing to grasp:
    the one there, in each frame until another point comes; one where no thing is lets go of it.

    Diagnostics say WARN from the first frame or message that cannot be used, and STALE after some seconds, until a
    frame is answered; WARN, too, where a topic of the camera is silent while others are not, and where most frames are
    dropped.

    >>> from labkit.node.bus import Bus
    >>> node = SegmentationNode(Pipeline(lambda rgb: rgb / 255.0), Bus(), T_base_cam=np.eye(4))
    >>> node.spin_once(timeout=0.0)
    False
    """

    def __init__(
        self,
        pipeline: Pipeline,
        transport,
        T_base_cam: Float[np.ndarray, "4 4"] | None = None,
        *,
        base_frame: str = "base_link",
        topics: Topics = DEFAULT_TOPICS,
        slop: float = 0.02,
        depth_scale: float = 0.001,
        queue: int = 10,
        patience: float = 0.2,
        tree: TransformTree | None = None,
        on_demand: bool = False,
        max_age: float = np.inf,
    ):
        require("slop", np.isfinite(slop) and slop >= 0.0, "seconds of 0 or more", slop)
        require("depth_scale", np.isfinite(depth_scale) and depth_scale > 0.0, "metres per unit, above 0", depth_scale)
        require("max_age", max_age > 0.0, "seconds above 0", max_age)
        self.pipeline, self.transport, self.topics = pipeline, transport, topics
        self.T_base_cam = None if T_base_cam is None else check_T("T_base_cam", T_base_cam)
        self.base_frame, self.depth_scale, self.patience = base_frame, depth_scale, patience
        self.tree = tree or TransformTree()
        self.on_demand, self.active, self.max_age = on_demand, True, max_age
        self._clicked: Point | None = None
        self._sync = Synchronizer(INPUTS, round(slop * NANOSECONDS), queue)
        self._health = Health({stream: getattr(topics, stream) for stream in INPUTS}, self._sync.slop)
        self._outputs = Outputs(transport, topics, base_frame)
        self._pending: tuple[dict, float] | None = None
        self._news = threading.Condition()
        self._requests: list[tuple[float, Callable[[bool, str], None]]] = []
        self._notices, self._noticed = (), -np.inf  # of the last frame that was looked at twice, and when
        transport.on_restart(self.restart)
        self._listen_to_all()
        transport.serve(topics.answer, self.request)

    @property
    def counts(self) -> Counts:
        """What became of the messages and frames."""
        return self._health.counts

    # ------------------------------------------------------------------------- what comes in, in any thread

    def _listen_to_all(self) -> None:
        for stream, encodings in (("rgb", ("rgb8", *convert.COLOUR)), ("depth", convert.DEPTH)):
            if self.transport.resolve(getattr(self.topics, stream)).endswith(("/compressed", "/compressedDepth")):
                kind, check = CompressedImage, partial(convert.check_compressed, depth=stream == "depth")
            else:
                kind, check = Image, partial(convert.check_image, encodings=encodings)
            self._listen(stream, kind, partial(self._take, stream, check))
        self._listen("info", CameraInfo, partial(self._take, "info", convert.camera_matrix))
        self._listen("clicked", Point, self._take_click)
        for stream in ("tf", "tf_static") if self.T_base_cam is None else ():
            self._listen(stream, Transforms, partial(self._take_transforms, stream))

    def _listen(self, stream: str, kind: type, take) -> None:
        """Subscribe; a message that cannot be read, or that `take` refuses, is skipped."""

        def receive(message: Message | ValueError) -> None:
            if stream in INPUTS:
                self._health.heard(stream)
            try:
                if isinstance(message, ValueError):
                    raise message
                take(message)
            except ValueError as error:
                self._skip(stream, error)

        self.transport.subscribe(getattr(self.topics, stream), kind, receive)

    def _take(self, stream: str, check, message: Message) -> None:
        check(message)
        stamp = _stamp(message)
        with self._news:
            together = self._sync.add(stream, stamp, message)
            if together is None:
                return
            self._health.complete()
            if self.active and (self._requests or not self.on_demand):
                if self._pending is not None:
                    self._health.count("dropped")
                self._pending = (together, time.monotonic())
                self._news.notify_all()

    def _take_transforms(self, stream: str, message: Transforms) -> None:
        require("message", isinstance(message, Transforms), "Transforms", type(message).__name__)
        for transform in message.transforms:
            try:
                self.tree.add(transform, static=stream == "tf_static")
            except ValueError as error:
                self._skip(stream, error)
        with self._news:
            self._news.notify_all()

    def _take_click(self, message: Point) -> None:
        _stamp(message)
        check_finite("point", check_shape("point", message.point, (3,)))
        self._clicked = message

    def _skip(self, stream: str, error: ValueError | LookupError) -> None:
        topic = getattr(self.topics, stream)
        logger.warning("%s: message skipped: %s", topic, error)
        self._health.count("skipped", topic, str(error))

    def restart(self) -> None:
        """Forget what belongs to the time before, because the clock was set back."""
        with self._news:
            self._sync.flush()
            self._health.complete()
            self.tree.forget()

    def flush(self) -> None:
        """Count what waits for its partners as lost: nothing more will come."""
        with self._news:
            self._sync.flush()
        self._count_lost()

    # --------------------------------------------------------------------------- what goes out, in one thread

    def spin(self, stop: threading.Event) -> None:
        """Answer frames until `stop` is set; tell how it goes with each, and once a second while there is none."""
        said = time.monotonic()
        while not stop.is_set():
            if self.spin_once(timeout=0.1):
                said = time.monotonic()
            elif time.monotonic() - said > HEARTBEAT:
                said = time.monotonic()
                message = self._report_state(Header(self.transport.now()))
                for reply in self._replies(said - STALE_AFTER):
                    reply(False, f"no frame came within {STALE_AFTER:g} s: {message}")

    def spin_once(self, timeout: float = 0.0) -> bool:
        """Answer the frame that waits, or the next one within `timeout` seconds; False if there was none to use."""
        with self._news:
            self._news.wait_for(lambda: self._pending is not None, timeout)
            if self._pending is None:
                return False
            together, arrived = self._pending
            self._pending = None
            replies = self._replies(arrived)
        answered, words = self._answer(together, arrived)
        for reply in replies:
            reply(answered, words)
        return answered

    def request(self, reply: Callable[[bool, str], None]) -> None:
        """Ask for an answer to the next frame that comes; `reply` gets whether there was one, and words.

        It is called in the thread that calls `spin`; if no frame comes for some seconds, it gets what is known of why.
        """
        with self._news:
            self._requests.append((time.monotonic(), reply))

    def _replies(self, until: float) -> list[Callable[[bool, str], None]]:
        """Take out the requests that came before a time."""
        with self._news:
            replies = [reply for asked, reply in self._requests if asked <= until]
            self._requests = [request for request in self._requests if request[0] > until]
        return replies

    def _answer(self, together: dict, arrived: float) -> tuple[bool, str]:
        header = together["rgb"].header
        try:
            perception, old = self._if_new(header, self._perceive(together))
            self._outputs.publish(header, perception)
        except Exception as error:
            if not isinstance(error, ValueError | LookupError):  # a mistake in somebody's stage: it is shown whole
                logger.exception("frame of stamp %d failed", header.stamp)
            return False, self._fail(header, error)
        self._health.count("answered")
        self._count_lost()
        plan = perception.plan
        values = {
            "milliseconds": f"{1000.0 * (time.monotonic() - arrived):.2f}",
            "of these in the pipeline": f"{1000.0 * sum(perception.seconds.values()):.2f}",
            "grasp": f"best of {len(plan.grasps)}" if plan.grasps else f"none: {plan.reason}",
        }
        wrong = [*old, *self._notice(perception, together["info"].D), *self._health.gone()]
        message = "; ".join(["answered", *wrong])
        self._outputs.report(header, message, WARN if wrong else OK, values | self._health.values())
        return True, f"answered the frame of stamp {header.stamp}; grasp: {values['grasp']}"

    def _perceive(self, together: dict) -> Perception:
        T_base_cam = self._base_transform(together["rgb"].header)
        for stream in ("rgb", "depth"):
            if isinstance(together[stream], CompressedImage):
                size = together["info"].height, together["info"].width
                together[stream] = convert.decompress(together[stream], size)
        frame = convert.to_frame(**together, T_base_cam=T_base_cam, depth_scale=self.depth_scale)
        click = self._clicked
        if click is None:
            return self.pipeline.run(frame)
        try:
            perception = self.pipeline.run(frame, self._pixel(click, together["rgb"].header, frame))
        except (ValueError, LookupError) as error:  # outside the picture, or in a frame that nobody knows
            self._clicked = None
            self._skip("clicked", error)
            return self.pipeline.run(frame)
        if not perception.clouds and self._clicked is click:
            self._clicked = None
        return perception

    def _pixel(self, click: Point, header: Header, frame: RGBDFrame) -> tuple[float, float]:
        """Where in a frame's picture a clicked point lies, (u, v)."""
        P = np.array([click.point], np.float64)
        if click.header.frame_id == header.frame_id:
            P = transform_points(frame.T_base_cam, P)
        elif click.header.frame_id != self.base_frame:
            with self._news:
                P = transform_points(self.tree.lookup(self.base_frame, click.header.frame_id, header.stamp), P)
        u, v = project(transform_points(invert_transform(frame.T_base_cam), P), frame.K)
        return float(u[0]), float(v[0])

    def _if_new(self, header: Header, perception: Perception) -> tuple[Perception, list[str]]:
        """Take the grasps of a frame that is too old away; also what is said of that."""
        age = (self.transport.now() - header.stamp) / NANOSECONDS
        if age <= self.max_age:
            return perception, []
        said = f"the frame is {age:.1f} s old, more than max_age = {self.max_age:g} s: no grasp"
        return replace(perception, plan=GraspPlan(reason=said)), [said]

    def _base_transform(self, header: Header) -> Float[np.ndarray, "4 4"]:
        """Where the camera stood at an image's stamp; its transform may arrive a little later than the image."""
        if self.T_base_cam is not None:
            return self.T_base_cam
        begin = time.monotonic()
        while True:
            with self._news:
                try:
                    return self.tree.lookup(self.base_frame, header.frame_id, header.stamp)
                except LookupError:
                    left = begin + self.patience - time.monotonic()
                    if left <= 0.0:
                        raise
                    self._news.wait(left)

    def _notice(self, perception: Perception, distortion) -> tuple[str, ...]:
        """What looks wrong; it seldom changes from frame to frame, and takes its time, so it is looked for at times."""
        now = time.monotonic()
        if now - self._noticed > HEARTBEAT:
            before, self._noticed = self._notices, now
            self._notices = notices(perception.frame, perception, distortion)
            if self._notices and not before:
                logger.warning("%s", "; ".join(self._notices))
        return self._notices

    def _fail(self, header: Header, error: Exception) -> str:
        words = repr(error) if isinstance(error, KeyError) else str(error)
        logger.warning("frame of stamp %d skipped: %s", header.stamp, words)
        self._health.count("failed", "frame skipped", words)
        return self._report_state(header)

    def _report_state(self, header: Header) -> str:
        """Tell how it goes without an answer; returns the words."""
        self._count_lost()
        message, level = "inactive", OK
        if self.active:
            message, level = self._health.state("a request" if self.on_demand and not self._requests else "frames")
        self._outputs.report(header, message, level, self._health.values())
        return message

    def _count_lost(self) -> None:
        with self._news:
            self._health.lost(self._sync.missing(), max(self._sync.left.values(), default=0))


def _stamp(message: Message) -> int:
    """When a message's content was true; raises ValueError if it does not say so."""
    header = message.header
    if not (isinstance(header, Header) and isinstance(header.stamp, int)):
        raise ValueError(f"header: expected a stamp in whole nanoseconds, got {header!r}")
    return header.stamp
