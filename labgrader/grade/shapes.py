"""The shapes of a program: what is left of its expressions when names, layout and the order of lines are taken away.

    out = []                              [half(x[i]) for i in range(n)]
    for i in range(n):
        out.append(half(x[i]))

Both hold the shapes of `half(x[i])`, of what is in it, and of "for i in range(n)". A shape is an expression, or the
head of a loop, in which variables have lost their names; arguments of a function are known by their position,
attributes, keywords, constants, NumPy and what is built into Python by themselves. What is added or multiplied may
stand in any order, and a > b is b < a. Where a value is kept on the way, under which name and in which line, changes no
shape.
"""

import ast
import builtins
import hashlib
from collections.abc import Sequence

LEAST_NODES = 3  # of a shape: anybody writes a shorter one
LONGEST_TEXT = 200  # characters of a shape; longer ones are hashed, else nested ones take the square of a program
MODULES = ("np", "numpy", "scipy", "torch", "math")
SWAPPED = {ast.Gt: ast.Lt, ast.GtE: ast.LtE}
ANY_ORDER = (ast.Add, ast.Mult, ast.BitAnd, ast.BitOr, ast.BitXor, ast.Eq, ast.NotEq)
WORDS = (ast.operator, ast.unaryop, ast.boolop, ast.cmpop)

Shapes = dict[str, list[int]]  # the lines of a program on which each of its shapes begins and ends, by fingerprint


def shapes(tree: ast.Module) -> Shapes:
    """The shapes in a program.

    >>> loop = "out = []\\nfor i in range(n):\\n    out.append(half(x[i] + 1))"
    >>> other = "[half(1 + y[k]) for k in range(m)]"
    >>> len(shapes(ast.parse(loop)).keys() & shapes(ast.parse(other)).keys())
    5
    """
    found: dict[str, tuple[int, set[int]]] = {}
    Reader({}, found).statement(tree)
    return {
        hashlib.sha256(text.encode()).hexdigest()[:16]: sorted(lines)
        for text, (size, lines) in found.items()
        if size >= LEAST_NODES
    }


class Reader:
    """Reads statements and expressions into texts without names.

    arguments: what stands for the arguments around; found: of each text its number of nodes, and its lines.
    """

    def __init__(self, arguments: dict[str, str], found: dict[str, tuple[int, set[int]]]):
        self.arguments, self.found = arguments, found

    def statement(self, node: ast.AST) -> None:
        """Read a statement, or what holds some: each expression of it, and the statements in it."""
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            given = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
            inner = Reader(self.arguments | {one.arg: f"argument{i}" for i, one in enumerate(given)}, self.found)
            for statement in node.body:
                inner.statement(statement)
        elif isinstance(node, ast.For | ast.AsyncFor):
            self.loop(node)
            for statement in (*node.body, *node.orelse):
                self.statement(statement)
        elif isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            value = self.text(node.value)
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                if not isinstance(target, ast.Name):
                    self.keep("set", [self.text(target), value], node)
        elif isinstance(node, ast.AugAssign):
            self.text(ast.copy_location(ast.BinOp(node.target, node.op, node.value), node))
        elif not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):  # which is a docstring
            for child in ast.iter_child_nodes(node):
                (self.text if isinstance(child, ast.expr) else self.statement)(child)

    def loop(self, node: ast.For | ast.AsyncFor | ast.comprehension) -> tuple[str, int]:
        """Read the head of a loop, which is the same in a comprehension."""
        return self.keep("for", [self.text(node.target), self.text(node.iter)], node.iter)

    def keep(self, word: str, parts: Sequence[tuple[str, int]], node: ast.AST) -> tuple[str, int]:
        """Make a shape of a word and the texts of what is in it; kept with the first and last line of its node.

        All lines between them would take the square of a long expression's lines.
        """
        text, size = f"{word}({','.join(text for text, _ in parts)})", 1 + sum(size for _, size in parts)
        if len(text) > LONGEST_TEXT:
            text = hashlib.sha256(text.encode()).hexdigest()
        lines = self.found.setdefault(text, (size, set()))[1]
        lines.update((node.lineno, node.end_lineno) if hasattr(node, "lineno") else ())
        return text, size

    def text(self, node: ast.AST) -> tuple[str, int]:
        """The text of an expression, and its number of nodes; what is in it is kept as well."""
        if isinstance(node, ast.Name):
            is_known = hasattr(builtins, node.id) or node.id in MODULES
            return self.arguments.get(node.id) or (node.id if is_known else "v"), 1
        if isinstance(node, ast.Constant):
            return repr(node.value)[:LONGEST_TEXT], 1
        if isinstance(node, ast.Lambda):
            return self.text(node.body)
        if isinstance(node, ast.Attribute):
            return self.keep(f".{node.attr}", [self.text(node.value)], node)
        if isinstance(node, ast.keyword):
            return self.keep(f"{node.arg}=", [self.text(node.value)], node)
        if isinstance(node, ast.comprehension):
            for test in node.ifs:
                self.text(test)
            return self.loop(node)
        children = list(ast.iter_child_nodes(node))
        words = [type(child) for child in children if isinstance(child, WORDS)]
        kinds = ast.expr | ast.keyword | ast.comprehension
        parts = [self.text(child) for child in children if isinstance(child, kinds)]
        if len(parts) == 2 and words and words[0] in SWAPPED:
            words, parts = [SWAPPED[words[0]]], parts[::-1]
        if words and issubclass(words[0], ANY_ORDER):
            parts.sort()
        kind = "each" if isinstance(node, ast.ListComp | ast.GeneratorExp) else type(node).__name__
        return self.keep(" ".join([kind, *(word.__name__ for word in words)]), parts, node)
