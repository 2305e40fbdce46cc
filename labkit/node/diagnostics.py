"""How the segmentation node is: what became of messages and frames, why, and since when nothing was answered."""

import threading
import time
from collections import Counter, OrderedDict, deque
from collections.abc import Mapping
from dataclasses import dataclass, field

OK, WARN, STALE = 0, 1, 3  # levels of diagnostics
PATIENCE = 1.0  # seconds without an answer until it is said for how long there was none
STALE_AFTER = 5.0  # seconds of trouble without an answer
RECENT = 20  # frames of which more than half must not be dropped or lost
REASONS = 50  # kinds of reasons that are kept
FATES = ("answered", "dropped", "lost", "failed", "skipped")


@dataclass
class Counts:
    """What became of the messages and frames.

    answered: frames with results published. dropped: frames that a newer one superseded before anybody looked at them.
    lost: frames of which a message never came. failed: frames that could not be used. skipped: messages that were
    malformed. `reasons` says why, and how often, the newest last.
    """

    answered: int = 0
    dropped: int = 0
    lost: int = 0
    failed: int = 0
    skipped: int = 0
    kinds: OrderedDict[tuple[str, str], tuple[int, str]] = field(default_factory=OrderedDict)

    def because(self, where: str, words: str) -> None:
        """Count a reason by where it arose and the field that its words name first; its newest words are kept.

        >>> counts = Counts()
        >>> for words in ("data: 9 bytes", "K: singular", "data: 7 bytes"):
        ...     counts.because("/rgb", words)
        >>> counts.reasons
        Counter({'/rgb: data: 7 bytes': 2, '/rgb: K: singular': 1})
        """
        kind = where, words.partition(":")[0]
        count, _ = self.kinds.get(kind, (0, ""))
        self.set(kind, count + 1, f"{where}: {words}")

    def set(self, kind: tuple[str, str], count: int, sentence: str) -> None:
        """Set how often a kind of reason was met; it is the newest then."""
        self.kinds[kind] = count, sentence
        self.kinds.move_to_end(kind)
        if len(self.kinds) > REASONS:
            self.kinds.popitem(last=False)

    @property
    def reasons(self) -> Counter[str]:
        """How often each kind of reason was met, under its newest words; the newest last."""
        return Counter({sentence: count for count, sentence in self.kinds.values() if count})


class Health:
    """Counts, and what they say of the node: in words, and at a level of diagnostics. Any thread may call it.

    inputs: the camera's streams, and the topic of each. slop: how far the stamps of one frame may lie apart,
    nanoseconds.
    """

    def __init__(self, inputs: Mapping[str, str], slop: int):
        self.counts, self.inputs = Counts(), dict(inputs)
        self._bound = f"within {slop / 1e6:g} ms"
        self._heard = Counter()  # messages by stream since the last ones that were together
        self._recent = deque(maxlen=RECENT)  # what became of frames
        self._trouble, self._since = "", None
        self._last = time.monotonic()  # when a message came, or the node began
        self._lock = threading.RLock()

    def heard(self, stream: str) -> None:
        """A message came, whatever it is worth."""
        with self._lock:
            self._heard[stream] += 1
            self._last = time.monotonic()

    def complete(self) -> None:
        """All messages of a frame came together, or what came before counts no more."""
        with self._lock:
            self._heard.clear()

    def count(self, fate: str, where: str = "", words: str = "") -> None:
        """Count what became of a frame, or that a message was skipped, and for which reason; an answer ends trouble."""
        with self._lock:
            setattr(self.counts, fate, getattr(self.counts, fate) + 1)
            if fate != "skipped":
                self._recent.append(fate)
            if where:
                self._trouble = f"{where}: {words}"
                self.counts.because(where, words)
            elif fate == "answered":
                self._trouble, self._since = "", None

    def lost(self, missing: Mapping[str, int], moments: int) -> None:
        """Of so many moments a message never came; missing: of how many by stream, as a Synchronizer counts them."""
        with self._lock:
            self._recent.extend(["lost"] * (moments - self.counts.lost))
            self.counts.lost = moments
            frames = {self.inputs[stream]: count for stream, count in missing.items()}
            frames["message of another topic"] = 0 if any(missing.values()) else moments
            for what, count in frames.items():
                kind = "frame lost", what
                if count != self.counts.kinds.get(kind, (0, ""))[0]:
                    self.counts.set(kind, count, f"frame lost: no {what} {self._bound}")

    def state(self, waiting_for: str) -> tuple[str, int]:
        """Say how it goes while no frame is answered, and at which level of diagnostics."""
        with self._lock:
            wrong = "; ".join(filter(None, (self._incomplete(), self._trouble)))
            if not wrong:
                self._since = None
                silent = time.monotonic() - self._last
                if silent > STALE_AFTER:
                    return f"no message on {' or '.join(self.inputs.values())} for {silent:.0f} s: is it on?", WARN
                return f"waiting for {waiting_for}", OK
            now = time.monotonic()
            self._since = self._since or now
            seconds = now - self._since
        told = f"no frame answered for {seconds:.0f} s: {wrong}" if seconds >= PATIENCE else wrong
        return told, STALE if seconds > STALE_AFTER else WARN

    def _incomplete(self) -> str:
        """Say which of the camera's topics are silent while others speak, or that their stamps differ."""
        if max(self._heard.values(), default=0) < 2:
            return ""
        speaking = [topic for stream, topic in self.inputs.items() if self._heard[stream]]
        if silent := [topic for topic in self.inputs.values() if topic not in speaking]:
            return f"messages on {' and '.join(speaking)}, but none on {' and '.join(silent)}"
        if self._trouble or min(self._heard.values()) < 2:  # what was skipped has been heard, too
            return ""
        return f"no stamps of {', '.join(self.inputs.values())} lie {self._bound}"

    def gone(self) -> list[str]:
        """Say what share of the newest frames was dropped or lost, if it is most of them."""
        with self._lock:
            fates = Counter(self._recent)
        dropped, lost = fates["dropped"], fates["lost"]
        return [f"{dropped} dropped and {lost} lost of {RECENT} frames"] if dropped + lost > RECENT // 2 else []

    def values(self) -> dict[str, str]:
        """The counts in words, then the reasons, the newest first."""
        with self._lock:
            counted = {fate: getattr(self.counts, fate) for fate in FATES} | dict(reversed(self.counts.reasons.items()))
        return {name: str(count) for name, count in counted.items()}
