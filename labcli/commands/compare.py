"""`labkit compare`: the stacks on the same scenes."""

from pathlib import Path
from typing import Annotated

import typer


def compare(
    out: Annotated[Path, typer.Option(help="The table to write, a CSV file.")] = Path("out/09_other_stacks.csv"),
    scenes: Annotated[int, typer.Option(help="How many scenes.", min=1)] = 40,
) -> None:
    """Compare the stacks on the same scenes, masks, times and lifts: the table that lesson 09 reads (some minutes)."""
    from labcli import stack_study

    typer.echo(stack_study.table(stack_study.run(out, scenes=scenes)))
