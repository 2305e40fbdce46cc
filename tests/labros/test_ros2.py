"""The node on ROS 2: real rclpy, real processes on loopback. `make test-ros2` runs this with the wheels from PyPI."""

import dataclasses
import importlib.util
import itertools
import os
import re
import shlex
import signal
import subprocess
import threading
import time
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest
from peers import MESSAGES, MS, PATIENCE, ROOT, Peer, process, small, variables, wait_for
from ruamel.yaml import YAML

import data_gen
from labkit.labels import CLASSES, SURFACE, one_hot
from labkit.learning.network import load_model, weights_path
from labkit.node.actors import Arm
from labkit.node.convert import decode_image, encode_pose
from labkit.node.messages import ROS_TOPICS, CameraInfo, CompressedImage, Header, Image, Transform, Transforms
from labkit.node.segmentation import SegmentationNode
from labkit.pipeline import Pipeline, segment_rgb_image
from labkit.sim.world import World
from labros import ros2, ros2_types
from labros.wire import TYPES, RosCodec

if importlib.util.find_spec("rclpy") is None:
    pytest.skip("needs ROS 2: make test-ros2, or a sourced ROS 2", allow_module_level=True)

NODE = ("-m", "labcli.cli", "node", "ros", "--model", "smallsegnet", "--no-crf")


def published(transport, topic: str) -> bool:
    return transport.node.count_publishers(topic) > 0


@pytest.fixture(autouse=True, scope="module")
def loopback(tmp_path_factory):
    """A domain of our own on this machine, so that nobody else's nodes hear us."""
    folder, domain = str(tmp_path_factory.mktemp("ros")), str(1 + os.getpid() % 100)
    with variables(
        ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST", ROS_DOMAIN_ID=domain, ROS_HOME=folder, ROS_LOG_DIR=folder
    ):
        yield


def join(name: str, *arguments: str, topics=ROS_TOPICS, **quality) -> Peer:
    """A camera and listener; arguments: ROS's."""
    transport = ros2.Ros2Transport(name, ["--ros-args", *arguments] if arguments else [])
    transport.quality(**{"inputs": "reliable"} | quality)
    return Peer(transport, published, topics)


@pytest.fixture
def peer():
    peer = join("peer")
    with peer.transport:
        yield peer


@pytest.fixture(scope="module")
def frame():
    return data_gen.render(data_gen.sample_scene(620000, "test"), (160, 120))


def sees_surface(rgb):
    return one_hot(np.full(rgb.shape[:2], SURFACE)).astype(np.float32)


class Inside:
    """A node in a thread of this process, which answers at once; options: those of SegmentationNode."""

    def __init__(self, *arguments: str, name="inside", quality=None, topics=ROS_TOPICS, **options):
        self.transport = ros2.Ros2Transport(name, ["--ros-args", *arguments] if arguments else [])
        self.transport.quality(**{"inputs": "reliable"} | (quality or {}))
        self.node = SegmentationNode(Pipeline(sees_surface), self.transport, topics=topics, **options)
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self.node.spin, args=(self.stop,))

    def __enter__(self) -> "Inside":
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.stop.set()
        self.thread.join()
        self.transport.close()


def spoil(rng, peer, good: dict[str, bytes], stamp: int) -> None:
    """Publish something malformed: bytes that hold no message, or a message that does not hold together."""
    header = Header(stamp, peer.camera.frame_id)
    images = [
        Image(header, 24, 32, "rgb8", 0, 96, bytes(int(rng.integers(0, 23 * 96)))),
        Image(header, 24, 32, "yuv422", 0, 96, bytes(24 * 96)),
        Image(header, 0, 32, "rgb8", 0, 96, b""),
    ]
    way = int(rng.integers(6))
    if way < 3:
        peer.transport.publish(peer.topics.rgb, images[way])
    elif way == 3:
        peer.transport.publish(peer.topics.info, CameraInfo(header, 24, 32, (0.0,) * 9))
    else:
        topic = [peer.topics.rgb, peer.topics.depth][way - 4]
        peer.transport.publish_bytes(topic, good[topic][: int(rng.integers(4, 60))])


def test_malformed_messages_a_late_joiner_and_a_killed_node_cost_no_good_frame(peer, frame):
    """1,000 good frames among 100 malformed messages, each answered once; a second listener; a second node."""
    tiny, rng, wire = small(frame), np.random.default_rng(0), RosCodec(ros1=False)
    image = MESSAGES[0]
    good = {topic: bytes(wire.encode(image)) for topic in (peer.topics.rgb, peer.topics.depth)}
    with peer.node(*NODE, "--qos-inputs", "reliable", "--table-z", "0.01") as running:
        peer.compare_with_the_pipeline(frame, table_z=0.01)
        spoiled = set(rng.choice(1000, 100, replace=False).tolist())
        for number in range(1000):
            if number in spoiled:
                spoil(rng, peer, good, number * 33 * MS)
            peer.ask(tiny, number * 33 * MS)
        wait_for(lambda: peer.counted()["answered"] == 1001, "the count")
        assert peer.counted() == {"answered": 1001, "dropped": 0, "lost": 0, "skipped": 100, "failed": 0}
        assert len(peer.heard["mask"]) == 1001

        late = join("late")
        with late.transport:
            wait_for(
                lambda: published(late.transport, late.topics.mask) and late.heard["diagnostics"], "the late listener"
            )
            peer.ask(tiny, 50_000 * MS)
            late.answer("mask", 50_000 * MS)
        running.kill()
        running.wait()
        assert running.stderr.read().count("message skipped") == 100
        wait_for(lambda: not peer.connected(), "the node's end to be noticed")
    with peer.node(*NODE, "--qos-inputs", "reliable"):
        peer.ask(tiny, 60_000 * MS)
        wait_for(lambda: peer.counted()["answered"] == 1, "a new count")


def test_a_node_that_comes_late_knows_the_static_transforms(peer, frame):
    """The camera's stand was told once, before there was a node; the images come without any transform."""
    pose = encode_pose(frame.T_base_cam, Header())
    peer.transport.advertise(ROS_TOPICS.tf_static, Transforms)
    told = Transform(Header(0, "base_link"), peer.camera.frame_id, pose.position, pose.orientation)
    peer.transport.publish(ROS_TOPICS.tf_static, Transforms((told,)))
    still = join("still", topics=dataclasses.replace(ROS_TOPICS, tf="/unused"))
    with still.transport, Inside():
        wait_for(lambda: peer.connected() and still.transport.wanted(ROS_TOPICS.rgb), "the node")
        still.camera.publish(small(frame), 7 * MS)
        assert still.answer("mask", 7 * MS).header.frame_id == "camera_optical_frame"


def test_two_namespaces_are_two_systems(frame):
    """Two nodes and two cameras, each pair in its namespace; transforms are shared, images and masks are not."""
    pairs = {side: join("camera", "-r", f"__ns:=/{side}") for side in ("left", "right")}
    try:
        with (
            pairs["left"].node(*NODE, "--ros-args", "-r", "__ns:=/left", "-p", "qos_inputs:=reliable"),
            pairs["right"].node(*NODE, "--ros-args", "-r", "__ns:=/right", "-p", "qos_inputs:=reliable"),
        ):
            for number, (_, pair) in zip(range(20), itertools.cycle(pairs.items()), strict=False):
                pair.ask(small(frame), (number + 1) * 100 * MS)
            names = pairs["left"].transport.node.get_node_names_and_namespaces()
            assert {("segmentation_node", "/left"), ("segmentation_node", "/right")} <= set(names)
            for pair in pairs.values():
                stamps = [mask.header.stamp for mask in pair.heard["mask"]]
                assert len(stamps) == 10 == len(set(stamps))
    finally:
        for pair in pairs.values():
            pair.transport.close()


def test_remapped_topics_and_parameters(frame):
    """-r and -p behind --ros-args win over the defaults and the command's own options; whole numbers will do."""
    topics = dataclasses.replace(ROS_TOPICS, rgb="/realsense/color", mask="/labels")
    peer = join("peer", topics=topics)
    words = ["-r", "camera/rgb/image_raw:=/realsense/color", "-r", "segmentation/mask:=/labels"]
    words += ["-p", "table_z:=0", "-p", "qos_inputs:=reliable", "-p", "camera_pose:=0.5 0 0.8 1 0 0 0"]
    with peer.transport, process(*NODE, "--table-z", "5.0", "--ros-args", *words, stderr=subprocess.PIPE) as running:
        streams = [topics.rgb, topics.depth, topics.info]
        wait_for(lambda: all(map(peer.transport.wanted, streams)) and published(peer.transport, "/labels"), "the node")
        peer.ask(small(frame), 5 * MS)
        given = parameters(peer.transport.node, "/segmentation_node", ["table_z", "camera_pose", "model"])
        assert given == [0, "0.5 0 0.8 1 0 0 0", "smallsegnet"]
        running.send_signal(signal.SIGINT)
        assert running.wait(PATIENCE) == 0


def parameters(node, of: str, names: list[str]) -> list:
    from rclpy.parameter import parameter_value_to_python
    from rclpy.parameter_client import AsyncParameterClient

    asked = AsyncParameterClient(node, of).get_parameters(names)
    wait_for(asked.done, "the parameters")
    return [parameter_value_to_python(value) for value in asked.result().values]


@pytest.mark.parametrize(
    "words, said",
    [
        (["-p", "table_z:=high"], "table_z: expected a number, got 'high'"),
        (["-p", "qos_inputs:=nice"], "qos_inputs: expected one of"),
    ],
)
def test_a_wrong_parameter_is_one_line_and_status_2(words, said):
    with process(*NODE, "--ros-args", *words, stderr=subprocess.PIPE) as running:
        line = running.communicate(timeout=PATIENCE)[1].splitlines()[-1]
    assert running.returncode == 2 and line.startswith(f"labkit: {said}")


def call(peer, kind: type, name: str, **request):
    """The answer of a service."""
    client = peer.transport.node.create_client(kind, name)
    wait_for(client.service_is_ready, name)
    answer = client.call_async(kind.Request(**request))
    wait_for(answer.done, f"the answer of {name}")
    return answer.result()


def test_a_service_answers_one_frame_on_demand(peer, frame):
    """A camera that goes on; of its frames those are answered that were asked for, each taken after the call."""
    from std_srvs.srv import Trigger

    with peer.node(*NODE, "--on-demand", "--ros-args", "-p", "qos_inputs:=reliable"):
        stop = threading.Event()
        camera = threading.Thread(target=peer.camera.run, args=(itertools.repeat(small(frame)), 20.0, stop))
        camera.start()
        stamps = []
        for _ in range(3):
            stamps.append(time.time_ns() - 50 * MS)
            answer = call(peer, Trigger, "segmentation/answer")
            assert answer.success and answer.message.startswith("answered the frame of stamp "), answer
            time.sleep(0.2)
        stop.set()
        camera.join()
        wait_for(lambda: peer.heard["diagnostics"][-1].message == "waiting for a request", "the state")
        assert peer.counted()["answered"] == 3 == len(peer.heard["mask"])
        assert all(mask.header.stamp > asked for mask, asked in zip(peer.heard["mask"], stamps, strict=True))
        silent = call(peer, Trigger, "segmentation/answer")
        assert not silent.success and silent.message.startswith("no frame came within 5 s: no message on camera/rgb")


def test_a_lifecycle_node_answers_while_it_is_active(peer, frame):
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState, GetState

    def change(name: str) -> bool:
        step = Transition(id=getattr(Transition, f"TRANSITION_{name}"))
        return call(peer, ChangeState, "segmentation_node/change_state", transition=step).success

    def state() -> str:
        return call(peer, GetState, "segmentation_node/get_state").current_state.label

    def says(message: str) -> None:
        peer.heard["diagnostics"].clear()
        wait_for(lambda: peer.heard["diagnostics"] and peer.heard["diagnostics"][-1].message == message, message)

    words = ("--lifecycle", "--ros-args", "-p", "qos_inputs:=reliable")
    with process(*NODE, *words, stderr=subprocess.PIPE) as running:
        assert state() == "unconfigured" and not published(peer.transport, ROS_TOPICS.mask)
        for stamp in (10, 20):
            assert change("CONFIGURE") and state() == "inactive"
            wait_for(peer.connected, "the node")
            says("inactive")
            peer.camera.publish(small(frame), stamp * MS)
            assert change("ACTIVATE") and state() == "active"
            peer.ask(small(frame), (stamp + 1) * MS)
            assert change("DEACTIVATE") and change("CLEANUP") and state() == "unconfigured"
            wait_for(lambda: not published(peer.transport, ROS_TOPICS.mask), "the end of its topics")
        assert [mask.header.stamp // MS for mask in peer.heard["mask"]] == [11, 21]
        running.send_signal(signal.SIGINT)
        assert running.wait(PATIENCE) == 0, running.stderr.read()


def test_a_lifecycle_node_that_cannot_be_built_stays_unconfigured(peer):
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    step = Transition(id=Transition.TRANSITION_CONFIGURE)
    words = ("--lifecycle", "--ros-args", "-p", "table_z:=high")
    with process(*NODE, *words, stderr=subprocess.PIPE) as running:
        for _ in range(2):
            assert not call(peer, ChangeState, "segmentation_node/change_state", transition=step).success
        running.send_signal(signal.SIGINT)
        said = running.communicate(timeout=PATIENCE)[1]
    assert running.returncode == 0 and said.count("not configured: table_z: expected a number, got 'high'") == 2


def test_compressed_images_from_remapped_topics_and_a_silent_calibration(peer, frame):
    """As image_transport names and writes them; what is missing is told until it comes."""
    units = np.round(1000.0 * np.nan_to_num(frame.depth)).astype(np.uint16)
    header = Header(7 * MS, peer.camera.frame_id)
    sent = {
        "/c/compressed": CompressedImage(
            header, "rgb8; jpeg compressed bgr8", cv2.imencode(".jpg", frame.rgb[..., ::-1])[1].tobytes()
        ),
        "/d/compressedDepth": CompressedImage(
            header, "16UC1; compressedDepth png", bytes(12) + cv2.imencode(".png", units)[1].tobytes()
        ),
        ROS_TOPICS.info: CameraInfo(header, *frame.depth.shape, tuple(frame.K.ravel().tolist())),
    }
    words = ["-r", "camera/rgb/image_raw:=/c/compressed", "-r", "camera/depth/image_raw:=/d/compressedDepth"]
    words += ["-p", "qos_inputs:=reliable", "-p", "camera_pose:=0.5 0 0.8 1 0 0 0"]
    for topic in ("/c/compressed", "/d/compressedDepth"):
        peer.transport.advertise(topic, CompressedImage)
    with process(*NODE, "--ros-args", *words, stderr=subprocess.PIPE) as running:
        wait_for(lambda: all(map(peer.transport.wanted, sent)), "the node")
        wait_for(lambda: peer.heard_from(peer.transport, ROS_TOPICS.mask), "its topics")
        for _ in range(3):
            for topic in ("/c/compressed", "/d/compressedDepth"):
                peer.transport.publish(topic, sent[topic])
        missing = "messages on camera/rgb/image_raw and camera/depth/image_raw, but none on camera/camera_info"
        wait_for(lambda: [m for m in peer.heard["diagnostics"] if missing in m.message and m.level == 1], missing)
        for topic, message in sent.items():
            peer.transport.publish(topic, message)
        expected = segment_rgb_image(load_model(weights_path("smallsegnet")), frame.rgb)
        assert np.mean(decode_image(peer.answer("mask", 7 * MS)) != expected) < 0.05
        running.send_signal(signal.SIGINT)
        assert running.wait(PATIENCE) == 0


def test_a_peer_that_cannot_be_talked_to_is_reported_in_words(peer, caplog):
    """The node asks for reliable images, and a camera offers only the newest."""
    hasty = join("hasty", outputs="best_effort", inputs="best_effort")
    with hasty.transport, Inside() as inside:
        topic = ROS_TOPICS.rgb
        wait_for(lambda: topic in inside.transport.troubles(), "the report")
        wait_for(lambda: topic in peer.told(), "the report in diagnostics")
        told = peer.told()[topic]
        assert told == (
            "no messages pass, for a publisher offers less than this node asks for: reliability, here reliable "
            "(see qos_inputs)"
        )


def test_every_frame_is_answered_or_superseded(peer, frame):
    """A camera faster than the node, with reliable inputs: of 200 frames none is lost, and the last one is answered."""

    def slow(rgb):
        time.sleep(0.05)
        return sees_surface(rgb)

    with Inside(quality={"inputs": "reliable", "depth": 250}, queue=250) as inside:
        fast = join("fast", depth=250)
        with fast.transport:
            wait_for(lambda: peer.connected() and fast.connected(), "the node")
            inside.node.pipeline = Pipeline(slow)
            fast.camera.run((small(frame) for _ in range(200)), 60.0)
            counts = inside.node.counts
            wait_for(lambda: counts.answered + counts.dropped == 200, "the last frame")
            wait_for(lambda: len(fast.heard["mask"]) == counts.answered, "the masks")
            assert counts.answered > 1 < counts.dropped and counts.lost == counts.failed == counts.skipped == 0


@pytest.mark.parametrize("quality", ros2.RELIABILITIES)
def test_full_size_at_a_camera_s_rate(quality):
    """Three seconds of 640x480 at 30 Hz from another process: each frame that arrives whole is answered or superseded.

    Over reliable topics each one arrives. The shared memory that Fast DDS takes by default holds no such image.
    """
    frame, depth = data_gen.render(data_gen.sample_scene(620000, "test"), (640, 480)), 100
    camera = join("camera", depth=depth)
    with camera.transport, camera.node(*NODE, "--qos-inputs", quality, "--qos-depth", str(depth)):
        camera.ask(frame, 1)
        assert camera.camera.run(itertools.repeat(frame, 90), 30.0) == 90

        def ended() -> bool:
            return sum(camera.counted()[what] for what in ("answered", "dropped", "lost")) >= 91

        wait_for(ended, "the last frame")
        counts, told = camera.counted(), camera.told()
        assert counts["answered"] + counts["dropped"] + counts["lost"] == 91 and counts["failed"] == 0, told
        assert counts["lost"] == 0 or (quality == "best_effort" and "lost on the way" in str(told)), told


def test_what_the_network_loses_stands_in_diagnostics(peer, frame):
    """A reader that keeps one message and is busy loses the others, and the node says how many."""
    with Inside(quality={"inputs": "best_effort", "depth": 1}) as inside:
        wait_for(peer.connected, "the node")
        peer.ask(small(frame), 0)
        with inside.node._news:  # the thread of ROS waits here
            for stamp in range(1, 21):
                peer.camera.publish(small(frame), stamp * 33 * MS)
            time.sleep(0.3)
        told = wait_for(lambda: re.match(r"1[5-9] .*", peer.told().get(ROS_TOPICS.rgb, "")), "the report")
        assert told[0].split(maxsplit=1)[1] == "messages lost on the way"


def test_the_clock_of_a_simulator_is_followed_and_what_was_before_its_restart_is_forgotten(peer, frame):
    """With use_sim_time the node's own stamps are of /clock; the pose of the first run is not one of the second."""
    from rosgraph_msgs.msg import Clock

    publisher = peer.transport.node.create_publisher(Clock, "/clock", 10)

    def tell(seconds: int) -> None:
        clock = Clock()
        clock.clock.sec = seconds
        publisher.publish(clock)

    with Inside("-p", "use_sim_time:=true", patience=0.0) as inside:
        wait_for(peer.connected, "the node")
        wait_for(lambda: (tell(100), inside.transport.now() == 10**11)[1], "the clock")
        peer.ask(small(frame), 10**11)
        wait_for(lambda: any(m.header.stamp == 10**11 for m in peer.heard["diagnostics"]), "a stamp of the simulator")
        wait_for(lambda: (tell(99), inside.transport.now() == 99 * 10**9)[1], "the clock that was set back")
        blind = join("blind", topics=dataclasses.replace(ROS_TOPICS, tf="/unused"))
        with blind.transport:
            wait_for(lambda: blind.transport.wanted(ROS_TOPICS.rgb), "the node")
            blind.camera.publish(small(frame), 10**11)
            wait_for(lambda: inside.node.counts.failed == 1, "the refusal")
            words = "no transform between"
            wait_for(lambda: any(words in m.message for m in peer.heard["diagnostics"]), "its words")


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_bytes_are_those_of_the_classes_of_ros(message):
    """rclpy's own class of the type, where it is installed, reads the kit's bytes and writes the same ones."""
    from rclpy.serialization import deserialize_message, serialize_message

    package, _, kind = TYPES[type(message)].split("/")
    module = pytest.importorskip(f"{package}.msg", reason=f"{package} has no wheel: a sourced ROS 2 has it")
    wire, name = RosCodec(ros1=False), TYPES[type(message)]
    data = bytes(wire.encode(message))
    theirs = serialize_message(deserialize_message(data, getattr(module, kind)))[: len(data)]  # it reserves too much
    assert bytes(wire.encode(wire.decode(name, theirs))) == data, "equal but for the bytes that align numbers"


@pytest.mark.parametrize("made_publishes", [True, False])
def test_a_made_type_talks_to_the_real_one(made_publishes):
    """sensor_msgs/Image from the wheel on one side, made from its name on the other; names and checksums are equal."""
    from rclpy.serialization import serialize_message
    from sensor_msgs.msg import Image as Real

    name = TYPES[Image]
    made = ros2_types.made_class(name, RosCodec(ros1=False).store.hash_rihs01(name))
    data, got = bytes(RosCodec(ros1=False).encode(MESSAGES[0])), []
    with ros2.Ros2Transport("sender") as sender, ros2.Ros2Transport("receiver") as receiver:
        publisher = sender.node.create_publisher(made if made_publishes else Real, "image", 10)
        receiver.node.create_subscription(
            Real if made_publishes else made, "image", got.append, 10, raw=not made_publishes
        )
        wait_for(lambda: publisher.get_subscription_count() and published(receiver, "image"), "the two to meet")
        (sent,) = sender.node.get_publishers_info_by_topic("image")
        (asked,) = sender.node.get_subscriptions_info_by_topic("image")
        assert sent.topic_type == asked.topic_type == name
        assert str(sent.topic_type_hash) == str(asked.topic_type_hash)
        publisher.publish(data)
        wait_for(lambda: got, "the message")
    theirs = serialize_message(got[0]) if made_publishes else got[0]
    assert bytes(RosCodec(ros1=False).encode(RosCodec(ros1=False).decode(name, theirs))) == data


def test_from_camera_topic_to_lift_over_ros(peer):
    """Topic 08's diagram: camera, node (the text's run_ros_node) and this listener and arm, three processes."""
    spec = data_gen.sample_scene(0, "test")
    node = (
        "from labkit.learning.network import weights_path; from labros.ros import run_ros_node\n"
        f"run_ros_node(weights_path('unet'), 4, 2, table_z={spec.table.z})"
    )
    camera = (
        "import threading, itertools, data_gen\n"
        "from labkit.node.actors import Camera; from labkit.node.messages import ROS_TOPICS\n"
        "from labros.ros2 import Ros2Transport\n"
        "frame = data_gen.render(data_gen.sample_scene(0, 'test'), (320, 240))\n"
        "with Ros2Transport('camera') as transport:\n"
        "    Camera(transport, topics=ROS_TOPICS).run(itertools.repeat(frame), 2.0)\n"
    )
    with World(spec) as world:
        arm = Arm(peer.transport, world, ROS_TOPICS)
        with peer.node("-c", node), process("-c", camera):
            result = arm.act(timeout=PATIENCE)
    assert result.success and result.class_id == CLASSES.index("target"), result


def test_forty_lines_of_a_real_node(peer, frame):
    """The lesson's script, which has nothing of the kit's edges: its mask is the network's, with the image's header."""
    script = ROOT / "lessons/08_ros2_node.py"
    assert len(script.read_text().splitlines()) < 45
    expected = segment_rgb_image(load_model(weights_path("smallsegnet")), frame.rgb)
    masks = []
    peer.transport.subscribe("mask", Image, masks.append)
    words = ["-p", "model:=smallsegnet", "-r", "image:=/camera/rgb/image_raw"]
    with process(script, "--ros-args", *words, stderr=subprocess.PIPE) as running:
        wait_for(lambda: peer.transport.wanted(ROS_TOPICS.rgb) and published(peer.transport, "mask"), "the script")

        def answered() -> bool:  # best effort: an image may be lost; a part of one does not end the script
            peer.transport.publish(ROS_TOPICS.rgb, Image(Header(), 240, 320, "rgb8", 0, 960, b"only a part"))
            peer.camera.publish(frame, 7)
            time.sleep(0.1)
            return bool(masks)

        wait_for(answered, "a mask")
        running.send_signal(signal.SIGINT)
        assert running.wait(PATIENCE) == 0, running.stderr.read()
    assert np.mean(decode_image(masks[0]) != expected) < 1e-3
    assert masks[0].header == Header(7, peer.camera.frame_id)


def test_the_launch_file_starts_the_node(peer, frame):
    """Its command with its defaults, as `ros2 launch` would put it together; and with the simulated camera."""
    file = ElementTree.parse(ROOT / "labros/share/segmentation.launch.xml").getroot()
    given = {argument.get("name"): argument.get("default") for argument in file.iter("arg")}
    given |= {"model": "smallsegnet", "qos_inputs": "reliable", "namespace": "robot", "options": "--sim"}
    asked = file.find("executable").get("cmd")
    assert set(re.findall(r"\$\(var (\w+)\)", ElementTree.tostring(file).decode())) == given.keys()
    command = shlex.split(re.sub(r"\$\(var (\w+)\)", lambda found: given[found[1]], asked))
    assert command.pop(0) == "labkit"
    with join("robot", "-r", "__ns:=/robot").transport as transport:
        masks = []
        transport.subscribe(ROS_TOPICS.mask, Image, masks.append)
        with process("-m", "labcli.cli", *command, stderr=subprocess.PIPE) as running:
            wait_for(lambda: len(masks) > 1, "masks of the simulated camera's images")
            running.send_signal(signal.SIGINT)
            assert running.wait(PATIENCE) == 0, running.stderr.read()


def test_rviz_is_told_topics_that_there_are():
    """Its displays listen with a quality of service that the node, with its defaults, satisfies."""
    view = YAML(typ="safe").load(ROOT / "labros/share/segmentation.rviz")["Visualization Manager"]
    shown = [display["Topic"] for display in view["Displays"] if "Topic" in display]
    assert view["Global Options"]["Fixed Frame"] == "base_link"
    assert {topic["Value"] for topic in shown} <= {f"/{topic}" for topic in vars(ROS_TOPICS).values()}
    for topic in shown:
        wanted = "Best Effort" if topic["Value"].startswith("/camera") else "Reliable"
        assert (topic["Reliability Policy"], topic["Durability Policy"]) == (wanted, "Volatile")
