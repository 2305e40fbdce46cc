"""From a notebook to the program that answers one question: a slice of it, the answer's cell and what that needs.

The check in a notebook, `labkit check` and the grader run the same program, so a tick of one is a tick of the others:

    program(cells, "iou", blanks)    the cell that defines iou, and by names the definitions, imports and constants of
                                     other cells that it needs; not the rest of these cells, and not their drawings

In this order: a cell becomes statements that know which names they bind, change and need (`Parsed`, `Statement`); from
the answer on, names are followed to the statements that give them their values (`Slice`).

Nothing here runs a student's code. The module needs the standard library alone, so that it can also run in the
grader's sandbox: a stranger's text may break a parser.
"""

import ast
import builtins
import re
import symtable
import sys
from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

UNREADABLE = (SyntaxError, ValueError, RecursionError, MemoryError)  # what a parser raises for a stranger's text
# Cell magics around Python; others hold another language.
KEEPS_ITS_BODY = ("%%time", "%%timeit", "%%capture", "%%prun")
# Names that show something or count progress. They are replaced by functions that do nothing.
QUIET = {
    "tqdm": "lambda things=(), *rest, **options: things",
    "trange": "lambda *bounds, **options: range(*(b for b in bounds if isinstance(b, int)))",
    "display": "lambda *things, **options: None",
    "clear_output": "lambda *things, **options: None",
}
QUIET_MODULES = ("tqdm", "IPython")
KIT = ("labkit", "data_gen")


@dataclass(frozen=True)
class Cell:
    """A code cell: its source, and the grade id that nbgrader gave it, "" if none."""

    source: str
    grade_id: str = ""


@dataclass(frozen=True)
class Program:
    """What to run, in order, in one namespace, before the answer is called.

    pieces: (name, text) of each cell that is needed; lines that are not needed are blank, so that numbers of lines are
    those of the cell. calls: other blanks that the answer calls, directly or not. refused: why the answer cannot be
    graded, in words for its student; "" if it can.
    """

    pieces: tuple[tuple[str, str], ...] = ()
    calls: tuple[str, ...] = ()
    refused: str = ""


class Refused(Exception):
    """An answer that cannot be graded; the text says why."""


def program(
    cells: Sequence[Cell],
    name: str,
    blanks: Collection[str] = (),
    packages: Collection[str] = ("numpy",),
    forbidden: Collection[str] = (),
    given: Mapping[str, str] | None = None,
    latest: bool = False,
) -> Program:
    """Cut out of a notebook's code cells the program that defines the function `name`.

    cells: all code cells, in the notebook's order, or in the order in which they were run if `latest` is set: then the
    last definition of a name counts, otherwise the nearest one above, and only without that the first one below.
    blanks: functions that the lab asks for. packages: those that there are where answers are graded, beside the
    standard library; forbidden: those that this task does not allow. given: for blanks that the student has wrong, the
    source that takes their place.

    >>> cells = [Cell("import numpy as np\\nimport matplotlib.pyplot as plt"), Cell("half = 0.5\\nplt.plot([half])")]
    >>> program([*cells, Cell("def f(x):\\n    return half * np.abs(x)")], "f").pieces
    (('cell 1', 'import numpy as np\\n'), ('cell 2', 'half = 0.5\\n'), ('f', 'def f(x):\\n    return half * np.abs(x)'))
    """
    try:
        without = {module.partition(".")[0] for module in forbidden}
        modules = {*packages, *sys.stdlib_module_names} - without
        return Slice(list(map(parsed, cells)), name, blanks, given or {}, modules, without, latest).program()
    except Refused as reason:
        return Program(refused=str(reason))


def cells_of(notebook_cells: object) -> list[Cell]:
    """The code cells of a notebook as JSON has it; whatever is none is left out."""
    found = []
    for cell in notebook_cells if isinstance(notebook_cells, list) else ():
        if not isinstance(cell, dict) or cell.get("cell_type") != "code":
            continue
        source, metadata = cell.get("source"), cell.get("metadata")
        if isinstance(source, list) and all(isinstance(line, str) for line in source):
            source = "".join(source)
        mark = metadata.get("nbgrader") if isinstance(metadata, dict) else None
        grade_id = mark.get("grade_id") if isinstance(mark, dict) else None
        if isinstance(source, str):
            found.append(Cell(source, grade_id if isinstance(grade_id, str) else ""))
    return found


# ------------------------------------------------------------------------------------------------------- one cell


class Statement:
    """Statements at the top of a cell that share lines, usually one.

    binds: names that it gives a value. touches: names whose value it may change. needs: names that it or a function in
    it reads. modules: what it imports where the import must succeed. star: whether it imports all names of a module.
    future: whether it is an import from __future__. imports: whether all that it does is to import.
    """

    def __init__(self, nodes: list[ast.stmt], lines: list[str]):
        self.nodes = nodes
        self.first, self.last = first_line(nodes[0]), last_line(nodes)
        binds, needs = names_of("\n".join(lines[self.first - 1 : self.last]))
        checked = [target for node in nodes if is_check(node) for target in node.targets]
        self.binds = binds - {target.id for target in checked if isinstance(target, ast.Name)}
        self.touches = set().union(*map(touched, nodes)) & (needs | self.binds)  # others are names inside functions
        self.needs = needs | self.touches
        self.modules = {module for node in nodes for module in imported(node)}
        froms = [node for node in nodes if isinstance(node, ast.ImportFrom)]
        self.star = any(node.names[0].name == "*" for node in froms)
        self.future = any(node.module == "__future__" for node in froms)
        self.imports = any(isinstance(node, ast.Import | ast.ImportFrom) for node in nodes)


class Parsed:
    """A cell as statements; `statements` is empty, and `problem` says why, if it is not Python."""

    def __init__(self, cell: Cell):
        self.grade_id, self.source = cell.grade_id, cell.source
        self.text = cell.source.replace("\r\n", "\n").replace("\r", "\n")
        self.problem = ""
        self.statements: list[Statement] = []
        try:
            tree = self.parse()
            self.dump = ast.dump(tree)
            self.statements = statements(tree, self.text.split("\n"))
        except UNREADABLE as error:
            line = getattr(error, "lineno", None)
            self.problem = f"its cell is not Python{f': look at line {line}' if line else ''}"

    def parse(self) -> ast.Module:
        """Parse the cell; what only IPython understands is taken out, each time that it stops the parser."""
        magic = re.match(r"\s*(%%\w+).*", self.text)
        if magic:
            rest = self.text[magic.end() :]
            self.text = "\n" * self.text[: magic.end()].count("\n") + rest
            self.text = self.text if magic[1] in KEEPS_ITS_BODY else "\n" * self.text.count("\n")
        while True:
            try:
                return ast.parse(self.text)
            except SyntaxError as error:
                lines = self.text.split("\n")
                number = (error.lineno or 0) - 1
                if not 0 <= number < len(lines) or (plain := without_magic(lines[number])) is None:
                    raise
                lines[number] = plain
                self.text = "\n".join(lines)

    @cached_property
    def binds(self) -> set[str]:
        """All names that the cell gives a value."""
        return set().union(*(statement.binds for statement in self.statements))

    def defines(self, name: str) -> bool:
        """Whether the cell defines a function of this name, and does not merely use the name for something."""
        for statement in self.statements:
            for node in statement.nodes:
                if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name:
                    return True
                if isinstance(node, ast.Assign) and isinstance(node.value, ast.Lambda) and name in statement.binds:
                    return True
        return False

    def is_blank(self, name: str) -> bool:
        """Whether the function of this name is as it was released: it only raises NotImplementedError."""
        for statement in self.statements:
            for node in statement.nodes:
                if isinstance(node, ast.FunctionDef) and node.name == name:
                    body = node.body[1:] if ast.get_docstring(node) is not None else node.body
                    return len(body) == 1 and isinstance(body[0], ast.Raise) and "NotImplemented" in ast.dump(body[0])
        return False

    def kept(self, chosen: Collection[int]) -> str:
        """The text with only these statements, by their positions; other lines are blank."""
        lines = {n for i in chosen for n in range(self.statements[i].first, self.statements[i].last + 1)}
        return "\n".join(line if n in lines else "" for n, line in enumerate(self.text.split("\n"), start=1))


parsed = lru_cache(maxsize=256)(Parsed)  # the programs of a notebook's answers are cut out of the same cells


def without_magic(line: str) -> str | None:
    """A line without what only IPython understands, None if there is no such thing in it.

    >>> without_magic("%time x = 1"), without_magic("    !ls"), without_magic("x = %timeit -o f()")
    ('x = 1', '    pass', 'x = None')
    """
    if timed := re.match(r"(\s*)%time\s+(\S.*)$", line):
        return timed[1] + timed[2]
    if whole := re.match(r"(\s*)(?:[%!].*|\?{1,2}[\w.]+;?\s*|[\w.%]+\?{1,2};?\s*)$", line):
        return whole[1] + "pass"
    if assigned := re.match(r"(\s*[\w\s,.]+=\s*)[%!]", line):
        return assigned[1] + "None"
    return None


def statements(tree: ast.Module, lines: list[str]) -> list[Statement]:
    """The statements of a cell, those on the same lines together."""
    together: list[list[ast.stmt]] = []
    for node in tree.body:
        if together and first_line(node) <= last_line(together[-1]):
            together[-1].append(node)
        else:
            together.append([node])
    return [Statement(nodes, lines) for nodes in together]


def first_line(node: ast.stmt) -> int:
    """The number of a statement's first line; decorators stand above it."""
    return min([node.lineno, *(decorator.lineno for decorator in getattr(node, "decorator_list", []))])


def last_line(nodes: list[ast.stmt]) -> int:
    """The number of the last line of some statements."""
    return max(node.end_lineno for node in nodes)


def names_of(text: str) -> tuple[set[str], set[str]]:
    """The names that a text binds at its top, and those that it, or a function in it, reads from there."""
    top = symtable.symtable(text, "cell", "exec")
    binds = {s.get_name() for s in top.get_symbols() if s.is_assigned() or s.is_imported() or s.is_namespace()}
    needs = {s.get_name() for s in top.get_symbols() if s.is_referenced()}
    inner = list(top.get_children())
    while inner:
        table = inner.pop()
        needs |= {s.get_name() for s in table.get_symbols() if s.is_global()}
        inner += table.get_children()
    return binds, needs


def touched(node: ast.stmt) -> set[str]:
    """Names whose value a statement may change in place: x[0] = 1, x.a = 1, x += 1, x.append(1), np.add.at(x, ...)."""
    found = set()
    for part in ast.walk(node):
        if isinstance(part, ast.Subscript | ast.Attribute) and isinstance(part.ctx, ast.Store | ast.Del):
            found.add(root(part))
        elif isinstance(part, ast.AugAssign):
            found.add(root(part.target))
        elif isinstance(part, ast.Expr) and isinstance(part.value, ast.Call):
            function = part.value.func
            if isinstance(function, ast.Attribute):
                found.add(root(function))
                if root(function) in ("np", "numpy", "random"):
                    found |= {root(argument) for argument in part.value.args[:1]}
    return found - {"", "np", "numpy", "plt"}


def root(node: ast.expr) -> str:
    """The name at the beginning of x.y[0].z, "" if there is none."""
    while isinstance(node, ast.Attribute | ast.Subscript | ast.Call | ast.Starred):
        node = node.func if isinstance(node, ast.Call) else node.value
    return node.id if isinstance(node, ast.Name) else ""


def imported(node: ast.AST) -> Iterator[str]:
    """The packages that a statement imports, in functions too; not those whose failing it handles."""
    if isinstance(node, ast.Try) and node.handlers:
        return
    if isinstance(node, ast.Import):
        yield from (alias.name.partition(".")[0] for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        yield (node.module or "").partition(".")[0] if not node.level else "."
    for child in ast.iter_child_nodes(node):
        yield from imported(child)


def is_check(node: ast.stmt) -> bool:
    """Whether a statement is `iou = check("04_iou.iou", iou)`: it puts nothing new in the place of the answer."""
    if not isinstance(node, ast.Assign) or not isinstance(node.value, ast.Call):
        return False
    function = node.value.func
    return getattr(function, "id", getattr(function, "attr", "")) == "check"


# -------------------------------------------------------------------------------------------------- several cells


@dataclass
class Slice:
    """The slice of a notebook for one answer: the statements that give values to the names that it needs.

    cells: in the order of the notebook, or in that in which they were run if `latest` is set. name: of the answer.
    blanks, given: as in `program`. modules: those that there are where answers are graded, forbidden: those that there
    are, but not for this task. Raises Refused where the answer cannot be graded.
    """

    cells: list[Parsed]
    name: str
    blanks: Collection[str]
    given: Mapping[str, str]
    modules: Collection[str]
    forbidden: Collection[str]
    latest: bool

    def __post_init__(self):
        self.home = self.home_of_answer()
        self.chosen: dict[int, set[int]] = {}  # positions of statements, by cell
        self.calls: dict[str, None] = {}  # other blanks, in the order in which they are met
        self.quiet: dict[str, None] = {}  # names of QUIET that no cell gives a value
        self.follow()

    def program(self) -> Program:
        """The slice as texts to run."""
        pieces = [("quiet", "\n".join(f"{name} = {QUIET[name]}" for name in self.quiet))] if self.quiet else []
        pieces += [(f"{blank}, the kit's", self.given[blank]) for blank in self.calls if blank in self.given]
        for where in sorted(self.chosen):
            label = self.name if where == self.home else f"cell {where + 1}"
            pieces.append((label, hushed(self.cells[where].kept(self.chosen[where]))))
        return Program(tuple(pieces), tuple(self.calls))

    def follow(self) -> None:
        """Follow names from the answer to the statements that give them values, and to what these need, and so on."""
        seen = {(self.name, self.home)}
        waiting = deque([(self.name, self.home, (self.name,))])  # a name, the cell that needs it, and how it came there
        while waiting:
            wanted, asking, way = waiting.popleft()
            for where, statement in self.choose(wanted, asking):
                self.allow(statement, way)
                for other in sorted(statement.needs):
                    if (other, where) not in seen:
                        seen.add((other, where))
                        waiting.append((other, where, (*way, other)))

    def choose(self, wanted: str, asking: int) -> Iterator[tuple[int, Statement]]:
        """Take in the statements that a name needs which a cell reads: those that are new in the slice, by cell."""
        if wanted in self.blanks and wanted != self.name:
            self.calls[wanted] = None
            if wanted in self.given:
                return
        at = self.home if wanted == self.name else self.place(wanted, asking)
        if at is None:
            if wanted in QUIET:
                self.quiet[wanted] = None
            return
        # What changes a value in place counts, up to the answer; a module is no value.
        binding = [statement for statement in self.cells[at].statements if wanted in statement.binds]
        is_value = not any(statement.imports for statement in binding)
        for where in range(at, max(at, self.home) + 1):
            for i, statement in enumerate(self.cells[where].statements):
                binds = where == at and (wanted in statement.binds or statement.star or statement.future)
                changes = is_value and wanted in statement.touches
                if (binds or changes) and i not in self.chosen.setdefault(where, set()):
                    self.chosen[where].add(i)
                    yield where, statement

    def home_of_answer(self) -> int:
        """The cell that holds the answer; raises Refused if there is none, or several that differ."""
        name, cells = self.name, self.cells
        marked = [i for i, cell in enumerate(cells) if cell.grade_id == name]
        binding = [i for i in marked if name in cells[i].binds]
        answered = [i for i in binding if not cells[i].is_blank(name)]
        if len({cells[i].dump for i in answered}) > 1:
            raise Refused(f"{len(answered)} different cells have its grade id: keep one")
        elsewhere = [i for i, cell in enumerate(cells) if i not in marked and cell.defines(name)]
        if self.latest and elsewhere:
            if not answered or answered[-1] > elsewhere[-1]:
                return max([elsewhere[-1], *answered])
            if cells[elsewhere[-1]].dump != cells[answered[-1]].dump:
                raise Refused(f"the cell of its task holds another {name}, which would be graded: put yours there")
        elsewhere = [i for i in elsewhere if not cells[i].is_blank(name)]
        if found := answered or elsewhere or binding:
            return found[-1]
        raise Refused(next((cells[i].problem for i in marked if cells[i].problem), f"no cell defines {name}"))

    def place(self, wanted: str, asking: int) -> int | None:
        """The cell that gives a name its value for a cell that needs it; None if that is Python's own, or nobody's."""
        binding = [i for i, cell in enumerate(self.cells) if wanted in cell.binds]
        if wanted in self.blanks:
            marked = [i for i in binding if self.cells[i].grade_id == wanted]
            binding = marked or [i for i in binding if self.cells[i].defines(wanted)]
        if asking in binding:
            return asking
        if self.latest and binding:
            return binding[-1]
        if above := [i for i in binding if i < asking]:
            return above[-1]
        if hasattr(builtins, wanted):
            return None
        if below := [i for i in binding if i > asking]:
            return below[0]
        stars = [i for i, cell in enumerate(self.cells) if any(statement.star for statement in cell.statements)]
        return stars[-1] if stars else None

    def allow(self, statement: Statement, way: tuple[str, ...]) -> None:
        """Raise Refused if a statement needs what is absent where answers are graded; way: names that led to it."""
        through = f"it uses {way[1]}: " if len(way) > 1 else ""
        if "open" in statement.needs and not any("open" in cell.binds for cell in self.cells):
            raise Refused(f"{through}an answer opens no file; take what you need from the arguments")
        if "tempfile" in statement.modules:
            raise Refused(f"{through}an answer writes no file; keep what you need in arrays")
        for module in sorted(statement.modules - self.modules - set(QUIET_MODULES)):
            if module in KIT:
                raise Refused(f"{through}an answer does not use {module}; take what you need from the arguments")
            if module in self.forbidden:
                raise Refused(f"{through}the task is to do it without {module}")
            raise Refused(f"{through}there is no module {module[:40]} where answers are graded")


def hushed(text: str) -> str:
    """Put functions that do nothing in the place of what is imported of tqdm and IPython."""
    if not any(module in text for module in QUIET_MODULES):
        return text
    lines = text.split("\n")
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if not isinstance(node, ast.Import | ast.ImportFrom) or set(imported(node)) - set(QUIET_MODULES):
            continue
        quiet = ", ".join(f"{name}={function}" for name, function in QUIET.items())
        bound = {}
        for alias in node.names:
            if isinstance(node, ast.ImportFrom) and alias.name in QUIET:
                bound[alias.asname or alias.name] = QUIET[alias.name]
            else:
                bound[alias.asname or alias.name.partition(".")[0]] = f'__import__("types").SimpleNamespace({quiet})'
        indent = lines[node.lineno - 1][: node.col_offset]
        for n in range(node.lineno - 1, node.end_lineno):
            lines[n] = ""
        lines[node.lineno - 1] = indent + "; ".join(f"{name} = {value}" for name, value in bound.items())
    return "\n".join(lines)
