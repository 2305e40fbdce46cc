"""One network, three engines, one answer; and the C++ listing's flow, with its mistake beside it."""

import importlib.util
import json
import os
import subprocess
from pathlib import Path

import cv2
import numpy as np
import onnx
import pytest
from typer.testing import CliRunner

import data_gen
from labcli.cli import app
from labkit.learning.engines import (
    ENGINES,
    SHIPPED,
    export,
    labels_of_scores,
    open_engine,
    open_shipped,
    segment_like_cpp,
)
from labkit.learning.network import UNetRGBD, load_model, weights_path
from labkit.pipeline import Pipeline, segment_rgb_image

FRAMES = 5
BGR = np.zeros((4, 4, 3), np.uint8)
SYSTEM_PYTHON = Path("/usr/bin/python3")


@pytest.fixture(scope="module")
def unet():
    """The shipped network."""
    return load_model(weights_path("unet"))


@pytest.fixture(scope="module")
def file(unet, tmp_path_factory):
    """The shipped network as an ONNX file."""
    path = tmp_path_factory.mktemp("onnx") / "unet.onnx"
    export(unet, path)
    return path


@pytest.fixture(scope="module")
def frames():
    """Images of scenes that nothing was trained on; LABKIT_FRAMES=50 takes more of them."""
    seeds = range(610_000, 610_000 + int(os.environ.get("LABKIT_FRAMES", FRAMES)))
    return [data_gen.render(data_gen.sample_scene(seed, "test"), (320, 240)) for seed in seeds]


# -------------------------------------------------------------------------------- the same answer everywhere


@pytest.mark.parametrize("name", SHIPPED)
def test_what_ships_as_onnx_is_the_network_of_the_weights_that_ship(name, frames, monkeypatch):
    expected = open_engine(load_model(weights_path(name))).logits(frames[0].rgb)
    assert np.abs(open_shipped(name).logits(frames[0].rgb) - expected).max() < 1e-4
    monkeypatch.setattr("importlib.util.find_spec", lambda package: None)  # as where onnx is not installed
    assert np.array_equal(open_shipped(name).logits(frames[0].rgb), expected)
    with pytest.raises(ValueError, match="name: expected one of unet, smallsegnet, got 'unet_rgbd'"):
        open_shipped("unet_rgbd")


def test_an_opencv_that_reads_a_network_for_one_size_alone_reads_it_for_each(monkeypatch):
    """OpenCV 4.12, which Colab has."""
    expected, picky, reads = open_shipped("unet"), cv2.dnn.readNetFromONNX, []

    def of_one_size_alone(data):
        reads.append(data.tobytes())
        if reads[-1] == expected.onnx:
            raise cv2.error("findCommonShape")
        return picky(data)

    monkeypatch.setattr(cv2.dnn, "readNetFromONNX", of_one_size_alone)
    engine, rng = open_shipped("unet"), np.random.default_rng(0)
    for height, width in ((24, 40), (24, 40), (40, 24)):
        picture = rng.integers(0, 256, (height, width, 3), np.uint8)
        assert np.abs(engine.logits(picture) - expected.logits(picture)).max() < 1e-4
    assert len(reads) == 3  # as it is, and for either size once


@pytest.mark.parametrize("name", ENGINES)
def test_the_shipped_network_gives_the_same_labels_and_grasps_in_every_engine(name, unet, frames, file):
    engines = [open_engine(model, name) for model in [unet] + [file] * (name != "torch")]
    for frame in frames:
        expected = open_engine(unet).logits(frame.rgb)
        for engine in engines:
            z = engine.logits(frame.rgb)
            assert np.abs(z - expected).max() < 1e-4
            assert np.mean(z.argmax(axis=0) == expected.argmax(axis=0)) >= 0.9999
    expected = Pipeline(unet).run(frames[1])
    for model in [unet] + [file] * (name != "torch"):
        p = Pipeline(model, engine=name).run(frames[1])
        assert np.mean(p.labels == expected.labels) >= 0.9999
        assert np.allclose(p.plan.grasps[0].T_base_grasp, expected.plan.grasps[0].T_base_grasp, atol=1e-3)


def test_a_function_and_an_engine_are_engines_too(frames):
    def thirds(rgb):
        return np.stack([rgb[..., 0] / 255.0, 1.0 - rgb[..., 0] / 255.0, 0.0 * rgb[..., 0]], axis=-1)

    engine, rgb = open_engine(thirds), frames[0].rgb
    assert open_engine(engine) is engine
    assert np.array_equal(engine(rgb), thirds(rgb)) and np.array_equal(engine(frames[0], flip_tta=True), thirds(rgb))
    assert np.allclose(np.exp(engine.logits(rgb)), thirds(rgb).transpose(2, 0, 1), atol=1e-6)


# ------------------------------------------------------------------------------------------------ the file


def test_the_file_stands_alone_and_says_what_it_is(file):
    proto = onnx.load(file, load_external_data=False)
    assert [path.name for path in file.parent.iterdir()] == ["unet.onnx"]
    assert all(tensor.data_location == onnx.TensorProto.DEFAULT for tensor in proto.graph.initializer)
    assert {entry.key: entry.value for entry in proto.metadata_props} == {
        "architecture": "UNet",
        "classes": "4",
        "things": "false",
        "divisor": "16",
        "arrays": '["image"]',
        "mean": "0.0",
        "pixel": "null",
        "std": "255.0",
    }
    assert not {node.op_type for node in proto.graph.node} & {"Shape", "Gather", "Slice", "Pad"}, "a plain graph"


def test_the_command_writes_the_file(tmp_path, file):
    path = tmp_path / "new" / "unet.onnx"
    done = CliRunner().invoke(app, ["export", "--model", "unet", "--onnx", str(path)])
    assert done.exit_code == 0 and path.name in done.output
    assert path.read_bytes() == file.read_bytes()


@pytest.mark.debian("python3-opencv")
def test_debians_opencv_reads_the_file_and_agrees(file, unet, frames, tmp_path):
    """OpenCV 4.6 in a process of the system's Python, which shares nothing with this one but files."""
    rgb = frames[0].rgb
    cv2.imwrite(str(tmp_path / "image.png"), cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR))
    code = (
        "import cv2, json, numpy as np, sys\n"
        "net = cv2.dnn.readNetFromONNX(sys.argv[1])\n"
        "net.setInput(cv2.dnn.blobFromImage(cv2.imread(sys.argv[2]), 1 / 255, swapRB=True))\n"
        "np.save(sys.argv[3], net.forward())\n"
        "print(json.dumps(cv2.__version__))\n"
    )
    files = [file, tmp_path / "image.png", tmp_path / "scores.npy"]
    done = subprocess.run([SYSTEM_PYTHON, "-I", "-c", code, *files], capture_output=True, text=True, check=True)
    scores = np.load(files[2])
    expected = open_engine(unet).logits(rgb)
    assert json.loads(done.stdout) != cv2.__version__
    assert np.abs(scores[0] - expected).max() < 1e-4
    assert np.mean(scores[0].argmax(axis=0) == expected.argmax(axis=0)) >= 0.9999


# ------------------------------------------------------------------------------------ the C++ listing


def test_equal_scores_give_the_first_class():
    scores = np.zeros((1, 4, 2, 3), np.float32)
    scores[0, 2, 1, 1] = scores[0, 3, 1, 1] = 1.0
    assert labels_of_scores(scores).tolist() == [[0, 0, 0], [0, 2, 0]]


def test_the_flow_of_the_cpp_node(unet, frames):
    rgb = np.ascontiguousarray(np.tile(frames[2].rgb, (2, 2, 1)))[:480, :500]  # other proportions than the blob's
    bgr = cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR)
    small = cv2.resize(rgb, (320, 240), interpolation=cv2.INTER_LINEAR)
    labels = segment_rgb_image(unet, small)
    rows = np.arange(480) * 240 // 480
    columns = np.floor(np.arange(500) * 320 / 500).astype(int)
    for name in ENGINES:
        mask = segment_like_cpp(open_engine(unet, name), bgr)
        assert mask.dtype == np.uint8 and mask.shape == (480, 500)
        assert np.mean(mask == labels[rows][:, columns]) >= 0.9999


# ---------------------------------------------------------------------------------------------- bad input


@pytest.mark.parametrize("name", ["opencv", "onnxruntime"])
def test_a_file_that_is_no_export(name, tmp_path):
    file = tmp_path / "some.onnx"
    with pytest.raises(FileNotFoundError, match="some"):
        open_engine(file, name)
    for data, says in ((b"no network at all", "expected an ONNX file"), (b"", "labkit export")):
        file.write_bytes(data)
        with pytest.raises(ValueError, match=f"model: .*{says}"):
            open_engine(file, name)


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("says", "call"),
    [
        ("engine: expected one of torch, opencv, onnxruntime, got 'abc'", lambda net: open_engine(None, "abc")),
        ("model: expected a PyTorch network, .* got 'unet.onnx'", lambda net: open_engine("unet.onnx")),
        ("model: .* or a function of an RGB image, got int", lambda net: open_engine(5)),
        ("probabilities: .* are they scores?", lambda net: open_engine(lambda rgb: rgb)(BGR + 1)),
        ("model: expected a PyTorch network", lambda net: open_engine(np.asarray, "opencv")),
        ("bgr: expected shape", lambda net: segment_like_cpp(net, BGR[..., 0])),
        (r"size: expected width and height .*, got \(0, 80\)", lambda net: segment_like_cpp(net, BGR, (0, 80))),
        ("picture: expected an RGBDFrame", lambda net: segment_like_cpp(UNetRGBD(), BGR)),
        ("scores: expected shape", lambda net: labels_of_scores(np.zeros((4, 2, 3)))),
    ],
)
def test_what_does_not_fit_is_named(says, call, unet):
    with pytest.raises(ValueError, match=says):
        call(open_engine(unet))


def spoilt(how: str, network) -> None:
    """Damage a network as files from elsewhere are damaged."""
    weights = network.graph.initializer[0]
    if how == "a NaN weight":
        values = onnx.numpy_helper.to_array(weights).copy()
        values.flat[0] = np.nan
        weights.CopyFrom(onnx.numpy_helper.from_array(values, weights.name))
    elif how == "an infinite number in a node":
        value = onnx.numpy_helper.from_array(np.array([np.inf], np.float32))
        network.graph.node.insert(0, onnx.helper.make_node("Constant", [], ["unused"], value=value))
    elif how == "weights cut short":
        weights.raw_data = weights.raw_data[:-4]
    elif how == "data in another file":
        weights.ClearField("raw_data")
        weights.data_location = onnx.TensorProto.EXTERNAL
        weights.external_data.add(key="location", value="weights.bin")
    elif how == "a weight that is missing":
        del network.graph.initializer[0]
    elif how == "an input that is missing":
        del network.graph.input[0]
    elif how == "an input too many":
        network.graph.input.add().CopyFrom(network.graph.input[0])
        network.graph.input[-1].name = "depth"
    elif how == "another output":
        network.graph.output[0].name = "scores"
    elif how == "sparse weights":
        network.graph.sparse_initializer.add().dims.append(3)


SPOILT = {
    "a NaN weight": "expected finite weights, got 1 NaN or infinite of 864 in",
    "an infinite number in a node": "expected finite weights, got 1 NaN or infinite of 1 in value of Constant",
    "weights cut short": r"expected 864 numbers of .*, \[32, 3, 3, 3\], got others: is it cut short",
    "data in another file": "expected one file that holds all weights, got .* in another file; save it as one",
    "a weight that is missing": "expected a whole network, got one in which ",
    "an input that is missing": "expected the inputs image, got none",
    "an input too many": "expected the inputs image, got image, depth",
    "another output": "expected the outputs logits, got scores",
    "sparse weights": "expected dense weights, got sparse ones",
}


@pytest.mark.parametrize("how", SPOILT)
@pytest.mark.parametrize("engine", ["opencv", "onnxruntime"])
def test_a_damaged_file_is_refused_in_words_before_an_engine_sees_it(how, engine, tmp_path, monkeypatch):
    """Of a NaN OpenCV made other labels for most pixels without a word, and of a short weight it died."""
    monkeypatch.setattr(cv2.dnn, "readNetFromONNX", None)
    monkeypatch.setattr("onnxruntime.InferenceSession", None)
    network = onnx.load_model(weights_path("smallsegnet").with_suffix(".onnx"))
    spoilt(how, network)
    (tmp_path / "spoilt.onnx").write_bytes(network.SerializeToString())
    with pytest.raises(ValueError, match=f"^model: {SPOILT[how]}"):
        open_engine(tmp_path / "spoilt.onnx", engine)


@pytest.mark.parametrize("engine", ["opencv", "onnxruntime"])
def test_without_the_package_that_checks_files_a_sentence_names_it(engine, monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "onnx" else find(name))
    with pytest.raises(ModuleNotFoundError, match="an ONNX file is checked first, by the package onnx"):
        open_engine(weights_path("smallsegnet").with_suffix(".onnx"), engine)
