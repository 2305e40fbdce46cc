"""`labkit grades`: tables of grades for other platforms."""

from pathlib import Path
from typing import Annotated

import typer

from labcli.commands.options import needs_linux, of_course, tell_written


def grades(
    topic: Annotated[str, typer.Argument(help="Which lab, such as 04_iou; or course, for all labs together.")],
    moodle: Annotated[bool, typer.Option("--moodle", help="Moodle's grading worksheet, and its zip of pages.")] = False,
    canvas: Annotated[bool, typer.Option("--canvas", help="Canvas's columns, and its zip of pages.")] = False,
    gradescope: Annotated[bool, typer.Option("--gradescope", help="An autograder for Gradescope, as a zip.")] = False,
    assignment: Annotated[
        int | None, typer.Option(help="Canvas's number of the assignment, if its column has a different name.", min=1)
    ] = None,
    course: Annotated[Path, typer.Option(help="Folder that holds nbgrader's gradebook.", callback=of_course)] = Path(
        "."
    ),
) -> None:
    """Write a table of grades: for Moodle or Canvas as they import it, with a zip of feedback that they hand out.

    Exit status 1 if something still has to be graded by hand; it says what.
    """
    needs_linux("grades")
    from labgrader.grade_course import private
    from labgrader.report.course_page import FOLDER, write_course
    from labgrader.report.gradescope import write_autograder
    from labgrader.report.platforms import write_grades

    if moodle + canvas + gradescope > 1:
        raise ValueError("expected one of --moodle, --canvas and --gradescope, got more")
    if assignment is not None and not canvas:
        raise ValueError("assignment: expected --canvas beside it, got another platform")
    platform = "moodle" if moodle else "canvas" if canvas else "scores"
    if topic == FOLDER and not gradescope:
        with private():
            files, waiting = write_course(course, platform)
        tell_written(files)
        if waiting:
            typer.echo(f"not final yet: {', '.join(waiting)}")
        raise typer.Exit(1 if waiting else 0)
    if gradescope:
        with private():
            tell_written([write_autograder(course, topic)])
        return
    with private():
        written = write_grades(course, topic, platform, assignment)
    if written.maximum != written.released:
        said = f"the maximum is {written.maximum:g} now, and was {written.released:g} in the lab that students got"
        typer.echo(f"{said}: set it in the assignment before you import")
    tell_written(written.files)
    for student, why in written.without.items():
        typer.echo(f"no grade: {student} ({why})")
    if written.waiting:
        typer.echo(f"to be graded by hand yet: {', '.join(written.waiting)}")
    raise typer.Exit(1 if written.waiting else 0)
