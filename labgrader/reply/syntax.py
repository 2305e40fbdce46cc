"""Places in a syntax tree, and what can be put there: a node as it is, one with other fields, or a text around it."""

import ast
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial

from labgrader.reply.finding import Span

SHORT = 6  # nodes of an expression that counts as short


@dataclass(frozen=True)
class Place:
    """A node of a syntax tree, or a list of statements (index None), in its parent."""

    parent: ast.AST
    field: str
    index: int | None = None

    @property
    def node(self):
        """What stands there."""
        value = getattr(self.parent, self.field)
        return value if self.index is None else value[self.index]

    def put(self, node) -> None:
        """Put another node there."""
        if self.index is None:
            setattr(self.parent, self.field, node)
        else:
            getattr(self.parent, self.field)[self.index] = node


def expressions(root: ast.AST) -> Iterator[Place]:
    """The places of all expressions that are read, in the order of the text; not annotations and defaults."""
    for field, value in ast.iter_fields(root):
        if field in ("annotation", "returns", "decorator_list", "args") and not isinstance(root, ast.Call):
            continue
        if isinstance(root, ast.Raise | ast.JoinedStr | ast.Import | ast.ImportFrom | ast.Assert):
            return
        for index, child in enumerate(value) if isinstance(value, list) else ((None, value),):
            if not isinstance(child, ast.AST):
                continue
            called = isinstance(root, ast.Call) and field == "func"
            is_read = isinstance(child, ast.expr) and isinstance(getattr(child, "ctx", ast.Load()), ast.Load)
            if is_read and not called:
                yield Place(root, field, index)
            yield from expressions(child)


def node_count(node: ast.AST) -> int:
    """The number of nodes of an expression, without contexts and operators."""
    return sum(isinstance(part, ast.expr | ast.keyword) for part in ast.walk(node))


def between(left: ast.expr, right: ast.expr) -> Span:
    """The place between two operands, where the operator stands."""
    return Span(left.end_lineno, left.end_col_offset, right.lineno, right.col_offset)


def span_of(node: ast.AST | Span) -> Span:
    """Where a node stands."""
    if isinstance(node, Span):
        return node
    return Span(node.lineno, node.col_offset, node.end_lineno, node.end_col_offset)


def the(node) -> Callable:
    """Give a node, or a list of statements, as it is."""
    return lambda: node


def changed(node: ast.AST, **fields) -> ast.AST:
    """A copy of a node with other fields, at its place in the text."""
    return ast.fix_missing_locations(ast.copy_location(type(node)(**dict(ast.iter_fields(node)) | fields), node))


def template(text: str, node: ast.AST) -> Callable:
    """Make an expression of a text, with a node in the place of `_`."""
    return partial(filled, parsed(text), node)


parsed = cache(lambda text: ast.parse(text, mode="eval").body)


def filled(part, node: ast.AST):
    """Copy a part of a template; what is new has the node's place in the text."""
    if isinstance(part, list):
        return [filled(each, node) for each in part]
    if not isinstance(part, ast.AST):
        return part
    if isinstance(part, ast.Name) and part.id == "_":
        return node
    new = type(part)(**{field: filled(value, node) for field, value in ast.iter_fields(part)})
    return ast.copy_location(new, node)


def without(items: list, i: int) -> list:
    """A list without one of its entries."""
    return items[:i] + items[i + 1 :]


def exchanged(items: list, i: int, j: int) -> list:
    """A list with two of its entries exchanged."""
    new = list(items)
    new[i], new[j] = new[j], new[i]
    return new
