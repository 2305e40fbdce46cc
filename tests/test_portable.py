"""The kit runs on Linux, macOS and Windows: what only some systems have is used in few files, each with its reason."""

import ast
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import conftest

ROOT = Path(__file__).parent.parent
MODULES = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
NAMES = {
    "os": "fork forkpty getuid geteuid getgid getgroups setuid setgid setsid killpg mkfifo chown umask uname nice wait "
    "getloadavg getpriority sched_getaffinity sched_setaffinity sysconf memfd_create openpty chroot",
    "signal": "SIGALRM SIGKILL SIGSTOP SIGHUP SIGUSR1 SIGUSR2 SIGCHLD SIGPIPE SIGXFSZ setitimer alarm pause",
    "socket": "AF_UNIX socketpair",
}
ONLY_POSIX = {f"{module}.{name}" for module, names in NAMES.items() for name in names.split()}
OPTIONS = {"preexec_fn", "pass_fds", "start_new_session", "umask"}
PLACES = re.compile(r"/(bin|dev|etc|lib|proc|run|tmp|usr|var)\b")

# Files that may, and why; of the tests, those that are skipped elsewhere may, too.
ALLOWED = {
    "labkit/course/grading/": "`labkit grade` needs Linux, and says so",
    "labkit/course/checker/run.py": "asks first for an alarm; without one, an endless answer is ended by hand",
    "labkit/course/checker/child.py": "a child process that has no limits ends, and nothing is told",
    "labkit/course/checker/repair.py": "runs in that child, or in the grader's sandbox",
    "labkit/apps/doctor.py": "asks first whether the system can tell a process's cores",
    "labkit/learning/images.py": "asks first whether the system tells how much memory there is",
    "labkit/node/ros1.py": "ROS 1 exists as Debian's packages only",
    "tests/grading_course.py": "only the tests of grading use it",
    "tests/course/conftest.py": "the browser's tests need Debian's Chromium",
    "tests/test_site.py": "the browser's tests need Debian's Chromium",
    "tests/node/test_convert.py": "compares with Debian's cv_bridge",
    "tests/node/test_sync.py": "compares with Debian's tf2",
    "tests/learning/test_engines.py": "reads a network with Debian's OpenCV",
    "tests/stacks/": "compares with Debian's OpenCV, in C++ and Java as well",
    "tests/apps/test_doctor.py": "the place is never opened",
    "tests/test_portable.py": "holds them as samples",
}


def uses(tree: ast.AST) -> Iterator[str]:
    """What in a module exists on POSIX systems only, or reads and writes text in an encoding that differs by system."""
    for node in ast.walk(tree):
        match node:
            case ast.Import(names=names):
                yield from {alias.name for alias in names} & MODULES
            case ast.ImportFrom(module=module, names=names):
                yield from {module} & MODULES | {f"{module}.{alias.name}" for alias in names} & ONLY_POSIX
            case ast.Attribute(value=ast.Name(id=module), attr=name) if f"{module}.{name}" in ONLY_POSIX:
                yield f"{module}.{name}"
            case ast.Constant(value=str(text)) if PLACES.match(text) or text == "fork":
                yield repr(text)
            case ast.Call(
                func=ast.Attribute(ast.Call(ast.Name("str")), "split" | "rsplit"), args=[ast.Constant("/"), *_]
            ):
                yield "split('/') of a path"
            case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name), args=args, keywords=keywords):
                given = {keyword.arg for keyword in keywords}
                yield from given & OPTIONS
                binary = any(isinstance(arg, ast.Constant) and "b" in str(arg.value) for arg in args[1:2])
                text = name in ("read_text", "write_text") or (name == "open" and isinstance(node.func, ast.Name))
                if text and not binary and "encoding" not in given:
                    yield f"{name}() without an encoding"


def code(path: Path) -> str:
    """The Python in a file; of a notebook, its code cells without IPython's own lines."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".ipynb":
        return text
    cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
    return "\n".join(re.sub(r"^\s*[%!].*$", "", "".join(cell["source"]), flags=re.MULTILINE) for cell in cells)


def test_what_only_posix_has_stands_where_it_must():
    files = [path for folder in ("labkit", "data_gen", "tests") for path in (ROOT / folder).rglob("*.py")]
    files += [path for folder in ("lessons", "solutions") for path in (ROOT / folder).rglob("*.ipynb")]
    allowed = (*ALLOWED, *(name.split("::")[0] for name in conftest.NOT_EVERYWHERE), "tests/attacks", "tests/bench")
    used, found = set(), {}
    for path in files:
        name = path.relative_to(ROOT).as_posix()
        posix = set(uses(ast.parse(code(path))))
        if name.startswith("tests/"):  # they run with PYTHONUTF8=1 on Windows
            posix = {use for use in posix if "encoding" not in use}
        if name.startswith(allowed):
            used |= {start for start in ALLOWED if posix and name.startswith(start)}
        elif posix:
            found[name] = posix
    assert not found
    assert used == ALLOWED.keys(), "these need no allowance any more"


def test_grading_elsewhere_says_in_one_line_that_it_needs_linux(monkeypatch, labkit, capsys):
    monkeypatch.setattr(sys, "platform", "darwin")
    assert labkit("grade", "04_iou") == 2
    assert capsys.readouterr().err == (
        "labkit: labkit grade needs Linux, this is darwin: grade on Linux, in WSL or in a container\n"
    )
