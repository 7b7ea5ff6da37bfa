"""The piece of a report that says what does not hold: above all numbers, so that none is read without it."""

from __future__ import annotations

import html
from collections.abc import Iterable
from typing import Any

from elusive.checks import Finding, broken, grave

UNSURE = "The numbers below are not to be believed as they stand: what they assume does not hold."


def findings_html(findings: Iterable[Finding]) -> str:
    """Return a box with a line for each finding that does not hold; nothing where all hold."""
    failing = broken(findings)
    if not failing:
        return ""
    lines = "".join(
        f'<li class="{"grave" if one.grave else "remark"}"><strong>{html.escape(one.name)}</strong> '
        f"{html.escape(one.sentence)} <em>{html.escape(one.remedy)}</em></li>"
        for one in failing
    )
    head = f"<p>{UNSURE}</p>" if grave(failing) else ""
    return f'<section class="findings">{head}<ul>{lines}</ul></section>\n'


def findings_note(figure: Any, findings: Iterable[Finding]) -> None:
    """Write under a figure that grave findings do not hold, by their names."""
    names = ", ".join(one.name for one in broken(findings) if one.grave)
    if names:
        said = f"Not to be believed as it stands ({names}): see checks.json"
        figure.supxlabel(said, x=0.99, ha="right", size=8, color="#b91c1c")
