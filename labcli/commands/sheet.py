"""`labkit sheet`: the sheet of paper that a camera is calibrated with."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from labcli.commands.options import tell_written


def sheet(
    out: Annotated[Path, typer.Option(help="The PDF to write.")] = Path("sheet.pdf"),
    paper: Annotated[Literal["a4", "letter"], typer.Option(help="Paper in the printer.")] = "a4",
) -> None:
    """Write a sheet to print at true size, for `calibrate` and `photos`."""
    from labcli.sheet import sheet_pdf
    from labkit.support.files import write_atomically

    write_atomically(out, sheet_pdf(paper))
    tell_written([out])
