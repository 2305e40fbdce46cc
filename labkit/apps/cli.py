"""The command `labkit`: one thin function a command, which imports what it needs only when it runs.

A new command is a function here that turns its options into one call of a module, and prints what comes back. Wrong
input may raise ValueError or OSError anywhere below: `main` says it in one line.
"""

import sys
import traceback
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

# Options that several commands share.
Model = Annotated[str, typer.Option(help="unet_rgbd, unet, smallsegnet, or a file of your own weights.")]
Refine = Annotated[bool | None, typer.Option("--crf/--no-crf", help="Refine a network's masks with the CRF.")]
Workers = Annotated[int, typer.Option(help="Processes.", min=1)]
Dask = Annotated[str | None, typer.Option(help="Run on the workers of this Dask scheduler, tcp://host:8786.")]


@app.callback()
def options(debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False) -> None:
    """Options before the command's name; `main` looks for --debug itself."""


@app.command()
def doctor(
    warm: Annotated[
        bool, typer.Option("--warm", help="Compile now what first runs would, beside the code, for all who use it.")
    ] = False,
) -> None:
    """Check Python, packages, PyBullet, a render, disk, cores and GPU; exit status 1 if something needed is missing."""
    from labkit.apps.doctor import all_well, examine, report, warm_up

    findings = [warm_up()] if warm else examine()
    typer.echo(report(findings))
    raise typer.Exit(0 if all_well(findings) else 1)


@app.command()
def check(lab: Annotated[Path, typer.Argument(help="A saved lab, your own notebook file.")]) -> None:
    """Check a saved lab as the grader will, on public cases; exit status 1 if an answer is not right."""
    from labkit.course.checking_file import check_file

    raise typer.Exit(0 if check_file(lab) else 1)


@app.command()
def train(
    data: Annotated[
        list[Path], typer.Argument(help="Data sets of data_gen, or folders of color/, depth/ and mask/ PNGs.")
    ] = (Path("data/train"),),
    scenes: Annotated[int | None, typer.Option(help="Take only the first so many scenes of each.", min=1)] = None,
    val: Annotated[Path | None, typer.Option(help="Data set to validate on after each epoch.")] = None,
    model: Annotated[
        str | None, typer.Option(help="Which network: unet_rgbd, unet or smallsegnet; that of --init, or else unet.")
    ] = None,
    init: Annotated[
        str | None, typer.Option(help="Weights to start from, to train on: a name as in --model, or a file.")
    ] = None,
    epochs: Annotated[int | None, typer.Option(help="Passes over the data; the model's recipe if not given.")] = None,
    lr: Annotated[float | None, typer.Option(help="Highest learning rate; the model's recipe if not given.")] = None,
    batch: Annotated[int | None, typer.Option(help="Images in a batch; the model's recipe if not given.")] = None,
    depth_scale: Annotated[
        float | None, typer.Option(help="Metres per unit of a folder's depth; else the camera file's, or 0.001.")
    ] = None,
    device: Annotated[Literal["auto", "cpu", "cuda"], typer.Option(help="Where to train.")] = "auto",
    seed: Annotated[int, typer.Option(help="Seed of weights, order and augmentation.")] = 0,
    out: Annotated[Path, typer.Option(help="Folder for weights, checkpoint and history.")] = Path("data/runs"),
    resume: Annotated[bool, typer.Option(help="Go on from the checkpoint in OUT, if there is one.")] = True,
    memory: Annotated[
        float | None,
        typer.Option(help="Gigabytes for images; more are kept in OUT. Half of the machine's if not given."),
    ] = None,
) -> None:
    """Train a network; stopped with Ctrl-C, the same command goes on where it was. Under torchrun, on many cores."""
    from dataclasses import replace

    import data_gen
    from labkit.apps.own_data import PictureFolder
    from labkit.learning import ranks, training
    from labkit.learning.network import architecture_of, load_model, weights_path

    network = None if init is None else load_model(weights_path(init))
    model = model or ("unet" if network is None else architecture_of(network))
    if model not in training.RECIPES:
        raise ValueError(f"model: expected {' or '.join(training.RECIPES)}, got {model!r}")
    if network is not None and architecture_of(network) != model:
        raise ValueError(f"init: expected weights of {model}, got {init} of {architecture_of(network)}")
    recipe = training.RECIPES[model] if network is None else training.fine_tuning(model, validated=val is not None)
    given = {"epochs": epochs, "lr": lr, "batch": batch}
    asked = {name: value for name, value in given.items() if value is not None}
    config = replace(recipe, seed=seed, **asked)

    def opened(path: Path):
        return PictureFolder(path, depth_scale) if (path / "color").is_dir() else data_gen.load(path)

    val_set = None if val is None else opened(val)
    train_set = data_gen.Joined([opened(path) for path in data], each=scenes)
    try:
        history = training.train(train_set, val_set, config, out, resume, device, model=network, memory_gb=memory)
    except KeyboardInterrupt as stop:  # it says where the checkpoint is
        if ranks.leads():
            typer.echo(f"labkit: {stop}", err=True)
        raise typer.Exit(130) from stop
    last = history[-1]
    scores = f", validation mIoU {last['mean_iou']:.3f}" if "mean_iou" in last else ""
    if ranks.leads():
        typer.echo(f"{out / f'{model}.pt'}: {last['epoch']} epochs, loss {last['loss']:.3f}{scores}")


@app.command()
def evaluate(
    scenes: Annotated[int, typer.Option(help="How many scenes; each is one trial.", min=1)] = 100,
    first_seed: Annotated[int, typer.Option(help="Seed of the first scene; the others follow.", min=0)] = 900_000,
    config: Annotated[Literal["test", "hard", "other", "train"], typer.Option(help="Which kind of scenes.")] = "test",
    masks: Annotated[Literal["predicted", "truth"], typer.Option(help="The network's masks, or the true ones.")] = (
        "predicted"
    ),
    model: Model = "unet_rgbd",
    crf: Refine = None,
    perturb: Annotated[
        bool, typer.Option("--perturb", help="Depth as a sensor measures it, pose off by 5 mm and 0.5 degree.")
    ] = False,
    json: Annotated[Path | None, typer.Option(help="Write the scores, and a row per trial, to this file, too.")] = None,
    worst: Annotated[int, typer.Option(help="Show so many of the worst trials in OUT/worst.html.", min=0)] = 0,
    out: Annotated[Path, typer.Option(help="Folder for worst.html.")] = Path("out"),
    workers: Workers = 1,
    dask: Dask = None,
) -> None:
    """Score masks and lifts over random scenes: IoU by class, and how often the arm lifts a target."""
    from data_gen import sample_scene
    from labkit.apps.evaluation import as_json, run_trials, summarise, table
    from labkit.apps.worst import page
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


@app.command()
def export(
    onnx: Annotated[Path, typer.Option(help="The file to write.")],
    model: Model = "unet",
) -> None:
    """Write a network as one ONNX file, which OpenCV, onnxruntime and other stacks read."""
    from labkit.learning import engines
    from labkit.learning.network import load_model, weights_path

    engines.export(load_model(weights_path(model)), onnx)
    typer.echo(f"wrote {onnx}")


@app.command()
def compare(
    out: Annotated[Path, typer.Option(help="The table to write, a CSV file.")] = Path("out/09_other_stacks.csv"),
    scenes: Annotated[int, typer.Option(help="How many scenes.", min=1)] = 40,
) -> None:
    """Compare the stacks on the same scenes, masks, times and lifts: a table as lesson 09 reads it (some minutes)."""
    from labkit.apps import stack_study

    typer.echo(stack_study.table(stack_study.run(out, scenes=scenes)))


@app.command()
def study(
    out: Annotated[
        Path | None, typer.Option(help="Where to write the table; out/07_grasp.csv or 07_scores.csv.")
    ] = None,
    scores: Annotated[
        bool, typer.Option("--scores", help="Measure what the planner's score is worth instead.")
    ] = False,
    workers: Workers = 1,
    dask: Dask = None,
) -> None:
    """Measure what IoU is worth: lifts by masks spoilt in five ways; stopped with Ctrl-C, it goes on where it was."""
    from labkit.apps import mask_study, score_study

    out = out or Path("out/07_scores.csv" if scores else "out/07_grasp.csv")
    rows = (score_study if scores else mask_study).run(out, workers=workers, dask=dask)
    rate, low, high = mask_study.lift_rate(rows)
    typer.echo(f"{out}: {len(rows)} lifts, {rate:.1%} succeeded (95 % interval {low:.1%} to {high:.1%})")


@app.command()
def demo(
    seed: Annotated[
        int | None, typer.Option(help="Seed of the scene; drawn, and printed, if not given.", min=0)
    ] = None,
    model: Model = "unet_rgbd",
    crf: Refine = None,
    out: Annotated[Path, typer.Option(help="Folder for demo.png and demo.gif.")] = Path("out"),
) -> None:
    """Show the whole chain on one random scene: from the camera's image to the object in the air."""
    import secrets

    from data_gen import sample_scene
    from labkit.apps import demo as show
    from labkit.learning.network import load_model, weights_path

    seed = secrets.randbelow(1_000_000) if seed is None else seed
    typer.echo(f"labkit demo --seed {seed}")
    story = show.tell(sample_scene(seed, "test"), load_model(weights_path(model)), crf=crf)
    typer.echo(show.report(story))
    for path in show.save(story, out):
        typer.echo(f"wrote {path}")


@app.command()
def perceive(
    color: Annotated[Path, typer.Argument(help="Colour picture, 8 bit.")],
    depth: Annotated[Path, typer.Argument(help="Depth picture aligned to it, 16-bit PNG; 0 is no reading.")],
    intrinsics: Annotated[
        str, typer.Option(help='The camera: "fx fy cx cy", or a file of librealsense, BOP, Open3D or ROS.')
    ],
    camera_pose: Annotated[
        str | None, typer.Option(help='Where the camera stands in the base frame: "x y z qx qy qz qw".')
    ] = None,
    plane: Annotated[
        Literal["auto"] | None, typer.Option(help="Find the table and lay the base frame on it; so without a pose.")
    ] = None,
    table_z: Annotated[float, typer.Option(help="Height of the table in the base frame, metres, with a pose.")] = 0.0,
    depth_scale: Annotated[
        float | None, typer.Option(help="Metres per unit of the depth file; else the camera file's, or 0.001.")
    ] = None,
    model: Model = "unet_rgbd",
    mask: Annotated[
        Path | None, typer.Option(help="Somebody else's mask in place of a network: 0 and one other value, or labels.")
    ] = None,
    instances: Annotated[
        bool, typer.Option("--instances", help="Each value above 0 of --mask is an object, and each object a target.")
    ] = False,
    anything: Annotated[
        bool, typer.Option("--anything", help="No network: whatever stands on the table is a target.")
    ] = False,
    target: Annotated[
        int | None, typer.Option(help="The class to grasp, 2 if none is given; with --mask, its value that says so.")
    ] = None,
    gripper: Annotated[
        str, typer.Option(help='The hand, where not the Panda\'s: "max_opening=0.14 ...", metres, or a JSON file.')
    ] = "",
    workspace: Annotated[
        str, typer.Option(help="What the arm can meet: from and to in x, y and z of the base frame; z from the table.")
    ] = "-20 20 -20 20 -0.02 0.5",
    out: Annotated[
        Path, typer.Option(help="Folder for overlay.png, targets.png, clouds, grasps.json, report.html.")
    ] = Path("out"),
) -> None:
    """Find targets and grasps in a picture of your own camera; no target is an answer, too."""
    from labkit.apps import perceive as own
    from labkit.apps.node_command import Settings
    from labkit.labels import TARGET
    from labkit.learning.network import load_model, weights_path
    from labkit.stacks.objects import on_the_table

    if plane is not None and camera_pose is not None:
        raise ValueError("plane: expected either --plane auto or --camera-pose, got both")
    if anything and (mask is not None or target is not None):
        raise ValueError("anything: expected neither --mask nor --target beside it; it takes each object for a target")
    if instances and (mask is None or target is not None):
        raise ValueError("instances: expected --mask FILE beside it, and no --target; each value is one")
    T_base_cam = Settings(camera_pose=camera_pose).T_base_cam()
    camera = own.read_intrinsics(intrinsics)
    frame = own.read_frame(color, depth, camera, depth_scale)
    if camera.distortion:
        typer.echo("the lens's distortion is undone first: what is written is of the rectified picture")
    known = {"T_base_cam": T_base_cam, "table_z": table_z}
    known |= {"gripper": own.read_gripper(gripper), "workspace": own.read_workspace(workspace)}
    if mask is not None:
        labels, numbers = own.read_mask(mask, frame.size, target, instances, camera)
        seen = own.perceive(frame, labels=labels, instances=numbers, **known)
    elif anything:
        seen = own.perceive(frame, on_the_table, **known)
    else:
        known["target_class"] = TARGET if target is None else target
        seen = own.perceive(frame, load_model(weights_path(model)), **known)
    typer.echo(own.describe(seen))
    for path in own.save(seen, out):
        typer.echo(f"wrote {path}")


@app.command(context_settings={"ignore_unknown_options": True})
def node(
    extra: Annotated[
        list[str] | None, typer.Argument(metavar="[--ros-args ...]", help="ROS's own arguments, behind all others.")
    ] = None,
    sim: Annotated[bool, typer.Option("--sim", help="Rehearse in this process: camera, node, and an arm.")] = False,
    ros: Annotated[bool, typer.Option("--ros", help="Run on ROS 2 until SIGINT; with --sim also a camera.")] = False,
    ros1: Annotated[bool, typer.Option("--ros1", help="The same on ROS 1.")] = False,
    lifecycle: Annotated[
        bool, typer.Option("--lifecycle", help="With --ros: others configure and activate the node.")
    ] = False,
    on_demand: Annotated[
        bool, typer.Option("--on-demand", help="With --ros: answer one frame for each call of segmentation/answer.")
    ] = False,
    bag: Annotated[
        Path | None, typer.Option(help="Answer the frames of a bag: NAME.bag, or a folder of ROS 2.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="The bag to write, of either kind.")] = None,
    storage: Annotated[str, typer.Option(help="How ROS 2 shall hold it: mcap or sqlite3.")] = "mcap",
    seed: Annotated[int, typer.Option(help="Seed of the scene of --sim.", min=0)] = 0,
    model: Model = "unet_rgbd",
    engine: Annotated[str, typer.Option(help="What runs the network: torch, opencv or onnxruntime.")] = "torch",
    mirror: Annotated[
        bool | None,
        typer.Option(
            "--mirror/--no-mirror", help="Look at the mirror image, too; else only a network with canonical views does."
        ),
    ] = None,
    crf: Refine = None,
    target: Annotated[int, typer.Option(help="The class to grasp.")] = 2,
    table_z: Annotated[
        float | None, typer.Option(help="Height of the table in the base frame, metres; else 0.")
    ] = None,
    camera_pose: Annotated[
        str | None, typer.Option(help='Where the camera stands in the base frame, "x y z qx qy qz qw"; else /tf says.')
    ] = None,
    base_frame: Annotated[str, typer.Option(help="The base frame's name.")] = "base_link",
    slop: Annotated[float, typer.Option(help="How far the stamps of a frame may lie apart, seconds.")] = 0.02,
    depth_scale: Annotated[float, typer.Option(help="Metres per unit of 16-bit depth.")] = 0.001,
    qos_inputs: Annotated[str, typer.Option(help="What to ask of cameras: best_effort or reliable.")] = "best_effort",
    qos_outputs: Annotated[str, typer.Option(help="What to offer: reliable or best_effort.")] = "reliable",
    qos_depth: Annotated[int, typer.Option(help="Messages that are kept for a slow reader.")] = 10,
    topic: Annotated[
        list[str] | None, typer.Option(help="Rename a topic: rgb=/my/image/compressed, mask=/my/mask ...")
    ] = None,
    probabilities: Annotated[
        bool, typer.Option("--probabilities", help="Write class probabilities to OUT, too.")
    ] = False,
) -> None:
    """Run the segmentation node: on a simulated scene, on a bag, or on ROS."""
    from labkit.apps import node_command as command

    on_ros = ros or ros1
    if (sim and not on_ros, ros, ros1, bag is not None).count(True) != 1:
        raise ValueError("node: expected one of --sim, --ros, --ros1 and --bag, or --sim beside one of ROS")
    if (lifecycle or on_demand) and not ros:
        raise ValueError("node: expected --lifecycle and --on-demand beside --ros, for they are ROS 2's")
    if (bag is None) != (out is None):
        raise ValueError("out: expected --out with --bag, and only with it")
    if extra and not (on_ros and extra[0] == "--ros-args"):
        raise ValueError(f"node: expected options of `labkit node --help`, and ROS's behind --ros-args, got {extra[0]}")
    settings = command.Settings(
        model=model,
        engine=engine,
        crf=crf,
        target=target,
        table_z=table_z,
        camera_pose=camera_pose,
        base_frame=base_frame,
        mirror=mirror,
        slop=slop,
        depth_scale=depth_scale,
        qos_inputs=qos_inputs,
        qos_outputs=qos_outputs,
        qos_depth=qos_depth,
        on_demand=on_demand,
        renamed=tuple(topic or ()),
    )
    if bag is not None:
        line, answered = command.answer_bag(settings, bag, out, probabilities, storage)
        typer.echo(line)
        raise typer.Exit(0 if answered else 1)
    if on_ros:
        command.run_on_ros(settings, 1 if ros1 else 2, extra or [], seed if sim else None, lifecycle)
    else:
        typer.echo(command.rehearse(settings, seed))


@app.command()
def release(
    topics: Annotated[list[str] | None, typer.Argument(help="Topics such as 04_iou; all if none is given.")] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Change nothing; exit status 1 if something would change.")
    ] = False,
    bundle: Annotated[
        Path | None, typer.Option(help="Write a zip of what students get: no solutions, no tests.")
    ] = None,
    course: Annotated[Path, typer.Option(help="Folder that holds lessons, solutions and labs.")] = Path("."),
) -> None:
    """Generate labs/ from solutions/ with nbgrader, and tidy the notebooks of solutions/ and lessons/."""
    from labkit.course import release as releasing

    changed = releasing.release(course, topics or (), check=check)
    for path in changed:
        typer.echo(f"{path}: not what `labkit release` makes of it" if check else f"changed {path}")
    if not changed:
        typer.echo("labs, solutions and lessons are as they should be")
    if bundle is not None:
        typer.echo(f"wrote {bundle}: {len(releasing.bundle(course, bundle))} files")
    raise typer.Exit(1 if check and changed else 0)


new = typer.Typer(help="Begin a question or a lab; `make test` then names each TODO of it.", no_args_is_help=True)
app.add_typer(new, name="new")
Checkout = Annotated[Path, typer.Option(help="The checkout to write into.")]


@new.command("question")
def new_question(
    name: Annotated[str, typer.Argument(help="Topic and function, such as 04_iou.dice.")],
    points: Annotated[int, typer.Option(help="What it is worth.", min=1)] = 2,
    course: Checkout = Path("."),
) -> None:
    """Write a question that works, right answers and wrong ones, and its cells in the topic's solution."""
    from labkit.course import scaffold

    tell_written(scaffold.new_question(course, name, points))


@new.command("lab")
def new_lab(
    topic: Annotated[str, typer.Argument(help="Two digits and a name, such as 11_instances.")],
    course: Checkout = Path("."),
) -> None:
    """Write a lab without questions: a topic, its solution, and a row in README."""
    from labkit.course import scaffold

    tell_written(scaffold.new_lab(course, topic))


def tell_written(paths: list[Path]) -> None:
    """Print which files were written."""
    for path in paths:
        typer.echo(f"wrote {path}")


@app.command()
def grade(
    topic: Annotated[str, typer.Argument(help="Which lab, such as 04_iou.")],
    submissions: Annotated[
        Path | None, typer.Option(help="Folder of STUDENT/TOPIC/TOPIC.ipynb; COURSE/submitted if not given.")
    ] = None,
    seed: Annotated[str | None, typer.Option(help="Secret seed of a round; drawn if not given; kept in OUT.")] = None,
    new_round: Annotated[
        bool, typer.Option("--new-round", help="Take another seed, and grade everybody with it; else late work joins.")
    ] = False,
    workers: Annotated[int | None, typer.Option(help="Submissions at a time; one a core if not given.", min=1)] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; COURSE/grades/TOPIC if not given.")] = None,
    course: Annotated[Path, typer.Option(help="Folder that holds labs/ and nbgrader's gradebook.")] = Path("."),
    comment: Annotated[
        tuple[str, str] | None, typer.Option(help="A group of wrong answers, see class.html, and what all in it read.")
    ] = None,
    everybody: Annotated[str | None, typer.Option(help="A question whose points everybody gets.")] = None,
    drop: Annotated[str | None, typer.Option(help="A question that does not count.")] = None,
    points: Annotated[str | None, typer.Option(help="A question and what it is worth now, such as iou=3.")] = None,
    partial: Annotated[str | None, typer.Option(help="A question whose outputs count one by one.")] = None,
    reason: Annotated[str, typer.Option(help="Why; goes into course.toml, and to students.")] = "",
    undo: Annotated[str | None, typer.Option(help="A question whose change is taken back.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Grade again what has not changed, too.")] = False,
    tidy: Annotated[
        bool, typer.Option("--tidy", help="Remove pages and grades of students whose submission is gone.")
    ] = False,
    unsafe: Annotated[
        bool, typer.Option("--unsafe-no-sandbox", help="Without bubblewrap: submissions may do anything here.")
    ] = False,
) -> None:
    """Grade submissions of a lab in a sandbox; exit status 1 if something needs a look, 2 if it could not be done."""
    import os

    if sys.platform != "linux":
        raise ValueError(f"labkit grade needs Linux, this is {sys.platform}: grade on Linux, in WSL or in a container")
    from labkit.course.grading.changes import change_of
    from labkit.course.grading.outputs import terminal_table
    from labkit.course.grading.run import grade_course
    from labkit.course.grading.sandbox import NO_SANDBOX

    workers = workers or os.cpu_count() or 1
    how = {"workers": workers, "force": force, "unsafe": unsafe, "tidy": tidy, "undone": undo}
    how["change"] = change_of(topic, reason, everybody=everybody, drop=drop, points=points, partial=partial)
    graded = grade_course(topic, course, submissions, out, seed, new_round, comment, **how)
    typer.echo(terminal_table(graded.lab, graded.records, graded.late))
    if graded.strangers:
        typer.echo(f"course.toml has extensions of nobody here: {', '.join(graded.strangers)}", err=True)
    for student, failure in graded.failures.items():
        typer.echo(f"{student}: {failure}", err=True)
    for old, name in graded.renamed.items():
        typer.echo(f"{old} is {name} now: grades and pages were moved")
    if graded.gone:
        done = "removed what there was" if tidy else "--tidy removes the pages and grades"
        typer.echo(f"{done} of students without a submission: {', '.join(graded.gone)}")
    folder = out or course / "grades" / topic
    typer.echo(f"{len(graded.records)} students, {graded.graded_now} of them graded now: {folder / 'grades.csv'}")
    if unsafe:
        typer.echo(f"Warning: {NO_SANDBOX}.", err=True)
    raise typer.Exit(1 if graded.needs_a_look else 0)


@app.command()
def grades(
    topic: Annotated[str, typer.Argument(help="Which lab, such as 04_iou.")],
    moodle: Annotated[bool, typer.Option("--moodle", help="Moodle's grading worksheet, and its zip of pages.")] = False,
    canvas: Annotated[bool, typer.Option("--canvas", help="Canvas's columns, and its zip of pages.")] = False,
    gradescope: Annotated[bool, typer.Option("--gradescope", help="An autograder for Gradescope, as a zip.")] = False,
    course: Annotated[Path, typer.Option(help="Folder that holds nbgrader's gradebook.")] = Path("."),
) -> None:
    """Write a table of grades: for Moodle or Canvas as they import it, with a zip of feedback that they hand out."""
    from labkit.course.grading.gradescope import write_autograder
    from labkit.course.grading.platforms import write_grades
    from labkit.course.grading.run import private

    if moodle + canvas + gradescope > 1:
        raise ValueError("expected one of --moodle, --canvas and --gradescope, got more")
    if gradescope:
        with private():
            tell_written([write_autograder(course, topic)])
        return
    with private():
        written = write_grades(course, topic, "moodle" if moodle else "canvas" if canvas else "scores")
    tell_written(written.files)
    for student, why in written.without.items():
        typer.echo(f"no grade: {student} ({why})")
    if written.waiting:
        typer.echo(f"to be graded by hand yet: {', '.join(written.waiting)}")
    raise typer.Exit(1 if written.waiting else 0)


def main() -> None:
    """Run a command. What the user can mend is one line and exit status 2; Ctrl-C is 130; --debug shows tracebacks."""
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
