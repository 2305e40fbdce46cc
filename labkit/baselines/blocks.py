"""A block diagram as Simulink has it: blocks and named signals between them; it runs and draws itself (section 9)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

from labkit.geometry import back_project_to_base, cluster, remove_outliers
from labkit.grasp import plan_grasps
from labkit.labels import TARGET


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
            if len(results) != len(block.outputs):
                raise ValueError(f"{block.name}: expected {len(block.outputs)} outputs, got {len(results)}")
            signals.update(zip(block.outputs, results, strict=True))
        return signals

    def columns(self) -> dict[Block, int]:
        """How many blocks stand before each one on the longest way to it: where it is drawn."""
        depth: dict[Block, int] = {}
        for block in self.blocks:
            before = [depth[self.givers[signal]] for signal in block.inputs if self.givers[signal] is not None]
            depth[block] = 1 + max(before, default=-1)
        return depth

    def draw(self, axes: Axes) -> None:
        """Draw the boxes, the arrows and the signals' names; what comes from outside enters at the left."""
        columns = self.columns()
        count = {column: list(columns.values()).count(column) for column in columns.values()}
        rows: dict[int, int] = {}
        places: dict[Block | str, tuple[float, float]] = {}
        for block, column in columns.items():
            row = rows.setdefault(column, 0)
            rows[column] += 1
            places[block] = (2.0 * column + 2.0, (count[column] - 1) / 2.0 - row)
        for number, signal in enumerate(self.inputs):
            places[signal] = (0.0, 0.8 * ((len(self.inputs) - 1) / 2.0 - number))
        for (x, y), thing in ((place, thing) for thing, place in places.items()):
            self._draw_thing(axes, thing, x, y)
        for block in self.blocks:
            for port, signal in enumerate(block.inputs):
                self._draw_arrow(axes, places, block, signal, (len(block.inputs) - 1) / 2.0 - port)
        axes.set(xlim=(-0.7, 2.0 * max(columns.values(), default=0) + 3.0))
        axes.margins(y=0.25)
        axes.axis("off")

    def _draw_thing(self, axes: Axes, thing, x: float, y: float) -> None:
        if isinstance(thing, str):
            axes.text(x, y, thing, ha="center", va="center", style="italic")
            return
        box = FancyBboxPatch((x - 0.55, y - 0.28), 1.1, 0.56, boxstyle="round,pad=0.04", fc="#e8eef7", ec="#33506f")
        axes.add_patch(box)
        axes.text(x, y, thing.name.replace(" ", "\n"), ha="center", va="center", fontsize=9)

    def _draw_arrow(self, axes: Axes, places: Mapping, block: Block, signal: str, port: float) -> None:
        giver = self.givers[signal]
        x0, y0 = places[signal if giver is None else giver]
        x1, y1 = places[block]
        start, end = (x0 + (0.45 if giver is None else 0.6), y0), (x1 - 0.6, y1 + 0.12 * port)
        axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": "0.35", "shrinkA": 0, "shrinkB": 0})
        if giver is not None:
            axes.text((start[0] + end[0]) / 2, (start[1] + end[1]) / 2 + 0.07, signal, ha="center", fontsize=8)


def perception_diagram(segment: Callable, manipulate: Callable, table_z: float = 0.0) -> Diagram:
    """Section 9's diagram: segmentation feeds point cloud processing, that a pose, that the manipulator's controller.

    segment: RGB image -> labels. manipulate: grasps and scene points -> what became of them. The frame's parts come
    from outside: rgb, depth, K, T_base_cam; every signal can be looked at after a run.
    """

    def clouds(labels, points):
        seen = np.isfinite(points[..., 2])
        target = cluster(remove_outliers(points[seen & (labels == TARGET)]))
        return target, points[seen & (points[..., 2] > table_z - 0.02)]

    def pose(target, scene, T_base_cam):
        return plan_grasps(target, scene, table_z, T_base_cam[:3, 3])

    blocks = [
        Block("semantic segmentation", segment, ("rgb",), ("labels",)),
        Block("back projection", back_project_to_base, ("depth", "K", "T_base_cam"), ("points",)),
        Block("point clouds", clouds, ("labels", "points"), ("target", "scene")),
        Block("object pose", pose, ("target", "scene", "T_base_cam"), ("grasps",)),
        Block("manipulator controller", manipulate, ("grasps", "scene"), ("outcome",)),
    ]
    return Diagram(blocks, inputs=("rgb", "depth", "K", "T_base_cam"))
