"""`labkit perceive`: targets and grasps in a picture from your own camera."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from labcli.commands.options import Aligned, CameraName, DepthScale, Gripper, Model


def perceive(
    color: Annotated[Path, typer.Argument(help="Colour picture.")],
    depth: Annotated[
        Path, typer.Argument(help="Depth aligned to it: 16-bit PNG, TIFF, PFM, NPY, NPZ, EXR; 0 and NaN: no reading.")
    ],
    intrinsics: Annotated[
        str, typer.Option(help='The camera: "fx fy cx cy", or a file of any usual kind (docs/cameras.md).')
    ],
    camera_pose: Annotated[
        str | None,
        typer.Option(
            help='Pose of the camera in the base frame: "x y z qx qy qz qw", a 4x4 matrix, or a file; by default '
            "pose/NAME.txt beside color/NAME.png, if it is there."
        ),
    ] = None,
    plane: Annotated[
        Literal["auto"] | None,
        typer.Option(help="Find the table and put the base frame on it; the default without a pose."),
    ] = None,
    table_z: Annotated[float, typer.Option(help="Height of the table in the base frame, metres.")] = 0.0,
    depth_scale: DepthScale = None,
    aligned: Aligned = False,
    camera_name: CameraName = None,
    model: Model = "unet_rgbd",
    mask: Annotated[
        Path | None,
        typer.Option(help="Use this mask instead of the network's: 0 and one other value, or labels."),
    ] = None,
    instances: Annotated[
        bool, typer.Option("--instances", help="Each value above 0 of --mask is an object, and each object a target.")
    ] = False,
    anything: Annotated[
        bool, typer.Option("--anything", help="Every object on the table is a target, whatever its class.")
    ] = False,
    at: Annotated[
        list[str] | None,
        typer.Option(
            help='Pixel "U,V", column and row: the object there is the target, of any class; several mark one object.'
        ),
    ] = None,
    not_at: Annotated[
        list[str] | None,
        typer.Option(
            "--not", help='Pixel "U,V" on another object that --at included: the two are separated between the clicks.'
        ),
    ] = None,
    target: Annotated[
        int | None,
        typer.Option(help="The class to grasp, 2 by default; with --mask, the value that means target."),
    ] = None,
    gripper: Gripper = "",
    workspace: Annotated[
        str,
        typer.Option(
            help="What the arm can reach: from and to in x, y and z of the base frame, z from the table; by default "
            "whatever stands on the table."
        ),
    ] = "",
    out: Annotated[
        Path, typer.Option(help="Folder for overlay.png, targets.png, clouds, grasps.json, report.html.")
    ] = Path("out"),
) -> None:
    """Find targets and grasps in a picture from your own camera; finding none is a valid result."""
    from dataclasses import replace

    from labcli import perceive as own
    from labcli.cameras import read_intrinsics
    from labcli.pictures import Reading, pose_beside, read_shot
    from labcli.poses import read_pose
    from labcli.report import save
    from labkit.labels import TARGET
    from labkit.learning.network import load_model, weights_path
    from labkit.learning.things import instance_finder
    from labkit.pipeline import Pipeline
    from labkit.support.files import check_writable

    if plane is not None and camera_pose is not None:
        raise ValueError("plane: expected either --plane auto or --camera-pose, got both")
    if anything and (mask is not None or target is not None):
        raise ValueError("anything: expected neither --mask nor --target beside it; it takes each object for a target")
    if instances and (mask is None or target is not None):
        raise ValueError("instances: expected --mask FILE beside it, and no --target; each value is one")
    check_writable(out)  # before anything that takes its time
    if camera_pose is None and plane is None and (beside := pose_beside(color)):
        camera_pose = str(beside)
        typer.echo(f"camera_pose: {beside}, which lies beside the picture; --plane auto finds the table instead")
    pose = read_pose(camera_pose, color) if camera_pose else None
    shot = read_shot(
        color, depth, read_intrinsics(intrinsics, color, camera_name), Reading(depth_scale, aligned, camera_name)
    )
    T_base_cam, said_of_pose = (None, ()) if pose is None else pose.in_base(shot.frame)
    for sentence in (*shot.said, *said_of_pose):
        typer.echo(sentence)
    planning = {"gripper": own.read_gripper(gripper), "unit_known": depth_scale is not None}
    planning["workspace"] = own.read_workspace(workspace) if workspace else "table"
    at, not_at = (
        [shot.pixel(*own.read_pixel(text, name), name) for text in texts or ()]
        for name, texts in (("at", at), ("not", not_at))
    )
    if not_at and not at:
        raise ValueError("not: expected --at U,V beside it: the thing that is to be parted")
    labels, numbers, said = None, None, ""
    if mask is not None:
        pipeline = Pipeline(**planning)
        labels, numbers, said = own.read_mask(mask, shot, target, instances)
    elif anything:
        pipeline = Pipeline(find_objects=instance_finder(load_model(weights_path(model))), **planning)
    else:
        pipeline = Pipeline(
            load_model(weights_path(model)), target_class=TARGET if target is None else target, **planning
        )
    seen = own.perceive(shot.frame, pipeline, labels, numbers, T_base_cam, table_z, at, not_at)
    seen = replace(seen, notices=(said, *seen.notices)) if said else seen
    typer.echo(own.describe(seen))
    for path in save(seen, out):
        typer.echo(f"wrote {path}")
