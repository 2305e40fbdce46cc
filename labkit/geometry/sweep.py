"""Depth from photographs of one table, by trying every height (topic 06, parallax).

Put a plane at some height over the table, and let each photograph paint it: where the height is right, the photographs
agree. They agree in two ways. Patterns agree however each was exposed (normalised correlation in a small window), and
tell the height sharply, where there is a pattern. Colours agree once exposures are matched, and tell the height roughly
wherever another colour is near: the middle of a white mug does not lie on the table, for at that height some of the
photographs show table. Where neither tells, neighbours (semi-global matching, Hirschmueller 2008) and the table decide.
Depth is unknown where a piece seems to rise from the table and nothing proves it, where parallax is too small, and
where photographs agree better on something far below the table: that is a reflection, or lies beside the table.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8

from labkit.frame import RGBDFrame
from labkit.geometry.calibration import sheet_pose
from labkit.geometry.depth_units import resized_K
from labkit.geometry.projection import invert_transform, pixel_rays
from labkit.geometry.sheet import Sheet
from labkit.support.validation import check_K, check_rgb, check_same_size, check_T, require

WIDEST = 640  # pixels of a view's longer side: what is larger is made smaller before the sweep
LEAST_VIEWS = 3
HEIGHTS = np.arange(-0.02, 0.281, 0.004)  # metres over the sheet that are tried
WINDOW, GRAIN_WINDOW = 9, 5  # pixels of a side: of the window that is correlated, and of that which must have a pattern
GRAIN = 8.0  # grey levels: a window whose values scatter less is nearly flat, and says little
NEUTRAL = 0.5  # cost of what says nothing, between agreement (0) and none (1)
SEEN_BY = 0.5, 0.67  # share of the other views, the best ones, that count for patterns and for colours: things hide
SAME_COLOUR, OTHER_COLOUR = 4.0, 30.0  # grey levels between colours that noise explains, and that nothing does
COLOUR_WEIGHT = 0.8  # of colours, where patterns have 1
TABLE, NEAR_TABLE = 0.02, 0.004  # by so much the table's own height is cheaper, and metres that count as it
SMALL_STEP, LARGE_STEP = 0.02, 0.25  # price of a height that differs from the neighbour's by one step, by more
COLOUR_STEP = 12.0  # grey levels between neighbours over which a large step costs half
SURE = 0.5  # certainty under which depth is not known
FLAT = 0.012  # metres from the table: what lies beyond must be proven
PROOF, PROVEN = 0.4, 0.3  # by so much a height must be cheaper than the table's, at so large a share of a raised piece
COARSE = 0.03  # metres: where one pixel of the widest parallax means more, depth is not known
SMALL = 160  # pixels of the longer side of the pictures in which what lies below the table is looked for,
UNDER = 0.03, 30.0, 40  # from so many metres below it to so many, in so many steps of equal parallax;
DEEPER = 0.1, 0.05  # it is there where it costs so much less than all heights, and from there on, so much less,
SUNK = 0.5  # and so is a raised piece of which so large a share is within a window of such a place
LEAST_FITTED, REFLECTION = 50, 15  # points that exposure is fitted to; side of a window of these, 120 pixels wide
DARK, BRIGHT = 8.0, 247.0  # grey levels beyond which a sensor tells no exposure
HIDDEN = 0.015  # metres that a point must lie behind another to be hidden by it
ODD_AREA = 0.004  # share of the picture: a place as large as that where one view alone differs was changed
OUTSIDE = -1e4  # value of a warped picture where there is none


@dataclass(frozen=True, eq=False)
class View:
    """A photograph without lens distortion, its K, and its pose T_base_cam; the table lies at z = 0.

    misfit: by how many pixels the sheet's corners lie beside where K and the pose put them (root mean square), a share
    of the picture's longer side; 0 where no sheet was looked for.
    """

    rgb: UInt8[np.ndarray, "H W 3"]
    K: Float[np.ndarray, "3 3"]
    T_base_cam: Float[np.ndarray, "4 4"]
    misfit: float = 0.0

    def __post_init__(self):
        check_rgb("rgb", self.rgb)
        check_K("K", self.K)
        check_T("T_base_cam", self.T_base_cam)

    def frame(self, depth: Float32[np.ndarray, "H W"]) -> RGBDFrame:
        """This view with its depth, in the base frame of the sheet, where the table lies at z = 0."""
        return RGBDFrame(self.rgb, depth, self.K, self.T_base_cam, table_z=0.0)


@dataclass(frozen=True, eq=False)
class Swept:
    """What a sweep found in the first view: depth in metres, 0 where nobody knows, and its certainty, 0 to 1.

    changed: for each other view, the share of the picture where it alone shows something else, in one piece.
    """

    depth: Float32[np.ndarray, "H W"]
    certainty: Float32[np.ndarray, "H W"]
    changed: tuple[float, ...]

    @property
    def odd(self) -> tuple[int, ...]:
        """Numbers of the other views, from 1, that show a scene in which something is elsewhere."""
        return tuple(i for i, share in enumerate(self.changed, start=1) if share > ODD_AREA)


def view_of_sheet(
    picture: UInt8[np.ndarray, "H W 3"], K: Float[np.ndarray, "3 3"], distortion: Sequence[float] = (), sheet=None
) -> View | None:
    """Find the sheet in a photograph at full size, and make a view of it, without lens, 640 pixels on its longer side.

    sheet: as it was printed, `Sheet()` by default. None if the sheet is not found. Topic 06.
    """
    corners = (sheet or Sheet()).find(picture)
    if corners is None:
        return None
    T_cam_sheet, off = sheet_pose(corners, K, distortion)
    height, width = picture.shape[:2]
    misfit = float(np.sqrt((off**2).sum(axis=1).mean())) / max(height, width)
    straight = cv2.undistort(picture, np.asarray(K, float), np.array(distortion, float)) if any(distortion) else picture
    scale = min(1.0, WIDEST / max(height, width))
    view = View(straight, K, invert_transform(T_cam_sheet), misfit)
    return _resized(view, (round(scale * width), round(scale * height)))


def frame_from_views(views: Sequence[View], progress: Callable = lambda heights: heights) -> RGBDFrame:
    """Make a frame of the first of at least three views: its colours, the depth that a sweep finds, its pose.

    The base frame is the sheet's, and the table lies at z = 0. progress: as in `sweep`. Topic 06, parallax.
    """
    return views[0].frame(sweep(views, progress).depth)


def central_first(views: Sequence[View]) -> list[int]:
    """Numbers of the views, that first whose camera is nearest to all others: it shares most with them."""
    middle = int(_apart(views).sum(axis=1).argmin())
    return [middle, *(i for i in range(len(views)) if i != middle)]


def _apart(views: Sequence[View]) -> Float[np.ndarray, "n n"]:
    """Metres from each camera to each other one."""
    C = np.array([view.T_base_cam[:3, 3] for view in views])
    return np.linalg.norm(C[:, None] - C[None], axis=-1)


def sweep(views: Sequence[View], progress: Callable = lambda heights: heights) -> Swept:
    """Find the depth of the first view's pixels from at least two others of the same table, all of one size.

    progress: wraps the heights while they are tried, such as tqdm. Takes about 6 s of one core and 0.5 GB for seven
    views of 640 x 480. Raises ValueError for fewer than three views, or views of several sizes. Topic 06, parallax.
    """
    require("views", len(views) >= LEAST_VIEWS, f"at least {LEAST_VIEWS}", len(views))
    first, others = views[0], views[1:]
    for i, view in enumerate(others, start=1):
        check_same_size("views[0].rgb", first.rgb, f"views[{i}].rgb", view.rgb)
    H, W = first.rgb.shape[:2]
    half = _scaling((W // 2) / W, (H // 2) / H)
    patterns, colours = Patterns(_gray(first)), _halved(first)
    gray, other_colours = [_gray(view) for view in others], [_halved(view) for view in others]
    at_half = [half @ plane_homography(first, view, 0.0) @ np.linalg.inv(half) for view in others]
    gains = [exposure_gain(colours, seen, M) for seen, M in zip(other_colours, at_half, strict=True)]
    by_pattern = np.empty((len(HEIGHTS), H, W), np.float32)
    by_colour = np.empty((len(HEIGHTS), H // 2, W // 2), np.float32)
    for k, height in enumerate(progress(HEIGHTS)):
        M = [plane_homography(first, view, height) for view in others]
        each = [patterns.cost(seen, m) for seen, m in zip(gray, M, strict=True)]
        by_pattern[k] = mean_of_best(each, SEEN_BY[0])
        M = [half @ m @ np.linalg.inv(half) for m in M]
        each = [colour_cost(colours, *at) for at in zip(other_colours, gains, M, strict=True)]
        by_colour[k] = mean_of_best(each, SEEN_BY[1])
    total = _upsampled(_smoothed(by_pattern, by_colour, colours), (W, H))
    total += by_pattern
    k = total.argmin(axis=0)
    height = _between(total, k)
    depth = depth_at(first, height)
    certainty = _certainty(patterns.weight, by_pattern, by_colour, k)
    known = (certainty > SURE) & (k > 0) & (k < len(HEIGHTS) - 1) & np.isfinite(depth)
    known &= ~_unproven(known & (np.abs(height) > FLAT), total[np.abs(HEIGHTS).argmin()] - total.min(axis=0) >= PROOF)
    below, near = _below(views)
    known &= ~(below | (_share_of_piece(known & (np.abs(height) > FLAT), near) > SUNK))
    known &= depth**2 <= COARSE * first.K[0, 0] * _apart(views)[0].max()  # a pixel means z^2 / (b f) at depth z
    depth = np.where(known, depth, 0.0).astype(np.float32)
    changed = changed_places(first, others, depth, colours, other_colours, gains)
    return Swept(depth, np.where(known, certainty, 0.0).astype(np.float32), changed)


def _unproven(raised: Bool[np.ndarray, "H W"], proof: Bool[np.ndarray, "H W"]) -> Bool[np.ndarray, "H W"]:
    """Pixels that seem to rise from the table, cost hardly more on it, and belong to a piece of which the same is true.

    The middle of a plain object agrees at many heights, but its rim proves one, and the piece is kept whole. At the
    picture's border, and in plain gaps between objects, nothing proves the height that the best paths happened to give.

    >>> raised = np.array([[True, True, True, False, True, True]])
    >>> _unproven(raised, np.array([[True, False, False, False, False, False]])).tolist()
    [[False, False, False, False, True, True]]
    """
    return raised & ~proof & (_share_of_piece(raised, proof) < PROVEN)


def _share_of_piece(pieces: Bool[np.ndarray, "H W"], which: Bool[np.ndarray, "H W"]) -> Float[np.ndarray, "H W"]:
    """For each pixel, of how large a share of its piece `which` is true; 0 outside of pieces."""
    count, number = cv2.connectedComponents(pieces.astype(np.uint8), connectivity=4)
    pixels, true = (np.bincount(number[pieces & each], minlength=count) for each in (True, which))
    return (true / np.maximum(pixels, 1))[number]


def plane_homography(first: View, other: View, height: float) -> Float[np.ndarray, "3 3"]:
    """Where another view sees the plane z = height that the first view's pixels lie on: pixels to pixels.

    A pixel's ray r = R K^-1 (u, v, 1) meets the plane at C + r (height - C_z) / r_z; multiplied by r_z, the point's
    direction from the other camera is linear in the pixel: (height - C_z) r + (C - C') r_z.
    """
    R, C = first.T_base_cam[:3, :3], first.T_base_cam[:3, 3]
    T_other = invert_transform(other.T_base_cam)
    M = (height - C[2]) * np.eye(3)
    M[:, 2] += C - other.T_base_cam[:3, 3]
    return other.K @ T_other[:3, :3] @ M @ R @ np.linalg.inv(first.K)


def depth_at(view: View, height: Float[np.ndarray, "H W"]) -> Float[np.ndarray, "H W"]:
    """Depth at which each pixel's ray reaches its height over the table; NaN where it does not reach it."""
    rise = pixel_rays(view.rgb.shape[:2], view.K) @ view.T_base_cam[2, :3]
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = (height - view.T_base_cam[2, 3]) / rise
    return np.where((rise < -1e-6) & (depth > 0.0), depth, np.nan)


# ------------------------------------------------------------------------------------------------ do they agree?


class Patterns:
    """Windows of the first view, whose means and scatter serve all heights; weight: 0 to 1, has it a pattern?"""

    def __init__(self, gray: Float32[np.ndarray, "H W"]):
        self.gray = gray
        self.mean, self.spread = _moments(gray, WINDOW)
        # A pattern must be near the window's middle: an edge farther off is that of something else.
        near = _moments(gray, GRAIN_WINDOW)[1]
        self.weight = near**2 / (near**2 + GRAIN**4)

    def cost(
        self, gray: Float32[np.ndarray, "H W"], M: Float[np.ndarray, "3 3"], outside: float = NEUTRAL
    ) -> Float32[np.ndarray, "H W"]:
        """What it costs to say that another view, warped by M, shows the same: 1 - correlation, at most 1.

        outside: the cost where that view ends.
        """
        seen = _warped(gray, M, self.gray.shape[::-1])
        there = np.maximum(seen, 0.0)
        mean, spread = _moments(there, WINDOW)
        both = cv2.boxFilter(self.gray * there, -1, (WINDOW, WINDOW)) - self.mean * mean
        off = np.minimum(1.0 - both / np.sqrt((self.spread + 1.0) * (spread + 1.0)), 1.0)
        return np.where(seen > OUTSIDE / 2.0, NEUTRAL + self.weight * (off - NEUTRAL), outside)


def exposure_gain(
    first: Float32[np.ndarray, "h w 3"], other: Float32[np.ndarray, "h w 3"], M: Float[np.ndarray, "3 3"]
) -> Float32[np.ndarray, "h w 3"]:
    """By how much to multiply another view's colours, pixel by pixel of the first, to have the first's exposure.

    M: where it sees the table's plane. The logarithm of the ratio is fitted by a quadratic of u and v, for each colour,
    in five rounds that forget what does not lie on the table (Tukey's weights): gain, white balance and shading. What
    then remains in the mean of a wide window, such as a lamp's reflection on the table, is added.
    """
    h, w = first.shape[:2]
    v, u = np.mgrid[-1.0 : 1.0 : h * 1j, -1.0 : 1.0 : w * 1j]
    powers = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=-1)
    mine, seen = first[::4, ::4], _warped(other, M, (w, h))[::4, ::4]
    used = (np.minimum(mine, seen).min(axis=-1) > DARK) & (np.maximum(mine, seen).max(axis=-1) < BRIGHT)
    if used.sum() < LEAST_FITTED:
        return np.ones_like(first)
    ratio = np.log(np.maximum(mine, 1.0) / np.maximum(seen, 1.0))
    gains = []
    for channel in range(3):
        y, X = ratio[..., channel], powers[::4, ::4]
        found, weight = np.zeros_like(y), np.zeros_like(y)
        a, weight[used] = _robust_fit(X[used], y[used])
        found = X @ a
        near = [cv2.blur(part.astype(np.float32), (REFLECTION, REFLECTION)) for part in (weight * (y - found), weight)]
        rest = cv2.resize(near[0] / (near[1] + 0.1), (w, h))
        gains.append(np.exp(np.clip(powers @ a + rest, -1.0, 1.0)))
    return np.stack(gains, axis=-1).astype(np.float32)


def _robust_fit(X: Float[np.ndarray, "N 6"], y: Float[np.ndarray, "N"]) -> tuple[Float[np.ndarray, "6"], np.ndarray]:
    """Coefficients of the surface through most points, drawn a little to a constant, and the points' weights."""
    weight = (np.abs(y - np.median(y)) < 0.25).astype(float)
    for _ in range(5):
        ridge = 1e-2 * weight.sum() * np.diag([1e-6, 1.0, 1.0, 1.0, 1.0, 1.0])
        found = np.linalg.solve((X * weight[:, None]).T @ X + ridge, (X * weight[:, None]).T @ y)
        off = np.abs(y - X @ found)
        reach = 3.0 * max(1.5 * np.median(off), 0.02)
        weight = np.maximum(1.0 - (off / reach) ** 2, 0.0) ** 2
    return found, weight


def colour_cost(
    first: Float32[np.ndarray, "h w 3"],
    other: Float32[np.ndarray, "h w 3"],
    gain: Float32[np.ndarray, "h w 3"],
    M: Float[np.ndarray, "3 3"],
) -> Float32[np.ndarray, "h w"]:
    """How much the colours of another view, warped by M and exposed as the first, differ: 0 (as noise does) to 1."""
    seen = _warped(other, M, first.shape[1::-1])
    off = np.abs(first - np.maximum(seen, 0.0) * gain).mean(axis=-1)
    return np.where(seen[..., 0] > OUTSIDE / 2.0, np.clip((off - SAME_COLOUR) / OTHER_COLOUR, 0.0, 1.0), NEUTRAL)


def mean_of_best(costs: Sequence[Float32[np.ndarray, "H W"]], share: float) -> Float32[np.ndarray, "H W"]:
    """The mean of each pixel's lowest costs, a share of all: from some views something hides it.

    >>> mean_of_best([np.full((1, 1), x, np.float32) for x in (1.0, 0.25, 0.75)], 0.5).tolist()
    [[0.5]]
    """
    count = int(np.ceil(share * len(costs)))
    return np.partition(np.stack(costs), count - 1, axis=0)[:count].mean(axis=0)


# --------------------------------------------------------------------------------------------- one height per pixel


def _smoothed(by_pattern, by_colour, guide) -> Float32[np.ndarray, "N h w"]:
    """Both costs and the table's discount at half size, with those of the ways to each pixel."""
    prior = np.where(np.abs(HEIGHTS) < NEAR_TABLE, -TABLE, 0.0).astype(np.float32)
    cost = COLOUR_WEIGHT * by_colour + prior[:, None, None]
    for k, one in enumerate(by_pattern):
        cost[k] += cv2.resize(one, guide.shape[1::-1], interpolation=cv2.INTER_AREA)
    return semi_global(np.ascontiguousarray(cost.transpose(1, 2, 0)), guide).transpose(2, 0, 1)


def semi_global(
    costs: Float32[np.ndarray, "h w N"], guide: Float32[np.ndarray, "h w 3"]
) -> Float32[np.ndarray, "h w N"]:
    """Sum the costs of the best ways from four sides to each pixel and height, divided by four.

    A way pays SMALL_STEP where its height changes by one step, LARGE_STEP where by more, less where the picture has an
    edge: L(p, k) = C(p, k) + min(L(q, k), L(q, k +- 1) + small, min L(q) + large) - min L(q), q the pixel before p.
    """
    total = np.zeros_like(costs)
    for axis in (0, 1):
        for step in (1, -1):
            C, G, T = (np.moveaxis(array, axis, 0)[::step] for array in (costs, guide, total))
            before = C[0].copy()
            T[0] += before
            for i in range(1, len(C)):
                edge = np.abs(G[i] - G[i - 1]).max(axis=-1)
                low = before.min(axis=1, keepdims=True)
                way = np.minimum(before, low + (LARGE_STEP / (1.0 + edge / COLOUR_STEP))[:, None])
                np.minimum(way[:, 1:], before[:, :-1] + SMALL_STEP, out=way[:, 1:])
                np.minimum(way[:, :-1], before[:, 1:] + SMALL_STEP, out=way[:, :-1])
                before = C[i] + way - low
                T[i] += before
    return total / 4.0


def _below(views: Sequence[View]) -> tuple[Bool[np.ndarray, "H W"], Bool[np.ndarray, "H W"]]:
    """Pixels of the first view whose patterns agree better somewhere below the table than at any height, and those
    within a window of them, where patterns are mixed.

    That is what a mirror shows, or a floor. Colours are not asked: a lamp's shine agrees below a plain table, too.
    """
    H, W = views[0].rgb.shape[:2]
    times = max(1, round(max(H, W) / SMALL))
    first, *others = (_resized(view, (W // times, H // times)) for view in views)
    patterns, seen = Patterns(_gray(first)), [_gray(view) for view in others]
    up, (near, far, steps) = first.T_base_cam[2, 3], UNDER
    under = up - 1.0 / np.linspace(1.0 / (up + far), 1.0 / (up + near), steps)
    heights = [*under, *HEIGHTS[::2]]
    costs = np.empty((*first.rgb.shape[:2], len(heights)), np.float32)
    for k, height in enumerate(heights):
        M = [plane_homography(first, view, height) for view in others]
        outside = 1.0 if k < steps else NEUTRAL  # what is below the table must be seen
        each = [patterns.cost(*at, outside) for at in zip(seen, M, strict=True)]
        costs[..., k] = mean_of_best(each, SEEN_BY[0])
    total = semi_global(costs, first.rgb.astype(np.float32))
    less = total[..., steps:].min(axis=-1) - total[..., :steps].min(axis=-1)
    sure = cv2.morphologyEx((less > DEEPER[0]).astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3))) > 0
    deeper = (_share_of_piece(less > DEEPER[1], sure) > 0.0).astype(np.uint8)
    empty = cv2.dilate(_empty(views[0].rgb), np.ones(2 * [times * (WINDOW + 1) + 1])) > 0
    grown = [cv2.dilate(deeper, np.ones((side, side))) for side in (3, WINDOW)]
    return tuple((cv2.resize(one, (W, H), interpolation=cv2.INTER_NEAREST) > 0) & ~empty for one in grown)


def _empty(rgb: UInt8[np.ndarray, "H W 3"]) -> UInt8[np.ndarray, "H W"]:
    """1 at the picture's border, and where it is black from there on: a lens that was taken out leaves such a strip,
    which goes along with the camera, as something infinitely far away does."""
    black = np.pad((rgb.max(axis=-1) == 0).astype(np.uint8), 1, constant_values=1)
    number = cv2.connectedComponents(black, connectivity=4)[1]
    return (number == number[0, 0]).astype(np.uint8)[1:-1, 1:-1]


def _between(total: Float32[np.ndarray, "N H W"], k) -> Float[np.ndarray, "H W"]:
    """The height of the lowest cost, between two steps: of the parabola through it and its neighbours."""
    inner = np.clip(k, 1, len(HEIGHTS) - 2)
    a, b, c = (np.take_along_axis(total, inner[None] + d, axis=0)[0] for d in (-1, 0, 1))
    bend = a - 2.0 * b + c
    shift = np.where(bend > 1e-6, 0.5 * (a - c) / np.maximum(bend, 1e-6), 0.0)
    return HEIGHTS[inner] + (HEIGHTS[1] - HEIGHTS[0]) * np.clip(shift, -0.5, 0.5)


def _certainty(weight, by_pattern, by_colour, k) -> Float32[np.ndarray, "H W"]:
    """1 - the cost at the height that was chosen: of the pattern where there is one, else of the colours."""
    H, W = k.shape
    pattern = np.take_along_axis(by_pattern, k[None], axis=0)[0] - NEUTRAL * (1.0 - weight)
    at_half = k[: H // 2 * 2 : 2, : W // 2 * 2 : 2]
    colour = cv2.resize(np.take_along_axis(by_colour, at_half[None], axis=0)[0], (W, H))
    return np.clip(1.0 - pattern - (1.0 - weight) * colour, 0.0, 1.0)


# ------------------------------------------------------------------------------------------ did something move?


def changed_places(first: View, others, depth, colours, other_colours, gains) -> tuple[float, ...]:
    """For each other view, the largest place where it alone differs from the first, a share of the picture.

    Where most of the others agree with the first, one that sees the point and shows another colour saw something else.
    """
    h, w = colours.shape[:2]
    H, W = depth.shape
    small = cv2.resize(depth, (w, h), interpolation=cv2.INTER_NEAREST)
    differs, looked = [], []
    for view, seen, gain in zip(others, other_colours, gains, strict=True):
        K, K_other = (resized_K(one.K, (W, H), (w, h)) for one in (first, view))
        uv, visible = _reprojected(small, K, K_other, invert_transform(view.T_base_cam) @ first.T_base_cam)
        there = cv2.remap(seen, uv, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=(OUTSIDE,) * 3)
        visible &= there[..., 0] > OUTSIDE / 2.0
        differs.append(visible & (np.abs(colours - np.maximum(there, 0.0) * gain).mean(axis=-1) > OTHER_COLOUR))
        looked.append(visible)
    agree = np.sum(np.array(looked) & ~np.array(differs), axis=0)
    most = 2 * agree > np.sum(looked, axis=0)
    return tuple(_largest(odd & most) / small.size for odd in differs)


def _reprojected(depth, K, K_other, T) -> tuple[Float32[np.ndarray, "h w 2"], Bool[np.ndarray, "h w"]]:
    """Where another view sees each point of a depth picture, and which of them nothing of that picture hides."""
    h, w = depth.shape
    P = pixel_rays((h, w), K) * depth[..., None] @ T[:3, :3].T + T[:3, 3]
    z = np.where(depth > 0.0, P[..., 2], np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        uv = np.nan_to_num((P / z[..., None] @ K_other.T)[..., :2], nan=OUTSIDE).astype(np.float32)
    nearest = np.full((h, w), np.float32(1e3))
    u, v = np.rint(uv).astype(int).reshape(-1, 2).T
    inside = (u >= 0) & (u < w) & (v >= 0) & (v < h)
    np.minimum.at(nearest, (v[inside], u[inside]), z.ravel()[inside])
    nearest = cv2.erode(nearest, np.ones((5, 5)))  # what is near hides what is beside it, too: edges are a little off
    before = np.full(h * w, np.nan)
    before[inside] = nearest[v[inside], u[inside]]
    with np.errstate(invalid="ignore"):
        return uv, z <= before.reshape(h, w) + HIDDEN


def _largest(places: Bool[np.ndarray, "h w"]) -> int:
    """Pixels of the largest piece, without what is thin."""
    opened = cv2.morphologyEx(places.astype(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))
    _, _, stats, _ = cv2.connectedComponentsWithStats(opened)
    return int(stats[1:, cv2.CC_STAT_AREA].max(initial=0))


# ------------------------------------------------------------------------------------------------------- pictures


def _gray(view: View) -> Float32[np.ndarray, "H W"]:
    return cv2.cvtColor(view.rgb, cv2.COLOR_RGB2GRAY).astype(np.float32)


def _halved(view: View) -> Float32[np.ndarray, "h w 3"]:
    """Colours at half size, whose noise is half as large."""
    H, W = view.rgb.shape[:2]
    return cv2.resize(view.rgb.astype(np.float32), (W // 2, H // 2), interpolation=cv2.INTER_AREA)


def _resized(view: View, size: tuple[int, int]) -> View:
    """The view in a picture of another, smaller size: width, height."""
    H, W = view.rgb.shape[:2]
    small = cv2.resize(view.rgb, size, interpolation=cv2.INTER_AREA)
    return replace(view, rgb=small, K=resized_K(view.K, (W, H), size))


def _upsampled(costs: Float32[np.ndarray, "N h w"], size: tuple[int, int]) -> Float32[np.ndarray, "N H W"]:
    return np.stack([cv2.resize(np.ascontiguousarray(cost), size) for cost in costs])


def _scaling(x: float, y: float) -> Float[np.ndarray, "3 3"]:
    """Pixels of a picture to those of one that is x times as wide and y times as high; pixel centres at integers."""
    return np.array([[x, 0.0, (x - 1.0) / 2.0], [0.0, y, (y - 1.0) / 2.0], [0.0, 0.0, 1.0]])


def _warped(image, M: Float[np.ndarray, "3 3"], size: tuple[int, int]):
    """Another view's picture as the first would see it; OUTSIDE where there is none."""
    how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return cv2.warpPerspective(image, M, size, flags=how, borderMode=cv2.BORDER_CONSTANT, borderValue=(OUTSIDE,) * 3)


def _moments(
    gray: Float32[np.ndarray, "H W"], side: int
) -> tuple[Float32[np.ndarray, "H W"], Float32[np.ndarray, "H W"]]:
    """Mean and variance of each window."""
    mean = cv2.boxFilter(gray, -1, (side, side))
    return mean, np.maximum(cv2.boxFilter(gray * gray, -1, (side, side)) - mean * mean, 0.0)
