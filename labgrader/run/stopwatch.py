"""How long a process has worked: its CPU time, so that a busy machine takes nothing away from an answer.

Waiting for a processor is free; sleep counts a fifth: an answer that only sleeps ends after five times its limit. A
check, where a student waits, ends after ten seconds asleep (`limits.Limits.asleep_s`), if the system tells sleep from
waiting.

Its memory is asked for here as well, on systems whose kernel sets no limit to that.
"""

import sys
import time
from contextlib import suppress
from pathlib import Path

SLEEP = 5.0  # seconds of sleep that count as one
CLOCK_OF_PROCESS = 2  # Linux: the clock of process `pid` has the number ~pid << 3 | 2


def cpu_s(pid: int) -> float:
    """CPU seconds of a process and its threads; raises OSError if it has ended, or if nobody can say."""
    if sys.platform == "linux":
        return time.clock_gettime(~pid << 3 | CLOCK_OF_PROCESS)
    try:
        import psutil  # comes with ipykernel

        times = psutil.Process(pid).cpu_times()
    except Exception as error:
        raise OSError(f"no CPU time of process {pid}") from error
    return times.user + times.system


def memory_of(pid: int) -> int:
    """Bytes of memory that a process holds; 0 if it has ended, or if nobody can say."""
    try:
        import psutil

        return psutil.Process(pid).memory_info().rss
    except Exception:
        return 0


def waited_s(pid: int | None) -> float | None:
    """Seconds in which a process could have run but had no processor; None where the system does not say."""
    with suppress(OSError, ValueError, IndexError):
        return int(Path(f"/proc/{pid}/schedstat").read_bytes().split()[1]) / 1e9
    return None


class Stopwatch:
    """Seconds that a process has used since it was made; where nobody can say its CPU time, those of the clock.

    slept: of these, those asleep at the last look; 0 where the system does not tell them from waiting.
    """

    def __init__(self, pid: int | None):
        self.pid, self.last, self.cpu, self.slept = pid, 0.0, None, 0.0
        if pid is not None:
            with suppress(OSError):
                self.cpu = cpu_s(pid)
        self.waited, self.begin = waited_s(pid), time.monotonic()

    def used(self) -> float:
        """CPU seconds, or a fifth of those of sleep where that is more; once it has ended, what was read last."""
        if self.cpu is None:
            return time.monotonic() - self.begin
        with suppress(OSError):
            cpu, waited = cpu_s(self.pid) - self.cpu, waited_s(self.pid)
            idle = time.monotonic() - self.begin - cpu
            if waited is not None and self.waited is not None:
                self.slept = idle = idle - (waited - self.waited)
            self.last = max(cpu, idle / SLEEP)
        return self.last
