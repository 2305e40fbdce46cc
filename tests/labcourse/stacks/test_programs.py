"""The kit against other stacks: C++ and Java with Debian's OpenCV, and Octave, on the same network and frame."""

import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest

from data_gen import render, sample_scene
from labcourse.stacks.threshold import fit_hsv, hsv_mask
from labkit.frame import RGBDFrame, read_image
from labkit.geometry import masked_cloud_to_base
from labkit.labels import SURFACE, TARGET
from labkit.learning.engines import export, open_engine, segment_like_cpp
from labkit.learning.network import load_model, weights_path

HERE = Path(__file__).parent
BLOB = (320, 240)  # the C++ listing squeezes any image to this
JAR = "/usr/share/java/opencv.jar"


def run(*command) -> None:
    """Run a program, quietly; fail with what it said if it fails."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    assert done.returncode == 0, f"{command[0]}: {(done.stderr or done.stdout)[-800:]}"


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    """The shipped network as an ONNX file."""
    path = tmp_path_factory.mktemp("network") / "unet.onnx"
    export(load_model(weights_path("unet")), path)
    return path


@pytest.fixture(params=[600_000, 600_001])
def frame(request, tmp_path):
    """A scene's frame, written as files for every stack and read back: depth is whole millimetres."""
    frame = render(sample_scene(request.param, "test"), (640, 480))
    cv2.imwrite(str(tmp_path / "image.png"), cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2BGR))
    cv2.imwrite(str(tmp_path / "depth.png"), np.round(1000.0 * frame.depth).astype(np.uint16))
    cv2.imwrite(str(tmp_path / "truth.png"), frame.labels)
    np.savetxt(tmp_path / "calibration.txt", np.concatenate([frame.K.ravel(), frame.T_base_cam.ravel()]), fmt="%.17g")
    names = (tmp_path / name for name in ("image.png", "depth.png"))
    return RGBDFrame.from_files(*names, frame.K, frame.T_base_cam, labels=tmp_path / "truth.png")


@pytest.mark.debian("g++", "libopencv-dnn-dev", "libopencv-imgcodecs-dev")
def test_cpp_gives_the_mask_and_the_cloud_of_the_kit(network, frame, tmp_path):
    libraries = [f"-lopencv_{name}" for name in ("dnn", "imgcodecs", "imgproc", "core")]
    program, mask, cloud = (tmp_path / name for name in ("segment", "cpp.png", "cpp.bin"))
    run("g++", "-O2", "-std=c++17", "-I/usr/include/opencv4", HERE / "segment.cpp", "-o", program, *libraries)
    inputs = [tmp_path / name for name in ("image.png", "depth.png", "calibration.txt")]
    run(program, network, *inputs, *BLOB, TARGET, mask, cloud)
    found, bgr = read_image("mask", mask, np.uint8), cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2BGR)
    assert np.mean(found == segment_like_cpp(open_engine(network, "opencv"), bgr, BLOB)) >= 0.9999
    expected = masked_cloud_to_base(found, frame.depth, frame.K, frame.T_base_cam, TARGET)
    assert len(expected) > 100 and np.allclose(np.fromfile(cloud).reshape(-1, 3), expected, atol=1e-5)


@pytest.mark.debian("default-jdk-headless", "libopencv-java")
def test_java_gives_the_colour_mask_and_the_labels_of_the_kit(network, frame, tmp_path):
    run("javac", "-cp", JAR, "-d", tmp_path, HERE / "TableMask.java")
    colours = fit_hsv([frame.rgb], [frame.labels == SURFACE])
    mask, labels = tmp_path / "java_mask.png", tmp_path / "java_labels.png"
    java = ["java", "-Djava.library.path=/usr/lib/jni", "-cp", f"{JAR}:{tmp_path}", "TableMask"]
    run(*java, tmp_path / "image.png", *colours.lower, *colours.upper, mask, network, labels)
    assert np.array_equal(read_image("mask", mask, np.uint8) > 0, hsv_mask(frame.rgb, colours))
    expected = open_engine(network, "onnxruntime").logits(frame.rgb).argmax(axis=0)
    assert np.mean(read_image("labels", labels, np.uint8) == expected) >= 0.9999


@pytest.mark.debian("octave")
def test_octave_gives_the_labels_scores_montage_and_cloud_of_the_kit(network, frame, tmp_path):
    engine = open_engine(network, "onnxruntime")
    p = engine(frame.rgb)
    p.transpose(2, 0, 1).astype(np.float32).tofile(tmp_path / "probabilities.bin")
    run("octave-cli", "--norc", HERE / "target_cloud.m", tmp_path, TARGET)
    found = read_image("labels", tmp_path / "labels.png", np.uint8)
    assert np.mean(found == p.argmax(axis=2)) >= 0.9999
    assert np.allclose(np.fromfile(tmp_path / "scores.bin", np.float32).reshape(found.shape), p.max(axis=2), atol=1e-6)
    both = read_image("montage", tmp_path / "montage.png", np.uint8, colour=True)
    mask = np.uint8(255 * (found == TARGET))
    assert np.array_equal(both, np.hstack([frame.rgb, np.dstack([mask, mask, mask])]))
    cloud = np.fromfile(tmp_path / "cloud.bin").reshape(-1, 3)
    expected = masked_cloud_to_base(found, frame.depth, frame.K, frame.T_base_cam, TARGET)
    v, u = np.nonzero((found == TARGET) & (frame.depth > 0.0))  # row by row; MATLAB's find goes column by column
    assert len(expected) > 100 and np.allclose(cloud, expected[np.lexsort([v, u])], atol=1e-5)


@pytest.mark.debian("octave")
def test_errata_the_matlab_listings_line_is_a_syntax_error():
    """The listing's `d_vec.;` is no MATLAB: the line wants a transpose, d_vec.' there."""
    line = "Kinv = eye(3); pix = ones(3, 2); d_vec = [1; 2]; P_cam = Kinv * pix .* d_vec."
    read = [
        subprocess.run(["octave-cli", "--norc", "--eval", f"{line}{end}"], capture_output=True).returncode == 0
        for end in ("';", ";")
    ]
    assert read == [True, False]
