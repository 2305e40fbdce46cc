"""The node over the in-process bus: what comes out of what goes in, what is dropped, skipped, and said about it."""

import contextlib
import dataclasses
import threading
import time

import cv2
import numpy as np
import pytest
from at_night import others_at_night
from peers import MS, PATIENCE, small, wait_for
from scenes import box, scene

from labkit.labels import SURFACE, one_hot, overlay
from labkit.node import convert
from labkit.node.actors import Arm, Camera
from labkit.node.bus import Bus
from labkit.node.messages import CompressedImage, Detections, Header, Image, Point, Topics
from labkit.node.rehearsal import camera_to_lift
from labkit.node.segmentation import SegmentationNode
from labkit.pipeline import Pipeline
from labkit.sim.world import World
from labros.wire import TYPES, RosCodec

TOPICS = Topics()
SCENE = dataclasses.replace(scene(box("block", 0.5, 0.05)), seed=5)


@pytest.fixture(scope="module")
def frame():
    with World(SCENE) as world:
        return world.render((160, 120))


class Truth:
    """A "network" that knows the labels of a frame."""

    def __init__(self, labels):
        self.answer = one_hot(labels).astype(np.float32)

    def __call__(self, rgb):
        return self.answer


class Listener:
    """Everything that was published, by topic."""

    read = 0  # diagnostics that `heard` has gone through

    def __init__(self, bus, *fields):
        self.heard = {field: [] for field in fields}
        for field in fields:
            bus.subscribe(getattr(TOPICS, field), object, self.heard[field].append)

    def __getattr__(self, name):
        return self.heard[name]


def system(frame, *listen, **options):
    """A bus with a node that sees the truth, a camera, and somebody who listens."""
    bus = Bus()
    listener = Listener(bus, "mask", "cloud", "grasp", "diagnostics", *listen)
    node = SegmentationNode(Pipeline(Truth(frame.labels)), bus, **options)
    return node, Camera(bus), listener, bus


def messages(frame, stamp=0, frame_id="camera_optical_frame"):
    """The three messages of a frame, by stream."""
    bus, caught = Bus(), {}
    for field in ("rgb", "depth", "info"):
        bus.subscribe(getattr(TOPICS, field), object, lambda message, field=field: caught.update({field: message}))
    Camera(bus, frame_id=frame_id).publish(frame, stamp)
    return caught


def send(bus, by_stream: dict) -> None:
    for stream, message in by_stream.items():
        bus.publish(getattr(TOPICS, stream), message)


@contextlib.contextmanager
def spinning(node):
    """The node in a thread of its own."""
    stop = threading.Event()
    thread = threading.Thread(target=node.spin, args=(stop,))
    thread.start()
    yield
    stop.set()
    thread.join()


def test_results_are_those_of_the_pipeline_and_carry_stamp_and_frame(frame):
    more = ("probabilities", "overlay", "scene", "gripper", "grasps", "scores", "detections")
    node, camera, out, _ = system(frame, *more, base_frame="base_link")
    camera.publish(frame, stamp=123456789)
    assert node.spin_once()
    p = node.pipeline.run(frame)
    (mask,), (cloud,), (grasp,) = out.mask, out.cloud, out.grasp
    assert mask.encoding == "mono8" and np.array_equal(convert.decode_image(mask), p.labels)
    assert mask.header == Header(123456789, "camera_optical_frame")
    assert cloud.header == grasp.header == Header(123456789, "base_link")
    assert np.allclose(convert.decode_cloud(cloud), np.concatenate(p.clouds), atol=1e-6)
    assert np.allclose(convert.decode_pose(grasp), p.plan.grasps[0].T_base_grasp, atol=1e-6)
    assert np.allclose(convert.decode_image(out.probabilities[0]), p.probabilities)
    assert np.array_equal(convert.decode_image(out.overlay[0]), overlay(frame.rgb, p.labels))
    assert np.allclose(convert.decode_cloud(out.scene[0]), p.scene, atol=1e-6)
    assert sum(out.gripper[0].position) == pytest.approx(p.plan.grasps[0].width)
    (colours,) = convert.decode_cloud(cloud, ["rgb"]).T
    pixels = np.concatenate(p.pixels)
    assert np.array_equal(colours.view(np.uint32), frame.rgb.reshape(-1, 3)[pixels].astype(int) @ (65536, 256, 1))
    (poses,), (scores,) = out.grasps, out.scores
    assert poses.poses[0] == grasp and len(poses.poses) == len(p.plan.grasps) > 1
    numbers = [[g.T_base_grasp[2, 3], g.score, g.width, g.target] for g in p.plan.grasps]
    assert np.allclose(convert.decode_cloud(scores, ["z", "score", "width", "target"]), numbers)
    found = out.detections[0].detections
    assert [one.grasp for one in found] == list(poses.poses)
    assert [one.score for one in found] == [g.score for g in p.plan.grasps]
    cloud = p.clouds[p.plan.grasps[0].target]
    assert np.allclose(np.subtract(found[0].centre, np.divide(found[0].size, 2)), cloud.min(axis=0))
    wire = RosCodec(ros1=False)
    assert wire.decode(TYPES[Detections], wire.encode(out.detections[0])) == out.detections[0]


def test_what_nobody_wants_is_not_made(frame):
    node, camera, _, bus = system(frame)
    sent = []
    publish, bus.publish = bus.publish, lambda topic, message: (sent.append(topic), publish(topic, message))
    camera.publish(frame)
    node.spin_once()
    assert TOPICS.mask in sent and not {TOPICS.probabilities, TOPICS.overlay, TOPICS.scene, TOPICS.gripper} & set(sent)


def test_millimetres_of_16_bit_are_metres_inside(frame):
    node, _, out, bus = system(frame)
    Camera(bus, depth="16UC1").publish(frame)
    node.spin_once()
    exact = np.concatenate(node.pipeline.run(frame).clouds)
    found = convert.decode_cloud(out.cloud[0])
    assert abs(len(found) - len(exact)) < 0.02 * len(exact)
    assert np.allclose(found.mean(axis=0), exact.mean(axis=0), atol=5e-4)


def test_a_slow_node_answers_the_newest_of_a_fast_camera(frame):
    bus = Bus()
    entered, go_on = threading.Event(), threading.Event()

    def slow(rgb):
        entered.set()
        assert go_on.wait(PATIENCE)
        return one_hot(frame.labels).astype(np.float32)

    out = Listener(bus, "mask")
    node = SegmentationNode(Pipeline(slow), bus)
    camera = Camera(bus)
    with spinning(node):
        camera.publish(frame, 0)
        assert entered.wait(PATIENCE)
        for stamp in (1, 2, 3):  # while the first is worked on
            camera.publish(frame, stamp * 100 * MS)
        go_on.set()
        wait_for(lambda: len(out.mask) == 2, "the second mask")
    assert [mask.header.stamp for mask in out.mask] == [0, 300 * MS]
    assert node.counts.dropped == 2 and node.counts.answered == 2


def spoil(rng, good):
    """One malformed message: its stream and itself."""
    header = Header(int(rng.integers(0, 10**10)), "camera_optical_frame")
    image, info = good["rgb"], good["info"]
    ways = [
        ("rgb", dataclasses.replace(image, header=header, data=image.data[: int(rng.integers(0, len(image.data)))])),
        ("rgb", dataclasses.replace(image, header=header, encoding=str(rng.choice(["yuv422", "", "rgb16"])))),
        ("rgb", dataclasses.replace(image, header=header, step=int(rng.integers(0, image.step)))),
        ("rgb", dataclasses.replace(image, header=header, height=0)),
        ("rgb", dataclasses.replace(image, header=header, width=image.width + int(rng.integers(1, 99)))),
        ("depth", dataclasses.replace(good["depth"], header=header, encoding="mono8")),
        ("depth", dataclasses.replace(good["depth"], header=header, data=b"")),
        ("depth", info),
        ("depth", dataclasses.replace(good["depth"], header=None)),
        ("info", dataclasses.replace(info, header=Header(None))),
        ("info", dataclasses.replace(info, header=header, K=(0.0,) * 9)),
        ("info", dataclasses.replace(info, header=header, K=tuple(np.transpose(np.reshape(info.K, (3, 3))).ravel()))),
        ("info", dataclasses.replace(info, header=header, K=(float("nan"),) * 9)),
        ("info", dataclasses.replace(info, header=header, K=info.K[:5])),
    ]
    return ways[rng.integers(len(ways))]


@pytest.mark.parametrize("count", others_at_night([200, 1000]))
@pytest.mark.bad_input
def test_among_as_many_malformed_messages_every_good_frame_is_answered(count, frame, caplog):
    """A malformed message in between two good frames each: the node answers all frames and says as many reasons."""
    bus = Bus()
    out = Listener(bus, "mask", "diagnostics")
    labels = np.full((24, 32), SURFACE)
    node = SegmentationNode(Pipeline(Truth(labels)), bus, T_base_cam=frame.T_base_cam)
    rng = np.random.default_rng(0)
    for number in range(count):
        good = messages(small(frame), number * 33 * MS)
        parts = list(good.items())
        rng.shuffle(parts)
        parts.insert(int(rng.integers(4)), spoil(rng, good))
        for stream, message in parts:
            bus.publish(getattr(TOPICS, stream), message)
        assert node.spin_once(), f"frame {number}"
    assert [mask.header.stamp for mask in out.mask] == [number * 33 * MS for number in range(count)]
    assert node.counts.skipped == count and node.counts.failed == node.counts.dropped == 0
    assert sum(node.counts.reasons.values()) == count
    said = [text for record in caplog.records if "skipped" in (text := record.getMessage())]
    assert len(said) == count and all("expected" in line and "got" in line for line in said)


def test_messages_that_do_not_fit_together_are_named_and_the_next_frame_is_answered(frame, caplog):
    node, camera, out, bus = system(frame, T_base_cam=frame.T_base_cam)
    good = messages(frame)
    header = Header(0, "camera_depth_frame")
    millimetres = convert.encode_image(1000.0 * frame.depth, "32FC1", good["depth"].header)
    for wrong, reason in (
        ({"info": dataclasses.replace(good["info"], height=99)}, "info: expected the size of rgb"),
        ({"depth": dataclasses.replace(good["depth"], header=header)}, "registered"),
        ({"depth": millimetres}, "looks like millimetres"),
    ):
        send(bus, good | wrong)
        assert not node.spin_once()
        assert reason in caplog.records[-1].getMessage() and out.diagnostics[-1].level == 1
    camera.publish(frame)
    assert node.spin_once() and node.counts.failed == 3


def test_a_broken_stage_ends_a_frame_and_not_the_node(frame, caplog):
    bus = Bus()
    answers = iter([RuntimeError("out of memory"), one_hot(frame.labels).astype(np.float32)])

    def model(rgb):
        answer = next(answers)
        if isinstance(answer, Exception):
            raise answer
        return answer

    node = SegmentationNode(Pipeline(model), bus)
    Camera(bus).publish(frame)
    assert not node.spin_once()
    assert any(record.exc_info for record in caplog.records), "the traceback of a mistake is shown"
    Camera(bus).publish(frame)
    assert node.spin_once() and node.counts.failed == 1


def test_a_frame_waits_for_its_transform_and_without_one_it_is_skipped(frame, caplog):
    node, camera, _, bus = system(frame, patience=PATIENCE)
    send(bus, messages(frame, 50 * MS))
    late = threading.Timer(0.1, camera.publish, (frame, 50 * MS))  # brings the transform, and another frame
    late.start()
    assert node.spin_once(), "the transform came after the images"
    late.join()
    node.patience = 0.0
    send(bus, messages(frame, 900 * MS))
    assert not node.spin_once() and "0.850 s after the last" in caplog.records[-1].getMessage()


def test_without_a_target_there_is_a_mask_and_no_grasp(frame):
    bus = Bus()
    out = Listener(bus, "mask", "cloud", "grasp", "diagnostics")
    node = SegmentationNode(Pipeline(Truth(np.full(frame.labels.shape, SURFACE))), bus)
    Camera(bus).publish(frame)
    assert node.spin_once() and len(out.mask) == 1
    assert convert.decode_cloud(out.cloud[0]).shape == (0, 3) and not out.grasp
    assert out.diagnostics[0].values["grasp"] == "none: no target points"


def test_a_node_without_frames_still_says_that_it_lives(frame, monkeypatch):
    monkeypatch.setattr("labkit.node.segmentation.HEARTBEAT", 0.0)
    node, _, out, _ = system(frame)
    with spinning(node):
        wait_for(lambda: out.diagnostics, "a word")
    assert out.diagnostics[0].message == "waiting for frames"


def heard(out, words: str, level: int) -> None:
    """Wait for diagnostics of a level with these words, behind those that were waited for before."""

    def said() -> bool:
        new = enumerate(out.diagnostics[out.read :], start=out.read + 1)
        out.read = next((n for n, m in new if words in m.message and m.level == level), 0) or out.read
        return out.read > before

    before = out.read
    wait_for(said, words)


def test_after_a_failure_the_heartbeat_warns_and_goes_stale_until_a_frame_is_answered(frame, monkeypatch):
    monkeypatch.setattr("labkit.node.segmentation.HEARTBEAT", 0.01)
    monkeypatch.setattr("labkit.node.diagnostics.STALE_AFTER", 0.5)
    monkeypatch.setattr("labkit.node.diagnostics.PATIENCE", 0.01)
    node, camera, out, bus = system(frame, T_base_cam=frame.T_base_cam)
    good = messages(frame)
    with spinning(node):
        heard(out, "waiting for frames", level=0)
        send(bus, good | {"info": dataclasses.replace(good["info"], height=99)})
        heard(out, "frame skipped: info: expected the size of rgb", level=1)
        failed = out.read
        heard(out, "s: frame skipped: info: expected the size of rgb", level=3)
        assert not any(m.level == 0 for m in out.diagnostics[failed : out.read])
        camera.publish(frame, 100 * MS)
        heard(out, "answered", level=0)
        heard(out, "waiting for frames", level=0)


def test_topics_that_are_silent_while_others_are_not_are_named(frame):
    node, _, out, bus = system(frame)
    Camera(bus, topics=Topics(rgb="/elsewhere", depth="/unused", info="/gone")).publish(frame)  # transforms alone
    with spinning(node):
        for number in range(3):
            good = messages(frame, number * 33 * MS)
            send(bus, {"rgb": good["rgb"], "depth": good["depth"]})
        words = f"messages on {TOPICS.rgb} and {TOPICS.depth}, but none on {TOPICS.info}"
        heard(out, words, level=1)
        for number in range(3):
            send(bus, {"info": messages(frame, (5 + number) * 1000 * MS)["info"]})
        heard(out, f"no stamps of {TOPICS.rgb}, {TOPICS.depth}, {TOPICS.info} lie within 20 ms", level=1)


@pytest.mark.bad_input
def test_reasons_are_told_in_full_and_the_newest_first(frame):
    """A kind is a topic and the field that the mistake names: none hides another, and each has its newest words."""
    node, camera, out, bus = system(frame, T_base_cam=frame.T_base_cam)
    good = messages(frame)["rgb"]
    for name, value in {"encoding": "yuv", "height": 0, "width": -1, "step": 1}.items():
        bus.publish(TOPICS.rgb, dataclasses.replace(good, **{name: value}))
    for length in (100, 200, 300):
        bus.publish(TOPICS.rgb, dataclasses.replace(good, data=bytes(length)))
    bus.publish(TOPICS.rgb, dataclasses.replace(good, height=-7))
    bus.publish(TOPICS.info, good)
    camera.publish(frame)
    assert node.spin_once()
    reasons = list(out.diagnostics[-1].values.items())[-6:]
    needed = good.height * good.step
    assert reasons[:3] == [
        (f"{TOPICS.info}: message: expected a CameraInfo, got Image", "1"),
        (f"{TOPICS.rgb}: height: expected a number above 0, got -7", "2"),
        (f"{TOPICS.rgb}: data: expected {needed} bytes, got 300: the message is truncated", "3"),
    ]
    assert [reason.split(": ")[1] for reason, _ in reasons[3:]] == ["step", "width", "encoding"]


def test_a_node_that_drops_most_frames_warns(frame):
    node, camera, out, _ = system(frame)
    for stamp in range(16):
        camera.publish(frame, stamp * 33 * MS)
    assert node.spin_once()
    assert (out.diagnostics[-1].level, out.diagnostics[-1].message) == (
        1,
        "answered; 15 dropped and 0 lost of 20 frames",
    )
    for stamp in range(16, 30):
        camera.publish(frame, stamp * 33 * MS)
        assert node.spin_once()
    assert (out.diagnostics[-1].level, out.diagnostics[-1].message) == (0, "answered")


def test_on_demand_a_request_is_answered_with_the_next_frame(frame, monkeypatch):
    monkeypatch.setattr("labkit.node.segmentation.HEARTBEAT", 0.01)
    monkeypatch.setattr("labkit.node.segmentation.STALE_AFTER", 0.1)
    node, camera, out, bus = system(frame, T_base_cam=frame.T_base_cam, on_demand=True)
    replies = []
    with spinning(node):
        camera.publish(frame, 1)
        heard(out, "waiting for a request", level=0)
        assert not out.mask
        node.request(lambda *reply: replies.append(reply))
        wait_for(lambda: replies, "the reply")
        assert replies == [(False, "no frame came within 0.1 s: waiting for frames")]
        monkeypatch.setattr("labkit.node.segmentation.STALE_AFTER", 100.0)
        node.request(lambda *reply: replies.append(reply))
        camera.publish(frame, 2)
        wait_for(lambda: len(replies) == 2, "the second reply")
        node.request(lambda *reply: replies.append(reply))
        good = messages(frame, 3)
        send(bus, good | {"info": dataclasses.replace(good["info"], height=99)})
        wait_for(lambda: len(replies) == 3, "the third reply")
    assert replies[1][0] and replies[1][1].startswith("answered the frame of stamp 2; grasp: best of")
    assert not replies[2][0] and "info: expected the size of rgb" in replies[2][1]
    assert [mask.header.stamp for mask in out.mask] == [2] and node.counts.dropped == 0


def test_a_request_is_answered_once_though_frames_come_meanwhile(frame):
    node, camera, out, _ = system(frame, on_demand=True)
    truth = node.pipeline

    class Busy:
        def run(self, frame):
            camera.publish(frame, 2)
            return truth.run(frame)

    node.pipeline = Busy()
    replies = []
    node.request(lambda *reply: replies.append(reply))
    camera.publish(frame, 1)
    assert node.spin_once() and not node.spin_once() and len(replies) == 1
    assert [mask.header.stamp for mask in out.mask] == [1]


def test_while_it_is_inactive_frames_are_let_go(frame):
    node, camera, out, _ = system(frame)
    node.active = False
    camera.publish(frame, 1)
    assert not node.spin_once()
    node.active = True
    camera.publish(frame, 2)
    assert node.spin_once() and [mask.header.stamp for mask in out.mask] == [2] and node.counts.dropped == 0


def test_compressed_images_are_taken_from_topics_that_are_named_so(frame):
    topics = dataclasses.replace(TOPICS, rgb="/color/compressed", depth="/depth/compressedDepth")
    node, _, out, bus = system(frame, T_base_cam=frame.T_base_cam, topics=topics)
    units = np.round(1000.0 * np.nan_to_num(frame.depth)).astype(np.uint16)
    colour = cv2.imencode(".png", frame.rgb[..., ::-1])[1].tobytes()
    depth = bytes(12) + cv2.imencode(".png", units)[1].tobytes()
    header = messages(frame)["rgb"].header
    bus.publish(topics.rgb, CompressedImage(header, "rgb8; png compressed bgr8", colour))
    bus.publish(topics.depth, CompressedImage(header, "16UC1; compressedDepth png", depth))
    bus.publish(topics.info, messages(frame)["info"])
    assert node.spin_once()
    expected = node.pipeline.run(dataclasses.replace(frame, depth=units * np.float32(0.001)))
    assert np.allclose(convert.decode_cloud(out.cloud[0]), np.concatenate(expected.clouds), atol=1e-6)
    pixels = frame.rgb.reshape(-1, 3)[np.concatenate(expected.pixels)]
    assert np.array_equal(convert.decode_cloud(out.cloud[0], ["rgb"])[:, 0], convert.pack_rgb(pixels))
    bus.publish(topics.rgb, CompressedImage(header, "rgb8; jpeg compressed bgr8", colour[:100]))
    bus.publish(topics.depth, CompressedImage(header, "16UC1; compressedDepth png", depth))
    bus.publish(topics.info, messages(frame)["info"])
    assert not node.spin_once() and "data: expected a whole picture" in out.diagnostics[-1].message


def test_when_the_clock_is_set_back_the_time_before_is_forgotten(frame):
    """A transport that says so: what waited pairs with nothing, and where the camera was then is not known any more."""
    told = []
    bus = Bus()
    bus.on_restart = told.append
    node = SegmentationNode(Pipeline(Truth(frame.labels)), bus, patience=0.0)
    (restart,) = told
    good = messages(frame, 100 * MS)
    Camera(bus).publish(frame, 100 * MS)
    assert node.spin_once()
    bus.publish(TOPICS.depth, good["depth"])
    restart()
    bus.publish(TOPICS.rgb, good["rgb"])
    bus.publish(TOPICS.info, good["info"])
    assert not node.spin_once() and node.counts.failed == 0, "the old depth is gone"
    bus.publish(TOPICS.depth, good["depth"])
    assert not node.spin_once() and node.counts.failed == 1, "and so is the old pose"


def test_distortion_is_told_in_the_diagnostics_and_once_in_the_log(frame, caplog):
    node, _, heard, bus = system(frame, T_base_cam=frame.T_base_cam)
    for stamp in range(2):
        parts = messages(frame, stamp)
        send(bus, parts | {"info": dataclasses.replace(parts["info"], D=(0.1, 0.0))})
        assert node.spin_once()
        said = heard.diagnostics[-1]
        assert said.level == 1 and "distortion, 0.1, 0, is not undone" in said.message
    assert sum("rectify first" in record.getMessage() for record in caplog.records) == 1


def test_a_camera_publishes_any_iterable_at_its_rate_until_it_is_stopped(frame):
    bus = Bus()
    out = Listener(bus, "rgb")
    start = time.monotonic()
    assert Camera(bus).run((frame for _ in range(5)), rate=50.0) == 5
    assert len(out.rgb) == 5 and time.monotonic() - start > 0.08
    stop = threading.Event()
    bus.subscribe(TOPICS.rgb, Image, lambda message: stop.set())
    assert Camera(bus).run(iter(lambda: frame, None), stop=stop) == 1


def test_the_arm_lifts_what_the_node_found():
    """Section 5's diagram, in process: nothing but messages goes from the camera to the arm."""
    with World(SCENE) as world:
        bus = Bus()
        frame = world.render()
        arm = Arm(bus, world)
        node = SegmentationNode(Pipeline(Truth(frame.labels)), bus)
        Camera(bus).publish(frame)
        assert node.spin_once()
        before = world.pose("block")[2, 3]
        result = arm.act(timeout=0.0)
        assert result.success and result.name == "block"
        assert world.pose("block")[2, 3] - before > 0.1
        assert arm.act(timeout=0.0).reason == "no grasp"


def test_the_rehearsal_says_in_one_line_what_happened():
    with World(SCENE) as world:
        labels = world.render().labels
    line = camera_to_lift(SCENE, Pipeline(Truth(labels)))
    assert line.startswith("scene 5: frame answered") and line.endswith("lifted block") and "\n" not in line
    nothing = camera_to_lift(SCENE, Pipeline(Truth(np.full(labels.shape, SURFACE))))
    assert nothing.endswith("0 target points, grasp: none: no target points")


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda p, b: SegmentationNode(p, b, slop=-1.0), "slop"),
        (lambda p, b: SegmentationNode(p, b, depth_scale=0.0), "depth_scale"),
        (lambda p, b: SegmentationNode(p, b, np.ones((4, 4))), "T_base_cam"),
        (lambda p, b: Camera(b, depth="mono8"), "depth"),
        (lambda p, b: Camera(b).run([], rate=0.0), "rate"),
    ],
)
def test_wrong_arguments_are_named(make, name):
    with pytest.raises(ValueError, match=f"^{name}:"):
        make(Pipeline(np.asarray), Bus())


def test_a_clicked_point_chooses_the_thing_that_stands_there_until_one_on_the_table_comes():
    spec = dataclasses.replace(scene(box("left", 0.5, 0.08), box("right", 0.55, -0.09)), seed=6)
    with World(spec) as world:
        frame = world.render()
        middle = world.centre("right")
    bus = Bus()
    listener = Listener(bus, "cloud", "mask", "diagnostics")
    node = SegmentationNode(Pipeline(find_objects=lambda seen: frame.instances), bus)
    T_cam_base = np.linalg.inv(frame.T_base_cam)
    top = np.array([*middle[:2], middle[2] + 0.018, 1.0])  # just under the box's upper face
    u, v, w = frame.K @ (T_cam_base @ top)[:3]
    number = frame.instances[round(v / w), round(u / w)]
    for frame_id, point in (("base_link", top[:3]), ("camera_optical_frame", (T_cam_base @ top)[:3])):
        bus.publish(TOPICS.clicked, Point(Header(0, frame_id), tuple(map(float, point))))
        Camera(bus).publish(frame)
        assert node.spin_once()
        mask = np.frombuffer(listener.mask[-1].data, np.uint8).reshape(frame.depth.shape)
        assert np.array_equal(mask == 2, frame.instances == number)
    bus.publish(TOPICS.clicked, Point(Header(0, "base_link"), (0.4, 0.0, 0.0)))
    Camera(bus).publish(frame)
    assert node.spin_once() and "the pixel shows the table" in listener.diagnostics[-1].values["grasp"]
    Camera(bus).publish(frame)
    assert node.spin_once() and listener.cloud[-1].width > 0, "the click is let go"
    bus.publish(TOPICS.clicked, Point(Header(0, "nowhere"), (0.4, 0.0, 0.0)))
    Camera(bus).publish(frame)
    assert node.spin_once() and node.counts.skipped == 1


def test_an_old_frame_gets_a_mask_and_a_warning_and_no_grasp(frame):
    node, camera, listener, bus = system(frame, max_age=1.0)
    camera.publish(frame, bus.now() - 2_000_000_000)
    assert node.spin_once() and len(listener.mask) == 1 and not listener.grasp
    said = listener.diagnostics[-1]
    assert said.level == 1 and "s old, more than max_age = 1 s: no grasp" in said.message
    camera.publish(frame)
    assert node.spin_once() and len(listener.grasp) == 1


def test_a_camera_that_says_nothing_is_a_warning(frame, monkeypatch):
    node, _, _, _ = system(frame)
    assert node._health.state("frames") == ("waiting for frames", 0)
    begin = time.monotonic()
    monkeypatch.setattr(time, "monotonic", lambda: begin + 6.0)
    message, level = node._health.state("frames")
    assert level == 1 and message.startswith("no message on /camera/rgb/image_raw or") and "for 6 s" in message


def test_a_point_survives_the_wire():
    point = Point(Header(5, "map"), (1.0, 2.0, 3.0))
    for ros1 in (False, True):
        wire = RosCodec(ros1)
        assert wire.decode("geometry_msgs/msg/PointStamped", wire.encode(point)) == point
