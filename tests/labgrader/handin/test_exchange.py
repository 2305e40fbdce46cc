"""What `nbgrader collect` takes from a hub's exchange: only what belongs to the account whose it claims to be.

Accounts are numbers that files are given to, which takes root; where it is missing, these tests say that they did not
run. Some of them collect as one more account, the instructor's, since root can read everything.
"""

import datetime
import io
import os
import pickle
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import grading_course as kit
import pytest
from nbgrader.coursedir import CourseDirectory

from labgrader.handin import exchange

TIMES = ("2026-10-01 12:00:00 UTC", "2026-10-02 12:00:00 UTC", "2026-10-03 12:00:00 UTC")
NUMBERS = {"ada": 61001, "ben": 61002, "cem": 61003, "mallory": 61004, "instructor": 61005}
NAMES = {number: name for name, number in NUMBERS.items()} | {os.getuid(): "me"}
SECRET = "a secret of the instructor's"

two_accounts = pytest.mark.skipif(os.geteuid() != 0, reason="not run: needs root, to be two accounts")


class Exchange:
    """An exchange and a course in a folder that other accounts can reach."""

    def __init__(self, place: Path):
        self.place, self.inbound = place, place / "exchange/kit/inbound"
        self.submitted, self.count = place / "course/submitted", 0
        self.inbound.mkdir(parents=True)
        self.submitted.parent.mkdir()
        (self.submitted.parent / "gradebook.db").write_bytes(kit.empty_gradebook())
        (place / "exchange").chmod(0o777)
        (place / "private").mkdir(mode=0o700)
        for name in ("04_iou.ipynb", "timestamp.txt"):
            (place / "private" / name).write_text(SECRET)

    def hand_in(self, student: str, time: str, content: str, by: str | None = None, told: str | None = None) -> Path:
        """Hand in a folder that claims to be a student's, with the rights that nbgrader gives it; returns it."""
        self.count += 1
        folder = self.inbound / f"{student}+04_iou+{time}+random{self.count}"
        (folder / "data").mkdir(parents=True)
        (folder / "04_iou.ipynb").write_text(content)
        (folder / "data/table.csv").write_text("1,2")
        (folder / "timestamp.txt").write_text(time if told is None else told)
        if os.geteuid() == 0:
            give(folder, by or student)
        folder.chmod(0o777)
        return folder

    def collect(self, **options) -> tuple[dict[str, str], list[str]]:
        """Collect; what is there then, notebooks by student, and what was said of folders."""
        said = io.StringIO()
        directory = CourseDirectory(root=str(self.submitted.parent), course_id="kit", assignment_id="04_iou")
        collector = exchange.OwnersCollect(coursedir=directory, root=str(self.place / "exchange"), **options)
        for kind in ("error", "warning"):
            setattr(collector.log, kind, lambda text, *words: print(text % words if words else text, file=said))
        collector.start()
        return self.there(), [line for line in said.getvalue().splitlines() if "+04_iou+" in line or "more" in line]

    def there(self) -> dict[str, str]:
        found = self.submitted.glob("*/04_iou/04_iou.ipynb")
        return {path.parent.parent.name: path.read_text() for path in found}


def give(folder: Path, name: str) -> None:
    for path in (folder, *folder.rglob("*")):
        os.chown(path, NUMBERS[name], NUMBERS[name], follow_symlinks=False)


@pytest.fixture
def hub(monkeypatch):
    """An exchange; accounts have the names of this module."""
    monkeypatch.setattr(exchange, "account", NAMES.__getitem__)
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        yield Exchange(Path(folder))


def as_account(name: str, what: Callable[[], object]) -> object:
    """What a function returns in a process that belongs to an account."""
    reads, writes = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.setgroups([])
            os.setgid(NUMBERS[name])
            os.setuid(NUMBERS[name])
            answer = what()
        except BaseException as error:
            answer = repr(error)
        with os.fdopen(writes, "wb") as pipe:
            pickle.dump(answer, pipe)
        os._exit(0)
    os.close(writes)
    with os.fdopen(reads, "rb") as pipe:
        answer = pickle.load(pipe)
    os.waitpid(child, 0)
    return answer


# ------------------------------------------------------------------------------------------------- whose it is


@two_accounts
def test_what_another_account_handed_in_is_left_and_named(hub):
    """Mallory's newer folder for Ada hides nothing of hers, and one for Ben, who handed in nothing, makes nothing."""
    hub.hand_in("ada", TIMES[0], "ada's first")
    hub.hand_in("ada", TIMES[1], "ada's second")
    hub.hand_in("ada", TIMES[2], "mallory's", by="mallory")
    hub.hand_in("ben", TIMES[0], "mallory's", by="mallory")
    hub.hand_in("cem", TIMES[0], "cem's")
    found, said = hub.collect()
    assert found == {"ada": "ada's second", "cem": "cem's"}
    said = [line for line in said if "says that" not in line]
    assert len(said) == 2 and all("belongs to 'mallory'" in line for line in said)
    assert sum("claims to be from 'ben'" in line for line in said) == 1
    assert not (hub.submitted / "ben").exists()


@two_accounts
def test_who_hands_in_for_others_a_hundred_times_is_named_a_few_times(hub):
    for _ in range(100):
        hub.hand_in("ada", TIMES[2], "mallory's", by="mallory")
    hub.hand_in("ben", TIMES[0], "ben's")
    found, said = hub.collect()
    assert found == {"ben": "ben's"}
    assert sum("mallory" in line for line in said) == exchange.MOST_NAMED + 1
    assert f"Left out {100 - exchange.MOST_NAMED} more that belong to 'mallory'" in said


@two_accounts
def test_a_file_of_anothers_in_ones_own_folder_is_not_collected(hub):
    folder = hub.hand_in("ada", TIMES[0], "whose?")
    os.chown(folder / "04_iou.ipynb", NUMBERS["mallory"], -1)
    hub.hand_in("ben", TIMES[0], "ben's")
    found, said = hub.collect()
    assert found == {"ben": "ben's"} and "belongs to 'mallory'" in "".join(said)


def test_where_all_are_one_account_the_check_can_be_switched_off(hub):
    """A name that no table could show is still none."""
    hub.hand_in("ada", TIMES[0], "ada's", by="ben")
    hub.hand_in("x;=1+1", TIMES[0], "not theirs", by="ben")
    found, said = hub.collect(check_owner=False)
    assert found == {"ada": "ada's"}
    assert any("names no student: it holds" in line for line in said)


# ------------------------------------------------------------------------------------- what changes meanwhile


def swap_file(folder: Path, private: Path) -> None:
    """A link in the place of the notebook."""
    os.rename(folder / "04_iou.ipynb", folder.parent / "away")
    (folder / "04_iou.ipynb").symlink_to(private / "04_iou.ipynb")


def swap_file_for_the_same(folder: Path, private: Path) -> None:
    """The other's file itself under the notebook's name, as some kernels let anybody do."""
    os.rename(folder / "04_iou.ipynb", folder.parent / "away")
    os.link(private / "04_iou.ipynb", folder / "04_iou.ipynb")


def swap_time(folder: Path, private: Path) -> None:
    """A link in the place of timestamp.txt."""
    os.rename(folder / "timestamp.txt", folder.parent / "away")
    (folder / "timestamp.txt").symlink_to(private / "timestamp.txt")


def swap_folder(folder: Path, private: Path) -> None:
    """A link in the place of all that was handed in."""
    os.rename(folder, folder.parent / "away")
    folder.symlink_to(private)


def swap_inner_folder(folder: Path, private: Path) -> None:
    """A link in the place of a folder in it."""
    os.rename(folder / "data", folder.parent / "away")
    (folder / "data").symlink_to(private)


SWAPS = (swap_file, swap_file_for_the_same, swap_time, swap_folder, swap_inner_folder)
EVENTS = ("open", "os.scandir", "os.listdir", "shutil.copytree")


class Meanwhile:
    """Does something before one of the steps of this process that open or list files of an exchange."""

    def __init__(self):
        self.at, self.count, self.act, self.inbound = -1, 0, None, ""
        sys.addaudithook(self.hook)  # none can be taken away again

    def hook(self, event: str, args: tuple) -> None:
        if self.act is None or event not in EVENTS:
            return
        place = os.fsdecode(args[0]) if isinstance(args[0], str | bytes | os.PathLike) else "a descriptor"
        if place.startswith(self.inbound) or "/" not in place:
            self.count += 1
            if self.count - 1 == self.at:
                act, self.act = self.act, None
                act()


@pytest.fixture(scope="module")
def meanwhile():
    return Meanwhile()


@two_accounts
@pytest.mark.parametrize("swap", SWAPS, ids=lambda swap: swap.__name__)
def test_whatever_is_swapped_at_whichever_step_nothing_of_anothers_is_collected(swap, monkeypatch, meanwhile):
    """Mallory waits, as with inotify, and changes her own folder before each of the steps, one after the other."""
    monkeypatch.setattr(exchange, "account", NAMES.__getitem__)
    at, steps = 0, 1
    while at <= steps:
        with tempfile.TemporaryDirectory() as place:
            hub = Exchange(Path(place))
            folder = hub.hand_in("mallory", TIMES[0], "mallory's")
            hub.hand_in("ada", TIMES[0], "ada's")
            meanwhile.at, meanwhile.count, meanwhile.inbound = at, 0, str(hub.inbound)
            meanwhile.act = lambda hub=hub, folder=folder: swap(folder, hub.place / "private")
            try:
                found, _ = hub.collect()
            finally:
                has_swapped, meanwhile.act = meanwhile.act is None, None
            steps = max(steps, meanwhile.count)
            texts = [path.read_text() for path in hub.submitted.rglob("*") if path.is_file()]
            assert SECRET not in texts and not [path for path in hub.submitted.rglob("*") if path.is_symlink()]
            assert found["ada"] == "ada's" and set(found) <= {"ada", "mallory"}
            assert has_swapped or at == steps
        at += 1
    assert steps > 8


# -------------------------------------------------------------------------- one account, and all the others'


def nonsense(hub: Exchange, name: str) -> None:
    hub.hand_in("mallory", "x", "mallory's").rename(hub.inbound / name)


def deep(hub: Exchange) -> None:
    folder = hub.hand_in("mallory", TIMES[0], "mallory's")
    (folder / "/".join(["x"] * 200)).mkdir(parents=True)
    give(folder, "mallory")


def pipe(hub: Exchange) -> None:
    folder = hub.hand_in("mallory", TIMES[0], "mallory's")
    os.mkfifo(folder / "pipe")
    give(folder, "mallory")


def large(hub: Exchange) -> None:
    folder = hub.hand_in("mallory", TIMES[0], "mallory's")
    (folder / "large").touch()
    os.truncate(folder / "large", 300 << 20)
    give(folder, "mallory")


def many(hub: Exchange) -> None:
    folder = hub.hand_in("mallory", TIMES[0], "mallory's")
    for i in range(1200):
        (folder / f"{i}").touch()
    give(folder, "mallory")


def closed_file(hub: Exchange) -> None:
    (hub.hand_in("mallory", TIMES[0], "mallory's") / "04_iou.ipynb").chmod(0)


def closed_folder(hub: Exchange) -> None:
    (hub.hand_in("mallory", TIMES[0], "mallory's") / "data").chmod(0)


def closed(hub: Exchange) -> None:
    hub.hand_in("mallory", TIMES[0], "mallory's").chmod(0)


def looping(hub: Exchange) -> None:
    folder = hub.hand_in("mallory", TIMES[0], "mallory's")
    (folder / "loop").symlink_to(folder)


ODD = {
    "no time": lambda hub: nonsense(hub, "mallory+04_iou+nonsense+r"),
    "a time that is too large": lambda hub: nonsense(hub, "mallory+04_iou+9999999999999999+r"),
    "a time of no calendar": lambda hub: nonsense(hub, "mallory+04_iou+0001-01-01 00:00:00 +1400+r"),
    "no words": lambda hub: nonsense(hub, "mallory+04_iou+"),
    "no student": lambda hub: nonsense(hub, f"+04_iou+{TIMES[0]}+r"),
    "two lines": lambda hub: nonsense(hub, f"mallory\n+04_iou+{TIMES[0]}+r"),
    **{f.__name__: f for f in (deep, pipe, large, many, closed_file, closed_folder, closed, looping)},
}


@two_accounts
@pytest.mark.parametrize("make", ODD.values(), ids=ODD)
def test_an_odd_folder_is_left_and_named_and_costs_nobody_else(hub, make):
    """Collected by an account without root's rights."""
    hub.hand_in("ada", TIMES[0], "ada's")
    make(hub)
    hub.hand_in("ben", TIMES[0], "ben's")
    give(hub.place, "instructor")
    for path in hub.inbound.iterdir():
        give(path, "mallory" if path.name.startswith(("mallory", "+")) else path.name[:3])
    found, said = as_account("instructor", hub.collect)
    assert found == {"ada": "ada's", "ben": "ben's"}
    assert [line for line in said if line.startswith("Left out") and ("mallory" in line or "'+04" in line)]
    assert sorted(path.name for path in hub.submitted.iterdir()) == ["ada", "ben"]


def link_from(folder: Path) -> None:
    (folder / "more").symlink_to("/etc/passwd")
    give(folder, folder.name.partition("+")[0])


@two_accounts
def test_an_earlier_folder_counts_where_the_last_one_cannot_be_taken(hub):
    hub.hand_in("ada", TIMES[0], "ada's first")
    link_from(hub.hand_in("ada", TIMES[1], "ada's second"))
    found, said = hub.collect()
    assert found == {"ada": "ada's first"} and any("'more': a link" in line for line in said)


@two_accounts
def test_a_newer_one_takes_the_place_of_the_one_before_if_it_can_be_taken(hub):
    hub.hand_in("ada", TIMES[0], "ada's first")
    hub.collect()
    hub.hand_in("ada", TIMES[1], "ada's second")
    assert hub.collect()[0] == {"ada": "ada's first"}
    assert hub.collect(update=True)[0] == {"ada": "ada's second"}
    link_from(hub.hand_in("ada", TIMES[2], "ada's third"))
    assert hub.collect(update=True)[0] == {"ada": "ada's second"}


# -------------------------------------------------------------------------------------- times, secrets, rights


@two_accounts
@pytest.mark.parametrize(
    "told, named", [(None, True), ("yesterday", True), ("", True), ("9999-12-31", False), ("8" * 40, True)]
)
def test_work_that_says_an_earlier_time_than_its_files_have_is_named(hub, told, named):
    """Its files are of today; a time that is none becomes that of the last change, which nobody can set back."""
    folder = hub.hand_in("ada", TIMES[0], "ada's", told=told)
    os.utime(folder / "timestamp.txt", (0, 0))
    found, said = hub.collect()
    assert found == {"ada": "ada's"}
    assert len([line for line in said if "says that" in line and "see [[extension]]" in line]) == named
    kept = exchange.time_told(hub.submitted / "ada/04_iou")
    if told not in (None, "9999-12-31"):
        assert abs(datetime.datetime.now(datetime.UTC).replace(tzinfo=None) - kept) < datetime.timedelta(minutes=5)


@two_accounts
def test_what_has_no_secret_gets_one_since_feedback_needs_it(hub):
    (hub.hand_in("ada", TIMES[0], "ada's") / "submission_secret.txt").write_text("her own")
    give(next(hub.inbound.iterdir()), "ada")
    hub.hand_in("ben", TIMES[0], "ben's")
    hub.collect()
    texts = [(hub.submitted / name / "04_iou/submission_secret.txt").read_text() for name in ("ada", "ben")]
    assert texts[0] == "her own" and len(texts[1]) > 60


@two_accounts
def test_nobody_else_reads_what_was_collected(hub):
    hub.hand_in("ada", TIMES[0], "ada's")
    (hub.submitted.parent / "roster.csv").write_text("id\n1\n")
    give(hub.place, "instructor")
    give(next(hub.inbound.iterdir()), "ada")

    def collect() -> dict:
        os.umask(0o022)
        return hub.collect()[0]

    assert as_account("instructor", collect) == {"ada": "ada's"}
    (hub.submitted.parent / "roster.csv").read_text()
    for name in ("submitted/ada/04_iou/04_iou.ipynb", "submitted/ada/04_iou/submission_secret.txt", "roster.csv"):
        path = hub.submitted.parent / name
        assert path.is_file()
        assert "PermissionError" in as_account("mallory", path.read_text), name


def test_the_hub_collects_so():
    from traitlets.config import Config

    text = (Path(__file__).parents[3] / "deploy/jupyter/nbgrader_config.py").read_text()
    config = Config()
    os.environ.setdefault("LABKIT_EXCHANGE", "/srv/exchange")
    exec(text, {"get_config": lambda: config})
    assert config.ExchangeFactory.collect == "labgrader.handin.exchange.OwnersCollect"
