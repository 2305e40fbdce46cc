"""The command `labkit`: one thin function a command, which imports what it needs only when it runs.

A new command is a function here that turns its options into one call of a module, and prints what comes back. Wrong
input may raise ValueError or OSError anywhere below: `main` says it in one line.
"""

import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

app = typer.Typer(
    help="Semantic segmentation for robotic manipulation: from one RGB-D image to a lifted object.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


@app.callback()
def options(debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False) -> None:
    """Options before the command's name; `main` looks for --debug itself."""


@app.command()
def doctor() -> None:
    """Check Python, packages, PyBullet, a render, disk, cores and GPU; exit status 1 if something needed is missing."""
    from labkit.doctor import all_well, examine, report

    findings = examine()
    typer.echo(report(findings))
    raise typer.Exit(0 if all_well(findings) else 1)


@app.command()
def train(
    data: Annotated[Path, typer.Argument(help="Data set to train on, as data_gen writes it.")] = Path("data/train"),
    val: Annotated[Path | None, typer.Option(help="Data set to validate on after each epoch.")] = None,
    model: Annotated[Literal["unet", "smallsegnet"], typer.Option(help="Which network.")] = "unet",
    epochs: Annotated[int | None, typer.Option(help="Passes over the data; the model's recipe if not given.")] = None,
    device: Annotated[Literal["auto", "cpu", "cuda"], typer.Option(help="Where to train.")] = "auto",
    seed: Annotated[int, typer.Option(help="Seed of weights, order and augmentation.")] = 0,
    out: Annotated[Path, typer.Option(help="Folder for weights, checkpoint and history.")] = Path("data/runs"),
    resume: Annotated[bool, typer.Option(help="Go on from the checkpoint in OUT, if there is one.")] = True,
) -> None:
    """Train a network; stopped with Ctrl-C, the same command goes on where it was."""
    from dataclasses import replace

    import data_gen
    from labkit import training

    recipe = training.RECIPES[model]
    config = replace(recipe, seed=seed, epochs=recipe.epochs if epochs is None else epochs)
    val_set = None if val is None else data_gen.load(val)
    history = training.train(data_gen.load(data), val_set, config, out, resume=resume, device=device)
    last = history[-1]
    scores = f", validation mIoU {last['mean_iou']:.3f}" if "mean_iou" in last else ""
    typer.echo(f"{out / f'{model}.pt'}: {last['epoch']} epochs, loss {last['loss']:.3f}{scores}")


def main() -> None:
    """Run a command. What the user can mend is one line and exit status 2; Ctrl-C is 130; --debug shows tracebacks."""
    try:
        app(prog_name="labkit")
    except (ValueError, OSError, ModuleNotFoundError) as error:
        if "--debug" in sys.argv:
            raise
        print(f"labkit: {one_line(error)}", file=sys.stderr)
        sys.exit(2)


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
