"""Cases of a test of which some take long, and others tell the same path through the code."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def longer(every: Iterable[Any], *long: Any) -> list[Any]:
    """All cases, a tuple where they have several parameters; ``long`` ones are left to ``make validate``."""
    marks = pytest.mark.validate
    return [
        pytest.param(*(one if isinstance(one, tuple) else (one,)), marks=marks) if one in long else one for one in every
    ]
