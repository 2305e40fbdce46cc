"""What one answer may use: seconds, memory, files, threads."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """What one answer may use. Seconds are of CPU time (`stopwatch`), but for start_s, of the clock; MB of memory are
    address space, with torch or without it.

    case_s: for one call; question_s: for all cases of a question; submission_s: for all answers of a notebook in one
    run, but least_s is left for each. asleep_s: of the clock, for all cases of a question together, in which it neither
    computes nor waits for a processor; None where nobody waits for it. container: whether this machine is a container
    that is made for one submission; then there is no bubblewrap, and answers only become another user.
    """

    start_s: float = 120.0
    case_s: float = 10.0
    question_s: float = 20.0
    submission_s: float = 60.0
    least_s: float = 1.0
    asleep_s: float | None = None
    memory_mb: int = 1024
    torch_memory_mb: int = 3072
    file_mb: int = 16
    threads: int = 32
    container: bool = False
