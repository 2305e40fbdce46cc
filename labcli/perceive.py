"""`labkit perceive`: a colour picture and a depth picture of anybody's camera become a mask, clouds, grasps, a report.

Without a camera pose the table is found in the depth picture (`on_table`), and the base frame is laid on it.
"""

from dataclasses import dataclass, field, fields, replace
from pathlib import Path

import numpy as np

from labcli.documents import numbers_of, parsed, text_of
from labcli.pictures import Shot, pose_beside, read_frame, read_numbers  # noqa: F401, labs look for read_frame here
from labcli.poses import read_pose
from labkit.frame import RGBDFrame, read_image
from labkit.geometry import Plane, Table, back_project, base_on_table, find_tables, invert_transform
from labkit.geometry.depth_units import LIKELY
from labkit.geometry.tables import height_of, planes_beside, table_at
from labkit.grasp import Gripper
from labkit.labels import CLASSES, IGNORE, TARGET
from labkit.notices import notices
from labkit.pipeline import Perception, Pipeline
from labkit.support.validation import require

# --------------------------------------------------------------------------------------------- what comes in


def read_gripper(text: str) -> Gripper:
    """Read a gripper's measures in metres, "max_opening=0.14 pad_width=0.022" or a JSON file; the rest is the Panda's.

    Raises ValueError for other words, other names, or measures that do not fit together.

    >>> read_gripper("max_opening=0.14").max_opening
    0.14
    """
    names = [measure.name for measure in fields(Gripper)]
    of_file = len(text) < 4000 and Path(text).is_file()
    words = parsed("gripper", text_of("gripper", text)) if of_file else text.replace(",", " ").split()
    try:
        given = words if isinstance(words, dict) else dict(str(word).split("=") for word in words)
        measures = {name: float(metres) for name, metres in given.items()}
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f'gripper: expected "NAME=METRES ..." or a JSON or YAML file, got {text!r}') from None
    unknown = ", ".join(sorted(measures.keys() - set(names)))
    require("gripper", not unknown, f"measures of {', '.join(names)}", unknown)
    return Gripper(**measures)


def read_workspace(text: str) -> tuple[tuple[float, float], ...]:
    """Read "x x y y z z": from and to, metres in the base frame, z from the table.

    Raises ValueError for other words than six numbers.
    """
    numbers = numbers_of(text)
    require("workspace", len(numbers) == 6, "six numbers, x x y y z z", repr(text))
    return tuple(zip(numbers[::2], numbers[1::2], strict=True))


def read_pixel(text: str, name: str = "at") -> tuple[float, float]:
    """Read "u,v", a pixel's column and row; raises ValueError for other words than two numbers.

    >>> read_pixel("320, 200")
    (320.0, 200.0)
    """
    numbers = numbers_of(text)
    require(name, len(numbers) == 2, 'two numbers "u,v", column and row of a pixel', repr(text))
    return tuple(numbers)


def read_mask(path, shot: Shot, target: int | None = None, instances: bool = False):
    """Read somebody's mask: labels, uint8 (H, W), the numbers of the objects or None, and what is to be said of it.

    8 or 16 bit, of the size of the shot's colour file; its lens is undone as the shot's. If it holds 0 and one other
    value alone, such as 255 or 1, that value means "target"; else the values are the kit's own classes. target: the
    value that means "target", whatever the others mean. instances: each value above 0 is an object, and a target.
    Raises ValueError for an image of another kind or size, and for values that no class has.
    """
    mask = read_numbers(path) if instances else read_image("mask", path, (np.uint8, np.uint16))
    mask = shot.labels_like(mask, path=path)
    if instances or target is not None:
        chosen = mask > 0 if target is None else mask == target
        return np.where(chosen, TARGET, 0).astype(np.uint8), mask if instances else None, ""
    values = np.unique(mask)
    others = values[values > 0].tolist()
    if len(others) <= 1:
        return np.where(mask > 0, TARGET, 0).astype(np.uint8), None, "".join(map(taken_for_target, others))
    if not np.isin(values, [*range(len(CLASSES)), IGNORE]).all():
        raise ValueError(
            f"mask: expected 0 and one other value, or labels 0 to {len(CLASSES) - 1} and 255, "
            f"got {values[:6].tolist()}{' ...' if len(values) > 6 else ''}; --instances takes each for an object, "
            "--target N one for the target"
        )
    return mask.astype(np.uint8), None, ""


def taken_for_target(value: int) -> str:
    """What to say of masks of 0 and one other value, if the kit has another class of that number.

    >>> taken_for_target(1), taken_for_target(255)
    ('the mask holds 0 and 1 alone: 1 is taken for the target, not for the class surface', '')
    """
    if value >= len(CLASSES) or value == TARGET:
        return ""
    return f"the mask holds 0 and {value} alone: {value} is taken for the target, not for the class {CLASSES[value]}"


def on_table(frame: RGBDFrame, table_z: float = 0.0) -> tuple[RGBDFrame, Plane]:
    """Find the table in a frame's depth, and lay the base frame on it, or so that the table is at height `table_z`.

    The table is the likeliest of `find_tables`. Gives the frame and the table's plane, in the camera's frame. Raises
    ValueError if there is no plane.
    """
    tables = find_tables(back_project(frame.depth, frame.K))
    if not tables:
        raise ValueError(f"depth: expected a plane that may be the table, got none{_why_none(frame)}")
    T = base_on_table(tables[0].plane)
    T[2, 3] += table_z
    return replace(frame, T_base_cam=T, table_z=table_z), tables[0].plane


def on_own_table(frame: RGBDFrame, color: Path) -> RGBDFrame:
    """A frame of a folder of pictures in its base frame, with the table at z = 0.

    The pose is that of pose/NAME.txt beside color/NAME.png, as `labkit photos` writes it, where that is there; else the
    table is found as in `on_table`, which raises ValueError if there is none, as does a file that is no pose.
    """
    beside = pose_beside(color)
    if beside is None:
        return on_table(frame)[0]
    return replace(frame, T_base_cam=read_pose(str(beside), color).in_base(frame)[0], table_z=0.0)


def _why_none(frame: RGBDFrame) -> str:
    """Say how far away depth is, and which unit would bring it to where tables are, if it is not there."""
    seen = frame.depth[frame.depth > 0.0]
    middle = float(np.median(seen)) if seen.size else 0.0
    if middle <= LIKELY[1]:
        return "; --camera-pose says where it is"
    said = f"; the median depth is {middle:.2g} m"
    for words, factor in (("a tenth", 0.1), ("a thousandth", 0.001)):
        if LIKELY[0] <= factor * middle <= LIKELY[1]:
            return f"{said}; {words} of the unit makes it {factor * middle:.2g} m: see --depth-scale"
    return f"{said}: see --depth-scale"


# ---------------------------------------------------------------------------------------------- what is made of it


@dataclass(frozen=True, eq=False)
class Seen:
    """A frame in the base frame, what was perceived in it, what looks wrong, and the table's plane if it was fitted.

    gripper: the hand that was planned for. others: level planes beside the table, in the base frame.
    """

    frame: RGBDFrame
    perception: Perception
    notices: tuple[str, ...] = ()
    plane: Plane | None = None
    gripper: Gripper = field(default_factory=Gripper)
    others: tuple[Table, ...] = ()


def perceive(
    frame: RGBDFrame,
    pipeline: Pipeline,
    labels=None,
    instances=None,
    T_base_cam=None,
    table_z: float = 0.0,
    at=None,
    not_at=None,
) -> Seen:
    """Run the chain on a frame that is given in the camera's own frame.

    labels: somebody else's, and the `instances` among them if known; else the pipeline perceives. T_base_cam: the
    camera's pose, with the table at height `table_z`; without it the table is found in the depth picture, and the base
    frame laid under it so that the table is at that height. at, not_at: as in `Pipeline.run`. Raises ValueError if no
    plane can be found, or for an argument that does not fit. Topics 06 and 07.
    """
    plane = None
    if T_base_cam is None:
        frame, plane = on_table(frame, table_z)
    else:
        frame = replace(frame, T_base_cam=T_base_cam, table_z=table_z)
    if labels is None:
        perception = pipeline.run(frame, at, not_at)
    else:
        perception = pipeline.locate(frame, labels, instances=instances, at=at, not_at=not_at)
    tables = perception.tables or find_tables(perception.points, frame.T_base_cam[:3, 3], up=(0.0, 0.0, 1.0))
    table = table_at(tables, table_z)
    others = tuple(planes_beside(tables, table))
    return Seen(frame, perception, notices(frame, perception), plane, pipeline.gripper, others)


def describe(seen: Seen) -> str:
    """Say what was found, in lines for a terminal: what looks wrong, the table, each target, how to grasp."""
    p, lines = seen.perception, [f"notice: {sentence}" for sentence in seen.notices]
    if seen.plane is not None:
        height = seen.frame.T_base_cam[2, 3] - (seen.frame.table_z or 0.0)
        tilt = np.degrees(np.arcsin(np.clip(-seen.frame.T_base_cam[2, 2], -1.0, 1.0)))
        lines.append(
            f"table: {seen.plane.inliers.mean():.0%} of {seen.plane.inliers.size} points lie on one plane, "
            f"{1000.0 * seen.plane.residual:.1f} mm off it (root mean square)"
        )
        lines.append(f"camera: {height:.3f} m over the table, looking {tilt:.0f} degrees down")
    for other in seen.others:
        length, width = (100.0 * side for side in other.sides)
        over = height_of(other) - (seen.frame.table_z or 0.0)
        lines.append(f"another plane: {over:+.2f} m from the table's height, {length:.0f} x {width:.0f} cm seen of it")
    for number, (cloud, certainty) in enumerate(zip(p.clouds, p.certainty, strict=True), start=1):
        middle = ", ".join(f"{x:+.3f}" for x in cloud.mean(axis=0, dtype=np.float64))
        lines.append(f"target {number}: {len(cloud)} points around ({middle}) m, certainty {certainty:.2f}")
    if not p.plan.grasps:
        return "\n".join([*lines, f"no grasp: {p.plan.reason}"])
    best = p.plan.grasps[0]
    place = ", ".join(f"{x:+.3f}" for x in best.T_base_grasp[:3, 3])
    yaw = np.degrees(np.arctan2(best.T_base_grasp[1, 1], best.T_base_grasp[0, 1])) % 180.0
    lines.append(
        f"best grasp: target {best.target + 1}, close at ({place}) m of the base frame, from jaws "
        f"{100.0 * best.width:.1f} cm apart, closing at {yaw:.0f} degrees from x; score {best.score:.2f}, the best of "
        f"{len(p.plan.grasps)}"
    )
    return "\n".join(lines)


def grasps_json(seen: Seen) -> dict:
    """The grasps as plain data: poses in the base frame and in the camera's, metres; width, score, target from 1."""
    T_cam_base = invert_transform(seen.frame.T_base_cam)
    p = seen.perception
    return {
        "T_base_cam": seen.frame.T_base_cam.tolist(),
        "table_z": seen.frame.table_z,
        "reason": p.plan.reason,
        "notices": list(seen.notices),
        "other_planes": [{"height": height_of(other), "sides": list(other.sides)} for other in seen.others],
        "targets": [
            {"points": len(cloud), "centroid": cloud.mean(axis=0, dtype=np.float64).tolist(), "certainty": certainty}
            for cloud, certainty in zip(p.clouds, p.certainty, strict=True)
        ],
        "grasps": [
            {
                "T_base_grasp": grasp.T_base_grasp.tolist(),
                "T_cam_grasp": (T_cam_base @ grasp.T_base_grasp).tolist(),
                "width": float(grasp.width),
                "score": float(grasp.score),
                "target": grasp.target + 1,
            }
            for grasp in p.plan.grasps
        ],
    }
