"""The node on ROS 1: a real master and real TCP on loopback, the node in a process of its own.

One process may be one node of ROS 1, so this file's process plays camera, listener and arm as the node "tester".
"""

import contextlib
import io
import os
import signal
import socket
import subprocess
import sys
import time
import xmlrpc.client

import numpy as np
import pytest
from peers import MESSAGES, MS, PATIENCE, Peer, process, small, variables, wait_for

import data_gen
from labkit.labels import CLASSES
from labkit.node.actors import Arm
from labkit.node.messages import ROS_TOPICS, Header, Image
from labkit.sim.world import World
from labros import ros1
from labros.wire import TYPES, RosCodec

pytestmark = pytest.mark.debian("python3-rospy", "python3-rosmaster")
NODE = ("-m", "labcli.cli", "node", "ros", "--ros1", "--model", "smallsegnet", "--no-crf")
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
from labros.ros1 import Ros1Transport
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


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture(scope="module")
def port():
    return free_port()


@pytest.fixture(scope="module")
def tester(port, tmp_path_factory):
    folder = str(tmp_path_factory.mktemp("ros"))
    uri = f"http://127.0.0.1:{port}"
    try:
        with (
            variables(ROS_MASTER_URI=uri, ROS_IP="127.0.0.1", ROS_HOME=folder, ROS_LOG_DIR=folder),
            master(port) as started,
            ros1.Ros1Transport("tester") as transport,
        ):
            tester = Peer(transport, lambda t, topic: t._subscribers[topic].get_num_connections() > 0)
            tester.master = started
            yield tester
        begin = time.process_time()
        time.sleep(1.0)
        assert time.process_time() - begin < 0.5, "something of rospy's runs on, and everything else here waits for it"
        assert socket.getdefaulttimeout() is None, "sockets of this process still have rospy's time limit"
    finally:
        if ros1.DIST_PACKAGES in sys.path:
            sys.path.remove(ros1.DIST_PACKAGES)


@pytest.fixture(scope="module")
def frame():
    return data_gen.render(data_gen.sample_scene(620000, "test"), (160, 120))


def test_bad_messages_a_killed_camera_and_a_new_master_cost_no_good_frame(tester, frame, port):
    """200 good frames among 200 malformed messages; then the camera dies, the master too, and others take over."""
    tiny, camera = small(frame), tester.camera
    with tester.node(*NODE, "--table-z", "0.01") as running:
        tester.compare_with_the_pipeline(frame, table_z=0.01)
        rng = np.random.default_rng(0)
        for number in range(200):
            header = Header(number * 33 * MS, camera.frame_id)
            stream = str(rng.choice(["rgb", "depth"]))
            encoding, step = ("rgb8", 96) if stream == "rgb" else ("32FC1", 128)
            cut = bytes(int(rng.integers(0, 23 * step)))
            tester.transport.publish(getattr(ROS_TOPICS, stream), Image(header, 24, 32, encoding, 0, step, cut))
            tester.ask(tiny, number * 33 * MS)
        wait_for(lambda: tester.counted()["answered"] == 201, "the count")
        assert tester.counted() == {"answered": 201, "dropped": 0, "lost": 0, "skipped": 200, "failed": 0}

        with process("-c", CAMERA, "first", 10_000, 99_999, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as first:
            wait_for(lambda: any(mask.header.stamp >= 10_005 * MS for mask in tester.heard["mask"]), "the first camera")
            first.kill()
        tester.master.kill()
        tester.master.wait()
        wait_for(lambda: not listens(port), "the master's end")
        tester.ask(tiny, 20_000 * MS)  # nodes that know each other need no master

        with (
            master(port),
            process("-c", CAMERA, "second", 30_000, 30_050, stdin=subprocess.PIPE, stdout=subprocess.PIPE),
        ):
            tester.answer("mask", 30_049 * MS)
            tester.ask(tiny, 40_000 * MS)
            wait_for(lambda: tester.heard["diagnostics"][-1].header.stamp == 40_000 * MS, "the last count")
            answered = [mask.header.stamp // MS for mask in tester.heard["mask"]]
            of_second = sum(30_000 <= stamp < 30_050 for stamp in answered)
            counted = tester.counted()
            assert counted["failed"] == 0 and of_second + counted["dropped"] >= 50
            assert counted["answered"] == len(answered) == len(set(answered))
    assert running.said.count("message skipped: data: expected") == 200 and "registering again" in running.said


@pytest.mark.debian(*(f"python3-{package}-msgs" for package in ("sensor", "geometry", "tf2", "diagnostic")))
@pytest.mark.parametrize(
    "message",
    [message for message in MESSAGES if RosCodec(ros1=True).knows(type(message))],
    ids=lambda message: type(message).__name__,
)
def test_bytes_and_checksum_are_those_of_the_classes_of_ros(message):
    """The class that Debian's package has for the type reads the kit's bytes and writes the same ones."""
    package, _, kind = TYPES[type(message)].split("/")
    cls, wire = getattr(ros1.import_ros(f"{package}.msg"), kind), RosCodec(ros1=True)
    data, again = bytes(wire.encode(message)), io.BytesIO()
    cls().deserialize(data).serialize(again)
    assert again.getvalue() == data
    assert wire.store.generate_msgdef(TYPES[type(message)], ros_version=1)[1] == cls._md5sum


def test_without_a_master_it_waits_and_sigint_ends_it_with_status_0(tester):
    nobody = f"http://127.0.0.1:{free_port()}"
    with variables(ROS_MASTER_URI=nobody), process(*NODE, stderr=subprocess.PIPE) as waiting:
        line = waiting.stderr.readline()
        while line and "waiting for the ROS master" not in line:
            line = waiting.stderr.readline()
        assert nobody in line
        waiting.send_signal(signal.SIGINT)
        waiting.stderr.read()
        assert waiting.wait(PATIENCE) == 0


@pytest.fixture
def new_master(tester, port):
    """Another master than the one that the tester found when it began."""
    tester.master.kill()
    tester.master.wait()
    wait_for(lambda: not listens(port), "the master's end")
    with master(port):
        yield


def test_a_new_master_learns_all_topics_from_a_node_that_told_it_one(tester, monkeypatch, request):
    """The node subscribes to something before it has noticed that the master is another one."""
    monkeypatch.setattr(ros1, "CHECK_SECONDS", 2.0)
    time.sleep(0.5)  # from here on it looks every two seconds
    request.getfixturevalue("new_master")
    tester.transport.subscribe("late", Image, print)
    edges = (*tester.transport._publishers.values(), *tester.transport._subscribers.values())
    wait_for(lambda: known_topics("/tester") == {edge.resolved_name for edge in edges}, "all topics")


def known_topics(node: str) -> set[str]:
    """What the master knows of a node."""
    with xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"]) as master:
        published, subscribed, _ = master.getSystemState("/test")[2]
    return {topic for topic, nodes in published + subscribed if node in nodes}


def test_from_camera_topic_to_lift_over_ros(tester, new_master):
    """Topic 08's diagram over a real master: camera and arm here, the text's run_ros_node in another process."""
    spec = data_gen.sample_scene(0, "test")
    code = (
        "from labkit.learning.network import weights_path; from labros.ros import run_ros_node\n"
        f"run_ros_node(weights_path('unet'), 4, 2, table_z={spec.table.z}, version=1)"
    )
    with World(spec) as world:
        frame = world.render((320, 240))
        arm = Arm(tester.transport, world, ROS_TOPICS)
        with tester.node("-c", code) as running:
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
