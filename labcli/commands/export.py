"""`labkit export`: a network as an ONNX file."""

from pathlib import Path
from typing import Annotated

import typer

from labcli.commands.options import Model


def export(
    onnx: Annotated[Path, typer.Option(help="The file to write.")],
    model: Model = "unet",
) -> None:
    """Write a network as one ONNX file, which OpenCV, onnxruntime and other stacks read."""
    from labkit.learning import engines
    from labkit.learning.network import load_model, weights_path

    engines.export(load_model(weights_path(model)), onnx)
    typer.echo(f"wrote {onnx}")
