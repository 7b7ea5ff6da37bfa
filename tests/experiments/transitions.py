"""Where a curve of errors over the background first reaches half of the chance level."""

from __future__ import annotations

import numpy as np

from elusive.contracts import Array
from elusive.experiments.mazurek2013.figures import CHANCE_LEVEL


def transition(sigmas: Array, errors: Array, level: float = CHANCE_LEVEL / 2) -> float:
    """Background deviation at which a curve first reaches a level, interpolated; NaN where it never does."""
    above = np.flatnonzero(errors >= level)
    if not above.size:
        return float("nan")
    after = int(above[0])
    if after == 0:
        return float(sigmas[0])
    return float(np.interp(level, errors[after - 1 : after + 1], sigmas[after - 1 : after + 1]))
