"""The table printed after a benchmark run: what, how many times faster, the target, whether it was met."""

from __future__ import annotations

import time

import pytest

ROWS: list[tuple[str, float, str, bool]] = []


@pytest.fixture
def best_of():
    """Best seconds a call, of processor time over all threads; in rounds, so that other load meets the rivals alike."""

    def measure(*rivals, rounds=7, seconds=0.15):
        for rival in rivals:
            rival()
        best = [float("inf")] * len(rivals)
        for _ in range(rounds):
            for i, rival in enumerate(rivals):
                calls, start = 0, time.process_time()
                while (spent := time.process_time() - start) < seconds or not calls:
                    rival()
                    calls += 1
                best[i] = min(best[i], spent / calls)
        return best

    return measure


@pytest.fixture
def report(request):
    """Keep a row for the table; a ratio below its target is told there, not failed."""

    def keep(what, ratio, target):
        ROWS.append((what, ratio, f">= {target:g}", ratio >= target))
        if "benchmark" in request.fixturenames:
            request.getfixturevalue("benchmark").extra_info.update(ratio=ratio, target=target)

    return keep


def pytest_terminal_summary(terminalreporter):
    """Print the table."""
    if ROWS:
        terminalreporter.section("ratios")
        width = max(len(row[0]) for row in ROWS)
        for what, ratio, target, met in ROWS:
            terminalreporter.write_line(f"{what:{width}}  {ratio:8.1f}  {target:>8}  {'met' if met else 'NOT MET'}")
