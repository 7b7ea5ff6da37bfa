"""The lines of a live run, as they stand among what a command said."""

from __future__ import annotations

import json
import re
from typing import Any


def json_lines(said: str) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """The records of the steps, and the summary, which is the last."""
    starts = [found.start() for found in re.finditer(r'\{"(time_s|summary)"', said)]
    *records, last = [json.JSONDecoder().raw_decode(said, start)[0] for start in starts]
    return records, last["summary"]
