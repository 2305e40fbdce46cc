"""`labkit study`: lifts by spoilt masks, and by grasps of several ranks."""

from pathlib import Path
from typing import Annotated

import typer

from labcli.commands.options import Dask, Workers


def study(
    out: Annotated[
        Path | None, typer.Option(help="Where to write the table; by default out/07_grasp.csv or out/07_scores.csv.")
    ] = None,
    scores: Annotated[
        bool, typer.Option("--scores", help="Measure instead how well the planner's score predicts lifts.")
    ] = False,
    workers: Workers = 1,
    dask: Dask = None,
) -> None:
    """Measure what IoU is worth: lifts with masks degraded in five ways; after Ctrl-C, the same command resumes."""
    from labcli import mask_study, score_study

    out = out or Path("out/07_scores.csv" if scores else "out/07_grasp.csv")
    rows = (score_study if scores else mask_study).run(out, workers=workers, dask=dask)
    rate, low, high = mask_study.lift_rate(rows)
    typer.echo(f"{out}: {len(rows)} lifts, {rate:.1%} succeeded (95 % interval {low:.1%} to {high:.1%})")
