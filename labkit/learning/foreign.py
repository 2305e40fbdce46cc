"""Networks as other libraries give them: where their logits are, of what size, and what a processor does (topic 03).

torchvision's and segmentation_models_pytorch's networks, and those of Hugging Face with their image processors; none
of these packages is needed here.
"""

from collections.abc import Mapping

import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch.nn import functional as F

from labkit.support.validation import require

COARSEST = 8  # of a picture's height and width to those of logits


def logits_of(result, size: tuple) -> Float[torch.Tensor, "N C H W"]:
    """The logits in what a network returned for pictures of height and width `size`, at each of their pixels.

    A tensor, a dict with them as "out" (torchvision), or an object with `.logits` (Hugging Face). Where they are a half
    to an eighth as high and wide, they are interpolated bilinearly, as SegFormer's and DeepLab's papers do before the
    softmax. Raises ValueError for others.

    >>> logits_of({"out": torch.tensor([[[[0.0, 4.0]]]])}, (2, 4))[0, 0, 0].tolist()
    [0.0, 1.0, 3.0, 4.0]
    """
    z = raw_logits(result)
    (h, w), (H, W) = z.shape[-2:], size
    if (h, w) == (H, W):
        return z
    sides = all(1.0 <= N / n <= COARSEST or abs(N / COARSEST - n) < 1.0 for n, N in ((h, H), (w, W)))
    like = f"logits (N, C, H, W) with H, W = {size}, or a half to an eighth of it"
    require("model", sides and abs(h * W - w * H) <= max(H, W), like, tuple(z.shape))
    return F.interpolate(z, size, mode="bilinear")


def raw_logits(result) -> Float[torch.Tensor, "N C h w"]:
    """The logits in what a network returned, of whatever size; raises ValueError if there are none."""
    z = result.get("out", result.get("logits")) if isinstance(result, Mapping) else getattr(result, "logits", result)
    if not isinstance(z, torch.Tensor) or z.ndim != 4:
        got = tuple(z.shape) if isinstance(z, torch.Tensor) else type(result).__name__
        got = f"one with {', '.join(map(str, result))}" if isinstance(result, Mapping) else got
        raise ValueError(f'model: expected logits (N, C, H, W), as a tensor, as "out" or as .logits, got {got}')
    return z


def divisor_of(model: torch.nn.Module) -> int:
    """What height and width must be divisible by: networks of segmentation_models_pytorch say it of their encoder."""
    return model.encoder.output_stride if getattr(model, "requires_divisible_input_shape", False) else 1


def class_names(model: torch.nn.Module) -> dict[int, str]:
    """The names of a network's classes by number, as Hugging Face's networks have them; none of another."""
    names = getattr(getattr(model, "config", None), "id2label", None) or {}
    return {int(number): str(name) for number, name in names.items()}


class Processor:
    """A Hugging Face image processor, and the way back from the pixels that it makes to the picture's.

    processor: an image processor, or one that has such as `image_processor`. Raises ValueError for another object, and
    for a processor that crops the picture: nobody would know what lies beyond.
    """

    def __init__(self, processor):
        processor = getattr(processor, "image_processor", processor)
        require("processor", callable(processor), "an image processor of Hugging Face", type(processor).__name__)
        crops = getattr(processor, "do_center_crop", False)
        require("processor", not crops, "one that keeps the whole picture, do_center_crop=False", "one that crops it")
        self.processor = processor

    def pixels(self, rgb: UInt8[np.ndarray, "H W 3"], **how) -> Float[torch.Tensor, "1 3 h w"]:
        """What the network gets to see of a picture."""
        values = self.processor(images=rgb, return_tensors="pt", input_data_format="channels_last", **how)
        return torch.as_tensor(values["pixel_values"])

    def back(self, z: Float[torch.Tensor, "1 C h w"], rgb: UInt8[np.ndarray, "H W 3"], pixels):
        """Bring logits of the processor's pixels to the picture's own, bilinearly; padding is cut off first."""
        if getattr(self.processor, "do_pad", False):
            rows, columns = _place(self.pixels(rgb, do_pad=False), pixels)
            z = F.interpolate(z, pixels.shape[-2:], mode="bilinear")[..., rows, columns]
        return F.interpolate(z, rgb.shape[:2], mode="bilinear")


def _place(part: Float[torch.Tensor, "1 3 h w"], whole: Float[torch.Tensor, "1 3 H W"]) -> tuple[slice, slice]:
    """Where a picture lies in its padded one: first row and column, or in the middle."""
    (h, w), (H, W) = part.shape[-2:], whole.shape[-2:]
    for top, left in ((0, 0), ((H - h) // 2, (W - w) // 2)):
        place = slice(top, top + h), slice(left, left + w)
        if h <= H and w <= W and torch.equal(whole[..., *place], part):
            return place
    raise ValueError("processor: expected one that pads at the right and below, or around, got another padding")
