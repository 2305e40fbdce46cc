"""Where frames stood when: a tree of stamped transforms, as the topics /tf and /tf_static describe it.

An image is of the past by the time it is used. The transform to use is the one of the image's stamp, not the latest.
"""

import bisect
import threading

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation, Slerp

from labkit.node.convert import rigid
from labkit.node.messages import NANOSECONDS, Transform


class TransformTree:
    """Transforms by child frame, each with its parent; moving ones are kept for `seconds` and interpolated (topic 08).

    A frame has one parent and is static or moves: what was said last holds, and what was known before is forgotten. Of
    two transforms of one stamp, too, the last one holds. One thread may fill the tree while another asks it.

    >>> tree = TransformTree()
    >>> from labkit.node.messages import Header
    >>> for stamp, x in ((0, 1.0), (100, 2.0)):
    ...     tree.add(Transform(Header(stamp, "base"), "camera", (x, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
    >>> tree.lookup("base", "camera", 25)[:3, 3].tolist()
    [1.25, 0.0, 0.0]
    """

    def __init__(self, seconds: float = 10.0):
        self._span = seconds * NANOSECONDS
        self._parents: dict[str, str] = {}
        self._static: set[str] = set()
        self._histories: dict[str, list[tuple[int, np.ndarray]]] = {}
        self._lock = threading.Lock()

    def add(self, transform: Transform, static: bool = False) -> None:
        """Take a transform in; raises ValueError if its quaternion is no rotation or the name of a frame is missing.

        One that is older than the newest by more than the kept time begins a new history: the clock was set back.
        """
        parent, child, stamp = transform.header.frame_id, transform.child_frame_id, transform.header.stamp
        if not parent or not child or parent == child:
            raise ValueError(f"transform: expected the names of two frames, got {parent!r} and {child!r}")
        T_parent_child = rigid(transform.translation, transform.rotation)
        with self._lock:
            if self._parents.get(child) != parent or (child in self._static) != static:
                self._static.discard(child)
                self._histories[child] = []
            self._parents[child] = parent
            history = self._histories[child]
            if static:
                self._static.add(child)
                history[:] = [(stamp, T_parent_child)]
                return
            if history and stamp < history[-1][0] - self._span:
                history.clear()
            at = bisect.bisect_left(history, stamp, key=lambda item: item[0])
            said_before = at < len(history) and history[at][0] == stamp
            history[at : at + said_before] = [(stamp, T_parent_child)]
            while history[-1][0] - history[0][0] > self._span:
                history.pop(0)

    def forget(self) -> None:
        """Forget where moving frames were, because the clock was set back; static ones stay."""
        with self._lock:
            for child in self._histories.keys() - self._static:
                del self._histories[child], self._parents[child]

    def lookup(self, target: str, source: str, stamp: int) -> Float[np.ndarray, "4 4"]:
        """Give T_target_source at a time: it maps the source frame's coordinates to the target's.

        Raises LookupError, with the reason, if the frames are not connected or the time lies outside what is known.
        """
        with self._lock:
            up_target, up_source = self._ancestors(target), self._ancestors(source)
            common = next((frame for frame in up_source if frame in up_target), None)
            if common is None:
                for name in (target, source):
                    if name.startswith("/"):
                        raise LookupError(
                            f"frame id: expected {name[1:]!r}, for tf's have no slash first, got {name!r}"
                        )
                raise LookupError(f"no transform between {target!r} and {source!r}")
            T_common_target = self._chain(up_target[: up_target.index(common)], stamp)
            T_common_source = self._chain(up_source[: up_source.index(common)], stamp)
        return np.linalg.solve(T_common_target, T_common_source)  # inv(T_common_target) @ T_common_source

    def _ancestors(self, frame: str) -> list[str]:
        """A frame, its parent, and so on up to the root, or until a loop closes."""
        found = [frame]
        while (parent := self._parents.get(found[-1])) is not None and parent not in found:
            found.append(parent)
        return found

    def _chain(self, frames: list[str], stamp: int) -> np.ndarray:
        T = np.eye(4)
        for frame in frames:
            T = self._at(frame, stamp) @ T
        return T

    def _at(self, child: str, stamp: int) -> np.ndarray:
        """T_parent_child at a time: straight between the neighbours' places, and on the shortest turn."""
        history = self._histories[child]
        if child in self._static:
            return history[0][1]
        first, last = history[0][0], history[-1][0]
        if not first <= stamp <= last:
            side, by = ("before the first", first - stamp) if stamp < first else ("after the last", stamp - last)
            raise LookupError(f"{child!r}: the image is {by / NANOSECONDS:.3f} s {side} known transform")
        after = bisect.bisect_left(history, stamp, key=lambda item: item[0])
        if history[after][0] == stamp:
            return history[after][1]
        (t0, T0), (t1, T1) = history[after - 1 : after + 1]
        share = (stamp - t0) / (t1 - t0)
        turns = Slerp([0.0, 1.0], Rotation.from_matrix([T0[:3, :3], T1[:3, :3]]))
        T = np.eye(4)
        T[:3, :3] = turns(share).as_matrix()
        T[:3, 3] = (1.0 - share) * T0[:3, 3] + share * T1[:3, 3]
        return T
