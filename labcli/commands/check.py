"""`labkit check`: what the grader will say of a saved lab."""

from pathlib import Path
from typing import Annotated

import typer


def check(lab: Annotated[Path, typer.Argument(help="A saved lab, your own notebook file.")]) -> None:
    """Check a saved lab as the grader will, on public cases; exit status 1 if an answer is not right.

    It runs with your rights and without a sandbox: a stranger's notebook is for `labkit grade`.
    """
    from labgrader.file_check import check_file

    raise typer.Exit(0 if check_file(lab) else 1)
