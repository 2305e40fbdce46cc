"""`labkit evaluate FOLDER`: how well are the things in somebody's own pictures told apart, and which went worst?"""

import html
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Integer, UInt8
from matplotlib import colormaps
from tqdm.auto import tqdm

from labcli.cameras import read_intrinsics
from labcli.perceive import on_own_table
from labcli.pictures import NOTHING_SAID, Reading, Shot, camera_file, depth_beside, pictures_in, read_numbers, read_shot
from labcli.report import PAGE, figures
from labkit.frame import RGBDFrame
from labkit.geometry import back_project_to_base
from labkit.instance_metrics import InstanceScores, pool, score_instances
from labkit.labels import OBSTACLE, TARGET
from labkit.learning.things import Instances
from labkit.metrics import wilson_interval
from labkit.pipeline import Pipeline
from labkit.targets import separate_objects

# The number of the thing at each pixel, 0 for none; or an object with such `instances`, as `Pipeline(find_objects)`.
Finder = Callable[[RGBDFrame], Integer[np.ndarray, "H W"] | Instances]
HALF = 0.5  # of the picture: a larger thing is more likely a table, and the mask one of classes
COLOURS = np.rint(255 * np.array(colormaps["tab20"].colors)).astype(np.uint8)


def things_by_class(network) -> Finder:
    """What a network's classes say of things: all that is target or obstacle, cut apart by empty space.

    A labelled pixel without depth goes to the nearest thing, so that the things together are what was labelled.
    """
    pipeline = Pipeline(network)

    def find(frame: RGBDFrame) -> Integer[np.ndarray, "H W"]:
        labels, _ = pipeline.perceive(frame)
        thing = np.isin(labels, (TARGET, OBSTACLE))
        P = back_project_to_base(frame.depth, frame.K, frame.T_base_cam).reshape(-1, 3)
        placed = np.flatnonzero(thing.ravel() & np.isfinite(P[:, 2]))
        apart = [placed[group] for group in separate_objects(P[placed])]
        numbers = np.zeros(thing.size, np.int32)
        for number, pixels in enumerate(apart, start=1):
            numbers[pixels] = number
        if not apart:
            return thing.astype(np.int32)
        away = (numbers == 0).astype(np.uint8).reshape(thing.shape)
        _, nearest = cv2.distanceTransformWithLabels(away, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
        number_of = np.zeros(nearest.max() + 1, np.int32)
        number_of[nearest[away == 0]] = numbers[numbers > 0]
        return np.where(thing, number_of[nearest], 0)

    return find


@dataclass(frozen=True, eq=False)
class Judged:
    """One picture, its true things and those that were found, how they score, and why nothing could be looked for.

    true: 0 is no thing. ignore: the number that does not count.
    """

    name: str
    rgb: UInt8[np.ndarray, "H W 3"]
    true: Integer[np.ndarray, "H W"]
    found: Integer[np.ndarray, "H W"]
    ignore: int
    scores: InstanceScores
    said: str = ""


class TrueThings(Sequence):
    """FOLDER/color/NAME.png (or .jpg) and depth/NAME.png with the true things in mask/NAME.png, and FOLDER/camera.json.

    A mask has 8 or 16 bits: 0 where there is no thing, the greatest number, 255 or 65535, where nobody knows, and
    another number for each thing. Masks of 0 and one other number alone do not tell things apart, and neither does a
    folder foreground/ in place of mask/, not 0 where a thing is: then `alone` is True. reading and
    the camera's file as for `labcli.own_data.PictureFolder`; `said` is what there is to say of the files.

    An item is a frame in the camera's own frame, whose instances are the true things. Raises FileNotFoundError or
    ValueError naming the file that is missing or does not fit.
    """

    def __init__(self, folder, reading: Reading = NOTHING_SAID):
        folder = Path(folder)
        self.reading = reading
        self.colors, self.said = pictures_in(folder / "color")
        kind = "mask" if (folder / "mask").is_dir() else "foreground"
        self.masks = [folder / kind / f"{path.stem}.png" for path in self.colors]
        self.camera = camera_file(folder)
        if not self.colors or not self.masks[0].parent.is_dir() or self.camera is None:
            raise FileNotFoundError(
                f"folder: expected pictures in color/, depth/ and mask/ (or foreground/), and camera.json, in {folder}"
            )
        numbers = {*np.concatenate([np.unique(read_numbers(path)) for path in self.masks]).tolist()} - {0}
        self.alone = kind == "foreground" or len(numbers) <= 1

    def __len__(self) -> int:
        return len(self.colors)

    def __getitem__(self, index: int) -> RGBDFrame:
        shot = self.shot(index)
        self.said += [sentence for sentence in shot.said if sentence not in self.said]
        return replace(shot.frame, instances=self.numbers(self.masks[index], shot, self.ignore(index)))

    def shot(self, index: int) -> Shot:
        """A picture as it is in its files, without its true things."""
        color = self.colors[index]
        camera = read_intrinsics(str(self.camera), color, self.reading.camera_name)
        return read_shot(color, depth_beside(color), camera, self.reading)

    def numbers(self, mask: Path, shot: Shot, outside: int = 0) -> Integer[np.ndarray, "h w"]:
        """The numbers of things in a mask of a picture's size, at the frame's pixels; 0 and 1 if truth is `alone`."""
        numbers = read_numbers(mask)
        return shot.labels_like((numbers > 0).astype(np.uint8) if self.alone else numbers, outside, mask)

    def ignore(self, index: int) -> int:
        """The number of the mask's pixels that nobody knows, the greatest of its kind."""
        return 255 if self.alone else int(np.iinfo(read_numbers(self.masks[index]).dtype).max)


def judge(things: TrueThings, find: Finder) -> list[Judged]:
    """Find the things of each picture on the table that its depth shows, or pose/NAME.txt says, and score them.

    In a picture without a table nothing is found, which counts, and is said.
    """
    judged = []
    for index, frame in enumerate(tqdm(things, desc="pictures", unit="picture")):
        found, said = np.zeros(frame.depth.shape, np.int32), ""
        try:
            seen = on_own_table(replace(frame, instances=None), things.colors[index])
        except ValueError as error:
            said = f"nothing was looked for: {error}"
        else:
            found = find(seen)
        judged.append(_judged(things, index, frame, getattr(found, "instances", found), said))
    return judged


def judge_masks(things: TrueThings, folder: Path) -> list[Judged]:
    """Score somebody's masks, FOLDER/NAME.png of 8 or 16 bits, of the pictures' names and sizes.

    Each number above 0 is a thing. Raises FileNotFoundError naming those that are missing, before one is scored, and
    ValueError for one of another size.
    """
    masks = [folder / f"{path.stem}.png" for path in things.colors]
    missing = [path.name for path in masks if not path.is_file()]
    if missing:
        more = f" and {len(missing) - 8} more" if len(missing) > 8 else ""
        raise FileNotFoundError(
            f"masks: expected a mask for each picture in {folder}, got no {', '.join(missing[:8])}{more}"
        )
    return [
        _judged(things, index, things[index], things.numbers(mask, things.shot(index)))
        for index, mask in enumerate(masks)
    ]


def _judged(
    things: TrueThings, index: int, frame: RGBDFrame, found: Integer[np.ndarray, "H W"], said: str = ""
) -> Judged:
    """Score what was found in one picture; said: why nothing could be."""
    ignore, true = things.ignore(index), frame.instances
    counted = true[true != ignore]
    largest = np.bincount(counted[counted > 0]).max(initial=0) / max(1, counted.size)
    if not said and not things.alone and largest > HALF:
        said = f"one true thing covers {largest:.0%} of the picture: are these numbers of classes, not of things?"
    scores = score_instances(true, np.where(found > 0, 1, 0) if things.alone else found, ignore)
    return Judged(things.colors[index].stem, frame.rgb, true, found, ignore, scores, said)


def table(judged: Sequence[Judged], alone: bool) -> str:
    """The scores as text for a terminal. alone: the truth does not tell things apart, so only foreground is scored."""
    scores = pool([picture.scores for picture in judged])
    lines = [f"{picture.name}: {picture.said}" for picture in judged if picture.said]
    foreground = f"foreground IoU {scores.foreground_iou:.3f}"
    if alone:
        return "\n".join([*lines, f"{scores.pictures} pictures whose truth does not tell things apart", foreground])
    lines += [f"{scores.pictures} pictures, {scores.true} things, {scores.found} found"]
    for what, count in (
        ("found as one piece, IoU over 0.5", scores.over_half),
        ("the same, IoU over 0.75", scores.over_three_quarters),
        ("F over 0.75", scores.detected),
    ):
        share = ""
        if scores.true:
            low, high = wilson_interval(count, scores.true)
            share = f" ({count / scores.true:.0%}, 95 % interval {low:.0%} to {high:.0%})"
        lines += [f"{what}: {count} of {scores.true}{share}"]
    lines += ["", f"{'mean over pictures':<20}{'precision':>10}{'recall':>8}{'F':>8}"]
    for what in ("overlap", "boundary"):
        P, R, F = getattr(scores, what)
        lines += [f"{what:<20}{P:>10.3f}{R:>8.3f}{F:>8.3f}"]
    return "\n".join([*lines, "", foreground])


def as_dict(judged: Sequence[Judged], alone: bool) -> dict:
    """The pooled scores and, as `rows`, each picture's; None where there is none, as for things if truth has none."""
    whole = asdict(pool([picture.scores for picture in judged]))
    rows = [
        {"name": one.name, "said": one.said, "foreground_iou": one.scores.foreground_iou, **asdict(one.scores)}
        for one in judged
    ]
    if alone:
        kept = {"pictures", "name", "said", "foreground", "foreground_iou"}
        whole, *rows = ({key: facts[key] for key in facts if key in kept} for facts in (whole, *rows))
    return _without_nan(whole | {"rows": rows})


def _without_nan(facts):
    if isinstance(facts, dict):
        return {key: _without_nan(value) for key, value in facts.items()}
    if isinstance(facts, (list, tuple)):
        return [_without_nan(value) for value in facts]
    return None if isinstance(facts, float) and np.isnan(facts) else facts


def worst(judged: Sequence[Judged], count: int, alone: bool) -> list[Judged]:
    """The pictures of the lowest F of overlap, or if truth does not tell things apart of the lowest foreground IoU."""

    def goodness(picture: Judged) -> float:
        return np.nan_to_num(picture.scores.foreground_iou, nan=1.0) if alone else picture.scores.overlap[2]

    return sorted(judged, key=goodness)[:count]


def page(judged: Sequence[Judged], count: int, alone: bool, beside: Sequence[Judged] = ()) -> str:
    """HTML of the worst pictures: each with its true things, with those that were found, and how they score.

    beside: what else was found in the same pictures, shown beside it.
    """
    body, others = [], {one.name: one for one in beside}
    for picture in worst(judged, count, alone):
        scores, true = picture.scores, np.where(picture.true == picture.ignore, 0, picture.true)
        said = [] if alone else [f"{scores.over(0.5)} of {scores.true} things found as one piece, {scores.found} found"]
        said += [] if alone else [f"overlap F {scores.overlap[2]:.3f}, boundary F {scores.boundary[2]:.3f}"]
        said += [f"foreground IoU {scores.foreground_iou:.3f}", picture.said]
        pictures = {"true things": painted(picture.rgb, true), "found": painted(picture.rgb, picture.found)}
        if picture.name in others:
            pictures["found by the kit"] = painted(picture.rgb, others[picture.name].found)
        body += [f"<h2>{html.escape(picture.name)}</h2>", figures(pictures)]
        body += [f"<pre>{html.escape(chr(10).join(filter(None, said)))}</pre>"]
    title = f"The worst {min(count, len(judged))} of {len(judged)} pictures"
    return PAGE.format(title=title, body="\n".join(body))


def painted(rgb: UInt8[np.ndarray, "H W 3"], numbers: Integer[np.ndarray, "H W"]) -> UInt8[np.ndarray, "H W 3"]:
    """The picture with a colour over each thing, and a white outline around it."""
    image = rgb.copy()
    for place, number in enumerate(np.unique(numbers[numbers > 0])):
        mask = numbers == number
        image[mask] = image[mask] // 2 + COLOURS[place % len(COLOURS)] // 2
        outlines, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(image, outlines, -1, (255, 255, 255), max(1, round(rgb.shape[1] / 640)))
    return image
