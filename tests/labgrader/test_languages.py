"""Hints in another language: what a file says is said, what it does not say stays English."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from labgrader import check as checking
from labgrader import course
from labgrader.languages import translated
from labgrader.reply.judge import judge

QUESTIONS = Path(__file__).parents[2] / "labcourse" / "questions"
FILES = sorted(QUESTIONS.rglob("*.de.toml"))


def test_each_topic_shows_how_a_hint_is_translated(monkeypatch):
    topics = [topic for topic in course.topics() if course.of_topic(topic)]
    said = {}
    for language in ("de", "en"):
        monkeypatch.setenv("LABGRADER_LANGUAGE", language)
        for topic in topics:
            questions = course.of_topic(topic).values()
            said[topic, language] = {one.hint for question in questions for one in question.misconceptions}
    assert {f"t{topic}" for topic in topics} <= {path.parent.name for path in FILES}
    assert all(len(said[topic, "de"] - said[topic, "en"]) == 1 for topic in topics)


def test_a_wrong_answer_earns_its_hint_in_the_language_that_is_chosen(monkeypatch):
    from labcourse.questions.t04_iou.iou import dice, overlap_twice_in_the_union

    answers = (*(partial(dice, absent=absent) for absent in (np.nan, 0.0)), overlap_twice_in_the_union)
    said = {}
    for language in ("de", "en", "xx"):
        monkeypatch.setenv("LABGRADER_LANGUAGE", language)
        question = course.find("04_iou.iou")
        said[language] = [judge(question, answer, seed=0).hint for answer in answers]
    assert said["en"] == said["xx"]
    assert all(hint.startswith("Das ist Dice (F1), ein anderes Maß") for hint in said["de"][:2])  # each of its variants
    assert said["de"][2] == said["en"][2]


def test_a_line_that_belongs_to_nothing_is_named(tmp_path):
    from labcourse.questions.t04_iou.iou import QUESTION

    (tmp_path / "iou.de.toml").write_text('[hints]\ndicee = "Dice"\n', encoding="utf-8")
    with pytest.raises(ValueError, match=r"iou\.de\.toml: hints: .* of iou\.py \(.*, dice, .*\), got dicee"):
        translated(QUESTION, tmp_path / "iou.py", "de")
    assert translated(QUESTION, tmp_path / "iou.py", "fr") is QUESTION


def test_a_check_says_that_hints_cannot_be_read_and_not_that_there_is_no_question(tmp_path, monkeypatch, capsys):
    from labcourse.questions.t04_iou.iou import QUESTION

    monkeypatch.setattr(checking, "find", lambda name: translated(QUESTION, tmp_path / "iou.py", "de"))
    for text, says in (('[hints]\ndicee = "Dice"\n', "got dicee"), ("[hints\n", "iou.de.toml: ")):
        (tmp_path / "iou.de.toml").write_text(text, encoding="utf-8")
        checking.check("04_iou.iou", len)
        first, second = capsys.readouterr().out.splitlines()
        assert first == "✘ the hints of this topic cannot be read" and says in second


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_translation_belongs_to_a_question(path):
    name = f"labcourse.questions.{path.parent.name}.{path.name.partition('.')[0]}"
    assert course.question_of(name, "de") is not course.question_of(name, "en")
