"""From a picture to probabilities: any network in any engine gives what plain PyTorch gives for the padded picture."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scenes import random_image
from torch import nn
from torch.nn import functional as F

from labkit.frame import RGBDFrame
from labkit.learning.channels import CHANNELS, geometry_channels
from labkit.learning.engines import ENGINES, open_engine
from labkit.learning.inference import NetworkInput
from labkit.learning.network import SmallSegNet, TorchEngine, UNet, UNetRGBD, evaluating
from labkit.learning.view import PIXEL, canonical_view
from labkit.pipeline import Pipeline
from labtrain.training import ImagesInMemory, evaluate


def tensor(rgb: np.ndarray, mean=0.0, std=255.0) -> torch.Tensor:
    return torch.from_numpy(((rgb - np.float32(mean)) / np.float32(std)).transpose(2, 0, 1))[None]


class Mine(nn.Module):
    """A network of one's own: logits in a dict, dropout, its own scale, and a size that must be divisible by 8."""

    takes = NetworkInput(mean=(120.0, 110.0, 100.0), std=(60.0, 61.0, 62.0), divisor=8)

    def __init__(self, num_classes: int = 3):
        super().__init__()
        torch.manual_seed(0)
        self.down, self.up = nn.Conv2d(3, 12, 8, 8), nn.ConvTranspose2d(12, num_classes, 8, 8)
        self.dropout, self.norm = nn.Dropout(0.5), nn.BatchNorm2d(12)

    def forward(self, x):
        return {"out": self.up(self.dropout(self.norm(self.down(x)))), "aux": x}


class Brightness(nn.Module):
    """No parameters at all."""

    def forward(self, x):
        return torch.cat([x.mean(dim=1, keepdim=True), 0.5 + 0.0 * x[:, :1]], dim=1)


class Tall(nn.Module):
    """Two classes by geometry alone: what stands higher than 3 cm over the table, and everything else."""

    takes = NetworkInput(("image", "geometry"), divisor=4)

    def __init__(self):
        super().__init__()
        self.scale = nn.Parameter(torch.tensor(1000.0))

    def forward(self, image, geometry):
        height = 0.05 * (2.0 * geometry[:, 1:2] - 1.0)
        z = self.scale * (height - 0.03) + 0.0 * image[:, :1]
        return torch.cat([-z, z], dim=1)


def plain(model: nn.Module, rgb: np.ndarray) -> np.ndarray:
    """Pad, scale and run by PyTorch alone, and crop."""
    takes = getattr(model, "takes", NetworkInput())
    (height, width), d = rgb.shape[:2], takes.divisor
    x = F.pad(tensor(rgb, takes.mean, takes.std), (0, -width % d, 0, -height % d), mode="replicate")
    with torch.inference_mode(), evaluating(model):
        z = model(x)
    return (z["out"] if isinstance(z, dict) else z)[0, :, :height, :width].numpy()


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("kind", [UNet, SmallSegNet, Mine, Brightness])
def test_any_network_and_size_gives_what_plain_pytorch_gives(kind, name):
    torch.manual_seed(0)
    model = kind()
    engine = open_engine(model, name)
    for size in ((37, 61), (96, 112), (33, 18)):
        rgb, order = random_image(*size), "F" if size[0] == 33 else "C"
        z, expected = engine.logits(np.array(rgb, order=order)), plain(model, rgb)
        assert z.shape == expected.shape and np.abs(z - expected).max() < 1e-4
        p, mirrored = (np.exp(x) / np.exp(x).sum(axis=0) for x in (expected, plain(model, rgb[:, ::-1].copy())))
        assert np.allclose(engine(rgb), p.transpose(1, 2, 0), atol=1e-5)
        both = 0.5 * (p + mirrored[:, :, ::-1]).transpose(1, 2, 0)
        assert engine(rgb, flip_tta=True).dtype == np.float32 and np.allclose(
            engine(rgb, flip_tta=True), both, atol=1e-5
        )
    assert model.training, "it is left in the mode that it was in"


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("size", [(1, 1), (1, 40), (16, 16), (40, 3)])
def test_a_sliver_of_an_image_is_seen_as_if_its_border_went_on(size, name):
    """OpenCV's engine pads to two cells of the network where one would do; see the comment there."""
    torch.manual_seed(0)
    model, rgb = UNet(), random_image(*size)
    engine = open_engine(model, name)
    wider = [(0, max(0, engine.padded_side(1) - side)) for side in size]
    expected = plain(model, np.pad(rgb, [*wider, (0, 0)], mode="edge"))[:, : size[0], : size[1]]
    assert np.abs(engine.logits(rgb) - expected).max() < 1e-4


def test_frozen_parts_of_a_training_network_stay_frozen():
    model = Mine().train()
    model.norm.eval()
    a, b = (TorchEngine(model)(random_image(16, 16)) for _ in range(2))
    assert np.array_equal(a, b), "dropout is off"
    assert model.training and model.dropout.training and not model.norm.training


def frame_of_steps() -> RGBDFrame:
    """Seen from 0.8 m above the base: a table at 0.1 m, steps of 0.02 m on it, one column without depth."""
    T_base_cam = np.diag([1.0, -1.0, -1.0, 1.0])
    T_base_cam[2, 3] = 0.8
    depth = np.full((10, 14), 0.7, np.float32) - 0.02 * (np.arange(14, dtype=np.float32) // 2)
    depth[:, 5] = np.nan
    K = np.array([[9.0, 0.0, 7.0], [0.0, 9.0, 5.0], [0.0, 0.0, 1.0]])
    return RGBDFrame(random_image(10, 14), depth, K, T_base_cam, table_z=0.1)


@pytest.mark.parametrize("name", ENGINES)
def test_a_network_may_look_at_geometry(name):
    frame = frame_of_steps()
    labels, _ = Pipeline(Tall(), engine=name, target_class=1).perceive(frame)
    assert np.array_equal(labels, np.broadcast_to((np.arange(14) >= 4) & (np.arange(14) != 5), (10, 14)))
    labels, _ = Pipeline(Tall(), table_z=0.18, engine=name, target_class=1).perceive(frame)
    assert not labels[:, :12].any() and labels[:, 12:].all(), "the pipeline's word for the table's height counts"
    with pytest.raises(ValueError, match="picture: expected an RGBDFrame"):
        open_engine(Tall(), name)(frame.rgb)


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("mirror", [False, True])
def test_the_kits_network_sees_the_frames_depth_in_every_engine(name, mirror):
    """RGB, then seven channels, padded by repeating the border; in a mirror the normal's sideways part is turned."""
    torch.manual_seed(0)
    model, frame = UNetRGBD().eval(), frame_of_steps()
    model.takes = replace(model.takes, pixel=None)  # pictures as they are
    engine = open_engine(model, name)
    more = [(0, engine.padded_side(side) - side) for side in (10, 14)]

    def softmax(rgb, channels):
        x = np.dstack([rgb.astype(np.float32) / 255.0, channels])
        x = np.pad(x, (*more, (0, 0)), mode="edge").transpose(2, 0, 1)[None].copy()
        with torch.inference_mode():
            z = model(*torch.from_numpy(x).split([3, 7], dim=1))[0, :, :10, :14]
        return F.softmax(z, dim=0).permute(1, 2, 0).numpy()

    for seen in (frame, replace(frame, depth=np.zeros_like(frame.depth))):
        channels = geometry_channels(seen.depth, seen.K, seen.T_base_cam, 0.1)
        assert seen is frame or (channels == 0.5).all()
        expected = softmax(seen.rgb, channels)
        if mirror:
            turned = channels[:, ::-1].copy()
            turned[..., CHANNELS.index("right")] = 1.0 - turned[..., CHANNELS.index("right")]
            expected = 0.5 * (expected + softmax(seen.rgb[:, ::-1], turned)[:, ::-1])
        assert np.abs(engine(seen, mirror) - expected).max() < 1e-5


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("mirror", [False, True])
def test_a_network_that_states_a_pixel_sees_the_canonical_view(name, mirror):
    torch.manual_seed(0)
    model, frame = UNetRGBD().eval(), frame_of_steps()
    p = open_engine(model, name)(frame, mirror)
    model.takes = replace(model.takes, pixel=None)
    as_it_is = open_engine(model, name)
    view = canonical_view(frame, PIXEL)
    z = [view.back(as_it_is.logits(view.frame, each).transpose(1, 2, 0)) for each in (False, True)[: 1 + mirror]]
    np.testing.assert_allclose(p, np.mean([F.softmax(torch.from_numpy(each), -1).numpy() for each in z], 0), atol=1e-5)


def test_networks_of_ones_own_are_evaluated():
    rgb, y = random_image(20, 26), np.random.default_rng(1).choice(np.array([0, 1, 2, 255], np.uint8), (20, 26))
    model = Mine()
    n = evaluate(model, ImagesInMemory([(rgb, y)] * 3, 3, progress=False), 3)
    predicted = open_engine(model)(rgb).argmax(axis=-1)
    expected = [[3 * np.sum((y == i) & (predicted == j)) for j in range(3)] for i in range(3)]
    assert np.abs(n - expected).sum() <= 0.02 * n.sum()  # bfloat16 may turn a pixel whose logits nearly tie


REFUSED = [
    ("arrays: expected", lambda rgb: NetworkInput(arrays=("depth",))),
    ("std: expected", lambda rgb: NetworkInput(std=0.0)),
    ("mean: expected", lambda rgb: NetworkInput(mean=(1.0, 2.0))),
    ("divisor: expected", lambda rgb: NetworkInput(divisor=0)),
    (r"model: expected logits \(N, C, H, W\)", TorchEngine(nn.Flatten())),
    (r"model: expected logits \(N, C, H, W\)", TorchEngine(nn.MaxPool2d(16))),
    ("rgb: expected uint8", lambda rgb: TorchEngine(nn.Flatten())(rgb / 255.0)),
]


@pytest.mark.bad_input
@pytest.mark.parametrize(("says", "call"), REFUSED)
def test_what_no_network_takes_or_gives_is_named(says, call):
    with pytest.raises(ValueError, match=f"^{says}"):
        call(random_image(16, 16))
