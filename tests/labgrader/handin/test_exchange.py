"""What `nbgrader collect` takes from a hub's exchange: only what belongs to the account whose it claims to be.

Accounts are the machine's; here `owners` says what they would be, since a test cannot make accounts.
"""

import datetime
import os
from pathlib import Path

import grading_course as kit
import pytest
from nbgrader.coursedir import CourseDirectory

from labgrader.handin import exchange

TIMES = ("2026-10-01 12:00:00 UTC", "2026-10-02 12:00:00 UTC", "2026-10-03 12:00:00 UTC")


@pytest.fixture
def collect(tmp_path, monkeypatch):
    """A function that collects folders, each (claimed, time, accounts, content); what is there then, and the log."""
    inbound = tmp_path / "exchange/kit/inbound"
    accounts = {}
    monkeypatch.setattr(exchange, "owners", lambda folder: accounts[folder.name])
    monkeypatch.setattr(exchange, "last_change", lambda folder: datetime.datetime(2026, 10, 1, 12))

    def run(*handed_in, told=None, **options):
        for i, (student, time, who, content) in enumerate(handed_in):
            folder = inbound / f"{student}+04_iou+{time}+random{i}"
            folder.mkdir(parents=True)
            (folder / "04_iou.ipynb").write_text(content)
            (folder / "timestamp.txt").write_text(time if told is None else told)
            accounts[folder.name] = who
        (tmp_path / "gradebook.db").write_bytes(kit.empty_gradebook())
        directory = CourseDirectory(root=str(tmp_path), course_id="kit", assignment_id="04_iou")
        collector = exchange.OwnersCollect(coursedir=directory, root=str(tmp_path / "exchange"), **options)
        said = []
        monkeypatch.setattr(collector.log, "error", lambda text, *words: said.append(text % words))
        monkeypatch.setattr(
            collector.log, "warning", lambda text, *words: "says that" in text and said.append(text % words)
        )
        collector.start()
        found = {path.parent.parent.name: path.read_text() for path in (tmp_path / "submitted").rglob("*.ipynb")}
        return found, said

    return run


def test_what_another_account_handed_in_is_left_and_named(collect):
    """Mallory's newer folder for Ada hides nothing of hers, and one for Ben, who handed in nothing, makes nothing."""
    found, said = collect(
        ("ada", TIMES[0], {"ada"}, "ada's first"),
        ("ada", TIMES[1], {"ada"}, "ada's second"),
        ("ada", TIMES[2], {"mallory"}, "mallory's"),
        ("ben", TIMES[0], {"mallory"}, "mallory's"),
        ("cem", TIMES[0], {"cem"}, "cem's"),
    )
    assert found == {"ada": "ada's second", "cem": "cem's"}
    assert len(said) == 2 and all("belongs to 'mallory'" in line for line in said)
    assert sum("claims to be from 'ben'" in line for line in said) == 1


def test_a_file_of_anothers_in_ones_own_folder_is_not_collected(collect):
    found, said = collect(("ada", TIMES[0], {"ada", "mallory"}, "whose?"), ("ben", TIMES[0], {"ben"}, "ben's"))
    assert found == {"ben": "ben's"} and len(said) == 1


@pytest.mark.parametrize("told, named", [(TIMES[0], True), ("yesterday", True), ("", True), (TIMES[1], False)])
def test_work_that_says_an_earlier_time_than_its_files_have_is_named(collect, monkeypatch, told, named):
    monkeypatch.setattr(exchange, "last_change", lambda folder: datetime.datetime(2026, 10, 2, 12, 9))
    found, said = collect(("ada", TIMES[0], {"ada"}, "ada's"), told=told)
    assert found == {"ada": "ada's"}
    assert [line for line in said if "and was changed 2026-10-02 12:09 UTC: see [[extension]]" in line] == said
    assert len(said) == named


def test_the_kernel_keeps_when_a_file_was_changed_whatever_its_own_time(tmp_path):
    (tmp_path / "timestamp.txt").write_text(TIMES[0])
    os.utime(tmp_path / "timestamp.txt", (0, 0))
    age = datetime.datetime.now(datetime.UTC).replace(tzinfo=None) - exchange.last_change(tmp_path)
    assert abs(age) < datetime.timedelta(minutes=5)
    assert exchange.time_told(tmp_path) == datetime.datetime(2026, 10, 1, 12)


def test_where_all_are_one_account_the_check_can_be_switched_off(collect):
    found, said = collect(("ada", TIMES[0], {"one"}, "ada's"), check_owner=False)
    assert found == {"ada": "ada's"} and not said


def test_owners_are_those_of_all_files_and_links_are_nobodys(tmp_path):
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep/file").touch()
    me = exchange.account(os.getuid())
    assert exchange.owners(tmp_path) == {me}
    (tmp_path / "deep/link").symlink_to("/etc/passwd")
    assert exchange.owners(tmp_path) == {me, "a link"}


def test_the_hub_collects_so():
    from traitlets.config import Config

    text = (Path(__file__).parents[3] / "deploy/jupyter/nbgrader_config.py").read_text()
    config = Config()
    os.environ.setdefault("LABKIT_EXCHANGE", "/srv/exchange")
    exec(text, {"get_config": lambda: config})
    assert config.ExchangeFactory.collect == "labgrader.handin.exchange.OwnersCollect"
