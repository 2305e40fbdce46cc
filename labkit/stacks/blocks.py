"""A block diagram as Simulink has it: blocks and named signals between them; it runs and draws itself (topic 09)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

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

    def columns(self) -> dict[Block, int]:
        """The column that each block is drawn in: 1 more than those that it waits for; column 0 is the outside."""
        column: dict[Block, int] = {}
        for block in self.blocks:
            column[block] = 1 + max((self._column(column, signal) for signal in block.inputs), default=0)
        return column

    def _column(self, column: Mapping[Block, int], signal: str) -> int:
        """The column that a signal comes from."""
        giver = self.givers[signal]
        return 0 if giver is None else column[giver]

    def places(self) -> dict[tuple[Block | str, int], tuple[float, float]]:
        """Where to draw: (block, column) -> (x, y), and (signal, column) where a wire passes through a column.

        In each column the things stand in the order of where their signals come from, so that few wires cross.
        """
        column = self.columns()
        last = dict.fromkeys(self.inputs, 0)
        for block in self.blocks:
            last.update({signal: max(last.get(signal, 0), column[block]) for signal in block.inputs})
        places = {(signal, 0): (0.0, self._height(n, len(self.inputs))) for n, signal in enumerate(self.inputs)}
        for c in range(1, 1 + max(column.values(), default=0)):
            passing = [signal for signal in last if self._column(column, signal) < c < last[signal]]
            things = [block for block in self.blocks if column[block] == c] + passing

            def from_above(thing, c=c):
                signals = thing.inputs if isinstance(thing, Block) else (thing,)
                return -np.mean([self._source(places, signal, c)[1] for signal in signals] or [0.0])

            for n, thing in enumerate(sorted(things, key=from_above)):
                places[thing, c] = (2.0 * c, self._height(n, len(things)))
        return places

    @staticmethod
    def _height(n: int, count: int) -> float:
        return 0.9 * ((count - 1) / 2.0 - n)

    def _source(self, places: Mapping, signal: str, c: int) -> tuple[float, float]:
        """Where a wire comes from that reaches column c: the column before, or its giver's port there."""
        if (signal, c - 1) in places:
            return places[signal, c - 1]
        giver = self.givers[signal]
        x, y = places[giver, c - 1]
        port = (len(giver.outputs) - 1) / 2.0 - giver.outputs.index(signal)
        return x + 0.6, y + 0.28 * port

    def draw(self, axes: Axes) -> None:
        """Draw the boxes, the wires, and signals' names where they leave their givers; the outside is at the left."""
        places = self.places()
        for (thing, c), (x, y) in places.items():
            if isinstance(thing, Block):
                shape = {"boxstyle": "round,pad=0.04", "fc": "#e8eef7", "ec": "#33506f"}
                axes.add_patch(FancyBboxPatch((x - 0.56, y - 0.26), 1.12, 0.52, zorder=3, **shape))
                axes.text(x, y, thing.name.replace(" ", "\n"), ha="center", va="center", fontsize=9, zorder=4)
                self._draw_wires(axes, places, thing, c)
            elif c == 0:
                axes.text(x - 0.05, y, thing, ha="right", va="center", style="italic")
        heights = [y for _, y in places.values()]
        axes.set(xlim=(-1.2, 2.0 * max(c for _, c in places) + 0.7), ylim=(min(heights) - 0.5, max(heights) + 0.5))
        axes.axis("off")

    def _draw_wires(self, axes: Axes, places: Mapping, block: Block, c: int) -> None:
        """Draw what leads to a block, uppermost wire to its uppermost port."""
        x1, y1 = places[block, c]
        arriving = sorted(block.inputs, key=lambda signal: -self._source(places, signal, c)[1])
        for port, signal in enumerate(arriving):
            points, at = [(x1 - 0.62, y1 + 0.2 * ((len(arriving) - 1) / 2.0 - port))], c
            while True:
                points.append(self._source(places, signal, at))
                at -= 1
                if at == 0 or (signal, at) not in places:
                    break
            end, bend = points[:2]
            style = {"arrowstyle": "-|>", "color": "0.35", "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", end, bend, arrowprops=style)
            axes.plot(*zip(*points[1:], strict=True), color="0.35", lw=1.0)
            named = {text.get_text() for text in axes.texts}
            if self.givers[signal] is not None and signal not in named:
                x, y = points[-1]
                white = {"fc": "white", "ec": "none", "pad": 0.6}
                axes.text(x + 0.08, y + 0.03, signal, va="bottom", fontsize=8, bbox=white, zorder=5)


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
