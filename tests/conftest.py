"""The suite runs with the shape annotations checked: every jaxtyping annotation is a test wherever it is passed.

Two things go without: modules of kernels (the hook wraps every function, and numba cannot compile the wrapper), and
tests marked `bad_input`, in which the functions' own validation must answer.

Tests marked `nightly` repeat at length what others show at once; `--nightly` runs them and no others, everything else
leaves them out (`make nightly`).

Tests marked `debian` need Debian packages beside the environment: where those are missing, the tests skip, and the run
ends with a table of what was skipped and the command that would enable it. Those that need Chromium take minutes:
`make test` leaves them to `.ci/run`.
"""

import os
import shutil
import subprocess
import sys
from collections import Counter
from functools import cache
from pathlib import Path

import jaxtyping
import pytest

ROOT = Path(__file__).parent.parent
sys.modules.setdefault("rfc3987_syntax", None)  # as `labcli.cli.main` does: a second of each process
PACKAGES = ("labkit", "labtrain", "labros", "labgrader", "labcourse", "labcli", "data_gen")


def annotated_modules() -> list[str]:
    """Dotted names of the packages' modules that have shapes in their annotations and hold no numba kernels."""
    files = [path for package in PACKAGES for path in (ROOT / package).rglob("*.py")]
    shaped = [path for path in files if "jaxtyping" in path.read_text(encoding="utf-8")]
    pure = [path for path in shaped if path.stem != "__init__" and not path.stem.endswith("_kernels")]
    return [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in pure]


jaxtyping.install_import_hook(annotated_modules(), "beartype.beartype")


@pytest.fixture(autouse=True)
def shape_checks_off_for_bad_input(request):
    """Let wrong arguments reach the function in tests marked `bad_input`."""
    marked = request.node.get_closest_marker("bad_input") is not None
    jaxtyping.config.update("jaxtyping_disable", marked)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)


@pytest.fixture(autouse=True)
def course_of_this_folder(monkeypatch):
    """A command of one test that names a course names it to no other."""
    monkeypatch.setenv("LABGRADER_COURSE", "")  # what is changed after this is undone, too


@pytest.fixture
def labkit(monkeypatch):
    """A function that runs a command of the kit in this process and returns its exit status."""
    from labcli import cli

    def run(*words) -> int:
        monkeypatch.setattr(sys, "argv", ["labkit", *map(str, words)])
        monkeypatch.setenv("PYTHONSAFEPATH", "")  # which `main` sets
        with pytest.raises(SystemExit) as stop:
            cli.main()
        return stop.value.code

    return run


@pytest.fixture(scope="module")
def one_thread():
    """PyTorch computes in one thread."""
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


# ------------------------------------------------------------------------------------------- other systems

# What is tested on some systems only: the start of a test's id, the systems, and why not on others.
NOT_EVERYWHERE = {
    "tests/labgrader/sandbox/": ("linux", "`labkit grade` needs Linux"),
    "tests/labgrader/handin/": ("linux", "`labkit grade` needs Linux"),
    "tests/labgrader/grade/": ("linux", "`labkit grade` needs Linux"),
    "tests/labgrader/report/": ("linux", "`labkit grade` needs Linux"),
    "tests/labgrader/test_grade_course": ("linux", "`labkit grade` needs Linux"),
    "tests/test_repository.py": ("linux", "needs GNU make 4 and bash"),
    "tests/data_gen/test_data_gen.py::test_the_command_says_a_full_disk": ("linux darwin", "needs a limit on files"),
    "tests/labtrain/test_scale.py": ("linux darwin", "Windows has no signal that kills"),
    "tests/labcli/test_cli.py::test_ctrl_c": ("linux darwin", "Windows sends no Ctrl-C to one process"),
}


def pytest_addoption(parser):
    """`--nightly`; `--no-skip`, for a machine that is meant to have every Debian package."""
    parser.addoption("--nightly", action="store_true", help="run the tests marked nightly, and no others")
    parser.addoption("--no-skip", action="store_true", help="fail tests whose Debian packages are missing")


@pytest.hookimpl(tryfirst=True)  # before -m chooses
def pytest_collection_modifyitems(config, items):
    """Leave out what is for another hour, mark what needs a browser, and skip what this system cannot do."""
    parts = {True: [], False: []}
    for item in items:
        parts[item.get_closest_marker("nightly") is not None].append(item)
    wanted = config.getoption("--nightly")
    items[:] = parts[wanted]
    config.hook.pytest_deselected(items=parts[not wanted])
    for item in items:
        if any("chromium" in mark.args for mark in item.iter_markers("debian")):
            item.add_marker("browser")
        for start, (systems, reason) in NOT_EVERYWHERE.items():
            if item.nodeid.startswith(start) and sys.platform not in systems.split():
                item.add_marker(pytest.mark.skip(reason=reason))


# ------------------------------------------------------------------------------------------- Debian packages

NEEDS = "needs Debian's "


@cache
def installed() -> set[str]:
    """Names of the Debian packages of this machine; none where there is no dpkg."""
    try:
        command = ["dpkg-query", "-W", "-f", "${db:Status-Abbrev} ${Package}\n"]
        lines = subprocess.run(command, capture_output=True, text=True).stdout.splitlines()
    except OSError:
        return set()
    return {line.split()[1] for line in lines if line.startswith("ii")}


def pytest_runtest_setup(item):
    """Skip a test whose Debian packages are not all there."""
    needed = [name for mark in item.iter_markers("debian") for name in mark.args]
    if missing := sorted(set(needed) - installed()):
        missing_here = pytest.fail if item.config.getoption("--no-skip") else pytest.skip
        missing_here(NEEDS + " ".join(missing))


def pytest_terminal_summary(terminalreporter):
    """The table of what was skipped, one line per reason, and what to install to run it."""
    reports = terminalreporter.stats.get("skipped", [])
    reasons = Counter(str(report.longrepr[-1]).removeprefix("Skipped: ") for report in reports)
    if not reasons:
        return
    terminalreporter.section("not tested on this machine")
    for reason, count in sorted(reasons.items()):
        terminalreporter.write_line(f"{count:4d} {'test ' if count == 1 else 'tests'}  {reason}")
    packages = {name for reason in reasons if reason.startswith(NEEDS) for name in reason.removeprefix(NEEDS).split()}
    if packages:
        command = "apt-get install --no-install-recommends " + " ".join(sorted(packages))
        terminalreporter.write_line(f"To test that as well, as root: {command}")


# --------------------------------------------------------------------------------------------------- a browser

PATIENCE_MS = 500_000  # a kernel that imports torch on a busy machine takes its time: twelve seconds of a processor


@pytest.fixture(scope="module")
def browser():
    """One Chromium without a window."""
    from playwright.sync_api import sync_playwright

    options = ["--no-sandbox", "--disable-dev-shm-usage"] if os.geteuid() == 0 else ["--disable-dev-shm-usage"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), headless=True, args=options)
        yield browser
        browser.close()


@pytest.fixture
def page(browser, tmp_path):
    """A page that remembers the errors of its console in `page.errors`, and leaves a picture of how it ended."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.errors = []
    page.on("console", lambda message: page.errors.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    yield page
    page.screenshot(path=tmp_path / "end.png")
    context.close()
