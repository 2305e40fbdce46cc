"""One entrance from a picture to classes, whatever the model is: `open_engine` (topics 03 and 09).

    engine = open_engine(model)    engine(picture) gives class probabilities, engine.logits(picture) logits

A network runs in PyTorch, or as an ONNX file in OpenCV's DNN module or onnxruntime, with equal results.
"""

import difflib
import importlib.util
import io
import json
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8

import labkit
from labkit.labels import TARGET
from labkit.learning.channels import CHANNELS
from labkit.learning.inference import THINGS, Engine, FunctionEngine, NetworkInput, check_class_count
from labkit.learning.onnx_file import check_onnx, parsed
from labkit.support.files import write_atomically
from labkit.support.validation import check_rgb, check_shape, require

OPSET = 13  # the newest that OpenCV 4.6 reads without a word
ENGINES = ("torch", "opencv", "onnxruntime")
SHIPPED = ("unet", "smallsegnet")  # as ONNX beside their weights


class OpenCVEngine(Engine):
    """An ONNX file in OpenCV's DNN module, as a node in C++ would use it."""

    def __init__(self, onnx: bytes):
        super().__init__(*_facts(onnx))
        self.onnx, self.size = onnx, None
        try:
            self.net = read(onnx)
        except cv2.error:  # OpenCV 4.12 reads networks that add or join layers for one size of picture alone
            self.size = (0, 0)

    def forward(self, *arrays: Float[np.ndarray, "N _ H W"]) -> Float[np.ndarray, "N C H W"]:
        return np.concatenate(self._run(arrays, _outputs(self.things)), axis=1)

    def classes(self, *arrays: Float[np.ndarray, "N _ H W"]) -> Float[np.ndarray, "N C H W"]:
        return self._run(arrays, ["logits"])[0]

    def _run(self, arrays, outputs: list[str]) -> Sequence[Float[np.ndarray, "N _ H W"]]:
        size = arrays[0].shape[2:]
        if self.size not in (None, size):
            self.net, self.size = read(of_size(self.onnx, *size)), size
        for name, array in zip(self.takes.arrays, arrays, strict=True):
            self.net.setInput(np.ascontiguousarray(array), name)
        return self.net.forward(outputs)

    def padded_side(self, side: int) -> int:
        # OpenCV 5.0's bilinear Resize reads past the end of a map that is one pixel high: keep them all larger.
        return max(super().padded_side(side), 2 * self.takes.divisor)


def read(onnx_file: bytes) -> cv2.dnn.Net:
    """An ONNX file as OpenCV's DNN module runs it."""
    return cv2.dnn.readNetFromONNX(np.frombuffer(onnx_file, np.uint8))


def of_size(onnx_file: bytes, height: int, width: int) -> bytes:
    """An ONNX file whose inputs have one size."""
    import onnx

    proto = onnx.load_model_from_string(onnx_file)
    for array in proto.graph.input:
        for axis, length in ((2, height), (3, width)):
            array.type.tensor_type.shape.dim[axis].dim_value = length
    return proto.SerializeToString()


class OnnxRuntimeEngine(Engine):
    """An ONNX file in onnxruntime: the fast one on a CPU."""

    def __init__(self, onnx: bytes):
        import onnxruntime

        super().__init__(*_facts(onnx))
        options = onnxruntime.SessionOptions()
        # Asked for by number, its threads are not tied to cores, which costs much where others work on the same cores.
        options.intra_op_num_threads = cv2.getNumThreads()
        self.session = onnxruntime.InferenceSession(onnx, options, providers=["CPUExecutionProvider"])

    def forward(self, *arrays: Float[np.ndarray, "N _ H W"]) -> Float[np.ndarray, "N C H W"]:
        contiguous = map(np.ascontiguousarray, arrays)
        outputs = self.session.run(_outputs(self.things), dict(zip(self.takes.arrays, contiguous, strict=True)))
        return np.concatenate(outputs, axis=1)


def open_engine(model, engine: str = "torch", processor=None) -> Engine:
    """Make an engine of a model: `engine(picture)` gives class probabilities, `engine.logits(picture)` logits.

    model: a PyTorch network (`TorchEngine` says which), a function from an RGB image to class probabilities (H, W, C),
    or an engine, which comes back as it is. engine: "torch", "opencv" or "onnxruntime"; the last two take a network, or
    the path of a file that `export` wrote. processor: a Hugging Face image processor that prepares what a PyTorch
    network sees. Raises ValueError for an unknown engine, another kind of model or processor or a file that is no such
    export, FileNotFoundError for none. Topic 09.

    >>> from labkit.learning.network import SmallSegNet
    >>> open_engine(SmallSegNet())(np.zeros((5, 7, 3), np.uint8)).shape
    (5, 7, 4)
    """
    require("engine", engine in ENGINES, f"one of {', '.join(ENGINES)}", repr(engine))
    if processor is not None:
        beside = f"{type(model).__name__} in the engine {engine}"
        require("processor", engine == "torch" and is_network(model), "a PyTorch network in its own engine", beside)
        from labkit.learning.network import ProcessedEngine

        return ProcessedEngine(model, processor)
    if engine != "torch":
        onnx = Path(model).read_bytes() if isinstance(model, str | Path) else to_onnx(model)
        return OpenCVEngine(onnx) if engine == "opencv" else OnnxRuntimeEngine(onnx)
    if isinstance(model, Engine):
        return model
    if is_network(model):
        from labkit.learning.network import TorchEngine

        return TorchEngine(model)
    got = repr(str(model)) if isinstance(model, str | Path) else type(model).__name__
    require("model", callable(model), "a PyTorch network, an engine or a function of an RGB image", got)
    return FunctionEngine(model)


def open_shipped(name: str) -> Engine:
    """The kit's own "unet" or "smallsegnet" in OpenCV: the labels of PyTorch without loading it, 120 MB less memory.

    Without the package `onnx` it is PyTorch all the same. Raises ValueError for another name. Topic 09.

    >>> open_shipped("unet")(np.zeros((5, 7, 3), np.uint8)).shape
    (5, 7, 4)
    """
    require("name", name in SHIPPED, f"one of {', '.join(SHIPPED)}", repr(name))
    if importlib.util.find_spec("onnx") is None:
        from labkit.learning.network import load_model, weights_path

        return open_engine(load_model(weights_path(name)))
    return open_engine(Path(labkit.__file__).with_name("weights") / f"{name}.onnx", "opencv")


def class_number(name: int | str | None, engine: Engine | None) -> int:
    """The number of the class to grasp: as given, or that of a name; None is TARGET, or 1 of two classes.

    Raises ValueError for a name that the engine's network does not have.
    """
    if name is None:
        return 1 if getattr(engine, "num_classes", None) == 2 else TARGET
    if not isinstance(name, str):
        return name
    names = {each: number for number, each in getattr(engine, "class_names", {}).items()}
    if name not in names:
        like = difflib.get_close_matches(name, names, 5, 0.4) or list(names)[:5]
        known = f"a name of the model's id2label, such as {', '.join(map(repr, like))}" if like else "a number"
        why = repr(name) if like else f"{name!r}, and the model has no config.id2label"
        raise ValueError(f"target_class: expected {known}, got {why}")
    return names[name]


def is_network(model) -> bool:
    """Whether a model is a PyTorch network."""
    torch = sys.modules.get("torch")  # heavy; where nobody imported it, nobody has a network
    return torch is not None and isinstance(model, torch.nn.Module)


def export(model, path) -> None:
    """Write a network as one self-contained ONNX file, atomically.

    Its inputs are the arrays that the network takes, such as `image`, (1, 3, H, W), its output `logits`, (1, C, H, W),
    and for a network that tells things apart `things`, (1, 3, H, W); all float32, for any H and W that are divisible as
    the file's metadata states. OpenCV 4.6 and 5 and onnxruntime read it. Raises ValueError if the model is no network,
    OSError naming `path` if it cannot be written. Topic 09.
    """
    write_atomically(path, to_onnx(model))


def to_onnx(model) -> bytes:
    """The bytes of the file that `export` writes."""
    import onnx
    import torch

    from labkit.learning.foreign import logits_of
    from labkit.learning.network import TorchEngine, evaluating

    class Outputs(torch.nn.Module):
        """The network without what it may return beside its logits and `THINGS`."""

        def __init__(self):
            super().__init__()
            self.network = model

        def forward(self, *arrays):
            result = self.network(*arrays)
            return (
                (result["out"], result["things"]) if engine.things else logits_of(result, tuple(arrays[0].shape[-2:]))
            )

    require("model", is_network(model), "a PyTorch network", type(model).__name__)
    engine = TorchEngine(model)
    takes = engine.takes
    height = -(-64 // takes.divisor) * takes.divisor
    example = {"image": np.zeros((1, 3, height, 2 * height), np.float32)}
    if "geometry" in takes.arrays:
        example["geometry"] = np.zeros((1, len(CHANNELS), height, 2 * height), np.float32)
    num_classes = max(2, engine.forward(*example.values()).shape[1] - len(THINGS) * engine.things)
    device = next((weight.device for weight in model.parameters()), "cpu")
    axes = {2: "height", 3: "width"}
    buffer = io.BytesIO()
    with warnings.catch_warnings(), evaluating(model):
        warnings.simplefilter("ignore")  # the older exporter is meant: the newer one writes what OpenCV 4.6 cannot read
        torch.onnx.export(
            Outputs().train(model.training),
            tuple(torch.from_numpy(array).to(device) for array in example.values()),
            buffer,
            dynamo=False,
            opset_version=OPSET,
            input_names=list(takes.arrays),
            output_names=_outputs(engine.things),
            dynamic_axes=dict.fromkeys((*takes.arrays, *_outputs(engine.things)), axes),
        )
    proto = onnx.load_model_from_string(buffer.getvalue())
    facts = {"architecture": type(model).__name__, "classes": num_classes, "things": engine.things, **vars(takes)}
    onnx.helper.set_model_props(proto, {k: v if isinstance(v, str) else json.dumps(v) for k, v in facts.items()})
    onnx.checker.check_model(proto)
    return proto.SerializeToString()


def _outputs(things: bool) -> list[str]:
    """Names of an ONNX file's outputs."""
    return ["logits", "things"] if things else ["logits"]


def _facts(onnx_file: bytes) -> tuple[NetworkInput, int, bool]:
    """What the metadata of an ONNX file says: what the network takes, its number of classes, and if it tells things.

    The file is checked first, whichever engine then runs it.
    """
    if importlib.util.find_spec("onnx") is None:
        raise ModuleNotFoundError('an ONNX file is checked first, by the package onnx: pip install "onnx"')
    facts = {entry.key: entry.value for entry in parsed(onnx_file).metadata_props}
    try:
        mean, std, divisor = (json.loads(facts[name]) for name in ("mean", "std", "divisor"))
        arrays, classes = tuple(json.loads(facts["arrays"])), json.loads(facts["classes"])
    except (KeyError, ValueError, TypeError, RecursionError) as error:
        raise ValueError(f"model: expected a file of `labkit export`, got one that states {sorted(facts)}") from error
    mean, std = (tuple(x) if isinstance(x, list) else x for x in (mean, std))
    takes = NetworkInput(arrays, mean, std, divisor, json.loads(facts.get("pixel", "null")))
    things = json.loads(facts.get("things", "false"))
    check_onnx(onnx_file, arrays, _outputs(things))
    return takes, classes, things


# ------------------------------------------------------------------------------------ the C++ listing


def segment_like_cpp(
    model, bgr: UInt8[np.ndarray, "H W 3"], size: tuple[int, int] = (320, 240)
) -> UInt8[np.ndarray, "H W"]:
    """Label an image as a small node in C++ does: a small blob, and the mask enlarged again (topic 09).

    model: as in `open_engine`, of images alone. bgr: as OpenCV and the node's message give it. size: width and height
    of the blob; the image is squeezed to it, whatever its proportions. Returns a mono8 mask of the image's size. Raises
    ValueError for an image or a size that does not fit.

    >>> from labkit.learning.network import SmallSegNet
    >>> segment_like_cpp(SmallSegNet(), np.zeros((48, 64, 3), np.uint8), (32, 24)).shape
    (48, 64)
    """
    bgr = check_rgb("bgr", bgr)
    require("size", min(size) >= 1, "width and height of at least 1", size)
    small = cv2.cvtColor(cv2.resize(bgr, size), cv2.COLOR_BGR2RGB)
    mask = labels_of_scores(open_engine(model).logits(small)[None])
    return cv2.resize(mask, (bgr.shape[1], bgr.shape[0]), interpolation=cv2.INTER_NEAREST)


def labels_of_scores(scores: Float[np.ndarray, "1 C H W"]) -> UInt8[np.ndarray, "H W"]:
    """The best class of each pixel of a network's output, the first one of equals.

    scores are NCHW: class c of pixel (y, x) is at c * H * W + y * W + x of the memory. A common listing reads
    y * W * C + x * C + c, which is NHWC's place, and so mixes pixels with classes. Topic 09.

    >>> labels_of_scores(np.array([[[[0.1, 2.0]], [[0.3, 1.0]]]]))
    array([[1, 0]], dtype=uint8)
    """
    scores = check_shape("scores", scores, (1, None, None, None))
    check_class_count("scores", scores.shape[1])
    return scores[0].argmax(axis=0).astype(np.uint8)
