"""Training: the same result however often it is stopped, labels that stay on their pixels, checked settings."""

import json
import math
import signal
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import torch
from torch import nn

import data_gen
from labkit.frame import RGBDFrame
from labkit.learning.engines import open_engine
from labkit.learning.inference import NetworkInput
from labkit.learning.network import SmallSegNet, load_model
from labkit.losses import class_weights, segmentation_loss
from labtrain import ranks
from labtrain.augment import (
    Draws,
    augment,
    random_colour,
    random_crop,
    random_flip,
    random_noise,
    random_sharpness,
)
from labtrain.images import table_height
from labtrain.training import (
    ImagesInMemory,
    TrainConfig,
    Trainer,
    bf16_is_native,
    choose_device,
    evaluate,
    train,
    undo_weights,
)

CONFIG = TrainConfig(model="smallsegnet", epochs=3, batch=2, lr=3e-3, crop=(12, 16))


def scenes(count: int, height: int = 16, width: int = 24) -> list[tuple[np.ndarray, np.ndarray]]:
    """Images whose red is the class, so that a network can learn them; a corner is ignored."""
    rng = np.random.default_rng(7)
    pairs = []
    for _ in range(count):
        y = np.kron(rng.integers(0, 4, (height // 4, width // 4)), np.ones((4, 4))).astype(np.uint8)
        rgb = np.stack([70 * y + 20, rng.integers(0, 256, y.shape), 0 * y], axis=-1).astype(np.uint8)
        y[:2, :2] = 255
        pairs.append((rgb, y))
    return pairs


def frames(count: int, height: int = 32, width: int = 48) -> list[RGBDFrame]:
    """Frames from 0.5 m above a table at z = 0.1: colours are noise, and each class has its height."""
    rng = np.random.default_rng(8)
    K = np.array([[60.0, 0.0, width / 2], [0.0, 60.0, height / 2], [0.0, 0.0, 1.0]])
    T_base_cam = np.diag([1.0, -1.0, -1.0, 1.0])
    T_base_cam[2, 3] = 0.6
    made = []
    for _ in range(count):
        y = np.kron(rng.integers(0, 4, (height // 16, width // 16)), np.ones((16, 16))).astype(np.uint8)
        y[:16, :16] = 1  # some of the table is always seen
        depth = np.choose(y, [0.9, 0.5, 0.48, 0.44]).astype(np.float32)
        made.append(RGBDFrame(rng.integers(0, 256, (*y.shape, 3), dtype=np.uint8), depth, K, T_base_cam, labels=y))
    return made


def weights_of(folder, name="smallsegnet") -> dict:
    return torch.load(folder / f"{name}.pt", weights_only=True)["state_dict"]


def assert_same_weights(a: dict, b: dict):
    assert a.keys() == b.keys()
    for name, weight in a.items():
        assert torch.equal(weight, b[name]), name


def draws(count: int) -> Draws:
    return Draws(torch.Generator().manual_seed(3), count)


def batch(count: int = 6, height: int = 20, width: int = 28) -> tuple[torch.Tensor, torch.Tensor]:
    """Images in which every pixel's labels can be read off its first channel."""
    rgb = torch.randint(
        0, 256, (count, height, width, 3), dtype=torch.uint8, generator=torch.Generator().manual_seed(0)
    )
    return rgb, rgb[..., 0] % 5


# Augmentation


def test_a_crop_is_a_window_of_the_image_and_of_its_labels():
    rgb, y = batch()
    x, cut = random_crop(rgb, y, (9, 11), draws(6))
    assert x.shape == (6, 3, 9, 11) and cut.shape == (6, 9, 11)
    red = (x[:, 0] * 255.0).round().to(torch.uint8)
    assert torch.equal(red % 5, cut)
    places = []
    for i in range(6):  # by brute force, the window lies somewhere in its own image
        found = [(r, c) for r in range(12) for c in range(18) if torch.equal(rgb[i, r : r + 9, c : c + 11, 0], red[i])]
        assert len(found) == 1
        places += found
    assert len(set(places)) > 1


@pytest.mark.parametrize("zoom", [0.8, 1.25])
def test_zoom_keeps_image_and_labels_aligned(zoom):
    """A bright square on black, labelled 1: after zooming, the pixels brighter than half are those labelled 1."""
    rgb, y = torch.zeros(3, 40, 40, 3, dtype=torch.uint8), torch.zeros(3, 40, 40, dtype=torch.uint8)
    rgb[:, 14:27, 13:26], y[:, 14:27, 13:26] = 255, 1
    x, cut = random_crop(rgb, y, (32, 32), draws(3), zoom)
    wrong = (x[:, 0] > 0.5) != (cut == 1)
    assert cut.sum() / 3 == pytest.approx(169 * zoom**2, rel=0.3)
    assert wrong.float().mean() < 0.01


def test_a_flip_mirrors_image_and_labels_and_twice_is_none():
    rgb, y = batch(count=16)
    x = rgb.permute(0, 3, 1, 2).float()
    x1, y1 = random_flip(x.clone(), y.clone(), draws(16))
    flipped = [i for i in range(16) if not torch.equal(y1[i], y[i])]
    assert 0 < len(flipped) < 16
    for i in flipped:
        assert torch.equal(x1[i], x[i].flip(-1)) and torch.equal(y1[i], y[i].flip(-1))
    x2, y2 = random_flip(x1, y1, draws(16))
    assert torch.equal(x2, x) and torch.equal(y2, y)


@pytest.mark.parametrize("change", [random_colour, random_sharpness, random_noise])
def test_pixel_changes_change_every_image_otherwise_and_move_nothing(change):
    x = torch.zeros(8, 3, 16, 16)
    x[:, :, 5, 9] = 1.0
    changed = change(x.clone(), draws(8))
    assert changed.shape == x.shape
    assert len({round(float(image.std()), 6) for image in changed}) > 3
    assert all(int(image.sum(dim=0).argmax()) == 5 * 16 + 9 for image in changed)


def test_augmented_batch_is_a_function_of_the_generator_and_keeps_255():
    rgb, y = batch()
    y[:, 5:] = 255
    before = rgb.clone(), y.clone()
    runs = [augment(rgb, y, (8, 12), torch.Generator().manual_seed(seed)) for seed in (1, 1, 2)]
    assert torch.equal(runs[0][0], runs[1][0]) and torch.equal(runs[0][1], runs[1][1])
    assert not torch.equal(runs[0][0], runs[2][0])
    assert torch.equal(rgb, before[0]) and torch.equal(y, before[1]), "the data are left as they are"
    for x, labels in runs:
        assert x.shape == (6, 3, 8, 12) and x.is_contiguous(memory_format=torch.channels_last)
        assert x.min() >= 0.0 and x.max() <= 1.0
        assert (labels == 255).any() and labels[labels != 255].max() < 5


@pytest.mark.bad_input
def test_a_window_larger_than_the_image():
    with pytest.raises(ValueError, match="size: expected a window within"):
        random_crop(*batch(), (21, 8), draws(6))


# A run


class OwnNetwork(nn.Module):
    """Another scale, logits in a dict, two classes more than there are."""

    takes = NetworkInput(mean=127.5, std=127.5)

    def __init__(self):
        super().__init__()
        torch.manual_seed(0)
        self.layers = nn.Sequential(nn.Conv2d(3, 16, 3, padding=1), nn.ReLU(), nn.Conv2d(16, 6, 1))

    def forward(self, x):
        assert x.min() >= -1.0 and x.max() <= 1.0 and x.min() < -0.5, "it is given what it states"
        return {"out": self.layers(x)}


@pytest.mark.parametrize(
    ("model", "make"),
    [
        *(pytest.param(name, None, marks=pytest.mark.nightly) for name in ("smallsegnet", "unet")),
        ("unet_rgbd", None),
        ("mine", OwnNetwork),
    ],
)
def test_a_stopped_and_resumed_run_ends_with_the_very_same_weights(model, make, tmp_path, monkeypatch):
    """Stopped by a real SIGINT in the middle of an epoch, once in each of three steps, and gone on with each time."""
    config = replace(CONFIG, model=model, epochs=2, crop=None, num_classes=6 if make else 4)
    data = (frames if model == "unet_rgbd" else scenes)(7)
    val = data[:2]

    def run(folder):
        return train(data, val, config, tmp_path / folder, progress=False, model=make and make())

    expected = run("a")
    plain_step, handler = Trainer.step, signal.getsignal(signal.SIGINT)

    def interrupted_step(self, batch):
        loss = plain_step(self, batch)
        if self.done in (1, 3, 5):
            signal.raise_signal(signal.SIGINT)
        return loss

    monkeypatch.setattr(Trainer, "step", interrupted_step)
    for steps in (1, 3, 5):
        with pytest.raises(KeyboardInterrupt, match=rf"stopped after {steps} of 8 steps.*{model}\.checkpoint\.pt"):
            run("b")
    assert str(run("b")) == str(expected)  # NaN, where a class is in no image, is not equal to itself
    assert_same_weights(weights_of(tmp_path / "a", model), weights_of(tmp_path / "b", model))
    assert signal.getsignal(signal.SIGINT) is handler


def test_a_finished_run_is_not_run_again_and_a_seed_is_a_result(tmp_path, monkeypatch):
    data, state = scenes(4), torch.get_rng_state()
    history = train(data, None, CONFIG, tmp_path / "a", progress=False)
    assert torch.equal(torch.get_rng_state(), state), "the global generator is left alone"
    train(data, None, CONFIG, tmp_path / "b", progress=False)
    plain_step = Trainer.step

    def fails_in_the_second_epoch(self, batch):
        if self.done == self.batches:
            raise RuntimeError("power cut")
        return plain_step(self, batch)

    monkeypatch.setattr(Trainer, "step", fails_in_the_second_epoch)
    with pytest.raises(RuntimeError, match="power cut"):
        train(data, None, replace(CONFIG, seed=1), tmp_path / "c", progress=False)
    monkeypatch.undo()
    assert load_model(tmp_path / "c/smallsegnet.pt") is not None, "weights are there before the end, without validation"
    train(data, None, replace(CONFIG, seed=1), tmp_path / "c", progress=False)
    first, again, other = (weights_of(tmp_path / folder) for folder in "abc")
    assert_same_weights(first, again)
    assert not torch.equal(first["conv1.weight"], other["conv1.weight"])
    monkeypatch.setattr(Trainer, "step", None)
    assert train(data, None, CONFIG, tmp_path / "a", progress=False) == history


@pytest.mark.parametrize(("name", "own"), [("smallsegnet", None), ("mine", OwnNetwork)])
def test_a_run_learns_and_writes_what_it_says(name, own, tmp_path):
    data, val = scenes(8), scenes(10)[8:]
    config = replace(CONFIG, model=name, num_classes=6 if own else 4, epochs=25, lr=1e-2, val_every=10, augment=False)
    history = train(data, val, config, tmp_path, progress=False, model=own and own())
    written = sorted(file.name for file in tmp_path.iterdir())
    assert written == [f"{name}.checkpoint.pt", f"{name}.history.json", f"{name}.pt"]
    assert str(json.loads((tmp_path / f"{name}.history.json").read_text())) == str(history)  # NaN != NaN
    assert [row["epoch"] for row in history] == list(range(1, 26)) and history[-1]["steps"] == 100
    assert [row["epoch"] for row in history if "mean_iou" in row] == [10, 20, 25]
    assert history[-1]["loss"] < 0.5 * history[0]["loss"]
    shares = [0.0] if own else [0.0, 0.25, 0.5, 0.75, 1.0]  # which of them is best differs by processor
    assert history[-1]["mean_iou"] > 0.6 and history[-1]["weights_undone"] in shares
    model = load_model(tmp_path / f"{name}.pt", model=own and own())
    right = [open_engine(model)(rgb).argmax(axis=-1)[y != 255] == y[y != 255] for rgb, y in val]
    assert np.concatenate(right).mean() > 0.8
    if own:
        with pytest.raises(ValueError, match=r"model: expected smallsegnet, .* or a network of your own, got 'mine'"):
            train(data, None, config, tmp_path / "b", progress=False)


@pytest.mark.nightly  # the shipped weights show it, too
def test_a_network_that_sees_depth_learns_what_colour_does_not_tell(tmp_path):
    """Colours are noise here; heights over the table are the classes."""
    data, val = frames(8), frames(10)[8:]
    config = replace(CONFIG, model="unet_rgbd", epochs=40, lr=1e-2, val_every=40, augment=False, crop=None)
    history = train(data, val, config, tmp_path, progress=False)
    assert min(history[-1]["iou"]) > 0.8
    model, frame = load_model(tmp_path / "unet_rgbd.pt"), val[0]
    frame = replace(frame, table_z=0.1)
    right = open_engine(model)(frame).argmax(axis=-1) == frame.labels
    blind = open_engine(model)(replace(frame, depth=0.0 * frame.depth)).argmax(axis=-1) == frame.labels
    assert right.mean() > 0.9 and blind.mean() < 0.7


def test_the_table_is_as_high_as_the_pixels_labelled_surface():
    frame = frames(1)[0]
    assert table_height(frame) == pytest.approx(0.1, abs=1e-6)
    lost = replace(frame, depth=np.where(frame.labels == 1, 0.0, frame.depth).astype(np.float32))
    assert table_height(lost) == 0.0
    for config in ("train", "wide"):
        spec = data_gen.sample_scene(3, config)
        frame = replace(data_gen.render(spec, (160, 120)), table_z=None)
        assert table_height(frame) == pytest.approx(spec.table.z, abs=1e-4)


def test_the_loss_of_a_step_is_the_weighted_loss_of_its_batch():
    data = ImagesInMemory(scenes(5), progress=False)
    trainer = Trainer(data, replace(CONFIG, weights="inverse", augment=False), torch.device("cpu"))
    (x,), y, _ = trainer.batch_of_step(0)
    model = SmallSegNet()
    model.load_state_dict(trainer.model.state_dict())
    weights = class_weights(data.class_counts(4), "inverse")
    assert trainer.step(next(trainer.ahead())) == pytest.approx(
        float(segmentation_loss(model(x), y, weights).detach()), rel=2e-2
    )


def focal(logits, labels, weights):
    """A sum over pixels that is not the kit's: pixels that are right already count less."""
    counted = labels != 255
    p = logits.float().softmax(dim=1).movedim(1, -1)[counted]
    p = p.gather(1, labels[counted].long()[:, None])[:, 0]
    return (-weights[labels[counted].long()] * (1 - p) ** 2 * p.log()).sum() / counted.sum().clamp(min=1)


def soft_iou(logits, labels, weights):
    """A ratio of sums over the whole batch, which is not a sum over pixels."""
    counted = labels != 255
    p = logits.float().softmax(dim=1).movedim(1, -1)[counted]
    hit = p.gather(1, labels[counted].long()[:, None]).sum()
    return 1 - hit / (2 * len(p) - hit)


focal.sums_over_pixels = True


@pytest.mark.parametrize("loss", [focal, soft_iou])
def test_a_loss_of_ones_own_is_what_a_run_lowers_and_its_checkpoint_names_it(loss, tmp_path):
    config = replace(CONFIG, epochs=20, lr=2e-2, augment=False, weights="sqrt" if loss is focal else "none")
    data = scenes(6)
    history = train(data, data[:2], config, tmp_path, progress=False, loss=loss)
    assert history[-1]["loss"] < 0.99 * history[0]["loss"]
    data = ImagesInMemory(data, progress=False)
    trainer = Trainer(data, config, torch.device("cpu"), loss=loss)
    (x,), y, _ = trainer.batch_of_step(0)
    model = SmallSegNet()
    model.load_state_dict(trainer.model.state_dict())
    weights = torch.from_numpy(class_weights(data.class_counts(4), config.weights)).float()
    assert trainer.step(next(trainer.ahead())) == pytest.approx(float(loss(model(x), y, weights).detach()), rel=2e-2)
    with pytest.raises(ValueError, match=rf"config: .* differs in loss: expected \['{loss.__name__}'\]"):
        train(data, None, config, tmp_path, progress=False)


def test_what_only_a_sum_over_pixels_allows_is_refused_to_others(tmp_path, monkeypatch):
    with pytest.raises(ValueError, match=r"weights: expected 'none', since .* not soft_iou, got 'sqrt'"):
        train(scenes(2), scenes(1), CONFIG, tmp_path, progress=False, loss=soft_iou)
    monkeypatch.setattr(ranks, "rank_and_count", lambda: (0, 2))
    with pytest.raises(ValueError, match=r"loss: expected one process, or a sum over pixels .*, got soft_iou"):
        train(scenes(2), None, CONFIG, tmp_path, progress=False, loss=soft_iou)
    assert not list(tmp_path.iterdir())


def test_a_checkpoint_from_before_a_setting_goes_on_with_its_default(tmp_path):
    """Its run had no other: a step of learning rate less, and no loss but the kit's."""
    config, data = replace(CONFIG, epochs=1), scenes(2)
    history = train(data, None, config, tmp_path, progress=False)
    path = tmp_path / "smallsegnet.checkpoint.pt"
    state = torch.load(path, weights_only=True)
    del state["loss"], state["config"]["warmup"], state["config"]["weights"]
    torch.save(state, path)
    assert train(data, None, config, tmp_path, progress=False) == history
    with pytest.raises(ValueError, match=r"differs in warmup: expected \[0.05\], got \[0.1\]"):
        train(data, None, replace(config, warmup=0.1), tmp_path, progress=False)


def test_an_epoch_shows_every_image_once():
    data = ImagesInMemory(scenes(7), progress=False)
    trainer = Trainer(data, replace(CONFIG, augment=False), torch.device("cpu"))
    assert trainer.batches == 4 and trainer.total == 12
    whole = data.rgb.permute(0, 3, 1, 2).float() / 255.0
    for epoch in range(2):
        images = torch.cat([trainer.batch_of_step(4 * epoch + place)[0][0] for place in range(4)])
        seen = [(image == whole).all(dim=(1, 2, 3)).nonzero().item() for image in images]
        assert sorted(seen) == list(range(7))


def test_learning_rate_rises_then_falls_to_zero():
    config = TrainConfig(lr=0.5, warmup=0.1)
    rates = [config.learning_rate(step, 100) for step in range(100)]
    assert rates[:10] == pytest.approx([0.05 * k for k in range(1, 11)])
    assert max(rates) == 0.5
    assert all(later < earlier for earlier, later in pairwise(rates[10:]))
    assert rates[55] == pytest.approx(0.25) and rates[-1] < 1e-3
    assert math.isclose(TrainConfig(lr=0.5).learning_rate(0, 1), 0.5)


def test_frames_and_tensors_are_datasets_too():
    pairs = scenes(3)
    camera = np.ones((16, 24), np.float32), np.diag([9.0, 9.0, 1.0]), np.eye(4)
    frames = [RGBDFrame(rgb, *camera, labels=y) for rgb, y in pairs]
    tensors = [(torch.from_numpy(rgb), torch.from_numpy(y)) for rgb, y in pairs]
    rgb, y = (np.stack(images) for images in zip(*pairs, strict=True))
    for dataset in (pairs, frames, tensors):
        data = ImagesInMemory(dataset, progress=False)
        assert np.array_equal(data.rgb, rgb) and np.array_equal(data.y, y)
    np.testing.assert_array_equal(data.class_counts(4), [(y == c).sum() for c in range(4)])


# Bad input


OFF = {"model": "../unet", "weight_decay": -0.1, "warmup": 1.0, "weights": "equal", "num_classes": 1, "seed": -1}
OFF |= dict.fromkeys(("epochs", "steps", "batch", "val_every", "lr"), 0)


@pytest.mark.bad_input
@pytest.mark.parametrize(("name", "value"), [*OFF.items(), ("lr", float("nan")), ("crop", (2, 64)), ("crop", (64,))])
def test_settings_are_checked(name, value):
    with pytest.raises(ValueError, match=rf"^{name}: expected .* got"):
        TrainConfig(**{name: value})


RGB, Y = scenes(1)[0]
NO_LABELS = RGBDFrame(RGB, np.ones(Y.shape, np.float32), np.diag([9.0, 9.0, 1.0]), np.eye(4))


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("train_set", "val_set", "says"),
    [
        ([], None, "train_set: expected at least one image"),
        (scenes(1), [], "val_set: expected at least one image"),
        ([*scenes(1), *scenes(1, 20, 24)], None, "train_set: expected images of one size"),
        ([(RGB, Y[:-1])], None, r"train_set\[0\]: expected labels of the size of the image"),
        ([(RGB, np.full_like(Y, 4))], None, r"train_set\[0\]: expected labels 0 to 3"),
        ([(RGB / 255.0, Y)], None, r"train_set\[0\]: expected uint8 RGB"),
        ([NO_LABELS], None, r"train_set\[0\]: expected a frame with labels"),
        (scenes(1), "unet_rgbd", r"train_set\[0\]: expected an RGBDFrame, for its depth, got tuple"),
        (ImagesInMemory(scenes(1), progress=False), "unet_rgbd", "train_set: expected images with depth"),
    ],
)
def test_data_that_do_not_fit(train_set, val_set, says, tmp_path):
    rgbd = val_set == "unet_rgbd"
    config = replace(CONFIG, model="unet_rgbd") if rgbd else CONFIG
    with pytest.raises(ValueError, match=says):
        train(train_set, None if rgbd else val_set, config, tmp_path, progress=False)
    assert not list(tmp_path.iterdir())


@pytest.mark.bad_input
def test_a_checkpoint_of_another_run_or_a_damaged_one(tmp_path):
    config, data = replace(CONFIG, epochs=1), scenes(2)
    train(data, None, config, tmp_path, progress=False)
    with pytest.raises(ValueError, match=r"config: .* differs in batch, seed.* another folder, .*--no-resume"):
        train(data, None, replace(config, batch=1, seed=4), tmp_path, progress=False)
    with pytest.raises(ValueError, match=r"config: .* differs in images"):
        train(scenes(3), None, config, tmp_path, progress=False)
    checkpoint = tmp_path / "smallsegnet.checkpoint.pt"
    checkpoint.write_bytes(checkpoint.read_bytes()[:5000])
    with pytest.raises(ValueError, match=r"out: .*truncated"):
        train(data, None, config, tmp_path, progress=False)
    train(data, None, config, tmp_path, resume=False, progress=False)


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("able", "native"),
    [
        ({"avx2": True}, False),
        ({"avx512_f": True, "avx512_bf16": False}, False),
        ({"avx512_bf16": True}, True),
        ({"amx_bf16": True}, True),
    ],
)
def test_devices_and_that_bf16_is_used_only_where_it_is_native(monkeypatch, able, native):
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: able)
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    device = choose_device("auto")
    assert device == choose_device("cpu") == torch.device("cpu")
    assert bf16_is_native(device) is native
    assert Trainer(ImagesInMemory(scenes(1), progress=False), CONFIG, device).bf16 is native
    for name, says in (("cuda", "a CUDA GPU"), ("tpu", "auto, cpu or cuda")):
        with pytest.raises(ValueError, match=f"device: expected {says}"):
            choose_device(name)


@pytest.mark.parametrize("crop", [None, (18, 22)])
@pytest.mark.parametrize("augmented", [False, True])
def test_sizes_that_the_network_does_not_take_are_padded(crop, augmented, tmp_path):
    """SmallSegNet takes multiples of 4; what is padded is nobody's error."""
    data = ImagesInMemory(scenes(3, 20, 24), progress=False)
    data.rgb, data.y = data.rgb[:, :18, :23].contiguous(), data.y[:, :18, :23].contiguous()
    config = replace(CONFIG, crop=crop, augment=augmented, epochs=1)
    (x,), y, _ = Trainer(data, config, torch.device("cpu")).batch_of_step(0)
    assert x.shape[2:] == y.shape[1:] == (20, 24)
    assert (y[:, 18:] == 255).all() and (y[:, :18, 2:20] != 255).all()
    assert torch.equal(x[:, :, 18], x[:, :, 17])
    assert "mean_iou" in train(data, data, config, tmp_path, progress=False)[-1]


class OnePixelRule(nn.Module):
    """Logits that are the same everywhere: the optimum of a weighted loss when images say nothing."""

    def __init__(self, z):
        super().__init__()
        self.logits = nn.Conv2d(3, len(z), 1)
        self.logits.weight.data.zero_()
        self.logits.bias.data.copy_(torch.tensor(z))

    def forward(self, x):
        return self.logits(x)


def test_undoing_the_weights_moves_the_weighted_optimum_back():
    """p = (0.7, 0.3) and weights (1, 9) make the rare class win everywhere; unweighted, the common one does."""
    rng = np.random.default_rng(0)
    y = (rng.random((2, 40, 40)) < 0.3).astype(np.uint8)
    data = ImagesInMemory([(np.zeros((40, 40, 3), np.uint8), labels) for labels in y], 2, progress=False)
    w = torch.tensor([1.0, 9.0])
    model = OnePixelRule(torch.log(w * torch.tensor([0.7, 0.3])).tolist())
    assert evaluate(model, data, 2)[:, 1].sum() == y.size
    share, n = undo_weights(model, w, data, 2)
    assert share > 0.5 and n[:, 0].sum() == y.size
    assert np.array_equal(evaluate(model, data, 2), n)
