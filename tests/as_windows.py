"""Makes this process lack what CPython lacks on Windows, as far as that can be done elsewhere; run it before the kit.

What other packages took from the standard library before stays theirs: they have wheels for Windows, and code for it.
"""

import importlib
import os
import signal
import subprocess
import sys

MODULES = [
    "resource",
    "fcntl",
    "pwd",
    "grp",
    "termios",
    "tty",
    "pty",
    "syslog",
    "crypt",
    "spwd",
    "nis",
    "posix",
    "_posixsubprocess",
]
OF_OS = [
    "fork",
    "forkpty",
    "register_at_fork",
    "getuid",
    "geteuid",
    "getgid",
    "getegid",
    "getgroups",
    "setuid",
    "setgid",
    "setsid",
    "sched_getaffinity",
    "sched_setaffinity",
    "mkfifo",
    "mknod",
    "killpg",
    "getpgid",
    "getpgrp",
    "nice",
    "getloadavg",
    "chown",
    "lchown",
    "fchown",
    "fchmod",
    "wait",
    "wait3",
    "wait4",
    "posix_spawn",
    "pread",
    "pwrite",
    "getpriority",
    "setpriority",
    "memfd_create",
    "O_NOFOLLOW",
    "O_DIRECTORY",
    "O_NONBLOCK",
    "O_CLOEXEC",
    "statvfs",
    "fstatvfs",
    "ctermid",
    "WNOHANG",
]
OF_SIGNAL = [
    "SIGKILL",
    "SIGALRM",
    "SIGHUP",
    "SIGUSR1",
    "SIGUSR2",
    "SIGCHLD",
    "SIGPIPE",
    "SIGSTOP",
    "SIGCONT",
    "SIGQUIT",
    "alarm",
    "setitimer",
    "getitimer",
    "pthread_sigmask",
    "sigwait",
    "pause",
]
LOADED = [
    "asyncio",
    "concurrent.futures",
    "ctypes",
    "multiprocessing.connection",
    "multiprocessing.shared_memory",
    "tempfile",
    "shutil",
]


def take_away(packages: list[str] = ()) -> None:
    """Load other packages, then take away what Windows has not."""
    for name in [*LOADED, *packages]:
        importlib.import_module(name)

    def kill(process) -> None:  # TerminateProcess
        if process.poll() is None:
            os.kill(process.pid, 9)

    subprocess.Popen.kill = subprocess.Popen.terminate = kill
    sys.modules.update(dict.fromkeys(MODULES))
    for module, names in ((os, OF_OS), (signal, OF_SIGNAL)):
        for name in names:
            vars(module).pop(name, None)
