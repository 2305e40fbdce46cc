"""Telling things apart: each pixel votes for the middle of its thing, and votes that agree are one thing.

Classes cannot do it: two mugs that touch are one region of "mug". So the network says three more numbers at each pixel
(`labkit.learning.inference.THINGS`): whether it is on a thing at all, and the arrow (du, dv) from the pixel to the
middle of its thing's visible pixels. That is a Hough transform with a learnt vote. Hough found lines so: each point
votes for every line it may lie on, and a line is where many votes meet. Here a pixel x has one vote, the place x +
d(x), and n pixels of one thing that vote without error put n votes on one place; pixels of its neighbour, however
close, put theirs on another. With errors of a few pixels the n votes lie in a spot, which a histogram, smoothed, turns
into a peak. What two things share is no longer a border but a valley between two peaks.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import cv2
import numpy as np
from jaxtyping import Float, Float32, Int32, Integer

from labkit.frame import RGBDFrame
from labkit.labels import IGNORE, unknown_number
from labkit.learning.inference import VOTE_UNIT, InstanceOutput
from labkit.learning.view import resized
from labkit.support.validation import check_finite, check_labels, check_shape, require

if TYPE_CHECKING:
    import torch

CELL = 3  # pixels of the view along a side of the histogram's cells
SPREAD = 1.0  # cells: standard deviation of the Gaussian that smooths the histogram
APART = 10  # pixels: of two peaks that are closer, the lower one is none
ENOUGH = 1.2  # votes in a cell of the smoothed histogram: a lower peak is none
LEAST = 60  # pixels of the view: a smaller thing is none
AGREES = 0.5  # of the radius of a disc of the thing's area: a vote that misses the peak by less agrees with it
LOOKS = 0.75, 1.3  # sizes of the world, to the true one, that things are looked at in
VOTES_COUNT = 8.0  # weight of a vote's loss at a pixel of a thing, against that of the foreground at any pixel


@dataclass(frozen=True, eq=False)
class Instances:
    """The things of one frame.

    instances: int32 (H, W), 0 where there is none, things numbered from 1, the largest first. certainty: for each
    thing, in 0..1, how sure it is that there is one and that it is one. foreground: float32 (H, W), probability that a
    pixel is on a thing. probabilities: of the classes, float32 (H, W, C); None if they were not asked for.
    """

    instances: Int32[np.ndarray, "H W"]
    certainty: tuple[float, ...]
    foreground: Float32[np.ndarray, "H W"]
    probabilities: Float32[np.ndarray, "H W C"] | None

    def __len__(self) -> int:
        return len(self.certainty)


def segment_instances(
    model, frame: RGBDFrame, flip_tta: bool = True, sizes: tuple[float, ...] | None = None, classes: bool = True
) -> Instances:
    """Find every thing in a frame, whatever it is and wherever it stands: `look`, then `group`.

    model: a network that tells things apart, such as the kit's unet_rgbd, or an engine of one. flip_tta: look at the
    mirror image, too. sizes, classes: as for `look`; None is LOOKS with `flip_tta`, which takes three times as long
    (twice without the classes), and none without. Nothing found is no error: `len(things)` is 0. Raises ValueError for
    another network.
    """
    from labkit.learning.engines import open_engine

    sizes = LOOKS if sizes is None and flip_tta else sizes or ()
    probabilities, sight = look(check_predicts_instances(open_engine(model)), frame, flip_tta, sizes, classes)
    numbers, certainty = group(sight.foreground, sight.votes)
    instances, foreground = brought_back(sight, numbers)
    left = np.unique(instances[instances > 0])  # a thing may lie outside the picture, or between its pixels
    number_of = np.zeros(len(certainty) + 1, np.int32)
    number_of[left] = np.arange(1, len(left) + 1)
    return Instances(number_of[instances], tuple(certainty[k - 1] for k in left), foreground, probabilities)


def look(engine, frame: RGBDFrame, flip_tta: bool = True, sizes: tuple[float, ...] = LOOKS, classes: bool = True):
    """Class probabilities of a frame and what the network says of its things, as `Engine.predict_instances` gives them.

    sizes: foreground and votes are the mean of one look for each, as if all lengths were so many times as large. A
    large thing that comes apart in one size may be whole in another, and a small one is seen better enlarged. With
    none, for a network that takes pictures as they are, and for a frame without any depth it is what the engine's
    `predict_instances` gives. The probabilities are those of the true size: it is what a class may hang on. classes:
    False leaves them out, None, where other sizes count, and with them the look in the true size.
    """
    probabilities, view = None, engine.takes.view(frame) if sizes and not classes else None
    if view is None:
        probabilities, sight = engine.predict_instances(frame, flip_tta)
        view = sight.view
        if not sizes or view is None:
            return probabilities, sight
    w, h = view.frame.size
    foreground, votes = np.zeros((h, w), np.float32), np.zeros((h, w, 2), np.float32)
    for factor in sizes:
        other = engine.predict_instances(resized(frame, factor), flip_tta)[1]
        size = np.array(other.foreground.shape[::-1], np.float32)  # of the other view, which shows the same
        foreground += cv2.resize(other.foreground, (w, h)) / len(sizes)
        votes += cv2.resize(other.votes, (w, h)) * ((w, h) / size) / len(sizes)
    return probabilities, InstanceOutput(np.clip(foreground, 0.0, 1.0), votes, view)


def instance_finder(model=None, flip_tta: bool = True) -> Callable[[RGBDFrame], Instances]:
    """Make a function that finds things of any class, for `Pipeline(find_objects=...)`, of `segment_instances`.

    It does not ask for classes, which takes a third less time. model: a network or an engine that tells things apart;
    None is the kit's own, unet_rgbd. flip_tta: as for `segment_instances`. Raises ValueError for a network of classes
    alone. Topic 03.
    """
    from labkit.learning.engines import open_engine
    from labkit.learning.network import load_model, weights_path

    engine = open_engine(load_model(weights_path("unet_rgbd")) if model is None else model)
    return partial(segment_instances, check_predicts_instances(engine), flip_tta=flip_tta, classes=False)


def predicts_instances(engine) -> bool:
    """Whether an engine says at each pixel which thing it belongs to."""
    return bool(getattr(engine, "things", False))


def check_predicts_instances(engine):
    """Return an engine whose network tells things apart; raises ValueError for one of classes alone."""
    wanted = "a network that tells things apart, such as unet_rgbd, or `labkit train --things` of one"
    require("model", predicts_instances(engine), wanted, "one of classes alone")
    return engine


def brought_back(sight: InstanceOutput, numbers: Int32[np.ndarray, "h w"]):
    """Instances and foreground at the picture's own pixels: the nearest pixel's of the view, and interpolated."""
    if sight.view is None:
        return numbers, sight.foreground
    back = sight.view.back
    instances = back(numbers[..., None].astype(np.float32), cv2.INTER_NEAREST)[..., 0].astype(np.int32)
    return instances, np.ascontiguousarray(back(sight.foreground[..., None])[..., 0])


def group(
    foreground: Float[np.ndarray, "h w"], votes: Float[np.ndarray, "h w 2"]
) -> tuple[Int32[np.ndarray, "h w"], tuple[float, ...]]:
    """Group pixels by their votes: numbers of things (0 is none), the largest first, and the certainty of each.

    foreground: probability that a pixel is on a thing; those above 0.5 vote. votes: (du, dv), pixels, from each pixel
    to the middle of its thing. Peaks of the smoothed histogram of votes are the things; a pixel is of the peak that its
    vote is nearest to. A vote that leaves the picture by more than its width or height makes no peak. The certainty of
    a thing is the mean over its pixels of its foreground where the vote agrees
    with the peak, and 0 where it does not. Raises ValueError for another shape, NaN, or a foreground outside 0..1.

    >>> foreground, votes = np.zeros((40, 90)), np.zeros((40, 90, 2))
    >>> for left in (10, 40):  # two squares of 30 pixels that touch
    ...     foreground[5:35, left : left + 30] = 1.0
    ...     v, u = np.mgrid[5:35, left : left + 30]
    ...     votes[5:35, left : left + 30] = np.stack([left + 14.5 - u, 19.5 - v], axis=-1)
    >>> numbers, certainty = group(foreground, votes)
    >>> numbers[20, [5, 39, 40]].tolist(), certainty
    ([0, 1, 2], (1.0, 1.0))
    """
    foreground = check_finite("foreground", check_shape("foreground", foreground, (None, None)))
    require("foreground", ((foreground >= 0.0) & (foreground <= 1.0)).all(), "probabilities in 0..1", "others")
    votes = check_finite("votes", check_shape("votes", votes, (*foreground.shape, 2)))
    v, u = np.nonzero(foreground > 0.5)
    numbers = np.zeros(foreground.shape, np.int32)
    places = np.stack([u, v], axis=1) + votes[v, u]
    size = np.array(foreground.shape[::-1])
    peaks = peaks_of(histogram(places[((places >= -size) & (places <= 2 * size)).all(axis=1)]))
    if len(peaks) == 0:
        return numbers, ()
    distance, nearest = nearest_of(np.clip(places, -size, 2 * size), peaks)
    pixels = np.bincount(nearest, minlength=len(peaks))
    order = [k for k in np.argsort(-pixels, kind="stable") if pixels[k] >= LEAST]
    number_of = np.zeros(len(peaks), np.int32)
    number_of[order] = np.arange(1, len(order) + 1)
    numbers[v, u] = number_of[nearest]
    agrees = distance < AGREES * np.sqrt(pixels[nearest] / np.pi)
    sure = np.bincount(nearest, foreground[v, u] * agrees, len(peaks)) / np.maximum(pixels, 1)
    return numbers, tuple(sure[order].tolist())


def histogram(places: Float[np.ndarray, "N 2"]) -> tuple[Float32[np.ndarray, "r c"], Float[np.ndarray, "2"]]:
    """Count votes (u, v) in cells of CELL pixels, smoothed; and the place of the first cell's middle.

    A vote is shared among the four cells around it, by its distance to their middles, so that no cell's edge tells.
    """
    if len(places) == 0:
        return np.zeros((1, 1), np.float32), np.zeros(2)
    pad = int(np.ceil(4 * SPREAD))
    first = places.min(axis=0) - pad * CELL
    at = (places - first) / CELL
    low = np.floor(at).astype(np.intp)
    share = at - low
    size = low.max(axis=0) + 2 + pad
    counts = np.zeros(size[0] * size[1])
    for i in (0, 1):
        for j in (0, 1):
            weight = np.abs(1 - i - share[:, 0]) * np.abs(1 - j - share[:, 1])
            counts += np.bincount((low[:, 1] + j) * size[0] + low[:, 0] + i, weight, len(counts))
    return cv2.GaussianBlur(counts.reshape(size[1], size[0]).astype(np.float32), (0, 0), SPREAD), first


def peaks_of(smoothed) -> Float[np.ndarray, "K 2"]:
    """The places (u, v) of a histogram's peaks: cells that are the highest within APART pixels, and ENOUGH.

    Cells of one height that are so near each other are one peak, in their middle.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    counts, first = smoothed
    reach = int(APART // CELL)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    row, column = np.nonzero((counts == cv2.dilate(counts, disc)) & (counts > ENOUGH))
    cells, height = np.stack([column, row], axis=1), counts[row, column]
    if len(cells) == 0:
        return np.zeros((0, 2))
    a, b = cKDTree(cells).query_pairs(APART / CELL, output_type="ndarray").T
    a, b = a[height[a] == height[b]], b[height[a] == height[b]]
    count, peak = connected_components(coo_array((np.ones(len(a)), (a, b)), (len(cells), len(cells))), directed=False)
    sums = np.stack([np.bincount(peak, axis, count) for axis in (column, row)], axis=1)
    return first + CELL * sums / np.bincount(peak)[:, None]


def nearest_of(places: Float[np.ndarray, "N 2"], peaks: Float[np.ndarray, "K 2"]):
    """For each place the distance to the nearest peak, and that peak's number."""
    from scipy.spatial import cKDTree

    return cKDTree(peaks).query(places)


def vote_targets(instances: Integer[np.ndarray, "H W"]) -> Float32[np.ndarray, "H W 2"]:
    """The true votes: (du, dv) from each pixel of a thing to the mean place of all its pixels; 0 elsewhere.

    instances: numbers of things up to 65535, 0 for none, `unknown_number` where nobody knows. Raises ValueError for
    others.

    >>> vote_targets(np.array([[7, 7, 7, 0, 2]]))[0, :, 0].tolist()
    [1.0, 0.0, -1.0, 0.0, 0.0]
    """
    instances = check_shape("instances", check_labels("instances", instances, 65_536, ignore=None), (None, None))
    v, u = np.nonzero((instances > 0) & (instances != unknown_number(instances)))
    number = instances[v, u]
    votes = np.zeros((*instances.shape, 2), np.float32)
    pixels = np.maximum(np.bincount(number), 1)
    for axis, place in enumerate((u, v)):
        votes[v, u, axis] = (np.bincount(number, place) / pixels)[number] - place
    return votes


def things_loss(z: "torch.Tensor", instances: "torch.Tensor") -> "torch.Tensor":
    """Give the loss of the channels `THINGS` (N, 3, H, W): the foreground's cross-entropy, and the votes' smooth L1.

    instances: uint8 (N, H, W), 0 is no thing, pixels of 255 are left out. A vote counts where a thing is. Its loss is
    quadratic up to 4 pixels of error and linear beyond, so that a pixel that cannot know, on a half hidden thing, does
    not pull more than others. All is summed over pixels and divided by the number of those counted, as
    `segmentation_loss` is. Raises ValueError for another type, whose 255 may be a thing.
    """
    import torch
    from torch.nn import functional as F

    require("instances", instances.dtype == torch.uint8, "uint8, 255 where nobody knows", instances.dtype)
    known = instances != IGNORE
    foreground = (instances > 0) & known
    truth = torch.from_numpy(np.stack([vote_targets(each) for each in instances.cpu().numpy()])).to(z.device)
    z = z.float()
    of_foreground = F.binary_cross_entropy_with_logits(z[:, 0], foreground.float(), reduction="none")
    of_votes = F.smooth_l1_loss(z[:, 1:], truth.permute(0, 3, 1, 2) / VOTE_UNIT, reduction="none", beta=0.2).sum(dim=1)
    total = (of_foreground * known).sum() + VOTES_COUNT * (of_votes * foreground).sum()
    return total / known.sum().clamp(min=1)
