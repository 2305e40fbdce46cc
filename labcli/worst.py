"""The trials of `labkit evaluate` that went worst, as a page with pictures: `--worst 12`."""

import html
from collections.abc import Sequence

import numpy as np
from tqdm.auto import tqdm

from labcli import report
from labcli.evaluation import Trial, look


def worst(trials: Sequence[Trial], count: int) -> list[int]:
    """Indices of the worst trials: those that lifted nothing come first, and of equals the lower target IoU.

    >>> def trial(hit, missed, lifted):
    ...     counts = np.zeros((4, 4), int)
    ...     counts[2, 2], counts[2, 3] = hit, missed
    ...     return Trial(1, counts, (counts[0], counts[1]), lifted, "", "mug")
    >>> worst([trial(3, 1, True), trial(9, 1, False), trial(1, 3, True), trial(1, 9, False)], 3)
    [3, 1, 2]
    """
    badness = [(trial.lifted, np.nan_to_num(trial.target_iou, nan=1.0)) for trial in trials]
    return sorted(range(len(trials)), key=badness.__getitem__)[:count]


def page(specs, trials: Sequence[Trial], count: int, *how) -> str:
    """HTML of the worst trials, each seen again: the picture with jaws, labels and true labels, and what was said.

    specs: the trials' scenes. how: model, size, crf and perturb, as `labcli.evaluation.look` takes them.
    """
    from labkit.sim.world import World

    body = []
    for i in tqdm(worst(trials, count), desc="worst", unit="scene"):
        trial = trials[i]
        with World(specs[i]) as world:
            perception, _ = look(world, *how)
        frame = perception.frame
        pictures = {
            "the picture, and the jaws": report.with_grasps(frame, perception.plan.grasps),
            "labels that were found": report.picture(frame.rgb, perception.labels),
            "true labels": report.picture(frame.rgb, frame.labels),
        }
        found = [f"lifted {trial.family}" if trial.lifted else f"not lifted: {trial.reason}"]
        found += [f"certainty {trial.certainty:.2f}", *(f"notice: {sentence}" for sentence in perception.notices)]
        body += [f"<h2>Seed {trial.seed}: target IoU {trial.target_iou:.3f}</h2>", report.figures(pictures)]
        body += [f"<pre>{html.escape(chr(10).join(found))}</pre>"]
    title = f"The worst {min(count, len(trials))} of {len(trials)} trials; targets orange, obstacles green"
    return report.PAGE.format(title=title, body="\n".join(body))
