"""lessons/errata.md, entry by entry: each test shows one published mistake, and that the kit does it right.

The few lines of a listing that matter are written out again here, in NumPy or PyTorch, as the listing computes them.
"""

import pickle
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from labcourse.stacks.small_fcn import SmallFCN
from labkit.crf import PottsCRF, solve
from labkit.geometry import back_projection_jacobian, masked_cloud_to_base
from labkit.labels import TARGET
from labkit.learning.network import SmallSegNet, load_model
from labkit.losses import segmentation_loss, softmax, weighted_optimum
from labkit.metrics import confusion_matrix, iou, mean_iou
from labkit.pipeline import segment_rgb_image

PAGE = (Path(__file__).parents[2] / "lessons" / "errata.md").read_text()


def test_every_entry_names_its_test_and_every_test_has_an_entry():
    named = re.findall(r"`(test_\w+)`", PAGE)
    written = [name for name in globals() if name.startswith("test_") and "entry" not in name]
    assert sorted(named) == sorted(written)
    assert len(re.findall(r"^## \d+\. ", PAGE, re.MULTILINE)) == len(named)


def test_masks_count_classes_from_zero():
    """The text's classes are 1 to C, its code's are 0 to C - 1."""
    model = SmallSegNet(num_classes=2)
    with torch.no_grad():
        model.logits.weight.zero_()
        model.logits.bias.copy_(torch.tensor([1.0, 0.0]))
    assert np.unique(segment_rgb_image(model, np.zeros((8, 8, 3), np.uint8))).tolist() == [0]


def test_each_pair_of_neighbours_counts_once():
    crf = PottsCRF.from_image(np.zeros((1, 2, 2)), np.zeros((1, 2)), lam=3.0, sigma_I=1.0, sigma_p=1e6)
    once = crf.energy(np.array([[0, 1]]))
    both_ends = sum(3.0 for p, q in ((0, 1), (1, 0)) if p != q)
    assert once == pytest.approx(3.0) and both_ends == pytest.approx(2 * once)


def test_sigma_p_only_rescales_lam_on_four_neighbours():
    image = np.random.default_rng(0).uniform(size=(5, 6))
    unary = np.random.default_rng(1).uniform(size=(5, 6, 3))
    y = np.random.default_rng(2).integers(0, 3, (5, 6))
    near = PottsCRF.from_image(unary, image, lam=2.0, sigma_I=0.3, sigma_p=0.8)
    far = PottsCRF.from_image(unary, image, lam=2.0 * np.exp(-1 / (2 * 0.8**2)), sigma_I=0.3, sigma_p=1e6)
    assert near.energy(y) == pytest.approx(far.energy(y), rel=1e-6)


def test_graph_cuts_are_not_exact_for_three_classes():
    """Expansion, each of whose moves is one exact cut, ends above the minimum that enumeration finds."""
    above = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        unary = rng.uniform(0, 2, (3, 3, 3))
        crf = PottsCRF.from_image(unary, np.zeros((3, 3)), lam=1.0, sigma_I=1.0, sigma_p=1.0)
        start = unary.argmin(axis=2)
        best, found = solve(crf, "brute_force").energy, solve(crf, "expansion", labels=start).energy
        assert found >= best - 1e-6
        above += found > best + 1e-3
    assert above > 0


def test_mean_iou_leaves_absent_classes_out():
    n = confusion_matrix(np.array([0, 0, 1]), np.array([0, 1, 1]), num_classes=3)
    with np.errstate(invalid="ignore"):
        as_written = np.mean(n.diagonal() / (n.sum(axis=0) + n.sum(axis=1) - n.diagonal()))
    assert np.isnan(as_written)
    assert np.isnan(iou(n)[2]) and mean_iou(n) == pytest.approx(0.5)


def test_the_weighted_mean_divides_by_the_sum_of_weights():
    rng = np.random.default_rng(0)
    z = torch.tensor(rng.normal(size=(1, 3, 4, 5)))
    y = torch.tensor(rng.integers(0, 3, (1, 4, 5)))
    w = torch.tensor([0.2, 1.0, 5.0], dtype=torch.float64)
    text = -(w[y] * z.log_softmax(dim=1).gather(1, y[:, None])[:, 0]).sum()
    listing = torch.nn.CrossEntropyLoss(weight=w)(z, y)
    assert listing == pytest.approx(float(text / w[y].sum())) and listing != pytest.approx(float(text))
    kit = segmentation_loss(z, y, w)
    assert float(kit) == pytest.approx(float(text) / y.numel(), rel=1e-6)


def test_small_segnet_needs_sides_divisible_by_four():
    net = SmallSegNet()
    x = net.conv3(net.pool(net.conv2(net.pool(net.conv1(torch.zeros(1, 3, 10, 15))))))  # ReLU leaves sizes alone
    listing = net.logits(net.up2(net.up1(x)))
    assert tuple(listing.shape[2:]) == (8, 12)
    with pytest.raises(ValueError, match="divisible by 4"):
        net(torch.zeros(1, 3, 10, 15))
    assert segment_rgb_image(SmallSegNet(), np.zeros((10, 15, 3), np.uint8)).shape == (10, 15)


def test_channels_are_swapped_even_for_rgb():
    class Reddest(torch.nn.Module):
        """Class 1 where there is more red than blue."""

        def __init__(self):
            super().__init__()
            self.anchor = torch.nn.Parameter(torch.zeros(1))

        def forward(self, x):
            return torch.stack([x[:, 2], x[:, 0]], dim=1)

    red = np.zeros((4, 4, 3), np.uint8)
    red[..., 0] = 255
    listing = Reddest()(torch.from_numpy(cv2.cvtColor(red, cv2.COLOR_BGR2RGB).transpose(2, 0, 1))[None]).argmax(1)
    assert (listing == 0).all()
    assert (segment_rgb_image(Reddest(), red, order="rgb") == 1).all()
    assert (segment_rgb_image(Reddest(), red[..., ::-1].copy(), order="bgr") == 1).all()


def test_pixels_without_depth_become_no_points():
    mask = np.full((2, 2), TARGET)
    depth = np.array([[1.0, 0.0], [np.nan, 2.0]], np.float32)
    K, T = np.diag([2.0, 2.0, 1.0]), np.eye(4)
    T[:3, 3] = 0.1, 0.2, 0.3
    v, u = np.where(mask == TARGET)
    listing = (np.linalg.inv(K) @ np.stack([u, v, np.ones(4)]) * depth[v, u]).T + T[:3, 3]
    assert (listing == T[:3, 3]).all(axis=1).any() and np.isnan(listing).any()
    assert len(masked_cloud_to_base(mask, depth, K, T, TARGET)) == 2


def test_the_cloud_has_one_dtype():
    mask, depth = np.zeros((2, 2), np.uint8), np.ones((2, 2), np.float32)
    listing_empty, listing_full = np.zeros((0, 3), np.float32), np.linalg.inv(np.eye(3)) @ np.ones((3, 4), np.float32)
    assert listing_empty.dtype != listing_full.dtype
    empty, full = (masked_cloud_to_base(mask, depth, np.eye(3), np.eye(4), c) for c in (TARGET, 0))
    assert empty.shape == (0, 3) and full.shape == (4, 3) and empty.dtype == full.dtype


def test_loading_weights_runs_no_code(tmp_path):
    class Mischief:
        def __reduce__(self):
            return (Path.touch, (tmp_path / "ran",))

    path = tmp_path / "weights.pt"
    torch.save({"state_dict": Mischief()}, path)
    with pytest.raises(ValueError, match="weights"):
        load_model(path)
    assert not (tmp_path / "ran").exists()
    torch.load(path, weights_only=False)  # what the listing did with every PyTorch before 2.6
    assert (tmp_path / "ran").exists()
    with pytest.raises(pickle.UnpicklingError):
        torch.load(path, weights_only=True)


def test_the_ros_node_uses_depth_intrinsics_transform_and_class():
    """The listing's camera is K = I: every point of a 640x480 cloud lies on rays hundreds of metres to the side."""
    u, v, d = 320.0, 240.0, 0.8
    listing = np.linalg.inv(np.eye(3)) @ [u, v, 1.0] * d
    K = np.array([[600.0, 0.0, 319.5], [0.0, 600.0, 239.5], [0.0, 0.0, 1.0]])
    mask, depth = np.zeros((480, 640), np.uint8), np.zeros((480, 640), np.float32)
    mask[240, 320], depth[240, 320] = TARGET, d
    (point,) = masked_cloud_to_base(mask, depth, K, np.eye(4), TARGET)
    assert np.linalg.norm(listing[:2]) > 300 and np.linalg.norm(point[:2]) < 0.001


def test_the_blob_is_nchw():
    scores = np.random.default_rng(0).normal(size=(1, 3, 4, 5)).astype(np.float32)
    C, H, W = scores.shape[1:]
    flat = scores.ravel()
    listing = np.array(
        [[np.argmax(flat[y * W * C + x * C : y * W * C + x * C + C]) for x in range(W)] for y in range(H)]
    )
    plane = H * W
    right = np.array([[np.argmax(flat[y * W + x :: plane]) for x in range(W)] for y in range(H)])
    assert (right == scores[0].argmax(axis=0)).all() and (listing != right).mean() > 0.3


def test_a_column_of_depths_must_be_transposed():
    """`d_vec.;` does not parse; without the transpose it stands for, 3xN times Nx1 does not fit."""
    rays, d_vec = np.ones((3, 7)), np.arange(7.0)[:, None]
    with pytest.raises(ValueError, match="broadcast"):
        rays * d_vec
    assert (rays * d_vec.T)[2].tolist() == d_vec[:, 0].tolist()
    assert (rays[:, :3] * d_vec[:3])[2].tolist() == [2, 2, 2]  # three pixels: no error, and rows are scaled


def test_png_holds_no_single_precision_metres(tmp_path):
    depth = np.array([[0.4567, 1.2345]], np.float32)
    path = str(tmp_path / "depth.png")
    assert cv2.imwrite(path, depth)
    assert not np.allclose(cv2.imread(path, cv2.IMREAD_UNCHANGED), depth, atol=0.1)
    cv2.imwrite(path, np.rint(depth / 0.0001).astype(np.uint16))
    assert np.allclose(cv2.imread(path, cv2.IMREAD_UNCHANGED) * 0.0001, depth, atol=0.00006)


def test_the_small_fcn_labels_every_pixel():
    scores = SmallFCN()(torch.zeros(1, 3, 6, 8))
    assert tuple(scores.shape) == (1, 4, 6, 8)
    assert scores.flatten().argmax().numel() == 1  # what a class decoder gives: one class for the image
    assert scores.argmax(dim=1).shape == (1, 6, 8)


def test_components_of_a_coloured_segmentation_merge():
    from scipy import ndimage

    regions = np.repeat(np.arange(1, 5), 3)[None].repeat(5, axis=0)
    coloured = np.array([[0, 0, 0], [230, 97, 0], [0, 158, 115], [86, 180, 233], [200, 200, 0]], np.uint8)[regions]
    _, as_written = ndimage.label(coloured.any(axis=-1))
    right = sum(ndimage.label(regions == k)[1] for k in np.unique(regions))
    assert as_written == 1 and right == 4


def test_depth_error_runs_along_the_ray_at_every_pixel():
    K = np.array([[500.0, 0.0, 319.5], [0.0, 510.0, 239.5], [0.0, 0.0, 1.0]])
    for u, v in ((319.5, 239.5), (10.0, 20.0), (639.0, 0.0)):
        P = np.linalg.inv(K) @ [u, v, 1.0] * 0.9
        along = back_projection_jacobian(u, v, 0.9, K)[:, 2]
        assert np.allclose(np.cross(P, along), 0.0, atol=1e-12)
        assert along[2] == pytest.approx(1.0)


def test_weights_move_the_optimum_and_not_only_the_speed():
    p, w = np.array([0.9, 0.1]), np.array([1.0, 9.0])
    z = np.zeros(2)
    for _ in range(20_000):  # gradient descent on the expected weighted loss of one logit vector
        q = softmax(z)
        z -= 0.05 * sum(p[c] * w[c] * (q - np.eye(2)[c]) for c in range(2))
    assert softmax(z) == pytest.approx(weighted_optimum(p, w), abs=1e-6)
    assert abs(softmax(z)[1] - p[1]) > 0.3


def test_the_centroid_of_what_is_seen_is_not_the_objects():
    """A sphere seen from above: the mean of its visible points lies two thirds of the radius above its middle."""
    radius = 0.04
    x, y = np.meshgrid(*[np.linspace(-radius, radius, 801)] * 2)
    inside = x**2 + y**2 < radius**2
    seen = np.sqrt(radius**2 - x[inside] ** 2 - y[inside] ** 2)
    assert seen.mean() == pytest.approx(2 / 3 * radius, rel=1e-3)
