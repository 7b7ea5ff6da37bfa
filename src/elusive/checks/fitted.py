"""A value that was fitted to a recording without labels, and how sure it is."""

from __future__ import annotations

import math
from typing import NamedTuple


class Fitted(NamedTuple):
    """One value of a fit."""

    option: str  # of `elusive track` that it stands for: "--noise-sigma"
    what: str  # in words
    value: str  # as that option takes it
    deviation: float  # standard error, in the value's unit; NaN where there is none
    how: str  # from what it is known, or why it is not

    @property
    def cells(self) -> tuple[str, str, str, str, str]:
        """Cells of its line in a table."""
        sure = f"{self.deviation:.2g}" if math.isfinite(self.deviation) else "-"
        return self.option, self.what, self.value, sure, self.how


HEADER = ("option", "what", "fitted", "deviation", "from")
