"""`labkit exam`: questions for paper, with a key."""

from pathlib import Path
from typing import Annotated

import typer

from labcli.commands.options import tell_written


def exam(
    out: Annotated[Path, typer.Option(help="Folder for exam_A.html, exam_B.html, ... and key.html.")],
    seed: Annotated[
        int, typer.Option(help="What the numbers are drawn from: keep it where students do not look.", min=0)
    ],
    topics: Annotated[str, typer.Option(help="Numbers of topics: 01-05, or 01,04,06-07.")] = "01-09",
    minutes: Annotated[int, typer.Option(help="How long the exam may take.", min=1)] = 60,
    versions: Annotated[int, typer.Option(help="Versions with the same questions and other numbers, 1 to 3.")] = 1,
) -> None:
    """Write an exam on paper: pages to print, and a key that the kit computes."""
    from labcourse.exam.draw import topics_of
    from labcourse.exam.page import write
    from labgrader.course import topics as taught

    tell_written(write(topics_of(topics, taught()), minutes, seed, versions, out))
