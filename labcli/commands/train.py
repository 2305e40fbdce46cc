"""`labkit train`: a network from data sets, or from somebody's own pictures."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from labcli.commands.options import Aligned, CameraName, DepthScale


def train(
    data: Annotated[
        list[Path], typer.Argument(help="Data sets of data_gen, or folders of color/, depth/ and mask/ PNGs.")
    ] = (Path("data/train"),),
    scenes: Annotated[int | None, typer.Option(help="Use only the first N scenes of each.", min=1)] = None,
    val: Annotated[Path | None, typer.Option(help="Data set to validate on after each epoch.")] = None,
    model: Annotated[
        str | None,
        typer.Option(help="Which network: unet_rgbd, unet or smallsegnet; by default that of --init, or unet."),
    ] = None,
    init: Annotated[str | None, typer.Option(help="Weights to continue from: a name as in --model, or a file.")] = None,
    things: Annotated[
        bool,
        typer.Option("--things", help="Also learn to separate objects, from data sets of data_gen; unet_rgbd only."),
    ] = False,
    epochs: Annotated[int | None, typer.Option(help="Passes over the data; by default the model's recipe.")] = None,
    lr: Annotated[float | None, typer.Option(help="Highest learning rate; by default the model's recipe.")] = None,
    batch: Annotated[int | None, typer.Option(help="Images in a batch; by default the model's recipe.")] = None,
    depth_scale: DepthScale = None,
    aligned: Aligned = False,
    camera_name: CameraName = None,
    device: Annotated[Literal["auto", "cpu", "cuda"], typer.Option(help="Where to train.")] = "auto",
    workers: Annotated[
        int, typer.Option(help="Processes that prepare batches ahead, for a GPU; results are the same.", min=0)
    ] = 0,
    seed: Annotated[int, typer.Option(help="Seed of weights, order and augmentation.")] = 0,
    out: Annotated[Path, typer.Option(help="Folder for weights, checkpoint and history.")] = Path("data/runs"),
    resume: Annotated[bool, typer.Option(help="Continue from the checkpoint in OUT, if there is one.")] = True,
) -> None:
    """Train a network; stopped with Ctrl-C, the same command resumes. Under torchrun it uses several processes."""
    from dataclasses import replace

    import data_gen
    from labcli.own_data import PictureFolder
    from labcli.pictures import Reading
    from labkit.learning.network import architecture_of, load_model, weights_path, with_things
    from labtrain import ranks, training

    network = None if init is None else load_model(weights_path(init))
    model = model or ("unet" if network is None else architecture_of(network))
    if model not in training.RECIPES:
        raise ValueError(f"model: expected {' or '.join(training.RECIPES)}, got {model!r}")
    if network is not None and architecture_of(network) != model:
        raise ValueError(f"init: expected weights of {model}, got {init} of {architecture_of(network)}")
    if things and (network is None or model != "unet_rgbd"):
        raise ValueError(f"things: expected weights of unet_rgbd to go on from, as --init, got {init} for {model}")
    recipe = (
        training.RECIPES[model] if network is None else training.fine_tuning_recipe(model, validated=val is not None)
    )
    if things:
        network, recipe = with_things(network), training.THINGS_RECIPE
    given = {"epochs": epochs, "lr": lr, "batch": batch}
    asked = {name: value for name, value in given.items() if value is not None}
    config = replace(recipe, seed=seed, **asked)

    reading = Reading(depth_scale, aligned, camera_name)

    def opened(path: Path):
        return PictureFolder(path, reading) if (path / "color").is_dir() else data_gen.load(path)

    val_set = None if val is None else opened(val)
    train_set = data_gen.Joined([opened(path) for path in data], each=scenes)
    try:
        history = training.train(train_set, val_set, config, out, resume, device, model=network, workers=workers)
    except KeyboardInterrupt as stop:  # it says where the checkpoint is
        if ranks.is_main():
            typer.echo(f"labkit: {stop}", err=True)
        raise typer.Exit(130) from stop
    last = history[-1]
    scores = f", validation mIoU {last['mean_iou']:.3f}" if "mean_iou" in last else ""
    if ranks.is_main():
        typer.echo(f"{out / f'{model}.pt'}: {last['epoch']} epochs, loss {last['loss']:.3f}{scores}")
