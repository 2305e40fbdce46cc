"""Networks as other libraries give them, by stand-ins that need none of these; tests/labkit/learning/test_libraries.py
has the libraries themselves.
"""

from collections import OrderedDict
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import torch
from scenes import random_image
from torch import nn
from torch.nn import functional as F

from data_gen import render, sample_scene
from labkit.labels import TARGET, one_hot
from labkit.learning.engines import export, open_engine
from labkit.learning.foreign import Processor
from labkit.learning.network import TorchEngine, UNet
from labkit.pipeline import Pipeline
from labtrain.training import TrainConfig, train

NAMES = {0: "wall", 1: "floor, flooring", 2: "bottle", 3: "box"}


class Coarse(nn.Module):
    """Four classes' logits at 1 / stride of the size, returned as `kind` says."""

    def __init__(self, stride: int = 1, kind: str = "tensor", classes: int = 4):
        super().__init__()
        torch.manual_seed(3)
        self.kind, self.conv = kind, nn.Conv2d(3, classes, stride, stride)
        self.config = SimpleNamespace(id2label=NAMES, num_labels=4)

    def forward(self, x):
        z = 5.0 * self.conv(x)
        return {
            "tensor": z,
            "out": OrderedDict(out=z, aux=-z),
            "logits": SimpleNamespace(loss=None, logits=z),
            "output": OrderedDict(loss=torch.zeros(()), logits=z),  # Hugging Face's are dicts as well
            "sigmoid": z.sigmoid(),
            "softmax": z.softmax(dim=1),
            "tuple": (z,),
            "queries": OrderedDict(class_queries_logits=z, masks_queries_logits=z),
            "flat": z.mean(dim=(2, 3)),
        }[self.kind]


@pytest.fixture(scope="module")
def frame():
    return render(sample_scene(3, "test"), (64, 48))


def z_of(model, rgb, how=lambda z: z):
    """What the network's convolution gives for a picture, by PyTorch alone, as probabilities (H, W, C)."""
    x = torch.from_numpy(rgb.transpose(2, 0, 1)[None] / np.float32(255.0))
    with torch.no_grad():
        z = how(F.interpolate(5.0 * model.conv(x), rgb.shape[:2], mode="bilinear", align_corners=False))
    return z[0].permute(1, 2, 0).numpy()


def softmax(z):
    return z.softmax(dim=1)


@pytest.mark.parametrize("kind", ["tensor", "out", "logits", "output"])
@pytest.mark.parametrize("stride", [1, 2, 3, 4, 8])
def test_logits_are_found_and_brought_to_the_pictures_size_before_the_softmax(kind, stride):
    rgb, model = random_image(48, 72), Coarse(stride, kind)
    np.testing.assert_allclose(open_engine(model)(rgb), z_of(model, rgb, softmax), atol=1e-5)


def test_the_bilinear_rule_is_that_of_pixel_centres():
    """By hand: a ramp of logits at an eighth of the size is a straight ramp between their middles, 3.5, 11.5, ..."""

    class Ramp(nn.Module):
        def forward(self, x):
            ramp = torch.arange(x.shape[-1] // 8, dtype=torch.float32).expand(1, 1, x.shape[-2] // 8, -1)
            return torch.cat([ramp, -ramp], dim=1)

    z = TorchEngine(Ramp()).logits(random_image(16, 48))
    expected = np.clip((np.arange(48) - 3.5) / 8.0, 0.0, 5.0)
    np.testing.assert_allclose(z, np.broadcast_to([[expected], [-expected]], (2, 16, 48)), atol=1e-6)


@pytest.mark.parametrize("kind", ["logits", "sigmoid"])
@pytest.mark.parametrize("stride", [1, 4])
def test_one_channel_is_the_target_against_the_rest(kind, stride, frame):
    model = Coarse(stride, kind, classes=1)
    model.config = None
    seen = Pipeline(model, crf=False).run(frame)
    x = torch.from_numpy(frame.rgb.transpose(2, 0, 1)[None] / np.float32(255.0))
    with torch.no_grad():
        z = 5.0 * model.conv(x)
        enlarged = F.interpolate(z if kind == "logits" else z.sigmoid(), frame.depth.shape, mode="bilinear")
    target = enlarged.sigmoid() if kind == "logits" else enlarged
    np.testing.assert_allclose(seen.probabilities[..., 1], target[0, 0], atol=1e-5)
    assert seen.target_class == 1 and set(np.unique(seen.labels)) <= {0, 1}
    assert np.array_equal(seen.labels == 1, seen.probabilities[..., 1] > 0.5)


def test_a_softmax_at_the_end_counts_once():
    rgb, model = random_image(16, 24), Coarse(kind="softmax")
    np.testing.assert_allclose(open_engine(model)(rgb), z_of(model, rgb, softmax), atol=1e-5)


def test_of_two_classes_the_second_is_the_target_and_whoever_names_one_is_asked(frame):
    p = Pipeline(lambda rgb: one_hot((frame.labels == TARGET).astype(int), 2)).run(frame)
    q = Pipeline().locate(frame, frame.labels)
    assert p.target_class == 1 and q.target_class == TARGET
    assert [len(cloud) for cloud in p.clouds] == [len(cloud) for cloud in q.clouds]
    with pytest.raises(ValueError, match=r"^target_class: expected one of the 2 "):
        Pipeline(lambda rgb: one_hot((frame.labels == TARGET).astype(int), 2), target_class=2).run(frame)
    assert Pipeline(UNet(num_classes=2)).target_class == 1


def test_a_target_may_be_a_name(frame):
    assert Pipeline(Coarse(), target_class="floor, flooring").run(frame).target_class == 1
    assert Pipeline(Coarse(), target_class="box").target_class == 3
    assert Pipeline(Coarse()).target_class == TARGET


def test_a_network_that_wants_sizes_of_its_encoder_gets_them():
    """As those of segmentation_models_pytorch, which refuse others."""

    class Strict(Coarse):
        requires_divisible_input_shape, encoder = True, SimpleNamespace(output_stride=32)

        def forward(self, x):
            assert x.shape[-2] % 32 == x.shape[-1] % 32 == 0
            return super().forward(x)

    rgb, model = random_image(40, 70), Strict()
    np.testing.assert_allclose(open_engine(model)(rgb), z_of(model, rgb, softmax), atol=1e-5)


@pytest.mark.parametrize("engine", ["onnxruntime", "opencv"])
@pytest.mark.parametrize(("stride", "classes"), [(4, 4), (1, 1), (4, 1)])
def test_exported_they_say_the_same(engine, stride, classes, tmp_path):
    rgb, model = random_image(48, 72), Coarse(stride, "logits", classes)
    export(model, tmp_path / "own.onnx")
    seen = open_engine(tmp_path / "own.onnx", engine)
    assert seen.num_classes == max(2, classes)
    np.testing.assert_allclose(seen(rgb), open_engine(model)(rgb), atol=1e-4)


@pytest.mark.nightly
def test_logits_of_a_quarter_of_the_size_train(tmp_path):
    frames = [render(sample_scene(seed, "test"), (64, 48)) for seed in range(2)]
    config = TrainConfig(steps=2, batch=2, crop=None, epochs=1)
    history = train(frames, frames, config, tmp_path, model=Coarse(4, "logits"), progress=False)
    assert np.isfinite(history[-1]["loss"]) and history[-1]["steps"] == 2


# ---------------------------------------------------------------------------------------------------- processors


class Prepares:
    """What a processor of transformers does: resize, scale, normalise and pad, by OpenCV and NumPy."""

    def __init__(self, size=None, pad=None, centred=False, **more):
        self.size, self.pad, self.centred, self.do_pad = size, pad, centred, pad is not None
        self.mean, self.std = np.array([0.485, 0.456, 0.406]), np.array([0.229, 0.224, 0.225])
        vars(self).update(more)

    def __call__(self, images, return_tensors=None, input_data_format=None, do_pad=None):
        assert return_tensors == "pt" and images.dtype == np.uint8 and input_data_format == "channels_last"
        rgb = images if self.size is None else cv2.resize(images, self.size[::-1])
        x = ((rgb / 255.0 - self.mean) / self.std).astype(np.float32)
        if self.pad and do_pad is not False:
            down, right = (P - n for P, n in zip(self.pad, x.shape[:2], strict=True))
            before = (down // 2, right // 2) if self.centred else (0, 0)
            x = np.pad(x, ((before[0], down - before[0]), (before[1], right - before[1]), (0, 0)))
        return {"pixel_values": torch.from_numpy(x.transpose(2, 0, 1)[None])}


@pytest.mark.parametrize("wrapped", [False, True])
def test_a_processor_prepares_the_picture_and_the_answer_comes_back(wrapped, frame):
    """Against PyTorch: the processor's own pixels, the network, and logits interpolated to the picture's size."""
    model, processor = Coarse(4, "logits"), Prepares((64, 80))
    x = processor(frame.rgb, "pt", "channels_last")["pixel_values"]
    with torch.no_grad():
        z = F.interpolate(model(x).logits, frame.depth.shape, mode="bilinear", align_corners=False)
    given = SimpleNamespace(image_processor=processor) if wrapped else processor
    seen = Pipeline(model, processor=given, crf=False, target_class="bottle").run(frame)
    np.testing.assert_allclose(seen.probabilities, z.softmax(dim=1)[0].permute(1, 2, 0), atol=1e-5)
    assert np.array_equal(seen.labels, z[0].argmax(dim=0)) and seen.target_class == 2


@pytest.mark.parametrize("centred", [False, True])
@pytest.mark.parametrize("size", [None, (36, 48)])
def test_what_a_processor_pads_is_no_part_of_the_picture(centred, size, frame):
    """A network of one pixel each knows nothing of the padding: the answer is that without it."""
    model = Coarse()
    padded = Pipeline(model, processor=Prepares(size, (64, 96), centred), crf=False).run(frame)
    alone = Pipeline(model, processor=Prepares(size), crf=False).run(frame)
    np.testing.assert_allclose(padded.probabilities, alone.probabilities, atol=1e-5)


def test_a_processor_and_the_mirror(frame):
    model = Coarse()
    once, twice = (
        Pipeline(model, processor=Prepares(), crf=False, flip_tta=mirror).perceive(frame)[1] for mirror in (False, True)
    )
    np.testing.assert_allclose(once, twice, atol=1e-5)


class Shifts(Prepares):
    """Pads at the left."""

    def __call__(self, *arguments, do_pad=None, **named):
        x = super().__call__(*arguments, **named)["pixel_values"]
        return {"pixel_values": x if do_pad is False else F.pad(x, (7, 0, 0, 0))}


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("says", "call"),
    [
        (r"model: expected logits .* or a half to an eighth of it, got \(1, 4, 3, 4\)", lambda f: Pipeline(Coarse(16))),
        (r"model: expected logits .* or as \.logits, got tuple", lambda f: Pipeline(Coarse(kind="tuple"))),
        (r"model: expected logits .*, got \(1, 4\)", lambda f: Pipeline(Coarse(kind="flat"))),
        ("model: .* got one with class_queries_logits, masks_q", lambda f: Pipeline(Coarse(kind="queries"))),
        (
            "target_class: expected a name of .*id2label, such as 'bottle'",
            lambda f: Pipeline(Coarse(), target_class="bottel"),
        ),
        (
            "target_class: expected a number, got 'box', and .* no config",
            lambda f: Pipeline(UNet(), target_class="box"),
        ),
        ("target_class: expected a number, got 'box'", lambda f: Pipeline(target_class="box")),
        ("processor: expected a model beside it", lambda f: Pipeline(processor=Prepares())),
        ("processor: expected a PyTorch network", lambda f: Pipeline(np.asarray, processor=Prepares())),
        ("processor: expected .*engine", lambda f: Pipeline(Coarse(), processor=Prepares(), engine="opencv")),
        ("processor: expected an image processor", lambda f: Pipeline(Coarse(), processor="nvidia/segformer")),
        ("processor: expected one that keeps", lambda f: Pipeline(Coarse(), processor=Prepares(do_center_crop=True))),
        ("processor: expected one that pads", lambda f: Pipeline(Coarse(), processor=Shifts(do_pad=True))),
    ],
)
def test_what_cannot_be_followed_is_named(says, call, frame):
    with pytest.raises(ValueError, match=f"^{says}"):
        call(frame).run(frame)


def test_a_processors_own_padding_of_none_is_left_alone():
    """A picture that needs none is asked for once more, and is where it was."""
    processor, rgb = Processor(Prepares(pad=(16, 24))), random_image(16, 24)
    z = torch.rand(1, 2, 16, 24)
    assert torch.equal(processor.back(z, rgb, processor.pixels(rgb)), z)
