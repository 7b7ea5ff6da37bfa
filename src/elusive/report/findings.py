"""The piece of a report that says what does not hold: above all numbers, so that none is read without it."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable

from elusive.checks import Finding, broken, grave

OPTION = re.compile(r"(--[a-z-]+)")
UNSURE = "The numbers below are not to be believed as they stand: what they assume does not hold."


def findings_html(findings: Iterable[Finding]) -> str:
    """Return a box with a line for each finding that does not hold; nothing where all hold."""
    failing = broken(findings)
    if not failing:
        return ""
    lines = "".join(
        f'<li class="{"grave" if one.grave else "remark"}"><strong>{html.escape(one.name)}</strong> '
        f"{_told(one.sentence)} <em>{_told(one.remedy)}</em></li>"
        for one in failing
    )
    head = f"<p>{UNSURE}</p>" if grave(failing) else ""
    return f'<section class="findings">{head}<ul>{lines}</ul></section>\n'


def _told(sentence: str) -> str:
    """Return a sentence in which no option is broken over two lines."""
    return OPTION.sub(r"<code>\1</code>", html.escape(sentence))
