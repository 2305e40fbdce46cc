"""Which messages belong together: those whose stamps differ by less than a bound, whatever order they come in."""

from collections import deque
from collections.abc import Sequence


class Synchronizer:
    """Approximate time synchronisation of several streams.

    `add` returns one message a stream as soon as all their stamps lie within `slop` nanoseconds, else None. Of several
    that would do, the ones nearest to the message just added are taken. Each stream keeps `depth` messages that wait;
    what is pushed out, or is older than what was taken, is counted in `unmatched`. Stamps need not rise, so that a
    camera's clock may start anew. Raises ValueError for a slop below 0 or an empty queue.

    >>> sync = Synchronizer(("rgb", "depth"), slop=10)
    >>> sync.add("rgb", 100, "image"), sync.add("depth", 50, "old"), sync.add("depth", 104, "depth")
    (None, None, {'rgb': 'image', 'depth': 'depth'})
    >>> sync.unmatched
    1
    """

    def __init__(self, streams: Sequence[str], slop: int, depth: int = 10):
        if slop < 0:
            raise ValueError(f"slop: expected nanoseconds of 0 or more, got {slop}")
        if depth < 1:
            raise ValueError(f"depth: expected at least one waiting message, got {depth}")
        self.slop, self.unmatched = slop, 0
        self._waiting = {stream: deque(maxlen=depth) for stream in streams}

    def add(self, stream: str, stamp: int, message) -> dict | None:
        """Take a message in; return the set that it completes, by stream, or None."""
        queue = self._waiting[stream]
        self.unmatched += len(queue) == queue.maxlen
        queue.append((stamp, message))
        if not all(self._waiting.values()):
            return None
        chosen = {name: min(q, key=lambda item: abs(item[0] - stamp)) for name, q in self._waiting.items()}
        chosen[stream] = (stamp, message)
        stamps = [when for when, _ in chosen.values()]
        if max(stamps) - min(stamps) > self.slop:
            return None
        for name, (when, _) in chosen.items():
            newer = [item for item in self._waiting[name] if item[0] > when]
            self.unmatched += len(self._waiting[name]) - len(newer) - 1
            self._waiting[name] = deque(newer, self._waiting[name].maxlen)
        return {name: message for name, (_, message) in chosen.items()}
