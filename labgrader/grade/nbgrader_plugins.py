"""nbgrader's Autograde refuses: it would run students' code unprotected, and write its scores over the kit's.

`nbgrader_config.py` names `GradedByLabkit`, so that the command and formgrader's button stop before they touch
anything. For a course with another configuration the gradebook names `KERNEL`, which no machine has. It names
`FeedbackPages`, too, which keep rubrics from students.
"""

from pathlib import Path

from nbconvert.exporters import HTMLExporter
from nbgrader.converters.base import NbGraderException, NotebookExporter

from labgrader.course import course
from labgrader.support import keep_closed

GRADE = f"{course().command} grade"
SAYS = f"this course is graded by `{GRADE} LAB`; nbgrader's Autograde changed nothing"
RUBRIC_TAG = "rubric"
KERNEL = {
    "name": f"graded-by-{GRADE.replace(' ', '-')}",
    "display_name": f"graded by {GRADE}",
    "language": "python",
}


class GradedByLabkit(NotebookExporter):
    """What nbgrader's Autograde makes before it begins, and cannot."""

    def __init__(self, **options):
        super().__init__(**options)
        self.log.error(SAYS)
        raise NbGraderException(SAYS)


class FeedbackPages(HTMLExporter):
    """nbgrader's feedback without the rubrics, which copies have for formgrader; nobody else reads their folder."""

    def from_notebook_node(self, nb, resources=None, **how):
        copied = Path((resources or {}).get("metadata", {}).get("path", "")).resolve()
        if copied.parent.parent.name == "autograded":  # its page is written next
            (copied.parents[2] / "feedback").mkdir(exist_ok=True)
            keep_closed(copied.parents[2])
        nb.cells = [cell for cell in nb.cells if RUBRIC_TAG not in cell.metadata.get("tags", ())]
        return super().from_notebook_node(nb, resources, **how)
