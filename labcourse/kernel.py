"""The kernel that `make lab` starts: IPython's, which keeps no memory that it does not use, and no language version."""

import ctypes
import sys
from typing import ClassVar

from ipykernel.ipkernel import IPythonKernel


class Kernel(IPythonKernel):
    """Says that its language is Python, and no version of it; gives freed memory back after each cell.

    JupyterLab writes what a kernel says of its language into each notebook that it opens, and marks the notebook as
    changed if that is new. Committed notebooks name no version, because each machine has another.
    """

    language_info: ClassVar = {"name": "python"}

    async def execute_request(self, stream, ident, parent):
        """Run a cell. The C library keeps what rendering and networks freed, a quarter of a kernel's memory."""
        await super().execute_request(stream, ident, parent)
        if sys.platform == "linux" and hasattr(ctypes.CDLL(None), "malloc_trim"):
            ctypes.CDLL(None).malloc_trim(0)
