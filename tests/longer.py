"""Cases of a test of which some take long, and others tell the same path through the code."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def longer(every: Iterable[Any], *long: Any) -> list[Any]:
    """All cases, of which ``long`` ones are left to ``make validate``."""
    return [pytest.param(one, marks=pytest.mark.validate) if one in long else one for one in every]
