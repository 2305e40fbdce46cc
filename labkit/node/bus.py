"""A transport within one process: topics by name, delivered at once, in the publisher's thread."""

import threading
from collections import defaultdict
from collections.abc import Callable


class Bus:
    """What a node needs of a transport: `advertise`, `publish`, `subscribe`, and `wanted`.

    The edges to ROS and to bags have the same four methods, so that nodes do not know which one they use.

    >>> bus, seen = Bus(), []
    >>> bus.subscribe("/mask", object, seen.append)
    >>> bus.publish("/mask", "a message")
    >>> seen, bus.wanted("/cloud")
    (['a message'], False)
    """

    def __init__(self):
        self._subscribers = defaultdict(list)
        self._lock = threading.Lock()

    def advertise(self, topic: str, kind: type) -> None:
        """Say that messages of the class `kind` are going to be published on a topic; here nobody needs to know."""

    def subscribe(self, topic: str, kind: type, callback: Callable[[object], None]) -> None:
        """Call `callback` with every message of a topic from now on; `kind` is the class that is expected."""
        with self._lock:
            self._subscribers[topic].append(callback)

    def publish(self, topic: str, message: object) -> None:
        """Deliver a message to all who have subscribed."""
        with self._lock:
            callbacks = tuple(self._subscribers.get(topic, ()))
        for callback in callbacks:
            callback(message)

    def wanted(self, topic: str) -> bool:
        """Whether anybody listens: what is large and asked for by nobody need not be made."""
        with self._lock:
            return bool(self._subscribers.get(topic))
