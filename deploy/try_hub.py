"""`make hub`: the class's hub for trying, on this machine alone: any name, no password, all it keeps in out/hub.

Servers are processes of whoever started it, so that nothing separates users and no limit holds.
"""

import os
from pathlib import Path

load_subconfig(str(Path(__file__).resolve().with_name("jupyterhub_config.py")))  # JupyterHub defines it
c = get_config()

HERE = Path(os.environ.get("LABKIT_HUB", "out/hub")).resolve()
(HERE / "exchange").mkdir(parents=True, exist_ok=True)
(HERE / "exchange").chmod(0o1777)  # nbgrader asks for 777; sticky, so that only its owner renames a folder

c.JupyterHub.authenticator_class = "dummy"
c.Authenticator.allow_all = True
c.Authenticator.allowed_groups = set()
c.JupyterHub.spawner_class = "simple"
c.SimpleLocalProcessSpawner.home_dir_template = f"{HERE}/users/{{username}}"
c.Spawner.environment["LABKIT_EXCHANGE"] = str(HERE / "exchange")
if os.geteuid() == 0:
    c.Spawner.args.append("--allow-root")
c.Spawner.http_timeout = c.Spawner.start_timeout = 180
c.JupyterHub.db_url = f"sqlite:///{HERE}/jupyterhub.sqlite"
c.JupyterHub.cookie_secret_file = str(HERE / "cookie_secret")
c.ConfigurableHTTPProxy.pid_file = str(HERE / "proxy.pid")
