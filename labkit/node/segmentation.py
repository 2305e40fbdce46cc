"""The segmentation node: the data flow of topic 08 around a Pipeline, over any transport."""

import logging
import re
import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import partial

import numpy as np
from jaxtyping import Float

from labkit.grasp import Grasp
from labkit.labels import overlay
from labkit.node import convert
from labkit.node.messages import (
    DEFAULT_TOPICS,
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
    PointCloud2,
    Pose,
    PoseArray,
    Topics,
    Transforms,
)
from labkit.node.sync import Synchronizer
from labkit.node.transforms import TransformTree
from labkit.notices import notices
from labkit.pipeline import Perception, Pipeline
from labkit.support.validation import check_T, require

logger = logging.getLogger(__name__)
OUTPUTS = {
    "mask": Image,
    "probabilities": Image,
    "overlay": Image,
    "cloud": PointCloud2,
    "scene": PointCloud2,
    "gripper": JointState,
    "grasp": Pose,
    "grasps": PoseArray,
    "scores": PointCloud2,
    "detections": Detections,
    "diagnostics": Diagnostics,
}
INPUTS = ("rgb", "depth", "info")
OK, WARN, STALE = 0, 1, 3  # levels of diagnostics
HEARTBEAT = 1.0  # seconds between diagnostics where nothing else happens
STALE_AFTER = 5.0  # seconds of trouble without an answer
RECENT = 20  # frames of which more than half must not be dropped or lost
REASONS = 50  # kinds of reasons that are kept
NUMBER = re.compile(r"(?<![\w/])-?\d+(\.\d+)?")


@dataclass
class Counts:
    """What became of the messages and frames.

    answered: frames with results published. dropped: frames that a newer one superseded before anybody looked at them.
    lost: frames of which a message never came. failed: frames that could not be used. skipped: messages that were
    malformed. `reasons` says why, and how often, the newest last.
    """

    answered: int = 0
    dropped: int = 0
    lost: int = 0
    failed: int = 0
    skipped: int = 0
    reasons: Counter = field(default_factory=Counter)

    def because(self, reason: str) -> None:
        """Count a reason; those that differ in numbers alone are one, in its newest words.

        >>> counts = Counts()
        >>> for reason in ("data: 9 bytes", "K: singular", "data: 7 bytes"):
        ...     counts.because(reason)
        >>> counts.reasons
        Counter({'data: 7 bytes': 2, 'K: singular': 1})
        """
        kind = NUMBER.sub("#", reason)
        before = next((known for known in self.reasons if NUMBER.sub("#", known) == kind), reason)
        self.reasons[reason] = self.reasons.pop(before, 0) + 1
        if len(self.reasons) > REASONS:
            del self.reasons[next(iter(self.reasons))]


class SegmentationNode:
    """Colour, depth, calibration and the camera's pose in; mask, target cloud and grasp out.

    pipeline: what perceives. transport: a Bus, or an edge to ROS or to a bag. T_base_cam: where the camera stands; None
    takes it from the transforms on /tf and /tf_static at the image's stamp, waiting up to `patience` seconds for them.
    base_frame: the base's name in messages. slop: how far the stamps of one frame may lie apart, seconds. depth_scale:
    metres per unit of 16-bit depth. queue: messages of each topic that wait for the others of their frame. on_demand:
    answer only the frames that `request` asks for. Raises ValueError for an argument that does not fit.

    Messages may come from any thread, which only checks them; frames are perceived by the thread that calls `spin` or
    `spin_once`. One frame waits: a newer one takes its place, and the old one is counted as dropped. Whatever is
    malformed or does not fit together is logged with the reason and skipped; a transport delivers a ValueError in place
    of a message that it cannot read. Every result carries the colour image's stamp. Probabilities, an overlay for
    people to look at, the planner's scene and the gripper's opening are published if anybody wants them. All grasps
    come as poses, the best first, as a cloud of the same order that holds their scores, widths and targets, and, where
    ROS 2 has vision_msgs, as detections with the box of what they hold. While `active` is False frames are let go, and
    nobody counts them.

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
    ):
        require("slop", np.isfinite(slop) and slop >= 0.0, "seconds of 0 or more", slop)
        require("depth_scale", np.isfinite(depth_scale) and depth_scale > 0.0, "metres per unit, above 0", depth_scale)
        self.pipeline, self.transport, self.topics = pipeline, transport, topics
        self.T_base_cam = None if T_base_cam is None else check_T("T_base_cam", T_base_cam)
        self.base_frame, self.depth_scale, self.patience = base_frame, depth_scale, patience
        self.counts = Counts()
        self.tree = tree or TransformTree()
        self.on_demand, self.active = on_demand, True
        self._sync = Synchronizer(INPUTS, round(slop * NANOSECONDS), queue)
        self._pending: tuple[dict, float] | None = None
        self._news = threading.Condition()
        self._heard = Counter()  # messages by stream since the last ones that were together
        self._recent = deque(maxlen=RECENT)  # what became of frames
        self._trouble, self._troubled_since = "", None
        self._requests: list[tuple[float, Callable[[bool, str], None]]] = []
        transport.on_restart(self.restart)
        self._notices, self._noticed = (), -np.inf  # of the last frame that was looked at twice, and when
        for output, kind in OUTPUTS.items():
            transport.advertise(getattr(topics, output), kind)
        for stream, encodings in (("rgb", ("rgb8", *convert.COLOUR)), ("depth", convert.DEPTH)):
            if transport.resolve(getattr(topics, stream)).endswith(("/compressed", "/compressedDepth")):
                kind, check = CompressedImage, partial(convert.check_compressed, depth=stream == "depth")
            else:
                kind, check = Image, partial(convert.check_image, encodings=encodings)
            self._listen(stream, kind, partial(self._take, stream, check))
        self._listen("info", CameraInfo, partial(self._take, "info", convert.camera_matrix))
        for stream in ("tf", "tf_static") if self.T_base_cam is None else ():
            self._listen(stream, Transforms, partial(self._take_transforms, stream))
        transport.serve(topics.answer, self.request)

    # ------------------------------------------------------------------------- what comes in, in any thread

    def _listen(self, stream: str, kind: type, take) -> None:
        """Subscribe; a message that cannot be read, or that `take` refuses, is skipped."""
        topic = getattr(self.topics, stream)

        def receive(message: Message | ValueError) -> None:
            if stream in INPUTS:
                with self._news:
                    self._heard[stream] += 1
            try:
                if isinstance(message, ValueError):
                    raise message
                take(message)
            except ValueError as error:
                self._skip(topic, error)

        self.transport.subscribe(topic, kind, receive)

    def _take(self, stream: str, check, message: Message) -> None:
        check(message)
        stamp = _stamp(message)
        with self._news:
            together = self._sync.add(stream, stamp, message)
            if together is None:
                return
            self._heard.clear()
            if self.active and (self._requests or not self.on_demand):
                if self._pending is not None:
                    self.counts.dropped += 1
                    self._recent.append("dropped")
                self._pending = (together, time.monotonic())
                self._news.notify_all()

    def _take_transforms(self, stream: str, message: Transforms) -> None:
        require("message", isinstance(message, Transforms), "Transforms", type(message).__name__)
        for transform in message.transforms:
            try:
                self.tree.add(transform, static=stream == "tf_static")
            except ValueError as error:
                self._skip(getattr(self.topics, stream), error)
        with self._news:
            self._news.notify_all()

    def _skip(self, topic: str, error: ValueError) -> None:
        logger.warning("%s: message skipped: %s", topic, error)
        with self._news:
            self.counts.skipped += 1
            self._trouble = f"{topic}: {error}"
            self.counts.because(self._trouble)

    # --------------------------------------------------------------------------- what goes out, in one thread

    def spin(self, stop: threading.Event) -> None:
        """Answer frames until `stop` is set; tell how it goes with each, and once a second while there is none."""
        said = time.monotonic()
        while not stop.is_set():
            if self.spin_once(timeout=0.1):
                said = time.monotonic()
            elif time.monotonic() - said > HEARTBEAT:
                said = time.monotonic()
                message, level = self._state()
                self._report(Header(self.transport.now()), message, {}, level)
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
            T_base_cam = self._base_transform(header)
            for stream in ("rgb", "depth"):
                if isinstance(together[stream], CompressedImage):
                    together[stream] = convert.decompress(together[stream])
            frame = convert.to_frame(**together, T_base_cam=T_base_cam, depth_scale=self.depth_scale)
            perception = self.pipeline.run(frame)
            self._publish(header, frame.rgb, perception)
        except (ValueError, LookupError) as error:
            return False, self._fail(header, error)
        except Exception as error:  # a mistake in somebody's stage must not end the node either, but it is shown whole
            logger.exception("frame of stamp %d failed", header.stamp)
            return False, self._fail(header, error)
        with self._news:
            self.counts.answered += 1
            self._recent.append("answered")
            self._trouble, self._troubled_since = "", None
        plan, now = perception.plan, time.monotonic()
        if now - self._noticed > HEARTBEAT:  # what looks wrong seldom changes from frame to frame, and takes its time
            before, self._noticed = self._notices, now
            self._notices = notices(perception.frame, perception, together["info"].D)
            if self._notices and not before:
                logger.warning("%s", "; ".join(self._notices))
        values = {
            "milliseconds": f"{1000.0 * (time.monotonic() - arrived):.2f}",
            "of these in the pipeline": f"{1000.0 * sum(perception.seconds.values()):.2f}",
            "grasp": f"best of {len(plan.grasps)}" if plan.grasps else f"none: {plan.reason}",
        }
        wrong = [*self._notices, *self._gone()]
        self._report(header, "; ".join(["answered", *wrong]), values, WARN if wrong else OK)
        return True, f"answered the frame of stamp {header.stamp}; grasp: {values['grasp']}"

    def _state(self) -> tuple[str, int]:
        """Say how it goes while no frame is answered, and at which level of diagnostics."""
        with self._news:
            wrong = "; ".join(filter(None, (self._incomplete(), self._trouble)))
            if not self.active:
                return "inactive", OK
            if not wrong:
                self._troubled_since = None
                return f"waiting for {'a request' if self.on_demand and not self._requests else 'frames'}", OK
            now = time.monotonic()
            self._troubled_since = self._troubled_since or now
            seconds = now - self._troubled_since
        told = f"no frame answered for {seconds:.0f} s: {wrong}" if seconds >= HEARTBEAT else wrong
        return told, STALE if seconds > STALE_AFTER else WARN

    def _incomplete(self) -> str:
        """Say which of the camera's topics are silent while others speak, or that their stamps differ."""
        if max(self._heard.values(), default=0) < 2:
            return ""
        named = {stream: getattr(self.topics, stream) for stream in INPUTS}
        speaking = [topic for stream, topic in named.items() if self._heard[stream]]
        if silent := [topic for topic in named.values() if topic not in speaking]:
            return f"messages on {' and '.join(speaking)}, but none on {' and '.join(silent)}"
        if self._trouble or min(self._heard.values()) < 2:  # what was skipped has been heard, too
            return ""
        return f"no stamps of {', '.join(named.values())} lie within {self._sync.slop / 1e6:g} ms"

    def _gone(self) -> list[str]:
        """Say what share of the newest frames was dropped or lost, if it is most of them."""
        with self._news:
            self._count_lost()
            fates = Counter(self._recent)
        dropped, lost = fates["dropped"], fates["lost"]
        return [f"{dropped} dropped and {lost} lost of {RECENT} frames"] if dropped + lost > RECENT // 2 else []

    def restart(self) -> None:
        """Forget what belongs to the time before, because the clock was set back."""
        with self._news:
            self._sync.flush()
            self._heard.clear()
            self.tree.forget()

    def flush(self) -> None:
        """Count what waits for its partners as lost: nothing more will come."""
        with self._news:
            self._sync.flush()
            self._count_lost()

    def _count_lost(self) -> None:
        lost = max(self._sync.left.values(), default=0)
        self._recent.extend(["lost"] * (lost - self.counts.lost))
        self.counts.lost = lost
        bound = f"within {self._sync.slop / 1e6:g} ms"
        missing = {getattr(self.topics, stream): frames for stream, frames in self._sync.missing().items()}
        missing["message of another topic"] = 0 if any(missing.values()) else lost
        for what, frames in missing.items():
            reason = f"frame lost: no {what} {bound}"
            if frames != self.counts.reasons[reason]:
                del self.counts.reasons[reason]  # the newest stands last
                self.counts.reasons |= {reason: frames} if frames else {}

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

    def _fail(self, header: Header, error: Exception) -> str:
        text = str(error) if not isinstance(error, KeyError) else repr(error)
        logger.warning("frame of stamp %d skipped: %s", header.stamp, text)
        with self._news:
            self.counts.failed += 1
            self._recent.append("failed")
            self._trouble = f"frame skipped: {text}"
            self.counts.because(self._trouble)
        message, level = self._state()
        self._report(header, message, {}, level)
        return message

    def _publish(self, header: Header, rgb: np.ndarray, perception: Perception) -> None:
        topics, base = self.topics, Header(header.stamp, self.base_frame)
        publish, wanted = self.transport.publish, self.transport.wanted
        publish(topics.mask, convert.encode_image(perception.labels, "mono8", header))
        if wanted(topics.probabilities):
            p = perception.probabilities.astype(np.float32, copy=False)
            publish(topics.probabilities, convert.encode_image(p, f"32FC{p.shape[-1]}", header))
        if wanted(topics.overlay):
            publish(topics.overlay, convert.encode_image(overlay(rgb, perception.labels), "rgb8", header))
        cloud = np.concatenate([np.zeros((0, 3), np.float32), *perception.clouds])
        colours = rgb.reshape(-1, 3)[np.concatenate([np.zeros(0, np.intp), *perception.pixels])]
        publish(topics.cloud, convert.encode_cloud(cloud, base, rgb=convert.pack_rgb(colours)))
        if wanted(topics.scene):
            publish(topics.scene, convert.encode_cloud(perception.scene, base))
        grasps = perception.plan.grasps
        poses = tuple(convert.encode_pose(grasp.T_base_grasp, base) for grasp in grasps)
        publish(topics.grasps, PoseArray(base, poses))
        at = np.reshape([pose.position for pose in poses], (-1, 3))
        more = {name: np.array([getattr(grasp, name) for grasp in grasps]) for name in ("score", "width", "target")}
        publish(topics.scores, convert.encode_cloud(at, base, **more))
        if wanted(topics.detections):
            found = (_detection(pose, grasp, perception) for pose, grasp in zip(poses, grasps, strict=True))
            publish(topics.detections, Detections(base, tuple(found)))
        if grasps:
            grasp = grasps[0]
            if wanted(topics.gripper):
                finger = grasp.width / 2.0
                names = ("panda_finger_joint1", "panda_finger_joint2")
                publish(topics.gripper, JointState(base, names, (finger, finger)))
            publish(topics.grasp, poses[0])

    def _report(self, header: Header, message: str, values: dict[str, str], level: int) -> None:
        with self._news:
            self._count_lost()
            counted = {f.name: getattr(self.counts, f.name) for f in fields(Counts) if f.name != "reasons"}
            values = values | {name: str(n) for name, n in counted.items()}
            values |= {reason: str(n) for reason, n in reversed(self.counts.reasons.items())}
        values |= self.transport.troubles()
        self.transport.publish(self.topics.diagnostics, Diagnostics(header, "segmentation", level, message, values))


def _detection(pose: Pose, grasp: Grasp, perception: Perception) -> Detection:
    cloud = perception.clouds[grasp.target].astype(float)
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    box = tuple(0.5 * (low + high)), tuple(high - low)
    return Detection(f"target {grasp.target + 1}", float(grasp.score), pose, *box)


def _stamp(message: Message) -> int:
    """When a message's content was true; raises ValueError if it does not say so."""
    header = message.header
    if not (isinstance(header, Header) and isinstance(header.stamp, int)):
        raise ValueError(f"header: expected a stamp in whole nanoseconds, got {header!r}")
    return header.stamp
