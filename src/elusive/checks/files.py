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
        {key: None if isinstance(value, float) and not math.isfinite(value) else value for key, value in row.items()}
        for row in (finding._asdict() for finding in findings)
    ]
    (folder / FILE).write_text(json.dumps(rows, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
