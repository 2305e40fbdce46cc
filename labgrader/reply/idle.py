"""What stands idle in a program: an argument that is never read, and a value that is computed and never used.

Beside these, rows that are one and the same list. All are true of the text alone, and say much where nothing else is
known of a wrong answer. The module needs the standard library alone.
"""

import ast
from collections.abc import Sequence

from labgrader.reply.finding import Finding
from labgrader.reply.syntax import span_of


def idle(pieces: Sequence[tuple[str, str]], name: str) -> list[Finding]:
    """Such parts of the function `name`, arguments first.

    >>> text = "def f(a, b):\\n    c = a + 1\\n    return a"
    >>> [(finding.kind, finding.spans[0].line) for finding in idle([("f", text)], "f")]
    [('unread', 1), ('unused', 2)]
    """
    for number, (_, text) in reversed(list(enumerate(pieces))):
        for node in ast.parse(text).body:
            if isinstance(node, ast.FunctionDef) and node.name == name:
                return [Finding(kind, number, (span_of(part),)) for kind, part in idle_parts(node)]
    return []


def idle_parts(function: ast.FunctionDef) -> list[tuple[str, ast.AST]]:
    """A name's [[0] * n] * m, arguments that are never read, and names that get a value alone which is never read.

    None where a text is run.
    """
    inside = list(ast.walk(function))
    read = {node.id for node in inside if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
    read |= {node.target.id for node in inside if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name)}
    if read & {"locals", "eval", "exec", "vars"}:
        return []
    arguments = [arg for arg in function.args.args if arg.arg not in read]
    outside = {name for node in inside if isinstance(node, ast.Global | ast.Nonlocal) for name in node.names}
    alone = [node for node in inside if isinstance(node, ast.Assign) and len(node.targets) == 1]
    values = [
        node
        for node in alone
        if isinstance(node.targets[0], ast.Name) and node.targets[0].id not in read | outside and computes(node.value)
    ]
    repeated = [n.value for n in alone if is_repeated(n.value) and is_repeated(n.value.left.elts[0])]
    found = {"aliased": repeated, "unread": arguments, "unused": values}
    return [(kind, node) for kind, nodes in found.items() for node in nodes]


def computes(node: ast.AST) -> bool:
    """Whether an expression is more than a name, a number, a length or a shape, whose line may well be left over."""
    if isinstance(node, ast.Call):
        return getattr(node.func, "id", "") not in ("len", "int", "float") or any(map(computes, node.args))
    if isinstance(node, ast.Attribute | ast.Subscript):
        return computes(node.value)
    return not isinstance(node, ast.Name | ast.Constant)


def is_repeated(node: ast.AST) -> bool:
    """Whether an expression is a list of one entry, many times: [x] * n."""
    repeats = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult) and isinstance(node.left, ast.List)
    return repeats and len(node.left.elts) == 1
