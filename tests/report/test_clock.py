"""Times of a table are those of the time line, and say once what they have in common."""

from __future__ import annotations

import pytest

from elusive.report.clock import Clock
from elusive.workbench.why_none import told_apart

NOON_S = 1_777_636_800.0  # 2026-05-01T12:00:00Z


@pytest.mark.parametrize(
    ("times", "unit", "heads", "bare"),
    [
        ([0.0, 2.5, 5.0], "s", ("from [s]",), "2.5"),
        ([0.0, 1.0, 2.0], "frame", ("from [frame]",), "1"),
        ([0.0, 4000.0, 8000.0], "s", ("from",), "01:06:40"),
        ([NOON_S, NOON_S + 2.5, NOON_S + 5.0], "s", ("from [UTC]",), "12:00:02.5"),
        ([NOON_S, NOON_S + 43_199.0, NOON_S + 43_200.0], "s", ("from",), "2026-05-01 23:59:59 UTC"),
        ([NOON_S], "s", ("from",), "2026-05-01 12:00:00 UTC"),
    ],
)
def test_a_column_of_times(times, unit, heads, bare):
    clock = Clock.of(times, unit)
    assert clock.heads("from") == heads
    assert clock.bare(times[min(1, len(times) - 1)]) == bare


def test_two_numbers_are_written_so_that_they_differ():
    assert told_apart(0.5, 0.95) == ("0.5", "0.95")
    assert told_apart(0.99961, 0.9999) == ("0.9996", "0.9999")
    assert told_apart(1.0, 1.0) == ("1", "1")
    assert told_apart(0.5, 0.9999999) == ("0.5", "0.9999999")  # no number but 1 is told as 1
