"""A JupyterHub for a class on one Linux machine: one installation that students cannot write to, and limits for each.

Root's systemd runs it from this checkout (docs/hub.md). `try_hub.py` replaces what needs root.
"""

import os
import sys
from pathlib import Path

KIT = Path(__file__).resolve().parents[1]
BIN = Path(sys.executable).parent
SETTINGS = KIT / "labcourse/jupyter"

c = get_config()  # JupyterHub defines it

c.JupyterHub.bind_url = "http://127.0.0.1:8000"  # your web server with its certificate stands before it
c.ConfigurableHTTPProxy.command = [str(BIN / "configurable-http-proxy")]
c.PAMAuthenticator.admin_groups = {"sudo"}
c.Authenticator.allowed_groups = {"students"}  # accounts of this machine; or another authenticator of JupyterHub's

# A student's server takes 150 MB, a kernel 200 to 500 MB; above the limit the student's own kernel dies.
c.JupyterHub.spawner_class = "systemdspawner.SystemdSpawner"
c.Spawner.mem_limit = "1500M"
c.Spawner.cpu_limit = 2.0
c.SystemdSpawner.isolate_tmp = True
c.SystemdSpawner.disable_user_sudo = True
c.JupyterHub.active_server_limit = 120
c.JupyterHub.services = [
    {"name": "idle", "command": [sys.executable, "-m", "jupyterhub_idle_culler", "--timeout=3600"]},
]
idle_may = ["list:users", "read:users:activity", "read:servers", "delete:servers"]
c.JupyterHub.load_roles = [{"name": "idle", "scopes": idle_may, "services": ["idle"]}]

c.Spawner.cmd = [str(BIN / "jupyterhub-singleuser")]
c.Spawner.default_url = "/lab"
c.Spawner.environment = {
    "PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}",
    "JUPYTER_PATH": str(SETTINGS),
    "JUPYTER_CONFIG_PATH": f"{SETTINGS}{os.pathsep}{Path(__file__).resolve().parent / 'jupyter'}",
    "LABKIT_EXCHANGE": "/srv/exchange",
    # Everybody's kernel would start a thread for each core, and they would wait for one another.
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
}
# A kernel that nobody uses for half an hour ends, its notebook stays: memory goes to who works.
c.Spawner.args = ["--MappingKernelManager.cull_idle_timeout=1800", "--MappingKernelManager.cull_connected=True"]
