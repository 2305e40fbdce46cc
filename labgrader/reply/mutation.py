"""Mutations of a program: each changes one place, as a student would who has found the mistake (used by `repair`).

    for mutation in mutations(function): with mutation.applied(): compile it

A mutation is a recipe (`recipes`), and the places where it is applied: one, each occurrence of the same expression, or
the same spot in parallel lines. The modules need the standard library alone.
"""

import ast
import contextlib
import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from labgrader.reply.finding import Span
from labgrader.reply.recipes import OPERATORS, Recipe, Scope, recipes_for
from labgrader.reply.syntax import SHORT, Place, changed, exchanged, expressions, node_count, span_of, template, the

LONGEST_GROUP = 6  # places that one recipe is applied to together


@dataclass(frozen=True)
class Mutation:
    """A recipe at one place, or at several that count as one."""

    kind: str
    cost: float
    places: tuple[Place, ...]
    makes: tuple[Callable, ...]
    spans: tuple[Span, ...]

    @contextlib.contextmanager
    def applied(self) -> Iterator[None]:
        """The tree is changed inside of the block."""
        before = [place.node for place in self.places]
        for place, make in zip(self.places, self.makes, strict=True):
            place.put(make())
        try:
            yield
        finally:
            for place, node in zip(self.places, before, strict=True):
                place.put(node)


def mutations(function: ast.stmt) -> list[Mutation]:
    """All mutations of a function, those that change least first; equal ones in the order of the text."""
    scope = Scope(function)
    found = [*of_expressions(function, scope), *of_statements(function)]
    return sorted(found, key=lambda mutation: mutation.cost)  # stable


# ------------------------------------------------------------------------------------------------- expressions


def of_expressions(function: ast.stmt, scope: Scope) -> Iterator[Mutation]:
    """Recipes at single places, at each occurrence of an expression, and in parallel lines."""
    places = list(expressions(function))
    recipes = {place: {(r.kind, r.key): r for r in recipes_for(place, scope)} for place in places}
    for node, name in kept_in(function):  # a list that holds itself fills the memory when it becomes an array
        for place in (place for place in places if place.node is node):
            made = recipes[place].items()
            recipes[place] = {key: recipe for key, recipe in made if getattr(recipe.make(), "id", "") != name}
    for place in places:
        for recipe in recipes[place].values():
            yield mutation_at([place], [recipe])
    seen = set()
    lines = [list(expressions(line)) for line in simple_statements(function)]
    equal = (group for inside in (places, *lines) for group in equal_places(inside))
    for group in (*equal, *parallel_places(function)):
        identity = tuple(id(place.node) for place in group)
        if identity in seen or any(place not in recipes for place in group):
            continue
        seen.add(identity)
        for key in recipes[group[0]]:
            if all(key in recipes[place] for place in group):
                yield mutation_at(group, [recipes[place][key] for place in group])
    yield from exchanged_names(function, scope, places)
    for inside in lines:
        yield from exchanged_parts(inside)


def kept_in(function: ast.stmt) -> Iterator[tuple[ast.expr, str]]:
    """What is put into a list as it is, or as an entry of a tuple, with the list's name."""
    for node in ast.walk(function):
        if isinstance(node, ast.Call) and getattr(node.func, "attr", "") in ("append", "insert"):
            held = list(node.args)
            while held:
                part = held.pop()
                held += part.elts if isinstance(part, ast.Tuple | ast.List) else []
                yield part, ast.unparse(node.func.value)


def mutation_at(places: Sequence[Place], recipes: Sequence[Recipe]) -> Mutation:
    """A mutation of some recipes at their places."""
    marks = [mark for p, recipe in zip(places, recipes, strict=True) for mark in recipe.mark or (p.node,)]
    cost = recipes[0].cost + (0.5 if len(places) > 1 else 0.0)
    makes = tuple(recipe.make for recipe in recipes)
    return Mutation(recipes[0].kind, cost, tuple(places), makes, tuple(map(span_of, marks)))


def equal_places(places: Sequence[Place]) -> Iterator[list[Place]]:
    """Places of the same expression, where there are several."""
    same: dict[str, list[Place]] = {}
    for place in places:
        same.setdefault(ast.dump(place.node), []).append(place)
    yield from (group for group in same.values() if 1 < len(group) <= LONGEST_GROUP)


def parallel_places(function: ast.stmt) -> Iterator[list[Place]]:
    """The same spot of statements, or of entries of a tuple or call, that are alike but for names and numbers."""
    for node in ast.walk(function):
        for field in ("body", "orelse", "elts", "args"):
            children = getattr(node, field, None)
            if not isinstance(children, list) or len(children) < 2:
                continue
            alike = itertools.groupby(enumerate(children), key=lambda entry: skeleton(entry[1]))
            for _, group in alike:
                members = list(group)
                if 1 < len(members) <= LONGEST_GROUP:
                    inside = [list(expressions(child)) for _, child in members]
                    if isinstance(members[0][1], ast.expr):
                        inside = [[Place(node, field, i), *rest] for (i, _), rest in zip(members, inside, strict=True)]
                    yield from (list(group) for group in zip(*inside, strict=True))


def skeleton(node: ast.AST) -> str:
    """A node's form without its names and numbers; one of its own for what has none to compare."""
    if isinstance(node, ast.Name | ast.Constant):
        return f"{type(node).__name__} at {id(node)}"
    parts = []
    for part in ast.walk(node):
        parts.append(type(part).__name__)
        if isinstance(part, ast.Attribute):
            parts.append(part.attr)
    return " ".join(parts)


def exchanged_names(function: ast.stmt, scope: Scope, places: Sequence[Place]) -> Iterator[Mutation]:
    """Two names exchanged wherever they are read, in one statement or in the whole function."""
    for where in (function, *simple_statements(function)):
        read = list(places) if where is function else list(expressions(where))
        named = [place for place in read if isinstance(place.node, ast.Name) and place.node.id in scope.names]
        for a, b in itertools.combinations(dict.fromkeys(place.node.id for place in named), 2):
            both = [place for place in named if place.node.id in (a, b)]
            other = {a: b, b: a}
            makes = tuple(template(other[place.node.id], place.node) for place in both)
            spans = tuple(span_of(place.node) for place in both)
            if len(both) <= LONGEST_GROUP:
                yield Mutation("names exchanged", 2.0, tuple(both), makes, spans)


def exchanged_parts(places: Sequence[Place]) -> Iterator[Mutation]:
    """Two short parts of a statement exchanged, such as k // 2 and k % 2."""
    kinds = ast.BinOp | ast.Subscript | ast.Call
    short = [p for p in places if isinstance(p.node, kinds) and node_count(p.node) <= SHORT]
    for a, b in itertools.combinations(short, 2):
        apart = span_of(a.node).last_line < b.node.lineno or a.node.end_col_offset <= b.node.col_offset
        if apart and type(a.node) is type(b.node) and ast.dump(a.node) != ast.dump(b.node):
            spans = span_of(a.node), span_of(b.node)
            yield Mutation("order", 2.0, (a, b), (the(b.node), the(a.node)), spans)


def simple_statements(function: ast.stmt) -> list[ast.stmt]:
    """The statements without a block of their own."""
    return [node for node in ast.walk(function) if isinstance(node, ast.stmt) and not hasattr(node, "body")]


# --------------------------------------------------------------------------------------------------- statements


def of_statements(function: ast.stmt) -> Iterator[Mutation]:
    """A line left out, two lines exchanged, one moved into or out of a block, another assignment."""
    for node in ast.walk(function):
        for field in ("body", "orelse"):
            block = getattr(node, field, None)
            if isinstance(block, list) and block and isinstance(block[0], ast.stmt):
                yield from of_block(Place(node, field))
        if isinstance(node, ast.AugAssign):
            yield from augmented(node)
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Tuple):
            yield from targets_exchanged(node.targets[0])


def of_block(place: Place) -> Iterator[Mutation]:
    """Mutations of a list of statements."""
    block = place.node

    def mutation(kind: str, cost: float, new: list[ast.stmt], *marked: ast.stmt) -> Mutation:
        return Mutation(kind, cost, (place,), (the(new),), tuple(map(first_line, marked)))

    for i, statement in enumerate(block):
        above, below = block[:i], block[i + 1 :]
        if len(block) > 1 and not is_docstring(statement):
            yield mutation("line too many", 1, above + below, statement)
        if isinstance(statement, ast.If) and not statement.orelse:
            yield mutation("always", 1, [*above, *statement.body, *below], statement)
        if isinstance(statement, ast.If) and statement.orelse:
            yield mutation("branch", 1, [*above, *statement.orelse, *below], statement)
            yield mutation("branch", 1, [*above, *statement.body, *below], statement.orelse[0])
        if isinstance(statement, ast.Break | ast.Continue):
            other = ast.Continue() if isinstance(statement, ast.Break) else ast.Break()
            yield mutation("loop", 1, [*above, ast.copy_location(other, statement), *below], statement)
        if below:
            yield mutation("lines exchanged", 2, exchanged(block, i, i + 1), statement, below[0])
        inner = getattr(statement, "body", None)
        if not isinstance(inner, list) or isinstance(statement, ast.FunctionDef | ast.ClassDef):
            continue
        if len(inner) > 1:
            yield mutation("moved", 2, [*above, changed(statement, body=inner[:-1]), inner[-1], *below], inner[-1])
            yield mutation("moved", 2, [*above, inner[0], changed(statement, body=inner[1:]), *below], inner[0])
        if below:
            yield mutation("moved", 2, [*above, changed(statement, body=[*inner, below[0]]), *below[1:]], below[0])
        if above:
            yield mutation("moved", 2, [*above[:-1], changed(statement, body=[above[-1], *inner]), *below], above[-1])


def is_docstring(statement: ast.stmt) -> bool:
    """Whether a statement is a text alone."""
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def first_line(statement: ast.stmt) -> Span:
    """The part of a statement's first line that belongs to it: up to the block that it opens."""
    body = getattr(statement, "body", None)
    if not isinstance(body, list):
        return span_of(statement)
    ends = [n for n in ast.iter_child_nodes(statement) if isinstance(n, ast.expr)]
    last = max(ends, key=lambda n: (n.end_lineno, n.end_col_offset), default=None)
    if last is None:
        return Span(statement.lineno, statement.col_offset, statement.lineno, statement.col_offset + 4)
    return Span(statement.lineno, statement.col_offset, last.end_lineno, last.end_col_offset)


def targets_exchanged(targets: ast.Tuple) -> Iterator[Mutation]:
    """`W, H = y.shape` for `H, W = y.shape`."""
    place = Place(targets, "elts")
    for i, j in itertools.combinations(range(len(targets.elts)), 2):
        spans = span_of(targets.elts[i]), span_of(targets.elts[j])
        yield Mutation("order", 1, (place,), (the(exchanged(targets.elts, i, j)),), spans)


def augmented(node: ast.AugAssign) -> Iterator[Mutation]:
    """Another operator of `+=`; `|=` for `&=`."""
    for op in OPERATORS.get(type(node.op), ()):
        if not isinstance(node.op, op):
            yield Mutation("operator", 1, (Place(node, "op"),), (the(op()),), (span_of(node),))
