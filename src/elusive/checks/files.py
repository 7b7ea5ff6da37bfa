"""Findings as a file: ``checks.json``."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path

from elusive.checks.finding import Finding
from elusive.io.atomic import atomic_path

FILE = "checks.json"


def write_checks(folder: Path, findings: Iterable[Finding]) -> None:
    """Write ``checks.json``: a list of the findings, those that hold too; a number that is none is null.

    Raises
    ------
    DataError
        If the file cannot be written.
    """
    rows = [
        finding._asdict()
        | {"holds": bool(finding.holds), "grave": bool(finding.grave)}
        | {"expected": _number(finding.expected), "seen": _number(finding.seen)}
        for finding in findings
    ]
    text = json.dumps(rows, indent=2, ensure_ascii=False) + "\n"
    with atomic_path(folder / FILE) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
