"""Honest submissions put together from ways in which students write, place and surround a right answer.

`generated(count)` draws them: an answer of the alternatives to each question in turn, with a way to import, to wrap it
and to spread it over cells, and with cells around it that are about something else. All of them work in their student's
notebook, run from top to bottom or with the last cells corrected.
"""

import ast

import grading_course as kit
import numpy as np

from labgrader.course import of_topic, topics
from submissions import Honest, parts_of

IMPORTS = (
    "import numpy as np",
    "import numpy as np, matplotlib.pyplot as plt",
    "import matplotlib.pyplot as plt, numpy as np, sys",
    "import numpy as np; import matplotlib.pyplot as plt",
    "import numpy as np; import matplotlib.pyplot as plt; plt.rcParams['figure.dpi'] = 90",
    "%matplotlib inline\nimport numpy as np\nimport matplotlib.pyplot as plt\nplt.style.use('default')",
    "from pathlib import Path; import numpy as np, labkit, data_gen\nfrom labkit import check",
    "import numpy\nnp = numpy",
    "try:\n    import cupy as np\nexcept ImportError:\n    import numpy as np",
    "from tqdm.auto import tqdm; import numpy as np\nfrom IPython.display import display",
    "import numpy as np  # as always\nimport torch, plotly.express as px",
    "from numpy import *\nimport numpy as np",
)
# What stands below an answer {f} that is called {f}_0 then; "" leaves it as it is.
WRAPPED = (
    "",
    "def {f}(*args):\n    print('called with', *args)\n    return {f}_0(*args)",
    "def {f}(*args):\n    for i in range(300): print(i, end=' ')\n    return {f}_0(*args)",
    "from functools import partial\n{f} = partial({f}_0)",
    "import functools\n\ndef same(g):\n    @functools.wraps(g)\n    def inner(*a): return g(*a)\n    return inner\n\n"
    "@same\ndef {f}(*args):\n    return {f}_0(*args)",
    "class Answer:\n    def __call__(self, *args):\n        return {f}_0(*args)\n\n{f} = Answer()",
    "def {f}(*args, depth=40):\n    return {f}(*args, depth=depth - 1) if depth else {f}_0(*args)",
    "def {f}(*args):\n    try:\n        return {f}_0(*args)\n    finally:\n        pass",
    "def {f}(*args):\n    def work():\n        return {f}_0(*args)\n    return work()",
    "{f} = lambda *args: {f}_0(*args)",
    "def {f}_all(*args):\n    yield {f}_0(*args)\n\ndef {f}(*args): return next({f}_all(*args))",
    "def {f}(*args):\n    args = tuple(a.copy() if hasattr(a, 'copy') else a for a in args); return {f}_0(*args)",
    "import time\n\ndef {f}(*args):\n    begin = time.perf_counter()\n    result = {f}_0(*args)\n"
    "    print(f'{{time.perf_counter() - begin:.3f}} s')\n    return result",
    "import warnings, logging\n\ndef {f}(*args):\n    warnings.warn('slow'); logging.info('')\n    return {f}_0(*args)",
    "import asyncio\n\nasync def {f}_later(*args): return {f}_0(*args)\n\ndef {f}(*args):\n"
    "    return asyncio.run({f}_later(*args))",
    "from concurrent.futures import ThreadPoolExecutor\n\ndef {f}(*args):\n    with ThreadPoolExecutor(2) as pool:\n"
    "        return pool.submit({f}_0, *args).result()",
    "import io, contextlib\n\ndef {f}(*args):\n    with contextlib.redirect_stdout(io.StringIO()) as said:\n"
    "        return {f}_0(*args)",
    "counter = {{'calls': 0}}\n\ndef {f}(*args):\n    counter['calls'] += 1\n    return {f}_0(*args)",
    "def {f}(*args: object) -> object:\n    '''Größe: 面積.'''\n    assert args; return {f}_0(*args)  # ✓",
    "import random\n\ndef {f}(*args):\n    random.seed(0); np.random.seed(0)\n    return {f}_0(*args)",
)
# Cells about something else, above or below an answer.
AROUND = (
    "plt.plot([1, 2]); plt.show()",
    "import matplotlib.pyplot as plt, numpy as np\nfig, ax = plt.subplots(); ax.plot([1]); fig.savefig('figure.png')",
    "!ls\n%cd .",
    "%%writefile notes.txt\nimport nothing",
    "%%bash\nls | head",
    "np.save('table.npy', np.eye(3)); table = np.load('table.npy')",
    "with open('notes.txt') as file:\n    notes = file.read()",
    "import os, subprocess; subprocess.run(['ls'])",
    "this is no Python",
    "%timeit np.ones(3).sum()",
    "i = j = k = 0; x = y = z = None; total = 3; result = []",
    "from tqdm import tqdm\nfor i in tqdm(range(3)): pass",
    "frames = [np.zeros((4, 4)) for _ in range(3)]; show = print\nshow(len(frames))",
    "import numpy as np, labkit\nlabkit.__version__ if hasattr(labkit, '__version__') else None",
    "help(np.sum)\n?np.sum\nnp.ones?",
    "from labkit import check; check",
    "def helper(a):\n    return plt.imshow(a)",
    "class Scene:\n    size = 3\n\nscene = Scene(); scene.size += 1",
)
HELPER = "def {f}_help(args):\n    {line}\n\n\ndef {f}(*args):\n    return {f}_help(args)"
FINE, WRONG, OTHER = "return {f}_0(*args)", "return None", "return plt.plot(args)"


def renamed(source: str, name: str) -> str:
    """A right answer under the name that a wrapper calls it by."""

    class Renamed(ast.NodeTransformer):
        def visit_Name(self, node: ast.Name) -> ast.AST:
            return ast.Name(f"{name}_0" if node.id == name else node.id, node.ctx)

        def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
            node.name = f"{name}_0" if node.name == name else node.name
            return self.generic_visit(node)

    return ast.unparse(Renamed().visit(ast.parse(source)))


def wrapped(rng: np.random.Generator, source: str, name: str) -> list[str]:
    """An answer as the texts of cells, in their order."""
    way = rng.integers(len(WRAPPED) + 4)
    if way < len(WRAPPED):
        text = WRAPPED[way].format(f=name)
        text = f"{renamed(source, name)}\n\n\n{text}" if text else source
        parts = parts_of(text)
        place = rng.integers(4)  # in one cell; what it needs in a cell above; each in a cell of its own; below
        if place == 0 or len(parts) == 1:
            return [text]
        if place == 1 or not parts[-1].startswith("def"):  # a value needs what it is made of at once
            return ["\n\n".join(parts[:-1]), parts[-1]]
        return parts if place == 2 else [parts[-1], "\n\n".join(parts[:-1])]
    base, text = renamed(source, name), HELPER.format(f=name, line=FINE.format(f=name))
    help_, answer = text.split("\n\n\n")
    wrong, other = (help_.replace(FINE.format(f=name), line) for line in (WRONG, OTHER))
    return {
        0: [base, wrong, answer, help_],  # a helper that is corrected below
        1: [base, help_, answer, other],  # one whose name is used again for something else
        2: [base, answer, help_],
        3: [base, wrong, help_, answer],
    }[int(way) - len(WRAPPED)]


def generated(count: int, seed: int = 0) -> list[Honest]:
    """That many submissions, named by their question: "04_iou.iou: 17"; a seed has always the same ones."""
    rng = np.random.default_rng(seed)
    names = [(topic, name) for topic in topics() for name in of_topic(topic)]
    found = []
    for number in range(count):
        topic, name = names[number % len(names)]
        choices = [cell for cell in kit.other_answers(topic)[name] if "torch" not in cell]
        texts = wrapped(rng, choices[rng.integers(len(choices))], name)
        cells = [(text, name if f"def {name}(" in text or f"{name} = " in text else "") for text in texts]
        if rng.random() < 0.2:  # the answer is not in its cell
            cells = [(text, "") for text, _ in cells]
        begin = IMPORTS[rng.integers(len(IMPORTS))]
        for text in rng.choice(AROUND, rng.integers(4), replace=False):
            cells.insert(rng.integers(len(cells) + 1), (str(text), ""))
        if rng.random() < 0.2:  # everything that is needed in one's own cell
            cells = [(f"{begin}\n{text}" if mark and "%" not in begin else text, mark) for text, mark in cells]
        cells = [(begin, "setup"), *cells, (f'{name} = check("{topic}.{name}", {name})', f"check_{name}")]
        found.append(Honest(f"{topic}.{name}: {number}", tuple(cells)))
    return found
