"""Runs the benchmarks of this folder and writes their tables on one page: `python -m bench.run [NAME ...]`.

A benchmark is a module bench_<name>.py whose docstring says what is compared, and whose main() returns a
Markdown table. Each runs in a process of its own, one after the other, so that none disturbs another's threads or
memory, and waits until the machine is quiet; the page says where that never came. When only some are named, the page
keeps the sections of the others.
"""

import argparse
import importlib
import multiprocessing
import os
import platform
import re
import sys
import time
import traceback
from concurrent.futures import ProcessPoolExecutor
from importlib import metadata
from pathlib import Path

HERE = Path(__file__).resolve().parent
PAGE = HERE.parent / "BENCHMARKS.md"
INTRODUCTION = """# Benchmarks

`make bench` writes this page. What stands in one table was measured side by side in one run; times are medians, and on
another machine they differ, while their ratios hold. Each section says when it was measured; those that do not, on
2026-11-21.
"""
SECTION = "<!-- bench: {} -->"
QUIET_LOAD, PATIENCE_S = 0.5, 900.0
# Train six networks in 90 minutes, five in 30; draw 140 photographs; follow the rays of 224.
ONLY_BY_NAME = {"depth", "ablations", "phone", "mirrors"}
NEEDS = {"photographs": HERE.parents[1] / "shared" / "real"}  # folders that are not everywhere
# Flags of /proc/cpuinfo that decide how fast networks and kernels run, in words.
CPU_FLAGS = {"avx2": "AVX2", "avx512f": "AVX-512", "avx512_bf16": "AVX-512 bf16", "amx_bf16": "AMX bf16"}
VERSIONS = ("numpy", "scipy", "numba", "torch", "opencv-python-headless", "pybullet")
PEERS = ("scikit-learn", "torchmetrics", "open3d", "pymaxflow", "gco-wrapper", "pydensecrf2", "onnxruntime", "nbgrader")


def main() -> int:
    """Run the benchmarks that are named and write the page; returns 1 if one of them failed."""
    names = sorted(path.stem.removeprefix("bench_") for path in HERE.glob("bench_*.py"))
    missing = f"default: all but {', '.join(ONLY_BY_NAME)}"
    parser = argparse.ArgumentParser(prog="python -m bench.run", description="Measure, and write the page.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one or more of: {', '.join(names)}; {missing}")
    parser.add_argument("--page", type=Path, default=PAGE, help="the page to write (default: %(default)s)")
    options = parser.parse_args()
    unknown = sorted(set(options.names) - set(names))
    if unknown:
        parser.error(f"no benchmark {', '.join(unknown)}; there are: {', '.join(names)}")

    old = read_sections(options.page)
    sections = {name: old[name] for name in names if name in old}
    failed = []
    for name in options.names or sorted(set(names) - ONLY_BY_NAME):
        if not NEEDS.get(name, HERE).is_dir():
            print(f"bench: {name} needs {NEEDS[name]}: skipped, the page keeps what it had", file=sys.stderr)
            continue
        print(f"bench: {name}", file=sys.stderr, flush=True)
        try:
            sections[name] = measure(name)
        except Exception:
            traceback.print_exc()
            failed.append(name)
            continue
        print(sections[name], flush=True)
        write_page(options.page, sections)
    if failed:
        print(f"bench: failed: {', '.join(failed)}; the page keeps what it had of them", file=sys.stderr)
    return 1 if failed else 0


def measure(name: str) -> str:
    """Run one benchmark in a process of its own and return its section of the page."""
    load, start = wait_until_quiet(), time.perf_counter()
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        description, table = pool.submit(run, name).result()
    seconds = time.perf_counter() - start
    title, _, rest = description.partition("\n")
    busy = "" if load < QUIET_LOAD else f" after {PATIENCE_S / 60:.0f} minutes of waiting: the machine was never quiet"
    when = f"Measured on {time.strftime('%Y-%m-%d')} in {seconds:.0f} s"
    footer = f"<sub>{when} on {machine()}; load before it {load:.1f}{busy}.</sub>"
    return "\n\n".join(part for part in (f"## {title.rstrip('.')}", rest.strip(), table.strip(), footer) if part)


def wait_until_quiet() -> float:
    """Wait until nothing else runs on this machine, for a limited time; returns its load."""
    end = time.monotonic() + PATIENCE_S
    while (load := os.getloadavg()[0]) >= QUIET_LOAD and time.monotonic() < end:
        time.sleep(2.0)
    return load


def run(name: str) -> tuple[str, str]:
    """Import a benchmark and run it: its docstring and its table."""
    module = importlib.import_module(f"bench.bench_{name}")
    return module.__doc__.strip(), module.main()


def machine() -> str:
    """Describe the machine by what decides speed, and by nothing that names it."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    info = Path("/proc/cpuinfo")
    flags = set(re.findall(r"\w+", info.read_text())) if info.is_file() else set()
    words = [word for flag, word in CPU_FLAGS.items() if flag in flags]
    return f"{cores} {platform.machine()} cores" + (f" with {', '.join(words)}" if words else "")


def versions() -> str:
    """List the versions of what is measured and of the peers that are installed."""
    found = [f"Python {platform.python_version()}"]
    for package in VERSIONS + PEERS:
        try:
            found.append(f"{package} {metadata.version(package)}")
        except metadata.PackageNotFoundError:
            continue
    return ", ".join(found)


def read_sections(page: Path) -> dict[str, str]:
    """Take a page apart into its sections by name; an absent page has none."""
    if not page.is_file():
        return {}
    parts = re.split(r"^<!-- bench: (\w+) -->\n", page.read_text(), flags=re.MULTILINE)
    return {name: text.strip() for name, text in zip(parts[1::2], parts[2::2], strict=True)}


def write_page(page: Path, sections: dict[str, str]) -> None:
    """Write the page anew, its sections in the order of their names."""
    parts = [INTRODUCTION, f"Versions: {versions()}.\n"]
    parts += [f"{SECTION.format(name)}\n{sections[name]}\n" for name in sorted(sections)]
    unfinished = page.with_suffix(".tmp")
    unfinished.write_text("\n".join(parts))
    os.replace(unfinished, page)


if __name__ == "__main__":
    sys.exit(main())
