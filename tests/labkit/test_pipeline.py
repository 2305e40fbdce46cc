"""The chain from frame to grasps, judged by the simulator's own poses."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from scenes import box, scene
from torch import nn

from labkit.frame import RGBDFrame
from labkit.grasp import GraspPlan, Gripper
from labkit.labels import IGNORE, OBSTACLE, SURFACE, TARGET, one_hot
from labkit.learning.engines import labels_of_scores, open_engine
from labkit.learning.network import SmallSegNet, UNetRGBD
from labkit.pipeline import (
    Pipeline,
    most_probable,
    refine_labels,
    segment_rgb_image,
)
from labkit.sim.world import World
from labkit.targets import WORKSPACE


@pytest.fixture(scope="module")
def seen():
    """Two targets and an obstacle, seen from the front: the frame, and the true middles of the targets."""
    spec = scene(box("left", 0.5, 0.08), box("right", 0.5, -0.08), box("post", 0.62, 0.0, (0.04, 0.04, 0.09), OBSTACLE))
    with World(spec) as world:
        return world.render(), {name: world.centre(name) for name in ("left", "right")}


@pytest.fixture(scope="module")
def frame(seen):
    return seen[0]


def test_two_targets_are_two_clouds_where_the_objects_are_and_the_best_grasp_closes_square_on_one(seen):
    frame, middles = seen
    p = Pipeline().locate(frame, frame.labels)
    assert len(p.clouds) == 2 and np.array_equal(p.labels, frame.labels)
    for middle in middles.values():
        distances = [np.linalg.norm(cloud.mean(axis=0) - middle) for cloud in p.clouds]
        assert min(distances) < 0.03, "the visible side's centroid is within half a block of the block's"
    assert len(p.clouds[0]) + len(p.clouds[1]) <= np.count_nonzero(frame.labels == TARGET)
    grasp = p.plan.grasps[0]
    position = grasp.T_base_grasp[:3, 3]
    assert min(np.linalg.norm(position[:2] - middle[:2]) for middle in middles.values()) < 0.02
    closing = np.abs(grasp.T_base_grasp[:3, 1])
    assert max(closing[:2]) > 0.99, "the blocks stand square to the base frame"
    assert [0.04, 0.06][int(closing.argmax())] < grasp.width <= 0.08, "open wider than the block is there"


def test_a_network_or_a_function_of_the_image_may_be_the_model(frame):
    network = SmallSegNet().eval()
    with torch.no_grad():
        x = torch.from_numpy(frame.rgb).permute(2, 0, 1)[None] / 255.0
        expected = network(x)[0].argmax(dim=0).numpy()
    p = Pipeline(network, flip_tta=False, crf=False).run(frame)
    assert np.mean(p.labels != expected) < 1e-3
    assert np.allclose(p.probabilities.sum(axis=-1), 1.0, atol=1e-5)
    q = Pipeline(lambda rgb: open_engine(network)(rgb)).run(frame)
    assert np.array_equal(p.labels, q.labels)


def test_a_network_with_canonical_views_looks_into_the_mirror_as_well(frame):
    torch.manual_seed(0)
    network = UNetRGBD().eval()
    once, twice = (open_engine(network)(frame, mirror) for mirror in (False, True))
    assert not np.array_equal(once, twice)
    for asked, expected in ((None, twice), (True, twice), (False, once)):
        assert np.array_equal(Pipeline(network, flip_tta=asked).perceive(frame)[1], expected)
    network.takes = dataclasses.replace(network.takes, pixel=None)  # its time grows with the picture
    assert np.array_equal(Pipeline(network).perceive(frame)[1], open_engine(network)(frame))


def test_ones_own_functions_take_the_stages_places(frame):
    calls = []

    def back_project(depth, K, T_base_cam):
        calls.append("back_project")
        v, u = np.indices(depth.shape)
        P = depth[..., None] * (np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(K).T)
        return P @ T_base_cam[:3, :3].T + T_base_cam[:3, 3]

    def split(P):
        calls.append("split")
        return [np.flatnonzero(P[:, 1] > 0.0), np.flatnonzero(P[:, 1] <= 0.0)]

    def grasp(clouds, scene, table_z, camera_position):
        calls.append("grasp")
        return GraspPlan((), f"{len(clouds)} clouds at {table_z}")

    p = Pipeline(table_z=0.0, back_project=back_project, split=split, grasp=grasp).locate(frame, frame.labels)
    assert calls == ["back_project", "split", "grasp"] and p.plan.reason == "2 clouds at 0.0"
    kit = Pipeline().locate(frame, frame.labels)
    assert np.nanmax(np.abs(p.points - kit.points)) < 1e-5


def test_no_target_and_no_depth_are_no_grasp_with_a_reason(frame):
    p = Pipeline().locate(frame, np.full(frame.labels.shape, SURFACE))
    assert p.clouds == [] and p.plan.grasps == ()
    assert repr(p) == "Perception(320 x 240, clouds of no points, no grasp: no target points)"
    depth = np.where(frame.labels == TARGET, 0.0, frame.depth).astype(np.float32)
    depth[:100] = np.nan
    p = Pipeline().locate(dataclasses.replace(frame, depth=depth), frame.labels)
    assert p.clouds == [] and np.isnan(p.points[:100]).all()
    assert np.isfinite(p.scene).all()
    tiny = RGBDFrame(np.zeros((1, 1, 3), np.uint8), np.ones((1, 1), np.float32), np.diag([9.0, 9.0, 1.0]), np.eye(4))
    assert Pipeline(SmallSegNet().eval()).run(tiny).labels.shape == (1, 1)


def test_run_is_perceive_and_then_locate(frame):
    network = SmallSegNet().eval()
    plain, probabilities = Pipeline(network, crf=False).perceive(frame)
    assert np.array_equal(plain, probabilities.argmax(axis=-1))
    pipeline = Pipeline(network)
    labels, _ = pipeline.perceive(frame)
    assert np.array_equal(labels, refine_labels(probabilities, frame)), "a network's labels are refined"
    p, q = pipeline.run(frame), pipeline.locate(frame, labels, probabilities)
    assert np.array_equal(p.labels, labels) and np.array_equal(p.probabilities, probabilities)
    assert p.certainty == q.certainty and p.plan.reason == q.plan.reason
    assert [g.score for g in p.plan.grasps] == [g.score for g in q.plan.grasps]
    ties = np.random.default_rng(0).integers(0, 3, (7, 5, 4)) / 2.0
    assert np.array_equal(most_probable(ties), ties.argmax(axis=-1))
    unknown = np.where(frame.labels == OBSTACLE, IGNORE, frame.labels)
    assert np.array_equal(Pipeline().locate(frame, unknown).labels, unknown)


def test_clouds_carry_their_pixels_and_the_certainty_of_these(frame):
    p_target = np.random.default_rng(0).uniform(0.5, 1.0, frame.labels.shape)
    probabilities = np.stack([0 * p_target, 1.0 - p_target, p_target, 0 * p_target], axis=-1)
    p = Pipeline().locate(frame, frame.labels, probabilities)
    assert len(p.pixels) == 2
    for pixels, cloud, certainty in zip(p.pixels, p.clouds, p.certainty, strict=True):
        v, u = np.divmod(pixels, frame.size[0])
        assert (frame.labels[v, u] == TARGET).all() and np.array_equal(p.points[v, u], cloud)
        assert certainty == pytest.approx(p_target[v, u].mean())
    assert Pipeline().locate(frame, frame.labels).certainty == (1.0, 1.0)


def test_a_thing_at_a_pixel_has_the_cloud_that_it_has_as_a_target(frame):
    """Of a network of classes: the target is cleaned once, and as sure as that it is target or obstacle."""
    few = np.random.default_rng(0).random(frame.depth.shape) < 0.3  # a second cleaning would take some of what is left
    frame = dataclasses.replace(frame, depth=np.where(few, frame.depth, 0.0).astype(np.float32))
    probabilities = np.full((*frame.labels.shape, 4), 0.1)
    np.put_along_axis(probabilities, np.minimum(frame.labels, 3)[..., None].astype(int), 0.7, axis=-1)
    pipeline = Pipeline(lambda rgb: probabilities, crf=False)
    whole = pipeline.run(frame)
    assert len(whole.clouds) == 2 and whole.certainty == (pytest.approx(0.7),) * 2
    for pixels, cloud in zip(whole.pixels, whole.clouds, strict=True):
        v, u = divmod(int(pixels[len(pixels) // 2]), frame.size[0])
        p = pipeline.run(frame, at=(u, v))
        assert np.array_equal(p.clouds[0], cloud) and len(p.clouds) == 1
        assert p.certainty == (pytest.approx(0.8),)
    two = np.stack([0.4 + 0.0 * frame.depth, 0.6 + 0.0 * frame.depth], axis=-1)  # a network of two classes
    there = Pipeline(target_class=1).locate(frame, (frame.labels == TARGET).astype(np.uint8), two, at=(u, v))
    assert there.certainty == (pytest.approx(0.6),)
    numbered = Pipeline().locate(frame, frame.labels, probabilities, (frame.labels == TARGET).astype(int))
    assert numbered.certainty == (pytest.approx(0.7),)


def moved(frame, x):
    T = frame.T_base_cam.copy()
    T[0, 3] += x
    return dataclasses.replace(frame, T_base_cam=T)


def test_nothing_is_grasped_where_nothing_is_known_to_be_free(frame):
    away = moved(frame, 1.2)
    refused = Pipeline().locate(away, away.labels)
    assert refused.plan.grasps == () and "workspace" in refused.plan.reason
    there = ((1.35, 2.2), *WORKSPACE[1:])
    p, q = Pipeline(workspace=there).locate(away, away.labels), Pipeline().locate(frame, frame.labels)
    assert len(p.plan.grasps) == len(q.plan.grasps) > 0
    assert p.plan.grasps[0].T_base_grasp[0, 3] - 1.2 == pytest.approx(q.plan.grasps[0].T_base_grasp[0, 3], abs=0.01)


def test_a_target_outside_the_workspace_is_none(frame):
    right_half = Pipeline(workspace=(WORKSPACE[0], (-0.7, 0.0), WORKSPACE[2])).locate(frame, frame.labels)
    assert len(right_half.clouds) == 1 and right_half.clouds[0][:, 1].max() < 0.0


@pytest.mark.parametrize(("classes", "target"), [(21, 5), (2, 1)])
def test_the_number_of_classes_and_the_target_are_the_callers(classes, target, frame):
    labels = np.where(frame.labels == TARGET, target, 0)
    p = Pipeline(lambda rgb: one_hot(labels, classes), target_class=target).run(frame)
    q = Pipeline().locate(frame, frame.labels)
    assert p.probabilities.shape[-1] == classes
    assert [len(cloud) for cloud in p.clouds] == [len(cloud) for cloud in q.clouds]
    assert p.plan.grasps[0].score == q.plan.grasps[0].score


def test_the_gripper_reaches_the_planner(frame):
    narrow = Pipeline(gripper=Gripper(max_opening=0.03)).locate(frame, frame.labels).plan
    assert max((grasp.width for grasp in narrow.grasps), default=0.0) <= 0.03
    assert max(grasp.width for grasp in Pipeline().locate(frame, frame.labels).plan.grasps) > 0.04


@pytest.mark.parametrize(("given", "of_frame", "used"), [(0.01, 0.02, 0.01), (None, 0.02, 0.02), (None, None, 0.0)])
def test_the_tables_height_is_given_or_the_frames_or_zero(given, of_frame, used, frame):
    heights = []

    def grasp(clouds, scene, table_z, camera_position):
        heights.append(table_z)
        return GraspPlan()

    frame = dataclasses.replace(frame, table_z=of_frame)
    Pipeline(table_z=given, grasp=grasp).locate(frame, frame.labels)
    assert heights == [used]


def test_the_crf_removes_speckles_and_may_be_ones_own(frame):
    clean = 0.9 * one_hot(frame.labels) + 0.025
    speckled = clean.copy()
    speckled[::9, ::9] = 0.2  # hardly an opinion
    speckled[::9, ::9, OBSTACLE] = 0.4
    p = Pipeline(lambda rgb: speckled, crf=True).run(frame)
    assert np.mean(p.labels != frame.labels) < 0.2 * np.mean(most_probable(speckled) != frame.labels)
    assert list(p.seconds) == ["network", "crf", "back_projection", "clouds", "grasps"]
    q = Pipeline(lambda rgb: speckled, crf=lambda probabilities, frame: frame.labels).run(frame)
    assert np.array_equal(q.labels, frame.labels)


class Broken(nn.Module):
    def __init__(self):
        super().__init__()
        self.scale = nn.Parameter(torch.tensor(float("nan")))

    def forward(self, x):
        return self.scale * x.repeat(1, 2, 1, 1)[:, :4]


def test_each_object_of_a_function_of_a_frame_is_a_target(frame):
    p = Pipeline(find_objects=lambda f: f.instances).run(frame)
    assert len(p.clouds) == len(np.unique(frame.instances)) - 1 == 3
    assert p.probabilities is None and p.certainty == (1.0, 1.0, 1.0) and "objects" in p.seconds
    assert {grasp.target for grasp in p.plan.grasps} <= {0, 1, 2}
    q = Pipeline().locate(frame, p.labels, instances=frame.instances)
    assert [len(cloud) for cloud in q.clouds] == [len(cloud) for cloud in p.clouds]


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("number", "certainty", "got"),
    [(7, [0.9], "got 1"), (1, [0.9, 0.8], "got 2"), (1, [], "got 0"), (1, 0.9, "shape"), (1, [90.0], "0..1")],
)
def test_a_function_that_is_sure_of_other_objects_than_it_found_is_refused(number, certainty, got, frame):
    """Each number up to the largest has a certainty; one more or less would be another object's."""
    found = SimpleNamespace(instances=number * (frame.instances == 1), certainty=certainty)
    pipeline = Pipeline(find_objects=lambda f: found)
    for at in (None, np.argwhere(frame.instances == 1)[0, ::-1]):
        with pytest.raises(ValueError, match=rf"^certainty: expected .*{got}"):
            pipeline.run(frame, at=at)


@pytest.mark.bad_input
@pytest.mark.parametrize("classes", [0, 256])
def test_a_model_of_more_or_fewer_classes_than_labels_have_numbers_is_refused(classes, frame):
    """At 256 the last one would be taken for "ignore", and beyond for the first ones."""

    class Network(nn.Module):
        def forward(self, x):
            return torch.zeros(len(x), classes, *x.shape[2:])

    says = rf"^(model|probabilities): expected 1 to 255 classes, got {classes}$"
    for model in (Network(), lambda rgb: np.full((*rgb.shape[:2], classes), 1.0 / max(classes, 1))):
        with pytest.raises(ValueError, match=says):
            Pipeline(model, target_class=0).run(frame)
        with pytest.raises(ValueError, match=says):
            segment_rgb_image(model, frame.rgb)
    with pytest.raises(ValueError, match=r"^model: expected 1 to 255 classes"):
        open_engine(Network()).logits(frame)
    with pytest.raises(ValueError, match=r"^scores: expected 1 to 255 classes"):
        labels_of_scores(np.zeros((1, classes, 2, 3), np.float32))


@pytest.mark.bad_input
@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda f: Pipeline("unet"), "model"),
        (lambda f: Pipeline().run(f), "model"),
        (lambda f: Pipeline(SmallSegNet(), find_objects=lambda f: f.instances), "find_objects"),
        (lambda f: Pipeline(table_z=750), "table_z"),
        (lambda f: Pipeline(target_class=-1), "target_class"),
        (lambda f: Pipeline(SmallSegNet(), target_class=4), "target_class"),
        (lambda f: Pipeline(lambda rgb: one_hot(f.labels), target_class=4).run(f), "target_class"),
        (lambda f: Pipeline(workspace=((0, 1), (0, 1))), "workspace"),
        (lambda f: Pipeline(workspace=((0, 1), (1, 0), (0, 1))), "workspace"),
        (lambda f: Pipeline(workspace="floor"), "workspace"),
        (lambda f: Pipeline(grasp=np.asarray, gripper=Gripper()), "gripper"),
        (lambda f: Pipeline().locate(f, np.zeros((3, 3), int)), "labels"),
        (lambda f: Pipeline().locate(f, np.full(f.labels.shape, 256)), "labels"),
        (lambda f: Pipeline().locate(f, f.labels, instances=f.labels / 2.0), "instances"),
        (lambda f: Pipeline().locate(f, f.labels, instances=f.instances[1:]), "instances"),
        (lambda f: Pipeline().locate(f, f.labels, instances=f.instances.astype(int) - 2), "instances"),
        (lambda f: Pipeline(target_class=4).locate(f, f.labels, one_hot(f.labels)), "target_class"),
        (lambda f: Pipeline().locate(f, f.labels, one_hot(f.labels)[..., :2]), "probabilities"),
        (lambda f: Pipeline().locate(f, f.labels, one_hot(f.labels) * 255), "probabilities"),
        (lambda f: Pipeline(lambda rgb: rgb[:5]).run(f), "probabilities"),
        (lambda f: Pipeline(lambda rgb: np.full((*rgb.shape[:2], 4), 77, np.uint8)).run(f), "probabilities"),
        (lambda f: Pipeline(lambda rgb: 4.0 * one_hot(f.labels) - 2.0).run(f), "probabilities"),
        (lambda f: Pipeline(lambda rgb: 0.5 * one_hot(f.labels)).run(f), "probabilities"),
        (lambda f: Pipeline(Broken()).run(f), "probabilities"),
        (lambda f: segment_rgb_image(np.asarray, f.rgb, order="hsv"), "order"),
        (lambda f: segment_rgb_image(np.asarray, f.rgb / 255.0), "image"),
    ],
)
def test_wrong_arguments_are_named(call, name, frame):
    with pytest.raises(ValueError, match=f"^{name}" if ":" in name else f"^{name}:"):
        call(frame)


def test_the_surer_target_is_grasped_first(frame):
    """The same masks; the network's opinion of the object that had the best grasp is turned down to 0.7."""
    sure = Pipeline().locate(frame, frame.labels, one_hot(frame.labels).astype(np.float32))
    first = sure.plan.grasps[0].target
    assert len(sure.clouds) == 2 and sure.certainty == (1.0, 1.0)
    p = one_hot(frame.labels).astype(np.float32)
    p.reshape(-1, 4)[sure.pixels[first]] = (0.1, 0.1, 0.7, 0.1)
    doubting = Pipeline().locate(frame, frame.labels, p)
    assert doubting.plan.grasps[0].target != first and doubting.certainty[first] == pytest.approx(0.7)
    assert sorted(-grasp.score for grasp in doubting.plan.grasps) == [-grasp.score for grasp in doubting.plan.grasps]


def test_a_model_of_other_inputs_says_what_to_do(frame):
    """A function of a frame in the place of a model, and a network of four channels."""
    import torch

    with pytest.raises(
        ValueError, match=r"model: expected a function of an RGB image; .*find_objects.* asks .*'depth'"
    ):
        Pipeline(lambda frame: frame.depth > 0.0).run(frame)
    with pytest.raises(ValueError, match=r"model: expected one that takes image of 3 channels .*`takes`"):
        Pipeline(torch.nn.Conv2d(4, 4, 1)).run(frame)
