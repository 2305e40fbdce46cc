"""The node on ROS 1: a real master and real TCP on loopback, the node in a process of its own.

One process may be one node of ROS, so this file's process plays camera, listener and arm as the node "tester".
"""

import contextlib
import io
import os
import signal
import socket
import subprocess
import sys
import xmlrpc.client

import numpy as np
import pytest
from processes import PATIENCE, process, wait_for

import data_gen
from labkit.frame import RGBDFrame
from labkit.labels import CLASSES
from labkit.network import load_model, weights_path
from labkit.node import convert, ros1
from labkit.node.actors import Arm, Camera
from labkit.node.messages import (
    CameraInfo,
    Diagnostics,
    Header,
    Image,
    JointState,
    PointCloud2,
    Pose,
    Topics,
    Transform,
    Transforms,
)
from labkit.node.wire import TYPES, Wire
from labkit.pipeline import Pipeline
from labkit.sim.world import World

pytestmark = pytest.mark.debian("python3-rospy", "python3-rosmaster")
TOPICS = Topics()
MS = 1_000_000
MASTER = """
import sys, time
sys.path.append("/usr/lib/python3/dist-packages")
import rosmaster.master
master = rosmaster.master.Master(port=int(sys.argv[1]))
master.start()
while master.ok():
    time.sleep(0.05)
"""
CAMERA = """
import sys, time
import numpy as np
from labkit.frame import RGBDFrame
from labkit.node.actors import Camera
from labkit.node.ros1 import Ros1Transport
name, first, last = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
frame = RGBDFrame(np.zeros((24, 32, 3), np.uint8), np.ones((24, 32), np.float32), np.diag([30.0, 30.0, 1.0]), np.eye(4))
with Ros1Transport(name) as transport:
    camera = Camera(transport)
    topics = camera.topics
    while not all(map(transport.wanted, (topics.rgb, topics.depth, topics.info, topics.tf))):
        time.sleep(0.01)
    for number in range(first, last):
        camera.publish(frame, number * 1_000_000)
        print(number, flush=True)
        time.sleep(0.02)
    sys.stdin.read()
"""


@contextlib.contextmanager
def master(port: int):
    with process("-c", MASTER, port) as started:
        wait_for(lambda: listens(port), "the master")
        yield started


def listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


@pytest.fixture(scope="module")
def port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Watcher:
    """Camera and listener of this process."""

    def __init__(self, transport):
        self.transport, self.camera = transport, Camera(transport)
        kinds = {"mask": Image, "cloud": PointCloud2, "grasp": Pose, "diagnostics": Diagnostics}
        self.heard = {name: [] for name in kinds}
        for name, kind in kinds.items():
            transport.subscribe(getattr(TOPICS, name), kind, self.heard[name].append)

    def connected(self) -> bool:
        """Whether the node listens to all that the camera says, and this process to all that the node says."""
        spoken = map(self.transport.wanted, (TOPICS.rgb, TOPICS.depth, TOPICS.info, TOPICS.tf))
        listened = [self.transport._subscribers[getattr(TOPICS, name)].get_num_connections() > 0 for name in self.heard]
        return all(spoken) and all(listened)

    def answer(self, name: str, stamp: int):
        """The message of a stamp, once it is there."""
        return wait_for(lambda: next((m for m in self.heard[name] if m.header.stamp == stamp), None), f"{name} {stamp}")

    def counted(self) -> dict[str, int]:
        """The node's own counts, as it told them last."""
        values = self.heard["diagnostics"][-1].values
        return {name: int(values[name]) for name in ("answered", "dropped", "skipped", "failed")}


@pytest.fixture(scope="module")
def tester(port, tmp_path_factory):
    folder = str(tmp_path_factory.mktemp("ros"))
    ours = {
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
        "ROS_IP": "127.0.0.1",
        "ROS_HOME": folder,
        "ROS_LOG_DIR": folder,
    }
    before = {name: os.environ.get(name) for name in ours}
    os.environ.update(ours)
    try:
        with master(port) as started, ros1.Ros1Transport("tester") as transport:
            tester = Watcher(transport)
            tester.master = started
            yield tester
    finally:
        if ros1.DIST_PACKAGES in sys.path:
            sys.path.remove(ros1.DIST_PACKAGES)
        for name, value in before.items():
            os.environ.pop(name, None) if value is None else os.environ.__setitem__(name, value)


@contextlib.contextmanager
def node(tester, *options, command=("-m", "labkit.apps.cli", "node", "--ros", "--model", "smallsegnet")):
    """The node in a process, connected; SIGINT ends it with status 0."""
    for messages in tester.heard.values():
        messages.clear()
    with process(*command, *options, stderr=subprocess.PIPE) as started:
        wait_for(tester.connected, "the node")
        yield started
        started.send_signal(signal.SIGINT)
        started.said = started.communicate(timeout=PATIENCE)[1]
        assert started.returncode == 0, started.said


@pytest.fixture(scope="module")
def frame():
    return data_gen.render(data_gen.sample_scene(620000, "test"), (160, 120))


def small(frame) -> RGBDFrame:
    return RGBDFrame(frame.rgb[:24, :32], frame.depth[:24, :32], frame.K, frame.T_base_cam)


def compare_with_the_pipeline(tester, frame):
    """Over loopback the node says what the pipeline finds, and carries stamp and frames through."""
    pipeline = Pipeline(load_model(weights_path("smallsegnet")), table_z=0.01)
    expected = pipeline.run(frame)
    stamp = 1_700_000_000_123_456_789
    tester.camera.publish(frame, stamp)
    mask, cloud = tester.answer("mask", stamp), tester.answer("cloud", stamp)
    assert np.mean(convert.decode_image(mask) != expected.labels) < 1e-3
    assert mask.encoding == "mono8" and mask.header.frame_id == "camera_optical_frame"
    assert cloud.header.frame_id == "base_link" and len(expected.clouds) > 0
    found, whole = convert.decode_cloud(cloud), np.concatenate(expected.clouds)
    assert abs(len(found) - len(whole)) < 0.05 * len(whole)
    assert np.allclose(found.mean(axis=0), whole.mean(axis=0), atol=2e-3)


def test_bad_messages_a_killed_camera_and_a_new_master_cost_no_good_frame(tester, frame, port):
    """200 good frames among 200 malformed messages; then the camera dies, the master too, and others take over."""
    tiny, camera = small(frame), tester.camera
    with node(tester, "--table-z", "0.01") as running:
        compare_with_the_pipeline(tester, frame)
        rng = np.random.default_rng(0)
        for number in range(200):
            header = Header(number * 33 * MS, camera.frame_id)
            stream = str(rng.choice(["rgb", "depth"]))
            encoding, step = ("rgb8", 96) if stream == "rgb" else ("32FC1", 128)
            cut = bytes(int(rng.integers(0, 23 * step)))
            tester.transport.publish(getattr(TOPICS, stream), Image(header, 24, 32, encoding, 0, step, cut))
            camera.publish(tiny, number * 33 * MS)
            tester.answer("mask", number * 33 * MS)
        wait_for(lambda: tester.counted()["answered"] == 201, "the count")
        assert tester.counted() == {"answered": 201, "dropped": 0, "skipped": 200, "failed": 0}

        with process("-c", CAMERA, "first", 10_000, 99_999, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as first:
            wait_for(lambda: any(mask.header.stamp >= 10_005 * MS for mask in tester.heard["mask"]), "the first camera")
            first.kill()
        tester.master.kill()
        tester.master.wait()
        wait_for(lambda: not listens(port), "the master's end")
        camera.publish(tiny, 20_000 * MS)
        tester.answer("mask", 20_000 * MS)  # nodes that know each other need no master

        with (
            master(port),
            process("-c", CAMERA, "second", 30_000, 30_050, stdin=subprocess.PIPE, stdout=subprocess.PIPE),
        ):
            tester.answer("mask", 30_049 * MS)
            camera.publish(tiny, 40_000 * MS)
            tester.answer("mask", 40_000 * MS)
            wait_for(lambda: tester.heard["diagnostics"][-1].header.stamp == 40_000 * MS, "the last count")
            answered = [mask.header.stamp // MS for mask in tester.heard["mask"]]
            of_second = sum(30_000 <= stamp < 30_050 for stamp in answered)
            counted = tester.counted()
            assert counted["failed"] == 0 and of_second + counted["dropped"] >= 50
            assert counted["answered"] == len(answered) == len(set(answered))
    assert running.said.count("message skipped: data: expected") == 200 and "registering again" in running.said


MESSAGES = [
    convert.encode_image(np.arange(24, dtype=np.uint8).reshape(2, 4, 3), "rgb8", Header(10**18 + 1, "camera")),
    CameraInfo(Header(5, "camera"), 2, 4, (9.0, 0.0, 2.0, 0.0, 8.0, 1.0, 0.0, 0.0, 1.0), (0.1,) * 5),
    convert.encode_cloud(np.eye(3), Header(5, "base_link")),
    Pose(Header(5, "base_link"), (1.0, 2.0, 3.0), (0.0, 0.6, 0.0, 0.8)),
    Transforms((Transform(Header(5, "base_link"), "camera", (1.0, 2.0, 3.0), (0.0, 0.6, 0.0, 0.8)),)),
    JointState(Header(5, "base_link"), ("left", "right"), (0.02, 0.02)),
    Diagnostics(Header(5), "node", 1, "words", {"answered": "3"}),
]


@pytest.mark.debian(*(f"python3-{package}-msgs" for package in ("sensor", "geometry", "tf2", "diagnostic")))
@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_bytes_and_checksum_are_those_of_the_classes_of_ros(message):
    """The class that Debian's package has for the type reads the kit's bytes and writes the same ones."""
    package, _, kind = TYPES[type(message)].split("/")
    cls, wire = getattr(ros1.ros(f"{package}.msg"), kind), Wire(ros1=True)
    data, again = bytes(wire.encode(message)), io.BytesIO()
    cls().deserialize(data).serialize(again)
    assert again.getvalue() == data
    assert wire.store.generate_msgdef(TYPES[type(message)], ros_version=1)[1] == cls._md5sum


def test_without_a_master_it_waits_and_sigint_ends_it_with_status_0(tester):
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        nobody = f"http://127.0.0.1:{probe.getsockname()[1]}"
    environment = os.environ | {"ROS_MASTER_URI": nobody, "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "labkit.apps.cli", "node", "--ros", "--model", "smallsegnet"]
    with subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True) as waiting:
        line = waiting.stderr.readline()
        while line and "waiting for the ROS master" not in line:
            line = waiting.stderr.readline()
        assert nobody in line
        waiting.send_signal(signal.SIGINT)
        waiting.stderr.read()
    assert waiting.returncode == 0


@pytest.fixture
def living_master(tester, port):
    """A master for the tests after the one that ended the first."""
    if listens(port):
        yield
    else:
        with master(port):
            yield


def test_from_camera_topic_to_lift_over_ros(tester, living_master):
    """Section 5's diagram over a real master: camera and arm here, the text's run_ros_node in another process."""
    spec = data_gen.sample_scene(0, "test")
    code = (
        "from labkit.network import weights_path; from labkit.node.ros import run_ros_node\n"
        f"run_ros_node(weights_path('unet'), 4, 2, table_z={spec.table.z})"
    )
    with World(spec) as world:
        frame = world.render((320, 240))
        arm = Arm(tester.transport, world)
        with node(tester, command=("-c", code)) as running:
            tester.camera.publish(frame, 5 * MS)
            tester.answer("grasp", 5 * MS)
            result = arm.act(timeout=PATIENCE)
            shut_down("/segmentation_node")  # what `rosnode kill` does; the status is 0 as after SIGINT
            assert running.wait(PATIENCE) == 0
    assert result.success and result.class_id == CLASSES.index("target"), result


def shut_down(name: str) -> None:
    with xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"]) as master:
        _, _, uri = master.lookupNode("/tester", name)
    with contextlib.suppress(OSError), xmlrpc.client.ServerProxy(uri) as slave:  # it may be gone before it answers
        slave.shutdown("/tester", "test")
