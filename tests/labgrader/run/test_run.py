"""One worker runs an answer: whatever that does, the check goes on, and this process is as it was before."""

import os
import subprocess
import sys
import textwrap
import threading
import time
import warnings
from contextlib import contextmanager

import numpy as np
import psutil
import pytest

from labgrader.comparison import UNTRIED, Problem, is_large
from labgrader.course import find
from labgrader.program.slice import Program
from labgrader.reply.finding import Span
from labgrader.run import subprocess_worker
from labgrader.run.run import Budget, Limits, Run, public_cases
from labgrader.run.stopwatch import Stopwatch, waited_s

pytestmark = pytest.mark.bad_input  # without the shape checks, as outside the suite
IOU = find("04_iou.iou")
PATIENT, SHORT = Limits(question_s=250.0, case_s=250.0), Limits(question_s=0.4)
RIGHT = "    i = np.diag(n)\n    with np.errstate(all='ignore'):\n        return i / (n.sum(0) + n.sum(1) - i)\n"
WRONG = RIGHT.replace("- i)", "+ i)")


def judged(*sources: str, limits: Limits = PATIENT):
    """The verdict on an answer in some cells, what it printed, and the findings."""
    pieces = [(f"cell {i}", text) for i, text in enumerate(("import numpy as np", *sources))]
    with Run(IOU, Program(tuple(pieces)), subprocess_worker.fresh_worker, limits) as answer:
        verdict, _ = answer.judge(public_cases(IOU))
        return verdict, answer.worker.printed(), answer.findings()


def test_a_right_answer_passes_and_a_wrong_one_gets_its_place():
    assert judged("def iou(n):\n" + RIGHT)[0].passed
    verdict, _, found = judged("def iou(n):\n" + WRONG)
    assert verdict.problem.says == "2 of 2 values are wrong" and verdict.where == "hand-made case 1 of 9"
    assert (found[0].kind, found[0].piece, found[0].spans) == ("operator", 1, (Span(4, 39, 4, 42),))


@pytest.mark.parametrize("source", [WRONG, RIGHT.replace("n.sum(0)", "n.sum(0).astype(np.int32)")])
def test_a_large_case_is_not_tried_once_a_usual_one_is_wrong_and_the_reply_is_the_same(source):
    program, cases = Program((("np", "import numpy as np"), ("iou", "def iou(n):\n" + source))), public_cases(IOU)
    large = [is_large(case) for case in cases]
    with Run(IOU, program, subprocess_worker.fresh_worker, PATIENT) as answer:
        whole, all_outputs = answer.judge(cases)
        brief, outputs = answer.judge(cases, brief=True)
    usual_is_wrong = source == WRONG
    assert any(large) and not any(output is UNTRIED for output in all_outputs)
    assert [output is UNTRIED for output in outputs] == [usual_is_wrong and which for which in large]
    assert (brief.where, brief.problem, brief.hint) == (whole.where, whole.problem, whole.hint) and not brief.passed


def test_a_slow_answer_is_not_tried_on_all_cases_once_a_usual_one_is_wrong(monkeypatch):
    monkeypatch.setattr("labgrader.run.run.ENOUGH_S", 0.0)
    program = Program((("np", "import numpy as np"), ("iou", "def iou(n):\n" + WRONG)))
    with Run(IOU, program, subprocess_worker.fresh_worker, PATIENT) as answer:
        verdict, outputs = answer.judge(public_cases(IOU), brief=True)
    assert [output is UNTRIED for output in outputs] == [False, *[True] * (len(outputs) - 1)]
    assert (
        verdict.where.startswith("hand-made case 1 of") and verdict.tried[0] == [public_cases(IOU)[0]] and verdict.hint
    )


@pytest.mark.parametrize("seconds, looks", [(0.1, ["watch", "repair"]), (3.0, ["repair"])])
def test_no_watch_looks_at_an_answer_that_takes_longer_than_it_may(seconds, looks):
    program, asked = Program((("np", "import numpy as np"), ("iou", "def iou(n):\n" + WRONG))), []
    with Run(IOU, program, subprocess_worker.fresh_worker, PATIENT) as answer:
        answer.judge(public_cases(IOU))
        answer.called_s, answer.worker.ask = seconds, lambda request, *limits: asked.append(request[0])
        answer.findings()
    assert asked == looks


def test_every_answer_has_a_process_that_has_run_nothing():
    leave = "import builtins, sys\nbuiltins.left = sys.left = np.left = 1\n"
    look = "import builtins, sys\nleft = [hasattr(where, 'left') for where in (builtins, sys, np)]\n"
    assert judged(leave + "def iou(n):\n" + RIGHT)[0].passed
    assert judged(look + "def iou(n):\n    assert not any(left)\n" + RIGHT)[0].passed


NASTY = """
import os, random, sys, warnings
np.random.seed(0)
np.seterr(all="raise")
np.sum = np.random.random = None
np.set_printoptions(precision=1)
warnings.simplefilter("error")
random.seed(0)
os.environ["LEFT"] = "1"
os.chdir("/")
sys.modules["json"] = sys.modules["math"] = None
sys.path.append("left")
sys.setrecursionlimit(200)
"""


def test_nothing_that_an_answer_does_reaches_this_process():
    """The suite's own state stands for a kernel's: a program that runs, and one whose mistake is looked for."""

    def state():
        modules = {name: id(module) for name, module in sys.modules.items() if not name.startswith("labgrader")}
        numbers = np.random.get_state()[1].tolist(), np.geterr(), np.get_printoptions()["precision"]  # noqa: NPY002
        return (os.getcwd(), dict(os.environ), list(sys.path), sys.getrecursionlimit(), list(warnings.filters),
                numbers, id(np.sum), modules["json"], modules["math"], sys.stdout, sys.stderr)  # fmt: skip

    public_cases(IOU)
    before = state()
    for body in (RIGHT, WRONG):
        judged(NASTY + "def iou(n):\n    n[:] = 0\n    globals()['x'] = 1\n" + body)
    assert state() == before and public_cases(IOU)[0].args[0].any() and "x" not in globals()


# Begins an answer that works for some seconds.
SLOW = "import time\ndef iou(n):\n    end = time.process_time() + {}\n    while time.process_time() < end: pass\n"
# What an answer does, the kind of the problem that it is, and what is said of it.
PROBLEMS = [
    ("def iou(n):\n    return n[7]", "exception", "IndexError: index 7 is out of bounds"),
    ("def iou(n):\n    raise NotImplementedError", "unanswered", "not answered yet"),
    ("def iou(n):\n    return g(n)\ndef g(n):\n    raise SystemExit(0)", "exception", "SystemExit: 0"),
    ("def iou(n):\n    raise KeyboardInterrupt", "exception", "KeyboardInterrupt"),
    ("def iou(n): return iou(n)", "exception", "RecursionError: maximum recursion depth"),
    ("def iou(n): return float(input())", "exception", "EOFError"),
    ("class Odd(Exception):\n    __str__ = None\ndef iou(n):\n    raise Odd", "exception", "Odd"),
    ("def iou(n): return int('9' * 10 + 'x' * 5000)", "exception", "ValueError: invalid literal"),
    ("iou = 3", "missing", "its cell makes it a int, not a function"),
    ("table = [0][1]\ndef iou(n): return table", "exception", "IndexError: list index out of range"),
    ("def iou(n): return iou", "kind", "expected an array or a number, got a function"),
    ("class Odd: pass\ndef iou(n): return Odd()", "kind", "expected an array or a number, got Odd"),
    ("def iou(n): return None", "kind", "it returns None: is a `return` missing?"),
    ("def iou(n): return np.ones(n.shape) + 0j", "dtype", "expected real numbers, got dtype complex128"),
    ("def iou(n): return np.zeros((1000, 1000))", "size", "it returns more than 1 MB"),
    ("def iou(n):\n    a = [0.5]\n    a.append(a)\n    return a, a", "size", "it returns more than 1 MB"),
    ("def iou(n):\n    n[:] = 0\n" + RIGHT, "finite", "2 of 2 values are NaN"),
    ("def iou(n):\n    n += 0\n    n = n.copy()\n" + RIGHT, None, ""),
    ("def iou(n):\n" + RIGHT + "raise ValueError", None, ""),
    ("import os\ndef iou(n): os._exit(3)", "ended", "it ended or crashed the process that it ran in"),
    ("x = bytearray(8 << 30)\ndef iou(n): return n", "exception", "MemoryError"),
    ("import time\ndef iou(n): time.sleep(9)", "time", "it did not return in time"),
    ("def iou(n):\n    while True: pass", "time", "it did not return in time"),
    ("def iou(n):\n    while True:\n        try:\n            while True: pass\n        except BaseException: pass",
     "time", "it did not return in time"),
    (SLOW.format(0.1) + RIGHT, "time", ""),
    ("while True: pass\ndef iou(n): return 0", "time", "it did not return in time"),
]  # fmt: skip


@pytest.mark.parametrize("source, kind, says", PROBLEMS, ids=range(len(PROBLEMS)))
def test_each_kind_of_problem_is_said_and_costs_nothing_else(source, kind, says):
    verdict, _, found = judged(source, limits=SHORT if kind == "time" else PATIENT)
    assert getattr(verdict.problem, "kind", None) == kind
    assert kind is None or (says in verdict.problem.says and len(verdict.problem.says) < 250)
    assert not (found and kind == "time")


def test_an_answer_that_sleeps_ends_a_check_soon_and_one_that_works_does_not():
    limits = Limits(case_s=8.0, asleep_s=0.4)
    verdict, _, _ = judged("import time\ndef iou(n):\n    time.sleep(0.15)\n" + RIGHT, limits=limits)
    assert (verdict.problem.says, verdict.case) == ("it slept for 0.4 seconds", 2), "all cases together"
    assert verdict.hint.startswith("It waits, and computes nothing")
    assert judged(SLOW.format(0.1) + RIGHT, limits=limits)[0].passed


SPIN = "import os\nos.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\nprint(flush=True)\nwhile True: pass"


@pytest.mark.skipif(waited_s(os.getpid()) is None, reason="the system does not tell sleep from waiting")
def test_what_waits_for_a_processor_does_not_sleep():
    """Two processes on one processor: neither of them sleeps, and one of them is idle for half of the time."""
    both = [subprocess.Popen([sys.executable, "-c", SPIN], stdout=subprocess.PIPE) for _ in range(2)]
    sleeper = subprocess.Popen([sys.executable, "-c", "import time; print(flush=True); time.sleep(60)"],
                               stdout=subprocess.PIPE)  # fmt: skip
    try:
        for process in (*both, sleeper):
            process.stdout.readline()
        watches = [Stopwatch(process.pid) for process in (*both, sleeper)]
        time.sleep(0.6)
        spun, also, slept = ((watch.used(), watch.slept) for watch in watches)
        assert spun[0] + also[0] < 0.9 and spun[1] < 0.1 and also[1] < 0.1 and slept[1] > 0.4
    finally:
        for process in (*both, sleeper):
            process.kill()
            process.communicate()


def test_time_in_which_it_cannot_run_is_not_an_answers():
    """Stopped by the system for longer than its limits, as on a busy machine, it is as right as before."""
    slow = Program((("numpy", "import numpy as np"), ("iou", SLOW.format(0.02) + RIGHT)))
    limits, cases = Limits(case_s=0.5, question_s=1.0), public_cases(IOU)
    with Run(IOU, slow, subprocess_worker.fresh_worker, limits) as answer:
        process = psutil.Process(answer.worker.pid)
        process.suspend()
        threading.Timer(1.2, process.resume).start()
        begin = time.monotonic()
        verdict, _ = answer.judge(cases)
        assert verdict.passed and time.monotonic() - begin > 1.0 > answer.used_s >= 0.02 * len(cases)


def test_where_the_kernel_limits_no_memory_it_is_looked_at():
    """As on macOS and Windows: here the kernel's limit is far off."""

    @contextmanager
    def start(packages, limits):
        with subprocess_worker.fresh_worker(packages, Limits(memory_mb=8192)) as worker:
            worker.memory = 400 << 20
            yield worker

    fill = "import numpy as np\nkept = []\ndef iou(n):\n    while len(kept) < 60: kept.append(np.ones(1 << 21))\n"
    for source, says in ((fill + "    while True: pass", "it used more than 400 MB of memory"), (fill, "returns None")):
        source = source.replace("60", "60" if "True" in source else "2")
        with Run(IOU, Program((("iou", source),)), start, PATIENT) as answer:
            assert says in answer.judge(public_cases(IOU))[0].problem.says


def test_answers_of_one_notebook_share_its_time_but_each_has_enough_for_a_right_one():
    budget = Budget(Limits(question_s=0.3, submission_s=0.4, least_s=0.2))
    endless = Program((("iou", "def iou(n):\n    while True: pass"),))
    given = []
    for _ in range(3):
        given.append(budget.for_one)
        with Run(IOU, endless, subprocess_worker.fresh_worker, budget.limits, budget) as answer:
            assert answer.judge(public_cases(IOU))[0].problem.kind == "time"
    assert given == pytest.approx([0.3, 0.2, 0.2])


def test_an_endless_answer_leaves_no_process_and_is_not_called_again():
    endless = Program((("iou", "def iou(n):\n    while True: print('turn', flush=True)"),))
    begin = time.monotonic()
    with Run(IOU, endless, subprocess_worker.fresh_worker, SHORT) as answer:
        verdict, outputs = answer.judge(public_cases(IOU))
        assert answer.worker.printed().startswith("turn\nturn\n") and len(answer.worker.printed()) == 601
    assert verdict.case == 0 and len({id(output) for output in outputs}) == 1
    assert answer.worker.closed and time.monotonic() - begin < 60.0


def test_the_deepest_own_line_is_told_in_whichever_cell_it_stands():
    verdict, _, _ = judged("\ndef g(x):\n    return np.linalg.inv(x[9])", "def iou(x):\n    return g(x)")
    assert verdict.problem.lines == ((3, "return np.linalg.inv(x[9])"),)
    assert judged("table = [0][1]\ndef iou(n): return table")[0].where == "before it is called"


def test_a_line_of_the_kits_is_not_told_as_the_students():
    pieces = ("mean, the kit's", "def mean(x):\n    return x[99]"), ("iou", "def iou(n):\n    return mean(n)")
    with Run(IOU, Program(pieces), subprocess_worker.fresh_worker, PATIENT) as answer:
        assert answer.judge(public_cases(IOU))[0].problem.lines == ((2, "return mean(n)"),)


def test_a_worker_that_is_killed_after_its_reply_gives_no_copies_of_it():
    program = Program((("np", "import numpy as np"), ("iou", "def iou(n):\n" + RIGHT)))
    with Run(IOU, program, subprocess_worker.fresh_worker, PATIENT) as answer:
        ask = answer.ask

        def killed_after(*request):
            reply = ask(*request)
            answer.worker.stopped = Problem("ended", "it used more than 1024 MB of memory")
            answer.worker.end()
            return reply

        answer.ask = killed_after
        first, *others = answer.outputs(public_cases(IOU))
    assert isinstance(first, np.ndarray) and {other.kind for other in others} == {"ended"}


def test_an_interrupt_while_its_cells_run_ends_the_worker():
    answer = Run(IOU, Program((("iou", "while True: pass"),)), subprocess_worker.fresh_worker, PATIENT)

    def interrupted(*request):
        raise KeyboardInterrupt

    answer.ask = interrupted
    with pytest.raises(KeyboardInterrupt), answer:
        pass
    assert answer.worker.closed


def test_what_is_printed_comes_back_and_warnings_do_not():
    loud = "import sys\ndef iou(n):\n    print('hello')\n    print('there', file=sys.stderr)\n    np.log(-1.0)\n"
    verdict, printed, _ = judged(loud + RIGHT)
    assert verdict.passed and printed == "hello\nthere\n" * len(public_cases(IOU))


def test_files_and_processes_are_refused(tmp_path):
    """As in the sandbox, where there are none: each attempt is refused, and the other mistake is found all the same."""
    target = tmp_path / "made"
    tries = [
        f"open({str(target)!r}, 'w').write('x')",
        f"__import__('pathlib').Path({str(target)!r}).touch()",
        f"__import__('os').mkdir({str(target)!r})",
        f"__import__('os').system('touch {target}')",
        f"__import__('subprocess').run(['touch', {str(target)!r}])",
    ]
    for attempt in tries:
        source = f"def iou(n):\n    try: {attempt}\n    except PermissionError: pass\n{WRONG}"
        with Run(
            IOU, Program((("np", "import numpy as np"), ("iou", source))), subprocess_worker.fresh_worker, PATIENT
        ) as run:
            verdict, found = run.judge(public_cases(IOU))[0], run.findings()
        assert found and not verdict.passed and not target.exists(), attempt


def test_a_worker_that_ended_while_it_waited_costs_nobody():
    judged("def iou(n):\n" + RIGHT, limits=Limits())
    assert subprocess_worker.spare.worker is not None
    subprocess_worker.spare.worker.kill()
    assert judged("def iou(n):\n" + RIGHT, limits=Limits())[0].passed


def test_a_worker_ends_with_the_process_that_started_it():
    """That one is killed while an answer runs that never ends."""
    code = """
    import os, threading, time
    from labgrader.program.slice import Program
    from labgrader.course import find
    from labgrader.run import subprocess_worker
    from labgrader.run.run import Run, Limits, public_cases
    text = "import os\\ndef iou(n):\\n    print(os.getpid())\\n    while True: pass"
    question, endless = find("04_iou.iou"), Program((("iou", text),))
    with Run(question, endless, subprocess_worker.fresh_worker, Limits()) as answer:
        threading.Thread(target=answer.judge, args=(public_cases(question),), daemon=True).start()
        while not answer.worker.printed().endswith("\\n"):
            time.sleep(0.05)
        print(answer.worker.printed(), flush=True)
        os._exit(1)
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True)
    number, deadline = int(done.stdout), time.monotonic() + 60.0
    while alive(number) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not alive(number)


def alive(number: int) -> bool:
    """Whether a process runs; one that has ended and that nobody asks about does not."""
    try:
        return psutil.Process(number).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
