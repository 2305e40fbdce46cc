"""Which messages belong together: those whose stamps differ by less than a bound, whatever order they come in."""

from collections import Counter, deque
from collections.abc import Sequence

from labkit.node.messages import NANOSECONDS
from labkit.support.validation import require


class Synchronizer:
    """Approximate time synchronisation of several streams (topic 08).

    `add` returns one message per stream as soon as all their stamps lie within `slop` nanoseconds, else None. Of
    several sets that would do, it takes the one whose messages are in sum nearest to the one just added. Each stream
    keeps `depth` messages that wait. A message that is pushed out, or is older than what was taken, is counted in
    `left`, by stream.

    Stamps need not rise. A stamp that is `restart` nanoseconds behind its stream's newest says that the clock was set
    back: what waits is then of the time before, and pairs with nothing that comes after. Raises ValueError for a slop
    below 0 or an empty queue.

    >>> sync = Synchronizer(("rgb", "depth"), slop=10)
    >>> sync.add("rgb", 100, "image"), sync.add("depth", 50, "old"), sync.add("depth", 104, "depth")
    (None, None, {'rgb': 'image', 'depth': 'depth'})
    >>> sync.unmatched
    1
    """

    def __init__(self, streams: Sequence[str], slop: int, depth: int = 10, restart: int = NANOSECONDS):
        require("slop", slop >= 0, "nanoseconds of 0 or more", slop)
        require("depth", depth >= 1, "at least one waiting message", depth)
        self.slop, self.restart, self.left = slop, restart, Counter()
        self._waiting = {stream: deque(maxlen=depth) for stream in streams}
        self._newest: dict[str, int] = {}
        self._to_follow: set[str] = set()  # streams that have sent nothing since another one's clock was set back

    @property
    def unmatched(self) -> int:
        """How many messages went without the others of their moment."""
        return self.left.total()

    def missing(self) -> dict[str, int]:
        """Give the number of moments that were lost because a stream's message did not come, by stream."""
        moments = max(self.left.values(), default=0)
        return {stream: moments - self.left[stream] for stream in self._waiting}

    def add(self, stream: str, stamp: int, message) -> dict | None:
        """Take a message in; return the set that it completes, by stream, or None."""
        self._follow_clock(stream, stamp)
        queue = self._waiting[stream]
        self.left[stream] += len(queue) == queue.maxlen
        queue.append((stamp, message))
        if not all(self._waiting.values()):
            return None
        chosen = self._nearest_set({**self._waiting, stream: [(stamp, message)]}, stamp)
        if chosen is None:
            return None
        for name, (when, _) in chosen.items():
            newer = [item for item in self._waiting[name] if item[0] > when]
            self.left[name] += len(self._waiting[name]) - len(newer) - 1
            self._waiting[name] = deque(newer, self._waiting[name].maxlen)
        return {name: message for name, (_, message) in chosen.items()}

    def _nearest_set(self, waiting: dict, stamp: int) -> dict | None:
        """A message of each stream within `slop` of each other, nearest to a stamp; None if there is no such set.

        The earliest of a set is one of those that wait: from each of them on, the nearest of every stream.
        """
        best, least = None, None
        for first in sorted({when for queue in waiting.values() for when, _ in queue}):
            if not stamp - self.slop <= first <= stamp:
                continue
            near = {name: [item for item in q if first <= item[0] <= first + self.slop] for name, q in waiting.items()}
            if not all(near.values()):
                continue
            chosen = {name: min(items, key=lambda item: abs(item[0] - stamp)) for name, items in near.items()}
            total = sum(abs(when - stamp) for when, _ in chosen.values())
            if least is None or total < least:
                best, least = chosen, total
        return best

    def flush(self) -> None:
        """Give up what waits, and count it: nothing more will come."""
        for name, queue in self._waiting.items():
            self.left[name] += len(queue)
            queue.clear()

    def _follow_clock(self, stream: str, stamp: int) -> None:
        newest = self._newest.get(stream, stamp)
        set_back = stamp < newest - self.restart
        self._newest[stream] = stamp if set_back else max(stamp, newest)
        if set_back and stream not in self._to_follow:
            self.flush()
            self._to_follow = self._waiting.keys() - {stream}
        self._to_follow.discard(stream)
