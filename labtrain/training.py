"""Training a network on labelled images: fast on a CPU, seeded, stopped and resumed at will (topics 03 and 05).

A run is a function of its configuration and its data. Step s of it draws its randomness from (seed, s) and the order of
epoch e from (seed, e), so that nothing has to be replayed: weights, optimiser and the number of steps done are all
that a checkpoint holds, and a resumed run ends where an undisturbed one does. Processes that torchrun started share
each step's batch (`labtrain.ranks`), and go through the same losses as one process.
"""

import copy
import json
import math
import re
import signal
import threading
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import nn
from torch.nn import functional as F
from torch.utils.data import DataLoader
from tqdm.auto import tqdm

from labkit.labels import CLASSES, IGNORE
from labkit.learning.foreign import logits_of
from labkit.learning.network import ARCHITECTURES, TorchEngine, read_checkpoint, save_model, write_checkpoint
from labkit.learning.things import things_loss
from labkit.losses import SCHEMES, class_weights, segmentation_loss
from labkit.metrics import confusion_matrix, iou, mean_iou
from labkit.support.files import write_atomically
from labkit.support.validation import require
from labtrain import ranks
from labtrain.augment import augment
from labtrain.augment_depth import augment_frames, varied_things
from labtrain.images import ImagesInMemory


@dataclass(frozen=True)
class TrainConfig:
    """Everything that a run depends on besides its data.

    model: a name in labkit.network.ARCHITECTURES, or the name in the files' names of a network of one's own. epochs:
    passes over the data; steps: optimiser steps instead, if given. lr: the highest learning rate; weights: scheme of
    labkit.losses.class_weights. crop: (h, w) of the random window of each image, or None for whole images. val_every:
    epochs between validations. Raises ValueError for a bad value.

    >>> TrainConfig(model="unet", epochs=2).batch
    8
    """

    model: str = "unet"
    epochs: int = 40
    steps: int | None = None
    batch: int = 8
    lr: float = 3e-3
    weight_decay: float = 0.01
    warmup: float = 0.05  # share of the steps in which the learning rate rises
    weights: str = "sqrt"
    augment: bool = True
    crop: tuple[int, int] | None = (192, 256)
    val_every: int = 1
    num_classes: int = len(CLASSES)
    seed: int = 0

    def __post_init__(self):
        def need(name, fits, expected):
            require(name, fits, expected, repr(getattr(self, name)))

        need("model", re.fullmatch(r"[\w-]+", self.model), "a name of letters, digits, - and _")
        need("weights", self.weights in SCHEMES, f"one of {', '.join(SCHEMES)}")
        need("epochs", self.epochs >= 1, "at least 1")
        need("steps", self.steps is None or self.steps >= 1, "at least 1, or None")
        need("batch", self.batch >= 1, "at least 1")
        need("lr", 0.0 < self.lr < 1.0, "a learning rate between 0 and 1")
        need("weight_decay", 0.0 <= self.weight_decay < 1.0, "a share in 0..1")
        need("warmup", 0.0 <= self.warmup < 1.0, "a share in 0..1")
        need("val_every", self.val_every >= 1, "at least 1")
        need("num_classes", 2 <= self.num_classes <= IGNORE, f"2 to {IGNORE}")
        need("seed", self.seed >= 0, "at least 0")
        need("crop", self.crop is None or (len(self.crop) == 2 and min(self.crop) >= 4), "(h, w) of 4 or more, or None")
        if self.crop is not None:
            object.__setattr__(self, "crop", tuple(int(length) for length in self.crop))

    def learning_rate(self, step: int, total: int) -> float:
        """Learning rate at a step of `total`: a linear rise, then half a cosine that falls to 0."""
        rise = max(1, round(self.warmup * total))
        if step < rise:
            return self.lr * (step + 1) / rise
        return self.lr * 0.5 * (1.0 + math.cos(math.pi * (step - rise) / max(1, total - rise)))


# What the committed weights are trained with; SmallSegNet has no normalisation, and wants smaller steps.
RECIPES = {
    "unet": TrainConfig(model="unet", epochs=40),
    "smallsegnet": TrainConfig(model="smallsegnet", epochs=4, lr=1e-3),
    "unet_rgbd": TrainConfig(model="unet_rgbd", epochs=24, crop=(144, 192), val_every=4),
}


# How trained weights learn to tell things apart: windows that hold a jug and its neighbours, the classes as they come.
THINGS_RECIPE = TrainConfig(
    model="unet_rgbd", epochs=10, batch=4, lr=2e-3, weights="none", crop=(224, 288), val_every=10
)


def fine_tuning_recipe(model: str, validated: bool) -> TrainConfig:
    """How trained weights go on with a few pictures of somebody's own: gently, and long enough for twenty of them.

    validated: whether there are pictures to validate on. Without, the classes are not weighted, since nothing could
    tell how far to take the weights out again (`undo_weights`).
    """
    return replace(RECIPES[model], epochs=60, lr=1e-3, weights="sqrt" if validated else "none", val_every=20)


fine_tuning = fine_tuning_recipe  # its name in lab 10 of courses that began before 0.3


def choose_device(device: str = "auto") -> torch.device:
    """Turn "auto", "cpu" or "cuda" into a device; raises ValueError if there is no such device here."""
    require("device", device in ("auto", "cpu", "cuda"), "auto, cpu or cuda", repr(device))
    if device == "cuda" and not torch.cuda.is_available():
        raise ValueError("device: expected a CUDA GPU and a CUDA build of PyTorch, got neither; use cpu or auto")
    if device == "cpu" or not torch.cuda.is_available():
        return torch.device("cpu")
    return torch.device("cuda", ranks.env_int("LOCAL_RANK"))


def bf16_is_native(device: torch.device) -> bool:
    """Whether the device multiplies bfloat16 in hardware; elsewhere it is emulated, and slower than float32."""
    if device.type == "cuda":
        return torch.cuda.is_bf16_supported(including_emulation=False)
    able = torch.cpu.get_capabilities()
    return bool(able.get("avx512_bf16") or able.get("amx_bf16") or able.get("bf16"))


def generator_for(*numbers: int) -> torch.Generator:
    """Make a generator whose stream belongs to these numbers, such as a seed and a step."""
    state = np.random.SeedSequence(numbers).generate_state(1, np.uint64)[0]
    return torch.Generator().manual_seed(int(state))


@lru_cache(maxsize=1)
def order_of_epoch(seed: int, epoch: int, count: int) -> torch.Tensor:
    """The order in which an epoch shows its images."""
    return torch.randperm(count, generator=generator_for(seed, 0, epoch))


class DeferredInterrupt:
    """While entered, the first Ctrl-C only sets `.pending`, so that no step is cut in half; a second one raises."""

    def __enter__(self) -> "DeferredInterrupt":
        self.pending = False
        self.installed = threading.current_thread() is threading.main_thread()  # only there may handlers be set
        if self.installed:
            self.previous = signal.signal(signal.SIGINT, self.handle)
        return self

    def handle(self, signum, stack_frame):
        if self.pending:
            raise KeyboardInterrupt
        self.pending = True

    def __exit__(self, *exception):
        if self.installed:
            signal.signal(signal.SIGINT, self.previous)


def fresh_model(config: TrainConfig) -> nn.Module:
    """Make the untrained network of a configuration; raises ValueError if it is none of the kit's."""
    if config.model not in ARCHITECTURES:
        names = ", ".join(ARCHITECTURES)
        raise ValueError(f"model: expected {names}, or a network of your own, got {config.model!r} alone")
    with torch.random.fork_rng():
        torch.manual_seed(config.seed)
        return ARCHITECTURES[config.model](config.num_classes)


class Trainer:
    """One run: model, optimiser and position; `step` makes one step, `state` and `restore` save and load all of it."""

    def __init__(
        self,
        data: ImagesInMemory,
        config: TrainConfig,
        device: torch.device,
        model: nn.Module | None = None,
        loss: Callable = segmentation_loss,
    ):
        self.data, self.config, self.device, self.loss = data, config, device, loss
        self.batches = math.ceil(len(data) / config.batch)  # in an epoch
        self.total = config.steps if config.steps is not None else config.epochs * self.batches
        model = fresh_model(config) if model is None else model
        engine = TorchEngine(model)
        self.takes, self.things = engine.takes, engine.things
        self.model = model.to(device=device, memory_format=torch.channels_last)
        parts = (part for part in model.modules() if any(True for _ in part.parameters()))
        self.frozen = [part for part in parts if not any(weight.requires_grad for weight in part.parameters())]
        # A frozen network with a branch that tells things apart learns no classes, and need not give them.
        self.learns_classes = not self.things or model.logits not in self.frozen
        self.call = ranks.wrap_ddp(self.model)
        self.optimiser = torch.optim.AdamW(
            [w for w in self.model.parameters() if w.requires_grad],
            lr=config.lr,
            weight_decay=config.weight_decay,
            fused=True,
        )
        self.bf16 = bf16_is_native(device)
        counts = data.class_counts(config.num_classes)
        self.weights = torch.from_numpy(class_weights(counts, config.weights)).float()
        self.done = 0
        self.losses: list[float] = []  # of this epoch
        self.history: list[dict] = []

    def images_of_step(self, step: int) -> tuple[list[int], range]:
        """The numbers of the images in a step's batch, and which of them, counted in the batch, this process makes."""
        epoch, place = divmod(step, self.batches)
        order = order_of_epoch(self.config.seed, epoch, len(self.data))
        chosen = order[place * self.config.batch : (place + 1) * self.config.batch].tolist()
        return chosen, ranks.share_of_batch(len(chosen))

    def batch_of_step(self, step: int) -> tuple[list[torch.Tensor], torch.Tensor, torch.Tensor | None]:
        """The arrays (N, D, h, w) that the network takes, labels (N, h, w), and instances if it tells things apart.

        A function of the seed and the step; with several ranks, this one's part of it.
        """
        config, (H, W) = self.config, self.data.y.shape[1:]
        whole, part = self.images_of_step(step)
        chosen = whole[part.start : part.stop] or [whole[part.start]]  # to have shapes; it is cut off again
        pictures, instances = self.data.pictures(chosen), None
        if self.things and config.augment:
            rngs = [
                np.random.default_rng([config.seed, 2, step, i]) for i in range(part.start, part.start + len(chosen))
            ]
            pictures = [varied_things(*each) for each in zip(pictures, rngs, strict=True)]
        views = [(picture, self.takes.view(picture)) for picture in pictures]
        seen = [picture if view is None else view.frame for picture, view in views]
        if config.augment:
            size = (H, W) if config.crop is None else (min(config.crop[0], H), min(config.crop[1], W))
            generator = generator_for(config.seed, 1, step)
            if self.data.depth is not None:
                *arrays, y, instances = augment_frames(seen, size, generator, part.start, len(whole))
            else:
                *arrays, y = augment(
                    self.data.rgb[chosen], self.data.y[chosen], size, generator, part.start, len(whole)
                )
            mean, std = (torch.tensor(value).float().reshape(-1, 1, 1) for value in (self.takes.mean, self.takes.std))
            arrays[0] = arrays[0] * (255.0 / std) - mean / std
        else:
            built = [self.takes.build(picture) for picture in seen]
            arrays = [stacked(array).permute(0, 3, 1, 2) for array in zip(*built, strict=True)]
            y = self.data.y[chosen] if self.takes.pixel is None else stacked([p.labels for p in seen], IGNORE)
            if self.things:
                instances = stacked([p.instances for p in seen], IGNORE)
        truth = [y, instances] if self.things else [y]
        arrays, truth = ([array[: len(part)] for array in each] for each in (arrays, truth))
        edges = (0, -y.shape[2] % self.takes.divisor, 0, -y.shape[1] % self.takes.divisor)
        if any(edges):
            arrays = [F.pad(array, edges, mode="replicate") for array in arrays]
            truth = [F.pad(image, edges, value=IGNORE) for image in truth]
        return arrays, truth[0], truth[1] if self.things else None

    def ahead(self, workers: int = 0):
        """The batches of all steps that are left, each made when it is asked for, or before, by forked processes."""
        steps = range(self.done, self.total)
        if not workers:
            return map(self.batch_of_step, steps)
        how = {"collate_fn": self.batch_of_step, "num_workers": workers, "multiprocessing_context": "fork"}
        threads = cv2.getNumThreads()
        cv2.setNumThreads(1)  # its threads do not outlive a fork, and a worker would wait for them
        try:
            return iter(DataLoader(steps, batch_size=None, worker_init_fn=_leave_ctrl_c, **how))
        finally:
            cv2.setNumThreads(threads)

    def step(self, batch) -> float:
        """Make one optimiser step and return its loss, over all ranks' images; batch: that of `batch_of_step`."""
        arrays, y, instances = batch
        for group in self.optimiser.param_groups:
            group["lr"] = self.config.learning_rate(self.done, self.total)
        self.model.train()
        for part in self.frozen:
            part.eval()
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.bf16):
            classes = {} if self.learns_classes else {"classes": False}
            result = self.call(*(array.to(self.device) for array in arrays), **classes)
        counted = (y != IGNORE).sum()
        share = counted / ranks.sum_over_ranks(counted).clamp(min=1)  # of the batch's pixels
        loss = 0.0
        if self.learns_classes:
            loss = self.loss(logits_of(result, tuple(y.shape[-2:])), y.to(self.device), self.weights)
        if self.things:
            loss = loss + things_loss(result["things"], instances.to(self.device))
        loss = loss * share
        self.optimiser.zero_grad(set_to_none=True)
        (loss * ranks.rank_and_count()[1]).backward()  # gradients are means over ranks, and the loss is their sum
        nn.utils.clip_grad_norm_(self.model.parameters(), 5.0)  # one odd batch must not undo an hour
        self.optimiser.step()
        self.done += 1
        self.losses.append(ranks.sum_over_ranks(loss.cpu()).item())
        return self.losses[-1]

    def state(self) -> dict:
        """All that another run needs to go on from here."""
        return {
            "model": self.model.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "done": self.done,
            "losses": self.losses,
            "history": self.history,
            "config": asdict(self.config),
            **self.what(),
        }

    def what(self) -> dict:
        """What makes another run of the same configuration: the number of images, the loss, and if it tells things."""
        return {"images": len(self.data), "loss": name_of(self.loss), "things": self.things}

    def restore(self, state: dict, source) -> None:
        """Go on from a `state`; raises ValueError naming `config` if it is of another run.

        What a state does not name was no choice yet when it was written, and had what is now its default.
        """
        ours = asdict(self.config) | self.what()
        defaults = {field.name: field.default for field in fields(TrainConfig)}
        defaults |= {"loss": name_of(segmentation_loss), "things": False}
        theirs = defaults | state.get("config", {}) | {key: state[key] for key in self.what() if key in state}
        differ = sorted(key for key in ours if theirs.get(key) != ours[key])
        if differ:
            raise ValueError(
                f"config: {source} is of another run, which differs in {', '.join(differ)}: expected "
                f"{[theirs.get(key) for key in differ]}, got {[ours[key] for key in differ]}; its learning rates "
                "were for that run: choose another folder, or start anew with resume=False (--no-resume)"
            )
        self.model.load_state_dict(state["model"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.done, self.losses, self.history = state["done"], list(state["losses"]), list(state["history"])

    def check_together(self) -> None:
        """Raise ValueError unless all ranks go on from the same step."""
        found, count = int(ranks.sum_over_ranks(torch.tensor(self.done))), ranks.rank_and_count()[1]
        together = ranks.sum_over_ranks(torch.tensor(int(self.done * count != found))) == 0
        require("out", together, "a checkpoint that every process reads, or none", f"step {self.done} here alone")


def _leave_ctrl_c(worker: int) -> None:
    """A worker does not stop at Ctrl-C: its parent ends it, after the step that is being made."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def stacked(images: Sequence[np.ndarray], beyond: int | None = None) -> torch.Tensor:
    """Images as one tensor: smaller ones get the value `beyond` at their right and lower edge, None repeats theirs."""
    H, W = np.max([image.shape[:2] for image in images], axis=0)
    how = {"mode": "edge"} if beyond is None else {"constant_values": beyond}
    edges = [[(0, H - x.shape[0]), (0, W - x.shape[1]), (0, 0)][: x.ndim] for x in images]
    return torch.from_numpy(np.stack([np.pad(x, edge, **how) for x, edge in zip(images, edges, strict=True)]))


def evaluate(model: nn.Module, data: ImagesInMemory, num_classes: int) -> np.ndarray:
    """Pool one confusion matrix (C, C) over all images of `data`, whole, with the model in eval mode."""
    engine, n = TorchEngine(model), np.zeros((num_classes, num_classes), np.int64)
    device, (rank, count) = engine.weight().device, ranks.rank_and_count()
    with torch.autocast(device.type, torch.bfloat16, enabled=bf16_is_native(device)):
        for i in range(rank, len(data), count):
            z = engine.logits(data.pictures([i])[0])
            n += confusion_matrix(data.y[i].numpy(), z.argmax(axis=0), num_classes)
    return ranks.sum_over_ranks(torch.from_numpy(n)).numpy()


def train(
    train_set: Sequence | ImagesInMemory,
    val_set: Sequence | ImagesInMemory | None,
    config: TrainConfig,
    out,
    resume: bool = True,
    device: str = "auto",
    progress: bool = True,
    model: nn.Module | None = None,
    loss: Callable = segmentation_loss,
    workers: int = 0,
) -> list[dict]:
    """Train a network and return its history: one dict per epoch (epoch, steps, loss, and mean_iou and iou by class).

    train_set, val_set: datasets as ImagesInMemory takes them, or ImagesInMemory; val_set may be None. model: a network
    of one's own, which is trained in place, as `labkit.network.TorchEngine` describes it. loss: a function of logits
    (N, C, H, W), labels (N, H, W) and class weights (C,) to a scalar, as `segmentation_loss` is; its attribute
    `sums_over_pixels` tells that the scalar is a sum over pixels, divided by how many are counted. workers: processes
    that make batches ahead, where processes can fork; the run is the same with any number of them. In the folder `out`
    are written, atomically, after each epoch: NAME.pt, the weights for load_model; NAME.history.json;
    NAME.checkpoint.pt, from which `resume` goes on. The checkpoint is written at Ctrl-C, too, which then raises
    KeyboardInterrupt and says where it is. On one machine, with as many threads, a resumed run ends with the very
    weights of an undisturbed one. Under torchrun, each process makes its part of every batch; the first one writes.
    Raises ValueError for data that do not fit, a checkpoint of another configuration, or a loss that is not a sum over
    pixels where one is needed: under torchrun, and to take class weights out again. Topics 03 and 05.
    """
    out, where, progress = Path(out), choose_device(device), progress and ranks.is_main()
    model = fresh_model(config) if model is None else model
    with ranks.process_group(where):
        check_loss(loss, config, validated=val_set is not None)
        how = {"progress": progress, "depth": "geometry" in TorchEngine(model).takes.arrays}
        things = TorchEngine(model).things
        train_data = cached_dataset(train_set, config.num_classes, "train_set", instances=things, **how)
        val_data = None if val_set is None else cached_dataset(val_set, config.num_classes, "val_set", **how)
        checkpoint = out / f"{config.model}.checkpoint.pt"
        trainer = Trainer(train_data, config, where, model, loss)
        if resume and checkpoint.is_file():
            trainer.restore(read_checkpoint("out", checkpoint), checkpoint)
        trainer.check_together()
        run(trainer, val_data, checkpoint, progress, workers)
        return trainer.history


def name_of(loss: Callable) -> str:
    """The name of a loss: a function's own, or its class's."""
    return getattr(loss, "__name__", type(loss).__name__)


def check_loss(loss: Callable, config: TrainConfig, validated: bool) -> None:
    """Raise ValueError if a loss that is not a sum over pixels meets what only a sum allows."""
    if not getattr(loss, "sums_over_pixels", False):
        expected = "one process, or a sum over pixels (sums_over_pixels = True), whose parts ranks can add up"
        require("loss", ranks.rank_and_count()[1] == 1, expected, name_of(loss))
        expected = f"'none', since validation takes them out again, from sums over pixels alone, not {name_of(loss)}"
        require("weights", config.weights == "none" or not validated, expected, repr(config.weights))


def run(trainer: Trainer, val_data: ImagesInMemory | None, checkpoint: Path, progress: bool, workers: int = 0) -> None:
    """Make all steps that are left, and write what there is after each epoch and at Ctrl-C."""
    config, out = trainer.config, checkpoint.parent
    bar = tqdm(total=trainer.total, initial=trainer.done, desc=config.model, unit="step", disable=not progress)
    with bar, DeferredInterrupt() as interrupt:
        batches = trainer.ahead(workers)
        while trainer.done < trainer.total:
            loss = trainer.step(next(batches))
            bar.update()
            bar.set_postfix_str(progress_line(loss, trainer.history), refresh=False)
            if trainer.done % trainer.batches == 0 or trainer.done == trainer.total:
                finish_epoch(trainer, val_data, out)
                write_state(trainer, checkpoint)
            if ranks.sum_over_ranks(torch.tensor(int(interrupt.pending))) > 0:  # all stop after the same step
                write_state(trainer, checkpoint)
                raise KeyboardInterrupt(
                    f"stopped after {trainer.done} of {trainer.total} steps; the same command goes on from {checkpoint}"
                )
    if val_data is not None and "weights_undone" not in trainer.history[-1]:
        finish_run(trainer, val_data, out)
        write_state(trainer, checkpoint)


def write_state(trainer: Trainer, checkpoint: Path) -> None:
    """Write all that another run needs to go on from here; the first rank does."""
    if ranks.is_main():
        write_checkpoint(checkpoint, trainer.state())


def finish_run(trainer: Trainer, val_data: ImagesInMemory, out: Path) -> None:
    """Take the class weights back out of a trained network as far as validation likes it, and save it for good."""
    config, model = trainer.config, copy.deepcopy(trainer.model)
    share, n = undo_weights(model, trainer.weights, val_data, config.num_classes)
    trainer.history[-1] |= {"mean_iou": mean_iou(n), "iou": iou(n).tolist(), "weights_undone": share}
    save_weights(model, trainer, out)


def save_weights(model: nn.Module, trainer: Trainer, out: Path) -> None:
    """Write a model as the run's weights, with the last row of the history, and the history; the first rank does."""
    if not ranks.is_main():
        return
    name = trainer.config.model
    save_model(model, out / f"{name}.pt", **trainer.history[-1], config=asdict(trainer.config))
    write_atomically(out / f"{name}.history.json", json.dumps(trainer.history, indent=1).encode())


def undo_weights(
    model: nn.Module, weights: torch.Tensor, val_data: ImagesInMemory, num_classes: int
) -> tuple[float, np.ndarray]:
    """Lower each class's last bias by share * log w, with the share in 0..1 that gives the best mean IoU on val_data.

    Weighted training moves the optimum from p_c to w_c p_c / sum(w p) (topic 05), so that a rare class
    wins pixels along its edges that are more likely not its own. Subtracting log w from the logits moves it back.
    Returns the share and the confusion matrix that it gives; the model's bias, `logits.bias`, is changed in place. A
    model that has none stays as it is.
    """
    bias = getattr(getattr(model, "logits", None), "bias", None)
    if bias is None or (weights == weights[0]).all():
        return 0.0, evaluate(model, val_data, num_classes)
    trained = bias.detach().clone()
    log_w = torch.log(weights.to(bias))
    best = None
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        bias.data.copy_(trained - share * log_w)
        n = evaluate(model, val_data, num_classes)
        if best is None or mean_iou(n) > mean_iou(best[1]):
            best = share, n
    bias.data.copy_(trained - best[0] * log_w)
    return best


def cached_dataset(
    dataset, num_classes: int, name: str, progress: bool, depth: bool, instances: bool = False
) -> ImagesInMemory:
    """Read a dataset into memory, unless it was read already."""
    if not isinstance(dataset, ImagesInMemory):
        return ImagesInMemory(dataset, num_classes, name, progress, depth, instances)
    require(name, not depth or dataset.depth is not None, "images with depth", "some that were read without")
    require(name, not instances or dataset.instances is not None, "images with instances", "some read without")
    return dataset


def finish_epoch(trainer: Trainer, val_data: ImagesInMemory | None, out: Path) -> None:
    """Write down the epoch that has just ended: its mean loss, the validation scores when they are due, the weights."""
    config = trainer.config
    epoch = math.ceil(trainer.done / trainer.batches)
    row = {"epoch": epoch, "steps": trainer.done, "loss": float(np.mean(trainer.losses))}
    trainer.losses = []
    last = trainer.done == trainer.total
    if val_data is not None and (epoch % config.val_every == 0 or last):
        n = evaluate(trainer.model, val_data, config.num_classes)
        row |= {"mean_iou": mean_iou(n), "iou": iou(n).tolist()}
    trainer.history.append(row)
    save_weights(trainer.model, trainer, out)


def progress_line(loss: float, history: list[dict]) -> str:
    """Say the last loss and validation scores for the progress bar."""
    scores = [f", val mIoU {row['mean_iou']:.3f}" for row in history if "mean_iou" in row]
    return f"loss {loss:.3f}{''.join(scores[-1:])}"
