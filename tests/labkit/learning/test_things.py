"""Things apart: votes and their loss, grouping against oracles, one forward pass in every engine, training, weights."""

import subprocess
import sys
import tracemalloc
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import torch

import data_gen
from labkit.frame import RGBDFrame
from labkit.instance_metrics import score_instances
from labkit.labels import IGNORE, unknown_number
from labkit.learning.engines import open_engine
from labkit.learning.inference import THINGS, VOTE_UNIT, Engine, NetworkInput
from labkit.learning.network import TorchEngine, UNetRGBD, load_model, save_model, weights_path, with_things
from labkit.learning.things import (
    CELL,
    LEAST,
    SPREAD,
    group,
    histogram,
    look,
    segment_instances,
    things_loss,
    vote_targets,
)
from labkit.learning.view import canonical_view
from labtrain.augment_depth import hidden_things, random_bend, random_depth_loss, random_exposure
from labtrain.images import ImagesInMemory
from labtrain.paint import painted
from labtrain.training import THINGS_RECIPE, Trainer, train


@pytest.fixture(scope="module")
def crowd() -> RGBDFrame:
    """A painted heap of things."""
    return data_gen.render(data_gen.sample_scene(4, "clutter"))


@pytest.fixture(scope="module")
def fresh() -> UNetRGBD:
    """A network that tells things apart, untrained."""
    torch.manual_seed(0)
    return UNetRGBD(things=True).eval()


def of_view(frame: RGBDFrame) -> np.ndarray:
    """The true instances in a frame's canonical view, 0 where nobody knows."""
    instances = canonical_view(frame).frame.instances
    return np.where(instances == IGNORE, 0, instances)


# Grouping -----------------------------------------------------------------------------------------------------------


def test_perfect_votes_give_back_the_true_things(crowd):
    """But for those that are too small, and those whose middles are nearer than the blur and APART can tell."""
    true = of_view(crowd)
    numbers, certainty = group((true > 0).astype(float), vote_targets(true))
    scores = score_instances(true, numbers)
    middles = {n: np.argwhere(true == n).mean(axis=0) for n in np.unique(true[true > 0])}
    far = [n for n in middles if all(np.linalg.norm(middles[n] - middles[m]) > 30 for m in middles if m != n)]
    far = [n for n in far if np.count_nonzero(true == n) >= LEAST]
    for n in far:
        assert len(np.unique(numbers[true == n])) == 1
    assert len(far) >= 3 and scores.over(0.75) >= len(far) and min(certainty) > 0.5
    pixels = np.bincount(numbers.ravel())[1:]
    assert (np.diff(pixels) <= 0).all() and len(pixels) == len(certainty) and pixels.min() >= LEAST


def test_touching_things_come_apart_and_noisy_votes_still_agree():
    rng = np.random.default_rng(0)
    true = np.zeros((80, 140), int)
    true[20:60, 20:60], true[20:60, 60:110] = 1, 2
    votes = vote_targets(true) + rng.normal(0.0, 3.0, (*true.shape, 2))
    numbers, certainty = group((true > 0).astype(float), votes)
    assert len(certainty) == 2 and score_instances(true, numbers).over(0.75) == 2
    scattered = vote_targets(true) + rng.normal(0.0, 9.0, (*true.shape, 2))
    sure = group((true > 0) * 0.7, scattered)[1]
    assert max(sure) < min(certainty) and max(sure) <= 0.7 + 1e-9  # neither foreground nor agreement


def test_histogram_is_the_blurred_count_of_shared_votes():
    """Each vote shared by hand among the four cells around it; a Gaussian keeps the sum, and the mean place."""
    rng = np.random.default_rng(1)
    places = rng.uniform(-20.0, 50.0, (40, 2))
    counts, first = histogram(places)
    assert counts.sum() == pytest.approx(40.0, rel=1e-3)
    row, column = np.mgrid[: counts.shape[0], : counts.shape[1]]
    mean = first + CELL * np.array([(counts * column).sum(), (counts * row).sum()]) / counts.sum()
    assert mean == pytest.approx(places.mean(axis=0), abs=0.01)
    brute = np.zeros(counts.shape)
    for u, v in (places - first) / CELL:
        for i, j in product((0, 1), repeat=2):
            brute[int(v) + j, int(u) + i] += abs(1 - i - u % 1) * abs(1 - j - v % 1)
    distance = np.arange(-8, 9)
    bell = np.exp(-0.5 * (distance / SPREAD) ** 2)
    bell /= bell.sum()
    blurred = brute
    for axis in (0, 1):
        blurred = np.apply_along_axis(np.convolve, axis, blurred, bell, "same")
    assert np.abs(blurred - counts).max() < 0.01


def test_nothing_is_no_error():
    for foreground in (np.zeros((9, 9)), np.pad(np.ones((3, 3)), 3)):  # nothing, and less than a thing has
        numbers, certainty = group(foreground, np.zeros((9, 9, 2)))
        assert not numbers.any() and certainty == ()


@pytest.mark.parametrize(
    ("foreground", "votes", "named"),
    [
        (np.zeros((4, 4, 1)), np.zeros((4, 4, 2)), "foreground"),
        (np.full((4, 4), 2.0), np.zeros((4, 4, 2)), "foreground: expected probabilities"),
        (np.full((4, 4), np.nan), np.zeros((4, 4, 2)), "foreground"),
        (np.zeros((4, 4)), np.zeros((4, 5, 2)), "votes"),
        (np.zeros((4, 4)), np.full((4, 4, 2), np.inf), "votes"),
    ],
)
@pytest.mark.bad_input
def test_bad_input_is_refused(foreground, votes, named):
    with pytest.raises(ValueError, match=named):
        group(foreground, votes)


def test_vote_targets_are_the_mean_place_of_each_thing(crowd):
    true = of_view(crowd)
    votes = vote_targets(true)
    for n in np.unique(true[true > 0]):
        v, u = np.nonzero(true == n)
        reached = np.stack([u, v], axis=1) + votes[v, u]
        assert np.abs(reached - (u.mean(), v.mean())).max() < 1e-3
    assert not votes[true == 0].any()
    assert not vote_targets(np.full((3, 3), IGNORE, np.uint8)).any()


# The loss -----------------------------------------------------------------------------------------------------------


def test_loss_is_smallest_at_the_truth_and_ignores_what_nobody_knows():
    instances = torch.tensor([[[1, 1, 0, 0, IGNORE], [1, 1, 0, 2, 2]]], dtype=torch.uint8)
    truth = torch.from_numpy(vote_targets(instances[0].numpy())).permute(2, 0, 1) / VOTE_UNIT
    best = torch.cat([torch.where((instances == 1) | (instances == 2), 30.0, -30.0), truth])[None]
    assert things_loss(best, instances).item() == pytest.approx(0.0, abs=1e-6)
    z = (best + torch.randn(best.shape, generator=torch.Generator().manual_seed(0))).requires_grad_()
    things_loss(z, instances).backward()
    assert z.grad[0, :, 0, 4].abs().max() == 0.0  # ignored
    assert z.grad[0, 1:, 0, 2].abs().max() == 0.0  # no thing: nothing to vote for
    assert z.grad[0, 1:, 0, 0].abs().min() > 0.0


def test_gradient_of_a_vote_is_linear_and_then_constant():
    instances = torch.ones((1, 1, 1), dtype=torch.uint8)
    for error, expected in ((0.1, 0.5), (0.5, 1.0), (-3.0, -1.0)):  # beta is 0.2
        z = torch.tensor([[[[0.0]], [[error]], [[0.0]]]], requires_grad=True)
        things_loss(z, instances).backward()
        assert z.grad[0, 1].item() == pytest.approx(8.0 * expected)
        assert z.grad[0, 0].item() == pytest.approx(-0.5)  # sigmoid(0) - 1


# Networks, files, engines -------------------------------------------------------------------------------------------


def test_classes_stay_what_they_were_when_things_are_added(crowd):
    torch.manual_seed(1)
    classes = UNetRGBD().eval()
    both = with_things(classes).eval()
    old, (p, sight) = TorchEngine(classes)(crowd, True), TorchEngine(both).predict_instances(crowd, True)
    np.testing.assert_array_equal(p, old)
    np.testing.assert_array_equal(TorchEngine(both)(crowd, True), old)
    assert TorchEngine(classes).predict_instances(crowd)[1] is None and sight.foreground.shape == sight.votes.shape[:2]
    assert TorchEngine(both).logits(crowd).shape == (4, *crowd.depth.shape)
    again = with_things(both)
    assert all(torch.equal(a, b) for a, b in zip(again.state_dict().values(), both.state_dict().values(), strict=True))


def test_a_file_says_whether_it_tells_things_apart(tmp_path, fresh):
    save_model(fresh, tmp_path / "both.pt")
    assert load_model(tmp_path / "both.pt").things
    save_model(UNetRGBD(), tmp_path / "classes.pt")
    assert not load_model(tmp_path / "classes.pt").things
    with pytest.raises(ValueError, match="num_classes: expected 4"):
        load_model(tmp_path / "both.pt", 7)


@pytest.mark.parametrize("engine", ["opencv", "onnxruntime"])
def test_every_engine_sees_the_same(engine, fresh, crowd):
    if engine == "onnxruntime":
        pytest.importorskip("onnxruntime")
    (p, here), (q, there) = (
        open_engine(fresh).predict_instances(crowd),
        open_engine(fresh, engine).predict_instances(crowd),
    )
    assert np.abs(p - q).max() < 1e-4 and q.shape[-1] == 4
    assert np.abs(here.foreground - there.foreground).max() < 1e-4
    assert np.abs(here.votes - there.votes).max() < 1e-2


def test_a_vote_in_the_mirror_points_the_other_way(crowd):
    class Right(Engine):
        """Sees things everywhere, whose middles are 20 pixels to the right and 40 down."""

        def forward(self, image):
            z = np.zeros((len(image), 4 + len(THINGS), *image.shape[2:]), np.float32)
            z[:, 5:] = np.reshape((1.0, 2.0), (2, 1, 1))
            return z

    once, twice = (
        Right(NetworkInput(), 4, things=True).predict_instances(crowd.rgb, mirror)[1] for mirror in (False, True)
    )
    assert once.votes[3, 5].tolist() == [VOTE_UNIT, 2 * VOTE_UNIT]
    assert twice.votes[3, 5].tolist() == [0.0, 2 * VOTE_UNIT]


def test_looks_in_other_sizes_are_averaged_in_pixels_of_the_one_view(crowd):
    class Told(Engine):
        """Sees things in the upper half of each view, whose middles are 20 pixels of that view to the right."""

        def forward(self, image, geometry):
            z = np.zeros((len(image), 4 + len(THINGS), *image.shape[2:]), np.float32)
            z[:, 4], z[:, 4, image.shape[2] // 2 :], z[:, 5] = 9.0, -9.0, 1.0
            return z

    engine = Told(NetworkInput(arrays=("image", "geometry"), pixel=0.0025), 4, things=True)
    (p, once), (q, thrice) = engine.predict_instances(crowd), look(engine, crowd, False, (0.5, 2.0))
    np.testing.assert_array_equal(p, q)
    assert once.votes.shape == thrice.votes.shape and thrice.view.to_turned.tolist() == once.view.to_turned.tolist()
    assert once.votes[5, 5].tolist() == [VOTE_UNIT, 0.0]
    np.testing.assert_allclose(thrice.votes[5, 5], [VOTE_UNIT * (2.0 + 0.5) / 2.0, 0.0], rtol=0.03)
    none, same = look(engine, crowd, False, (0.5, 2.0), classes=False)  # the true size adds nothing to it
    assert none is None and same.view.to_turned.tolist() == once.view.to_turned.tolist()
    np.testing.assert_array_equal(same.votes, thrice.votes)
    np.testing.assert_array_equal(same.foreground, thrice.foreground)
    h = len(once.foreground)
    away = np.abs(np.arange(h) - h / 2.0) > 4.0  # the three halves end within a few pixels of one another
    np.testing.assert_allclose(thrice.foreground[away], once.foreground[away], atol=1e-4)
    for unsized in (look(engine, crowd, False, ())[1], look(engine, replace(crowd, depth=0.0 * crowd.depth), False)[1]):
        assert unsized.votes[5, 5].tolist() == [VOTE_UNIT, 0.0]


def test_a_network_of_classes_alone_finds_no_things(crowd):
    with pytest.raises(ValueError, match="model: expected a network that tells things apart"):
        segment_instances(UNetRGBD(), crowd)


def square(off=(0.0, 0.0), side: int = 30):
    """Foreground and votes of one square thing; of every second column the votes are `off` by so many pixels."""
    foreground, votes = np.zeros((60, 70)), np.zeros((60, 70, 2))
    inside = np.s_[10 : 10 + side, 20 : 20 + side]
    v, u = np.mgrid[inside]
    foreground[inside] = 1.0
    votes[inside] = np.stack([u.mean() - u, v.mean() - v], axis=-1)
    votes[10 : 10 + side, 20 : 20 + side : 2] += off
    return foreground, votes


@pytest.mark.parametrize("off", [(3, 0), (0, 3), (-3, 3), (6, 0), (9, 0), (-3, -6)])
@pytest.mark.parametrize("least", [8, 30])
def test_votes_that_are_split_between_two_cells_are_one_thing(off, least):
    """Two peaks of one height, nearer than peaks can be apart."""
    numbers, certainty = group(*square(off, least))
    assert len(certainty) == 1 and np.array_equal(numbers > 0, square(side=least)[0] > 0.5)
    assert certainty[0] == 1.0 or np.hypot(*off) / 2.0 > 0.5 * np.sqrt(least**2 / np.pi)


@pytest.mark.parametrize("far", [30_000.0, -1e6, 1e300])
def test_a_vote_that_leads_nowhere_costs_no_memory_and_no_thing(far):
    foreground, votes = square()
    votes[20, 30] = far, -far
    tracemalloc.start()
    try:
        numbers, certainty = group(foreground, votes)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 20e6 and np.array_equal(numbers > 0, foreground > 0.5)
    assert certainty == (pytest.approx(1.0 - 1.0 / 900.0),)
    numbers, certainty = group(foreground, np.full_like(votes, far))
    assert not numbers.any() and certainty == ()


# Paint and training -------------------------------------------------------------------------------------------------


def test_paint_stays_on_things_keeps_their_shading_and_is_repeatable(crowd):
    once, again = (painted(crowd, np.random.default_rng(3), share=1.0) for _ in range(2))
    changed = (once.rgb != crowd.rgb).any(axis=2)
    assert changed.mean() > 0.01 and not changed[crowd.instances == 0].any()
    np.testing.assert_array_equal(once.rgb, again.rgb)
    dark, bright = np.full((20, 40, 3), 100, np.uint8), np.ones((20, 40), np.uint8)
    dark[:, 20:] = 50  # one thing, half of it in shade
    flat = RGBDFrame(dark, np.ones((20, 40), np.float32), np.eye(3), np.eye(4), instances=bright)
    for seed in range(5):
        rgb = painted(flat, np.random.default_rng(seed), share=1.0).rgb.astype(float).max(axis=2)
        assert rgb[:, 20:].max() <= 0.55 * 255.0
    with pytest.raises(ValueError, match="one with instances"):
        painted(RGBDFrame(crowd.rgb, crowd.depth, crowd.K, crowd.T_base_cam), np.random.default_rng(0))


def many(frame: RGBDFrame, numbers, kind) -> RGBDFrame:
    """A frame whose upper edge shows things of these numbers, a pixel each, and nothing else."""
    instances = np.zeros(frame.depth.shape, kind)
    instances[0, : len(numbers)] = numbers
    return replace(frame, instances=instances)


@pytest.mark.parametrize("numbers", [(256, 300, 511), (1, 255, 256), (255, 65_534), (7, 7, 2)])
def test_training_tells_things_of_any_number_apart(crowd, numbers):
    """Also those above 255, and 255 itself where it is a thing's; `unknown_number` alone is unknown."""
    frames = [
        many(crowd, numbers, np.uint16),
        many(crowd, (*numbers, 65_535), np.uint16),
        replace(crowd, instances=None),
    ]
    kept = ImagesInMemory(frames, depth=True, instances=True, progress=False).instances
    assert kept.dtype == np.uint8 and (kept[2] == IGNORE).all()
    for image in kept[:2]:
        own = image[0, : len(numbers)]
        assert not image[1:].any() and own.min() > 0 and own.max() < IGNORE
        assert np.array_equal(np.unique(own, return_inverse=True)[1], np.unique(numbers, return_inverse=True)[1])
    assert kept[0, 0, len(numbers)] == 0 and kept[1, 0, len(numbers)] == IGNORE


@pytest.mark.bad_input
def test_more_things_than_8_bits_can_number_are_refused(crowd):
    ImagesInMemory([many(crowd, range(300, 554), np.uint16)], depth=True, instances=True, progress=False)
    with pytest.raises(ValueError, match=r"^dataset\[0\]: expected at most 254 objects in a frame, got 255"):
        ImagesInMemory([many(crowd, range(300, 555), np.uint16)], depth=True, instances=True, progress=False)
    with pytest.raises(ValueError, match=r"^instances: expected uint8, 255 where nobody knows"):
        things_loss(torch.zeros((1, 3, 2, 2)), torch.full((1, 2, 2), 255))


def test_what_is_unknown_is_neither_painted_nor_hidden_nor_voted_for_and_a_thing_of_number_255_is(crowd):
    for kind, unknown in ((np.uint8, 255), (np.uint16, 65_535)):
        nobody_knows = replace(crowd, instances=np.full(crowd.depth.shape, unknown, kind))
        thing = replace(crowd, instances=np.full(crowd.depth.shape, 255, np.uint16))
        assert not vote_targets(nobody_knows.instances).any() and vote_targets(thing.instances).any()
        changed = 0
        for seed in range(12):
            assert np.array_equal(painted(nobody_knows, np.random.default_rng(seed)).rgb, crowd.rgb)
            assert np.array_equal(hidden_things(nobody_knows, np.random.default_rng(seed)).depth, crowd.depth)
            changed += (painted(thing, np.random.default_rng(seed)).rgb != crowd.rgb).any()
        assert changed > 3
        view = canonical_view(many(crowd, (255,), kind)).frame.instances  # beyond the picture nobody knows
        assert unknown_number(view) == unknown and (view == unknown).any()


def test_bands_lie_square_to_a_thing_s_length():
    """A thing that is long in u gets bands whose pixels of one column are all painted or none."""
    rgb, one = np.full((20, 60, 3), 120, np.uint8), np.zeros((20, 60), np.uint8)
    one[5:15, 5:55] = 1
    frame = RGBDFrame(rgb, np.ones((20, 60), np.float32), np.eye(3), np.eye(4), instances=one)
    whole = 0
    for seed in range(30):
        columns = (painted(frame, np.random.default_rng(seed), 1.0, bands=1.0).rgb != rgb).any(axis=2)[5:15, 5:55]
        whole += bool((columns.all(axis=0) | ~columns.any(axis=0)).all() and columns.any())
    assert whole > 3  # where no other shape was drawn beside the bands


def test_bad_exposure_and_depth_leave_instances_and_say_nothing_of_their_own(crowd):
    for change in (random_exposure, random_bend, random_depth_loss):
        for seed in range(6):
            once, again = (change(crowd, np.random.default_rng(seed)) for _ in range(2))
            assert np.array_equal(once.rgb, again.rgb) and np.array_equal(once.depth, again.depth)
            assert once.rgb.dtype == np.uint8 and once.depth.dtype == np.float32
            np.testing.assert_array_equal(once.instances, crowd.instances)
            off = np.abs(once.depth - crowd.depth)
            lost = (once.depth == 0.0) & (crowd.depth > 0.0)
            if change is random_exposure:
                assert not off.any() and (once.rgb != crowd.rgb).any()
            elif change is random_bend:
                assert 0.0005 < off.max() <= 0.0151 and not lost.any()
            else:
                assert 0.005 < lost.mean() < 0.45 and not off[~lost].any()


@pytest.mark.nightly
def test_batches_made_ahead_by_other_processes_are_the_same():
    """In a process of its own: here, threads that other tests began might be waited for after the fork."""
    program = """if True:
        import cv2, torch, data_gen
        from dataclasses import replace
        from labkit.learning.network import UNetRGBD
        from labtrain.training import THINGS_RECIPE, ImagesInMemory, Trainer
        frames = [data_gen.render(data_gen.sample_scene(4, "clutter"), (80, 60))] * 4
        data = ImagesInMemory(frames, depth=True, instances=True, progress=False)
        config = replace(THINGS_RECIPE, steps=3, batch=2, crop=(32, 48))
        trainer = Trainer(data, config, torch.device("cpu"), UNetRGBD(things=True))
        threads = cv2.getNumThreads()
        for step, ahead in enumerate(trainer.ahead(2)):
            here = trainer.batch_of_step(step)
            for one, other in zip([*here[0], *here[1:]], [*ahead[0], *ahead[1:]]):
                assert torch.equal(one, other)
        print("same", step + 1, cv2.getNumThreads() == threads)
    """
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=200)
    assert done.stdout == "same 3 True\n", done.stderr


def test_instances_are_carried_into_the_batch_as_labels_are(crowd):
    """Where a label says thing, so does the instance, through view, zoom, roll, window and mirror."""
    data = ImagesInMemory([crowd] * 4, depth=True, instances=True, progress=False)
    trainer = Trainer(data, THINGS_RECIPE, torch.device("cpu"), UNetRGBD(things=True))
    (x, g), y, instances = trainer.batch_of_step(0)
    assert x.shape[2:] == g.shape[2:] == y.shape[1:] == instances.shape[1:]
    assert torch.equal((y == 2) | (y == 3), (instances > 0) & (instances != IGNORE))
    assert torch.equal(y == IGNORE, instances == IGNORE) and (y >= 2).any()


def test_training_leaves_classes_as_they_are_and_goes_on_where_it_stopped(tmp_path, crowd):
    config = replace(THINGS_RECIPE, steps=4, epochs=1, crop=(64, 96), batch=2)
    frames = [crowd] * 4
    torch.manual_seed(0)
    start = UNetRGBD().state_dict()

    def network():
        model = UNetRGBD()
        model.load_state_dict(start)
        return with_things(model)

    train(frames, None, config, tmp_path / "whole", progress=False, model=network())
    data = ImagesInMemory(frames, depth=True, instances=True, progress=False)
    trainer = Trainer(data, config, torch.device("cpu"), network())
    losses = [trainer.step(next(trainer.ahead())) for _ in range(2)]
    torch.save(trainer.state(), tmp_path / "unet_rgbd.checkpoint.pt")
    train(frames, None, config, tmp_path, progress=False, model=network())
    whole, resumed = (load_model(folder / "unet_rgbd.pt").state_dict() for folder in (tmp_path / "whole", tmp_path))
    assert all(torch.equal(whole[name], resumed[name]) for name in whole) and np.isfinite(losses).all()
    for name, weight in start.items():  # classes stay as they were, to the statistics of their normalisations
        assert torch.equal(whole[name], weight.half().float() if weight.ndim == 4 else weight), name
    branch = {name for name in whole if name.startswith("branch.")}
    assert any(not torch.equal(whole[name], with_things(network()).state_dict()[name]) for name in branch)


# The shipped weights ------------------------------------------------------------------------------------------------


def test_shipped_weights_find_most_things_of_a_heap():
    network = load_model(weights_path("unet_rgbd"))
    found = true = 0
    for config, seed in (("clutter", 800_001), ("bin", 800_003)):
        frame = data_gen.render(data_gen.sample_scene(seed, config))
        seen = segment_instances(network, frame)
        scores = score_instances(frame.instances, seen.instances)
        found, true = found + scores.over(0.5), true + scores.true
        assert len(seen) == len(np.unique(seen.instances)) - 1 and seen.foreground.shape == frame.depth.shape
        assert seen.probabilities.shape == (*frame.depth.shape, 4) and all(0.0 <= c <= 1.0 for c in seen.certainty)
    assert found / true > 0.6
