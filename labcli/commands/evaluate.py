"""`labkit evaluate`: scores of masks and lifts over random scenes, or of things in your own pictures."""

import inspect
from pathlib import Path
from typing import Annotated, Literal

import typer

from labcli.commands.options import Aligned, CameraName, Dask, DepthScale, Model, Refine, Workers


def evaluate(
    folder: Annotated[
        Path | None,
        typer.Argument(
            help="Your own pictures: color/, depth/ and mask/ of numbered objects; random scenes if omitted."
        ),
    ] = None,
    scenes: Annotated[int, typer.Option(help="How many scenes; each is one trial.", min=1)] = 100,
    first_seed: Annotated[int, typer.Option(help="Seed of the first scene; the others follow.", min=0)] = 900_000,
    config: Annotated[Literal["test", "hard", "other", "train"], typer.Option(help="Which kind of scenes.")] = "test",
    masks: Annotated[
        str,
        typer.Option(
            help="The network's masks (predicted) or the true ones (truth); with FOLDER another folder of somebody's "
            "masks, scored beside the kit's."
        ),
    ] = "predicted",
    model: Model = "unet_rgbd",
    crf: Refine = None,
    perturb: Annotated[
        bool, typer.Option("--perturb", help="Depth as a sensor measures it, pose off by 5 mm and 0.5 degree.")
    ] = False,
    json: Annotated[Path | None, typer.Option(help="Also write the scores, and a row per trial, to this file.")] = None,
    worst: Annotated[int, typer.Option(help="Show this many of the worst in OUT/worst.html.", min=0)] = 0,
    out: Annotated[Path, typer.Option(help="Folder for worst.html.")] = Path("out"),
    anything: Annotated[
        bool, typer.Option("--anything", help="With FOLDER: score objects of any class, each separately.")
    ] = False,
    depth_scale: DepthScale = None,
    aligned: Aligned = False,
    camera_name: CameraName = None,
    workers: Workers = 1,
    dask: Dask = None,
) -> None:
    """Score masks and lifts over random scenes: IoU by class, and how often the arm lifts a target.

    With FOLDER, score how well the objects in your own pictures are separated; nothing is simulated.
    """
    options = inspect.signature(evaluate).parameters
    given = {name for name, value in locals().items() if name in options and value != options[name].default}
    of_scenes = {"scenes", "first_seed", "config", "crf", "perturb", "workers", "dask"}
    of_pictures = {"anything", "depth_scale", "aligned", "camera_name"}
    wrong = sorted(given & (of_pictures if folder is None else of_scenes))
    if wrong:
        raise ValueError(f"{wrong[0]}: expected {'FOLDER beside it' if folder is None else 'no FOLDER beside it'}")
    if folder is not None:
        reading = depth_scale, aligned, camera_name
        _of_a_folder(folder, Path(masks) if "masks" in given else None, model, anything, reading, json, worst, out)
        return
    if masks not in ("predicted", "truth"):
        raise ValueError(f"masks: expected predicted or truth, or FOLDER beside a folder of masks, got {masks!r}")
    from data_gen import sample_scene
    from labcli.evaluation import as_json, run_trials, summarise, table
    from labcli.worst import page
    from labkit.learning.network import load_model, weights_path
    from labkit.support.files import write_atomically

    weights = None if masks == "truth" else weights_path(model)
    if weights is not None:
        load_model(weights)  # so that wrong weights are said before anything is simulated
    specs = [sample_scene(seed, config) for seed in range(first_seed, first_seed + scenes)]
    trials = run_trials(specs, weights, crf=crf, perturb=perturb, workers=workers, dask=dask)
    report = summarise(trials)
    typer.echo(table(report))
    if json is not None:
        write_atomically(json, as_json(report).encode())
    if worst:
        write_atomically(out / "worst.html", page(specs, trials, worst, weights, (320, 240), crf, perturb).encode())
        typer.echo(f"wrote {out / 'worst.html'}")


def _of_a_folder(
    folder: Path, masks: Path | None, model: str, things: bool, reading, json: Path | None, worst: int, out: Path
) -> None:
    from json import dumps

    from labcli import evaluate_folder as own
    from labcli.pictures import Reading
    from labkit.learning.network import load_model, weights_path
    from labkit.learning.things import instance_finder
    from labkit.support.files import write_atomically

    true, network = own.TrueThings(folder, Reading(*reading)), load_model(weights_path(model))
    given = [] if masks is None else own.judge_masks(true, masks)  # what is missing is said before a network runs
    judged = own.judge(true, instance_finder(network) if things else own.things_by_class(network))
    for sentence in true.said:
        typer.echo(sentence, err=True)
    parts = {"": judged} if masks is None else {"masks": given, "kit": judged}
    for name, part in parts.items():
        if name:
            typer.echo({"masks": f"the masks of {masks}:", "kit": f"\nthe kit's, {model}:"}[name])
        typer.echo(own.table(part, true.alone))
    if json is not None:
        facts = {name: own.as_dict(part, true.alone) for name, part in parts.items()}
        write_atomically(json, f"{dumps(facts.get('', facts), indent=1, allow_nan=False)}\n".encode())
    if worst:
        pages = own.page(given, worst, true.alone, judged) if given else own.page(judged, worst, true.alone)
        write_atomically(out / "worst.html", pages.encode())
        typer.echo(f"wrote {out / 'worst.html'}")
