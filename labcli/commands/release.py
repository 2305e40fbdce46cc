"""`labkit release`: labs from solutions."""

from pathlib import Path
from typing import Annotated

import typer

from labcli.commands.options import of_course


def release(
    topics: Annotated[list[str] | None, typer.Argument(help="Topics such as 04_iou; all by default.")] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Change nothing; exit status 1 if something would change.")
    ] = False,
    bundle: Annotated[
        Path | None, typer.Option(help="Write a zip for students of these topics: no solutions, no tests.")
    ] = None,
    repository: Annotated[
        Path | None, typer.Option(help="Write the same into a git repository, to be published (docs/publish.md).")
    ] = None,
    week: Annotated[int | None, typer.Option(help="The topics of a week of the syllabus, instead of names.")] = None,
    course: Annotated[
        Path, typer.Option(help="Folder that holds lessons, solutions and labs.", callback=of_course)
    ] = Path("."),
) -> None:
    """Generate labs/ from solutions/ with nbgrader, and tidy the notebooks of solutions/ and lessons/."""
    from labgrader.release import bundle as bundling
    from labgrader.release import release as releasing
    from labgrader.release.repository import repository as publish

    if week is not None:
        topics = [*(topics or []), *bundling.topics_of_week(week)]
    changed = releasing.release(course, topics or (), check=check)
    for path in changed:
        typer.echo(f"{path}: not what `labkit release` makes of it" if check else f"changed {path}")
    if not changed:
        typer.echo("labs, solutions and lessons are as they should be")
    made = {}
    if bundle is not None:
        made[bundle] = bundling.bundle(course, bundle, topics or ())
    if repository is not None:
        made[repository] = publish(course, repository, topics or ())
    for target, one in made.items():
        for name, reason in one.left_out.items():
            typer.echo(f"left out {name}: {reason}")
        everything = "" if one.tracked else ", all that lies there: this is no git repository"
        typer.echo(f"wrote {target}: {len(one.names)} files{everything}")
    raise typer.Exit(1 if check and changed else 0)
