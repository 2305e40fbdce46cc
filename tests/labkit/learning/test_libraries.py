"""Networks of other libraries as they come, of random weights, against these libraries' own post-processing.

It runs in the environment of `make test-models`; in any other these libraries are missing, and it skips.
"""

import cv2
import numpy as np
import pytest
import torch
from test_library_page import BLOCKS
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


# ------------------------------------------------------------------------------------- masks of a foundation model


@pytest.fixture(scope="module")
def page():
    """What docs/library.md defines in its section on such masks."""
    names: dict = {}
    exec(compile(BLOCKS["Masks of a foundation model"], "library.md", "exec"), names)
    return names


@pytest.fixture(scope="module")
def sam():
    """A tiny SAM of random weights that takes pictures of 64 pixels, and its processor."""
    torch.manual_seed(1)
    vision = {"hidden_size": 16, "num_hidden_layers": 2, "num_attention_heads": 2, "intermediate_size": 32}
    vision |= {
        "image_size": 64,
        "patch_size": 8,
        "output_channels": 16,
        "window_size": 0,
        "global_attn_indexes": [0, 1],
    }
    vision |= {"mlp_dim": 32, "num_pos_feats": 8}
    prompt = {"hidden_size": 16, "image_size": 64, "patch_size": 8, "mask_input_channels": 4}
    decoder = {
        "hidden_size": 16,
        "mlp_dim": 32,
        "num_hidden_layers": 2,
        "num_attention_heads": 2,
        "iou_head_hidden_dim": 16,
    }
    config = transformers.SamConfig(vision_config=vision, prompt_encoder_config=prompt, mask_decoder_config=decoder)
    images = transformers.SamImageProcessor(size={"longest_edge": 64}, pad_size={"height": 64, "width": 64})
    return transformers.SamModel(config).eval(), transformers.SamProcessor(images)


def test_sams_mask_at_a_point_is_the_thing_there(page, sam, frame):
    """Against its low-resolution logits, brought to the picture by hand: 160 x 120 is 64 x 48 in a square of 64."""
    model, processor = sam
    (mask,) = page["pointed"](model, processor, 80, 60)(frame.rgb)
    given = processor(frame.rgb, input_points=[[[[80, 60]]]], return_tensors="pt")
    with torch.no_grad():
        said = model(**given)
    z = said.pred_masks[0, :, said.iou_scores[0, 0].argmax()][None]
    z = F.interpolate(z, (64, 64), mode="bilinear")[..., :48, :]
    expected = F.interpolate(z, (120, 160), mode="bilinear")[0, 0].numpy() > 0.0
    assert mask.shape == (120, 160) and 0 < mask.sum() < mask.size and np.array_equal(mask, expected)
    find = page["finder"](page["pointed"](model, processor, 80, 60), over=-1.0)
    assert np.array_equal(find(frame) > 0, mask)
    v, u = (int(x[len(x) // 2]) for x in np.nonzero(mask & (frame.depth > 0)))
    seen = Pipeline(find_objects=find).run(frame, at=(u, v))
    assert len(seen.clouds) <= 1 and np.array_equal(seen.labels == 2, mask)


def test_any_mask_generator_gives_objects(page, sam, frame):
    """The generator of transformers with every mask let through: numbers cover what the masks do, wholes over parts."""
    from PIL import Image

    model, processor = sam
    every = {"pred_iou_thresh": -1e9, "stability_score_thresh": -1.0, "points_per_crop": 4, "crops_nms_thresh": 0.9}
    generate = transformers.pipeline("mask-generation", model=model, image_processor=processor.image_processor)

    def masks(rgb):
        return generate(Image.fromarray(rgb), **every)["masks"]

    given = [np.asarray(mask, bool) for mask in masks(frame.rgb)]
    numbers = page["finder"](masks, over=-1.0, least=1)(frame)
    assert len(given) > 1 and np.array_equal(numbers > 0, np.any(given, axis=0))
    largest = max(given, key=np.sum)
    assert len(np.unique(numbers[largest])) == 1, "the largest lies on the others"
    assert Pipeline(find_objects=page["finder"](masks, over=-1.0)).run(frame).probabilities is None
