"""Kernels that are forks of one process, which has imported what notebooks import: that is a third of their time.

As a program this is that process. Its arguments name modules; each line of its input asks for a kernel, and the answer
is the number of the kernel's process. It ends when its input does.
"""

import importlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable
from contextlib import suppress

INLINE = {"MPLBACKEND": "module://matplotlib_inline.backend_inline"}  # as ipykernel sets it before anything is imported


class WarmKernels:
    """Starts kernels as jupyter_client.launcher.launch_kernel does, by a process that has imported `modules`."""

    def __init__(self, modules: Iterable[str]):
        self.modules, self.process = list(modules), None

    def __call__(self, cmd: list[str], env: dict[str, str], cwd: str | None = None, **streams) -> "Kernel":
        """Fork a kernel. `cmd` is what would start one: python -m ipykernel_launcher, and arguments."""
        if self.process is None:
            server = [sys.executable, "-P", __file__, *self.modules]
            pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
            self.process = subprocess.Popen(server, env=env | INLINE, start_new_session=True, **pipes)
        asked = {
            "arguments": cmd[cmd.index("ipykernel_launcher") + 1 :],
            "env": env | INLINE,
            "cwd": cwd or os.getcwd(),
        }
        print(json.dumps(asked), file=self.process.stdin, flush=True)
        return Kernel(int(self.process.stdout.readline()))


class Kernel:
    """A kernel's process; jupyter_client wants of it what it wants of one of subprocess."""

    stdin = stdout = stderr = None

    def __init__(self, pid: int):
        self.pid = pid

    def poll(self) -> int | None:
        """None while it runs. What it says when it ends, nobody here is told."""
        try:
            os.kill(self.pid, 0)
        except ProcessLookupError:
            return 0
        return None

    def wait(self) -> int:
        """Wait for its end."""
        while self.poll() is None:
            time.sleep(0.02)
        return 0

    def send_signal(self, number: int) -> None:
        """Send it a signal."""
        os.kill(self.pid, number)


def main() -> None:
    """Import the modules that the arguments name, and fork a kernel for each line of the input."""
    from ipykernel.kernelapp import IPKernelApp

    for module in sys.argv[1:]:
        with suppress(ImportError):  # the cell that needs it will say so
            importlib.import_module(module)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the system takes kernels away that have ended
    server = os.getpid()
    for line in sys.stdin:
        asked = json.loads(line)
        if pid := os.fork():
            os.setpgid(pid, pid)  # a signal to a kernel's group is to reach no other
            print(pid, flush=True)
            continue
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        nothing = os.open(os.devnull, os.O_RDWR)
        for stream in range(3):
            os.dup2(nothing, stream)
        os.chdir(asked["cwd"])
        os.environ.clear()
        os.environ.update(asked["env"], JPY_PARENT_PID=str(server))
        sys.argv[1:] = asked["arguments"]
        try:
            IPKernelApp.launch_instance()
        finally:
            os._exit(0)


if __name__ == "__main__":
    main()
