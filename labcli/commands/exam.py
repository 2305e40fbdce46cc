"""`labkit exam`: questions for paper, with a key."""

import secrets
from pathlib import Path
from typing import Annotated

import typer

from labcli.commands.options import tell_written


def exam(
    out: Annotated[Path, typer.Option(help="Folder for exam_A.html, exam_B.html, ... and key.html.")],
    seed: Annotated[
        int | None,
        typer.Option(help="Seed for the numbers; drawn by the system if omitted. Only the key shows it.", min=0),
    ] = None,
    topics: Annotated[str, typer.Option(help="Numbers of topics: 01-05, or 01,04,06-07.")] = "01-09",
    minutes: Annotated[
        int, typer.Option(help="How long the exam takes; questions fill five sixths of it.", min=1)
    ] = 60,
    versions: Annotated[int, typer.Option(help="Versions with the same questions and different numbers, 1 to 3.")] = 1,
    without: Annotated[list[str] | None, typer.Option(help="A question to leave out, by its name in a key.")] = None,
    course: Annotated[str, typer.Option(help="Printed in the heading; a line to fill in if omitted.")] = "",
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Remove another exam's pages and key in OUT.")] = False,
    aids: Annotated[str, typer.Option(help="What students may use; pen and paper if omitted.")] = "",
) -> None:
    """Write an exam on paper: pages to print, and a key that the kit computes."""
    from labcourse.exam.draw import topics_of
    from labcourse.exam.page import exam as drawn_exam
    from labcourse.exam.page import write
    from labgrader.course import topics as taught

    chosen, seed = topics_of(topics, taught()), secrets.randbits(64) if seed is None else seed
    pages = drawn_exam(chosen, minutes, seed, versions, without or (), course, aids)
    tell_written(write(out, pages, overwrite))
