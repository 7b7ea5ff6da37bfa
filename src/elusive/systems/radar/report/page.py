"""The radar report's page: map, tracks and clouds over time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from elusive.contracts import Array
from elusive.report import plots
from elusive.report.page import facts, picture_url, rounded, stored, track_table, write_page
from elusive.systems.radar.report.contents import ChartMap, Cloud, Extent, RadarPath, RadarTracked, WaterRaster

SCANS_SHOWN = 2000
POINTS_SHOWN = 40_000  # of all tracks together
TELLING = 6  # clouds that the page leads to
DEGREE = 3  # of the polynomial that gives longitude and latitude: right to a metre over 100 km


def write_radar_html(path: Path, tracked: RadarTracked) -> None:
    """Write a page with the map, the tracks and clouds over time, and their speed, deviation and error."""
    points = sum(len(one.times_s) for one in tracked.paths)
    stride = max(1, -(-len(tracked.times_s) // SCANS_SHOWN), -(-points // POINTS_SHOWN))
    times = tracked.times_s[::stride]
    clouds = tracked.drawn_clouds()
    telling = {id(cloud) for cloud in tracked.telling_clouds(TELLING)}
    data = {
        "times": times.tolist(),
        "plots": rounded(tracked.plots),
        "paths": [_path(one, tracked.error(one), times) for one in tracked.paths],
        "clouds": [_cloud(cloud) for cloud in clouds],
        "telling": [number for number, cloud in enumerate(clouds) if id(cloud) in telling],
        "truth": None if tracked.truth is None else rounded(tracked.truth),
        "extent": tracked.extent,
        "chart": None if tracked.chart is None else _chart(tracked.chart),
        "degrees": None if tracked.lonlat is None else _degrees(tracked.lonlat, tracked.extent),
        "estimate": tracked.estimate,
    }
    write_page(
        path,
        "report_radar.html",
        data,
        {"title": tracked.title, "verdict": tracked.verdict},
        tracks=track_table(tracked.header, tracked.tracks, {str(one.track) for one in tracked.paths}, "Centre on it"),
        table=facts(tracked.rows),
        map=stored("report_radar_map.js"),
        player=stored("report_player.css"),
        script=stored("report_radar.js"),
    )


def _path(path: RadarPath, error: Array | None, times: Array) -> dict[str, object]:
    """Lay a track out by column, at the scans shown and at its last."""
    shown = np.isin(path.times_s, times)
    shown[-1:] = True
    across = np.zeros(len(path.times_s)) if path.covariance is None else path.covariance
    return {
        "track": path.track,
        "colour": plots.track_colour(path.track),
        "times": path.times_s[shown].tolist(),
        "x": rounded(path.places[shown, 0]),
        "y": rounded(path.places[shown, 1]),
        "vx": rounded(path.velocity[shown, 0]),
        "vy": rounded(path.velocity[shown, 1]),
        "sx": rounded(path.deviation[shown, 0], 3),
        "sy": rounded(path.deviation[shown, 1], 3),
        "cxy": rounded(across[shown], 3),
        "sure": path.confirmed[shown].astype(int).tolist(),
        "forbidden": path.forbidden[shown].astype(int).tolist(),
        "allowed": None if path.allowed is None else rounded(path.allowed[shown], 4),
        "error": None if error is None else rounded(error[shown]),
    }


def _cloud(cloud: Cloud) -> dict[str, object]:
    """Lay a cloud out; particles in whole centimetres from the mean."""
    return {
        "time": cloud.time_s,
        "track": cloud.track,
        "mean": rounded(cloud.mean),
        "mode": None if cloud.mode is None else rounded(cloud.mode),
        "plots": rounded(cloud.plots),
        "cm": np.round(100 * (cloud.particles - np.round(cloud.mean, 2))).astype(int).ravel().tolist(),
        "water": None if np.isnan(cloud.water) else round(cloud.water, 4),
    }


def _chart(chart: ChartMap) -> dict[str, object]:
    return {
        "window": None if chart.window is None else np.round(chart.window, 1).tolist(),
        "land": [rounded(ring.ravel(), 1) for ring in chart.land],
        "rasters": [{"extent": raster.extent, "url": _picture(raster)} for raster in chart.rasters],
    }


def _picture(raster: WaterRaster) -> str:
    """Write P(water) as a grey PNG in a data URL, north at the top: 0 to 254 for P, 255 where nothing is known."""
    known = np.isfinite(raster.probability)
    grey = np.where(known, np.round(254 * np.clip(np.nan_to_num(raster.probability), 0.0, 1.0)), 255)
    return picture_url(np.ascontiguousarray(grey[::-1]).astype(np.uint8))


def _degrees(lonlat: Callable[[Array], Array], extent: Extent) -> dict[str, object]:
    """Fit polynomials of x and y to longitude and latitude over four times what is shown."""
    west, east, south, north = extent
    x0, y0, half = 0.5 * (west + east), 0.5 * (south + north), 2.0 * max(east - west, north - south)
    u, v = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-1.0, 1.0, 9)] * 2))
    degrees = lonlat(np.column_stack([x0 + half * u, y0 + half * v]))
    lon = degrees[len(u) // 2, 0] + np.mod(degrees[:, 0] - degrees[len(u) // 2, 0] + 180.0, 360.0) - 180.0
    terms = np.column_stack([u**i * v**j for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)])
    fitted, *_ = np.linalg.lstsq(terms, np.column_stack([lon, degrees[:, 1]]), rcond=None)
    return {
        "x": x0,
        "y": y0,
        "half": half,
        "degree": DEGREE,
        "lon": fitted[:, 0].tolist(),
        "lat": fitted[:, 1].tolist(),
    }
