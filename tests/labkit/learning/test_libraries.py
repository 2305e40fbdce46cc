"""Networks of other libraries as they come, of random weights, against these libraries' own post-processing.

It runs in the environment of `make test-models`; in any other these libraries are missing, and it skips.
"""

import cv2
import numpy as np
import pytest
import torch
from torch.nn import functional as F

from data_gen import render, sample_scene
from labkit.learning.inference import NetworkInput
from labkit.pipeline import Pipeline

transformers = pytest.importorskip("transformers", reason="needs `make test-models`")
smp = pytest.importorskip("segmentation_models_pytorch", reason="needs `make test-models`")
segmentation = pytest.importorskip("torchvision.models.segmentation", reason="needs `make test-models`")
pytestmark = pytest.mark.nightly
NAMES = {0: "wall", 1: "table", 2: "bottle", 3: "box", 4: "sky"}
TINY = {"num_labels": 5, "id2label": NAMES}
BEIT = {"hidden_size": 32, "num_hidden_layers": 4, "num_attention_heads": 2, "intermediate_size": 37, "patch_size": 16}
BEIT |= {"out_indices": [0, 1, 2, 3], "image_size": 96, "pool_scales": [1, 2], "use_relative_position_bias": True}
HUGGING_FACE = {  # configuration, processor's settings
    "Segformer": ({"depths": [1] * 4, "hidden_sizes": [8, 16, 24, 32], "decoder_hidden_size": 16}, {"size": (96, 128)}),
    "Beit": (BEIT, {"size": (96, 96), "do_center_crop": False}),
    "DPT": (
        {"hidden_size": 32, "num_hidden_layers": 4, "num_attention_heads": 2, "image_size": 96, "patch_size": 16}
        | {"backbone_out_indices": [0, 1, 2, 3], "neck_hidden_sizes": [8, 8, 16, 16], "fusion_hidden_size": 16},
        {"size": (96, 96)},
    ),
    "MobileViT": (
        {"hidden_sizes": [12, 16, 20], "neck_hidden_sizes": [8, 8, 16, 16, 20, 20, 32], "image_size": 64},
        {"size": (96, 128), "do_center_crop": False},
    ),
    "MobileNetV2": ({"depth_multiplier": 0.25}, {"size": (96, 128), "do_center_crop": False}),
}


@pytest.fixture(scope="module")
def frame():
    return render(sample_scene(3, "test"), (160, 120))


@pytest.fixture(autouse=True)
def seeded():
    torch.manual_seed(0)


def standardised(model, arguments, output):
    """Random weights prefer one class everywhere: here each class has logits of mean 0 and deviation 1."""
    z = output.logits.double()
    output.logits = ((z - z.mean((2, 3), keepdim=True)) / z.std((2, 3), keepdim=True)).float()
    return output


def hugging_face(name: str, **more):
    """A tiny network of random weights and its processor."""
    config, settings = HUGGING_FACE[name]
    network = getattr(transformers, f"{name}ForSemanticSegmentation")
    model = network(getattr(transformers, f"{name}Config")(**TINY, **config)).eval()
    for weight in model.parameters():  # those of a beginning are too small for deep networks to see anything
        if weight.ndim > 1:
            torch.nn.init.kaiming_normal_(weight)
    model.register_forward_hook(standardised)
    size = dict(zip(("height", "width"), settings["size"], strict=True))
    processor = getattr(transformers, f"{name}ImageProcessor")(**{**settings, "size": size, **more})
    return model, processor


@pytest.mark.parametrize("name", HUGGING_FACE)
def test_a_model_and_its_processor_label_as_their_own_post_processing_does(name, frame):
    model, processor = hugging_face(name)
    with torch.no_grad():
        outputs = model(**processor(images=frame.rgb, return_tensors="pt"))
    (expected,) = processor.post_process_semantic_segmentation(outputs, target_sizes=[frame.depth.shape])
    seen = Pipeline(model, processor=processor, crf=False, target_class="bottle").run(frame)
    equal = np.mean(seen.labels == expected.numpy())
    size, classes = tuple(outputs.logits.shape[-2:]), len(np.unique(seen.labels))
    print(f"{name}: logits of {size}, {classes} classes seen, labels equal at {equal:.4%} of the pixels")
    assert equal > 0.9999 and classes > 3 and seen.target_class == 2 and seen.probabilities.shape == (120, 160, 5)


def test_a_processor_that_pads_in_the_middle(frame):
    """DPT's own post-processing stretches the padding, too: the judge is its network's logits, cut by hand."""
    model, processor = hugging_face("DPT", do_resize=False, do_pad=True, size_divisor=96)
    pixels = processor(images=frame.rgb, return_tensors="pt")["pixel_values"]
    assert pixels.shape[-2:] == (192, 192)
    with torch.no_grad():
        z = F.interpolate(model(pixels).logits, (192, 192), mode="bilinear")[..., 36:156, 16:176]
    seen = Pipeline(model, processor=processor, crf=False).run(frame)
    np.testing.assert_allclose(seen.probabilities, z.softmax(1)[0].permute(1, 2, 0), atol=1e-5)


def test_a_model_without_its_processor_takes_what_it_states(frame):
    model, _ = hugging_face("Segformer")
    x = torch.from_numpy(frame.rgb.transpose(2, 0, 1)[None] / np.float32(255.0))
    with torch.no_grad():
        z = F.interpolate(model(x).logits, frame.depth.shape, mode="bilinear")
    seen = Pipeline(model, crf=False).run(frame)
    np.testing.assert_allclose(seen.probabilities, z.softmax(1)[0].permute(1, 2, 0), atol=1e-5)


@pytest.mark.parametrize("name", ["lraspp_mobilenet_v3_large", "deeplabv3_mobilenet_v3_large", "fcn_resnet50"])
def test_networks_of_torchvision(name, frame):
    model = getattr(segmentation, name)(weights=None, weights_backbone=None, num_classes=5).eval()
    mean, std = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)
    model.takes = NetworkInput(mean=tuple(255 * m for m in mean), std=tuple(255 * s for s in std))
    from torchvision.transforms._presets import SemanticSegmentation

    prepare = SemanticSegmentation(resize_size=None, mean=mean, std=std)
    with torch.no_grad():
        p = model(prepare(torch.from_numpy(frame.rgb.transpose(2, 0, 1)))[None])["out"].softmax(dim=1)
    seen = Pipeline(model, crf=False).run(frame)
    np.testing.assert_allclose(seen.probabilities, p[0].permute(1, 2, 0), atol=1e-5)


@pytest.mark.parametrize("kind", ["Unet", "FPN", "DeepLabV3Plus", "Segformer", "UPerNet"])
@pytest.mark.parametrize(("classes", "activation"), [(1, None), (1, "sigmoid"), (4, None), (4, "softmax2d")])
def test_networks_of_segmentation_models_pytorch(kind, classes, activation, frame):
    """120 rows are no multiple of 32: the border is repeated, as its own message asks for."""
    model = getattr(smp, kind)("resnet18", encoder_weights=None, classes=classes, activation=activation).eval()
    down = -120 % model.encoder.output_stride if model.requires_divisible_input_shape else 0
    rgb = cv2.copyMakeBorder(frame.rgb, 0, down, 0, 0, cv2.BORDER_REPLICATE)
    with torch.no_grad():
        z = model(torch.from_numpy(rgb.transpose(2, 0, 1)[None] / np.float32(255.0)))[..., :120, :]
    if activation is None:
        z = torch.sigmoid(z) if classes == 1 else torch.softmax(z, dim=1)
    p = torch.cat([1.0 - z, z], dim=1) if classes == 1 else z
    seen = Pipeline(model, crf=False).run(frame)
    np.testing.assert_allclose(seen.probabilities, p[0].permute(1, 2, 0), atol=1e-5)
    assert seen.target_class == (1 if classes == 1 else 2)
