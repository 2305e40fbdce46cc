"""`labkit new question` and `labkit new lab`: the beginning of one, with TODOs."""

from pathlib import Path
from typing import Annotated

import typer

from labcli.commands.options import of_course, tell_written

app = typer.Typer(help="Start a question or a lab; `make test` then lists its TODOs.", no_args_is_help=True)
Checkout = Annotated[Path, typer.Option(help="The checkout to write into.", callback=of_course)]


@app.command("question")
def new_question(
    name: Annotated[str, typer.Argument(help="Topic and function, such as 04_iou.dice.")],
    points: Annotated[int, typer.Option(help="What it is worth.", min=1)] = 2,
    course: Checkout = Path("."),
) -> None:
    """Write a working question, right and wrong answers to it, and its cells in the topic's solution."""
    from labgrader.release import scaffold

    tell_written(scaffold.new_question(course, name, points))


@app.command("lab")
def new_lab(
    topic: Annotated[str, typer.Argument(help="Two digits and a name, such as 11_instances.")],
    course: Checkout = Path("."),
) -> None:
    """Write a lab without questions: a topic, its solution, and a row in README."""
    from labgrader.release import scaffold

    tell_written(scaffold.new_lab(course, topic))
