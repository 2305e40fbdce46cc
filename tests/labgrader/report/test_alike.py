"""Answers that are alike beyond what their task forces are listed for the instructor, and others are not."""

import ast
import json
import re
import tracemalloc
from pathlib import Path

import grading_course as kit
import pytest

from labgrader.course import of_topic, topics
from labgrader.grade import copied_code
from labgrader.grade.batch import Record, write_record
from labgrader.grade.grade import Result
from labgrader.grade.read_programs import read_all, read_program
from labgrader.grade.shapes import shapes
from labgrader.handin.reading import read_lab
from labgrader.program.effects import without_idle
from labgrader.program.fingerprint import fingerprints
from labgrader.report import alike
from labgrader.report.alike import Found, old_records
from labgrader.report.alike_page import MOST_NAMED, alike_page, terminal_lines, write_alike

LABS = ("04_iou", "07_grasp", "09_other_stacks")


class Copier(ast.NodeTransformer):
    """Renames what a function calls its own, turns sums and comparisons round, and swaps independent neighbours."""

    def __init__(self, tree: ast.AST):
        stored = (n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store))
        self.names = {name: f"thing_{i}" for i, name in enumerate(sorted(set(stored)))}

    def visit_Name(self, node):
        return ast.Name(self.names.get(node.id, node.id), node.ctx)

    def visit_arg(self, node):
        return ast.arg(self.names.setdefault(node.arg, f"given_{len(self.names)}"))

    def visit_BinOp(self, node):
        node = self.generic_visit(node)
        turned = isinstance(node.op, ast.Add | ast.Mult)
        return ast.BinOp(node.right, node.op, node.left) if turned else node

    def visit_FunctionDef(self, node):
        node = self.generic_visit(node)
        for i, (a, b) in enumerate(zip(node.body, node.body[1:], strict=False)):
            free = not names(a) & names(b, ast.Store) and not names(a, ast.Store) & names(b)
            if isinstance(a, ast.Assign) and isinstance(b, ast.Assign) and free:
                node.body[i : i + 2] = [b, a]
        return node


class Loops(ast.NodeTransformer):
    """Writes the first comprehension of a statement as a loop above it."""

    def __init__(self):
        self.above: list[ast.stmt] = []

    def visit_ListComp(self, node):
        if self.above:
            return node
        body: list[ast.stmt] = [ast.Expr(ast.Call(ast.parse("kept.append").body[0].value, [node.elt], []))]
        for one in reversed(node.generators):
            for test in one.ifs:
                body = [ast.If(test, body, [])]
            body = [ast.For(one.target, one.iter, body, [])]
        self.above = [ast.parse("kept = []").body[0], *body]
        return ast.Name("kept", ast.Load())


def names(node: ast.AST, context=ast.expr_context) -> set[str]:
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, context)}


def renamed(source: str) -> str:
    tree = ast.parse(source)
    return ast.unparse(ast.fix_missing_locations(Copier(tree).visit(tree)))


def with_loops(source: str) -> str:
    tree = ast.parse(source)
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            body = []
            for statement in function.body:
                loops = Loops()
                statement = loops.visit(statement) if isinstance(statement, ast.Assign | ast.Return) else statement
                body += [*loops.above, statement]
            function.body = body
    return ast.unparse(ast.fix_missing_locations(tree))


def record(student: str, programs: dict[str, str]) -> Record:
    results = tuple(Result(name, 1.0, 1.0, "right", program=text, right=True) for name, text in programs.items())
    return Record(student, "", results, True, student, "key")


@pytest.fixture(scope="module")
def labs(tmp_path_factory):
    """A course with three labs, by topic."""
    course = tmp_path_factory.mktemp("course")
    for topic in LABS:
        kit.write(course / "labs" / topic / f"{topic}.ipynb", kit.lab_notebook(topic, whole=True))
    return {topic: (course, read_lab(course, topic)) for topic in LABS}


def find_alike(course: Path, lab, records: list[Record], old: list[Record] = (), term: str = "old") -> Found:
    known = read_all([result.program for record in (*records, *old) for result in record.results])
    return alike.find_alike(course, lab, {term: old, "": records}, known)


def people(found: Found) -> set[frozenset]:
    return {frozenset((str(pair.one), str(pair.other), pair.question)) for pair in found.pairs}


def test_of_planted_pairs_nine_of_ten_are_found_and_of_others_none(labs):
    """In each class every other right answer of a lab is somebody's; then each is handed in in disguise as well."""
    planted, found, others = set(), set(), set()
    for topic, (course, lab) in labs.items():
        for disguise in (renamed, lambda source: renamed(with_loops(source))):
            authors, copiers = {}, {}
            for name, sources in kit.other_answers(topic).items():
                for i, source in enumerate(sources):
                    if disguise is renamed or " for " in source:
                        authors.setdefault(i, {})[name] = source
                        copiers.setdefault(i, {})[name] = disguise(source)
            records = [record(f"author {i}", programs) for i, programs in authors.items()]
            records += [record(f"copier {i}", programs) for i, programs in copiers.items()]
            for pair in find_alike(course, lab, records).pairs:
                one, other = sorted((pair.one.whose, pair.other.whose))
                same = one[-1] == other[-1] and one != other
                (found if same else others).add((topic, pair.question, one, disguise) if same else pair.question)
            planted |= {(topic, name, f"author {i}", disguise) for i, of in authors.items() for name in of}
    assert len(planted) >= 30 and found <= planted and len(found) >= 0.9 * len(planted), planted - found
    assert others <= {"grasp_pose"}  # of whose two samples one is the other with a function around it


OWN = """def iou(n):
    scores = []
    for c in range(len(n)):
        missed = sum(int(n[c, j]) for j in range(len(n)) if j != c)
        union = int(n[c].sum()) + int(n[:, c].sum()) - int(n[c, c]) + 0 * missed
        scores.append(int(n[c, c]) / union if union else float("nan"))
    return np.array(scores)
"""


def test_what_the_class_has_in_common_is_the_tasks_but_a_text_that_many_share_is_found(labs):
    course, lab = labs["04_iou"]
    disguised = [OWN.replace("scores", f"s{i}").replace("missed", f"m{i}") for i in range(8)]
    many = [record(f"s{i}", {"iou": text}) for i, text in enumerate(disguised)]
    assert not find_alike(course, lab, many).pairs
    ring = [record(f"s{i}", {"iou": OWN}) for i in range(8)]
    found = find_alike(course, lab, ring)
    assert len(found.pairs) == 28 and len(found.groups) == 1
    assert len(find_alike(course, lab, many[:2]).pairs) == 1


def test_a_copied_solution_or_reference_is_listed_whatever_was_added(labs):
    course, lab = labs["04_iou"]
    reference = kit.copied_answers("04_iou")["trimap_band"]
    solution = OWN.replace("def iou", "def mean_iou")
    path = course / "solutions/04_iou/04_iou.ipynb"
    kit.write(path, kit.lab_notebook("04_iou", {"mean_iou": solution}, whole=True))
    body = renamed(reference).split("\n")
    hidden = "\n".join([*body[:-1], "    pass", body[-1]])
    records = [record("ada", {"trimap_band": hidden, "mean_iou": renamed(solution)}), record("ben", {"iou": OWN})]
    found = find_alike(course, lab, records)
    path.unlink()
    said = {(pair.question, str(pair.one), str(pair.other)) for pair in found.pairs}
    assert said == {("trimap_band", "ada", "the kit's reference"), ("mean_iou", "ada", "the model solution")}


# Each is put into a copy at the beginning of each function, and before each of its last lines.
IDLE = (
    ("pass",),
    ("...", "'a text'", "0", "True"),
    ("idle = 1", "idle_2 = idle + 2", "idle_3 = [idle_2, idle]", "assert True"),
    ("import math", "def idle_6(a):\n    return a + 1", "idle_7 = idle_6(2) + math.pi", "print('here')"),
    ("if False:\n    return 1", "while 0:\n    x = 1", "for _ in range(3):\n    pass", "len('abc') > 2"),
    ("idle_4 = 0", "idle_4 += 1", "idle_5: int = 3", "np.zeros(3)"),
)


class Padded(ast.NodeTransformer):
    """Puts statements into each function."""

    def __init__(self, lines: tuple[str, ...]):
        self.added = [ast.parse(line).body[0] for line in lines]

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        node.body = [*self.added, *node.body[:-1], *self.added, node.body[-1]]
        return node


def padded(source: str, lines: tuple[str, ...]) -> str:
    return ast.unparse(ast.fix_missing_locations(Padded(lines).visit(ast.parse(source))))


@pytest.mark.parametrize("lines", IDLE, ids=lambda lines: lines[0].split("\n")[0])
def test_lines_without_effect_hide_no_copy_of_a_reference(lines):
    """All references that are long enough to be known, by their fingerprints; and as many as before by likeness."""
    questions = [question for topic in topics() for question in of_topic(topic).values()]
    known = [question for question in questions if fingerprints(question.source)]
    assert len(known) >= 45
    for question in known:
        copied = fingerprints(padded(question.source, lines))
        assert copied_code.of_the_kit(copied, question), question.name
        kept, idle = (read_program(text).shapes.keys() for text in (question.source, padded(question.source, lines)))
        assert kept == idle, question.name


def test_what_has_an_effect_is_kept():
    source = """def f(n, out):
    n[0] = 1
    out.sort()
    np.fill_diagonal(out, 0)
    np.add(n, 1, out=out)
    x = g(n)
    for k in range(3):
        x += k
    if n:
        raise ValueError
    return x"""
    assert ast.unparse(without_idle(ast.parse(source))) == source
    assert "y = 1" in ast.unparse(without_idle(ast.parse("y = 1\ndef f(): return 2")))  # others read it


def test_a_long_chain_with_comments_between_its_lines_takes_little_memory():
    """470 additions over many lines: 1.4 GB when each kept all lines that it spans."""
    comments = "\n    #".join([""] * 80)
    source = "def f(x):\n  return (x" + "".join(f"{comments}\n    + {i}" for i in range(470)) + ")"
    tracemalloc.start()
    try:
        found = shapes(ast.parse(source))
        size = len(json.dumps(found))
        used = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(found) > 400 and used < 30 << 20 and size < 1 << 20


def test_an_earlier_term_is_compared_with_this_one_but_not_with_itself_or_with_who_comes_again(labs, tmp_path):
    course, lab = labs["04_iou"]
    past = [record(name, {"iou": OWN.replace("c", "k")}) for name in ("old_1", "old_2", "Ada Lovelace_77")]
    for one in past:
        write_record(tmp_path / "autumn/grades/04_iou", one)
    old = old_records(tmp_path / "autumn", "04_iou")
    found = find_alike(course, lab, [record("Ada King_77", {"iou": OWN})], old, "autumn")
    assert people(found) == {frozenset(("Ada King_77", f"old_{i} (autumn)", "iou")) for i in (1, 2)}
    with pytest.raises(ValueError, match="against: expected a course in which 04_iou was graded"):
        old_records(tmp_path, "04_iou")


def test_a_program_that_breaks_the_parser_costs_nobody_else(labs):
    course, lab = labs["04_iou"]
    deep = "x = " + "-" * 30_000 + "1"
    records = [record("ada", {"iou": OWN}), record("eve", {"iou": deep}), record("ben", {"iou": renamed(OWN)})]
    found = find_alike(course, lab, records)
    assert found.unread == ("eve: iou",) and people(found) == {frozenset(("ada", "ben", "iou"))}
    assert {*read_all(["(" * 9_000, "\0", "def f(:", "x" * 50_000]).values()} == {None}


def test_the_page_shows_both_marks_what_they_share_and_lets_nothing_run(labs, tmp_path):
    course, lab = labs["04_iou"]
    hostile = OWN + "    # </pre><script>alert(1)</script>\n"
    records = [record("ada", {"iou": hostile}), record("=ben", {"iou": renamed(OWN)})]
    found = find_alike(course, lab, records)
    write_alike(tmp_path, lab, records, found)
    page = (tmp_path / "alike.html").read_text()
    assert "<script>" not in page and "&lt;script&gt;" in page and page.count("<pre tabindex") == 2
    marked = re.findall("<mark>(.*?)</mark>", page)
    assert any("union = " in line for line in marked) and not any(line.startswith("def iou") for line in marked)
    assert (tmp_path / "alike.csv").read_text().splitlines()[1].startswith("iou,ada,'=ben,1.00,")
    assert "None." in alike_page(lab, [], Found()) and terminal_lines(Found(), Path("x")) == []
    assert terminal_lines(found, Path("alike.html"))[0].startswith("1 group of answers is more alike")


def test_twenty_with_one_answer_are_one_group_of_the_page_and_others_are_others(labs):
    course, lab = labs["04_iou"]
    other = kit.other_answers("04_iou")["mean_iou"][0]
    crowd = [record(f"s{i}", {"iou": OWN if i % 2 else renamed(OWN), "mean_iou": OWN + f"# {i}"}) for i in range(20)]
    crowd += [record(name, {"iou": "def iou(n):\n    return n", "mean_iou": other}) for name in ("ada", "ben")]
    found = find_alike(course, lab, crowd)
    assert sorted(len(group.hands) for group in found.groups if group.question == "iou") == [20]
    page = alike_page(lab, crowd, found)
    sizes = re.findall(r"<h2>(\d+) answers: ", page)
    assert sizes == ["20"] and page.count("<section") <= 2
    assert page.count("<pre tabindex") <= 2 + 20 + 2, "the two texts of iou stand there once each"
    lines = terminal_lines(found, Path("x"))
    assert "20 answers: s0, s1, s10, s11, ..." in lines[1] and len(lines) <= 3
    many = [pair(f"a{i}", f"b{i}") for i in range(MOST_NAMED + 3)]
    assert len(terminal_lines(Found(tuple(many)), Path("x"))) == MOST_NAMED + 2


def pair(one: str, other: str) -> alike.Pair:
    hands = (alike.Hand(name, "", {}) for name in (one, other))
    return alike.Pair("iou", *hands, 1.0, frozenset("x"))
