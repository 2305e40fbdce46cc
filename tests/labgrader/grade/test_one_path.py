"""A wrong answer is told the same in its notebook, by `check FILE`, and on its graded page.

tests/data/answers.json has the answers, of each kind of sentence some.
"""

import importlib.util
import json
import sys
from pathlib import Path

import grading_course as kit
import pytest
from at_night import others_at_night

from labgrader.check import check
from labgrader.course import find
from labgrader.file_check import check_file
from labgrader.grade.grade import Grading
from labgrader.handin.reading import read_lab, read_submission

pytestmark = pytest.mark.bad_input  # without the shape checks, as outside the suite
ANSWERS = json.loads((Path(__file__).parents[2] / "data" / "answers.json").read_text())


def block_of(function: str, printed: str) -> list[str]:
    """What a check printed of one function, line by line, without indentation."""
    lines = printed.splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith(f"✘ {function}: "))
    rest = (line.strip() for line in lines[first + 1 :])
    block = [lines[first]]
    for line in rest:
        if line.startswith(("✔", "✘", "○")) or line.endswith("answers are right.") or "kit's function" in line:
            break
        block.append(line)
    return [line for line in block if line]


@pytest.mark.parametrize(
    "answer",
    others_at_night(ANSWERS, by_day=ANSWERS[::16]),
    ids=lambda a: f"{a['question'].partition('.')[2]}: {a['thought']}",
)
def test_notebook_file_and_page_say_the_same(answer, tmp_path, capsys, monkeypatch):
    question, source = find(answer["question"]), answer["source"]
    monkeypatch.setitem(kit.FEW, question.topic, (question.function,))
    kit.write_lab(tmp_path, question.topic)
    path = kit.submit(tmp_path, "ada", question.topic, {question.function: source})

    (tmp_path / "answered.py").write_text(f"{source}\nimport numpy as np\n")  # lines are counted as in a cell
    spec = importlib.util.spec_from_file_location("answered", tmp_path / "answered.py")
    monkeypatch.setitem(sys.modules, "answered", module := importlib.util.module_from_spec(spec))
    spec.loader.exec_module(module)
    check(question.name, getattr(module, question.function))
    in_notebook = block_of(question.function, capsys.readouterr().out)
    assert not check_file(path)
    in_file = block_of(question.function, capsys.readouterr().out)

    lab = read_lab(tmp_path, question.topic)
    result = Grading(lab, read_submission(tmp_path / "submitted" / "ada", lab), unsafe=True).draft(question.function)
    on_page = [*result.shown.splitlines(), f"Hint: {result.hint}"]
    assert in_notebook == in_file
    own = [
        line
        for line in in_file[1:]
        if not line.startswith(("In hand-made case ", "In random case ", "line ", "Note: "))
    ]
    assert own == [line.strip() for line in on_page if line.strip()] and not result.flag
