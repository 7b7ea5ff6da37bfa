"""Cases of a test of which some take long, and others tell the same path through the code."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def longer(every: Iterable[Any], *long: Any, marks: Any = pytest.mark.thorough) -> list[Any]:
    """All cases, a tuple where they have several parameters; ``long`` ones are left to ``make thorough``.

    ``marks`` is another marker: of what ``make thorough`` measures.
    """
    return [
        pytest.param(*(one if isinstance(one, tuple) else (one,)), marks=marks) if one in long else one for one in every
    ]
