"""A notebook's code cell as statements that know which names they bind, change and need.

Nothing here runs a student's code. The module needs the standard library alone.
"""

import ast
import re
import symtable
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

UNREADABLE = (SyntaxError, ValueError, RecursionError, MemoryError)  # what a parser raises for a stranger's text
CONFLICT = re.compile(r"^(<{7}|>{7})(?: .*)?$", re.MULTILINE)  # what git writes round two versions of some lines
# Cell magics around Python; others hold another language.
KEEPS_ITS_BODY = ("%%time", "%%timeit", "%%capture", "%%prun")


@dataclass(frozen=True)
class Cell:
    """A code cell: its source, and the grade id that nbgrader gave it, "" if none."""

    source: str
    grade_id: str = ""


def cells_of(notebook_cells: object) -> list[Cell]:
    """The code cells of a notebook as JSON has it; whatever is none is left out."""
    cells = notebook_cells if isinstance(notebook_cells, list) else ()
    code = [cell for cell in cells if isinstance(cell, dict) and cell.get("cell_type") == "code"]
    return [Cell(source, grade_id(cell) or "") for cell in code if (source := source_of(cell)) is not None]


def source_of(cell: dict) -> str | None:
    """The source of a cell, which may be text or a list of lines; None if it is neither."""
    source = cell.get("source")
    if isinstance(source, list) and all(isinstance(line, str) for line in source):
        source = "".join(source)
    return plain_text(source) if isinstance(source, str) else None


def plain_text(text: str) -> str:
    """A text without halves of characters, which JSON can hold and files cannot."""
    return text.encode("utf-8", "replace").decode()


def grade_id(cell: object) -> str | None:
    """The grade id of a cell, None if it has none or is none."""
    try:
        name = cell["metadata"]["nbgrader"]["grade_id"]
    except (TypeError, KeyError):
        return None
    return name if isinstance(name, str) else None


class Statement:
    """A statement at the top of a cell; of `import a, b` each name is one of its own.

    text: its own, from line `first` to line `last`. binds: names that it gives a value. touches: names whose value it
    may change. needs: names that it or a function in it reads; reads: those that it reads as it runs. modules: what it
    imports where the import must succeed.
    star: whether it imports all names of a module. future: whether it is an import from __future__. imports: whether
    all that it does is to import.
    """

    def __init__(self, node: ast.stmt, text: str):
        self.node, self.text = node, text
        self.first, self.last = first_line(node), node.end_lineno
        binds, needs, reads = names_of(text)
        checked = node.targets if is_check(node) else []
        self.binds = binds - {target.id for target in checked if isinstance(target, ast.Name)}
        self.touches = touched(node) & (needs | self.binds)  # others are names inside functions
        self.needs, self.reads = needs | self.touches, reads | self.touches
        self.modules = set(imported(node))
        is_from = isinstance(node, ast.ImportFrom)
        self.star = is_from and node.names[0].name == "*"
        self.future = is_from and node.module == "__future__"
        self.imports = isinstance(node, ast.Import | ast.ImportFrom)


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
            self.statements = list(statements(tree, self.text.split("\n")))
        except UNREADABLE as error:
            line, mark = getattr(error, "lineno", None), CONFLICT.search(self.source)
            where = f"look at line {line}" if line else ""
            if mark and "\n=======" in self.source:
                line = self.source.count("\n", 0, mark.start()) + 1
                where = f"it has git's conflict marks, the first in line {line}: keep one of the versions"
            self.problem = f"its cell is not Python{': ' if where else ''}{where}"

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

    def is_earlier(self, name: str, position: int) -> bool:
        """Whether a statement that runs needs the value that a name had before the cell changes it: k = k + 1."""
        return self.first.get(name, -1) >= position and name in self.statements[position].reads

    def changes(self, name: str) -> bool:
        """Whether the cell makes the value of a name out of the one that it had before."""
        return name in self.first and self.is_earlier(name, self.first[name])

    @cached_property
    def first(self) -> dict[str, int]:
        """By each name that the cell gives a value the position of the first statement that does."""
        found: dict[str, int] = {}
        for i, statement in enumerate(self.statements):
            for name in statement.binds:
                found.setdefault(name, i)
        return found

    @property
    def binds(self) -> Collection[str]:
        """All names that the cell gives a value."""
        return self.first.keys()

    def defines(self, name: str) -> bool:
        """Whether the cell defines a function of this name, and does not merely use the name for something."""
        for statement in self.statements:
            node = statement.node
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name:
                return True
            if isinstance(node, ast.Assign) and isinstance(node.value, ast.Lambda) and name in statement.binds:
                return True
        return False

    def is_blank(self, name: str) -> bool:
        """Whether the function of this name is as it was released: it only raises NotImplementedError."""
        for node in (statement.node for statement in self.statements):
            if isinstance(node, ast.FunctionDef) and node.name == name:
                body = node.body[1:] if ast.get_docstring(node) is not None else node.body
                return len(body) == 1 and isinstance(body[0], ast.Raise) and "NotImplemented" in ast.dump(body[0])
        return False

    def kept(self, chosen: Collection[int]) -> str:
        """The text with only these statements, by their positions, each on its own lines; other lines are blank."""
        given, lines = self.text.split("\n"), [""] * (self.text.count("\n") + 1)
        for group in self.on_the_same_lines():
            here = [self.statements[i] for i in group if i in chosen]
            if len(here) == len(group):
                rows = slice(here[0].first - 1, here[-1].last)
                lines[rows] = given[rows]
                continue
            for statement in here:
                for row, line in enumerate(statement.text.split("\n"), start=statement.first - 1):
                    lines[row] = f"{lines[row]}; {line}" if lines[row] else line
        return "\n".join(lines)

    def on_the_same_lines(self) -> list[list[int]]:
        """The positions of the statements, those that share lines together."""
        groups: list[list[int]] = []
        for i, statement in enumerate(self.statements):
            if groups and statement.first <= self.statements[i - 1].last:
                groups[-1].append(i)
            else:
                groups.append([i])
        return groups


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


def statements(tree: ast.Module, lines: list[str]) -> Iterator[Statement]:
    """The statements of a cell."""
    encoded = [line.encode() for line in lines]  # columns are bytes
    for node in tree.body:
        if not isinstance(node, ast.Import):
            first, last = first_line(node), node.end_lineno
            rows = encoded[first - 1 : last]
            rows[-1] = rows[-1][: node.end_col_offset]
            rows[0] = rows[0][node.col_offset if first == node.lineno else 0 :]
            yield Statement(node, b"\n".join(rows).decode())
            continue
        for alias in node.names:
            alone = ast.copy_location(ast.Import([alias]), node)
            yield Statement(alone, ast.unparse(alone))


def first_line(node: ast.stmt) -> int:
    """The number of a statement's first line; decorators stand above it."""
    return min([node.lineno, *(decorator.lineno for decorator in getattr(node, "decorator_list", []))])


# CPython's DEF_COMP_ITER, which symtable has no method for: from 3.12 on a comprehension's variables stand in the table
# of what is around it, too.
OF_A_COMPREHENSION = 512
COMPREHENSIONS = ("listcomp", "setcomp", "dictcomp", "genexpr")


def names_of(text: str) -> tuple[set[str], set[str], set[str]]:
    """The names that a text binds at its top, those that it, or a function in it, reads, and those read as it runs.

    >>> names_of("k = max(n for n in k)")[2] == {"k", "max"}, names_of("def k(n):\\n    return k(n - 1)")[2]
    (True, set())
    """
    top = symtable.symtable(text, "cell", "exec")
    own = [s for s in top.get_symbols() if not s._Symbol__flags & OF_A_COMPREHENSION]
    binds = {s.get_name() for s in own if s.is_assigned() or s.is_imported() or s.is_namespace()}
    needs = {s.get_name() for s in own if s.is_referenced()}
    reads = set(needs)
    inner = [(table, True) for table in top.get_children()]
    while inner:
        table, now = inner.pop()
        now = now and (table.get_type() == "class" or table.get_name() in COMPREHENSIONS)
        found = {s.get_name() for s in table.get_symbols() if s.is_global()}
        needs |= found
        reads |= found if now else set()
        inner += [(child, now) for child in table.get_children()]
    return binds, needs, reads


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
