"""What `labkit doctor` looks at: is everything here that the kit needs, and if not, what mends it."""

import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import labkit
from labgrader.packages import distribution_of, requirements

KIT = distribution_of("labkit")
PACKAGE = Path(labkit.__file__).parent
CLONE = PACKAGE.with_name("constraints.txt")  # not there if labkit was installed from a wheel
NEEDED_GB = 2.0  # free disk for a data set to train on, checkpoints and pictures
NEEDED_RENDER_MM = 0.1

# Who needs the packages of an extra; `make bench`, `hub`, `site` and `test-models` have environments of their own.
USERS = {
    "course": "`make lab` needs",
    "instructor": "`labkit release` and `labkit grade` need",
    "stacks": "`labkit export` and the engines of topic 09 need",
    "cluster": "`--dask` needs",
    "exr": "depth as OpenEXR needs",
    "heic": "photographs of an iPhone, HEIC, need",
    "test": "`make test` needs",
}

OK, NOTE, WRONG = "ok", "note", "WRONG"


@dataclass(frozen=True)
class Finding:
    """One line of the report. state: OK, NOTE (good to know, nothing needs mending) or WRONG; mend: what to do then."""

    name: str
    state: str
    found: str
    mend: str = ""


def examine(folder=".") -> list[Finding]:
    """Look at everything and return what was found; `folder` is where data and pictures will be written."""
    checks: list[tuple[str, Callable[[], Iterable[Finding]]]] = [
        ("Python", check_python),
        ("packages", check_packages),
        ("PyBullet", check_pybullet),
        ("render", check_render),
        ("disk", lambda: check_disk(folder)),
        ("cores", check_cores),
        ("GPU", check_gpu),
        ("sandbox", check_sandbox),
    ]
    return [finding for name, check in checks for finding in run_check(name, check)]


def run_check(name: str, check: Callable[[], Iterable[Finding]]) -> list[Finding]:
    """Run one check; one that cannot even run is WRONG, and the others still have their say.

    >>> run_check("GPU", lambda: 1 / 0)
    [Finding(name='GPU', state='WRONG', found='ZeroDivisionError: division by zero', mend='see the packages above')]
    """
    try:
        return list(check())
    except Exception as error:  # whatever is broken on this machine: finding it is what this is for
        return [Finding(name, WRONG, f"{type(error).__name__}: {error}", "see the packages above")]


def check_python() -> list[Finding]:
    """The interpreter. Its version was checked when labkit was imported; here, whether the environment is its own."""
    version = platform.python_version()
    if sys.prefix != sys.base_prefix:
        return [Finding("Python", OK, f"{version}, in a virtual environment")]
    mend = "python -m venv .venv, and install labkit there"
    return [Finding("Python", NOTE, f"{version}, shared with other projects, which may change its packages", mend)]


def check_packages() -> Iterator[Finding]:
    """Everything that labkit requires, directly or not; then each extra; then whether the versions fit together."""
    runtime = requirements(KIT)
    yield complete("packages", runtime)
    for extra in USERS:
        of_extra = requirements(KIT, extra)
        yield complete(f"[{extra}]", {name: of_extra[name] for name in of_extra.keys() - runtime.keys()}, extra)
    done = subprocess.run([sys.executable, "-P", "-m", "pip", "check"], capture_output=True, text=True)
    found, *more = (done.stdout or done.stderr).strip().splitlines()  # a finding a line
    yield Finding("versions", NOTE if done.returncode else OK, found + f", and {len(more)} more" * bool(more))


def complete(title: str, installed: dict[str, str | None], extra: str = "") -> Finding:
    """Say which packages are missing. Missing ones of an extra are only a note."""
    missing = sorted(name for name, version in installed.items() if version is None)
    if not missing:
        return Finding(title, OK, f"{len(installed)}, all there")
    target, purpose = (f"'.[{extra}]'", f" (only {USERS[extra]} them)") if extra else (".", "")
    mend = f"python -m pip install -c constraints.txt -e {target}"
    if not CLONE.exists():
        mend = f"python -m pip install '{KIT}{f'[{extra}]' if extra else ''}'"
    return Finding(title, NOTE if extra else WRONG, f"missing: {', '.join(missing)}{purpose}", mend)


def check_pybullet() -> list[Finding]:
    """PyBullet comes as one of two distributions; one built without numpy gives the same images as tuples."""
    from labkit.sim.client import pybullet  # imported only under labkit.sim

    found = [f"{name} {version}" for name, version in requirements(KIT).items() if name.startswith("pybullet")]
    return [Finding("PyBullet", OK, f"{found[0]}, {'with' if pybullet.isNumpyEnabled() else 'without'} numpy")]


def check_render() -> list[Finding]:
    """Render a table, turn the depth image back into points: they must lie on the table's known plane."""
    error_mm = 1000.0 * table_error()
    found = f"the table's points lie within {error_mm:.3f} mm of its plane"
    if error_mm <= NEEDED_RENDER_MM:
        return [Finding("render", OK, found)]
    return [Finding("render", WRONG, f"{found}, expected {NEEDED_RENDER_MM} mm", "install the pinned PyBullet")]


def table_error() -> float:
    """Largest distance in metres of a rendered table's points from the plane where the scene puts its top."""
    import numpy as np

    from labkit.geometry import back_project_to_base
    from labkit.sim.spec import Camera, SceneSpec
    from labkit.sim.world import World

    # From so near, the tilted and rolled camera sees nothing but the table's top.
    spec = SceneSpec(objects=(), camera=Camera.looking_at((0.55, 0.0, 0.0), 0.4, 0.3, 1.0, roll=0.2), robot=False)
    with World(spec) as world:
        frame = world.render((320, 240))
    P_base = back_project_to_base(frame.depth, frame.K, frame.T_base_cam)
    return float(np.abs(P_base[..., 2] - spec.table.z).max())


def check_disk(folder=".") -> list[Finding]:
    """Free disk where data and pictures go."""
    free = shutil.disk_usage(folder).free / 1e9
    state = OK if free >= NEEDED_GB else WRONG
    return [Finding("disk", state, f"{free:.1f} GB free", f"free {NEEDED_GB:.0f} GB" if state == WRONG else "")]


def check_cores() -> list[Finding]:
    """Processor cores that this process may use."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return [Finding("cores", OK if cores >= 2 else NOTE, f"{cores}, {platform.machine()}")]


def check_gpu() -> list[Finding]:
    """A GPU that this build of PyTorch can use; nothing needs one."""
    import torch

    if torch.cuda.is_available():
        return [Finding("GPU", OK, f"{torch.cuda.get_device_name()}, PyTorch {torch.__version__}")]
    return [Finding("GPU", NOTE, f"none for PyTorch {torch.__version__}: networks run on the CPU")]


def check_sandbox() -> list[Finding]:
    """The sandbox that `labkit grade` runs submissions in; students need none."""
    from labgrader.sandbox import bwrap

    try:
        path = bwrap.executable()
    except bwrap.NoSandbox as missing:
        return [Finding("sandbox", NOTE, f"none for `labkit grade`: {missing.cause}", missing.mend)]
    version = ".".join(map(str, bwrap.version_of(path)))
    return [Finding("sandbox", OK, f"bubblewrap {version}, {path}")]


def warm_up() -> Finding:
    """Compile every kernel for what commands and labs pass to it, by a small run of each; say where that is kept."""
    import numpy as np

    from data_gen import sample_scene
    from labkit.crf import PottsCRF, solve
    from labkit.learning.network import load_model, weights_path
    from labkit.pipeline import Pipeline
    from labkit.sim.world import World
    from labkit.support import compiled

    with World(sample_scene(0, "test")) as world:
        frame = world.render((160, 120))
    Pipeline(load_model(weights_path("unet_rgbd"))).run(frame)
    Pipeline().locate(frame, frame.labels)  # whatever the network saw of so small a picture, here are targets
    rgb, psi = np.zeros((48, 64, 3), np.uint8), np.full((48, 64, 4), (0.0, 9.0, 9.0, 9.0))
    psi[20:28, 30:38] = np.random.default_rng(0).random((8, 8, 4))  # the rest is certain, and "persistency" uses both
    for y in (rgb[..., 0].copy(), np.zeros((48, 64), np.int64)):
        PottsCRF.from_image(psi, rgb, lam=0.3, sigma_I=50.0).energy(y)
    for method in ("icm", "mean_field", "expansion", "trws", "persistency", "min_cut"):
        classes = 2 if method == "min_cut" else 4
        solve(PottsCRF.from_image(psi[..., :classes].copy(), rgb, lam=0.3, sigma_I=50.0), method)
    return where_kept(compiled.KERNELS)


def where_kept(kernels) -> Finding:
    """Say where kernels are kept that were compiled, and whether all who use this installation find them there."""
    place = Path(os.path.commonpath([kernel.stats.cache_path for kernel in kernels]))
    found = (
        f"{sum(len(kernel.signatures) for kernel in kernels)} compiled, for processors of this kind; kept in {place}"
    )
    if place.is_relative_to(PACKAGE):
        return Finding("kernels", OK, f"{found}, where all who use this installation find them")
    return Finding("kernels", NOTE, found, f"run it as a user who may write to {PACKAGE}, then all others find them")


def report(findings: list[Finding]) -> str:
    """Lay the findings out as a table, each with its mend on the line below.

    >>> print(report([Finding("Python", OK, "3.11.7"), Finding("disk", WRONG, "0.1 GB free", "free 2 GB")]))
    ok     Python  3.11.7
    WRONG  disk    0.1 GB free
                   mend: free 2 GB
    """
    width = max(len(finding.name) for finding in findings)
    lines = []
    for finding in findings:
        lines.append(f"{finding.state:<5}  {finding.name:<{width}}  {finding.found}")
        if finding.mend:
            lines.append(" " * (width + 9) + f"mend: {finding.mend}")
    return "\n".join(lines)


def all_well(findings: list[Finding]) -> bool:
    """Whether nothing that the kit needs is missing."""
    return all(finding.state != WRONG for finding in findings)
