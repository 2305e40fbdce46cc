"""The node on ROS 2: what it adds to a bare relay, and a minute of a camera's 30 frames a second, on loopback.

Added latency: from the camera's call to the mask's arrival in another process, less what the pipeline took of it.
Discovery is limited to localhost. A bare relay is thirty lines of rclpy that take the same three messages and send a
mask of the same size; frames go to relay and node in turn. On a machine that others use as well, the least times say
more than the medians. Then the camera keeps its rate for a minute. Each frame that the node receives is answered or
superseded by a newer one; with best effort some may never arrive, and diagnostics say how many. Memory is flat if the
last tenth of the minute finds the node's within 2 % of the second tenth's. Runs with the wheels of `make ros2`.
"""

import importlib.util
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from data_gen import render, sample_scene
from labkit.node.actors import Camera
from labkit.node.messages import ROS_TOPICS, Diagnostics, Image
from labkit.node.ros2 import Ros2Transport, set_up_shared_memory

ROOT = Path(__file__).parents[2]
PATIENCE = 200.0  # seconds; the first frame may have to wait for numba
SIZE, REPEATS, SECONDS, RATE = (640, 480), 60, 60, 30.0
DEPTH = 100  # messages that wait for a busy reader: three seconds of the camera
NODE = ("-m", "labkit.apps.cli", "node", "--ros", "--model", "unet", "--engine", "onnxruntime", "--no-crf")


def main() -> str:
    """Two tables: latency, and a minute at 30 Hz."""
    if importlib.util.find_spec("rclpy") is None:
        python = ROOT / ".venv-ros2/bin/python"
        if not python.exists():
            return "ROS 2 on loopback was not measured: `make ros2` sets it up"
        command = [python, "-m", "tests.bench.bench_ros2"]
        return subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout.strip()
    os.environ |= {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": str(1 + os.getpid() % 100)}
    set_up_shared_memory()  # for the relay, too
    frame = render(sample_scene(700_000, "test"), SIZE)
    return "\n\n".join([latency(frame), endurance(frame)])


def relay() -> None:
    """The bare relay, as a reader of rclpy's tutorials writes it."""
    import rclpy
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from sensor_msgs.msg import CameraInfo
    from sensor_msgs.msg import Image as RosImage

    rclpy.init(args=sys.argv)
    node = rclpy.create_node("relay")
    reliable = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
    publisher = node.create_publisher(RosImage, ROS_TOPICS.mask, reliable)

    def answer(rgb: RosImage) -> None:
        mask = RosImage(header=rgb.header, height=rgb.height, width=rgb.width, encoding="mono8", step=rgb.width)
        mask.data = rgb.data[: rgb.height * rgb.width]
        publisher.publish(mask)

    node.create_subscription(RosImage, ROS_TOPICS.rgb, answer, reliable)
    node.create_subscription(RosImage, ROS_TOPICS.depth, lambda depth: None, reliable)
    node.create_subscription(CameraInfo, ROS_TOPICS.info, lambda info: None, reliable)
    rclpy.spin(node)


class Peer:
    """Camera and listener in a namespace: when masks arrived, and what diagnostics said last."""

    def __init__(self, space: str):
        self.transport = Ros2Transport("bench", ["--ros-args", "-r", f"__ns:=/{space}"])
        self.transport.quality("reliable", depth=DEPTH)
        self.arrived, self.told, self.news = {}, {}, threading.Condition()
        self.transport.subscribe(ROS_TOPICS.mask, Image, self.receive)
        self.transport.subscribe(
            ROS_TOPICS.diagnostics, Diagnostics, lambda m: self.told.update({m.header.stamp: m.values})
        )
        self.camera = Camera(self.transport, topics=ROS_TOPICS)

    def receive(self, mask: Image) -> None:
        with self.news:
            self.arrived[mask.header.stamp] = time.perf_counter()
            self.news.notify()

    def ask(self, frame, stamp: int) -> float:
        """Milliseconds from the camera's call to the mask's arrival."""
        start = time.perf_counter()
        self.camera.publish(frame, stamp)
        with self.news:
            assert self.news.wait_for(lambda: stamp in self.arrived, PATIENCE), "no answer"
        return 1000.0 * (self.arrived[stamp] - start)


@contextmanager
def meeting(frame, space: str, *command: str):
    """A process and a peer for it, in a namespace of their own, connected and warm."""
    started = subprocess.Popen([sys.executable, *command, "-r", f"__ns:=/{space}"], cwd=ROOT, stderr=subprocess.DEVNULL)
    peer = Peer(space)
    try:
        topics = ROS_TOPICS
        streams = (topics.rgb, topics.depth, topics.info, *([topics.tf] if space == "kit" else []))
        while not (all(map(peer.transport.wanted, streams)) and peer.transport.node.count_publishers(topics.mask)):
            time.sleep(0.05)
        while not (peer.arrived and (peer.told or space == "bare")):  # each side finds the other in its own time
            peer.camera.publish(frame, time.time_ns())
            time.sleep(1.0)
        yield peer, started
    finally:
        started.send_signal(signal.SIGINT)
        peer.transport.close()
        started.wait(PATIENCE)


def latency(frame) -> str:
    """Relay and node in turn, one frame at a time."""
    with (
        meeting(frame, "bare", "-c", "from tests.bench.bench_ros2 import relay; relay()", "--ros-args") as (bare, _),
        meeting(frame, "kit", *NODE, "--qos-inputs", "reliable", "--ros-args") as (kit, _),
    ):
        relayed, added, perceived = [], [], []
        for turn in range(REPEATS + 5):
            stamp = time.time_ns()  # later than those of `meeting`: an older pose than all that are known is refused
            first, second = bare.ask(frame, stamp), kit.ask(frame, stamp)
            while stamp not in kit.told:
                time.sleep(0.001)
            if turn >= 5:
                perceived.append(float(kit.told[stamp]["of these in the pipeline"]))
                relayed.append(first)
                added.append(second - perceived[-1])
    ratios = np.median(added) / np.median(relayed), min(added) / min(relayed)
    rows = [
        "| ROS 2 on loopback, 640x480, UNet once on onnxruntime | median ms | least ms |",
        "|---|---|---|",
        f"| in the pipeline | {np.median(perceived):.1f} | {min(perceived):.1f} |",
        f"| bare relay | {np.median(relayed):.1f} | {min(relayed):.1f} |",
        f"| added by node and network | {np.median(added):.1f} | {min(added):.1f} |",
        f"| ratio (to reach: at most 1.3) | {ratios[0]:.2f} | {ratios[1]:.2f} |",
    ]
    return "\n".join(rows)


def endurance(frame) -> str:
    """A minute at the camera's rate, with each reliability of the inputs."""
    rows = []
    for quality in ("reliable", "best_effort"):
        options = ("--qos-inputs", quality, "--qos-depth", str(DEPTH), "--ros-args")
        with meeting(frame, "kit", *NODE, *options) as (kit, process):
            before = counts(kit)
            resident, stop = [], threading.Event()
            watcher = threading.Thread(target=watch, args=(process.pid, resident, stop))
            watcher.start()
            sent = kit.camera.run((frame for _ in range(int(SECONDS * RATE))), RATE)
            stop.set()
            watcher.join()
            time.sleep(3.0)
            became = [after - earlier for earlier, after in zip(before, counts(kit), strict=True)]
            tenth = len(resident) // 10
            growth = 100.0 * (np.mean(resident[-tenth:]) / np.mean(resident[tenth : 2 * tenth]) - 1.0)
            rows.append(f"| {quality} | {' | '.join(map(str, (sent, *became)))} | {growth:+.2f} % |")
    head = f"| inputs, {RATE:.0f} Hz for {SECONDS} s | sent | answered | superseded | incomplete | failed "
    return f"{head}| colour images lost on the way | memory |\n|{'---|' * 8}\n" + "\n".join(rows)


def counts(kit: Peer) -> list[int]:
    """Frames answered, superseded, incomplete and failed, and colour images lost on the way, as diagnostics tell."""
    last = kit.told[max(kit.told)]
    gone = last.get(ROS_TOPICS.rgb, "0 messages lost").split()[0]
    return [int(last[name]) for name in ("answered", "dropped", "lost", "failed")] + [int(gone)]


def watch(pid: int, resident: list[float], stop: threading.Event) -> None:
    """Note a process's resident memory, megabytes, ten times a second."""
    while not stop.wait(0.1):
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
        resident.append(pages * os.sysconf("SC_PAGE_SIZE") / 1e6)


if __name__ == "__main__":
    print(main())
