"""`labkit grade`: submissions of a lab, in a sandbox."""

from pathlib import Path
from typing import Annotated

import typer

from labcli.commands.options import needs_linux, of_course


def grade(
    topic: Annotated[str, typer.Argument(help="Which lab, such as 04_iou.")],
    submissions: Annotated[
        Path | None, typer.Option(help="Folder of STUDENT/TOPIC/TOPIC.ipynb; by default COURSE/submitted.")
    ] = None,
    seed: Annotated[str | None, typer.Option(help="Secret seed of a round; drawn by default; kept in OUT.")] = None,
    new_round: Annotated[
        bool,
        typer.Option(
            "--new-round", help="Draw a new seed and grade everyone with it; otherwise late work joins the old round."
        ),
    ] = False,
    workers: Annotated[
        int | None, typer.Option(help="Submissions graded at a time; by default one per core.", min=1)
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; by default COURSE/grades/TOPIC.")] = None,
    course: Annotated[
        Path, typer.Option(help="Folder that holds labs/ and nbgrader's gradebook.", callback=of_course)
    ] = Path("."),
    comment: Annotated[
        tuple[str, str] | None,
        typer.Option(help="A group of wrong answers, see class.html, and the comment they all see."),
    ] = None,
    everybody: Annotated[str | None, typer.Option(help="A question for which everyone gets full points.")] = None,
    drop: Annotated[str | None, typer.Option(help="A question that does not count.")] = None,
    points: Annotated[str | None, typer.Option(help="A question and its new points, such as iou=3.")] = None,
    partial: Annotated[str | None, typer.Option(help="A question whose outputs count separately.")] = None,
    reason: Annotated[str, typer.Option(help="Why; kept in changes.json, and shown to students.")] = "",
    undo: Annotated[str | None, typer.Option(help="A question whose change should be undone.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Grade again even what has not changed.")] = False,
    tidy: Annotated[
        bool, typer.Option("--tidy", help="Remove pages and grades of students whose submission is gone.")
    ] = False,
    against: Annotated[Path | None, typer.Option(help="An earlier course whose answers are compared too.")] = None,
    look: Annotated[
        str | None, typer.Option(help="A key on a student's page: show that program, its cases and replies.")
    ] = None,
    unsafe: Annotated[
        bool, typer.Option("--unsafe-no-sandbox", help="Without bubblewrap: submissions may do anything here.")
    ] = False,
) -> None:
    """Grade a lab in a sandbox; exit status 1 if something needs attention, 2 if grading was impossible."""
    import os

    needs_linux("grade")
    from labgrader.grade.changes import change_of
    from labgrader.grade_course import grade_course
    from labgrader.report.second_look import second_look
    from labgrader.sandbox.sandbox import NO_SANDBOX

    if look is not None:
        for line in second_look(topic, course, look, submissions, out, unsafe):
            typer.echo(line)
        return
    how = {"submissions": submissions, "out": out, "seed": seed, "new_round": new_round, "comment": comment}
    how |= {"workers": workers or os.cpu_count() or 1, "force": force, "unsafe": unsafe, "tidy": tidy, "undone": undo}
    how["change"] = change_of(topic, reason, everybody=everybody, drop=drop, points=points, partial=partial)
    graded = grade_course(topic, course, against=against, **how)
    folder = out or course / "grades" / topic
    tell(graded, folder, tidy)
    if unsafe:
        typer.echo(f"Warning: {NO_SANDBOX}.", err=True)
    raise typer.Exit(1 if graded.needs_a_look else 0)


def tell(graded, folder: Path, tidy: bool) -> None:
    """Print the table of a grading, what an instructor should know about it, and where its files are."""
    from labgrader.report.alike_page import terminal_lines
    from labgrader.report.outputs import terminal_table
    from labgrader.support import counted

    topic = graded.lab.topic
    typer.echo(terminal_table(graded.lab, graded.records, graded.told, graded.absent))
    if graded.strangers:
        typer.echo(f"course.toml has extensions of nobody here: {', '.join(graded.strangers)}", err=True)
    for student, failure in graded.failures.items():
        typer.echo(f"{student}: {failure}", err=True)
    for student, file in graded.other_files.items():
        typer.echo(f"{student}: no {topic}.ipynb, so {file} was graded, the only notebook there and a copy of the lab")
    if graded.new_gradebook:
        lost = "a new one was made, without the points and comments that a person gave; put back a copy if you have one"
        typer.echo(f"there were grades of {topic}, but no gradebook.db beside them: {lost}", err=True)
    if graded.kept_out:
        typer.echo(f"added to .gitignore, since they are about persons: {', '.join(graded.kept_out)}", err=True)
    for old, name in graded.renamed.items():
        typer.echo(f"{old} is {name} now: grades and pages were moved")
    if graded.gone:
        done = "removed what there was" if tidy else "--tidy removes the pages and grades"
        typer.echo(f"{done} of students without a submission: {', '.join(graded.gone)}")
    typer.echo(
        f"{counted(len(graded.records), 'student')}, {graded.graded_now} of them graded now: {folder / 'grades.csv'}"
    )
    for line in terminal_lines(graded.alike, folder / "alike.html"):
        typer.echo(line)
