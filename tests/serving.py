"""JupyterLab as a server on a free port, at nobody's home, and what tests do on its pages."""

import os
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic, sleep

TOKEN = "a-token-of-this-test"
ROOT = Path(__file__).parent.parent


@contextmanager
def jupyterlab(folder: Path, home: Path) -> Iterator[str]:
    """Serve a folder as `make lab` does, with settings and all that Jupyter keeps in `home`; gives the URL."""
    (home / "settings/@jupyterlab/notebook-extension").mkdir(parents=True)  # all cells are there, also unseen ones
    settings = home / "settings/@jupyterlab/notebook-extension/tracker.jupyterlab-settings"
    settings.write_text('{"windowingMode": "none"}')
    places = {"CONFIG": "config", "DATA": "data", "RUNTIME": "runtime"}
    environment = {key: value for key, value in os.environ.items() if key != "LABKIT_STRICT"}
    environment |= {f"JUPYTER_{name}_DIR": str(home / place) for name, place in places.items()}
    environment |= {"IPYTHONDIR": str(home / "ipython"), "JUPYTERLAB_WORKSPACES_DIR": str(home / "workspaces")}
    environment["JUPYTERLAB_SETTINGS_DIR"] = str(home / "settings")
    environment |= dict.fromkeys(("JUPYTER_PATH", "JUPYTER_CONFIG_PATH"), str(ROOT / "labcourse/jupyter"))
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", "--ip=127.0.0.1", f"--port={port}"]
    command += ["--ServerApp.port_retries=0", f"--IdentityProvider.token={TOKEN}", f"--ServerApp.root_dir={folder}"]
    with (home / "log").open("w") as log:
        server = subprocess.Popen(command, cwd=folder, env=environment, stdout=log, stderr=subprocess.STDOUT)
        url = f"http://127.0.0.1:{port}"
        try:
            wait_for(url, server, home / "log")
            yield url
        finally:
            server.terminate()  # it ends its kernels
            try:
                server.wait(20)
            except subprocess.TimeoutExpired:
                server.kill()
                server.wait()


def wait_for(url: str, server: subprocess.Popen, log: Path) -> None:
    """Wait until the server answers."""
    end = monotonic() + 200
    while True:
        try:
            urllib.request.urlopen(f"{url}/api?token={TOKEN}", timeout=5).close()
            return
        except (urllib.error.URLError, ConnectionError, TimeoutError):
            assert server.poll() is None and monotonic() < end, log.read_text()[-2000:]
            sleep(0.2)


def open_page(page, url: str) -> None:
    """Open a notebook without the side bar, and wait for its kernel."""
    page.goto(url)
    page.wait_for_selector(".jp-Notebook .jp-CodeCell")
    page.wait_for_selector("#jp-main-statusbar :text('| Idle')")  # what is run earlier JupyterLab forgets
    page.keyboard.press("Control+b")  # the side bar
    page.wait_for_timeout(500)


def menu(page, *entries: str) -> None:
    """Choose an entry of JupyterLab's menus."""
    page.click(f".lm-MenuBar-itemLabel:text-is('{entries[0]}')")
    page.click(f".lm-Menu-itemLabel:text-is('{entries[1]}')")


def cell_with(page, text: str):
    """The code cell whose own text (not its output) holds a text."""
    return page.locator(".jp-CodeCell").filter(has=page.locator(".jp-InputArea .cm-content", has_text=text)).first


def wait_until_idle(page) -> None:
    """Wait until no cell waits to be run."""
    page.wait_for_function(
        "() => ![...document.querySelectorAll('.jp-InputPrompt')].some(prompt => prompt.textContent.includes('*'))"
        " && document.querySelector('.jp-Notebook-ExecutionIndicator').dataset.status === 'idle'"
    )
