"""The node: what it costs over Pipeline.run, in process and over ROS on loopback, and its memory over 10,000 frames.

Overhead: from the arrival of a frame's last message to the last result published, against `Pipeline.run` on the same
frame, taken in turn. Added latency: from the camera's call to the mask's arrival in another process, less what the
pipeline took of it. Resident memory is flat if the last tenth of the frames finds it within 2 % of the second tenth's.
"""

import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from functools import partial

import numpy as np

from data_gen import render, sample_scene
from labkit.learning.network import load_model, weights_path
from labkit.node.actors import Camera
from labkit.node.bus import Bus
from labkit.node.messages import DEFAULT_TOPICS, Diagnostics, Image
from labkit.node.segmentation import SegmentationNode
from labkit.pipeline import Pipeline
from tests.bench.measure import in_turns, resident_mb, table

SIZE = (640, 480)
REPEATS, SECONDS, RATE, FRAMES = 40, 60, 30.0, 10_000
MASTER = (
    "import sys, time; sys.path.append('/usr/lib/python3/dist-packages'); import rosmaster.master as m\n"
    "master = m.Master(port=int(sys.argv[1])); master.start()\n"
    "while master.ok(): time.sleep(0.1)"
)


def main() -> str:
    """Three tables: overhead in process, ROS on loopback, memory."""
    frame = render(sample_scene(700_000, "test"), SIZE)
    return "\n\n".join([in_process(frame), over_ros(frame), memory()])


def in_process(frame) -> str:
    """Milliseconds of Pipeline.run and of the node around it, alternately."""
    rows = []
    for name, options in (
        ("UNet, mirrored", {"mirror": True, "crf": False}),
        ("UNet, onnxruntime, once", {"engine": "onnxruntime", "crf": False}),
    ):
        pipeline = Pipeline(load_model(weights_path("unet")), **options)
        bus = Bus()
        node, camera = SegmentationNode(pipeline, bus), Camera(bus)
        numbers = iter(range(REPEATS + 1))

        def publish(camera=camera, numbers=numbers):
            camera.publish(frame, next(numbers))

        turns = {"alone": partial(pipeline.run, frame), "published": publish, "node": node.spin_once}
        times = in_turns(turns, REPEATS)
        a, b = np.median(times["alone"]), np.median(times["node"])
        rows.append((name, f"{a:.1f}", f"{b:.1f}", f"{100.0 * (b / a - 1.0):+.1f} %"))
    return table("640x480, in process | Pipeline.run, ms | node, ms | overhead (to reach: 10 %)", rows)


def over_ros(frame) -> str:
    """Added latency, and a minute at 30 Hz, with a master, the node, and this process as camera and listener."""
    from labkit.node import ros1

    try:
        ros1.ros("rospy"), ros1.ros("rosmaster")
    except ModuleNotFoundError as error:
        return f"ROS on loopback was not measured: {error}"
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    folder = tempfile.mkdtemp()
    os.environ.update(
        ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1", ROS_HOME=folder, ROS_LOG_DIR=folder
    )
    fast = ["--engine", "onnxruntime", "--no-crf"]
    command = [sys.executable, "-m", "labkit.apps.cli", "node", "--ros1", "--model", "unet", *fast]
    master = subprocess.Popen([sys.executable, "-c", MASTER, str(port)])
    node = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    try:
        time.sleep(1.0)
        with ros1.Ros1Transport("bench") as transport:
            return talk(transport, frame)
    finally:
        node.send_signal(signal.SIGINT)
        node.wait(30)
        master.kill()


def talk(transport, frame) -> str:
    """One frame at a time for the latency; then as a camera does, for a minute."""
    topics, arrived, told = DEFAULT_TOPICS, {}, {}
    transport.subscribe(topics.mask, Image, lambda m: arrived.setdefault(m.header.stamp, time.perf_counter()))
    transport.subscribe(topics.diagnostics, Diagnostics, lambda m: told.setdefault(m.header.stamp, m.values))
    camera = Camera(transport)
    while not all(map(transport.wanted, (topics.rgb, topics.depth, topics.info, topics.tf))):
        time.sleep(0.05)
    time.sleep(1.0)
    added, perceived = [], []
    for number in range(1, REPEATS + 4):
        start = time.perf_counter()
        camera.publish(frame, number)
        while number not in arrived or number not in told:
            time.sleep(0.0005)
        if number > 3:
            perceived.append(float(told[number]["of these in the pipeline"]))
            added.append(1000.0 * (arrived[number] - start) - perceived[-1])
    before = {name: int(told[number][name]) for name in ("answered", "dropped")}
    sent = camera.run((frame for _ in range(int(SECONDS * RATE))), RATE)
    time.sleep(1.0)
    last = told[max(told)]
    answered, dropped = (int(last[name]) - before[name] for name in ("answered", "dropped"))
    rows = [
        ("in the pipeline, median ms", f"{np.median(perceived):.1f}"),
        ("added by node and network, median ms (to reach: 12)", f"{np.median(added):.1f}"),
        (f"{RATE:.0f} Hz for {SECONDS} s: frames sent, answered, superseded", f"{sent}, {answered}, {dropped}"),
    ]
    return table("ROS on loopback, 640x480, UNet once on onnxruntime | ", rows)


def memory() -> str:
    """Resident memory over many frames of several scenes, by tenths."""
    frames = [render(sample_scene(seed, "test"), (80, 60)) for seed in range(700_000, 700_010)]
    bus = Bus()
    node, camera = SegmentationNode(Pipeline(load_model(weights_path("smallsegnet")), mirror=False), bus), Camera(bus)
    resident = []
    for number in range(FRAMES):
        camera.publish(frames[number % len(frames)], 33_000_000 * number)
        node.spin_once()
        if number % 10 == 0:
            resident.append(resident_mb())
    tenth = len(resident) // 10
    second, last = np.mean(resident[tenth : 2 * tenth]), np.mean(resident[-tenth:])
    row = ("resident memory", f"{second:.1f}", f"{last:.1f}", f"{100.0 * (last / second - 1.0):+.2f} %")
    return table(f"{FRAMES:,} frames of 80x60 in process | second tenth, MB | last tenth, MB | change", [row])
