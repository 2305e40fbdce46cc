"""The node on recordings: bags of ROS 1 and ROS 2, written and read without ROS."""

import dataclasses

import numpy as np
import pytest
from peers import MESSAGES, MS, small
from rosbags.highlevel import AnyReader
from ruamel.yaml import YAML

import data_gen
from labkit.labels import SURFACE, one_hot
from labkit.node import convert
from labkit.node.actors import Camera
from labkit.node.messages import CameraInfo, Header, Image, Pose, Topics, Transform, Transforms
from labkit.pipeline import Pipeline
from labros.bags import BagWriter, answer_bag
from labros.wire import RosCodec

TOPICS = Topics()
NAMES = ["in.bag", "in_ros2"]


@pytest.fixture(scope="module")
def frames():
    return [data_gen.render(data_gen.sample_scene(seed, "test"), (160, 120)) for seed in (620000, 620001)]


class Truth:
    """A network that knows the frames by their images."""

    def __init__(self, frames):
        self.answers = {frame.rgb.tobytes(): one_hot(frame.labels).astype(np.float32) for frame in frames}

    def __call__(self, rgb):
        return self.answers[rgb.tobytes()]


def record(path, frames, storage="mcap", **options):
    with BagWriter(path, storage=storage) as bag:
        camera = Camera(bag, **options)
        for number, frame in enumerate(frames):
            camera.publish(frame, (number + 1) * 100 * MS)
    return path


def contents(path) -> dict[str, list]:
    """Messages by topic, with the stamps of the recording."""
    found, wire = {}, RosCodec(ros1=path.suffix == ".bag")
    with AnyReader([path]) as reader:
        for connection in reader.connections:
            found[connection.topic] = []
        for connection, stamp, data in reader.messages():
            found[connection.topic].append((stamp, wire.decode(connection.msgtype, data)))
    return found


@pytest.mark.parametrize("name", NAMES)
def test_every_message_comes_back_from_a_bag_as_it_was(tmp_path, name):
    known = RosCodec(ros1=name.endswith(".bag")).knows
    sent = {f"/{type(message).__name__}": message for message in MESSAGES if known(type(message))}
    with BagWriter(tmp_path / name) as bag:
        for topic, message in sent.items():
            bag.publish(topic, message)
    came = contents(tmp_path / name)
    assert came.keys() == sent.keys()
    for topic, ((stamp, found),) in came.items():
        message = sent[topic]
        assert stamp == (message.transforms[0] if isinstance(message, Transforms) else message).header.stamp
        if hasattr(message, "data"):
            assert bytes(found.data) == message.data
            found, message = (dataclasses.replace(m, data=b"") for m in (found, message))
        assert dataclasses.astuple(found) == dataclasses.astuple(message)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("depth", ["32FC1", "16UC1"])
def test_a_bag_is_answered_frame_by_frame(tmp_path, frames, name, depth):
    source = record(tmp_path / name, frames, depth=depth)
    out = tmp_path / name.replace("in", "out")
    counts = answer_bag(source, out, Pipeline(Truth(frames)), probabilities=True, progress=False)
    assert counts.answered == 2 and counts.failed == counts.skipped == counts.dropped == 0
    found = contents(out)
    for number, frame in enumerate(frames):
        expected = Pipeline(Truth(frames)).run(frame)
        stamp, mask = found[TOPICS.mask][number]
        assert stamp == mask.header.stamp == (number + 1) * 100 * MS
        assert mask.header.frame_id == "camera_optical_frame"
        assert np.array_equal(convert.decode_image(mask), expected.labels)
        assert np.array_equal(convert.decode_image(found[TOPICS.probabilities][number][1]), expected.probabilities)
        cloud = convert.decode_cloud(found[TOPICS.cloud][number][1])
        if depth == "32FC1":
            assert np.allclose(cloud, np.concatenate(expected.clouds), atol=1e-5)
        assert found[TOPICS.cloud][number][1].header.frame_id == "base_link"
    assert found[TOPICS.grasp] and not found[TOPICS.scene]
    assert found[TOPICS.diagnostics][-1][1].values["answered"] == "2"


@pytest.mark.parametrize("storage, ending", [("mcap", "mcap"), ("sqlite3", "db3")])
def test_both_storages_of_ros_2_are_folders_as_ros_2_writes_them_and_their_files_are_bags(
    tmp_path, frames, storage, ending
):
    """The folder has its description, with what `ros2 bag play` shall offer; the file in it is answered alone, too."""
    source = record(tmp_path / "in", frames, storage, topics=dataclasses.replace(TOPICS, tf="/tf_static"))
    (file,) = source.glob(f"*.{ending}")
    described = YAML().load(source / "metadata.yaml")["rosbag2_bagfile_information"]
    assert described["storage_identifier"] == storage and described["relative_file_paths"] == [file.name]
    offered = {
        told["topic_metadata"]["name"]: told["topic_metadata"]["offered_qos_profiles"][0]
        for told in described["topics_with_message_count"]
    }
    assert offered["/tf_static"]["durability"] == "transient_local" and offered[TOPICS.rgb]["durability"] == "volatile"
    for number, bag in enumerate((source, file)):
        out = tmp_path / f"out{number}"
        counts = answer_bag(bag, out, Pipeline(Truth(frames)), storage=storage, progress=False)
        assert counts.answered == 2 and list(out.glob(f"*.{ending}"))


def test_from_ros_2_to_ros_1_and_with_names_and_pose_as_parameters(tmp_path, frames):
    names = dataclasses.replace(TOPICS, rgb="/left/image", mask="/labels", tf="/elsewhere")
    source = record(tmp_path / "in", frames[:1], topics=names)
    T = frames[0].T_base_cam
    counts = answer_bag(
        source, tmp_path / "out.bag", Pipeline(Truth(frames)), topics=names, T_base_cam=T, progress=False
    )
    assert counts.answered == 1
    found = contents(tmp_path / "out.bag")
    assert len(found["/labels"]) == 1 and TOPICS.mask not in found


def test_a_transform_may_be_recorded_after_its_image(tmp_path, frames):
    frame = frames[0]
    with BagWriter(tmp_path / "in.bag") as bag:
        Camera(bag, topics=dataclasses.replace(TOPICS, tf="/unused")).publish(frame, 100 * MS)
        for stamp in (50, 900):
            pose = convert.encode_pose(frame.T_base_cam, Header(stamp * MS, "base_link"))
            camera = Transform(pose.header, "camera_optical_frame", pose.position, pose.orientation)
            bag.publish(TOPICS.tf, Transforms((camera,)))
    counts = answer_bag(tmp_path / "in.bag", tmp_path / "out.bag", Pipeline(Truth(frames)), progress=False)
    assert counts.answered == 1


def test_malformed_messages_of_a_bag_are_skipped(tmp_path, frames):
    header = Header(0, "camera_optical_frame")
    with BagWriter(tmp_path / "in.bag") as bag:
        camera = Camera(bag)
        for number in range(5):
            stamp = number * 100 * MS
            bag.publish(TOPICS.rgb, Image(Header(stamp, header.frame_id), 9, 9, "rgb8", 0, 27, b"\0" * 20))
            bag.publish(TOPICS.info, CameraInfo(Header(stamp, header.frame_id), 24, 32, (0.0,) * 9))
            camera.publish(small(frames[0]), stamp)
    surface = one_hot(np.full((24, 32), SURFACE)).astype(np.float32)
    counts = answer_bag(tmp_path / "in.bag", tmp_path / "out", Pipeline(lambda rgb: surface), progress=False)
    assert (counts.answered, counts.skipped, counts.failed) == (5, 10, 0)


def test_frames_of_which_a_message_was_lost_are_counted_and_named(tmp_path, frames):
    """Four moments: one whole, one without colour, two without depth."""
    ways = [{}, {"rgb": "/gone"}, {"depth": "/gone"}, {"depth": "/gone"}]
    with BagWriter(tmp_path / "in.bag") as bag:
        for number, way in enumerate(ways):
            Camera(bag, topics=dataclasses.replace(TOPICS, **way)).publish(frames[0], number * 100 * MS)
    counts = answer_bag(tmp_path / "in.bag", tmp_path / "out.bag", Pipeline(Truth(frames)), progress=False)
    assert (counts.answered, counts.lost, counts.failed, counts.skipped) == (1, 3, 0, 0)
    assert counts.reasons == {
        f"frame lost: no {TOPICS.rgb} within 20 ms": 1,
        f"frame lost: no {TOPICS.depth} within 20 ms": 2,
    }


@pytest.mark.bad_input
def test_a_topic_of_another_type_is_skipped_with_its_type(tmp_path, frames, caplog):
    with BagWriter(tmp_path / "in.bag") as bag:
        Camera(bag, topics=dataclasses.replace(TOPICS, rgb="/unused")).publish(frames[0], 0)
        bag.publish(TOPICS.rgb, Pose(Header(), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
    counts = answer_bag(tmp_path / "in.bag", tmp_path / "out.bag", Pipeline(Truth(frames)), progress=False)
    assert counts.answered == 0 and counts.skipped == 1
    assert "expected an Image, got Pose" in caplog.records[-1].getMessage()


@pytest.mark.bad_input
def test_what_cannot_be_done_with_bags_is_said(tmp_path, frames):
    pipeline = Pipeline(Truth(frames))
    with pytest.raises(FileNotFoundError):
        answer_bag(tmp_path / "nowhere.bag", tmp_path / "out.bag", pipeline)
    whole = record(tmp_path / "in.bag", frames)
    cut = tmp_path / "cut.bag"
    cut.write_bytes(whole.read_bytes()[:5000])
    with pytest.raises(ValueError, match=r"^bag: .*cut\.bag cannot be read"):
        answer_bag(cut, tmp_path / "out.bag", pipeline)
    (tmp_path / "folder").mkdir()
    with pytest.raises(ValueError, match=r"^bag: .*folder cannot be read"):
        answer_bag(tmp_path / "folder", tmp_path / "out.bag", pipeline)
    with pytest.raises(ValueError, match=r"^topics: expected /color in .* got .*/camera/rgb/image_raw"):
        answer_bag(whole, tmp_path / "out.bag", pipeline, topics=dataclasses.replace(TOPICS, rgb="/color"))
    with pytest.raises(FileExistsError):
        answer_bag(whole, cut, pipeline)
    with pytest.raises(ValueError, match=r"^storage: expected one of mcap, sqlite3, got 'zip'"):
        answer_bag(whole, tmp_path / "out.bag", pipeline, storage="zip")
    assert not (tmp_path / "out.bag").exists(), "nothing is written before the input is known to be good"
