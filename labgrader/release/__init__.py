"""Labs from solutions, where they are published, and what students get.

release     labs from solutions
bundle      what students get, as one zip
publishing  where a course is published, and its notebooks there
scaffold    a new question, or a new lab, begun
"""
