"""Processes for tests: started with the kit on their path, gone afterwards; and patience with them."""

import contextlib
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
PATIENCE = 60.0  # seconds: only a failure waits so long


def wait_for(condition, what: str):
    """Poll until something is there; the test fails, and says what was missing, if it never comes."""
    deadline = time.monotonic() + PATIENCE
    while not (found := condition()):
        assert time.monotonic() < deadline, f"waited in vain for {what}"
        time.sleep(0.005)
    return found


@contextlib.contextmanager
def process(*command, **options):
    """A process of this Python that is gone afterwards."""
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    environment = os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": path}
    with subprocess.Popen([sys.executable, *map(str, command)], env=environment, text=True, **options) as started:
        try:
            yield started
        finally:
            started.kill()
