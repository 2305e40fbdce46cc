"""The networks of the kit, their weights on disk, and any PyTorch network as an engine (topic 03).

A network of one's own, any nn.Module that maps images to logits, runs and trains like these. What it takes, if not
RGB in 0..1 of any size, it states in an attribute `takes` (`labkit.learning.inference.NetworkInput`).
"""

import io
from collections.abc import Mapping
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from torch import nn
from torch.nn import functional as F

from labkit.labels import CLASSES
from labkit.learning.channels import CHANNELS
from labkit.learning.foreign import Processor, class_names, divisor_of, logits_of, raw_logits
from labkit.learning.inference import THINGS, Engine, NetworkInput
from labkit.learning.view import PIXEL
from labkit.support.files import write_atomically
from labkit.support.validation import require


class SmallSegNet(nn.Module):
    """A compact encoder-decoder: two poolings, two transposed convolutions, 134,436 weights (topic 03).

    A pixel's logits depend on a window of 18 x 18 pixels, so it knows colours and edges but not the shape of an object.
    Height and width must be divisible by 4: else ValueError. `TorchEngine` takes any size: it pads and crops.

    >>> SmallSegNet()(torch.zeros(1, 3, 8, 12)).shape
    torch.Size([1, 4, 8, 12])
    """

    takes = NetworkInput(divisor=4)

    def __init__(self, num_classes: int = len(CLASSES)):
        super().__init__()
        self.num_classes = num_classes
        self.conv1 = nn.Conv2d(3, 32, kernel_size=3, padding=1)
        self.conv2 = nn.Conv2d(32, 64, kernel_size=3, padding=1)
        self.pool = nn.MaxPool2d(kernel_size=2, stride=2)
        self.conv3 = nn.Conv2d(64, 128, kernel_size=3, padding=1)
        self.up1 = nn.ConvTranspose2d(128, 64, kernel_size=2, stride=2)
        self.up2 = nn.ConvTranspose2d(64, 32, kernel_size=2, stride=2)
        self.logits = nn.Conv2d(32, num_classes, kernel_size=1)

    def forward(self, x: Float[torch.Tensor, "N 3 H W"]) -> Float[torch.Tensor, "N C H W"]:
        """Map images in [0, 1] to logits of the same height and width."""
        if x.shape[-2] % self.takes.divisor or x.shape[-1] % self.takes.divisor:
            raise ValueError(f"x: expected height and width divisible by 4, got {tuple(x.shape[-2:])}")
        x = self.pool(F.relu(self.conv1(x)))  # (N, 32, H/2, W/2)
        x = self.pool(F.relu(self.conv2(x)))  # (N, 64, H/4, W/4)
        x = F.relu(self.conv3(x))  # (N, 128, H/4, W/4)
        x = F.relu(self.up1(x))  # (N, 64, H/2, W/2)
        x = F.relu(self.up2(x))  # (N, 32, H, W)
        return self.logits(x)


def convolution(inputs: int, outputs: int, kernel: int = 3, stride: int = 1) -> nn.Sequential:
    """Convolution, batch normalisation, ReLU; the normalisation has the bias."""
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, kernel, stride, padding=(kernel - 1) // 2, bias=False),
        nn.BatchNorm2d(outputs),
        nn.ReLU(inplace=True),
    )


class Residual(nn.Module):
    """Two convolutions whose result is added to their input, so that depth costs no gradient (He et al., 2016)."""

    def __init__(self, channels: int):
        super().__init__()
        self.first = convolution(channels, channels)
        self.second = nn.Sequential(nn.Conv2d(channels, channels, 3, padding=1, bias=False), nn.BatchNorm2d(channels))

    def forward(self, x: Float[torch.Tensor, "N C H W"]) -> Float[torch.Tensor, "N C H W"]:
        return F.relu(x + self.second(self.first(x)))


class UNet(nn.Module):
    """The network that is good: a U-Net (Ronneberger et al., 2015) made for two CPU cores, 0.9 million weights.

    Its stem halves the image at once, since convolutions at full resolution cost most and know least. An encoder goes
    down to 1/16, where a pixel sees the whole object and its neighbours; a decoder comes back up and adds the
    encoder's features at each scale, which know where the edges are. Any height and width: what is not divisible by
    16 is padded by repeating its border, and the logits are cropped.

    widths: channels at 1/2, 1/4, 1/8 and 1/16. blocks: residual blocks there. channels: of the input. Topic 03.

    >>> UNet(num_classes=4).eval()(torch.zeros(1, 3, 37, 61)).shape
    torch.Size([1, 4, 37, 61])
    """

    def __init__(
        self,
        num_classes: int = len(CLASSES),
        widths: tuple[int, ...] = (32, 64, 96, 96),
        blocks: tuple[int, ...] = (0, 1, 2, 1),
        channels: int = 3,
    ):
        super().__init__()
        self.num_classes = num_classes
        self.takes = NetworkInput(divisor=2 ** len(widths))
        # A 6x6 kernel of stride 2 sees a pixel's 2x2 cell and two pixels around it, so that the stem loses no detail.
        stem = convolution(channels, widths[0], 6, 2)
        encoder = [nn.Sequential(stem, *[Residual(widths[0]) for _ in range(blocks[0])])]
        for below, above, count in zip(widths[:-1], widths[1:], blocks[1:], strict=True):
            encoder.append(nn.Sequential(convolution(below, above, 3, 2), *[Residual(above) for _ in range(count)]))
        self.encoder = nn.ModuleList(encoder)
        scales = range(len(widths) - 1)
        self.narrow = nn.ModuleList(convolution(widths[i + 1], widths[i], 1) for i in scales)
        self.decoder = nn.ModuleList(convolution(widths[i], widths[i]) for i in scales)
        self.logits = nn.ConvTranspose2d(widths[0], num_classes, kernel_size=4, stride=2, padding=1)

    def forward(self, x: Float[torch.Tensor, "N D H W"]) -> Float[torch.Tensor, "N C H W"]:
        """Map images in [0, 1] to logits of the same height and width."""
        height, width = x.shape[-2:]
        down, right = -height % self.takes.divisor, -width % self.takes.divisor
        if down or right:
            return UNet.forward(self, F.pad(x, (0, right, 0, down), mode="replicate"))[..., :height, :width]
        return self.logits(decoded(self.encoded(x), self.narrow, self.decoder))

    def encoded(self, x: Float[torch.Tensor, "N D H W"]) -> list[torch.Tensor]:
        """The features at each scale, the finest first."""
        x = x - 0.5
        skips = []
        for stage in self.encoder:
            x = stage(x)
            skips.append(x)
        return skips


def decoded(skips: list[torch.Tensor], narrow: nn.ModuleList, decoder: nn.ModuleList) -> torch.Tensor:
    """The finest features again, with what the coarser ones know of the whole object."""
    x = skips[-1]
    for i in reversed(range(len(decoder))):
        x = F.interpolate(narrow[i](x), scale_factor=2, mode="bilinear")
        x = decoder[i](x + skips[i])
    return x


class ThingsBranch(nn.Module):
    """What a U-Net needs to tell things apart beside its classes: a coarsest scale, a decoder and three outputs.

    It looks at the U-Net's features at 1/2, 1/4 and 1/8, and leaves them as they are: so classes stay what they are.
    widths: channels at 1/2, 1/4, 1/8 and 1/16.
    """

    def __init__(self, widths: tuple[int, ...]):
        super().__init__()
        self.deep = nn.Sequential(convolution(widths[-2], widths[-1], 3, 2), Residual(widths[-1]))
        scales = range(len(widths) - 1)
        self.narrow = nn.ModuleList(convolution(widths[i + 1], widths[i], 1) for i in scales)
        self.decoder = nn.ModuleList(convolution(widths[i], widths[i]) for i in scales)
        self.outputs = nn.ConvTranspose2d(widths[0], len(THINGS), kernel_size=4, stride=2, padding=1)

    def forward(self, skips: list[torch.Tensor]) -> Float[torch.Tensor, "N 3 H W"]:
        """Map the features of a U-Net, the finest first, to the channels `THINGS` at the image's height and width."""
        return self.outputs(decoded([*skips[:-1], self.deep(skips[-2])], self.narrow, self.decoder))


class UNetRGBD(UNet):
    """A U-Net that also sees depth, as `labkit.learning.channels.geometry_channels`; 1.3 million weights.

    A shape is told by its heights and normals, which do not depend on colour, texture or viewpoint. One more block and
    wider features at 1/16 cost little there. It sees frames in their canonical view. things: with a `ThingsBranch`,
    half a million weights more, whose three channels tell things apart (`labkit.learning.things`); logits and they then
    come as a dict. Topics 03 and 06.

    >>> image, geometry = torch.zeros(1, 3, 37, 61), torch.full((1, 7, 37, 61), 0.5)
    >>> UNetRGBD().eval()(image, geometry).shape
    torch.Size([1, 4, 37, 61])
    >>> {name: tuple(z.shape) for name, z in UNetRGBD(things=True).eval()(image, geometry).items()}
    {'out': (1, 4, 37, 61), 'things': (1, 3, 37, 61)}
    """

    half_kernels = True  # in its file

    def __init__(self, num_classes: int = len(CLASSES), things: bool = False):
        widths = (32, 64, 96, 128)
        super().__init__(num_classes, widths, (0, 1, 2, 2), 3 + len(CHANNELS))
        self.takes = replace(self.takes, arrays=("image", "geometry"), pixel=PIXEL)
        self.branch = ThingsBranch(widths) if things else None

    @property
    def things(self) -> bool:
        """Whether it tells things apart."""
        return self.branch is not None

    def forward(
        self, image: Float[torch.Tensor, "N 3 H W"], geometry: Float[torch.Tensor, "N 7 H W"], classes: bool = True
    ) -> Float[torch.Tensor, "N C H W"] | dict[str, torch.Tensor]:
        """Map images and geometry in [0, 1] to logits of the same height and width.

        With things a dict: the logits as "out", unless `classes` is False, and the channels `THINGS`, (N, 3, H, W), as
        "things".
        """
        if not self.things:
            return self.classes(image, geometry)
        height, width = image.shape[-2:]
        edges = (0, -width % self.takes.divisor, 0, -height % self.takes.divisor)
        x = torch.cat([image, geometry], dim=1)
        skips = self.encoded(F.pad(x, edges, mode="replicate") if any(edges) else x)
        z = {"out": self.logits(decoded(skips, self.narrow, self.decoder))} if classes else {}
        z["things"] = self.branch(skips)
        return {name: each[..., :height, :width] for name, each in z.items()}

    def classes(
        self, image: Float[torch.Tensor, "N 3 H W"], geometry: Float[torch.Tensor, "N 7 H W"]
    ) -> Float[torch.Tensor, "N C H W"]:
        """The logits alone."""
        return super().forward(torch.cat([image, geometry], dim=1))


def with_things(model: UNetRGBD, seed: int = 0) -> UNetRGBD:
    """A network with the weights of another and a `ThingsBranch`, its own or a fresh one: it alone is trained."""
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        more = UNetRGBD(model.num_classes, things=True)
    more.load_state_dict(model.state_dict(), strict=False)
    more.takes = model.takes
    for name, weight in more.named_parameters():
        weight.requires_grad_(name.startswith("branch."))
    return more


WEIGHTS = Path(__file__).parents[1] / "weights"  # shipped with the kit; MODEL_CARD.md beside them says what they can do
ARCHITECTURES = {"smallsegnet": SmallSegNet, "unet": UNet, "unet_rgbd": UNetRGBD}


def architecture_of(model: nn.Module) -> str:
    """Name of a model's architecture: a key of ARCHITECTURES, or for others the name of its class."""
    return next((name for name, kind in ARCHITECTURES.items() if type(model) is kind), type(model).__name__)


def save_model(model: nn.Module, path, **meta) -> None:
    """Write a model's weights, its architecture and plain facts about it (`meta`), atomically.

    The file is a dict with keys architecture, num_classes, things (whether it tells them apart), pixel (of the view
    that it knows), state_dict and meta, that `load_model` reads; `meta` holds numbers, strings, lists and dicts. A
    model that states `half_kernels` gets the kernels of its convolutions stored in 16 bits, which halves the file and
    changes probabilities by less than a thousandth.
    """
    state = {name: tensor.detach().cpu().contiguous() for name, tensor in model.state_dict().items()}
    if getattr(model, "half_kernels", False):
        state = {name: tensor.half() if tensor.ndim == 4 else tensor for name, tensor in state.items()}
    checkpoint = {
        "architecture": architecture_of(model),
        "num_classes": getattr(model, "num_classes", None),
        "things": getattr(model, "things", False),
        "pixel": TorchEngine(model).takes.pixel,
        "state_dict": state,
        "meta": meta,
    }
    write_checkpoint(path, checkpoint)


def write_checkpoint(path, checkpoint: dict) -> None:
    """Write a dict of tensors and plain values as torch.save does, atomically; raises OSError if the disk is full."""
    buffer = io.BytesIO()
    torch.save(checkpoint, buffer)
    write_atomically(path, buffer.getvalue())


def read_checkpoint(name: str, path) -> dict:
    """Read a file of torch.save without unpickling objects; `name` is the argument that the errors speak of."""
    if not Path(path).is_file():
        raise FileNotFoundError(f"{name}: no file {path}")
    try:
        checkpoint = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # damaged zip, foreign pickle, plain text: torch raises half a dozen types for these
        reason = (str(error).strip().splitlines() or [type(error).__name__])[0]
        raise ValueError(
            f"{name}: {path} holds no weights that can be read (truncated or not weights?): {reason}"
        ) from error
    require(name, isinstance(checkpoint, dict), f"a dict of weights in {path}", type(checkpoint).__name__)
    return checkpoint


def load_model(path, num_classes: int = len(CLASSES), model: nn.Module | None = None) -> nn.Module:
    """Load a network from a file of `save_model`, or a bare state_dict; in eval mode, on the CPU.

    The architecture is the one that the file records, or else told from the names of its weights; model: a network of
    one's own to load the weights into instead. Nothing is ever unpickled (weights_only=True). Raises FileNotFoundError
    for a missing file, ValueError for one that is truncated, holds no weights, or weights of another network or for
    another number of classes. Topic 03.
    """
    checkpoint = read_checkpoint("path", path)
    state = checkpoint.get("state_dict", checkpoint)
    if not isinstance(state, dict) or not all(isinstance(value, torch.Tensor) for value in state.values()):
        raise ValueError(f"path: expected weights by name in {path}, got other things")
    odd = [name for name, w in state.items() if w.layout != torch.strided or w.is_quantized or w.is_meta]
    require("path", not odd, f"dense arrays in {path}", lambda: f"sparse or quantised ones: {', '.join(odd[:3])}")
    kit_s_own = model is None
    if kit_s_own:
        architecture = checkpoint.get("architecture") or told_by_weights(state)
        if architecture not in ARCHITECTURES:
            names = ", ".join(ARCHITECTURES)
            raise ValueError(f"path: expected weights of {names}, or `model`, for {path} of {architecture!r}")
        things = {"things": True} if checkpoint.get("things") else {}
        model = ARCHITECTURES[architecture](num_classes, **things)
        bias = state.get("logits.bias")
        trained_for = num_classes if bias is None else len(bias)
        if trained_for != num_classes:
            raise ValueError(
                f"num_classes: expected {trained_for}, the classes that {path} was trained for, got {num_classes}"
            )
    expected = model.state_dict()
    strange = len(state.keys() - expected.keys())
    fitting = sum(name in state and state[name].shape == weight.shape for name, weight in expected.items())
    if strange or fitting < len(expected):
        raise ValueError(
            f"path: expected the weights of {architecture_of(model)}, {len(expected)} arrays, got {fitting} that fit "
            f"and {strange} of other names in {path}"
        )
    model.load_state_dict(state)
    if kit_s_own:  # a file that does not state it is of a network that knows pictures as they are
        model.takes = replace(model.takes, pixel=checkpoint.get("pixel"))
    return model.to(memory_format=torch.channels_last).eval()


def told_by_weights(state: Mapping[str, torch.Tensor]) -> str:
    """Name of the architecture that weights without a name are of."""
    if "conv1.weight" in state:
        return "smallsegnet"
    stem = state.get("encoder.0.0.0.weight")
    return "unet" if stem is None or stem.shape[1] == 3 else "unet_rgbd"


def weights_path(model: str) -> Path:
    """Where weights are: the kit's own for a name in ARCHITECTURES, else `model` itself as a path.

    >>> weights_path("unet").name, str(weights_path("runs/mine.pt"))
    ('unet.pt', 'runs/mine.pt')
    """
    return WEIGHTS / f"{model}.pt" if model in ARCHITECTURES else Path(model)


class TorchEngine(Engine):
    """Any PyTorch network, run here: `TorchEngine(model)(rgb)` gives class probabilities.

    model: a module that maps its arrays, (N, channels, H, W), to logits (N, C, H, W), or to what `logits_of` finds them
    in, of a half to an eighth of the size as well. takes: what it takes; None asks the model's own attribute `takes`,
    else it gets RGB in 0..1. It runs in eval mode, and is left in the mode that it was in. class_names: by number,
    where the model's config has an id2label. Raises ValueError for logits of another shape.

    >>> mine = nn.Sequential(nn.Conv2d(3, 8, 3, padding=1), nn.ReLU(), nn.Conv2d(8, 2, 1))
    >>> TorchEngine(mine, NetworkInput(mean=127.5, std=127.5))(np.zeros((5, 7, 3), np.uint8)).shape
    (5, 7, 2)
    """

    def __init__(self, model: nn.Module, takes: NetworkInput | None = None):
        takes = takes or getattr(model, "takes", None) or NetworkInput(divisor=divisor_of(model))
        self.model, self.class_names = model, class_names(model)
        num_classes = getattr(model, "num_classes", None) or len(self.class_names) or None
        super().__init__(takes, num_classes and max(num_classes, 2), getattr(model, "things", False))

    def weight(self) -> torch.Tensor:
        """One of the network's weights: where it runs, and in which precision. A zero on the CPU if it has none."""
        held = chain(self.model.parameters(), self.model.buffers())
        return next((tensor for tensor in held if tensor.is_floating_point()), torch.zeros(()))

    def forward(self, *arrays: Float[np.ndarray, "N _ H W"]) -> Float[np.ndarray, "N C H W"]:
        """Run the network where its weights are, in their precision; gives logits, then `THINGS`, in float32."""
        return self._run(arrays, things=True)

    def classes(self, *arrays: Float[np.ndarray, "N _ H W"]) -> Float[np.ndarray, "N C H W"]:
        return self._run(arrays, things=False)

    def _run(self, arrays, things: bool) -> Float[np.ndarray, "N C H W"]:
        network = self.model.classes if self.things and not things else self.model
        with torch.inference_mode(), evaluating(self.model):
            result = self.run(network, *map(torch.from_numpy, arrays))
            if self.things and things:
                z = torch.cat([result["out"], result["things"]], dim=1)
            else:
                z = logits_of(result, tuple(arrays[0].shape[-2:]))
        return z.float().cpu().numpy()

    def run(self, network, *arrays: Float[torch.Tensor, "N _ H W"]):
        """What the network returns for its arrays, where its weights are and in their precision."""
        weight = self.weight()
        x = [array.to(weight.device, weight.dtype) for array in arrays]
        try:
            return network(*(each.contiguous(memory_format=torch.channels_last) for each in x))
        except (RuntimeError, TypeError) as error:  # as of a first layer that takes other channels
            given = " and ".join(f"{a} of {x.shape[1]} channels" for a, x in zip(self.takes.arrays, x, strict=True))
            why = str(error).splitlines()[0]
            told = f"one that takes {given} (its attribute `takes` says)"
            raise ValueError(f"model: expected {told}, got {why}") from error


class ProcessedEngine(TorchEngine):
    """A network that sees pictures as its Hugging Face processor prepares them: scaled, resized, padded.

    processor: as for `labkit.learning.foreign.Processor`. The logits are brought to the picture's own pixels as the
    processor's own post_process_semantic_segmentation does it, but without what was padded.
    """

    def __init__(self, model: nn.Module, processor):
        super().__init__(model, NetworkInput(std=1.0))
        self.processor = Processor(processor)

    def forward(self, image: Float[np.ndarray, "N 3 H W"]) -> Float[np.ndarray, "N C H W"]:
        return np.concatenate([self._of(rgb) for rgb in image.transpose(0, 2, 3, 1).astype(np.uint8)])

    classes = forward

    def _of(self, rgb) -> Float[np.ndarray, "1 C H W"]:
        with torch.inference_mode(), evaluating(self.model):
            pixels = self.processor.pixels(rgb)
            z = raw_logits(self.run(self.model, pixels)).float()
            return self.processor.back(z, rgb, pixels).cpu().numpy()


@contextmanager
def evaluating(model: nn.Module):
    """Put a model into eval mode, and each of its parts back afterwards: some may be frozen in it for good."""
    training = [part for part in model.modules() if part.training]
    try:
        yield model.eval()
    finally:
        for part in training:
            part.training = True
