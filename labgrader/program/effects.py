"""A function without what has no effect: what a copier adds so that a copy looks different.

Taken out are `pass`, `...`, texts and values that nobody keeps, what is printed, values, imports and functions under
names that nobody reads, `x = x`, `assert True`, branches that a constant decides, empty loops and branches, and what
stands behind `return`. It is a heuristic: there are endless ways to write what does nothing.

It needs the standard library alone, so that a stranger's text is parsed in the sandbox.
"""

import ast

ENDS = (ast.Return, ast.Raise, ast.Break, ast.Continue)  # nothing behind them runs
MOST_ROUNDS = 8  # what is read by nothing but what is taken out goes in the next one
MODULES = ("np", "numpy", "math", "scipy", "torch")
# What of these modules changes something.
WRITES = ("copyto", "put", "place", "putmask", "put_along_axis", "fill_diagonal", "seterr", "save", "shuffle")
QUIET = frozenset(("print", "len", "abs", "sum", "min", "max", "int", "float", "str", "bool", "type", "repr", "id"))


def without_idle(tree: ast.Module) -> ast.Module:
    """The tree without what has no effect, as far as it is seen; the tree itself is changed.

    >>> tree = ast.parse("def f(x):\\n    y = 2\\n    z = y\\n    print(x)\\n    return x + 1")
    >>> ast.unparse(without_idle(tree))
    'def f(x):\\n    return x + 1'
    """
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            any(not tidied(node) for _ in range(MOST_ROUNDS))
        elif isinstance(node, ast.mod | ast.stmt | ast.ExceptHandler):
            waiting += ast.iter_child_nodes(node)
    return tree


def tidied(function: ast.FunctionDef) -> bool:
    """Take out of a function what has no effect; whether there was something."""
    nodes = list(ast.walk(function))
    read = {node.id for node in nodes if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Store)}
    read |= {name for node in nodes if isinstance(node, ast.Global | ast.Nonlocal) for name in node.names}
    before = len(nodes)
    function.body = kept(function.body, read)
    return sum(1 for _ in ast.walk(function)) < before


def kept(statements: list[ast.stmt], read: set[str]) -> list[ast.stmt]:
    """The statements of a block that have an effect; read: names whose value somebody reads."""
    found: list[ast.stmt] = []
    for statement in statements:
        for one in decided(statement):
            for block in ("body", "orelse", "finalbody"):
                if isinstance(getattr(one, block, None), list):
                    setattr(one, block, kept(getattr(one, block), read))
            if not is_idle(one, read):
                found.append(one)
        if found and isinstance(found[-1], ENDS):
            break
    return found


def decided(statement: ast.stmt) -> list[ast.stmt]:
    """A statement; of a branch that a constant decides what runs of it."""
    if isinstance(statement, ast.If) and isinstance(statement.test, ast.Constant):
        return statement.body if statement.test.value else statement.orelse
    if isinstance(statement, ast.While) and isinstance(statement.test, ast.Constant) and not statement.test.value:
        return statement.orelse
    return [statement]


def is_idle(statement: ast.stmt, read: set[str]) -> bool:
    """Whether a statement does nothing that anybody sees."""
    match statement:
        case ast.Pass():
            return True
        case ast.Expr(value):
            return has_no_effect(value)
        case ast.Assign(targets=[ast.Name(id=name)], value=ast.Name(id=other)) if name == other:
            return True
        case ast.Assign(targets=targets):
            return all(isinstance(target, ast.Name) and target.id not in read for target in targets)
        case ast.AnnAssign(target=ast.Name(id=name), value=value):
            return value is None or name not in read
        case ast.AugAssign(target=ast.Name(id=name)):
            return name not in read
        case ast.Import(names) | ast.ImportFrom(names=names):
            return all((alias.asname or alias.name.partition(".")[0]) not in read for alias in names)
        case ast.FunctionDef(name=name):
            return name not in read
        case ast.Assert(test=ast.Constant(value=value)):
            return bool(value)
        case ast.If(test=test, body=[], orelse=[]) | ast.While(test=test, body=[], orelse=[]):
            return has_no_effect(test)
        case ast.For(iter=values, body=[], orelse=[]):
            return has_no_effect(values)
    return False


def has_no_effect(value: ast.expr) -> bool:
    """Whether to compute a value changes nothing, as far as its calls are known."""
    for node in ast.walk(value):
        if isinstance(node, ast.NamedExpr | ast.Await | ast.Yield | ast.YieldFrom):
            return False
        if isinstance(node, ast.Call):
            match node.func:
                case ast.Name(id=name) if name in QUIET or name in ("range", "enumerate", "zip", "list", "tuple"):
                    continue
                case ast.Attribute(value=ast.Name(id=module), attr=name) if module in MODULES and name not in WRITES:
                    if not any(keyword.arg == "out" for keyword in node.keywords):
                        continue
            return False
    return True
