"""A block diagram as Simulink has it: blocks and named signals between them (topic 09)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

from labkit.support.validation import require


@dataclass(frozen=True)
class Block:
    """One box: a function of the signals named in `inputs`, whose result, or tuple of results, are the `outputs`."""

    name: str
    function: Callable
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


class Diagram:
    """Blocks wired by the names of their signals, in any order of declaration.

    inputs: signals that come from outside, such as a camera's. Raises ValueError for a signal that nobody gives or two
    give, and for a loop: within one time step, a block cannot wait for itself.

    >>> double = Block("gain", lambda x: 2 * x, ("x",), ("y",))
    >>> Diagram([double], inputs=("x",)).run(x=4)["y"]
    8
    """

    def __init__(self, blocks: Sequence[Block], inputs: Sequence[str]):
        self.inputs = tuple(inputs)
        self.givers: dict[str, Block | None] = dict.fromkeys(self.inputs)
        for block in blocks:
            for signal in block.outputs:
                if signal in self.givers:
                    raise ValueError(f"blocks: expected one giver of the signal {signal!r}, {block.name!r} is another")
                self.givers[signal] = block
        for block in blocks:
            unknown = [signal for signal in block.inputs if signal not in self.givers]
            if unknown:
                raise ValueError(f"blocks: nobody gives {', '.join(map(repr, unknown))}, which {block.name!r} needs")
        graph = {block: {self.givers[signal] for signal in block.inputs} - {None} for block in blocks}
        try:
            self.blocks = tuple(TopologicalSorter(graph).static_order())
        except CycleError as error:
            names = " -> ".join(block.name for block in error.args[1])
            raise ValueError(f"blocks: expected no loop, got {names}") from error

    def run(self, **signals) -> dict:
        """Run every block once, each after those that it needs; returns all signals by name.

        Raises ValueError if the signals given are not the diagram's inputs, or a block gives another number of outputs.
        """
        if signals.keys() != set(self.inputs):
            raise ValueError(f"signals: expected {', '.join(sorted(self.inputs))}, got {', '.join(sorted(signals))}")
        signals = dict(signals)
        for block in self.blocks:
            result = block.function(*(signals[name] for name in block.inputs))
            results = (result,) if len(block.outputs) == 1 else tuple(result)
            require(block.name, len(results) == len(block.outputs), f"{len(block.outputs)} outputs", len(results))
            signals.update(zip(block.outputs, results, strict=True))
        return signals


def perception_diagram(pipeline, segment: Callable, manipulate: Callable) -> Diagram:
    """Wire the stages of a Pipeline: segmentation feeds point clouds, these a grasp pose, that the manipulator.

    segment: RGB image -> labels. manipulate: plan and scene points -> what became of them. A frame's parts come from
    outside: rgb, depth, K, T_base_cam, table_z; every signal can be looked at after a run.
    """

    def pose(clouds, scene, table_z, T_base_cam):
        return pipeline.plan(clouds, scene, table_z, T_base_cam[:3, 3])

    blocks = [
        Block("semantic segmentation", segment, ("rgb",), ("labels",)),
        Block("back projection", pipeline.back_project, ("depth", "K", "T_base_cam"), ("points",)),
        Block("point clouds", pipeline.targets, ("labels", "points", "table_z"), ("pixels", "clouds", "scene")),
        Block("grasp pose", pose, ("clouds", "scene", "table_z", "T_base_cam"), ("plan",)),
        Block("manipulator controller", manipulate, ("plan", "scene"), ("outcome",)),
    ]
    return Diagram(blocks, inputs=("rgb", "depth", "K", "T_base_cam", "table_z"))
