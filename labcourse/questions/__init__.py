"""The questions of the labs: one definition serves the student's check, the instructor's grade and the project's tests.

`labgrader.question` says what a question is. Each question is a module in its folder, `t04_iou/iou.py` for
04_iou.iou: the reference, how its inputs are drawn, its cases by hand, and wrong answers with the hints that they earn.
What several questions of a topic share stands in the folder's `__init__`. `labgrader.course.find` finds one by name.
"""
