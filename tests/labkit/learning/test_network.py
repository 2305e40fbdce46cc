"""The networks: exactly the text's layers, any image size, and weights that load or say why not."""

import io
import pickle
from dataclasses import replace

import numpy as np
import pytest
import torch
from scenes import random_image
from torch.nn import functional as F

import data_gen
from labkit.frame import RGBDFrame
from labkit.labels import TARGET
from labkit.learning.engines import open_engine
from labkit.learning.view import PIXEL
from labkit.network import (
    ARCHITECTURES,
    SmallSegNet,
    UNet,
    UNetRGBD,
    load_model,
    save_model,
    weights_path,
)


def small_unet(num_classes: int = 4) -> UNet:
    torch.manual_seed(0)
    return UNet(num_classes, widths=(8, 8, 16), blocks=(1, 0, 1))


def test_smallsegnet_has_the_layers_of_the_text():
    shapes = {name: tuple(weight.shape) for name, weight in SmallSegNet(num_classes=4).state_dict().items()}
    assert shapes == {
        "conv1.weight": (32, 3, 3, 3),
        "conv1.bias": (32,),
        "conv2.weight": (64, 32, 3, 3),
        "conv2.bias": (64,),
        "conv3.weight": (128, 64, 3, 3),
        "conv3.bias": (128,),
        "up1.weight": (128, 64, 2, 2),
        "up1.bias": (64,),
        "up2.weight": (64, 32, 2, 2),
        "up2.bias": (32,),
        "logits.weight": (4, 32, 1, 1),
        "logits.bias": (4,),
    }


def test_smallsegnet_computes_what_the_text_does():
    """The oracle is the text's forward pass, written out with functional calls on the same weights."""
    model = SmallSegNet().double().eval()
    w = model.state_dict()
    x = torch.rand(2, 3, 12, 8, dtype=torch.float64)
    z = F.max_pool2d(F.relu(F.conv2d(x, w["conv1.weight"], w["conv1.bias"], padding=1)), 2)
    z = F.max_pool2d(F.relu(F.conv2d(z, w["conv2.weight"], w["conv2.bias"], padding=1)), 2)
    z = F.relu(F.conv2d(z, w["conv3.weight"], w["conv3.bias"], padding=1))
    z = F.relu(F.conv_transpose2d(z, w["up1.weight"], w["up1.bias"], stride=2))
    z = F.relu(F.conv_transpose2d(z, w["up2.weight"], w["up2.bias"], stride=2))
    z = F.conv2d(z, w["logits.weight"], w["logits.bias"])
    torch.testing.assert_close(model(x), z)


@pytest.mark.parametrize("size", [(37, 61), (1, 1), (16, 16), (17, 32), (50, 3)])
def test_unet_takes_any_size_and_crops_what_it_pads(size):
    """The logits of an odd size are those of the image that was padded by hand, where the two overlap."""
    model, x = small_unet().eval(), torch.rand(2, 3, *size)
    padded = F.pad(x, (0, -size[1] % 8, 0, -size[0] % 8), mode="replicate")
    torch.testing.assert_close(model(x), model(padded)[..., : size[0], : size[1]])


def test_all_weights_fit_in_eight_megabytes(tmp_path):
    for name, kind in ARCHITECTURES.items():
        save_model(kind(), tmp_path / name)
    assert sum(file.stat().st_size for file in tmp_path.iterdir()) < 8_000_000
    assert 700_000 < sum(weight.numel() for weight in UNet().parameters()) < 1_000_000


def test_unet_sees_a_whole_object_and_smallsegnet_about_twenty_pixels():
    """The receptive field, measured: how far away a pixel can be and still move the logits in the middle."""
    reach = {}
    for model in (UNet().eval(), SmallSegNet().eval()):
        x = torch.rand(1, 3, 256, 256, requires_grad=True)
        model(x)[0, 2, 128, 128].backward()
        touched = x.grad.abs().sum(dim=(0, 1)).nonzero()
        reach[type(model)] = int((touched - 128).abs().max())
    assert reach[UNet] >= 40
    assert 8 <= reach[SmallSegNet] <= 12


def test_kernels_stored_in_half_give_nearly_the_same_probabilities(tmp_path):
    torch.manual_seed(0)
    model, image = UNetRGBD().eval(), random_image(48, 64)
    frame = RGBDFrame(image, np.random.default_rng(1).uniform(0.5, 0.6, (48, 64)), np.diag([50.0, 50, 1]), np.eye(4))
    save_model(model, tmp_path / "w.pt")
    loaded = load_model(tmp_path / "w.pt")
    assert type(loaded) is UNetRGBD and {w.dtype for w in loaded.parameters()} == {torch.float32}
    p, q = (open_engine(m)(frame) for m in (model, loaded))
    assert np.abs(p - q).max() < 1e-3
    torch.save(model.state_dict(), tmp_path / "bare.pt")
    assert type(load_model(tmp_path / "bare.pt")) is UNetRGBD


def test_weights_keep_the_view_that_they_were_trained_in(tmp_path):
    model = UNetRGBD()
    for pixel in (0.004, None):
        model.takes = replace(model.takes, pixel=pixel)
        save_model(model, tmp_path / "w.pt")
        assert load_model(tmp_path / "w.pt").takes == model.takes
    old = torch.load(tmp_path / "w.pt", weights_only=True)
    del old["pixel"]
    torch.save(old, tmp_path / "old.pt")
    assert load_model(tmp_path / "old.pt").takes.pixel is None, "there were no views when it was trained"
    assert load_model(weights_path("unet_rgbd")).takes.pixel == PIXEL
    assert load_model(weights_path("unet")).takes.pixel is None, "colours alone gain nothing by it"


@pytest.mark.parametrize("model", [UNet(3), SmallSegNet(3)], ids=["unet", "smallsegnet"])
def test_saved_weights_load_and_predict_the_same(model, tmp_path):
    model(torch.rand(2, 3, 16, 16))  # so that the running means of UNet are not those of a fresh one
    save_model(model.eval(), tmp_path / "sub" / "weights.pt", epoch=3, iou=[0.5, float("nan")])
    loaded = load_model(tmp_path / "sub" / "weights.pt", num_classes=3)
    assert type(loaded) is type(model) and not loaded.training
    image = random_image(20, 28)
    np.testing.assert_allclose(open_engine(loaded)(image), open_engine(model)(image), atol=1e-6)
    assert [file.name for file in (tmp_path / "sub").iterdir()] == ["weights.pt"]
    assert torch.load(tmp_path / "sub" / "weights.pt", weights_only=True)["meta"]["epoch"] == 3
    torch.save(model.state_dict(), tmp_path / "bare.pt")  # as the text saves and loads it
    assert type(load_model(tmp_path / "bare.pt", 3)) is type(model)
    with pytest.raises(ValueError, match=r"num_classes: expected 3, the classes that .*weights\.pt .* got 5"):
        load_model(tmp_path / "sub" / "weights.pt", 5)
    F.cross_entropy(loaded(torch.rand(2, 3, 32, 32)), torch.randint(0, 3, (2, 32, 32))).backward()
    for name, weight in loaded.named_parameters():
        assert weight.grad is not None and weight.grad.abs().max() > 0.0, f"{name} learns nothing"


def as_file(content) -> bytes:
    buffer = io.BytesIO()
    torch.save(content, buffer)
    return buffer.getvalue()


STATE = SmallSegNet().state_dict()
NOTHING = r".*w\.pt holds no weights that can be read"
REFUSED = {  # what the file is, its bytes, what is said
    "truncated": (as_file(STATE)[:100_000], NOTHING),
    "empty": (b"", NOTHING),
    "text": (b"not weights at all", NOTHING),
    "pickle": (pickle.dumps([1, 2], 2), NOTHING),
    "a list": (as_file([1, 2]), "expected a dict of weights"),
    "numbers": (as_file({"epoch": 3}), "expected weights by name"),
    "unknown": (
        as_file({"architecture": "vit", "state_dict": {}}),
        "expected weights of smallsegnet, .* or `model`, .* 'vit'",
    ),
    "another": (
        as_file({"architecture": "unet", "state_dict": STATE}),
        "expected the weights of unet.* got 1 that fit and 10 of other names",
    ),
    "no weights": (as_file({}), r"expected the weights of unet, \d+ arrays, got 0 that fit"),
}


@pytest.mark.bad_input
@pytest.mark.parametrize(("data", "says"), REFUSED.values(), ids=REFUSED)
def test_a_file_without_weights(data, says, tmp_path):
    with pytest.raises(FileNotFoundError, match="path: no file"):
        load_model(tmp_path / "w.pt", 4)
    (tmp_path / "w.pt").write_bytes(data)
    with pytest.raises(ValueError, match=f"^path: {says}"):
        load_model(tmp_path / "w.pt", 4)


def test_weights_of_ones_own_network_load_into_it(tmp_path):
    mine, other = (torch.nn.Sequential(torch.nn.Conv2d(3, 2, 1), torch.nn.BatchNorm2d(2)) for _ in range(2))
    save_model(mine, tmp_path / "w.pt")
    loaded = load_model(tmp_path / "w.pt", model=other)
    assert loaded is other and not loaded.training and torch.equal(other[0].weight, mine[0].weight)
    with pytest.raises(ValueError, match=r"path: expected weights of smallsegnet, .* or `model`, .* 'Sequential'"):
        load_model(tmp_path / "w.pt")
    with pytest.raises(ValueError, match="path: expected the weights of Conv2d, 2 arrays, got 0 that fit and 7 of"):
        load_model(tmp_path / "w.pt", model=torch.nn.Conv2d(3, 2, 1))


@pytest.mark.nightly
def test_taking_class_weights_out_gives_the_target_its_share_of_probability():
    """On 12 of the scenes that both networks were trained on; SmallSegNet cannot tell what a target is, and hedges."""
    frames = [data_gen.render(data_gen.sample_scene(seed, "train"), (320, 240)) for seed in range(1000, 1012)]
    engines = {name: open_engine(load_model(weights_path(name))) for name in ("unet", "smallsegnet")}
    given = {name: np.mean([answer(frame.rgb)[..., TARGET] for frame in frames]) for name, answer in engines.items()}
    pixels = np.mean([frame.labels == TARGET for frame in frames])
    assert given["unet"] == pytest.approx(pixels, rel=0.05) and given["smallsegnet"] > 3.0 * pixels


def test_lesson_03_says_how_few_pixels_of_a_whole_frame_train_mode_changes():
    frames = [data_gen.render(data_gen.sample_scene(seed, "train"), (320, 240)) for seed in (600_002, 600_008, 600_011)]
    for frame in frames:
        x = torch.from_numpy(frame.rgb / 255.0).permute(2, 0, 1)[None].float()
        with torch.no_grad():
            right, wrong = (load_model(weights_path("unet")).train(mode)(x).argmax(1) for mode in (False, True))
        assert 0 < (right != wrong).float().mean() < 1 / 20


@pytest.mark.parametrize("odd", ["sparse", "meta"])
def test_arrays_that_are_not_dense_are_refused_in_words(odd, tmp_path):
    weights = {name: w.clone() for name, w in SmallSegNet().state_dict().items()}
    name, w = next(iter(weights.items()))
    ways = {
        "sparse": lambda: w.to_sparse(),
        "meta": lambda: w.to("meta"),
    }
    weights[name] = ways[odd]()
    torch.save(weights, tmp_path / "odd.pt")
    with pytest.raises(ValueError, match=r"^path: "):
        load_model(tmp_path / "odd.pt")
