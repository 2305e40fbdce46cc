"""The questions of the labs: one definition serves the student's check, the instructor's grade and the project's tests.

`question` says what a question is; the questions of a topic stand in a module that is named after it, `t04_iou` for
04_iou. They are imported when they are asked for.
"""
