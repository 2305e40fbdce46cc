"""Fingerprints of functions: of their syntax trees without what a copier changes first, names, comments and layout.

What has no effect is left out (`effects`): one `pass` would else make another function of a copy.

It needs the standard library alone, so that a stranger's text is parsed in the sandbox.
"""

import ast
import hashlib

from labgrader.program.effects import without_idle

LEAST_NODES = 45  # of a syntax tree: anybody may write a shorter function just so


def fingerprints(source: str) -> dict[str, str]:
    """The fingerprints of the functions in a source that are long enough, with their names; {} if it is no Python."""
    try:
        tree = without_idle(ast.parse(source))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return {}
    found = [(*words_of(node), node.name) for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    return {hashlib.sha256(words.encode()).hexdigest(): name for words, size, name in found if size >= LEAST_NODES}


def words_of(function: ast.FunctionDef) -> tuple[str, int]:
    """A function's syntax tree as words, without docstring and annotations, and how many words that is.

    Variables are numbered in the order in which they occur; attributes and constants stay.

    >>> texts = "def f(x): return x.T @ x", "def g(left):\\n  return left.T @ left"
    >>> a, b = (ast.parse(text).body[0] for text in texts)
    >>> words_of(a) == words_of(b)
    True
    """
    numbers: dict[str, str] = {}
    words: list[str] = []
    arguments = function.args
    for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
        numbers.setdefault(argument.arg, f"v{len(numbers)}")
    waiting = list(reversed(function.body[1:] if ast.get_docstring(function) is not None else function.body))
    while waiting:
        node = waiting.pop()
        words.append(type(node).__name__)
        if isinstance(node, ast.Name | ast.arg):
            name = node.id if isinstance(node, ast.Name) else node.arg
            words.append(numbers.setdefault(name, f"v{len(numbers)}"))
            continue
        if isinstance(node, ast.Attribute):
            words.append(node.attr)
        elif isinstance(node, ast.Constant):
            words.append(repr(node.value))
        waiting += reversed([child for child in ast.iter_child_nodes(node) if not isinstance(child, ast.expr_context)])
    return " ".join(words), len(words)
