"""Random changes of a training batch that leave its labels true: the network must not learn what may change.

Every change works on a batch as tensors and takes its random numbers from the `Draws` that it is given, so that a seed
gives the same batch again. Images are float (N, 3, H, W) in [0, 1], labels integer (N, H, W).
"""

import torch
from jaxtyping import Float, Integer, UInt8
from torch.nn import functional as F

from labkit.support.validation import require


class Draws:
    """Random numbers for a batch that several processes may share.

    The batch has `whole` images; this process makes `made` of them, beginning with image `first`. It draws the numbers
    of all and keeps those of its own, so that an image is changed in the same way whichever process makes it.

    >>> draws = [Draws(torch.Generator().manual_seed(0), 5, *part) for part in ((), (0, 2), (2, 3))]
    >>> whole, *parts = [draw.uniform(0.0, 1.0, 2) for draw in draws]
    >>> bool((torch.cat(parts) == whole).all())
    True
    """

    def __init__(self, generator: torch.Generator, whole: int, first: int = 0, made: int | None = None):
        self.generator, self.whole = generator, whole
        self.rows = slice(first, whole if made is None else first + made)

    def uniform(self, low: float, high: float, *shape: int) -> torch.Tensor:
        """Draw numbers between `low` and `high`: (made, *shape)."""
        return low + (high - low) * torch.rand((self.whole, *shape), generator=self.generator)[self.rows]

    def integers(self, high: int, *shape: int) -> torch.Tensor:
        """Draw integers from 0 to `high` - 1: (made, *shape)."""
        return torch.randint(0, high, (self.whole, *shape), generator=self.generator)[self.rows]


def random_crop(
    rgb: UInt8[torch.Tensor, "N H W 3"],
    y: UInt8[torch.Tensor, "N H W"],
    size: tuple[int, int],
    draws: Draws,
    zoom: float = 1.0,
) -> tuple[Float[torch.Tensor, "N 3 h w"], UInt8[torch.Tensor, "N h w"]]:
    """Cut a window of (h, w) pixels at a random place of each image, and turn its bytes into floats in [0, 1].

    zoom: the window holds `zoom` times fewer pixels along each axis and is enlarged (labels by nearest neighbour).
    Raises ValueError if the window is larger than the image.

    >>> rgb, y = torch.zeros(2, 6, 8, 3, dtype=torch.uint8), torch.zeros(2, 6, 8, dtype=torch.uint8)
    >>> [tuple(t.shape) for t in random_crop(rgb, y, (4, 4), Draws(torch.Generator(), 2))]
    [(2, 3, 4, 4), (2, 4, 4)]
    """
    H, W = y.shape[1:]
    h, w = (round(length / zoom) for length in size)
    require("size", h <= H and w <= W, f"a window within {(H, W)}", (h, w))
    rows, columns = draws.integers(H - h + 1).tolist(), draws.integers(W - w + 1).tolist()
    windows = [(i, slice(r, r + h), slice(c, c + w)) for i, (r, c) in enumerate(zip(rows, columns, strict=True))]
    # Bytes (N, h, w, 3) seen as (N, 3, h, w) are channels_last as they stand: no transpose is ever made.
    x = torch.stack([rgb[window] for window in windows]).permute(0, 3, 1, 2).float().div_(255.0)
    y = torch.stack([y[window] for window in windows])
    if (h, w) != tuple(size):
        x = F.interpolate(x, size=tuple(size), mode="bilinear")
        y = F.interpolate(y[:, None], size=tuple(size), mode="nearest-exact")[:, 0]
    return x, y


def random_flip(
    x: Float[torch.Tensor, "N 3 H W"], y: Integer[torch.Tensor, "N H W"], draws: Draws
) -> tuple[Float[torch.Tensor, "N 3 H W"], Integer[torch.Tensor, "N H W"]]:
    """Mirror about half of the images left to right, and their labels with them; in place."""
    flip = draws.uniform(0.0, 1.0) < 0.5
    x[flip], y[flip] = x[flip].flip(-1), y[flip].flip(-1)
    return x, y


def random_colour(x: Float[torch.Tensor, "N 3 H W"], draws: Draws) -> Float[torch.Tensor, "N 3 H W"]:
    """Change each image's white balance, contrast, brightness and saturation: one affine map of its colours."""
    gains = draws.uniform(0.8, 1.25, 1, 1) * draws.uniform(0.85, 1.18, 3, 1)
    saturation = draws.uniform(0.5, 1.4, 1, 1)
    grey = torch.full((3, 3), 1.0 / 3.0)
    A = gains * (grey + saturation * (torch.eye(3) - grey))
    b = 0.5 - 0.5 * gains[..., 0] + draws.uniform(-0.12, 0.12, 1)
    return torch.einsum("ncd,ndhw->nchw", A, x) + b[..., None, None]


def random_hue(x: Float[torch.Tensor, "N 3 H W"], draws: Draws) -> Float[torch.Tensor, "N 3 H W"]:
    """Swap the colours of some images, take them from some, and the whole picture from a few."""
    whole = torch.rand(draws.whole, generator=draws.generator).tolist()
    orders = [torch.randperm(3, generator=draws.generator) if share < 0.3 else None for share in whole]
    for i, (share, order) in enumerate(zip(whole[draws.rows], orders[draws.rows], strict=True)):
        if order is not None:
            x[i] = x[i][order]
        elif share < 0.4:
            x[i] = x[i].mean(dim=0, keepdim=True)
        elif share < 0.46:
            x[i] = 0.5
    return x


def random_sharpness(x: Float[torch.Tensor, "N 3 H W"], draws: Draws) -> Float[torch.Tensor, "N 3 H W"]:
    """Blur some images and sharpen others a little: towards their 3x3 mean, or away from it; half stay as they are."""
    amount = draws.uniform(-0.4, 0.8) * (draws.uniform(0.0, 1.0) < 0.5)
    mean = F.avg_pool2d(x, 3, stride=1, padding=1, count_include_pad=False)
    return torch.lerp(x, mean, amount[:, None, None, None])


def random_noise(x: Float[torch.Tensor, "N 3 H W"], draws: Draws) -> Float[torch.Tensor, "N 3 H W"]:
    """Add a sensor's noise, of another strength in each image.

    One noise image serves the batch, rolled to another place each time: drawing it is what costs.
    """
    noise = torch.randn(x[0].shape, generator=draws.generator).permute(1, 2, 0).contiguous().permute(2, 0, 1)
    strength = draws.uniform(0.0, 0.04)
    shifts = draws.integers(64, 2).tolist()
    rolled = torch.stack([noise.roll(shift, (1, 2)) for shift in shifts])
    return x + strength[:, None, None, None] * rolled


def augment(
    rgb: UInt8[torch.Tensor, "N H W 3"],
    y: UInt8[torch.Tensor, "N H W"],
    size: tuple[int, int],
    generator: torch.Generator,
    first: int = 0,
    whole: int | None = None,
) -> tuple[Float[torch.Tensor, "N 3 h w"], UInt8[torch.Tensor, "N h w"]]:
    """Crop to `size` (h, w), zoom every other batch, flip, and change colour, sharpness and noise.

    first, whole: these images are a part of a batch of `whole` images, from number `first` on; all of it if not given.
    The same generator state gives the same batch; 255 stays 255. Raises ValueError if `size` exceeds the image.

    >>> rgb, y = torch.zeros(2, 6, 8, 3, dtype=torch.uint8), torch.full((2, 6, 8), 255, dtype=torch.uint8)
    >>> x, y = augment(rgb, y, (4, 4), torch.Generator().manual_seed(0))
    >>> tuple(x.shape), float(x.min()) >= 0.0, y.unique().tolist()
    ((2, 3, 4, 4), True, [255])
    """
    zoom = 1.0
    if torch.rand((), generator=generator) < 0.5:
        # Zooming out is limited by the image: a window cannot be larger than it.
        widest = max(0.8, size[0] / y.shape[1], size[1] / y.shape[2])
        zoom = float(Draws(generator, 1).uniform(min(widest, 1.0), 1.25))
    draws = Draws(generator, whole or len(y), first, len(y))
    x, y = random_flip(*random_crop(rgb, y, size, draws, zoom), draws)
    x = random_noise(random_sharpness(random_colour(x, draws), draws), draws)
    return x.clamp_(0.0, 1.0).contiguous(memory_format=torch.channels_last), y
