"""The page of a report: one HTML file that asks nothing of the network."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from string import Template

import numpy as np

from elusive import plots
from elusive.contracts import Array
from elusive.io.atomic import atomic_path
from elusive.report_bearings.contents import BearingsTracked, half_axes

TIMES_SHOWN = 4000


def write_bearings_html(path: Path, tracked: BearingsTracked) -> None:
    """Write a page with the ground over time, the error or deviation, and the residuals of each sensor."""
    stride = max(1, -(-len(tracked.times_s) // TIMES_SHOWN))
    shown = np.arange(0, len(tracked.times_s), stride)
    places = np.where(tracked.told[:, None], tracked.places, np.nan)
    error = tracked.error
    data = {
        "times": _numbers(tracked.times_s[shown], 3),
        "extent": tracked.extent,
        "sensors": _numbers(tracked.sensors),
        "names": list(tracked.names),
        "colours": [plots.SERIES[row % len(plots.SERIES)] for row in range(len(tracked.names))],
        "places": _numbers(places[shown]),
        "ellipses": _numbers(half_axes(tracked.covariances)[shown], 4),
        "heights": None if tracked.heights is None else _numbers(tracked.heights[shown]),
        "deviation": _numbers(np.where(tracked.told, tracked.deviation, np.nan)[shown], 3),
        "truth": None if tracked.truth is None else _numbers(tracked.truth[shown]),
        "error": None if error is None else _numbers(np.where(tracked.told, error, np.nan)[shown], 3),
        "bearings": [_bearings(tracked, row) for row in shown.tolist()],
    }
    template = Template(_stored("report_bearings.html"))
    page = template.substitute(
        title=html.escape(tracked.title),
        verdict=html.escape(tracked.verdict),
        table="".join(f"<tr><th>{html.escape(a)}</th><td>{html.escape(b)}</td></tr>" for a, b in tracked.rows),
        # no "</script>" can end the script early
        data=json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"),
        script=_stored("report_bearings.js"),
    )
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _bearings(tracked: BearingsTracked, row: int) -> list[list[object]]:
    """Sensor, azimuth [rad] and residual [degrees] of each bearing of a time."""
    mine = slice(tracked.first[row], tracked.first[row + 1])
    azimuths, residuals = _numbers(tracked.azimuth_rad[mine], 5), _numbers(tracked.residual_deg[mine], 4)
    return [list(one) for one in zip(tracked.sensor[mine].tolist(), azimuths, residuals, strict=True)]


def _stored(name: str) -> str:
    return files("elusive").joinpath("templates", name).read_text(encoding="utf-8")


def _numbers(values: Array | Sequence[float], digits: int = 2) -> list[object]:
    """Round for JSON, NaN as null."""
    given = np.asarray(values, dtype=np.float64)
    rounded = np.round(given, digits).astype(object)
    rounded[~np.isfinite(given)] = None
    listed: list[object] = rounded.tolist()
    return listed
