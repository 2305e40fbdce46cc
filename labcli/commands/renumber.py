"""`labkit renumber`: reruns lessons and updates their marked numbers."""

from pathlib import Path
from typing import Annotated

import typer


def renumber(
    lessons: Annotated[list[Path] | None, typer.Argument(help="Notebooks; all lessons by default.")] = None,
    family: Annotated[
        str,
        typer.Option(help="Run nothing: list the lessons and solutions whose scenes contain an object of this family."),
    ] = "",
) -> None:
    """Rerun lessons, update their marked numbers, and list the sentences whose claim may no longer hold.

    For your own camera (`camera` in [tool.labcourse], LABKIT_CAMERA), other scenes, or new versions. The
    notebooks are changed in place; git shows the changes. Exit status 1 if a sentence has to be read again.
    """
    from labcli import renumber as again

    paths = lessons or sorted(
        [*Path("lessons").glob("*.ipynb"), *(Path().glob("solutions/*/*.ipynb") if family else [])]
    )
    if not paths:
        raise ValueError("lessons: expected notebooks, or a folder lessons/ here, found neither")
    if family:
        for path, scenes in again.holding(family, paths).items():
            typer.echo(f"{path}: {', '.join(f'{seed} {config}' for seed, config in scenes)}")
        return
    raise typer.Exit(0 if again.all_of(paths, typer.echo) else 1)
