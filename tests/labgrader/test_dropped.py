"""A course that leaves topics out by one setting."""

from dataclasses import replace

import pytest

from labgrader import course
from labgrader.release import bundle, release


@pytest.fixture
def without_two_topics(monkeypatch):
    here = replace(course.course(), dropped=("02_crf", "09_other_stacks"))
    monkeypatch.setattr(course, "course", lambda: here)
    return here


def test_what_is_dropped_is_no_topic_no_file_and_no_row(without_two_topics):
    assert [topic[:2] for topic in course.topics()] == ["01", "03", "04", "05", "06", "07", "08", "10"]
    with pytest.raises(ValueError, match=r"topic: expected one of 01_labels, 03_gradient.*got '02_crf'"):
        course.of_topic("02_crf")
    names = ["lessons/02_crf_cut.ipynb", "lessons/schematics/09_x.svg", "labs/02_crf/02_crf.ipynb", "lessons/03_a.csv"]
    assert [bundle.of((), name) for name in [*names, "labkit/02_x.py"]] == [False, False, False, True, True]
    page = (
        "| [a](../lessons/02_crf.ipynb) |\n| [b](../lessons/01_labels.ipynb), [c](../labs/02_crf/02_crf.ipynb) |\ntext"
    )
    assert course.taught_rows(page) == page.partition("\n")[2]


def test_the_page_to_begin_on_and_the_weeks_follow(without_two_topics):
    page = release.start_page(without_two_topics.root)
    assert "01_labels.ipynb" in page and "03_gradient.ipynb" in page
    assert "02_crf" not in page and "09_other_stacks" not in page
    assert bundle.topics_of_week(2) == ("03_gradient",)
