"""The references of 03_gradient are the kit's functions, and agree with SciPy, autograd and a real network."""

from labkit.course.questions.question import of_topic

QUESTIONS = of_topic("03_gradient")
right = {name: question.reference for name, question in QUESTIONS.items()}
