"""`labkit calibrate`: what a camera is, and where it is on an arm, from photographs of a sheet."""

from pathlib import Path
from typing import Annotated

import typer

from labcli.commands.options import MeasuredMm, tell_written


def calibrate(
    folder: Annotated[Path, typer.Argument(help="Photographs of the sheet from at least six sides.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder for camera.json and calibration.html; FOLDER by default.")
    ] = None,
    measured_mm: MeasuredMm = 150.0,
    chessboard: Annotated[str, typer.Option(help="Your own chessboard instead of the sheet: inner corners, 9x6.")] = "",
    square: Annotated[float | None, typer.Option(help="Side of a square of --chessboard, metres.")] = None,
    arm: Annotated[
        Path | None,
        typer.Option(help="The arm's pose for each photograph, a CSV of name,x,y,z,qx,qy,qz,qw: hand in base."),
    ] = None,
    camera: Annotated[
        Path | None, typer.Option(help="With --arm: an existing camera.json, instead of calibrating first.")
    ] = None,
) -> None:
    """Find a camera's matrix and lens from photographs of the sheet; with --arm, where it is on or beside an arm."""
    from labcli import calibrate as own
    from labcli.cameras import read_intrinsics
    from labkit.support.files import check_writable, write_atomically
    from labkit.support.validation import require

    require("camera", camera is None or arm is not None, "--arm beside it", "none")
    out = out or folder
    check_writable(out)
    target = own.target_of(chessboard, square, measured_mm)
    require(
        "arm", not (arm and chessboard), "the kit's sheet: a chessboard's pose is known but for a half turn", chessboard
    )
    views = own.look(folder, target)
    written = {}
    if camera is None:
        found = own.calibrated(views)
        K, lens = found.K, found.distortion
        written["camera.json"] = own.dumped(own.camera_json(found, views.orientation))
        written["calibration.html"] = own.page(found, views).encode()
    else:
        known = read_intrinsics(str(camera))
        K, lens = known.K, known.distortion
        way = "brown_conrady" if known.lens is None else known.lens.model
        require("camera", way == "brown_conrady", "a lens of OpenCV's kind", way)
        require("camera", known.size in (None, views.size), f"one of pictures of {views.size}", known.size)
    poses = own.on_arm(views, own.read_arm(arm), K, lens) if arm else None
    for line in views.said:
        typer.echo(line)
    if camera is None:
        typer.echo(own.describe(found))
    if poses:
        text, written["hand_eye.json"] = own.arm_json(*poses)
        typer.echo(text)
    for name, data in written.items():
        write_atomically(out / name, data)
    tell_written([out / name for name in written])
