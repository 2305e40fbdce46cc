"""The command `python -m data_gen`: write a dataset, or verify one."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from labtrain.executors import executor_for

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def main(
    out: Annotated[Path, typer.Argument(help="folder of the dataset")],
    scenes: Annotated[int, typer.Option(help="how many", min=1)] = 100,
    first_seed: Annotated[int, typer.Option(help="seed of the first scene; the others follow", min=0)] = 0,
    config: Annotated[str, typer.Option(help="train, wide, any, clutter, bin, messy, test, hard or other")] = "train",
    size: Annotated[str, typer.Option(help="WIDTHxHEIGHT in pixels")] = "320x240",
    workers: Annotated[int, typer.Option(help="processes", min=1)] = 1,
    dask: Annotated[str | None, typer.Option(help="a Dask scheduler, tcp://host:8786, whose workers see OUT")] = None,
    depth_noise: Annotated[bool, typer.Option(help="spoil depth as a real sensor does")] = False,
    verify: Annotated[bool, typer.Option("--verify", help="write nothing, check the files of OUT")] = False,
) -> None:
    """Render random scenes into OUT; interrupted, the same command resumes."""
    import data_gen

    if verify:
        problems = data_gen.verify(out)
        print("\n".join(problems) or f"{out}: all files are as they were written")
        raise typer.Exit(1 if problems else 0)
    try:
        width, height = (int(n) for n in size.split("x"))
    except ValueError:
        raise ValueError(f"size: expected WIDTHxHEIGHT such as 320x240, got {size!r}") from None
    with executor_for(workers, dask) as executor:
        data_gen.generate(
            out,
            range(first_seed, first_seed + scenes),
            config,
            (width, height),
            executor,
            data_gen.DepthSensor() if depth_noise else None,
        )


if __name__ == "__main__":
    try:
        app()
    except (ValueError, OSError) as error:
        sys.exit(f"data_gen: {error}")
    except KeyboardInterrupt:
        sys.exit(130)
