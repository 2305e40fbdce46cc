"""The kernel that `make lab` starts: IPython's, which leaves a notebook's metadata as they are committed."""

from typing import ClassVar

from ipykernel.ipkernel import IPythonKernel


class Kernel(IPythonKernel):
    """Says that its language is Python, and no version of it.

    JupyterLab writes what a kernel says of its language into each notebook that it opens, and marks the notebook as
    changed if that is new. Committed notebooks name no version, because each machine has another.
    """

    language_info: ClassVar = {"name": "python"}
