"""Which messages belong together, and where the camera stood when."""

import itertools
import json
import subprocess

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labkit.node.messages import Header, Transform
from labkit.node.sync import Synchronizer
from labkit.node.transforms import TransformTree

SYSTEM_PYTHON = "/usr/bin/python3"
STREAMS = ("rgb", "depth", "info")


def test_every_moment_is_found_under_jitter_and_in_any_order():
    """Thirty frames a second, stamps up to 8 ms off, messages up to a period late: each frame once, no mixture."""
    rng = np.random.default_rng(0)
    sync = Synchronizer(STREAMS, slop=16)
    sent = []
    for number, stream in itertools.product(range(500), STREAMS):
        stamp = 33 * number + int(rng.integers(0, 9))
        sent.append((33 * number + rng.uniform(0, 33), stream, stamp, number))
    found = [sync.add(stream, stamp, number) for _, stream, stamp, number in sorted(sent)]
    sets = [together for together in found if together is not None]
    assert all(len(set(together.values())) == 1 for together in sets)
    assert [together["rgb"] for together in sets] == sorted(together["rgb"] for together in sets)
    assert len(sets) == 500 and sync.unmatched == 0


def test_against_every_combination():
    """A set is given exactly when a combination lies within the bound, and it is one of the nearest; by trying all."""
    rng = np.random.default_rng(1)
    for _ in range(300):
        sync, waiting = Synchronizer(STREAMS, slop=10, depth=50), {stream: [] for stream in STREAMS}
        for _ in range(25):
            stream, stamp = str(rng.choice(STREAMS)), int(rng.integers(0, 120))
            together = sync.add(stream, stamp, stamp)
            waiting[stream].append(stamp)
            sets = [s for s in itertools.product(*(waiting[name] for name in STREAMS)) if stamp in s]
            sets = [s for s in sets if s[STREAMS.index(stream)] == stamp and max(s) - min(s) <= 10]
            assert (together is not None) == bool(sets)
            if together:
                given = tuple(together[name] for name in STREAMS)
                assert given in sets
                off = [sum(abs(when - stamp) for when in s) for s in (given, *sets)]
                assert off[0] == min(off)
                waiting = {name: [s for s in waiting[name] if s > together[name]] for name in STREAMS}


def test_the_nearest_of_each_stream_are_no_set_but_another_is():
    """Depth at 15 is nearest to colour at 0, and 33 away from the calibration; depth at -18 is not."""
    sync = Synchronizer(STREAMS, slop=20)
    for stream, stamp in (("depth", -18), ("info", -18), ("depth", 15)):
        assert sync.add(stream, stamp, stamp) is None
    assert sync.add("rgb", 0, 0) == {"rgb": 0, "depth": -18, "info": -18}


def test_lost_messages_cost_their_frame_and_no_other():
    sync = Synchronizer(STREAMS, slop=10)
    lost = {(3, "depth"), (7, "rgb"), (8, "info")}
    sets = []
    for number, stream in itertools.product(range(12), STREAMS):
        if (number, stream) not in lost:
            sets.append(sync.add(stream, 33 * number, number))
    assert [s["rgb"] for s in sets if s] == [0, 1, 2, 4, 5, 6, 9, 10, 11]
    assert sync.unmatched == 6


@pytest.mark.parametrize("first", ["rgb", "depth"])
def test_after_a_restart_of_the_clock_nothing_pairs_with_what_came_before(first):
    """Depth was left alone at 66, just where colour is after the restart; whichever stream restarts first."""
    sync, second = Synchronizer(("rgb", "depth"), slop=10, restart=1000), {"rgb": "depth", "depth": "rgb"}[first]
    old = [("depth", 66), *((stream, stamp) for stamp in (9900, 9933) for stream in ("rgb", "depth")), (second, 9966)]
    new = [(stream, stamp) for stamp in (33, 66, 99) for stream in (first, second)]
    for stream, stamp in old:
        sync.add(stream, stamp, ("old", stamp))
    found = [sync.add(stream, stamp, ("new", stamp)) for stream, stamp in new]
    assert [s for s in found if s] == [{"rgb": ("new", t), "depth": ("new", t)} for t in (33, 66, 99)]


def test_a_restart_forgets_what_waits_in_every_stream():
    sync = Synchronizer(("rgb", "depth"), slop=10, restart=1000)
    for stream, stamp in (("depth", 2000), ("depth", 33)):  # the second is the only sign of a restart
        sync.add(stream, stamp, "before")
    sync.add("rgb", 5000, "before")
    assert sync.add("rgb", 33, "after") is None, "colour restarted once more: that depth is of the time before"
    assert sync.add("depth", 33, "after") == {"rgb": "after", "depth": "after"}


def test_no_queue_grows():
    sync = Synchronizer(("rgb", "depth"), slop=10, depth=4)
    for stamp in range(1000):
        assert sync.add("rgb", 100 * stamp, stamp) is None
    assert sync.unmatched == 996


@pytest.mark.bad_input
@pytest.mark.parametrize("arguments, name", [({"slop": -1}, "slop"), ({"slop": 1, "depth": 0}, "depth")])
def test_wrong_arguments_are_named(arguments, name):
    with pytest.raises(ValueError, match=f"^{name}:"):
        Synchronizer(STREAMS, **arguments)


# ------------------------------------------------------------------------------------------------ transforms


def transform(parent, child, stamp, rng) -> Transform:
    turn = Rotation.random(rng=rng).as_quat()
    return Transform(Header(stamp, parent), child, tuple(rng.normal(size=3).tolist()), tuple(turn.tolist()))


def test_a_chain_is_the_product_of_its_links_and_its_inverse():
    rng = np.random.default_rng(2)
    tree = TransformTree()
    links = [("world", "base"), ("base", "hand"), ("hand", "camera"), ("world", "table")]
    T = {}
    for parent, child in links:
        message = transform(parent, child, 0, rng)
        tree.add(message, static=True)
        T[child] = np.eye(4)
        T[child][:3, :3] = Rotation.from_quat(message.rotation).as_matrix()
        T[child][:3, 3] = message.translation
    T_table_camera = np.linalg.inv(T["table"]) @ T["base"] @ T["hand"] @ T["camera"]
    assert np.allclose(tree.lookup("table", "camera", 99), T_table_camera)
    assert np.allclose(tree.lookup("camera", "table", 99), np.linalg.inv(T_table_camera))
    assert np.array_equal(tree.lookup("hand", "hand", 0), np.eye(4))


def test_between_two_stamps_the_camera_is_between_two_places():
    tree = TransformTree()
    for stamp, yaw in ((0, 0.0), (1000, 1.0)):
        q = Rotation.from_euler("z", yaw).as_quat()
        tree.add(Transform(Header(stamp, "base"), "camera", (2.0 * yaw, 0.0, 1.0), tuple(q.tolist())))
    T = tree.lookup("base", "camera", 250)
    assert np.allclose(T[:3, 3], (0.5, 0.0, 1.0))
    assert np.allclose(Rotation.from_matrix(T[:3, :3]).as_euler("xyz"), (0.0, 0.0, 0.25))


@pytest.mark.debian("python3-tf2", "python3-rospy", "python3-geometry-msgs")
def test_the_tree_agrees_with_tf2():
    """Debian's tf2, in a process of the system's Python: chains of moving frames at times in between."""
    rng = np.random.default_rng(3)
    links = [("world", "base"), ("base", "hand"), ("hand", "camera"), ("world", "table")]
    sent = [transform(a, b, int(s * 1e8), rng) for a, b in links for s in range(5)]
    asked = [
        (*map(str, rng.choice(["world", "base", "hand", "camera", "table"], 2)), int(rng.integers(1, 4e8)))
        for _ in range(60)
    ]
    code = (
        "import sys, json, rospy, tf2_py\n"
        "from geometry_msgs.msg import TransformStamped\n"
        "sent, asked = json.load(sys.stdin)\n"
        "buffer = tf2_py.BufferCore(rospy.Duration(10.0))\n"
        "for parent, child, stamp, t, q in sent:\n"
        "    m = TransformStamped(); m.header.frame_id = parent; m.child_frame_id = child\n"
        "    m.header.stamp = rospy.Time(0, stamp)\n"
        "    m.transform.translation.x, m.transform.translation.y, m.transform.translation.z = t\n"
        "    r = m.transform.rotation; r.x, r.y, r.z, r.w = q\n"
        "    buffer.set_transform(m, 'test')\n"
        "out = []\n"
        "for target, source, stamp in asked:\n"
        "    m = buffer.lookup_transform_core(target, source, rospy.Time(0, stamp)).transform\n"
        "    t, r = m.translation, m.rotation\n"
        "    out.append([[t.x, t.y, t.z], [r.x, r.y, r.z, r.w]])\n"
        "print(json.dumps(out))"
    )
    plain = [[m.header.frame_id, m.child_frame_id, m.header.stamp, m.translation, m.rotation] for m in sent]
    given = json.dumps([plain, asked])
    done = subprocess.run([SYSTEM_PYTHON, "-c", code], input=given, capture_output=True, text=True, check=True)
    tree = TransformTree()
    for message in sent:
        tree.add(message)
    for (target, source, stamp), (t, q) in zip(asked, json.loads(done.stdout), strict=True):
        T = tree.lookup(target, source, stamp)
        assert np.allclose(T[:3, 3], t, atol=1e-6)
        assert np.allclose(T[:3, :3], Rotation.from_quat(q).as_matrix(), atol=1e-6)


def test_of_two_transforms_of_one_stamp_the_last_one_holds():
    tree = TransformTree()
    for stamp, x in ((0, 0.0), (100, 1.0), (200, 4.0), (100, 2.0), (200, 6.0), (0, -2.0)):
        tree.add(Transform(Header(stamp, "base"), "camera", (x, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
    assert [tree.lookup("base", "camera", stamp)[0, 3] for stamp in (0, 50, 100, 150, 200)] == [
        -2.0,
        0.0,
        2.0,
        4.0,
        6.0,
    ]


def test_what_is_not_known_is_said():
    tree = TransformTree(seconds=1.0)
    rng = np.random.default_rng(4)
    with pytest.raises(LookupError, match="frame id: expected 'camera', for tf's have no slash first, got '/camera'"):
        tree.lookup("base", "/camera", 0)
    with pytest.raises(LookupError, match="no transform between 'base' and 'camera'"):
        tree.lookup("base", "camera", 0)
    for stamp in (0, 3_000_000_000):
        tree.add(transform("base", "camera", stamp, rng))
    with pytest.raises(LookupError, match=r"2\.000 s before the first"):
        tree.lookup("base", "camera", 1_000_000_000)
    with pytest.raises(LookupError, match=r"0\.500 s after the last"):
        tree.lookup("base", "camera", 3_500_000_000)
    tree.add(transform("base", "camera", 7, rng))
    assert tree.lookup("base", "camera", 7).shape == (4, 4), "a clock that was set back begins a new history"


@pytest.mark.parametrize("parent", ["base", "hand"])
def test_a_frame_follows_what_was_said_last(parent):
    """A camera is taken off its stand and moved, under the same parent or another one, then put on a stand again."""
    tree, rng = TransformTree(), np.random.default_rng(6)
    for static in (True, False, True):
        message = transform(parent if not static else "base", "camera", 0, rng)
        tree.add(message, static)
        T = tree.lookup(message.header.frame_id, "camera", 0)
        assert np.allclose(T[:3, 3], message.translation)
    with pytest.raises(LookupError):
        tree.lookup("hand", "camera", 0)


def test_a_loop_of_frames_is_no_trap():
    tree = TransformTree()
    rng = np.random.default_rng(5)
    for parent, child in (("a", "b"), ("b", "c"), ("c", "a")):
        tree.add(transform(parent, child, 0, rng), static=True)
    assert tree.lookup("a", "b", 0).shape == (4, 4)
    with pytest.raises(LookupError):
        tree.lookup("a", "elsewhere", 0)


@pytest.mark.bad_input
@pytest.mark.parametrize(
    "wrong",
    [
        Transform(Header(0, ""), "camera", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)),
        Transform(Header(0, "camera"), "camera", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)),
        Transform(Header(0, "base"), "camera", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)),
        Transform(Header(0, "base"), "camera", (0.0, 0.0), (0.0, 0.0, 0.0, 1.0)),
    ],
)
def test_a_transform_that_is_none_is_refused(wrong):
    with pytest.raises(ValueError, match="expected"):
        TransformTree().add(wrong)
