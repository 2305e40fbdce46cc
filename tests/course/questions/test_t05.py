"""The references of 05_class_weights are the kit's functions, and agree with descent, integration and PyTorch."""

from labkit.course.questions.question import of_topic

QUESTIONS = of_topic("05_class_weights")
right = {name: question.reference for name, question in QUESTIONS.items()}
