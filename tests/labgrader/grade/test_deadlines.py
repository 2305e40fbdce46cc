"""course.toml and roster.csv: who is late by how much, and what cannot be used is refused with file and line."""

import datetime

import pytest

from labgrader.grade.deadlines import Lateness, read_deadline, unknown_extensions
from labgrader.grade.totals import handed_in_late
from labgrader.handin.roster import person_of, read_roster

TOPIC = "04_iou"
DEADLINE = """
[[deadline]]
lab = "04_iou"
due = 2026-10-05T22:00:00Z
grace_minutes = 15
penalty_per_day = 30
"""
BLOCKS = "expected blocks [[change]], [[deadline]], [[extension]], [[notebook]], [[bonus]], [[weight]], [[course]]"
EXTENSION = """
[[extension]]
lab = "04_iou"
student = "1234"
due = 2026-10-07T22:00:00Z
reason = "ill"
"""


def deadline(folder, text=DEADLINE + EXTENSION):
    (folder / "course.toml").write_text(text)
    return read_deadline(folder, TOPIC)


@pytest.mark.parametrize(
    "hours, days, percent", [(-1, 0, 0), (0.25, 0, 0), (0.26, 1, 30), (24, 1, 30), (24.1, 2, 60), (200, 9, 100)]
)
def test_days_count_from_the_deadline_once_the_grace_is_over(tmp_path, hours, days, percent):
    handed_in = datetime.datetime(2026, 10, 5, 22) + datetime.timedelta(hours=hours)
    late = deadline(tmp_path).lateness("Zoë Müller_12", handed_in)
    assert (late.days, late.percent) == (days, percent)


def test_an_extension_moves_one_students_deadline_or_says_how_late_they_are(tmp_path):
    noon = datetime.datetime(2026, 10, 8, 12)
    found = deadline(tmp_path)
    assert found.lateness("lovelaceada_1234", noon).days == 1 and found.lateness("ada", noon).days == 3
    late_days = EXTENSION.replace("due = 2026-10-07T22:00:00Z", "late_days = 0")
    assert deadline(tmp_path, DEADLINE + late_days).lateness("lovelaceada_1234", noon).days == 0
    assert unknown_extensions(found, ["lovelaceada_1234"]) == [] and unknown_extensions(found, ["ada"]) == ["1234"]


def test_a_mark_without_a_time_counts_as_one_day_and_says_so(tmp_path):
    late = deadline(tmp_path).lateness("ada", None, marked=datetime.datetime(2026, 10, 8))
    assert late.days == 1 and "its platform marks it late" in str(late)
    assert str(deadline(tmp_path).lateness("ada", None)) == ""


def test_an_extension_counts_where_a_platform_says_late_and_not_since_when(tmp_path):
    """The zip was made before it ended: nothing is off. After that nobody knows, and a person is told what to write."""
    found, (before, after) = deadline(tmp_path), (datetime.datetime(2026, 10, day) for day in (7, 9))
    assert found.lateness("lovelaceada_1234", None, before) == Lateness()
    unknown = found.lateness("lovelaceada_1234", None, after)
    assert (unknown.days, unknown.percent) == (0, 0.0) and "its [[extension]] says late_days = N" in str(unknown)
    for days in (0, 2):
        said = EXTENSION.replace("due = 2026-10-07T22:00:00Z", f"late_days = {days}")
        assert deadline(tmp_path, DEADLINE + said).lateness("lovelaceada_1234", None, after).days == days


def test_an_extension_finds_its_student_by_email_too(tmp_path):
    (tmp_path / "roster.csv").write_text("id,name,email\n77,Ada,ada@x.org\n78,Ada,ada@x.org\n5,Ben,ben@x.org\n")
    found, late = deadline(tmp_path, DEADLINE + EXTENSION.replace("1234", "ada@x.org")), datetime.datetime(2026, 10, 7)
    assert [found.lateness(student, late).days for student in ("Ada_77", "Ada_78", "Ben_5")] == [0, 0, 2]
    assert unknown_extensions(found, ["Ada_77", "Ada_78", "Ben_5"]) == []


@pytest.mark.parametrize(
    "late, says",
    [
        (Lateness(1, 0.0, free=1), "1 day late, covered by a free late day; no deduction"),
        (Lateness(2, 0.0, free=2), "2 days late, covered by 2 free late days; no deduction"),
        (Lateness(2, 10.0, free=1), "2 days late, 1 of them free, 10 % less"),
        (Lateness(2), "2 days late; no deduction"),
    ],
)
def test_where_nothing_is_taken_off_nothing_is_said_to_be(late, says):
    assert str(late) == says and ("taken off" in handed_in_late(late)) == bool(late.percent)


def test_a_date_is_its_end_and_local(tmp_path):
    due = deadline(tmp_path, DEADLINE.replace("2026-10-05T22:00:00Z", "2026-10-05")).due
    assert due == datetime.datetime(2026, 10, 5, 23, 59, 59).astimezone(datetime.UTC).replace(tzinfo=None)


@pytest.mark.parametrize(
    "text, says",
    [
        (
            DEADLINE.replace("2026-10-05T22:00:00Z", '"monday"'),
            "[[deadline]] number 1: expected due, a date such as 2026-10-05",
        ),
        (
            DEADLINE.replace("30", "-1"),
            "[[deadline]] number 1: expected penalty_per_day, a number that is not negative",
        ),
        (
            DEADLINE.replace("grace", "mercy"),
            "[[deadline]] number 1: expected lab, due, grace_minutes, penalty_per_day",
        ),
        (DEADLINE.replace("04_iou", "04_oiu"), "[[deadline]] number 1: lab: expected one of 01_labels"),
        (DEADLINE + DEADLINE, "[[deadline]] number 2: lab: 04_iou has a deadline above"),
        (DEADLINE + EXTENSION + EXTENSION, "[[extension]] number 2: student: 1234 has an extension above"),
        (
            DEADLINE + EXTENSION + "late_days = 1\n",
            "[[extension]] number 1: expected one of due = DATE and late_days = NUMBER",
        ),
        (
            DEADLINE + "[[deadlines]]\n",
            BLOCKS + ", [[canvas]], got deadlines",
        ),
        (
            DEADLINE.replace("[[deadline]]", "[deadline]"),
            BLOCKS + ", [[canvas]], got",
        ),
        (
            "extension = [7]",
            BLOCKS + ", [[canvas]], got extension",
        ),
        (DEADLINE.replace("2026", "0001"), "[[deadline]] number 1: expected due, a date such as 2026-10-05"),
        (DEADLINE.replace("2026", "9999"), "[[deadline]] number 1: expected due, a date such as 2026-10-05"),
        (DEADLINE + EXTENSION.replace("2026", "9999"), "[[extension]] number 1: expected due, a date such as"),
        ("[[deadline]\n", "(at line 1"),
    ],
)
def test_what_a_person_broke_is_refused_with_its_place(tmp_path, text, says):
    with pytest.raises(ValueError) as refusal:
        deadline(tmp_path, text)
    assert "course.toml" in str(refusal.value) and says in str(refusal.value)


@pytest.mark.parametrize(
    "text, first, last, email",
    [
        ("id,name,email\n12,Zoë O'Brien,z@x.org\n", "Zoë", "O'Brien", "z@x.org"),
        (
            "Identifier;Full name;Email address\nParticipant 12;Ada B. Lovelace;a@x.org\n",
            "Ada B.",
            "Lovelace",
            "a@x.org",
        ),
        ('Student,ID,SIS Login ID\n    Points Possible,,\n"Lovelace, Ada",12,ada\n', "Ada", "Lovelace", ""),
        ("\ufeffid\tname\n12\tCher\n", "", "Cher", ""),
    ],
    ids=["own", "Moodle", "Canvas", "tabs"],
)
def test_a_roster_is_read_as_platforms_write_it(tmp_path, text, first, last, email):
    (tmp_path / "roster.csv").write_text(text)
    person = person_of(read_roster(tmp_path), "somebody_12")
    assert person.first_and_last == (first, last) and person.email == email
    assert person.more.get("SIS Login ID", "ada") == "ada" and person_of({"12": person}, "somebody_13") is None


@pytest.mark.parametrize(
    "text, says",
    [
        (b"name,email\nAda,a@x.org\n", "line 1: expected a column id"),
        (b"id,name\n1,Ada\n,Ben\n", "line 3: expected an id, got none for Ben"),
        (b"id,name\n1,Ada\n1,Ben\n", "line 3: expected each id once, got 1 again"),
        (b"id,name\n1,Zo\xeb\n", "save it as CSV UTF-8"),
    ],
)
def test_a_roster_that_cannot_be_used_is_refused_with_its_line(tmp_path, text, says):
    (tmp_path / "roster.csv").write_bytes(text)
    with pytest.raises(ValueError, match=r"roster\.csv") as refusal:
        read_roster(tmp_path)
    assert says in str(refusal.value)
