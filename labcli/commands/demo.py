"""`labkit demo`: the whole chain on one scene, with pictures."""

from pathlib import Path
from typing import Annotated

import typer

from labcli.commands.options import Model, Refine


def demo(
    seed: Annotated[int | None, typer.Option(help="Seed of the scene; drawn and printed if omitted.", min=0)] = None,
    model: Model = "unet_rgbd",
    crf: Refine = None,
    calm: Annotated[
        bool, typer.Option(help="Wooden table, plain walls, seven colours; or the look of the scored scenes.")
    ] = True,
    out: Annotated[Path, typer.Option(help="Folder for demo.png and demo.gif.")] = Path("out"),
) -> None:
    """Show the whole chain on one random scene: from the camera's image to the object in the air."""
    import secrets

    from data_gen import calm as calmly
    from data_gen import sample_scene
    from labcli import demo as show
    from labkit.learning.network import load_model, weights_path

    seed = secrets.randbelow(1_000_000) if seed is None else seed
    typer.echo(f"labkit demo --seed {seed}")
    spec = sample_scene(seed, "test")
    story = show.tell(calmly(spec) if calm else spec, load_model(weights_path(model)), crf=crf)
    typer.echo(show.report(story))
    for path in show.save(story, out):
        typer.echo(f"wrote {path}")
