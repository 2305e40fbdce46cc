"""`labkit texts`: a page on which a person grades answers in words, question by question."""

from pathlib import Path
from typing import Annotated

import typer

from labcli.commands.options import needs_linux, of_course


def texts(
    topic: Annotated[str, typer.Argument(help="Which lab, such as 04_iou.")],
    course: Annotated[Path, typer.Option(help="Folder that holds nbgrader's gradebook.", callback=of_course)] = Path(
        "."
    ),
    port: Annotated[int, typer.Option(help="Port of the page; a free one by default.", min=0, max=65535)] = 0,
) -> None:
    """Grade written answers in a browser, all students' answers to a question on one page, without names."""
    needs_linux("texts")
    from labgrader.grade_course import private
    from labgrader.handin.reading import read_lab
    from labgrader.report.texts_server import TextsServer

    with private(), TextsServer(course, read_lab(course, topic), port) as server:
        typer.echo(f"open {server.url}\nCtrl-C ends it; then `labkit grades {topic}` brings pages and files up to date")
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            typer.echo("")
