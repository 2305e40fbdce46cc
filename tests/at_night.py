"""Values that a test repeats itself on: some at each run, all others at night."""

from collections.abc import Iterable

import pytest


def others_at_night(values: Iterable, by_day: Iterable = ()) -> list:
    """All values, those that are not named `by_day` marked nightly; by default the first is for each run."""
    values = list(values)
    named = list(by_day) or values[:1]
    return [value if value in named else pytest.param(value, marks=pytest.mark.nightly) for value in values]
