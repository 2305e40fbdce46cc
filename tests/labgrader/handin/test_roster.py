"""roster.csv: whatever a student's name holds, it stays in its own row."""

import pytest

from labgrader.handin.roster import person_of, read_roster
from labgrader.report.outputs import harmless

# What ends a line for str.splitlines or for a terminal, beside \\n and \\r.
ENDS = "\v\f\x1c\x1d\x1e\x85\u2028\u2029"


def roster(folder, text: str):
    (folder / "roster.csv").write_bytes(text.encode())
    return read_roster(folder)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("name", [f"Eve{c}8,Grace,g@x.org" for c in ENDS] + ["Eve\n8", "Eve\r\n8,Grace", "Eve\x1b[2J"])
def test_a_name_with_a_lines_end_moves_no_other_row(tmp_path, name, end):
    people = roster(tmp_path, end.join(["id,name,email", f'7,"{name}",e@x.org', "8,Grace,g@x.org", ""]))
    assert list(people) == ["7", "8"]
    assert (people["8"].name, people["8"].email, people["7"].email) == ("Grace", "g@x.org", "e@x.org")
    assert people["7"].name.isprintable() and people["7"].name.startswith("Eve ")


@pytest.mark.parametrize(
    "line, says",
    [
        ('7,"Eve,e@x.org', "quotation mark"),
        ('7,"Eve" x,e@x.org', "line 2: ',' expected after '\"'"),
        ("7,Adams, Eve,e@x.org", "line 2: expected 3 cells, got 4; a cell with a comma needs quotes"),
    ],
)
def test_a_row_that_would_move_cells_is_refused_with_its_line(tmp_path, line, says):
    with pytest.raises(ValueError, match=r"roster\.csv") as error:
        roster(tmp_path, f"id,name,email\n{line}\n8,Grace,g@x.org\n")
    assert says in str(error.value)


def test_ids_are_the_same_however_their_letters_are_composed(tmp_path):
    people = roster(tmp_path, "id,name\nZoe\u0308_7,Zoe\u0308\n")
    assert person_of(people, "Zo\u00eb_7") is person_of(people, "Zoe\u0308_7") is not None


@pytest.mark.parametrize("start", "=+-@\uff1d\uff0b\uff0d\uff20\ufe66\ufe62\ufe63\ufe6b")
@pytest.mark.parametrize("before", ["", " ", "\u200b", "ada;", "ada\u2028", "ada\v "])
def test_no_cell_is_a_formula_in_any_of_its_forms(start, before):
    assert harmless(f"{before}{start}1+1") == f"{before}'{start}1+1"
