"""Where many equal jobs run: in this process, in several, or on the workers of a Dask cluster."""

import multiprocessing
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, ProcessPoolExecutor, as_completed, wait
from contextlib import contextmanager
from hashlib import sha256
from itertools import starmap
from pathlib import Path

import labkit
import labtrain

# Workers share the cores among themselves: NumPy and PyTorch read these when they are loaded. A second thread of
# OpenBLAS gains nothing with small matrices, but keeps a core busy while it waits for more.
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


@contextmanager
def executor_for(workers: int = 1, dask: str | None = None) -> Iterator[Executor | None]:
    """Give an executor of concurrent.futures: None for this process, or so many processes, or a cluster's workers.

    dask: address of a Dask scheduler, "tcp://host:8786"; its workers have the same files and the same kit, or
    ValueError names those that have not. A job whose worker dies is run again by another.
    """
    if dask is not None:
        from distributed import Client

        try:
            client = Client(dask, timeout=20)
        except OSError as error:
            raise ValueError(f"dask: found no scheduler at {dask}") from error
        with client:
            _check_workers(client, dask)
            yield client.get_executor(pure=False)
    elif workers == 1:
        yield None
    else:
        # Fresh processes: PyBullet and OpenCV must not be forked while they run. Each is replaced after some hundred
        # jobs, which bounds what PyBullet's caches hold.
        spawn = multiprocessing.get_context("spawn")
        with inherited(ONE_THREAD), ProcessPoolExecutor(workers, spawn, max_tasks_per_child=400) as executor:
            yield executor


def as_they_come(
    function: Callable, jobs: Iterable[tuple], executor: Executor | None = None, most: int = 64
) -> Iterator:
    """Yield the results of function(*job) as they come, with at most so many jobs waiting, so that memory stays flat.

    executor: None for this process.

    >>> list(as_they_come(pow, [(2, 3), (3, 2)]))
    [8, 9]
    """
    if executor is None:
        yield from starmap(function, jobs)
        return
    pending = set()
    try:
        for job in jobs:
            pending.add(executor.submit(function, *job))
            if len(pending) >= most:
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                yield from (future.result() for future in done)
        for future in as_completed(pending):
            yield future.result()
    finally:
        for future in pending:
            future.cancel()


@contextmanager
def inherited(variables: dict[str, str]) -> Iterator[None]:
    """Processes that are started meanwhile have these environment variables; this one has its own again afterwards."""
    before = {name: os.environ[name] for name in variables if name in os.environ}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name in variables:
            os.environ.pop(name, None)
        os.environ.update(before)


def one_thread() -> None:
    """Make a worker of a cluster, whose libraries may be loaded, compute in one thread."""
    os.environ.update(ONE_THREAD)
    if torch := sys.modules.get("torch"):
        torch.set_num_threads(1)


def kit_version() -> str:
    """Name this installation of the kit: its version, and a digest of its code."""
    files = [path for kit in (labkit, labtrain) for path in sorted(Path(kit.__file__).parent.rglob("*.py"))]
    return f"{labkit.__version__}, code {sha256(b''.join(path.read_bytes() for path in files)).hexdigest()[:8]}"


def _check_workers(client, address: str) -> None:
    try:
        found = client.run(kit_version)
    except ImportError as error:
        raise ValueError(f"dask: expected workers with labkit {kit_version()}, got some without the kit") from error
    if not found:
        raise ValueError(f"dask: expected workers at {address}, got none yet")
    others = {where: what for where, what in found.items() if what != kit_version()}
    if others:
        where, what = next(iter(others.items()))
        raise ValueError(f"dask: expected workers with labkit {kit_version()}, got {what} at {where}")
    client.run(one_thread)
