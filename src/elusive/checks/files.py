"""Findings as a file: ``checks.json``."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path

from elusive.checks.finding import Finding

FILE = "checks.json"


def write_checks(folder: Path, findings: Iterable[Finding]) -> None:
    """Write ``checks.json``: a list of the findings, those that hold too; a number that is none is null."""
    rows = [
        finding._asdict()
        | {"holds": bool(finding.holds), "grave": bool(finding.grave)}
        | {"expected": _number(finding.expected), "seen": _number(finding.seen)}
        for finding in findings
    ]
    (folder / FILE).write_text(json.dumps(rows, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
