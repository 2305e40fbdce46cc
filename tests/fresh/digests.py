"""What this machine makes of fixed seeds: a digest each of data, trained weights, scores and grades.

`make everywhere` runs it on each Debian, and compares. The clock is nowhere in them.
"""

import hashlib
import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

import torch

ROOT = Path(__file__).resolve().parents[2]


def run(*arguments) -> None:
    """Run a Python command of the kit; what it prints goes to stderr."""
    subprocess.run([sys.executable, "-m", *map(str, arguments)], cwd=ROOT, stdout=sys.stderr, check=True)


def say(name: str, parts: Iterable[bytes]) -> None:
    """Print one digest."""
    print(f"digest {name:<24}{hashlib.sha256(b'|'.join(parts)).hexdigest()[:16]}", flush=True)


def files(folder: Path, pattern: str = "*") -> Iterable[bytes]:
    """Contents of a folder's files in the order of their names."""
    return [path.read_bytes() for path in sorted(folder.rglob(pattern)) if path.is_file()]


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        data, runs, course = (Path(folder) / name for name in ("data", "runs", "course"))
        run("data_gen", data, "--scenes", 8, "--config", "hard", "--size", "160x120")
        say("data", files(data))
        for model in ("smallsegnet", "unet_rgbd"):
            run("labcli.cli", "train", data, "--model", model, "--epochs", 2, "--device", "cpu", "--out", runs)
            weights = torch.load(runs / f"{model}.pt", weights_only=True)["state_dict"]
            say(f"weights {model}", [tensor.numpy().tobytes() for tensor in weights.values()])
        for model in ("unet", "unet_rgbd"):
            run("labcli.cli", "evaluate", "--model", model, "--scenes", 3, "--json", runs / "scores.json")
            scores = json.loads((runs / "scores.json").read_bytes())
            del scores["seconds"]
            say(f"scores {model}", [json.dumps(scores).encode()])
        shutil.copytree(ROOT / "labs" / "04_iou", course / "labs" / "04_iou")
        submitted = ROOT / "tests" / "data" / "submitted"
        grading = ("grade", "04_iou", "--seed", "everywhere", "--course", course, "--submissions", submitted)
        subprocess.run([sys.executable, "-m", "labcli.cli", *map(str, grading)], cwd=ROOT, stdout=sys.stderr)
        say("grades", files(course / "grades", "grades.csv") + files(course / "grades", "results.json"))


if __name__ == "__main__":
    main()
