"""The panel of what tracks are worth over time: GOSPA, and what it is made of."""

from __future__ import annotations

from typing import Any

import numpy as np

from elusive.contracts import Array
from elusive.metrics import Gospa
from elusive.report import drawing as draw
from elusive.report.extents import stride_of
from elusive.report.plots import SERIES

TIMES_SHOWN = 2000
PARTS = (("places off", "localisation", SERIES[1]), ("missed", "missed", SERIES[3]), ("false", "false", SERIES[5]))


def gospa_chart(times: Array, found: Gospa, cutoff: float, unit: str, **more: Any) -> draw.Panel:
    """Return GOSPA (p = 2) over time and its parts, whose squares add up to its own.

    Parameters
    ----------
    times
        ``(T,)``.
    found
        Of each time, from :func:`~elusive.metrics.set_distances.gospa`.
    cutoff, unit
        c, and what it is in.
    """
    shown = slice(None, None, stride_of(len(times), TIMES_SHOWN))
    lines = [
        draw.line(times[shown], np.sqrt(getattr(found, part))[shown], colour, width=1.2, name=name)
        for name, part, colour in PARTS
    ]
    lines.append(draw.line(times[shown], found.distance[shown], "--accent", name="GOSPA"))
    title = f"What is it worth? GOSPA, {np.mean(found.distance):.2f} {unit} on average (c {cutoff:.3g} {unit})"
    top = 1.05 * max(float(np.max(found.distance, initial=0.0)), 0.1 * cutoff)
    return draw.chart(title, times, lines, axis="GOSPA", unit=unit, reach=(0.0, top), **more)
