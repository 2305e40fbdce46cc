"""JupyterLab as a server on a free port, at nobody's home, for tests that look at its pages."""

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
    environment |= dict.fromkeys(("JUPYTER_PATH", "JUPYTER_CONFIG_PATH"), str(ROOT / "labkit/course/jupyter"))
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
