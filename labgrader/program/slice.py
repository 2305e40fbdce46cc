"""From a notebook to the program that answers one question: a slice of it, the answer's cell and what that needs.

The check in a notebook, `check FILE` and the grader run the same program, so a tick of one is a tick of the others:

    program(cells, "iou", blanks)    the cell that defines iou, and by names the definitions, imports and constants of
                                     other cells that it needs; not the rest of these cells, and not their drawings

In this order: a cell becomes statements that know which names they bind, change and need (`cell`); from
the answer on, names are followed to the statements that give them their values (`Slice`).

Nothing here runs a student's code. The module needs the standard library alone, so that it can also run in the
grader's sandbox: a stranger's text may break a parser.
"""

import ast
import builtins
import sys
from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from labgrader.program.cell import Cell, Parsed, Statement, imported, parsed

# Names that show something or count progress. They are replaced by functions that do nothing.
QUIET = {
    "tqdm": "lambda things=(), *rest, **options: things",
    "trange": "lambda *bounds, **options: range(*(b for b in bounds if isinstance(b, int)))",
    "display": "lambda *things, **options: None",
    "clear_output": "lambda *things, **options: None",
}
QUIET_MODULES = ("tqdm", "IPython")
SILENT, OF_THE_KIT = "quiet", ", the kit's"  # pieces of a program that no student wrote: a label, and how one ends
NO_CELL = "no cell defines"  # begins the refusal of a notebook without the answer
WINDOWS = {"tkinter", "turtle"}  # of the standard library, and not there without a screen: editors import them unasked


@dataclass(frozen=True)
class Program:
    """What to run, in order, in one namespace, before the answer is called.

    pieces: (name, text) of each cell that is needed; lines that are not needed are blank, so that numbers of lines are
    those of the cell. calls: other blanks that the answer calls, directly or not. refused: why the answer cannot be
    graded, in words for its student; "" if it can. name: of the function that is called, "" for the question's. late:
    the program with the last definitions in the notebook, where cells below define names of it anew: it counts if this
    one is wrong, since it is what a kernel has in the end. copies: which code cells, counted from 1, have the answer's
    grade id and differ: a cell was copied to try again, or split; the last of them is the answer.
    """

    pieces: tuple[tuple[str, str], ...] = ()
    calls: tuple[str, ...] = ()
    refused: str = ""
    name: str = ""
    late: "Program | None" = None
    copies: tuple[int, ...] = ()

    @property
    def note(self) -> str:
        """What to tell of an answer with several cells, "" if it has one.

        >>> Program(copies=(4, 6)).note
        'code cells 4 and 6 both define it, and the lower one counts, as in a run from top to bottom'
        """
        *first, last = map(str, self.copies or ("",))
        which = "both define it, and the lower one" if len(first) == 1 else "all define it, and the lowest one"
        return (
            f"code cells {', '.join(first)} and {last} {which} counts, as in a run from top to bottom" if first else ""
        )


class Refused(Exception):
    """An answer that cannot be graded; the text says why."""


def program(
    cells: Sequence[Cell],
    name: str,
    blanks: Collection[str] = (),
    packages: Collection[str] = ("numpy",),
    forbidden: Collection[str] = (),
    kit: Collection[str] = (),
    given: Mapping[str, str] | None = None,
    latest: bool = False,
) -> Program:
    """Cut out of a notebook's code cells the program that defines the function `name`.

    cells: all code cells, in the notebook's order, or in the order in which they were run if `latest` is set: then the
    last definition of a name counts, otherwise the nearest one above, and only without that the first one below; with
    others below there is a second program, `late`.
    blanks: functions that the lab asks for. packages: those that there are where answers are graded, beside the
    standard library; forbidden: those that this task does not allow; kit: the course's own, for notebooks alone. given:
    for blanks that the student has wrong, the source that takes their place.

    >>> cells = [Cell("import numpy as np\\nimport matplotlib.pyplot as plt"), Cell("half = 0.5\\nplt.plot([half])")]
    >>> program([*cells, Cell("def f(x):\\n    return half * np.abs(x)")], "f").pieces
    (('cell 1', 'import numpy as np\\n'), ('cell 2', 'half = 0.5\\n'), ('f', 'def f(x):\\n    return half * np.abs(x)'))
    """
    without = {module.partition(".")[0] for module in forbidden}
    modules = {*packages, *sys.stdlib_module_names} - WINDOWS - without
    asked = (list(map(parsed, cells)), name, blanks, given or {}, modules, without, kit, latest)
    first = Slice(*asked)
    made = first.program()
    late = Slice(*asked, last_definitions=True).program() if first.meets_others_below else made
    if late.refused or same_text(late, made):
        return made
    return replace(made, calls=tuple(dict.fromkeys((*made.calls, *late.calls))), late=late)


def is_students(label: str) -> bool:
    """Whether a piece of a program is the student's own."""
    return label != SILENT and not label.endswith(OF_THE_KIT)


def same_text(a: Program, b: Program) -> bool:
    """Whether two programs hold the same lines, in whichever cells."""
    return sorted(text.strip() for _, text in a.pieces) == sorted(text.strip() for _, text in b.pieces)


# -------------------------------------------------------------------------------------------------- several cells


@dataclass
class Slice:
    """The slice of a notebook for one answer: the statements that give values to the names that it needs.

    cells: in the order of the notebook, or in that in which they were run if `latest` is set. name: of the answer.
    blanks, given, kit: as in `program`. modules: those that there are where answers are graded, forbidden: those that
    there are, but not for this task. last_definitions: those of other names
    count, wherever they stand; meets_others_below:
    whether it would be another one then.
    """

    cells: list[Parsed]
    name: str
    blanks: Collection[str]
    given: Mapping[str, str]
    modules: Collection[str]
    forbidden: Collection[str]
    kit: Collection[str]
    latest: bool
    last_definitions: bool = False

    def __post_init__(self):
        self.chosen: dict[int, set[int]] = {}  # positions of statements, by cell
        self.calls: dict[str, None] = {}  # other blanks, in the order in which they are met
        self.quiet: dict[str, None] = {}  # names of QUIET that no cell gives a value
        self.copies: tuple[int, ...] = ()
        self.meets_others_below = False

    def program(self) -> Program:
        """The slice as texts to run, or why the answer cannot be graded."""
        try:
            self.home = self.home_of_answer()
            self.follow()
        except Refused as reason:
            return Program(refused=str(reason))
        pieces = [(SILENT, "\n".join(f"{name} = {QUIET[name]}" for name in self.quiet))] if self.quiet else []
        pieces += [(f"{blank}{OF_THE_KIT}", self.given[blank]) for blank in self.calls if blank in self.given]
        for where in sorted(self.chosen):
            label = self.name if where == self.home else f"cell {where + 1}"
            pieces.append((label, hushed(self.cells[where].kept(self.chosen[where]))))
        return Program(tuple(pieces), tuple(self.calls), copies=self.copies)

    def follow(self) -> None:
        """Follow names from the answer to the statements that give them values, and to what these need, and so on."""
        # A name, the cell that needs it, whether as it was before that cell, and how it came there.
        waiting = deque([(self.name, self.home, False, (self.name,))])
        seen = {(self.name, self.home, False)}
        while waiting:
            wanted, asking, before, way = waiting.popleft()
            for where, position in self.choose(wanted, asking, before):
                statement = self.cells[where].statements[position]
                self.allow(statement, way)
                for other in sorted(statement.needs):
                    for key in ((other, where, False), (other, where, True)):
                        if key not in seen and (not key[2] or self.cells[where].is_earlier(other, position)):
                            seen.add(key)
                            waiting.append((*key, (*way, other)))

    def choose(self, wanted: str, asking: int, before: bool) -> Iterator[tuple[int, int]]:
        """Take in the statements that a name needs which a cell reads: those that are new in the slice, by cell.

        before: whether the value is the one that the name has before that cell, which gives it another.
        """
        if wanted in self.blanks and wanted != self.name:
            self.calls[wanted] = None
            if wanted in self.given:
                return
        at = self.home if wanted == self.name and not before else self.place(wanted, asking, before)
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
                    yield where, i

    def home_of_answer(self) -> int:
        """The cell that holds the answer: of several with its grade id the last; raises Refused if there is none."""
        name, cells = self.name, self.cells
        marked = [i for i, cell in enumerate(cells) if cell.grade_id == name]
        binding = [i for i in marked if name in cells[i].binds]
        answered = [i for i in binding if not cells[i].is_blank(name)]
        copies = list(answered)
        while copies and cells[copies[-1]].changes(name):  # the half of a split cell that wraps the other one
            copies.pop()
        if len({cells[i].dump for i in copies}) > 1:
            self.copies = tuple(i + 1 for i in copies)
        elsewhere = [i for i, cell in enumerate(cells) if i not in marked and cell.defines(name)]
        if self.latest and elsewhere:
            if not answered or answered[-1] > elsewhere[-1]:
                return max([elsewhere[-1], *answered])
            if cells[elsewhere[-1]].dump != cells[answered[-1]].dump:
                raise Refused(f"the cell of its task holds another {name}, which would be graded: put yours there")
        elsewhere = [i for i in elsewhere if not cells[i].is_blank(name)]
        if found := answered or elsewhere or binding:
            return found[-1]
        raise Refused(next((cells[i].problem for i in marked if cells[i].problem), f"{NO_CELL} {name}"))

    def place(self, wanted: str, asking: int, before: bool) -> int | None:
        """The cell that gives a name its value for a cell that needs it; None if that is Python's own, or nobody's."""
        binding = [i for i, cell in enumerate(self.cells) if wanted in cell.binds]
        if wanted in self.blanks:
            marked = [i for i in binding if self.cells[i].grade_id == wanted]
            binding = marked or [i for i in binding if self.cells[i].defines(wanted)]
        if before and (earlier := [i for i in binding if i < asking]):
            return earlier[-1]
        if asking in binding:
            return asking
        if self.latest and binding:
            return binding[-1]
        if above := [i for i in binding if i < asking]:
            self.meets_others_below |= binding[-1] > asking
            return binding[-1] if self.last_definitions else above[-1]
        if hasattr(builtins, wanted):
            return None
        if below := [i for i in binding if i > asking]:
            self.meets_others_below |= len(below) > 1
            return below[-1 if self.last_definitions else 0]
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
            if module in self.kit:
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
