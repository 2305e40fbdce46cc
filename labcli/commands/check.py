"""`labkit check`: what the grader will say of a saved lab."""

from contextlib import closing
from pathlib import Path
from typing import Annotated

import typer


def check(lab: Annotated[Path, typer.Argument(help="A saved lab, a notebook file.")]) -> None:
    """Check a saved lab as the grader will, on public cases; exit status 1 if an answer is wrong.

    Answers run in the grader's sandbox if there is one (Linux). Otherwise they run with your own
    rights, after a warning: do not check a stranger's notebook on such a machine.
    """
    from labgrader.file_check import LIMITS, check_file

    try:
        from labgrader.sandbox import sandbox

        sandbox.probe(("numpy",), LIMITS)
    except (ImportError, OSError, ValueError) as reason:
        typer.echo(f"Checked WITHOUT a sandbox, with your rights: {reason}", err=True)
        passed = check_file(lab)
    else:
        with closing(sandbox.servers):
            passed = check_file(lab, sandbox.fresh_worker)
    raise typer.Exit(0 if passed else 1)
