"""`labkit photos`: a frame with depth from photographs of one table, with the sheet on it."""

from pathlib import Path
from typing import Annotated

import typer

from labcli.commands.options import MeasuredMm


def photos(
    folder: Annotated[Path, typer.Argument(help="Five to twelve photographs of one table, the sheet in each.")],
    camera: Annotated[Path, typer.Option(help="camera.json of `labkit calibrate`, of the same camera and size.")],
    out: Annotated[Path, typer.Option(help="Folder that gets color/, depth/, pose/ and camera.json.")],
    name: Annotated[str, typer.Option(help="The frame's name.")],
    measured_mm: MeasuredMm = 150.0,
) -> None:
    """Make a frame with depth from photographs of a table with the sheet on it, and add it to a folder of pictures."""
    from labcli import photos as own
    from labcli.cameras import read_intrinsics
    from labkit.geometry.sheet import RULER_MM, Sheet

    own.check_new(out, name)
    table = own.table_in(folder, read_intrinsics(str(camera)), Sheet(measured_mm / RULER_MM))
    typer.echo(own.describe(table, own.write(out, name, table.frame)))
