"""Run in the environment of Colab's versions: each notebook in an empty folder, with a mock of google.colab.

The first cell of a notebook installs the wheel. A released lab must run to its end, a solution must tick every answer,
and its first tick come within BUDGET_S of the first import, with nothing compiled before. On a machine that does other
work the seconds of the processor count, if they are fewer.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from importlib import metadata
from pathlib import Path

import nbformat
import psutil
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

BUDGET_S = 90.0
WORK = Path(__file__).parent
STARTUP = "import sys\nsys.path.insert(0, {here!r})\nimport google.colab\nsys.path.remove({here!r})\n"


def main() -> int:
    subprocess.run([sys.executable, "-m", "pip", "uninstall", "-q", "-y", "labkit-manipulation"], check=True)
    before, wrong = installed(), []
    for path in sorted(WORK.rglob("*.ipynb")):
        name, start = path.relative_to(WORK).as_posix(), time.monotonic()
        problem, tick = run(path)
        ticked = "" if tick is None else f", first tick after {tick[0]:.0f} s ({tick[1]:.0f} s of the processor)"
        state = "FAILED" if problem else "ok"
        print(f"{state:<7} {name}  {time.monotonic() - start:.0f} s{ticked}  {problem}", flush=True)
        wrong += [name] if problem else []
    after = installed()
    replaced = {name: (version, after.get(name)) for name, version in before.items() if after.get(name) != version}
    print(f"{len(after) - len(before)} packages came with the wheel; of Colab's it replaced {replaced or 'none'}")
    return 1 if wrong or replaced else 0


def installed() -> dict[str, str]:
    """Versions of the packages of this environment."""
    return {distribution.name: distribution.version for distribution in metadata.distributions()}


def run(path: Path) -> tuple[str, tuple[float, float] | None]:
    """Run a notebook in a kernel of its own, in an empty folder; what is wrong, and when the first tick came."""
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        profile = Path(folder) / "ipython" / "profile_default" / "startup"
        profile.mkdir(parents=True)
        (profile / "00-colab.py").write_text(STARTUP.format(here=str(WORK)))
        empty = Path(folder) / "content"
        empty.mkdir()
        os.environ |= {"IPYTHONDIR": str(Path(folder) / "ipython"), "NUMBA_CACHE_DIR": str(Path(folder) / "numba")}
        os.environ |= {"STAND_IN_NOTEBOOK": str(path), "PYDEVD_DISABLE_FILE_VALIDATION": "1"}
        client = NotebookClient(
            notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(empty)}}
        )
        try:
            with client.setup_kernel():
                tick = run_cells(client, notebook)
        except CellExecutionError as error:
            return str(error).strip().splitlines()[-1][:200], None
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    return judged(path, notebook, tick), tick


def run_cells(client: NotebookClient, notebook) -> tuple[float, float] | None:
    """Run the cells; seconds, and those of the processor, from the first import of the kit to the first tick."""
    kernel, since, tick = psutil.Process(client.km.provisioner.pid), None, None
    for index, cell in enumerate(notebook.cells):
        if since is None and re.search(r"^(import|from) (?!sys\b)", cell.source, re.MULTILINE):
            since = time.monotonic(), used(kernel)
        client.execute_cell(cell, index)
        if tick is None and since and "\u2714" in said(cell):
            tick = time.monotonic() - since[0], used(kernel) - since[1]
    return tick


def used(process: psutil.Process) -> float:
    """Seconds of the processor that a process and those that it waited for have used."""
    times = process.cpu_times()
    return times.user + times.system + times.children_user + times.children_system


def said(cell) -> str:
    """The text that a cell shows."""
    shown = [output.get("text") or output.get("data", {}).get("text/plain", "") for output in cell.get("outputs", [])]
    return "\n".join(shown)


def judged(path: Path, notebook, tick: tuple[float, float] | None) -> str:
    """What is wrong with a notebook that ran to its end."""
    if path.parts[-3] != "solutions":
        return ""
    text = "\n".join(map(said, notebook.cells))
    counts = re.findall(r"as it is now: (\d+) of (\d+) answers are right", text)
    if counts and counts[-1][0] != counts[-1][1]:
        return f"{counts[-1][0]} of {counts[-1][1]} answers are right"
    if tick is not None and min(tick) > BUDGET_S:
        return f"the first tick took over {BUDGET_S:.0f} s"
    return "" if counts or "none of them is empty" in text else "its check did not read the notebook"


if __name__ == "__main__":
    sys.exit(main())
