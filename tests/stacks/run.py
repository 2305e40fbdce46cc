"""The kit against other stacks: C++ and Java with Debian's OpenCV, and Octave, on the same network and frames.

`make stacks` runs it: it builds the programs of this folder where their tools are installed, says what to install where
they are not, and compares what comes out. Exit status 1 if a stack disagrees with the kit.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from data_gen import render, sample_scene
from labkit.frame import RGBDFrame, read_image
from labkit.geometry import backproject_to_base
from labkit.labels import SURFACE, TARGET
from labkit.network import load_model, weights_path
from labkit.stacks.engines import export, open_engine, segment_like_cpp
from labkit.stacks.matlab import cloud_of_mask, montage, semanticseg
from labkit.stacks.threshold import fit_hsv, hsv_mask

HERE = Path(__file__).parent
BLOB = (320, 240)  # the text's C++ listing: any image is squeezed to this
HEADERS = Path("/usr/include/opencv4")
JAR = Path("/usr/share/java/opencv.jar")
LIBRARIES = ("dnn", "imgcodecs", "imgproc", "core")


@dataclass(frozen=True)
class Finding:
    """One comparison: which stack, what of it, how alike it is to the kit's, and whether that is good enough."""

    stack: str
    what: str
    value: str
    good: bool


@dataclass(frozen=True)
class Stack:
    """What a stack needs, how to get it on Debian, and the function (folder, frame, network file) -> findings."""

    name: str
    needs: Callable[[], bool]
    packages: str
    build: Callable[[Path], None]
    compare: Callable[[Path, RGBDFrame, Path], list[Finding]]


def run(*command) -> None:
    """Run a program, quietly; raise with what it said if it fails."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{command[0]} ended with status {done.returncode}: {(done.stderr or done.stdout)[-800:]}")


def equal(stack: str, what: str, found: np.ndarray, expected: np.ndarray, least: float = 0.9999) -> Finding:
    """Compare labels or masks by the share of equal pixels."""
    share = float(np.mean(found == expected)) if found.shape == expected.shape else 0.0
    return Finding(stack, what, f"{share:.4%} equal", share >= least)


def close(stack: str, what: str, found: np.ndarray, expected: np.ndarray, tolerance: float, unit: str) -> Finding:
    """Compare numbers by their largest difference."""
    apart = float(np.abs(found - expected).max(initial=0.0)) if found.shape == expected.shape else np.inf
    return Finding(stack, what, f"{found.size} numbers within {apart:.0e}{unit}", apart <= tolerance)


# ------------------------------------------------------------------------------------------------- C++


def build_cpp(folder: Path) -> None:
    libraries = [f"-lopencv_{name}" for name in LIBRARIES]
    run("g++", "-O2", "-std=c++17", f"-I{HEADERS}", HERE / "segment.cpp", "-o", folder / "segment", *libraries)


def compare_cpp(folder: Path, frame: RGBDFrame, network: Path) -> list[Finding]:
    inputs = [folder / name for name in ("image.png", "depth.png", "calibration.txt")]
    run(folder / "segment", network, *inputs, *BLOB, TARGET, folder / "cpp.png", folder / "cpp.bin")
    mask = read_image("mask", folder / "cpp.png", np.uint8)
    bgr = cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2BGR)
    cloud = np.fromfile(folder / "cpp.bin").reshape(-1, 3)
    expected = backproject_to_base(mask, frame.depth, frame.K, frame.T_base_cam, TARGET)
    return [
        equal("C++", "mask of a 320x240 blob", mask, segment_like_cpp(open_engine("opencv", network), bgr, BLOB)),
        close("C++", "target cloud", cloud, expected, 1e-5, " m"),
    ]


# ------------------------------------------------------------------------------------------------- Java


def build_java(folder: Path) -> None:
    run("javac", "-cp", JAR, "-d", folder, HERE / "TableMask.java")


def compare_java(folder: Path, frame: RGBDFrame, network: Path) -> list[Finding]:
    colours = fit_hsv([frame.rgb], [frame.labels == SURFACE])
    outputs = [folder / "java_mask.png", network, folder / "java_labels.png"]
    java = ["java", "-Djava.library.path=/usr/lib/jni", "-cp", f"{JAR}:{folder}", "TableMask"]
    run(*java, folder / "image.png", *colours.lower, *colours.upper, *outputs)
    mask = read_image("mask", outputs[0], np.uint8) > 0
    labels = read_image("labels", outputs[2], np.uint8)
    expected = open_engine("onnxruntime", network).logits(frame.rgb).argmax(axis=0)
    return [
        equal("Java", "mask of the table's colour", mask, hsv_mask(frame.rgb, colours), 1.0),
        equal("Java", "the network's labels", labels, expected),
    ]


# ----------------------------------------------------------------------------------------------- Octave


def compare_octave(folder: Path, frame: RGBDFrame, network: Path) -> list[Finding]:
    engine = open_engine("onnxruntime", network)
    p = engine(frame.rgb)
    p.transpose(2, 0, 1).astype(np.float32).tofile(folder / "probabilities.bin")
    run("octave-cli", "--norc", HERE / "target_cloud.m", folder, TARGET)
    labels, scores = semanticseg(frame.rgb, engine)
    found = read_image("labels", folder / "labels.png", np.uint8)
    both = read_image("montage", folder / "montage.png", np.uint8, colour=True)
    cloud = np.fromfile(folder / "cloud.bin").reshape(-1, 3)
    expected = cloud_of_mask(found == TARGET, frame.depth, frame.K, frame.T_base_cam)
    sure = np.fromfile(folder / "scores.bin", np.float32).reshape(scores.shape)
    return [
        equal("Octave", "labels", found, labels),
        close("Octave", "scores", sure, scores, 1e-6, ""),
        equal("Octave", "montage", both, montage(frame.rgb, found == TARGET), 1.0),
        close("Octave", "target cloud, column by column", cloud, expected, 1e-5, " m"),
    ]


def octave_reads(code: str) -> bool:
    """Whether Octave can parse a line."""
    command = ["octave-cli", "--norc", "--eval", f"a = 1; {code}"]
    return subprocess.run(command, capture_output=True).returncode == 0


def errata_octave() -> Finding:
    """The listing's `d_vec.;` is no MATLAB: the line wants a transpose, d_vec.' there."""
    start = "Kinv = eye(3); pix = ones(3, 2); d_vec = [1; 2]; P_cam = Kinv * pix .* d_vec."
    good = octave_reads(start + "';") and not octave_reads(start + ";")
    return Finding("Octave", "the listing's line as printed", "a syntax error" if good else "as expected?", good)


# ------------------------------------------------------------------------------------------------- all


def have(*tools: str) -> bool:
    return all(shutil.which(tool) for tool in tools)


STACKS = (
    Stack(
        "C++",
        lambda: have("g++") and all((HEADERS / f"opencv2/{name}.hpp").is_file() for name in LIBRARIES),
        "g++ libopencv-dnn-dev libopencv-imgcodecs-dev",
        build_cpp,
        compare_cpp,
    ),
    Stack(
        "Java",
        lambda: have("java", "javac") and JAR.is_file(),
        "default-jdk-headless libopencv-java",
        build_java,
        compare_java,
    ),
    Stack("Octave", lambda: have("octave-cli"), "octave", lambda folder: None, compare_octave),
)


def write_frame(folder: Path, seed: int) -> RGBDFrame:
    """Write a scene's frame as files, and read it back: depth is whole millimetres now, for every stack."""
    frame = render(sample_scene(seed, "test"), (640, 480))
    cv2.imwrite(str(folder / "image.png"), cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2BGR))
    cv2.imwrite(str(folder / "depth.png"), np.round(1000.0 * frame.depth).astype(np.uint16))
    np.savetxt(folder / "calibration.txt", np.concatenate([frame.K.ravel(), frame.T_base_cam.ravel()]), fmt="%.17g")
    cv2.imwrite(str(folder / "labels_true.png"), frame.labels)
    names = (folder / name for name in ("image.png", "depth.png"))
    return RGBDFrame.from_files(*names, frame.K, frame.T_base_cam, labels=folder / "labels_true.png")


def main(arguments: list[str] | None = None) -> int:
    """Compare on a few frames; print a line a comparison and frame, and what to install for the stacks left out."""
    parser = argparse.ArgumentParser(prog="python -m tests.stacks.run", description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=3, help="how many scenes (default: %(default)s)")
    count = parser.parse_args(arguments).frames
    findings = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        network = folder / "unet.onnx"
        export(load_model(weights_path("unet")), network)
        ready = [stack for stack in STACKS if stack.needs()]
        for stack in ready:
            stack.build(folder)
        for seed in range(600_000, 600_000 + count):
            frame = write_frame(folder, seed)
            for stack in ready:
                findings += [(seed, finding) for finding in stack.compare(folder, frame, network)]
        if any(stack.name == "Octave" for stack in ready):
            findings.append(("", errata_octave()))
    for seed, f in findings:
        print(f"{f.stack:<8}{seed:<8}{f.what:<34}{f.value:<36}{'ok' if f.good else 'DISAGREES'}")
    for stack in STACKS:
        if stack not in ready:
            print(f"{stack.name:<8}not installed; on Debian: apt-get install --no-install-recommends {stack.packages}")
    return 1 if any(not finding.good for _, finding in findings) else 0


if __name__ == "__main__":
    sys.exit(main())
