"""From one picture to class probabilities, whatever gives them (topics 03 and 09).

A network states what it takes: which arrays, on what scale, of what sizes. All that lies between a picture and the
probabilities is done here, once for every engine: the arrays are built and padded, the network's logits are cropped,
softmax makes them probabilities, and those of the mirror image may be averaged in. A network that states the size of a
pixel sees each frame's canonical view (`labkit.learning.view`). Only the network's own run, from arrays to logits, is
an engine's.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, UInt8

from labkit.frame import RGBDFrame
from labkit.labels import IGNORE
from labkit.learning.channels import geometry_channels, mirrored
from labkit.learning.view import CanonicalView, canonical_view
from labkit.support.validation import check_finite, check_rgb, check_shape, require

VOTE_UNIT = 20.0  # pixels of the view that a network's output of 1 means in a vote
# What a network may give beside its classes at each pixel: a logit, and a vote in units of VOTE_UNIT.
THINGS = ("foreground", "du", "dv")


@dataclass(frozen=True)
class NetworkInput:
    """What a network takes. It says so in its attribute `takes`, and a file of `labkit export` in its metadata.

    arrays: "image", or "image" and "geometry", in the order of the network's arguments. The image is (rgb - mean) / std
    with rgb in 0..255; mean and std are one number, or one for each of R, G and B; the default scales to 0..1. geometry
    is what depth, calibration and the table's height tell (`channels.geometry_channels`), seven channels in
    0..1, all 0.5 where the camera read no depth. divisor: what height and width must be divisible by; pictures of other
    sizes are padded by repeating their border, and the logits are cropped. pixel: metres that the median pixel of a
    frame's canonical view covers, if the network knows such views; None if it takes pictures as they are. Raises
    ValueError for an argument that does not fit.

    >>> NetworkInput(divisor=16).build(np.full((1, 1, 3), 51, np.uint8))[0].astype(float).round(3).tolist()
    [[[0.2, 0.2, 0.2]]]
    """

    arrays: tuple[str, ...] = ("image",)
    mean: float | tuple[float, float, float] = 0.0
    std: float | tuple[float, float, float] = 255.0
    divisor: int = 1
    pixel: float | None = None

    def __post_init__(self):
        if self.arrays not in (("image",), ("image", "geometry")):
            raise ValueError(f'arrays: expected ("image",) or ("image", "geometry"), got {self.arrays!r}')
        for name in ("mean", "std"):
            require(name, np.shape(getattr(self, name)) in ((), (3,)), "one number or three", repr(getattr(self, name)))
        require("std", np.min(self.std) > 0.0, "numbers above 0", repr(self.std))
        require("divisor", self.divisor >= 1, "at least 1", repr(self.divisor))
        require("pixel", self.pixel is None or self.pixel > 0.0, "metres above 0, or None", repr(self.pixel))

    def view(self, picture: RGBDFrame | UInt8[np.ndarray, "H W 3"]) -> CanonicalView | None:
        """The canonical view that the network gets to see; None if it sees the picture as it is.

        That is so for a network that states no `pixel`, an RGB image, and a frame without any depth.
        """
        if self.pixel is None or not isinstance(picture, RGBDFrame):
            return None
        return canonical_view(picture, self.pixel)

    def build(self, picture: RGBDFrame | UInt8[np.ndarray, "H W 3"]) -> list[Float32[np.ndarray, "H W _"]]:
        """Build the arrays for one picture: a frame, or an RGB image for a network that takes nothing else."""
        is_frame = isinstance(picture, RGBDFrame)
        arrays = [self.scaled(picture.rgb if is_frame else check_rgb("rgb", picture))]
        if "geometry" in self.arrays:
            require("picture", is_frame, "an RGBDFrame, since the network looks at depth", "an RGB image")
            depth, K, T = picture.depth, picture.K, picture.T_base_cam
            arrays.append(geometry_channels(depth, K, T, picture.table_z or 0.0))
        return arrays

    def scaled(self, rgb: UInt8[np.ndarray, "*shape 3"]) -> Float32[np.ndarray, "*shape 3"]:
        """Scale colours as the network expects them."""
        return (rgb - np.float32(self.mean)) / np.float32(self.std)


@dataclass(frozen=True, eq=False)
class InstanceOutput:
    """What a network says of things, at the pixels of the view that it saw, (h, w).

    foreground: probability that the pixel is on a thing. votes: where the middle of its thing's visible pixels is, as
    (du, dv) in pixels of the view from the pixel itself. view: the way back to the picture's own pixels; None if the
    network saw the picture as it is.
    """

    foreground: Float32[np.ndarray, "h w"]
    votes: Float32[np.ndarray, "h w 2"]
    view: CanonicalView | None


class Engine(ABC):
    """A network that is ready to run: `engine(picture)` gives class probabilities, `engine.logits(picture)` logits.

    takes: what the network takes. num_classes: how many classes it tells apart, None if it does not say. things:
    whether it tells things apart as well; `engine.predict_instances(picture)` then gives that, too.
    """

    def __init__(self, takes: NetworkInput, num_classes: int | None = None, things: bool = False):
        self.takes, self.num_classes, self.things = takes, num_classes, things

    @abstractmethod
    def forward(self, *arrays: Float32[np.ndarray, "N _ H W"]) -> Float32[np.ndarray, "N C H W"]:
        """Run the network on its arrays, of a height and width that it takes; gives logits, then `THINGS` if any."""

    def classes(self, *arrays: Float32[np.ndarray, "N _ H W"]) -> Float32[np.ndarray, "N C H W"]:
        """As `forward`, but logits alone."""
        z = self.forward(*arrays)
        return z[:, : self.num_classes] if self.things else z

    def __call__(
        self, picture: RGBDFrame | UInt8[np.ndarray, "H W 3"], flip_tta: bool = False
    ) -> Float32[np.ndarray, "H W C"]:
        """Class probabilities of a picture, of any height and width: the softmax of the logits (topic 03).

        flip_tta: average them with those of the mirrored picture, mirrored back (test-time flip): two opinions, at
        twice the price, whose errors differ. Raises ValueError if the picture is not what the network takes, or the
        result is not finite (the weights may hold NaN).
        """
        view, arrays = self._seen(picture)
        return self._probabilities(
            view, [self._outputs(arrays, m, self.classes) for m in (False, True)[: 1 + flip_tta]]
        )

    def predict_instances(
        self, picture: RGBDFrame | UInt8[np.ndarray, "H W 3"], flip_tta: bool = False
    ) -> tuple[Float32[np.ndarray, "H W C"], InstanceOutput | None]:
        """Class probabilities of a picture and, by the same run of the network, what it says of things; else None.

        Arguments and errors as for the engine itself. In a mirror, votes change the sign of du; both are averaged.
        """
        if not self.things:
            return self(picture, flip_tta), None
        view, arrays = self._seen(picture)
        runs = [self._outputs(arrays, m, self.forward) for m in (False, True)[: 1 + flip_tta]]
        p = self._probabilities(view, [z[: self.num_classes] for z in runs])
        z = np.stack([z[self.num_classes :] for z in runs])
        if flip_tta:
            z[1, THINGS.index("du")] *= -1.0
        z = check_finite("things", z)
        with np.errstate(over="ignore"):  # exp of a large number: the foreground is 0
            foreground = (1.0 / (1.0 + np.exp(-z[:, 0]))).mean(axis=0)
        return p, InstanceOutput(foreground, z[:, 1:].mean(axis=0).transpose(1, 2, 0) * np.float32(VOTE_UNIT), view)

    def logits(
        self, picture: RGBDFrame | UInt8[np.ndarray, "H W 3"], mirror: bool = False
    ) -> Float32[np.ndarray, "C H W"]:
        """Logits of one picture, of any height and width; raises ValueError if it is not what the network takes.

        mirror: those of the mirrored picture, mirrored back. Logits of a canonical view are brought back to the
        picture's own pixels.
        """
        view, arrays = self._seen(picture)
        z = self._outputs(arrays, mirror, self.classes)
        check_class_count("model", len(z))
        return self._back(view, z)

    def _seen(self, picture):
        """The canonical view of a picture, None if the network sees it as it is, and the arrays for the network."""
        view = self.takes.view(picture)
        return view, self.takes.build(picture if view is None else view.frame)

    def _probabilities(self, view, runs: Sequence[Float32[np.ndarray, "C h w"]]) -> Float32[np.ndarray, "H W C"]:
        """The class probabilities of one run, or the mean of two runs', at the picture's own pixels."""
        check_class_count("model", len(runs[0]))
        p = _softmax(self._back(view, runs[0]))
        for z in runs[1:]:
            p = 0.5 * (p + _softmax(self._back(view, z)))
        return check_finite("probabilities", np.ascontiguousarray(p.transpose(1, 2, 0)))

    def _outputs(self, arrays, mirror: bool, run: Callable) -> Float32[np.ndarray, "C h w"]:
        """What `run` gives for the arrays of one picture, or of its mirror image, mirrored back."""
        z = self.padded([(mirrored(array) if mirror else array)[None] for array in arrays], run)[0]
        return z[..., ::-1] if mirror else z

    def _back(self, view: CanonicalView | None, z: Float32[np.ndarray, "C h w"]) -> Float32[np.ndarray, "C H W"]:
        """Bring channels of the view to the picture's own pixels."""
        return z if view is None else view.back(z.transpose(1, 2, 0)).transpose(2, 0, 1)

    def padded(
        self, arrays: Sequence[Float32[np.ndarray, "N H W _"]], run: Callable | None = None
    ) -> Float32[np.ndarray, "N C H W"]:
        """Run the network on arrays of any height and width: pad them by repeating their border, crop the logits.

        run: `classes`, the default, gives logits alone; `forward` also what the network says of things.
        """
        height, width = arrays[0].shape[1:3]
        down, right = (self.padded_side(side) - side for side in (height, width))
        if down or right:
            arrays = [np.pad(array, ((0, 0), (0, down), (0, right), (0, 0)), mode="edge") for array in arrays]
        # Channels stay last in memory: PyTorch's convolutions are fastest there, and other engines make their own copy.
        run = run or self.classes
        z = run(*(np.ascontiguousarray(array).transpose(0, 3, 1, 2) for array in arrays))[..., :height, :width]
        return z if self.things else as_logits(z)

    def padded_side(self, side: int) -> int:
        """The height or width that a picture's is padded to."""
        return -(-side // self.takes.divisor) * self.takes.divisor


class FunctionEngine(Engine):
    """A plain function from an RGB image, uint8 (H, W, 3), to class probabilities (H, W, C) in the place of a network.

    It decides for itself whether to look into the mirror, too. Its logits are the logarithms of its probabilities.
    Raises ValueError if what it gives is no probabilities.
    """

    def __init__(self, function: Callable[[np.ndarray], np.ndarray]):
        super().__init__(NetworkInput(std=1.0))
        self.function = function

    def __call__(
        self, picture: RGBDFrame | UInt8[np.ndarray, "H W 3"], flip_tta: bool = False
    ) -> Float[np.ndarray, "H W C"]:
        rgb = picture.rgb if isinstance(picture, RGBDFrame) else check_rgb("rgb", picture)
        try:
            p = self.function(rgb)
        except AttributeError as error:
            if not isinstance(getattr(error, "obj", None), np.ndarray):
                raise
            wanted = "a function of an RGB image; of a frame, to numbers of objects, it is Pipeline(find_objects=...)"
            raise ValueError(f"model: expected {wanted}, got one that asks the image for {error.name!r}") from error
        return check_probabilities(p, rgb.shape[:2])

    def forward(self, image: Float32[np.ndarray, "N 3 H W"]) -> Float32[np.ndarray, "N C H W"]:
        with np.errstate(divide="ignore"):  # the logarithm of 0
            z = np.log([self(rgb) for rgb in image.transpose(0, 2, 3, 1).astype(np.uint8)])
        return z.transpose(0, 3, 1, 2).astype(np.float32)


def check_class_count(name: str, count: int) -> None:
    """Raise a ValueError naming the argument unless labels of 8 bits can tell so many classes apart, 255 being none."""
    require(name, 1 <= count <= IGNORE, f"1 to {IGNORE} classes", count)


def check_probabilities(p, size: tuple[int, int]) -> Float[np.ndarray, "H W C"]:
    """Return what a model gave as an array (H, W, C) if these are probabilities of its classes at each pixel.

    Raises ValueError for another shape, NaN (the weights may hold it), and logits or 0..255 scores.

    >>> check_probabilities([[[20, 235]]], (1, 1))
    Traceback (most recent call last):
    ...
    ValueError: probabilities: expected numbers in 0..1 that sum to 1 at each pixel, got 20 to 235; are they scores?
    """
    p = check_finite("probabilities", check_shape("probabilities", p, (*size, None)))
    check_class_count("probabilities", p.shape[-1])
    low, high = p.min(), p.max()
    total = p @ np.ones(p.shape[-1], np.float32)  # several times as fast as p.sum(axis=-1)
    fits = low >= -1e-3 and high <= 1.001 and np.abs(total - 1.0).max() <= 0.01
    expected = "numbers in 0..1 that sum to 1 at each pixel"
    require("probabilities", fits, expected, lambda: f"{low:.4g} to {high:.4g}; are they scores?")
    return p if p.dtype.kind == "f" else p.astype(np.float32)


def as_logits(z: Float32[np.ndarray, "N _ H W"]) -> Float32[np.ndarray, "N C H W"]:
    """Logits of what a network gives: of one channel those of two classes, of probabilities their logarithms.

    Softmax of (0, z) is (1 - s, s) with the sigmoid s = 1 / (1 + exp(-z)): so one channel is the logit of class 1, or,
    if all is in 0..1, the sigmoid of it already. Several channels in 0..1 that sum to 1 are probabilities.

    >>> print(as_logits(np.array([0.5, 0.75], np.float32).reshape(1, 1, 1, 2))[0, 1].round(3))
    [[0.    1.099]]
    """
    within = z.size > 0 and z.min() >= 0.0 and z.max() <= 1.0
    if z.shape[1] == 1:
        if within:
            p = np.clip(z, 1e-7, 1.0 - 1e-7)
            z = np.log(p / (1.0 - p))
        return np.concatenate([np.zeros_like(z), z], axis=1)
    if within and np.abs(z.sum(axis=1) - 1.0).max() < 1e-3:
        return np.log(np.maximum(z, 1e-12))
    return z


def _softmax(z: Float32[np.ndarray, "C H W"]) -> Float32[np.ndarray, "C H W"]:
    """Softmax over the first axis: whole images at a time are several times as fast as short last axes."""
    z = np.ascontiguousarray(z)
    e = np.exp(z - z.max(axis=0))
    e /= e.sum(axis=0)
    return e
