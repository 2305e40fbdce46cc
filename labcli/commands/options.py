"""Options that several commands share, and how they say what they wrote."""

from pathlib import Path
from typing import Annotated

import typer

Model = Annotated[str, typer.Option(help="unet_rgbd, unet, smallsegnet, or a file of your own weights.")]
Refine = Annotated[bool | None, typer.Option("--crf/--no-crf", help="Refine a network's masks with the CRF.")]
Workers = Annotated[int, typer.Option(help="Processes.", min=1)]
Dask = Annotated[str | None, typer.Option(help="Run on the workers of this Dask scheduler, tcp://host:8786.")]

MeasuredMm = Annotated[
    float, typer.Option(help="How long the sheet's line of 150 mm is as printed, millimetres.", min=30.0, max=750.0)
]


def of_course(folder: Path) -> Path:
    """Take the settings of the course that a command is told, before anything asks for the course."""
    from labgrader.course import use

    use(folder)
    return folder


def tell_written(paths: list[Path]) -> None:
    """Print which files were written."""
    for path in paths:
        typer.echo(f"wrote {path}")
