"""The same network in other engines: an ONNX file, run by PyTorch, OpenCV's DNN module or onnxruntime (section 7)."""

import io
import warnings
from abc import ABC, abstractmethod
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from labkit.support.files import write_atomically
from labkit.support.validation import check_rgb, check_shape

OPSET = 13  # the newest that OpenCV 4.6 reads without a word


class Engine(ABC):
    """A network that is ready to run. `engine(rgb)` gives class probabilities, so it may stand as a Pipeline's model.

    divisor: the network's height and width are multiples of it, `cells` times it at least; images of other sizes are
    padded by repeating their border, and the logits are cropped.
    """

    def __init__(self, divisor: int, cells: int = 1):
        self.divisor, self.cells = divisor, cells

    @abstractmethod
    def forward(self, blob: Float[np.ndarray, "N 3 H W"]) -> Float[np.ndarray, "N C H W"]:
        """Map a blob of images, RGB in 0..1, float32, to logits; height and width are multiples of `divisor`."""

    def logits(self, rgb: UInt8[np.ndarray, "H W 3"]) -> Float[np.ndarray, "C H W"]:
        """Logits of one RGB image of any height and width; raises ValueError if it is none."""
        rgb = check_rgb("rgb", rgb)
        height, width = rgb.shape[:2]
        down, right = (max(-side % self.divisor, self.cells * self.divisor - side) for side in (height, width))
        if down or right:
            rgb = cv2.copyMakeBorder(rgb, 0, down, 0, right, cv2.BORDER_REPLICATE)
        return self.forward(cv2.dnn.blobFromImage(rgb, 1.0 / 255.0))[0, :, :height, :width]

    def __call__(self, rgb: UInt8[np.ndarray, "H W 3"], mirror: bool = False) -> Float[np.ndarray, "H W C"]:
        """Class probabilities of an RGB image; mirror: averaged with those of its mirror image, mirrored back."""
        p = _softmax(self.logits(rgb))
        if mirror:
            p = 0.5 * (p + _softmax(self.logits(rgb[:, ::-1]))[:, :, ::-1])
        return p.transpose(1, 2, 0)


def _softmax(z: Float[np.ndarray, "C H W"]) -> Float[np.ndarray, "C H W"]:
    """Softmax over the first axis: whole images at a time are several times as fast as short last axes."""
    e = np.exp(z - z.max(axis=0))
    return e / e.sum(axis=0)


class TorchEngine(Engine):
    """A network in PyTorch itself."""

    def __init__(self, model):
        super().__init__(_grid(model))
        self.model, self.num_classes = model.eval(), model.num_classes

    def forward(self, blob: Float[np.ndarray, "N 3 H W"]) -> Float[np.ndarray, "N C H W"]:
        import torch

        weight = next(self.model.parameters())
        with torch.inference_mode():
            x = torch.from_numpy(blob).to(weight.device, weight.dtype, memory_format=torch.channels_last)
            return self.model(x).float().cpu().numpy()


class OpenCVEngine(Engine):
    """An ONNX file in OpenCV's DNN module, which the text's C++ node uses."""

    def __init__(self, onnx: bytes):
        # OpenCV 5.0's bilinear Resize reads past the end of a map that is one pixel high: keep them all larger.
        super().__init__(_divisor(onnx), cells=2)
        self.net = cv2.dnn.readNetFromONNX(np.frombuffer(onnx, np.uint8))

    def forward(self, blob: Float[np.ndarray, "N 3 H W"]) -> Float[np.ndarray, "N C H W"]:
        self.net.setInput(blob)
        return self.net.forward()


class OnnxRuntimeEngine(Engine):
    """An ONNX file in onnxruntime: the fast one on a CPU."""

    def __init__(self, onnx: bytes):
        import onnxruntime

        super().__init__(_divisor(onnx))
        options = onnxruntime.SessionOptions()
        # Asked for by number, its threads are not tied to cores, which costs much where others work on the same cores.
        options.intra_op_num_threads = cv2.getNumThreads()
        self.session = onnxruntime.InferenceSession(onnx, options, providers=["CPUExecutionProvider"])

    def forward(self, blob: Float[np.ndarray, "N 3 H W"]) -> Float[np.ndarray, "N C H W"]:
        return self.session.run(None, {"image": blob})[0]


ENGINES = {"torch": TorchEngine, "opencv": OpenCVEngine, "onnxruntime": OnnxRuntimeEngine}


def open_engine(name: str, model) -> Engine:
    """Make an engine by its name: "torch", "opencv" or "onnxruntime".

    model: a network of labkit.network (or another module that states its `divisor` and `num_classes`), or, for the last
    two, the path of a file that `export` wrote. Raises ValueError for an unknown name, another kind of model or a file
    that is no such export, FileNotFoundError for none. Section 7 of the text.

    >>> from labkit.network import SmallSegNet
    >>> open_engine("torch", SmallSegNet()).logits(np.zeros((5, 7, 3), np.uint8)).shape
    (4, 5, 7)
    """
    if name not in ENGINES:
        raise ValueError(f"engine: expected one of {', '.join(ENGINES)}, got {name!r}")
    is_file = isinstance(model, (str, Path))
    if name == "torch":
        if is_file:
            raise ValueError(f"model: expected a network for the torch engine, which reads no ONNX, got {str(model)!r}")
        return TorchEngine(model)
    return ENGINES[name](Path(model).read_bytes() if is_file else to_onnx(model))


def export(model, path) -> None:
    """Write a network as one self-contained ONNX file, atomically.

    Its input `image` is (1, 3, H, W) RGB in 0..1 and its output `logits` (1, C, H, W), float32, for any H and W that
    are multiples of the divisor that the file's metadata states. OpenCV 4.6 and 5 and onnxruntime read it. Raises
    ValueError if the model is no such network, OSError naming `path` if it cannot be written. Section 7.
    """
    write_atomically(path, to_onnx(model))


def to_onnx(model) -> bytes:
    """The bytes of the file that `export` writes."""
    import onnx
    import torch

    class OnGrid(torch.nn.Module):
        """The network without padding and cropping, which would make the graph's shapes depend on the input."""

        def __init__(self):
            super().__init__()
            self.network = model

        def forward(self, image):
            return getattr(self.network, "on_grid", self.network)(image)

    divisor = _grid(model)
    axes = {2: "height", 3: "width"}
    buffer = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the older exporter is meant: the newer one writes what OpenCV 4.6 cannot read
        torch.onnx.export(
            OnGrid().eval(),
            (torch.zeros(1, 3, 4 * divisor, 6 * divisor, device=next(model.parameters()).device),),
            buffer,
            dynamo=False,
            opset_version=OPSET,
            input_names=["image"],
            output_names=["logits"],
            dynamic_axes={"image": axes, "logits": axes},
        )
    proto = onnx.load_model_from_string(buffer.getvalue())
    facts = {"architecture": type(model).__name__, "classes": str(model.num_classes), "divisor": str(divisor)}
    onnx.helper.set_model_props(proto, facts)
    onnx.checker.check_model(proto)
    return proto.SerializeToString()


def _grid(model) -> int:
    """What height and width of a network's input must be multiples of; raises ValueError for anything else."""
    import torch

    divisor = getattr(model, "stride", getattr(model, "divisor", None))
    if not (isinstance(model, torch.nn.Module) and isinstance(divisor, int)):
        raise ValueError(f"model: expected a network such as labkit.network's, got {type(model).__name__}")
    return divisor


def _divisor(onnx_file: bytes) -> int:
    """What the metadata of an ONNX file says of its grid."""
    import onnx

    try:
        facts = {entry.key: entry.value for entry in onnx.load_model_from_string(onnx_file).metadata_props}
    except Exception as error:  # protobuf's own kind of error, and protobuf is not ours to import
        raise ValueError("model: expected an ONNX file, got one that is damaged or of another kind") from error
    if "divisor" not in facts:
        raise ValueError(f"model: expected a file of `labkit export`, got one with the facts {sorted(facts)} only")
    return int(facts["divisor"])


# ------------------------------------------------------------------------------------ the C++ listing


def segment_like_cpp(
    engine: Engine, bgr: UInt8[np.ndarray, "H W 3"], size: tuple[int, int] = (320, 240)
) -> UInt8[np.ndarray, "H W"]:
    """Label an image as the text's C++ node does: a small blob, and the mask enlarged again (section 7).

    bgr: as OpenCV and the node's message give it. size: width and height of the blob, multiples of the engine's
    divisor; the image is squeezed to it, whatever its proportions. Returns a mono8 mask of the image's size. Raises
    ValueError for an image or a size that does not fit.

    >>> from labkit.network import SmallSegNet
    >>> segment_like_cpp(open_engine("torch", SmallSegNet()), np.zeros((48, 64, 3), np.uint8), (32, 24)).shape
    (48, 64)
    """
    bgr = check_rgb("bgr", bgr)
    if any(side < 1 or side % engine.divisor for side in size):
        raise ValueError(f"size: expected width and height that are multiples of {engine.divisor}, got {size}")
    blob = cv2.dnn.blobFromImage(bgr, 1.0 / 255.0, size, (0.0, 0.0, 0.0), swapRB=True, crop=False)
    mask = labels_of_scores(engine.forward(blob))
    return cv2.resize(mask, (bgr.shape[1], bgr.shape[0]), interpolation=cv2.INTER_NEAREST)


def labels_of_scores(scores: Float[np.ndarray, "1 C H W"]) -> UInt8[np.ndarray, "H W"]:
    """The best class of each pixel of a network's output, the first one of equals.

    scores are NCHW: class c of pixel (y, x) is at c * H * W + y * W + x of the memory. The text's listing reads
    y * W * C + x * C + c, which is NHWC's place, and so mixes pixels with classes. Section 7.

    >>> labels_of_scores(np.array([[[[0.1, 2.0]], [[0.3, 1.0]]]]))
    array([[1, 0]], dtype=uint8)
    """
    scores = check_shape("scores", scores, (1, None, None, None))
    return scores[0].argmax(axis=0).astype(np.uint8)
