"""What was fitted to a recording without labels: values, how sure each is, the configuration that they make."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import yaml


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


class Fit(NamedTuple):
    """What a recording says of itself."""

    values: tuple[Fitted, ...]
    tree: dict[str, Any]  # what was fitted alone, as a configuration of `elusive track` nests it
    remark: str = ""  # what the recording was taken for

    def to_yaml(self) -> str:
        """Return the configuration; all that is not in it keeps its defaults."""
        return yaml.safe_dump(self.tree, sort_keys=False)


HEADER = ("option", "what", "fitted", "deviation", "from")
