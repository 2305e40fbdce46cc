"""The questions of the labs: one definition serves the student's check, the instructor's grade and the project's tests.

`labkit.course.checker.question` says what a question is. Each question is a module in its folder,
`t04_iou/iou.py` for
04_iou.iou: the reference, how its inputs are drawn, its cases by hand, and wrong answers with the hints that they earn.
What several questions of a topic share stands in the folder's `__init__`. They are imported when they are asked for.
"""

import importlib
import pkgutil

from labkit.course.checker.question import Question

TOPICS = tuple(sorted(module.name.removeprefix("t") for module in pkgutil.iter_modules(__path__)))  # "01_labels", ...


def of_topic(topic: str) -> dict[str, Question]:
    """Give the questions of a topic by their functions' names: of each module in the topic's folder its QUESTION.

    Raises ValueError for a topic that there is not.
    """
    if topic not in TOPICS:
        raise ValueError(f"topic: expected one of {', '.join(TOPICS)}, got {topic!r}")
    folder = importlib.import_module(f"labkit.course.topics.t{topic}")
    names = [module.name for module in pkgutil.iter_modules(folder.__path__)]
    return {name: importlib.import_module(f"{folder.__name__}.{name}").QUESTION for name in names}


def find(name: str) -> Question:
    """Find a question by its name, such as "04_iou.iou"; raises ValueError, and lists the names that there are."""
    topic, _, function = name.partition(".")
    questions = of_topic(topic)
    if function not in questions:
        raise ValueError(f"name: expected one of {', '.join(q.name for q in questions.values())}, got {name!r}")
    return questions[function]
