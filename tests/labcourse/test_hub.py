"""A class of three on the hub of `make hub`: a link, fetch, a tick, submit, collect, grade, feedback, in Chromium.

As root two accounts of the machine share an exchange made as docs/hub.md says, and one of them is hostile.

It runs in the environment of `make hub` (`make test-hub`); in any other there is no JupyterHub, and it skips.
"""

import os
import shutil
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

import nbformat
import pytest
import serving
from notebooks import ROOT
from serving import cell_with, menu, open_page, wait_until_idle

pytest.importorskip("jupyterhub", reason="needs `make test-hub`")
pytestmark = [pytest.mark.debian("chromium"), pytest.mark.timeout(1500)]

RIGHT = "".join(
    line
    for cell in nbformat.read(ROOT / "solutions/04_iou/04_iou.ipynb", as_version=4).cells
    if cell.metadata.get("nbgrader", {}).get("grade_id") == "iou"
    for line in cell.source.splitlines(keepends=True)
    if "###" not in line
)
ANSWERS = {"ada": (RIGHT, "✔ iou is right"), "ben": ("def iou(n):\n    return n / 2", "✘ iou"), "cem": (None, "○ iou")}


@pytest.fixture(scope="module")
def hub(tmp_path_factory):
    """The hub with everything that it keeps in a folder of its own; gives its URL and that folder."""
    folder = tmp_path_factory.mktemp("hub")
    ports = []
    probes = [socket.socket() for _ in range(3)]
    for probe in probes:
        probe.bind(("127.0.0.1", 0))
        ports.append(probe.getsockname()[1])
    for probe in probes:
        probe.close()
    url, api = (f"http://127.0.0.1:{port}" for port in ports[:2])
    command = [sys.executable, "-m", "jupyterhub", "-f", "deploy/try_hub.py", f"--JupyterHub.bind_url={url}"]
    command += [f"--JupyterHub.hub_port={ports[2]}", f"--ConfigurableHTTPProxy.api_url={api}"]
    with (folder / "log").open("w") as log:
        environment = os.environ | {"LABKIT_HUB": str(folder)}
        server = subprocess.Popen(command, cwd=ROOT, env=environment, stdout=log, stderr=subprocess.STDOUT)
        try:
            serving.wait_for(f"{url}/hub", server, folder / "log")
            yield url, folder
        finally:
            server.terminate()  # it ends its proxy and the students' servers
            try:
                server.wait(60)
            except subprocess.TimeoutExpired:
                server.kill()
                server.wait()


@pytest.fixture(scope="module")
def course(hub):
    """A function that runs a command as the instructor, in a course of one lab."""
    _, folder = hub
    for name in ("labs/04_iou", "solutions/04_iou"):
        shutil.copytree(ROOT / name, folder / "course" / name)
    shutil.copy(ROOT / "nbgrader_config.py", folder / "course")
    with (folder / "course/nbgrader_config.py").open("a") as config:
        config.write("c.ExchangeCollect.check_owner = False  # all are one account here\n")
    settings = {"JUPYTER_CONFIG_PATH": str(ROOT / "deploy/jupyter"), "LABKIT_EXCHANGE": str(folder / "exchange")}
    settings["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"  # nbgrader calls alembic

    def run(module: str, *words: str) -> str:
        command = [sys.executable, "-m", module, *words]
        environment = os.environ | settings
        done = subprocess.run(command, cwd=folder / "course", env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    return run


def log_in(page, url: str, name: str, where: str) -> None:
    """Log in under a name, and wait for one's JupyterLab at a place of the hub."""
    page.goto(f"{url}/hub/login?next=/hub/user-redirect/{where}")
    page.fill("#username_input", name)
    page.fill("#password_input", "any")
    page.click("#login_submit")
    page.wait_for_selector("#jp-main-dock-panel")


def assignments(page) -> None:
    """Open nbgrader's list of assignments."""
    menu(page, "Nbgrader", "Assignment List")


def test_three_students_fetch_tick_submit_and_read_their_feedback(hub, course, browser, tmp_path):
    url, folder = hub
    subprocess.run([ROOT / "deploy/publish", folder / "class", "04_iou"], check=True)
    course("nbgrader", "release_assignment", "04_iou")
    pages = {}
    for name, (answer, shown) in ANSWERS.items():
        page = pages[name] = browser.new_context(viewport={"width": 1280, "height": 900}).new_page()
        page.set_default_timeout(300_000)
        link = f"git-pull?repo=file://{folder}/class&branch=main&urlpath=lab/tree/class/lessons/04_iou.ipynb"
        log_in(page, url, name, link.replace("&", "%26").replace("?", "%3F"))
        page.wait_for_selector(".jp-Notebook .jp-CodeCell")
        home = folder / "users" / name
        assert (home / "class/labs/04_iou/04_iou.ipynb").exists() and not (home / "class/solutions").exists()
        assignments(page)
        page.click("#released_assignments_list button:text-is('Fetch')")
        page.wait_for_selector("#fetched_assignments_list button:text-is('Submit')")
        open_page(page, f"{url}/user/{name}/lab/tree/04_iou/04_iou.ipynb?reset")
        cell_with(page, "import numpy as np").locator(".cm-content").click()
        page.keyboard.press("Shift+Enter")
        if answer:
            cell_with(page, "def iou(").locator(".cm-content").click()
            page.keyboard.press("Control+a")
            page.keyboard.insert_text(answer)
        menu(page, "Run", "Run All Cells")
        page.locator(".jp-OutputArea-output", has_text=shown).wait_for()
        wait_until_idle(page)
        page.screenshot(path=tmp_path / f"{name}.png")
        page.keyboard.press("Control+s")
        page.locator("#jp-main-dock-panel .lm-TabBar-tab.jp-mod-dirty").wait_for(state="detached")
        assignments(page)
        page.click("#fetched_assignments_list button:text-is('Submit')")
        page.wait_for_selector("#submitted_assignments_list .list_item")
    course("nbgrader", "collect", "04_iou")
    table = course("labcli.cli", "grade", "04_iou", "--workers", "1")
    assert all(name in table for name in ANSWERS), table
    course("nbgrader", "generate_feedback", "04_iou")
    course("nbgrader", "release_feedback", "04_iou")
    for name, page in pages.items():
        page.reload()
        assignments(page)
        page.click("button:text-is('Fetch Feedback')")
        page.wait_for_selector("#submitted_assignments_list :text('view feedback')")
        (report,) = (folder / "users" / name / "04_iou/feedback").rglob("*.html")
        assert "04_iou" in report.read_text()
        page.screenshot(path=tmp_path / f"{name}_feedback.png")


# ------------------------------------------------------------------------------------------- a hostile student

HONEST, HOSTILE = "games", "daemon"  # accounts that every Debian has


def as_account(account: str, *command: str, **variables: str) -> subprocess.CompletedProcess:
    """Run a command as an account of this machine, in its folder of the exchange's test."""
    home = Path(variables["HOME"])
    environment = {
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.defpath}",
        "PYTHONPATH": str(ROOT),
        **variables,
    }
    how = {"cwd": home, "env": environment, "user": account, "extra_groups": [], "capture_output": True, "text": True}
    return subprocess.run(command, **how)


@pytest.fixture
def place():
    """A folder that every account can reach, as none of pytest's is."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        yield Path(folder)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs root, to be two accounts")
def test_a_hostile_account_hands_in_reads_and_renames_nothing_of_anothers(place):
    try:
        can_read = as_account(HOSTILE, sys.executable, "-c", "import nbgrader", HOME=str(place)).returncode == 0
    except PermissionError:  # an interpreter in root's home
        can_read = False
    if not can_read:
        pytest.skip("other accounts cannot read this environment")
    exchange, course, kit = place / "exchange", place / "course", place / "kit"
    for folder, mode in ((exchange, 0o1777), (exchange / "labkit", 0o755), (exchange / "labkit/inbound", 0o3733)):
        folder.mkdir()
        folder.chmod(mode)
    shutil.copytree(ROOT / "labs/04_iou", course / "labs/04_iou")
    shutil.copytree(ROOT / "solutions/04_iou", course / "solutions/04_iou")
    course.chmod(0o700)
    settings = {"JUPYTER_CONFIG_PATH": str(ROOT / "deploy/jupyter"), "LABKIT_EXCHANGE": str(exchange)}
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"  # nbgrader calls alembic
    environment = os.environ | settings | {"PYTHONPATH": str(ROOT), "PATH": path}

    def instructor(*words: str) -> str:
        command = [sys.executable, "-m", "nbgrader", *words]
        done = subprocess.run(command, cwd=course, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stderr

    shutil.copy(ROOT / "nbgrader_config.py", course)
    instructor("release_assignment", "04_iou")
    for account in (HONEST, HOSTILE):
        home = place / account
        shutil.copytree(ROOT / "labs/04_iou", home / "04_iou")
        (home / "04_iou/04_iou.ipynb").write_text(f"of {account}")
        for path in (home, *home.rglob("*")):
            shutil.chown(path, account)
    submit = (sys.executable, "-m", "nbgrader", "submit", "04_iou")
    # Both say that they are the honest one, as anybody can; the hostile one later, so that it would be the newest.
    for account in (HONEST, HOSTILE):
        done = as_account(account, *submit, HOME=str(place / account), JUPYTERHUB_USER=HONEST, **settings)
        assert done.returncode == 0, done.stderr
    said = instructor("collect", "04_iou")
    assert (course / f"submitted/{HONEST}/04_iou/04_iou.ipynb").read_text() == f"of {HONEST}"
    assert f"claims to be from '{HONEST}' and belongs to '{HOSTILE}'" in said
    # docs/hub.md closes the repository as it closes solutions; a name known to the hostile one opens and moves nothing.
    (kit / ".git").mkdir(parents=True)
    (kit / ".git/HEAD").write_text("ref: refs/heads/main")
    (line,) = (line for line in (ROOT / "docs/hub.md").read_text().splitlines() if "chmod -R go-rwx" in line)
    (kit / "solutions").mkdir()
    (kit / "tests").mkdir()
    (kit / "labcourse/exam").mkdir(parents=True)
    subprocess.run(line.partition("#")[0].split(), cwd=kit, check=True)
    (own,) = [path for path in (exchange / "labkit/inbound").iterdir() if path.owner() == HONEST]
    tries = {
        "read the repository": f"open({str(kit / '.git/HEAD')!r}).read()",
        "list what others handed in": f"os.listdir({str(exchange / 'labkit/inbound')!r})",
        "rename another's": f"os.rename({str(own)!r}, {str(own)!r} + 'x')",
        "rename the exchange": f"os.rename({str(exchange / 'labkit')!r}, {str(exchange / 'mine')!r})",
        "read the course": f"os.listdir({str(course)!r})",
    }
    for what, line in tries.items():
        done = as_account(HOSTILE, sys.executable, "-c", f"import os; {line}", HOME=str(place / HOSTILE))
        assert "Error" in done.stderr, what
