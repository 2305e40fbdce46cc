"""The whole diagram of topic 08 in one process: camera topics, node, grasp, and the arm that lifts."""

from labkit.node.actors import Arm, Camera
from labkit.node.bus import Bus
from labkit.node.messages import Diagnostics, PointCloud2, Topics
from labkit.node.segmentation import SegmentationNode
from labkit.pipeline import Pipeline


def camera_to_lift(spec, pipeline: Pipeline, size: tuple[int, int] = (320, 240)) -> str:
    """Build a scene, publish what its camera sees, let the node answer and the arm act; one line says what happened.

    spec: a SceneSpec. pipeline: with the height of the spec's table. Nothing but messages goes from one to the next.
    """
    from labkit.sim.world import World  # PyBullet, for whoever has a scene

    bus, topics, heard = Bus(), Topics(), {}
    for topic, kind in ((topics.cloud, PointCloud2), (topics.diagnostics, Diagnostics)):
        bus.subscribe(topic, kind, lambda message, topic=topic: heard.update({topic: message}))
    node = SegmentationNode(pipeline, bus)
    with World(spec) as world:
        arm = Arm(bus, world)
        Camera(bus).publish(world.render(size))
        answered = node.spin_once()
        result = arm.act(timeout=0.0)
    said = heard[topics.diagnostics]
    if not answered:
        return f"scene {spec.seed}: {said.message}"
    told = (
        f"scene {spec.seed}: frame answered, {heard[topics.cloud].width} target points, grasp: {said.values['grasp']}"
    )
    if not said.values["grasp"].startswith("best"):
        return told
    return f"{told}, {f'lifted {result.name}' if result.success else f'not lifted: {result.reason}'}"
