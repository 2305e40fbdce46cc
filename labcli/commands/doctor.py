"""`labkit doctor`: is everything here that the kit needs, and if not, what mends it?"""

from typing import Annotated

import typer


def doctor(
    warm: Annotated[
        bool, typer.Option("--warm", help="Compile now, for all users, what first runs would compile.")
    ] = False,
) -> None:
    """Check Python, packages, PyBullet, a render, disk, cores and GPU; exit status 1 if something needed is missing."""
    from labcli.doctor import all_well, examine, report, warm_up

    findings = [warm_up()] if warm else examine()
    typer.echo(report(findings))
    raise typer.Exit(0 if all_well(findings) else 1)
