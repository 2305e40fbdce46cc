"""Marked numbers of a notebook's prose, which its outputs show: docs/style.md says how they are marked."""

import re

NUMBER = r"(?<![\w.])-?\d+(?:,\d{3})*(?:\.\d+)?(?:e-?\d+)?"
MARK = re.compile(rf"({NUMBER})\s?(\\?%)?[$*_)`\s]{{0,3}}<!--=\s*([0-9a-f]{{4,8}})?\s*(?::\s*([^>]*?))?\s*-->")

OPERAND = r"\d+(?:\.\d+)?(?:e-?\d+)?"
CONSTANTS = (1, 2, 100)  # of a formula, which no output needs to show


def value(text: str) -> float:
    """A number as prose or an output writes it."""
    return float(text.replace(",", ""))


def printed(cell) -> str:
    """What a cell printed or gave as text; what stands in for a picture does not count."""
    outputs = [o for o in cell.get("outputs", []) if "image/png" not in o.get("data", {})]
    return "\n".join(o.get("text") or o.get("data", {}).get("text/plain", "") for o in outputs)


def numbers(text: str) -> list[str]:
    """The numbers of an output, as written."""
    return re.findall(NUMBER, text)


def shows(text: str, number: str, percent: bool, formula: str | None) -> bool:
    """Whether an output holds a number of prose, rounded as the prose has it; formula: of numbers of the output."""
    digits = len(number.partition(".")[2])
    there = [value(n) for n in numbers(text)]
    if formula:
        used = [value(n) for n in re.findall(OPERAND, formula)]
        if any(n not in there and n not in CONSTANTS for n in used):
            return False
        there = [computed(formula)]
    candidates = there + [100 * n for n in there] if percent else there
    return any(rounds_to(n, number, digits) for n in candidates)


def rounds_to(n: float, number: str, digits: int) -> bool:
    """Whether a number is another one of so many digits after the point; prose may leave a sign to its words."""
    return abs(abs(n) - abs(value(number))) <= 0.5000001 * 10**-digits


def computed(formula: str) -> float:
    """The value of a mark's formula; ValueError if it is more than numbers and + - * /."""
    if not re.fullmatch(r"[\d\s.+*/()e-]+", formula):
        raise ValueError(f"formula: expected numbers with + - * / and brackets, got {formula!r}")
    return float(eval(formula))
