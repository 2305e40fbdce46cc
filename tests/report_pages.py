"""The pages that grading writes, by name, from records made here: long names, wide tables, long lines of code."""

from pathlib import Path

from labgrader.grade.batch import Record
from labgrader.grade.deadlines import Lateness
from labgrader.grade.grade import Result
from labgrader.grade.overview import standings
from labgrader.grade.policy import Policy
from labgrader.grade.totals import Final
from labgrader.handin.reading import Lab
from labgrader.report.alike import Found, Hand, Pair
from labgrader.report.alike_page import alike_page
from labgrader.report.course_page import Row, course_page
from labgrader.report.outputs import class_page, feedback_page
from labgrader.report.texts import Text, Texts, texts_page

PROGRAM = "def mean_iou(n):\n    return " + " + ".join(f"n[{i}, {i}] / n[{i}].sum()" for i in range(12))
ADA, BEN = "ada_lovelace_of_the_analytical_engine_1815", "ben"


def report_pages() -> dict[str, str]:
    """Feedback, class, alike, course and texts."""
    lab = Lab("04_iou", {"iou": "", "mean_iou": ""}, {"iou": 2.0, "mean_iou": 3.0}, ("explain",), {}, {}, "digest")
    wrong = Result("mean_iou", 0.0, 3.0, "wrong: [0.25, 0.5, 0.125]", "Are absent classes counted?", kind="values")
    wrong = Result(**(vars(wrong) | {"program": PROGRAM, "flag": "attempts: reads a file"}))
    records = [
        Record(ADA, "", (Result("iou", 2.0, 2.0, "right", right=True), wrong), False, "d", "k"),
        Record(
            BEN,
            "",
            (Result("iou", 2.0, 2.0, "right", right=True), Result("mean_iou", 3.0, 3.0, "right", right=True)),
            True,
            "d",
            "k",
        ),
    ]
    hands = [Hand(name, PROGRAM, {"a": (2,)}) for name in (ADA, BEN)]
    labs = [f"0{i}_lab" for i in range(1, 10)]
    final = Final(ADA, 3.5, 5.0, ("explain",), Lateness(2, 20.0, free=1), "")
    row = Row(ADA, None, dict.fromkeys(labs, final), 70.0, dropped=["03_lab"], unread=["02_lab"])
    answer = Text("explain-3f09c2ab", ADA, f"Because $a$.\n\n```\n{PROGRAM}\n```\n\n" + "verylongword" * 20, None, "")
    texts = Texts("explain", 3.0, f"- 3 points\n\n```\n{PROGRAM}\n```", (answer,), 1)
    return {
        "feedback": feedback_page(lab, records[0], {}),
        "class": class_page(lab, standings(lab, records), {}, records),
        "alike": alike_page(lab, records, Found((Pair("mean_iou", *hands, 0.9, frozenset("a")),), (f"{ADA}: iou",))),
        "course": course_page(labs, [row], Policy({}, drop_lowest=1)),
        "texts": texts_page(lab, texts, ["explain", "explain_more"], "nonce"),
    }


def write_report_pages(folder: Path) -> dict[str, Path]:
    """The same as files."""
    written = {name: folder / f"{name}.html" for name in report_pages()}
    for name, text in report_pages().items():
        written[name].write_text(text, encoding="utf-8")
    return written
