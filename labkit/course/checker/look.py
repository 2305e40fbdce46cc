"""One look at the program of a wrong answer: instruments first, then repair.

It runs where a student's program may run: in a child process of the check (`child`), or in the grader's sandbox, which
has these modules and NumPy, and nothing else of labkit.
"""

from collections.abc import Callable, Sequence

from labkit.course.checker.comparison import compare
from labkit.course.checker.finding import Finding, write
from labkit.course.checker.instruments import readings
from labkit.course.checker.question import Question
from labkit.course.checker.repair import repairs

# The modules that a look needs, each after those that it imports.
MODULES = ("question", "comparison", "finding", "mutation", "repair", "instruments", "look")

Pairs = Sequence[tuple[tuple, object]]  # the arguments of cases, and what is expected


def look(
    question: Question, pieces: Sequence[tuple[str, str]], public: Pairs, fresh: Callable[[], Pairs]
) -> list[Finding]:
    """What is found in a program, the surest first; public, fresh: cases, as `repair.repairs` takes them."""

    def right(expected, got):
        return compare(question, expected, got) is None

    found = readings(pieces, question.function, public, right)
    return found + repairs(pieces, question.function, public, fresh, right)


def in_the_sandbox(tolerances: dict, pieces: Sequence[tuple[str, str]], public: Pairs, fresh: Pairs) -> str:
    """The findings as JSON, where there is no kit: tolerances are the fields of a Question that compare outputs.

    Outputs that are equally right in another form (`Question.canonical`) count as wrong here, so that a repair may be
    missed, and none is wrong.
    """
    question = Question(reference=None, inputs=None, **tolerances)
    return write(look(question, pieces, public, lambda: fresh))
