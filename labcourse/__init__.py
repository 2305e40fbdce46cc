"""What notebooks of this course import: its questions, explorers, plots, tables of attempts and of studies."""

import sys
from pathlib import Path

TABLES = Path(__file__).parent / "tables"  # what studies measured, for lessons to read wherever they run
DRIVE = Path("/content/drive")  # where Colab shows a student's Google Drive, once they allow it


def work_folder(name: str) -> Path:
    """A folder for a student's own files: data/ of the course, or of the notebook's folder where there is no course.

    On Google Colab, whose disk is emptied after a session, it is on the student's Drive.
    """
    if "google.colab" in sys.modules:
        from google.colab import drive

        drive.mount(str(DRIVE))
        return DRIVE / "MyDrive" / "labkit" / name
    course = Path("../..") if Path("../../labs").is_dir() else Path()
    return course / "data" / name
