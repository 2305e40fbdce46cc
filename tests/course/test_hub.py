"""A class of three on the hub of `make hub`: a link, fetch, a tick, submit, collect, grade, feedback, in Chromium.

It runs in the environment of `make hub` (`make test-hub`); in any other there is no JupyterHub, and it skips.
"""

import os
import shutil
import socket
import subprocess
import sys
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
    table = course("labkit.apps.cli", "grade", "04_iou", "--workers", "1")
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
