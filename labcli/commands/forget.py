"""`labkit forget`: a student who is to be in no file of a course any more."""

from pathlib import Path
from typing import Annotated

import typer

from labcli.commands.options import needs_linux, of_course


def forget(
    student: Annotated[str, typer.Argument(help="A student's folder, the number at its end, or an id of the roster.")],
    course: Annotated[
        Path, typer.Option(help="Folder that holds submitted/, grades/ and roster.csv.", callback=of_course)
    ] = Path("."),
) -> None:
    """Remove a student from submissions, grades, gradebook, roster and extensions, and list each place."""
    needs_linux("forget")
    from labgrader.grade_course import private
    from labgrader.report.forget import forget as forget_student

    with private():
        done = forget_student(course, student)
    for line in done:
        typer.echo(line)
