"""What a program tries that no answer needs: processes, sockets, frames, the grader's own memory, files of the machine.

The sandbox stops it, whether it is seen here or not; this is for the instructor's table, where an attempt would else
look like a mistake. It reads the program and runs nothing, so what is disguised well enough is not seen.
"""

import ast
from collections.abc import Iterator

MOST_SHOWN = 4
ANY = ("subprocess", "socket", "ctypes", "pty", "resource", "gc", "atexit", "sqlite3", "multiprocessing", "mmap")
OF_MODULES = {
    "os": "system popen fork forkpty kill killpg _exit abort execv execve execl execvp posix_spawn spawnv setuid "
    "seteuid setgid setegid setpriority sched_setaffinity unshare getppid walk scandir listdir open write pipe "
    "dup2 closerange remove unlink rmdir removedirs rename replace truncate mkdir makedirs symlink link chmod chown "
    "environ putenv memfd_create posix_fadvise preadv",
    "sys": "_getframe _current_frames modules meta_path path settrace setprofile addaudithook",
    "signal": "signal alarm setitimer pthread_kill raise_signal",
    "shutil": "rmtree move copyfile copytree",
    "inspect": "currentframe stack getouterframes",
    "threading": "Thread",
    "builtins": "isinstance issubclass len sum open print eval exec",
}
DOTTED = {f"{module}.{name}" for module, names in OF_MODULES.items() for name in names.split()}
INNER = (
    *("__subclasses__", "__globals__", "__builtins__", "__code__", "__closure__", "__bases__", "__mro__", "__loader__"),
    *("__reduce__", "__reduce_ex__", "__array_ufunc__", "__array_function__", "f_back", "f_globals", "f_locals"),
    *("f_builtins", "tb_frame", "gi_frame", "cr_frame"),
)
PLACES = ("/proc", "/etc/", "/dev/", "gradebook.db", "secret_seed", "site-packages", "/tmp/")
PATCHED = ("np", "numpy", "builtins")  # a name in these is given another value


def attempts(tree: ast.AST) -> list[str]:
    """What a program tries, with the line of each: ["os.system (line 3)"]; [] for an answer as it should be.

    >>> attempts(ast.parse("import os\\ndef f(x):\\n    os.system('ls')\\n    return x"))
    ['os.system (line 3)']
    """
    found: dict[str, int] = {}
    for node in ast.walk(tree):
        for what in tried(node):
            found[what] = min(node.lineno, found.get(what, node.lineno))
    ordered = sorted(found.items(), key=lambda item: item[1])
    shown = [f"{what} (line {line})" for what, line in ordered[:MOST_SHOWN]]
    return [*shown, *(["..."] if len(ordered) > MOST_SHOWN else [])]


def tried(node: ast.AST) -> Iterator[str]:
    """What one node of a syntax tree tries."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names if alias.name.partition(".")[0] in ANY)
    elif isinstance(node, ast.ImportFrom) and node.module:
        yield from ({f"{node.module}.{alias.name}" for alias in node.names} & DOTTED)
        yield from [node.module] if node.module.partition(".")[0] in ANY else ()
    elif isinstance(node, ast.Attribute):
        base = node.value.id if isinstance(node.value, ast.Name) else ""
        if f"{base}.{node.attr}" in DOTTED:
            yield f"{base}.{node.attr}"
        elif node.attr in INNER:
            yield node.attr
        elif base in PATCHED and isinstance(node.ctx, ast.Store):
            yield f"another {base}.{node.attr}"
    elif isinstance(node, ast.FunctionDef) and node.name in INNER:
        yield node.name
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        name = node.func.id
        patched = name == "setattr" and node.args and getattr(node.args[0], "id", "") in PATCHED
        yield from [name] if patched or name in ("__import__", "exec", "eval", "compile") else ()
    elif isinstance(node, ast.Constant) and isinstance(node.value, str) and len(node.value) < 200:
        yield from (f"the place {place}" for place in PLACES if place in node.value)
