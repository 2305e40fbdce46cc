"""Scenes per second, the share of it spent inside PyBullet, two workers against one, and memory."""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import data_gen
from bench.measure import table
from data_gen.dataset import write_frame
from labkit.sim.client import Client
from labtrain.executors import as_they_come, executor_for

SCENES = 40
FRAMES = 1000  # for the memory


def main() -> str:
    """Rows of a table: each figure, what was measured, and what was to be reached."""
    with tempfile.TemporaryDirectory() as folder:
        write_frame(folder, 0, 0, "test", (320, 240), None)  # the first scene of a process reads all models
        seconds, share = timed_scenes(folder)
        ratio = one_worker_against_two(folder)
        generating, loading = memory(folder)
    rows = [
        ("seconds per scene on one core, median", f"{np.median(seconds):.3f}", 0.4),
        ("share of it inside PyBullet", f"{share:.0%}", "stated"),
        ("scenes per second, 2 workers over 1", f"{ratio:.2f}", 1.7),
        (f"peak memory, generating {FRAMES} frames, MB", f"{generating:.0f}", 1000),
        (f"peak memory, loading {FRAMES} frames, MB", f"{loading:.0f}", 1000),
    ]
    return table("figure at 320x240 | measured | to reach", rows)


def timed_scenes(folder: str) -> tuple[list[float], float]:
    """Seconds of each scene, and the share of them spent in calls of PyBullet's functions."""
    seconds, inside = [], []
    plain = Client.__getattr__

    def timed(client: Client, name: str):
        function = plain(client, name)

        def call(*arguments, **named):
            start = time.perf_counter()
            try:
                return function(*arguments, **named)
            finally:
                inside.append(time.perf_counter() - start)

        if callable(function):
            setattr(client, name, call)
        return getattr(client, name, function)

    Client.__getattr__ = timed
    try:
        for seed in range(1, SCENES + 1):
            start = time.perf_counter()
            write_frame(folder, seed, seed, "test", (320, 240), None)
            seconds.append(time.perf_counter() - start)
    finally:
        Client.__getattr__ = plain
    return seconds, sum(inside) / sum(seconds)


def one_worker_against_two(folder: str) -> float:
    """How many times as fast two processes write the same scenes as one, the start of processes left out."""
    rates = {}
    for workers in (1, 2):
        with executor_for(workers) as executor:
            first = [(data_gen.sample_scene(seed, "test"), (320, 240)) for seed in range(6)]
            list(as_they_come(data_gen.render, first, executor))  # each process has read the models
            start = time.perf_counter()
            out = Path(folder) / f"workers{workers}"
            data_gen.generate(out, range(SCENES), "test", (320, 240), executor, progress=False)
            rates[workers] = SCENES / (time.perf_counter() - start)
    return rates[2] / rates[1]


def memory(folder: str) -> tuple[float, float]:
    """Peak resident megabytes of a fresh process that generates many frames, and of one that loads them."""
    out = Path(folder) / "many"
    call = "import resource, data_gen; {}; print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024)"
    work = (
        f"data_gen.generate({str(out)!r}, range({FRAMES}), 'test', (320, 240), progress=False)",
        f"[frame.depth.max() for frame in data_gen.load({str(out)!r})]",
    )
    results = [
        subprocess.run([sys.executable, "-c", call.format(code)], capture_output=True, text=True, check=True)
        for code in work
    ]
    return tuple(float(result.stdout.split()[-1]) for result in results)
