"""The notebook that this kernel runs: as Google Colab holds it, or its file where the editor or the folder tells."""

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path

SECONDS = 30.0  # that Colab's page may take to send its notebook


def live_notebook() -> dict | None:
    """The notebook as it stands on Colab's page, saved or not; None if this is no kernel of Colab."""
    if "google.colab" not in sys.modules:
        return None
    from google.colab import _message

    reply = _message.blocking_request("get_ipynb", timeout_sec=SECONDS)
    return reply["ipynb"] if reply else None


def running_file(shell: object | None, is_lab: Callable[[dict], bool]) -> Path:
    """The file of the notebook that runs: JupyterLab and VS Code name it, else it is the folder's only lab.

    shell: IPython's. is_lab: tells whether a notebook is one. Raises ValueError, and says how to name it, if none or
    several could be meant.
    """
    for named in (os.environ.get("JPY_SESSION_NAME"), getattr(shell, "user_ns", {}).get("__vsc_ipynb_file__")):
        if named and named.endswith(".ipynb") and Path(named).is_file():
            return Path(named)
    found = [path for path in sorted(Path.cwd().glob("*.ipynb")) if is_lab(read_saved(path))]
    if len(found) == 1:
        return found[0]
    there = f"{len(found)} labs, {', '.join(path.name for path in found)}" if found else "no lab"
    example = found[0].name if found else "NAME.ipynb"
    raise ValueError(f"path: this folder holds {there}; say which, such as check_file({example!r})")


def read_saved(path: Path) -> dict:
    """A notebook's JSON; {} if a file is none."""
    try:
        notebook = json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError):
        return {}
    return notebook if isinstance(notebook, dict) else {}
