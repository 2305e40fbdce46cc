"""Marked numbers follow the outputs; a sentence whose claim may have changed is listed, and no other."""

import nbformat
import pytest

from data_gen import sample_scene
from data_gen.families import FAMILIES
from labcli.renumber import holding, in_prose, renumber, scenes_of

OLD, NEW = "IoU [0.616 0.9], of 1250 pixels, shift -4", "IoU [0.655 0.8], of 980 pixels, shift -5"


@pytest.mark.parametrize(
    "text, after",
    [
        ("IoU 0.62<!--=-->.", "IoU 0.66<!--=-->."),  # 0.655 in binary is above
        ("62 %<!--=--> of them", "66 %<!--=--> of them"),
        ("$E = 0.616$<!--=-->", "$E = 0.655$<!--=-->"),
        ("it is shifted by 4<!--=--> pixels", "it is shifted by 5<!--=--> pixels"),
        ("twice **1.232<!--=: 2 * 0.616-->**", "twice **1.310<!--=: 2 * 0.655-->**"),
        ("32 %<!--=: 1 - 0.616 / 0.9--> less", "18 %<!--=: 1 - 0.655 / 0.8--> less"),
        ("0.9<!--=ab12--> there", "0.8<!--=ab12--> there"),
        ("0.616 is not marked", "0.616 is not marked"),
    ],
)
def test_a_marked_number_is_written_as_the_new_output_has_it(text, after):
    assert in_prose(text, "cell", "ab12cd", {"ab12cd": OLD}, {"ab12cd": NEW})[0] == after


@pytest.mark.parametrize(
    "text, new, why",
    [
        (
            "It falls from 0.9<!--=--> to 0.616<!--=-->.",
            "IoU [0.7 0.65], of 1250 pixels, shift -4",
            "0.9 and 0.616 are",
        ),
        ("All 1,250<!--=--> are wrong.", NEW.replace("980", "80"), "1250 is 80 now"),
        ("All 1,250<!--=--> are wrong.", NEW.replace("pixels", "voxels"), "says something else"),
        ("A share of 0.7<!--=-->.", NEW, "did not show it before"),
        ("It is 0.6<!--=--> or 0.9<!--=-->.", NEW, ""),
    ],
)
def test_a_sentence_whose_claim_may_not_hold_is_listed(text, new, why):
    new = new if why != "0.9 and 0.616 are" else "IoU [0.95 0.9], of 1250 pixels, shift -4"
    _, _, doubts = in_prose(f"All is well. {text} So it is.", "cell", "a", {"a": OLD}, {"a": new})
    assert [why in doubt.why and "All is well" not in doubt.sentence for doubt in doubts] == [True] * bool(why)


def test_two_places_with_the_same_number_that_part_have_to_be_read():
    _, changed, doubts = in_prose("Each has 3<!--=-->.", "cell", "a", {"a": "3 and 3"}, {"a": "4 and 5"})
    assert changed == 0 and ["several places" in doubt.why for doubt in doubts] == [True]


def test_a_notebook_is_written_back_and_says_how_many_changed(tmp_path):
    made = nbformat.v4
    code = made.new_code_cell("print(x)", id="code", outputs=[made.new_output("stream", name="stdout", text="x 0.8\n")])
    path = tmp_path / "01.ipynb"
    nbformat.write(made.new_notebook(cells=[code, made.new_markdown_cell("x is 0.7<!--=-->.", id="prose")]), path)
    assert renumber(path, {"code": "x 0.7\n", "prose": ""}) == (1, [])
    assert nbformat.read(path, as_version=4).cells[1].source == "x is 0.8<!--=-->."


def test_a_familys_notebooks_are_those_that_draw_a_scene_with_it(tmp_path):
    codes = {
        "a.ipynb": '%matplotlib inline\nframe = data_gen.render(data_gen.sample_scene(7, "test"))',
        "b.ipynb": 'frames = [scene(seed, "hard") for seed in range(600_000, 600_003)]',
        "c.ipynb": "print(600_000 // 3)",
    }
    for name, code in codes.items():
        nbformat.write(nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code)]), tmp_path / name)
    drawn = [[(7, "test")], [(seed, "hard") for seed in range(600_000, 600_003)], [(600_000, "train")]]
    paths = sorted(tmp_path.glob("*.ipynb"))
    assert [scenes_of(path) for path in paths] == drawn
    for family in FAMILIES:
        holding_it = {
            path: [scene for scene in scenes if family in {thing.family for thing in sample_scene(*scene).objects}]
            for path, scenes in zip(paths, drawn, strict=True)
        }
        assert holding(family, paths) == {path: scenes for path, scenes in holding_it.items() if scenes}
    with pytest.raises(ValueError, match=r"family: expected one of mug, .*, got 'jug'"):
        holding("jug", paths)
