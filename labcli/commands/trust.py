"""`labkit trust`: a course of one's own, whose code may run."""

from pathlib import Path
from typing import Annotated

import typer


def trust(
    folder: Annotated[
        Path, typer.Argument(help="A course's folder, with a pyproject.toml; the current one by default.")
    ] = Path("."),
) -> None:
    """Trust a course other than the installed one: commands in its folder then run its questions, which are code."""
    from labgrader.course import trust as trust_folder

    typer.echo(f"{folder.resolve()} is trusted from now on; {trust_folder(folder)} lists such folders")
