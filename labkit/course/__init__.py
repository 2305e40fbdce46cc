"""What needs a student, an instructor or Jupyter: questions and their checks, grading, release, explorers, plots."""
