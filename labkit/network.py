"""The two networks of the kit, their weights on disk, and class probabilities (the text's sections 3 and 6)."""

import io
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import nn
from torch.nn import functional as F

from labkit.labels import CLASSES
from labkit.support.files import write_atomically
from labkit.support.validation import check_rgb


class SmallSegNet(nn.Module):
    """The text's compact encoder-decoder: two poolings, two transposed convolutions, 134,436 weights (section 6).

    A pixel's logits depend on about 20 pixels around it, so it knows colours and edges but not the shape of an object.
    Height and width must be divisible by 4 (the text does not say so): else ValueError. `predict_probabilities` takes
    any size, since it pads and crops.

    >>> SmallSegNet()(torch.zeros(1, 3, 8, 12)).shape
    torch.Size([1, 4, 8, 12])
    """

    divisor = 4  # of height and width

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
        if x.shape[-2] % 4 or x.shape[-1] % 4:
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
    encoder's features at each scale, which know where the edges are. Any height and width: the image is padded to
    a multiple of 16 by repeating its border, and the logits are cropped.

    widths: channels at 1/2, 1/4, 1/8 and 1/16. blocks: residual blocks there. Section 3 of the text.

    >>> UNet(num_classes=4).eval()(torch.zeros(1, 3, 37, 61)).shape
    torch.Size([1, 4, 37, 61])
    """

    divisor = 1  # of height and width

    def __init__(
        self,
        num_classes: int = len(CLASSES),
        widths: tuple[int, ...] = (32, 64, 96, 96),
        blocks: tuple[int, ...] = (0, 1, 2, 1),
    ):
        super().__init__()
        self.num_classes = num_classes
        self.stride = 2 ** len(widths)
        # A 6x6 kernel of stride 2 sees a pixel's 2x2 cell and two pixels around it, so that the stem loses no detail.
        encoder = [nn.Sequential(convolution(3, widths[0], 6, 2), *[Residual(widths[0]) for _ in range(blocks[0])])]
        for below, above, count in zip(widths[:-1], widths[1:], blocks[1:], strict=True):
            encoder.append(nn.Sequential(convolution(below, above, 3, 2), *[Residual(above) for _ in range(count)]))
        self.encoder = nn.ModuleList(encoder)
        scales = range(len(widths) - 1)
        self.narrow = nn.ModuleList(convolution(widths[i + 1], widths[i], 1) for i in scales)
        self.decoder = nn.ModuleList(convolution(widths[i], widths[i]) for i in scales)
        self.logits = nn.ConvTranspose2d(widths[0], num_classes, kernel_size=4, stride=2, padding=1)

    def forward(self, x: Float[torch.Tensor, "N 3 H W"]) -> Float[torch.Tensor, "N C H W"]:
        """Map images in [0, 1] to logits of the same height and width."""
        height, width = x.shape[-2:]
        return self.on_grid(pad_to_multiple(x, self.stride))[..., :height, :width]

    def on_grid(self, x: Float[torch.Tensor, "N 3 H W"]) -> Float[torch.Tensor, "N C H W"]:
        """Do the same for a height and width divisible by `stride`: nothing to pad or crop, so an export is plain."""
        x = x - 0.5
        skips = []
        for stage in self.encoder:
            x = stage(x)
            skips.append(x)
        for i in reversed(range(len(self.decoder))):
            x = F.interpolate(self.narrow[i](x), scale_factor=2, mode="bilinear")
            x = self.decoder[i](x + skips[i])
        return self.logits(x)


WEIGHTS = Path(__file__).parent / "weights"  # shipped with the kit; MODEL_CARD.md beside them says what they can do
ARCHITECTURES = {"smallsegnet": SmallSegNet, "unet": UNet}


def architecture_of(model: nn.Module) -> str:
    """Name of a model's architecture, a key of ARCHITECTURES."""
    names = [name for name, kind in ARCHITECTURES.items() if type(model) is kind]
    if not names:
        raise ValueError(f"model: expected one of {sorted(ARCHITECTURES)}, got {type(model).__name__}")
    return names[0]


def pad_to_multiple(x: Float[torch.Tensor, "N C H W"], multiple: int) -> Float[torch.Tensor, "N C H2 W2"]:
    """Repeat an image's last row and column until its height and width are multiples of `multiple`."""
    down, right = -x.shape[-2] % multiple, -x.shape[-1] % multiple
    return F.pad(x, (0, right, 0, down), mode="replicate") if down or right else x


def save_model(model: nn.Module, path, **meta) -> None:
    """Write a model's weights, its architecture and plain facts about it (`meta`), atomically.

    The file is a dict with keys architecture, num_classes, state_dict and meta, that `load_model` reads; `meta` holds
    numbers, strings, lists and dicts.
    """
    checkpoint = {
        "architecture": architecture_of(model),
        "num_classes": model.num_classes,
        "state_dict": {name: tensor.detach().cpu().contiguous() for name, tensor in model.state_dict().items()},
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
    if not isinstance(checkpoint, dict):
        raise ValueError(f"{name}: expected a dict of weights in {path}, got {type(checkpoint).__name__}")
    return checkpoint


def load_model(path, num_classes: int = len(CLASSES)) -> SmallSegNet | UNet:
    """Load either network from a file of `save_model`, or a bare state_dict as in the text; in eval mode, on the CPU.

    The architecture is the one that the file records, or else told from the names of its weights. Nothing is ever
    unpickled (weights_only=True). Raises FileNotFoundError for a missing file, ValueError for one that is truncated,
    holds no weights, or weights for another number of classes. Section 6 of the text.
    """
    checkpoint = read_checkpoint("path", path)
    state = checkpoint.get("state_dict", checkpoint)
    if not isinstance(state, dict) or not all(isinstance(value, torch.Tensor) for value in state.values()):
        raise ValueError(f"path: expected weights by name in {path}, got other things")
    architecture = checkpoint.get("architecture", "smallsegnet" if "conv1.weight" in state else "unet")
    if architecture not in ARCHITECTURES:
        raise ValueError(
            f"path: expected an architecture among {sorted(ARCHITECTURES)} in {path}, got {architecture!r}"
        )
    model = ARCHITECTURES[architecture](num_classes)
    bias = state.get("logits.bias")
    if bias is not None and bias.shape != (num_classes,):
        raise ValueError(
            f"num_classes: expected {len(bias)}, the classes that {path} was trained for, got {num_classes}"
        )
    try:
        model.load_state_dict(state)
    except RuntimeError as error:
        raise ValueError(f"path: the weights in {path} do not fit {architecture}: {error}") from error
    return model.to(memory_format=torch.channels_last).eval()


def weights_path(model: str) -> Path:
    """Where weights are: the kit's own for "unet" and "smallsegnet", else `model` itself as a path.

    >>> weights_path("unet").name, str(weights_path("runs/mine.pt"))
    ('unet.pt', 'runs/mine.pt')
    """
    return WEIGHTS / f"{model}.pt" if model in ARCHITECTURES else Path(model)


def predict_logits(model: nn.Module, rgb: UInt8[np.ndarray, "H W 3"]) -> Float[torch.Tensor, "C H W"]:
    """Run a network on one RGB image; any height and width (padded as needed, and cropped).

    Raises ValueError if `rgb` is no RGB image. Float32, channels_last: on a CPU two to three times as fast as NCHW.
    """
    rgb = check_rgb("rgb", rgb)
    weight = next(model.parameters())
    with torch.inference_mode():
        # (H, W, 3) bytes seen as (1, 3, H, W) are channels_last as they stand.
        x = torch.from_numpy(np.ascontiguousarray(rgb)).to(weight.device)[None].permute(0, 3, 1, 2)
        x = pad_to_multiple(x.to(weight.dtype) / 255.0, getattr(model, "divisor", 1))
        return model(x)[0, :, : rgb.shape[0], : rgb.shape[1]].float()


def predict_probabilities(
    model: nn.Module, rgb: UInt8[np.ndarray, "H W 3"], mirror: bool = False
) -> Float[np.ndarray, "H W C"]:
    """Give each pixel's class probabilities, float32, the softmax of the network's logits (section 3 of the text).

    mirror: average them with those of the mirrored image, mirrored back: two opinions, of twice the price, whose
    errors differ. `model` is in eval mode. Raises ValueError if `rgb` is no RGB image.

    >>> predict_probabilities(SmallSegNet().eval(), np.zeros((5, 7, 3), np.uint8)).shape
    (5, 7, 4)
    """
    with torch.inference_mode():
        p = F.softmax(predict_logits(model, rgb).permute(1, 2, 0), dim=-1)
        if mirror:
            mirrored = predict_logits(model, rgb[:, ::-1].copy())
            p = 0.5 * (p + F.softmax(mirrored.permute(1, 2, 0), dim=-1).flip(1))
        return p.cpu().numpy()
