"""Old addresses: notebooks and nbgrader_config.py of a course that began before 0.3 import `labkit.course`.

Each leads to the module that stands elsewhere now, when it is imported.
"""

import importlib
import importlib.abc
import importlib.machinery
import sys

MOVED = {
    "topics": "labcourse.questions",
    "checking": "labgrader.check",
    "checking_file": "labgrader.file_check",
    "checker": "labgrader.reply",
    "grading": "labgrader.grade",
    "release": "labgrader.release.release",
    "scaffold": "labgrader.release.scaffold",
    **{name: f"labcourse.{name}" for name in ("attempts", "explorers", "kernel", "plots")},
    "grading.refusal": "labgrader.grade.nbgrader_plugins",
    "grading.collect": "labgrader.handin.collect",  # what nbgrader_config.py names
}


class Moved(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds `labkit.course.X` where X stands now."""

    def find_spec(self, name, path=None, target=None):
        """Say where a module of this name is to be found; None if it is no old address."""
        old = name.removeprefix(f"{__name__}.")
        head, _, rest = old.partition(".")
        if not name.startswith(f"{__name__}.") or head not in MOVED:
            return None
        new = MOVED.get(old) or f"{MOVED[head]}.{rest}"
        return importlib.machinery.ModuleSpec(name, self, origin=new, is_package=True)

    def exec_module(self, module):
        """Put the module that stands there now in the place of the one that was asked for."""
        sys.modules[module.__name__] = importlib.import_module(module.__spec__.origin)


__path__: list[str] = []  # a module with modules in it
sys.meta_path.insert(0, Moved())  # before the one that would read such a module from its file a second time
