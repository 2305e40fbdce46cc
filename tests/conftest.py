"""The suite runs with the shape annotations checked: every jaxtyping annotation is a test wherever it is passed.

Two things go without: modules that import numba (the hook wraps every function, and numba cannot compile the
wrapper), and tests marked `bad_input`, in which the functions' own validation must answer.
"""

from pathlib import Path

import jaxtyping
import pytest

ROOT = Path(__file__).parent.parent


def annotated_modules() -> list[str]:
    """Dotted names of the modules of labkit and data_gen that hold no numba kernels."""
    files = [path for package in ("labkit", "data_gen") for path in (ROOT / package).rglob("*.py")]
    pure = [
        path
        for path in files
        if path.stem != "__init__" and "import numba" not in path.read_text().replace("from numba", "import numba")
    ]
    return [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in pure]


jaxtyping.install_import_hook(annotated_modules(), "beartype.beartype")


@pytest.fixture(autouse=True)
def shape_checks_off_for_bad_input(request):
    """Let wrong arguments reach the function in tests marked `bad_input`."""
    marked = request.node.get_closest_marker("bad_input") is not None
    jaxtyping.config.update("jaxtyping_disable", marked)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)
