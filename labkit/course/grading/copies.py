"""Copies of the kit's own code among answers: found by their structure, whatever their names, comments and layout."""

import ast
import functools
import inspect
from pathlib import Path

import labkit
from labkit.course.questions.question import Question

LEAST_NODES = 45  # of a syntax tree: anybody may write a shorter function just so


def found_in(source: str, question: Question) -> list[str]:
    """Say of which functions of the kit an answer has copies; an empty list if of none, or if it is no Python."""
    wrong = {misconception.answer.__name__ for misconception in question.misconceptions}
    own = shapes_in(inspect.getsource(inspect.getmodule(question.reference)))
    known = known_functions() | {shape: name for shape, name in own.items() if name not in wrong}
    return [f"has a copy of the kit's {known[shape]}" for shape in shapes_in(source) if shape in known]


@functools.cache
def known_functions() -> dict[str, str]:
    """The names of the kit's functions that are long enough to be known by their shape; the course's own left out."""
    root, found = Path(labkit.__file__).parent, {}
    for path in sorted(root.rglob("*.py")):
        if "course" not in path.relative_to(root).parts:
            module = ".".join(path.relative_to(root.parent).with_suffix("").parts)
            found |= {shape: f"{module}.{name}" for shape, name in shapes_in(path.read_text()).items()}
    return found


def shapes_in(source: str) -> dict[str, str]:
    """The shapes of the functions in a source that are long enough, with their names; {} if it is no Python."""
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return {}
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    with_sizes = [(shape_of(node), node.name) for node in functions]
    return {shape: name for (shape, size), name in with_sizes if size >= LEAST_NODES}


def shape_of(function: ast.FunctionDef) -> tuple[str, int]:
    """A function's syntax tree without names of its own, docstring and annotations, and how many nodes it has.

    Names of variables are numbered in the order in which they occur; attributes and called names stay.
    """
    numbers: dict[str, str] = {}
    words = []
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    waiting = [*reversed(body)]
    for argument in (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs):
        numbers.setdefault(argument.arg, f"v{len(numbers)}")
    while waiting:
        node = waiting.pop()
        words.append(type(node).__name__)
        if isinstance(node, ast.Name):
            words.append(numbers.setdefault(node.id, f"v{len(numbers)}"))
        elif isinstance(node, ast.Attribute):
            words.append(node.attr)
        elif isinstance(node, ast.Constant):
            words.append(repr(node.value))
        elif isinstance(node, ast.arg):
            words.append(numbers.setdefault(node.arg, f"v{len(numbers)}"))
            continue
        waiting += reversed([child for child in ast.iter_child_nodes(node) if not isinstance(child, ast.expr_context)])
    return " ".join(words), len(words)
