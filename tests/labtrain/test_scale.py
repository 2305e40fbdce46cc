"""More than one machine's work on a real Dask scheduler with workers, processes of their own on loopback."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor
from pathlib import Path

import pytest

import data_gen
from labcli import mask_study
from labcli.evaluation import run_trials
from labtrain.executors import executor_for

pytest.importorskip("distributed")
ROOT = Path(__file__).parents[2]
HERE = ("--host", "tcp://127.0.0.1")
PATIENCE = 240  # seconds


def start(*words: str, path: Path = ROOT) -> subprocess.Popen:
    environment = os.environ | {"PYTHONPATH": str(path), "OMP_NUM_THREADS": "1"}
    return subprocess.Popen([sys.executable, "-m", *words], env=environment, cwd=path, stderr=subprocess.DEVNULL)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """The scheduler's address, and a function that starts a worker."""
    file = tmp_path_factory.mktemp("dask") / "scheduler.json"
    running = [
        start("distributed.cli.dask_scheduler", "--scheduler-file", str(file), "--no-dashboard", "--port", "0", *HERE)
    ]

    def worker(path: Path = ROOT) -> subprocess.Popen:
        words = ("--scheduler-file", str(file), "--nthreads", "1", "--no-nanny", "--no-dashboard", *HERE)
        running.append(start("distributed.cli.dask_worker", *words, path=path))
        return running[-1]

    from distributed import Client

    while not file.exists():
        time.sleep(0.1)
    with Client(scheduler_file=str(file)) as client:
        yield client, worker
    for process in running:
        process.kill()
        process.wait()


@pytest.fixture(scope="module")
def one_worker(cluster):
    client, worker = cluster
    worker()
    client.wait_for_workers(1, timeout=PATIENCE)
    return client.scheduler.address


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_frames_of_a_worker_are_the_same_bytes(one_worker, tmp_path):
    data_gen.generate(tmp_path / "here", range(3), "test", (64, 48), progress=False)
    with executor_for(dask=one_worker) as executor:
        data_gen.generate(tmp_path / "there", range(3), "test", (64, 48), executor, progress=False)
    assert files(tmp_path / "there") == files(tmp_path / "here")


@pytest.mark.nightly
def test_a_worker_killed_in_the_middle_costs_nothing_but_time(cluster, tmp_path):
    """Same bytes as in this process, though one of two workers dies after the first frames."""
    client, worker = cluster
    before = len(client.scheduler_info()["workers"])
    workers = [worker(), worker()]
    client.wait_for_workers(before + 2, timeout=PATIENCE)
    seeds = range(12)
    data_gen.generate(tmp_path / "here", seeds, "test", (64, 48), progress=False)
    with executor_for(dask=client.scheduler.address) as executor:

        class Watched(Executor):
            """Kills a worker when the fourth job comes back."""

            def submit(self, function, *job):
                future = executor.submit(function, *job)
                if job[1] == 3:
                    future.add_done_callback(lambda _: os.kill(workers[0].pid, signal.SIGKILL))
                return future

        data_gen.generate(tmp_path / "there", seeds, "test", (64, 48), Watched(), progress=False)
    assert workers[0].wait(PATIENCE) == -signal.SIGKILL
    assert files(tmp_path / "there") == files(tmp_path / "here")


@pytest.mark.nightly
def test_scores_and_tables_are_those_of_one_process(one_worker, tmp_path):
    specs = [data_gen.sample_scene(seed, "test") for seed in (3, 4)]
    here, there = (run_trials(specs, None, (96, 72), progress=False, dask=dask) for dask in (None, one_worker))
    assert [(a.lifted, a.reason, a.counts.tolist()) for a in here] == [
        (b.lifted, b.reason, b.counts.tolist()) for b in there
    ]
    for name, dask in (("here", None), ("there", one_worker)):
        mask_study.run(tmp_path / name, scenes=1, progress=False, dask=dask)
    assert (tmp_path / "here").read_bytes() == (tmp_path / "there").read_bytes()


@pytest.mark.nightly
def test_a_worker_with_another_kit_is_refused_in_a_line(cluster, tmp_path):
    """Another version: the same package with one more line."""
    client, worker = cluster
    subprocess.run(
        ["cp", "-r", *(str(ROOT / room) for room in ("labkit", "labtrain", "data_gen")), str(tmp_path)], check=True
    )
    with (tmp_path / "labkit" / "losses.py").open("a") as file:
        file.write("# newer\n")
    before = len(client.scheduler_info()["workers"])
    other = worker(tmp_path)
    client.wait_for_workers(before + 1, timeout=PATIENCE)
    refused = pytest.raises(ValueError, match=r"dask: expected workers with labkit .*, got .* at tcp://")
    with refused, executor_for(dask=client.scheduler.address):
        pass
    other.kill()


@pytest.mark.bad_input
def test_no_scheduler_is_said(monkeypatch):
    """Here after one second of patience."""
    import distributed

    plain = distributed.Client
    monkeypatch.setattr(distributed, "Client", lambda address, timeout: plain(address, timeout=1))
    refused = pytest.raises(ValueError, match=r"dask: found no scheduler at tcp://127\.0\.0\.1:9")
    with refused, executor_for(dask="tcp://127.0.0.1:9"):
        pass


PROGRAM = """
import os
import numpy, threadpoolctl
from labtrain.executors import executor_for
if __name__ == "__main__":
    before = dict(os.environ)
    with executor_for(2) as executor:
        libraries = executor.submit(threadpoolctl.threadpool_info).result()
    print([library["num_threads"] for library in libraries if library["user_api"] == "blas"], os.environ == before)
"""


def test_processes_compute_in_one_thread_each_whatever_their_program_has_loaded(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    words = [sys.executable, str(tmp_path / "program.py")]
    done = subprocess.run(
        words, env=environment | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["[1]", "True"]
