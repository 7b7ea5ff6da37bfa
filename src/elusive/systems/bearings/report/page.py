"""The page of a report on bearings: the ground over time, and the residuals."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from elusive.report import plots
from elusive.report.page import facts, rounded, stored, write_page
from elusive.systems.bearings.report.contents import BearingsTracked, half_axes

TIMES_SHOWN = 4000


def write_bearings_html(path: Path, tracked: BearingsTracked) -> None:
    """Write a page with the ground over time, the error or deviation, and the residuals of each sensor."""
    stride = max(1, -(-len(tracked.times_s) // TIMES_SHOWN))
    shown = np.arange(0, len(tracked.times_s), stride)
    places = np.where(tracked.told[:, None], tracked.places, np.nan)
    error = tracked.error
    data = {
        "times": rounded(tracked.times_s[shown], 3),
        "extent": tracked.extent,
        "sensors": rounded(tracked.sensors),
        "names": list(tracked.names),
        "colours": [plots.SERIES[row % len(plots.SERIES)] for row in range(len(tracked.names))],
        "places": rounded(places[shown]),
        "ellipses": rounded(half_axes(tracked.covariances)[shown], 4),
        "heights": None if tracked.heights is None else rounded(tracked.heights[shown]),
        "deviation": rounded(np.where(tracked.told, tracked.deviation, np.nan)[shown], 3),
        "truth": None if tracked.truth is None else rounded(tracked.truth[shown]),
        "error": None if error is None else rounded(np.where(tracked.told, error, np.nan)[shown], 3),
        "bearings": [_bearings(tracked, row) for row in shown.tolist()],
    }
    write_page(
        path,
        "report_bearings.html",
        data,
        {"title": tracked.title, "verdict": tracked.verdict},
        table=facts(tracked.rows),
        player=stored("report_player.css"),
        script=stored("report_bearings.js"),
    )


def _bearings(tracked: BearingsTracked, row: int) -> list[list[object]]:
    """Sensor, azimuth [rad] and residual [degrees] of each bearing of a time."""
    mine = slice(tracked.first[row], tracked.first[row + 1])
    azimuths, residuals = rounded(tracked.azimuth_rad[mine], 5), rounded(tracked.residual_deg[mine], 4)
    return [list(one) for one in zip(tracked.sensor[mine].tolist(), azimuths, residuals, strict=True)]
