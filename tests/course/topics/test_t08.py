"""The references of topic 08 do what the kit's node does."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labkit.course.topics import of_topic
from labkit.node import convert
from labkit.node.messages import Header, Image, PointCloud2, Transform
from labkit.node.sync import Synchronizer
from labkit.node.transforms import TransformTree

QUESTIONS = of_topic("08_node")
H = Header(0, "camera")


def cases(name):
    question = QUESTIONS[name]
    drawn = [question.inputs(np.random.default_rng(seed)) for seed in range(20)]
    return question.reference, [*question.by_hand, *drawn]


def test_depth_is_read_as_the_kit_reads_it():
    reference, arguments = cases("decode_depth")
    for data, height, width, step, is_bigendian in arguments:
        message = Image(H, height, width, "16UC1", is_bigendian, step, data.tobytes())
        depth = convert.depth_image(message)
        expected = np.where(depth > 0.0, depth, np.nan)
        np.testing.assert_allclose(reference(data, height, width, step, is_bigendian), expected, rtol=1e-6)


def test_pairs_are_those_of_the_synchroniser_where_frames_are_further_apart_than_the_bound():
    rng = np.random.default_rng(0)
    for _ in range(20):
        number = np.arange(40)
        a, b = (33_000_000 * number + rng.integers(0, 9_000_000, 40) for _ in "ab")
        kept_a, kept_b = (np.flatnonzero(rng.random(40) < 0.8) for _ in "ab")
        sync, found = Synchronizer(("a", "b"), slop=10_000_000), {}
        arrivals = [("a", int(a[i]), k) for k, i in enumerate(kept_a)]
        arrivals += [("b", int(b[i]), k) for k, i in enumerate(kept_b)]
        for stream, stamp, k in sorted(arrivals, key=lambda arrival: arrival[1]):
            if together := sync.add(stream, stamp, k):
                found[together["a"]] = together["b"]
        j = QUESTIONS["pair_stamps"].reference(a[kept_a], b[kept_b], 10_000_000)
        assert found == {i: int(k) for i, k in enumerate(j) if k >= 0}


def test_a_pose_between_two_is_the_one_of_the_kits_tree():
    reference, arguments = cases("pose_at")
    for stamps, positions, quaternions, t in arguments:
        tree = TransformTree()
        for stamp, p, q in zip(stamps, positions, quaternions, strict=True):
            tree.add(Transform(Header(int(stamp), "base"), "camera", tuple(p.tolist()), tuple(q.tolist())))
        p, q = reference(stamps, positions, quaternions, t)
        if np.isnan(p).any():
            with pytest.raises(LookupError, match="known transform"):
                tree.lookup("base", "camera", t)
            continue
        T = tree.lookup("base", "camera", t)
        np.testing.assert_allclose(p, T[:3, 3], atol=1e-9)
        np.testing.assert_allclose(Rotation.from_quat(q).as_matrix(), T[:3, :3], atol=1e-6)


def test_a_packed_cloud_is_read_by_the_kit():
    reference, arguments = cases("pack_cloud")
    for (P,) in arguments:
        data = reference(P).tobytes()
        count = len(data) // 16
        message = PointCloud2(H, 1, count, convert.XYZ, False, 16, 16 * count, data)
        assert np.allclose(convert.decode_cloud(message), P[np.isfinite(P).all(axis=1)], atol=1e-6)


def test_a_quaternion_is_the_one_of_the_kits_poses():
    reference, arguments = cases("quaternion")
    for (R,) in arguments:
        T = np.eye(4)
        T[:3, :3] = R
        q = reference(R)
        assert abs(np.dot(q, convert.encode_pose(T, H).orientation)) == pytest.approx(1.0)
        assert np.allclose(Rotation.from_quat(q).as_matrix(), R)
