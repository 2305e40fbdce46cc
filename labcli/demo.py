"""The main job, shown: one scene from camera to lift, with a table of stages, a picture of every step and a film."""

import sys
import threading
from collections.abc import Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Polygon
from PIL import Image

from labcli import report as pages
from labcli.evaluation import lift
from labcourse.views import fingers
from labkit.frame import RGBDFrame
from labkit.geometry import centroid_and_covariance
from labkit.grasp import Grasp, Gripper
from labkit.labels import CLASSES, PALETTE, TARGET, colorize
from labkit.metrics import confusion_matrix, iou, mean_iou
from labkit.pipeline import Perception, Pipeline, timed
from labkit.sim.panda import LiftResult
from labkit.sim.spec import Camera, SceneSpec
from labkit.sim.world import TIME_STEP, World

FILM_SIZE = (640, 400)
COMPILING = "compiling, once on this machine: about twenty seconds"
FILM_RATE = 8  # pictures a second, of simulated time


@dataclass(frozen=True, eq=False)
class Story:
    """All that the demo saw: the frame, what was perceived, what became of the lift, the film, the seconds by stage."""

    spec: SceneSpec
    frame: RGBDFrame
    perception: Perception
    result: LiftResult
    film: list[UInt8[np.ndarray, "H W 3"]]
    true_centroids: dict[str, np.ndarray]
    seconds: dict[str, float]


def tell(spec: SceneSpec, model, size: tuple[int, int] = (320, 240), crf: bool | None = None) -> Story:
    """Run the chain on a scene with a network: look once, perceive, grasp, lift; film the arm meanwhile."""
    seconds, film, steps = {}, [], count()

    def record(world: World) -> None:
        if next(steps) % round(1.0 / TIME_STEP / FILM_RATE) == 0:
            film.append(world.render(FILM_SIZE, camera).rgb)

    with timed(seconds, "scene"):
        world = World(spec)
    with world:
        with timed(seconds, "render"):
            frame = world.render(size, smooth=True)
        pipeline = Pipeline(model, crf=crf)
        with timed(seconds, "warm-up"), said_if_long(COMPILING):
            pipeline.run(frame)  # a first run compiles and warms up; the second is what a robot waits for
        perception = pipeline.run(frame)
        seconds |= perception.seconds
        true_centroids = {t.name: world.centre(t.name) for t in spec.objects if t.class_id == TARGET}
        camera = film_camera(perception.plan.grasps, spec.table.z)
        world.observers.append(record)
        with timed(seconds, "lift and film"):
            result = lift(world, perception)
    return Story(spec, frame, perception, result, film, true_centroids, seconds)


def film_camera(grasps: Sequence[Grasp], table_z: float) -> Camera:
    """Place a camera to which the thing in the jaws shows: it looks across their closing, from the table's far side."""
    if not grasps:
        return Camera.looking_at((0.44, 0.0, table_z + 0.13), 1.4, 0.75, 0.5, fov_y=0.52)
    T = grasps[0].T_base_grasp
    along_pads = T[:2, 0] if T[:2, 0] @ T[:2, 3] > 0.0 else -T[:2, 0]
    azimuth = float(np.arctan2(along_pads[1], along_pads[0]))
    return Camera.looking_at((*T[:2, 3], table_z + 0.17), 1.05, azimuth, 0.3, fov_y=0.54)


@contextmanager
def said_if_long(words: str, seconds: float = 1.5):
    """Say on the terminal what a block is doing, if it takes so long."""
    timer = threading.Timer(seconds, print, (words,), {"file": sys.stderr, "flush": True})
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def report(story: Story) -> str:
    """The table of stages and the outcome, for a terminal."""
    p, counts = story.perception, story.spec.class_counts()
    n = confusion_matrix(story.frame.labels, p.labels, len(CLASSES))
    width, height = story.frame.size
    found = {
        "scene": f"seed {story.spec.seed}, {counts['target']} target(s) among {counts['obstacle']} obstacles",
        "render": f"{width} x {height} RGB-D image",
        "warm-up": "a first run, which compiles",
        "network": f"probabilities of {len(CLASSES)} classes per pixel",
        "labels": f"{np.count_nonzero(p.labels == TARGET)} target pixels",
        "crf": "labels refined along edges of colour and depth",
        "back_projection": f"{np.count_nonzero(np.isfinite(p.points[..., 2]))} points in the base frame",
        "clouds": f"{len(p.clouds)} target cloud(s) of {', '.join(str(len(c)) for c in p.clouds) or 'no'} points",
        "grasps": f"{len(p.plan.grasps)} candidates" if p.plan.grasps else f"none: {p.plan.reason}",
        "lift and film": "lifted a target" if story.result.success else f"failed: {story.result.reason}",
    }
    rows = [f"{'stage':<17}{'ms':>9}  result"]
    rows += [f"{stage:<17}{1000.0 * s:>9.1f}  {found.get(stage, '')}" for stage, s in story.seconds.items()]
    scores = ", ".join(f"{name} {value:.3f}" for name, value in zip(CLASSES, iou(n), strict=True))
    rows += ["", f"IoU of this frame: {scores}; mean {mean_iou(n):.3f}"]
    for number, cloud in enumerate(p.clouds, start=1):
        centroid, _ = centroid_and_covariance(cloud)
        name, distance = nearest(centroid, story.true_centroids)
        place = ", ".join(f"{x:+.3f}" for x in centroid)
        rows.append(
            f"cloud {number}: visible centroid ({place}) m, {100.0 * distance:.1f} cm from the middle of {name}"
        )
    if p.plan.grasps:
        grasp = p.plan.grasps[0]
        place = ", ".join(f"{x:+.3f}" for x in grasp.T_base_grasp[:3, 3])
        rows.append(f"best grasp: at ({place}) m, jaws {100.0 * grasp.width:.1f} cm apart")
    return "\n".join([*rows, outcome_in_words(story)])


def outcome_in_words(story: Story) -> str:
    """What became of the lift."""
    return f"lifted {story.result.name}" if story.result.success else f"not lifted: {story.result.reason}"


def nearest(point: np.ndarray, places: dict[str, np.ndarray]) -> tuple[str, float]:
    """The name of the place nearest to a point, and how far it is."""
    distances = {name: float(np.linalg.norm(place - point)) for name, place in places.items()}
    name = min(distances, key=distances.get)
    return name, distances[name]


def picture(story: Story) -> Figure:
    """Seven panels: colour, height, labels, overlay, target cloud, grasp from above, and the arm at the end."""
    figure = Figure(figsize=(16.0, 7.8), layout="constrained", dpi=100)
    above, below = figure.subfigures(2, 1, height_ratios=(3.2, 4.0))
    panels = above.subplot_mosaic([["rgb", "height", "labels", "overlay"]])
    panels |= below.subplot_mosaic(
        [["cloud", "grasp", "arm"]], width_ratios=(4.4, 4.4, 6.4), per_subplot_kw={"cloud": {"projection": "3d"}}
    )
    frame, p = story.frame, story.perception
    target = np.where(p.labels == TARGET, p.labels, 0)
    images = {
        "rgb": (frame.rgb, "1  the camera's image"),
        "labels": (colorize(p.labels), "3  a class for each pixel"),
        "overlay": (pages.picture(frame.rgb, target), "4  the target mask"),
        "arm": (story.film[-1] if story.film else frame.rgb, "7  " + outcome_in_words(story)),
    }
    for name, (image, title) in images.items():
        panels[name].imshow(image)
        panels[name].set_title(title, loc="left")
        panels[name].set_axis_off()
    handles = [Patch(color=PALETTE[c] / 255.0, label=name) for c, name in enumerate(CLASSES)]
    panels["labels"].legend(handles=handles, loc="lower center", ncols=4, fontsize=8, handlelength=1.0)
    draw_height(panels["height"], story)
    draw_cloud(panels["cloud"], story)
    draw_grasp(panels["grasp"], story)
    return figure


def draw_height(axes, story: Story) -> None:
    """How high each pixel lies over the table, in centimetres: what depth and calibration tell, seen from anywhere."""
    centimetres = 100.0 * (story.perception.points[..., 2] - story.spec.table.z)
    shown = axes.imshow(centimetres, cmap="viridis", vmin=-2.0, vmax=12.0, interpolation="nearest")
    bar = axes.inset_axes((0.2, 0.1, 0.6, 0.04))  # within the picture, so that the panels stay in a row
    axes.figure.colorbar(shown, cax=bar, orientation="horizontal", extend="both", ticks=[0, 4, 8, 12])
    bar.tick_params(colors="white", labelsize=8)
    bar.set_title("height over the table (cm)", color="white", fontsize=8, pad=3)
    axes.set_title("2  height, from depth", loc="left")
    axes.set_axis_off()


def draw_cloud(axes, story: Story) -> None:
    """The points round the targets in their colours, with visible and true centres: they are not the same point."""
    p, frame, table_z = story.perception, story.frame, story.spec.table.z
    middle = np.mean(list(story.true_centroids.values()), axis=0)
    near = (np.abs(p.points[..., :2] - middle[:2]).max(axis=-1) < 0.17) & (p.points[..., 2] > table_z - 0.01)
    shown = frame.rgb.copy()
    shown[p.labels == TARGET] = PALETTE[TARGET]
    axes.scatter(*p.points[near].T, s=2.5, c=shown[near] / 255.0, depthshade=False, rasterized=True)
    marks = {"visible centroid": ("k+", [centroid_and_covariance(cloud)[0] for cloud in p.clouds])}
    marks["true middle"] = ("wx", list(story.true_centroids.values()))
    for label, (style, places) in marks.items():
        if places:
            axes.plot(*np.transpose(places), style, ms=10, mew=2, label=label, zorder=10)
    low, high = middle - 0.17, middle + 0.17
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(table_z, table_z + 0.2))
    axes.set_box_aspect((1.0, 1.0, 0.59), zoom=1.05)
    eye = frame.T_base_cam[:3, 3] - middle
    axes.view_init(elev=28.0, azim=float(np.degrees(np.arctan2(eye[1], eye[0]))) + 25.0)
    axes.set(xlabel="x (m)", ylabel="y (m)")
    axes.tick_params(labelsize=7)
    axes.locator_params(nbins=4)
    axes.set_title("5  the target cloud in the robot's frame, z up", loc="left")
    axes.legend(fontsize=8, loc="upper right", facecolor="0.75")


def draw_grasp(axes, story: Story) -> None:
    """From above: every point by its height, the target in orange, and the two jaws of the best candidates."""
    p, table_z = story.perception, story.spec.table.z
    axes.set_title("6  the grasp, seen from above", loc="left")
    axes.set(xlabel="y of the base frame (m)", ylabel="x of the base frame (m)")
    axes.set_aspect("equal", adjustable="box")
    middle = p.plan.grasps[0].T_base_grasp[:2, 3] if p.plan.grasps else np.array([0.52, 0.0])
    axes.set(xlim=(middle[1] - 0.16, middle[1] + 0.16), ylim=(middle[0] - 0.12, middle[0] + 0.12))
    raised = p.scene[p.scene[:, 2] > table_z + 0.004]
    axes.scatter(raised[:, 1], raised[:, 0], c=raised[:, 2], s=4, cmap="Greys", vmin=table_z - 0.06, rasterized=True)
    for cloud in p.clouds:
        axes.scatter(cloud[:, 1], cloud[:, 0], s=4, color=PALETTE[TARGET] / 255.0, rasterized=True)
    if not p.plan.grasps:
        axes.text(middle[1], middle[0], p.plan.reason, ha="center", wrap=True)
        return
    for rank, grasp in reversed(list(enumerate(p.plan.grasps[:5]))):
        style = {"facecolor": "tab:blue", "alpha": 0.9} if rank == 0 else {"fill": False, "edgecolor": "0.5", "lw": 0.6}
        for finger in fingers(grasp.T_base_grasp, grasp.width, Gripper()):
            axes.add_patch(Polygon(finger[[0, 1, 3, 2], 1::-1], **style))


def save(story: Story, out: Path) -> list[Path]:
    """Write demo.png and demo.gif into the folder `out`; returns their paths."""
    out.mkdir(parents=True, exist_ok=True)
    paths = [out / "demo.png"]
    picture(story).savefig(paths[0])
    if story.film:
        paths.append(out / "demo.gif")
        frames = [Image.fromarray(image) for image in story.film]
        # One palette for all, taken from pictures all over the film, so that it does not flicker.
        some = np.hstack([story.film[i] for i in np.linspace(0, len(frames) - 1, 5).astype(int)])
        palette = Image.fromarray(some).quantize(128)
        frames = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in frames]
        pause = [1000 // FILM_RATE] * (len(frames) - 1) + [1500]
        frames[0].save(paths[1], save_all=True, append_images=frames[1:], duration=pause, loop=0, optimize=False)
    return paths
