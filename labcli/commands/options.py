"""Options that several commands share, and how they say what they wrote."""

import sys
from pathlib import Path
from typing import Annotated

import typer

Model = Annotated[str, typer.Option(help="unet_rgbd, unet, smallsegnet, or a file of your own weights.")]
Refine = Annotated[bool | None, typer.Option("--crf/--no-crf", help="Refine a network's masks with the CRF.")]
Workers = Annotated[int, typer.Option(help="Processes.", min=1)]
Dask = Annotated[str | None, typer.Option(help="Run on the workers of this Dask scheduler, tcp://host:8786.")]

Gripper = Annotated[
    str, typer.Option(help='The hand, if not the Panda\'s: "max_opening=0.14 ...", metres, or a JSON or YAML file.')
]
DepthScale = Annotated[
    float | None, typer.Option(help="Metres per unit of depth; by default the camera file's, or the one that fits.")
]
Aligned = Annotated[
    bool, typer.Option("--aligned", help="Depth of another size shows the same view as colour, as on a phone.")
]
CameraName = Annotated[str | None, typer.Option(help="Which camera to use, if the file has several.")]

MeasuredMm = Annotated[
    float, typer.Option(help="Measured length of the sheet's 150 mm line as printed, millimetres.", min=30.0, max=750.0)
]


def of_course(context: typer.Context, parameter: typer.CallbackParam, folder: Path) -> Path:
    """Take the settings of the course that a command is told, before anything asks for the course.

    Only what somebody typed names a course: the folder in which a command is started may be a stranger's.
    """
    from labgrader.course import use

    source = context.get_parameter_source(parameter.name)
    if source is None or source.name != "DEFAULT":
        use(folder)
    return folder


def needs_linux(command: str) -> None:
    """Raise ValueError unless this is Linux, whose kernel keeps submissions apart."""
    if sys.platform != "linux":
        where = "use Linux, WSL or a container"
        raise ValueError(f"labkit {command} needs Linux, and this is {sys.platform}: {where} (docs/install.md)")


def tell_written(paths: list[Path]) -> None:
    """Print which files were written."""
    for path in paths:
        typer.echo(f"wrote {path}")
