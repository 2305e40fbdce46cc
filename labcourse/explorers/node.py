"""Explorers of topic 08: what a frame's age costs in millimetres, and which messages belong together."""

from dataclasses import dataclass

import ipywidgets
import numpy as np
from jaxtyping import Int
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from labcourse.explorers.explorer import Explorer
from labkit.node.sync import Synchronizer

TRANSPORT_MS = 8.0  # from the shutter to the node
OPENING_MM, OBJECT_MM, FINGER_MM = 80.0, 50.0, 14.0  # the Panda's jaws, a block on a belt
MARGIN_MM = (OPENING_MM - OBJECT_MM) / 2  # how far off the hand may be before a finger comes down on the block
FREE, LOST, ANSWERED = "0.75", "tab:red", "tab:blue"


@dataclass(frozen=True)
class Journey:
    """One frame on its way, milliseconds: taken by the camera, arrived at the node, and worked on from begin to end.

    begin and end are None for a frame that a newer one superseded.
    """

    taken: float
    arrived: float
    begin: float | None = None
    end: float | None = None


def journeys(rate: int | float, network_ms: int | float, seconds: float = 0.6) -> list[Journey]:
    """Follow the frames of a camera through a node that takes network_ms for each and always takes the newest.

    The frames are those taken in the first `seconds`; the camera goes on after them, so that the last ones may be
    superseded, too.

    >>> [journey.end for journey in journeys(rate=10.0, network_ms=50.0, seconds=0.3)]
    [58.0, 158.0, 258.0]
    >>> [journey.begin for journey in journeys(rate=10.0, network_ms=150.0, seconds=0.4)]
    [8.0, 158.0, None, 308.0]
    """
    period = 1000.0 / rate
    found, free = [], 0.0
    for k in range(round(seconds * rate)):
        arrived = k * period + TRANSPORT_MS
        begin = max(arrived, free)
        if arrived + period <= begin + 1e-6:  # a newer one is there; one that comes just then counts, rounded or not
            found.append(Journey(arrived - TRANSPORT_MS, arrived))
        else:
            free = begin + network_ms
            found.append(Journey(arrived - TRANSPORT_MS, arrived, begin, free))
    return found


def lag_explorer() -> Explorer:
    """A timeline of messages beside the grasp: what latency costs where things move.

    Controls: network (ms a frame), rate (frames a second), speed (of the belt, mm/s).
    """

    def draw(figure: Figure, network: int, rate: int, speed: int) -> None:
        line, above = figure.subplots(1, 2, width_ratios=[1.7, 1.0])
        way = journeys(rate, network)
        last = [journey for journey in way if journey.end is not None][-1]
        age = last.end - last.taken
        draw_journeys(line, way)
        line.set_title(
            f"{sum(j.end is None for j in way)} of {len(way)} frames superseded, the last answer is {age:.0f} ms old"
        )
        draw_grasp(above, speed * age / 1000.0)

    controls = {
        "network": ipywidgets.IntSlider(200, min=5, max=300, step=5, description="network (ms)"),
        "rate": ipywidgets.IntSlider(15, min=5, max=60, description="rate (Hz)"),
        "speed": ipywidgets.IntSlider(100, min=0, max=300, step=10, description="belt (mm/s)"),
    }
    return Explorer(draw, controls, size=(9.5, 3.1))


def draw_journeys(axes: Axes, way: list[Journey]) -> None:
    """A row for what the camera takes, one for what the node does; a line joins the two."""
    for journey in way:
        lost = journey.end is None
        axes.plot(journey.taken, 1.0, "o", color=LOST if lost else ANSWERED, ms=5)
        if lost:
            axes.plot(journey.arrived, 0.55, "x", color=LOST)
            axes.plot([journey.taken, journey.arrived], [1.0, 0.55], color=LOST, lw=0.6)
            continue
        axes.plot([journey.taken, journey.arrived, journey.begin], [1.0, 0.55, 0.3], color=ANSWERED, lw=0.8)
        axes.add_patch(Rectangle((journey.begin, 0.0), journey.end - journey.begin, 0.3, fc=FREE, ec=ANSWERED))
        axes.plot(journey.end, 0.15, ">", color=ANSWERED, ms=6)
    axes.set_yticks([0.15, 0.55, 1.0], ["perceive", "arrive", "camera"])
    axes.set(ylim=(-0.1, 1.15), xlabel="time (ms)")


def draw_grasp(axes: Axes, error_mm: float) -> None:
    """The block where it is, and the jaws where the answer says that it was; seen from above, millimetres."""
    hits = error_mm > MARGIN_MM
    axes.add_patch(Rectangle((error_mm - OBJECT_MM / 2, -20), OBJECT_MM, 40, color="tab:orange"))
    axes.add_patch(Rectangle((-OBJECT_MM / 2, -20), OBJECT_MM, 40, fill=False, ec="0.5", ls=":"))
    for left in (-OPENING_MM / 2 - FINGER_MM, OPENING_MM / 2):
        axes.add_patch(Rectangle((left, -12), FINGER_MM, 24, color="tab:red" if hits else "0.3"))
    axes.set(xlim=(-70, 110), ylim=(-45, 45), xlabel="along the belt (mm)", yticks=[])
    axes.set_aspect("equal")
    axes.set_title(f"error {error_mm:.1f} mm: " + ("a finger hits it" if hits else "the jaws still fit"))


def two_streams(jitter_ms: float, lost: float, seed: int = 4) -> tuple[Int[np.ndarray, "A"], Int[np.ndarray, "B"]]:
    """Draw stamps of colour and depth, microseconds, over half a second at 30 Hz, with jitter and lost messages."""
    rng = np.random.default_rng(seed)
    regular = 33_333 * np.arange(15)
    streams = [regular + rng.integers(0, max(1, round(1000 * jitter_ms)), 15) for _ in "ab"]
    kept = [rng.random(15) >= lost for _ in "ab"]
    a, b = (np.sort(stamps[there]) for stamps, there in zip(streams, kept, strict=True))
    return a, b


def synchronised(a: Int[np.ndarray, "A"], b: Int[np.ndarray, "B"], slop: int) -> list[tuple[int, int]]:
    """The pairs of stamps that the kit's Synchronizer makes of two streams that arrive in the order of their stamps.

    >>> synchronised(np.array([0, 33, 66]), np.array([5, 68]), slop=10)
    [(0, 5), (66, 68)]
    """
    sync, found = Synchronizer(("a", "b"), slop), []
    arrivals = [(int(stamp), name) for name, stamps in (("a", a), ("b", b)) for stamp in stamps]
    for stamp, name in sorted(arrivals):
        if together := sync.add(name, stamp, stamp):
            found.append((together["a"], together["b"]))
    return found


def sync_explorer() -> Explorer:
    """Two streams of stamps and the pairs that they make. Controls: slop and jitter (ms), lost (share of messages)."""

    def draw(figure: Figure, slop: float, jitter: float, lost: float) -> None:
        axes = figure.subplots()
        a, b = two_streams(jitter, lost)
        pairs = synchronised(a, b, round(1000 * slop))
        for name, stamps, height in (("colour", a, 1.0), ("depth", b, 0.0)):
            single = np.setdiff1d(stamps, np.array(pairs).reshape(-1, 2)[:, 0 if height else 1])
            axes.plot(stamps / 1000, np.full(len(stamps), height), "o", color=ANSWERED, label=name)
            axes.plot(single / 1000, np.full(len(single), height), "x", color=LOST, ms=11)
        for i, j in pairs:
            axes.plot([i / 1000, j / 1000], [1.0, 0.0], color=ANSWERED, lw=1.2)
        worst = max((abs(i - j) for i, j in pairs), default=0) / 1000
        axes.set_title(f"{len(pairs)} pairs, the worst {worst:.1f} ms apart; alone: {len(a) + len(b) - 2 * len(pairs)}")
        axes.set_yticks([0.0, 1.0], ["depth", "colour"])
        axes.set(ylim=(-0.3, 1.3), xlabel="stamp (ms)")

    controls = {
        "slop": ipywidgets.FloatSlider(value=10.0, min=0.0, max=60.0, step=1.0, description="slop (ms)"),
        "jitter": ipywidgets.FloatSlider(value=12.0, min=0.0, max=30.0, step=1.0, description="jitter (ms)"),
        "lost": ipywidgets.FloatSlider(value=0.2, min=0.0, max=0.6, step=0.1, description="lost"),
    }
    return Explorer(draw, controls, size=(8.5, 2.6))
