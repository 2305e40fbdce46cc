"""A limit on the CPU time of a call in this process, on every system: `TimeIsUp` is raised in what takes longer.

It reaches Python's own loops. A compiled function that does not come back is ended with its process, by whoever started
that (`labgrader.run.channel`); NumPy's that are known not to come back from infinite numbers raise instead (`finite`).
"""

import contextlib
import ctypes
import functools
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np

TICK_S = 0.02
ENDLESS = ("svd", "pinv", "lstsq")  # of np.linalg: LAPACK's search for singular vectors


class TimeIsUp(BaseException):
    """Raised in a program that runs too long; not an Exception, so that `except Exception` lets it pass."""


ENDS = (Exception, SystemExit, KeyboardInterrupt, TimeIsUp)  # how a student's program may end


class Alarm:
    """Watches the thread that made it. It rings again and again: a program may catch everything in an endless loop."""

    def __init__(self):
        self.thread, self.end, self.lock = threading.get_ident(), None, threading.Lock()
        self.now = time.process_time()  # of the last tick: a look at the clock costs as much as a short call
        threading.Thread(target=self.watch, daemon=True).start()

    def watch(self) -> None:
        """Ring whenever the time is up: TimeIsUp comes up in the thread as soon as it runs Python's code."""
        ring = ctypes.pythonapi.PyThreadState_SetAsyncExc
        while True:
            time.sleep(TICK_S)
            with self.lock:
                self.now = time.process_time()
                if self.end is not None and self.now > self.end:
                    ring(ctypes.c_ulong(self.thread), ctypes.py_object(TimeIsUp))

    def stop(self) -> None:
        """Ring no more, and take what has rung but has not come up yet."""
        while True:
            try:
                with self.lock:
                    self.end = None
                for _ in range(3):  # it comes up between two turns of a loop
                    pass
                return
            except TimeIsUp:
                continue


alarm = functools.cache(Alarm)


@contextlib.contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise TimeIsUp in a block that takes more CPU seconds; blocks in one another have the limit of the inner one.

    The first thread that calls this is the only one that may.

    >>> with limited(0.1):
    ...     while True: pass
    Traceback (most recent call last):
    labgrader.reply.alarm.TimeIsUp
    """
    watching = alarm()
    watching.end = watching.now + TICK_S + seconds
    try:
        yield
    finally:
        watching.stop()


@contextlib.contextmanager
def finite() -> Iterator[None]:
    """Functions of np.linalg that may not come back from a matrix with infinite entries raise LinAlgError of one."""
    before = {name: getattr(np.linalg, name) for name in ENDLESS}
    for name, function in before.items():
        setattr(np.linalg, name, of_finite(function))
    try:
        yield
    finally:
        for name, function in before.items():
            setattr(np.linalg, name, function)


def of_finite(function: Callable) -> Callable:
    """A function of a matrix that raises LinAlgError where an entry is infinite."""

    @functools.wraps(function)
    def wrapper(a, *args, **kwargs):
        if np.isinf(a).any():
            raise np.linalg.LinAlgError("infinite entries")
        return function(a, *args, **kwargs)

    return wrapper
