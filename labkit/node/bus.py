"""What a node needs of a transport, and the simplest one: topics within one process."""

import threading
import time
from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Callable


class Transport(ABC):
    """Topics by name. The bus, the edges to ROS and to bags: a node does not know which one it uses (topic 08)."""

    @abstractmethod
    def advertise(self, topic: str, kind: type) -> None:
        """Say that messages of the class `kind` are going to be published on a topic."""

    @abstractmethod
    def subscribe(self, topic: str, kind: type, callback: Callable) -> None:
        """Call `callback` with every message of a topic from now on; with a ValueError for one that cannot be read."""

    @abstractmethod
    def publish(self, topic: str, message) -> None:
        """Send a message to all who have subscribed."""

    @abstractmethod
    def wanted(self, topic: str) -> bool:
        """Whether anybody listens: what is large and asked for by nobody need not be made."""

    def resolve(self, topic: str) -> str:
        """Give the name that a topic has in the end; by default its own."""
        return topic

    def serve(self, name: str, request: Callable[[Callable[[bool, str], None]], None]) -> None:
        """Offer a service; whoever calls it gets what `request` gives to its argument. By default nobody can call."""
        return None

    def now(self) -> int:
        """The time, nanoseconds: by default this machine's."""
        return time.time_ns()

    def on_restart(self, callback: Callable[[], None]) -> None:
        """Call `callback` whenever the time is set back, as a simulator does; by default it never is."""
        return None

    def troubles(self) -> dict[str, str]:
        """What the middleware knows to go wrong, in words, by topic; by default nothing."""
        return {}

    def close(self) -> None:
        """Leave; at the end of a `with`, too."""
        return None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


class Bus(Transport):
    """A transport within one process, which delivers at once, in the publisher's thread.

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
        """Nobody needs to know."""

    def subscribe(self, topic: str, kind: type, callback: Callable[[object], None]) -> None:
        """Deliver every message to the callback, whatever its class."""
        with self._lock:
            self._subscribers[topic].append(callback)

    def publish(self, topic: str, message: object) -> None:
        """Deliver a message."""
        with self._lock:
            callbacks = tuple(self._subscribers.get(topic, ()))
        for callback in callbacks:
            callback(message)

    def wanted(self, topic: str) -> bool:
        """Whether anybody has subscribed."""
        with self._lock:
            return bool(self._subscribers.get(topic))
