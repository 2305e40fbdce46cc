"""The command `labkit`, gathered from `labcli.commands`: a file for each.

A new command is a function in a file of its own that turns its options into one call of a module, imports what it needs
only when it runs, and prints what comes back; it is named below. Wrong input may raise ValueError or OSError anywhere:
`main` says it in one line.
"""

import os
import sys
import traceback
from typing import Annotated

import typer

from labcli.commands import new, node
from labcli.commands.calibrate import calibrate
from labcli.commands.check import check
from labcli.commands.compare import compare
from labcli.commands.demo import demo
from labcli.commands.doctor import doctor
from labcli.commands.evaluate import evaluate
from labcli.commands.exam import exam
from labcli.commands.export import export
from labcli.commands.forget import forget
from labcli.commands.grade import grade
from labcli.commands.grades import grades
from labcli.commands.perceive import perceive
from labcli.commands.photos import photos
from labcli.commands.release import release
from labcli.commands.renumber import renumber
from labcli.commands.sheet import sheet
from labcli.commands.study import study
from labcli.commands.texts import texts
from labcli.commands.train import train
from labcli.commands.trust import trust

app = typer.Typer(
    help="Semantic segmentation for robotic manipulation: from one RGB-D image to a lifted object.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
for command in (doctor, check, train, evaluate, export, compare, study, demo, perceive, sheet, calibrate, photos):
    app.command()(command)
for command in (release, renumber, grade, texts, grades, forget, exam, trust):
    app.command()(command)
app.add_typer(node.app, name="node")
app.add_typer(new.app, name="new")


@app.callback()
def options(debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False) -> None:
    """Options before the command's name; `main` looks for --debug itself."""


def main() -> None:
    """Run a command. What the user can mend is one line and exit status 2; Ctrl-C is 130; --debug shows tracebacks."""
    # nbformat's validator would build grammars of internationalised addresses for a second, and notebooks have none.
    sys.modules.setdefault("rfc3987_syntax", None)
    os.environ["PYTHONSAFEPATH"] = "1"  # no Python process that a command starts imports what lies in this folder
    try:
        app(prog_name="labkit")
    except Exception as error:
        if "--debug" in sys.argv or not isinstance(error, ValueError | OSError | ModuleNotFoundError):
            traceback.print_exc()
        else:
            print(f"labkit: {one_line(error)}", file=sys.stderr)
        sys.exit(2)  # not 1: by that commands say that something needs a look


def one_line(error: Exception) -> str:
    """Say an error in one line.

    >>> one_line(FileNotFoundError(2, "No such file or directory", "data/train"))
    'data/train: No such file or directory'
    """
    if isinstance(error, OSError) and error.filename is not None:
        text = f"{error.filename}: {error.strerror}"
    elif isinstance(error, ModuleNotFoundError):
        text = f"{error}; `labkit doctor` tells what is missing"
    else:
        text = str(error) or type(error).__name__
    return " ".join(text.split())


if __name__ == "__main__":
    main()
