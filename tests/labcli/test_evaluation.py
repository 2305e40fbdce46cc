"""Scores and lifts over scenes: pooled, honest, and as the command prints them."""

import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest
import torch
from scenes import box, scene

from data_gen import sample_scene
from labcli.evaluation import Trial, lift, run_trial, summarise
from labkit.labels import CLASSES, OBSTACLE, SURFACE, TARGET
from labkit.learning.channels import CHANNELS
from labkit.learning.inference import NetworkInput
from labkit.learning.network import SmallSegNet, save_model
from labkit.metrics import confusion_matrix, iou
from labkit.pipeline import Pipeline
from labkit.sim.world import World


def trial(counts, lifted=True, reason="", edges=(1, 2)):
    counts = np.array(counts)
    return Trial(0, counts, (np.full(4, edges[0]), np.full(4, edges[1])), lifted, reason, "mug", {"network": 0.1})


def test_counts_are_added_before_they_are_divided():
    """1 of 1 and 0 of 99 average to 0.5; pooled they are 0.01."""
    good, bad = np.zeros((2, 4, 4), int)
    good[TARGET, TARGET] = 1
    bad[TARGET, OBSTACLE] = 99
    report = summarise([trial(good), trial(bad, False, "slipped")])
    assert np.isclose(report.iou["target"], 0.01)
    assert report.lift_rate == 0.5 and report.failures == {"slipped": 1} and report.trials == 2
    low, high = report.lift_interval
    assert 0.0 < low < 0.5 < high < 1.0


def test_declining_what_is_unsure_is_the_lift_rate_of_the_surest():
    rng = np.random.default_rng(0)
    trials = [
        dataclasses.replace(trial(np.eye(4, dtype=int), bool(rng.random() < c)), certainty=c) for c in rng.random(40)
    ]
    rows = summarise(trials).declining
    assert len(rows) == 10 and rows[-1][1] == 1.0 and rows[-1][2] == np.mean([t.lifted for t in trials])
    for least, share, rate in rows:
        tried = [t.lifted for t in trials if t.certainty >= least]
        assert share == len(tried) / 40 and rate == pytest.approx(np.mean(tried))


def test_calibration_pools_pixels_of_all_trials():
    counts = [np.array([[4, 0.4, 1], [0, 0, 0]]), np.array([[6, 0.6, 1], [2, 1.8, 2]])]
    trials = [dataclasses.replace(trial(np.eye(4, dtype=int)), reliability=c) for c in (*counts, None)]
    assert summarise(trials).calibration == [(0.1, 0.2, 10), (0.9, 1.0, 2)]
    assert summarise(trials[2:]).calibration == []


def post_scene(class_id):
    return scene(box("post", 0.5, 0.05, (0.03, 0.03, 0.05), class_id))


def test_lifting_a_non_target_is_a_failure():
    """The mask says target, the simulator says obstacle: the arm lifts it, and the trial fails."""
    outcomes = {}
    for class_id in (TARGET, OBSTACLE):
        with World(post_scene(class_id)) as world:
            frame = world.render()
            mask = np.where(frame.instances == 1, TARGET, frame.labels)
            outcomes[class_id] = lift(world, Pipeline().locate(frame, mask))
        with World(post_scene(class_id)) as world:
            perception = Pipeline().locate(frame, np.where(mask == TARGET, OBSTACLE, mask))
            declined = lift(world, perception)  # no candidate
        assert not declined.success and declined.reason == perception.plan.reason != ""
    assert outcomes[TARGET].success
    assert not outcomes[OBSTACLE].success and "obstacle" in outcomes[OBSTACLE].reason


def test_the_command_writes_the_promised_keys(tmp_path):
    out = tmp_path / "scores.json"
    arguments = ["--scenes", "2", "--first-seed", "500000", "--config", "test", "--masks", "truth", "--json", str(out)]
    arguments += ["--worst", "1", "--out", str(tmp_path)]
    run = subprocess.run([sys.executable, "-m", "labcli.cli", "evaluate", *arguments], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    scores = json.loads(out.read_text())
    promised = "iou mean_iou boundary_iou pixel_accuracy lift_rate lift_interval trials failures seconds"
    assert set(promised.split()) <= set(scores)
    assert set(scores["iou"]) == set(CLASSES) and scores["trials"] == 2
    assert scores["mean_iou"] == scores["boundary_iou"] == scores["pixel_accuracy"] == 1.0
    assert [row["seed"] for row in scores["rows"]] == [500_000, 500_001]
    assert sum(row["reason"] == "" for row in scores["rows"]) == round(2 * scores["lift_rate"])
    assert all(row["target_iou"] == 1.0 and 0.0 <= row["certainty"] <= 1.0 for row in scores["rows"])
    page = (tmp_path / "worst.html").read_text()
    first = min(scores["rows"], key=lambda row: row["reason"] == "")
    assert page.count("<figure>") == 3 and f"Seed {first['seed']}: target IoU 1.000" in page
    assert "IoU" in run.stdout and "95 %" in run.stdout and "lifted" in run.stdout


def test_weights_that_were_trained_again_are_loaded_again(tmp_path):
    """The same file, first with weights that see nothing but surface, then nothing but obstacles."""
    seen = []
    for class_id in (SURFACE, OBSTACLE):
        model = SmallSegNet()
        model.logits.bias.data[class_id] = 1000.0
        save_model(model, tmp_path / "w.pt")
        seen.append(run_trial(post_scene(TARGET), tmp_path / "w.pt", (64, 48)).counts.sum(axis=0).argmax())
    assert seen == [SURFACE, OBSTACLE]


def test_predicted_masks_are_scored_against_the_truth():
    spec = sample_scene(500_001, "test")

    def all_surface(rgb):
        return np.dstack([np.zeros(rgb.shape[:2]), np.ones(rgb.shape[:2]), np.zeros((*rgb.shape[:2], 2))])

    result = run_trial(spec, all_surface, (160, 120))
    with World(spec) as world:
        labels = world.render((160, 120)).labels
    assert np.array_equal(result.counts, confusion_matrix(labels, np.ones_like(labels), 4))
    assert not result.lifted and iou(result.counts)[TARGET] == 0.0


def test_a_perturbed_trial_gives_every_model_the_same_spoilt_frame():
    """The score still knows the truth; the depth and the pose that the model works with are off."""
    spec, seen = sample_scene(500_002, "test"), []

    class Spy(torch.nn.Module):
        """A network that writes down what it sees and calls everything surface."""

        takes = NetworkInput(("image", "geometry"))

        def forward(self, image, geometry):
            seen.append((image.numpy().copy(), geometry.numpy()[0].copy()))
            return torch.eye(4)[1][None, :, None, None].expand(1, 4, *image.shape[-2:])

        def __init__(self):
            super().__init__()
            self.weight = torch.nn.Parameter(torch.zeros(1))

    for perturb in (False, True, True):
        trial = run_trial(spec, Spy(), (160, 120), perturb=perturb)
        assert trial.certainty == 0.0
    exact, spoilt, again = seen[:: len(seen) // 3]  # the first look of each trial
    assert np.array_equal(spoilt[1], again[1]) and np.array_equal(exact[0], spoilt[0])
    known = spoilt[1][CHANNELS.index("known")] == 1.0
    heights = [geometry[CHANNELS.index("height, fine")] for _, geometry in (exact, spoilt)]
    on_table = (abs(heights[0] - 0.5) < 1e-3) & known
    assert on_table.sum() > 1000
    assert 0.01 < np.abs(heights[1] - heights[0])[on_table].mean() < 0.25  # 1 to 25 mm of 100


def test_certainty_is_that_of_the_best_grasps_target():
    with World(post_scene(TARGET)) as world:
        labels = world.render().labels

    def sure(rgb):
        return np.where(np.eye(4, dtype=bool)[labels], 0.7, 0.1)

    trial = run_trial(post_scene(TARGET), sure)
    assert trial.lifted and trial.certainty == pytest.approx(0.7, abs=1e-3)
    pixels, p, true = trial.reliability.T
    assert pixels.sum() == labels.size and true.sum() == (labels == TARGET).sum() == true[7] + true[6]
    assert p.sum() == pytest.approx(0.1 * labels.size + 0.6 * true.sum())
