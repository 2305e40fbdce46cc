"""Training by two real processes that torchrun starts, over gloo on loopback, beside one process."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import torch

import data_gen
from labkit.losses import segmentation_loss
from labtrain import training
from labtrain.augment import augment
from tests.labtrain.test_training import CONFIG, batch, focal, frames, scenes

ROOT = Path(__file__).parents[2]
# As each rank has: sums of two threads are rounded otherwise, and Adam's first steps magnify that.
pytestmark = pytest.mark.usefixtures("one_thread")
# Loopback by its number: on some machines the own name leads nowhere, and ranks would wait for it.
LAUNCH = (sys.executable, "-m", "torch.distributed.run", "--standalone", "--local-addr=127.0.0.1", "--nproc-per-node=2")
NIGHTLY = pytest.mark.nightly


def small_run(model: str, out: Path, epochs: int = 2) -> list[dict]:
    """Five images in batches of four: the second batch of an epoch has one image for two ranks. In float32."""
    training.bf16_is_native = lambda device: False
    data = (frames if model == "unet_rgbd" else scenes)(5, 32, 48)
    loss = focal if model == "smallsegnet" else segmentation_loss
    config = replace(CONFIG, model=model, epochs=epochs, batch=4, crop=None, lr=1e-3)
    return training.train(data, data[:3], config, out, device="cpu", loss=loss)


def environment() -> dict[str, str]:
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests")]), "OMP_NUM_THREADS": "1"}


def by_two(*words: str, check: bool = True) -> subprocess.CompletedProcess:
    command = [*LAUNCH, *words]
    return subprocess.run(command, env=environment(), cwd=ROOT, capture_output=True, text=True, check=check)


@NIGHTLY
@pytest.mark.parametrize("model", ["unet", "smallsegnet", "unet_rgbd"])
def test_two_ranks_go_through_the_losses_of_one_process(model, tmp_path, monkeypatch):
    """Also with batch normalisation, a rank without an image, class weights, another loss."""
    monkeypatch.setattr(training, "bf16_is_native", None)
    alone = small_run(model, tmp_path / "alone")
    by_two(__file__, model, str(tmp_path / "two"), "2")
    together = json.loads((tmp_path / "two" / f"{model}.history.json").read_text())
    ours, theirs = ([row["loss"] for row in history] for history in (alone, together))
    # Depth has many equal pixels, and rounding decides which is the largest: pixels changed by 1e-6 change the first
    # gradient by 0.8 % in one process, too. Without the whole batch's statistics, losses differ by 3 and 5 %.
    first, all_of_them = (2e-3, 4e-3) if model == "unet_rgbd" else (1e-5, 1e-3)
    assert theirs[0] == pytest.approx(ours[0], rel=first)
    assert theirs == pytest.approx(ours, rel=all_of_them)
    written = {path.name for path in (tmp_path / "two").iterdir()}
    assert written == {f"{model}{end}" for end in (".pt", ".history.json", ".checkpoint.pt")}


@NIGHTLY
def test_a_killed_rank_and_an_interrupt_are_gone_on_from(tmp_path, monkeypatch):
    """One rank dies in the second epoch; the next run, by one process, is stopped by SIGINT; two ranks end it."""
    monkeypatch.setattr(training, "bf16_is_native", None)
    expected = small_run("unet", tmp_path / "whole", epochs=4)
    words = (__file__, "unet", str(tmp_path / "out"), "4")
    assert by_two(*words, "1", "KILL", check=False).returncode != 0
    killed = torch.load(tmp_path / "out" / "unet.checkpoint.pt")
    assert killed["done"] == 2
    assert by_two(*words, "0", "INT", check=False).returncode != 0
    assert torch.load(tmp_path / "out" / "unet.checkpoint.pt")["done"] == 3, "both ranks stop after the same step"
    by_two(*words)
    history = json.loads((tmp_path / "out" / "unet.history.json").read_text())
    assert [row["loss"] for row in history] == pytest.approx([row["loss"] for row in expected], rel=2e-3)


@NIGHTLY
def test_the_command_prints_once(tmp_path):
    data_gen.generate(tmp_path / "data", range(3), "test", (64, 48), progress=False)
    words = ("train", str(tmp_path / "data"), "--epochs", "1", "--device", "cpu", "--out", str(tmp_path / "out"))
    done = by_two("-m", "labcli.cli", *words)
    assert done.stdout.count("unet.pt: 1 epochs, loss") == 1
    assert done.stderr.count("reading train_set: 100%") == 1


def test_a_part_of_a_batch_is_changed_as_in_the_whole():
    rgb, y = batch(5)
    for seed in range(4):  # with and without zoom

        def changed(part, *where, seed=seed):
            return augment(rgb[part], y[part], (8, 12), torch.Generator().manual_seed(seed), *where)

        x, labels = changed(slice(None))
        parts = [changed(slice(0, 2), 0, 5), changed(slice(2, 5), 2, 5)]
        assert torch.allclose(x, torch.cat([part[0] for part in parts]), atol=1e-6)
        assert torch.equal(labels, torch.cat([part[1] for part in parts]))


def dies_at_step_three(rank: int, name: str) -> None:
    """Send this process a signal after the first step of the run's second epoch, if it is that rank."""
    plain = training.Trainer.step

    def step(self, batch):
        loss = plain(self, batch)
        if self.done == 3 and os.environ["RANK"] == str(rank):
            os.kill(os.getpid(), getattr(signal, f"SIG{name}"))
        return loss

    training.Trainer.step = step


if __name__ == "__main__":
    model, out, epochs, *death = sys.argv[1:]
    if death:
        dies_at_step_three(int(death[0]), death[1])
    small_run(model, Path(out), int(epochs))
