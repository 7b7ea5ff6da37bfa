"""Where an emitter is, as files: a table, GeoJSON, and a figure of sensors, bearings and error ellipse."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.checks import Finding, write_checks
from elusive.contracts import Array
from elusive.filters.gaussian.geolocation import Ellipse, Fix
from elusive.geometry.local_frame import LocalFrame
from elusive.io.csv_files import write_csv
from elusive.report import drawing as draw
from elusive.report import plots
from elusive.report.extents import about
from elusive.report.picture import write_picture
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.heard import bearings_of, sensors_of, starts_of

LOCAL = "local metres: x east, y north"
FEW = 30  # bearings that are drawn one by one
CORNERS = 72


class Located(NamedTuple):
    """Where the emitter is."""

    fix: Fix
    ellipse: Ellipse
    lonlat_deg: Array | None  # (2,) where an origin is known
    remarks: tuple[str, ...]
    table: list[tuple[str, str]]
    findings: tuple[Finding, ...] = ()


def write_located(
    folder: Path, located: Located, heard: Sequence[PlaceSet], sites: SensorSites, frame: LocalFrame | None, name: str
) -> None:
    """Write table, GeoJSON, figure and ``checks.json``; without a frame places stay in local metres."""
    numbers = _numbers(located)
    write_csv(folder / "emitter.csv", list(numbers), [numbers.values()])
    (folder / "emitter.geojson").write_text(_geojson(located, numbers, frame), encoding="utf-8", newline="\n")
    _draw(folder / "emitter.png", located, heard, sites, name)
    write_checks(folder, located.findings)


def _numbers(located: Located) -> dict[str, float | None]:
    """Every number of the result; None where it is not known."""
    (x, y), covariance, ellipse = located.fix.position_m, located.fix.covariance, located.ellipse
    sd = np.sqrt(np.diag(covariance))
    values = {
        "x_m": x, "y_m": y, "sd_x_m": sd[0], "sd_y_m": sd[1], "correlation": covariance[0, 1] / (sd[0] * sd[1]),
        "semi_major_m": ellipse.semi_major_m, "semi_minor_m": ellipse.semi_minor_m, "azimuth_deg": ellipse.azimuth_deg,
        "confidence": ellipse.confidence, "sigma_deg": math.degrees(located.fix.sigma_rad),
    }  # fmt: skip
    if located.lonlat_deg is not None:
        values |= dict(zip(("lon_deg", "lat_deg"), located.lonlat_deg, strict=True))
    return {name: float(value) if math.isfinite(value) else None for name, value in values.items()}


def _geojson(located: Located, numbers: dict[str, float | None], frame: LocalFrame | None) -> str:
    """Return a point and, where it is known, the ellipse: geographic as RFC 7946 has it, or said to be local."""
    outline, place = _outline(located), located.fix.position_m
    shapes = [("Point", place[None], {"what": "emitter", **numbers})]
    if outline is not None:
        shapes.append(("Polygon", outline, {"what": "error ellipse"}))
    features = []
    for kind, corners, properties in shapes:
        places = (corners if frame is None else frame.to_lonlat(corners)).tolist()
        geometry = {"type": kind, "coordinates": places[0] if kind == "Point" else [places]}
        features.append({"type": "Feature", "geometry": geometry, "properties": properties})
    # other programs would take metres for degrees
    system = {"coordinate_system": LOCAL} if frame is None else {}
    return json.dumps({"type": "FeatureCollection", **system, "features": features}, allow_nan=False) + "\n"


def _outline(located: Located) -> Array | None:
    """Corners of the ellipse in turn, the first again at the end."""
    if not np.isfinite(located.fix.covariance).all():
        return None
    angle = np.linspace(0, 2 * np.pi, CORNERS + 1)
    angle[-1] = 0.0
    circle = math.sqrt(-2 * math.log1p(-located.ellipse.confidence)) * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.asarray(located.fix.position_m + circle @ np.linalg.cholesky(located.fix.covariance).T)


def _draw(path: Path, located: Located, heard: Sequence[PlaceSet], sites: SensorSites, name: str) -> None:
    outline, (x, y) = _outline(located), located.fix.position_m
    used = np.unique(np.concatenate([sensors_of(times) for times in heard]))
    places = sites.positions_m[used, :2]
    whole = about(np.vstack([places, [x, y]]))
    near = 0.05 * (whole[1] - whole[0]) if outline is None else 1.4 * float(np.abs(outline - [x, y]).max())
    layers = _lines(located, heard, starts_of(heard, sites), 4 * math.hypot(whole[1] - whole[0], whole[3] - whole[2]))
    if outline is not None:
        ellipse = located.ellipse
        shape = [x, y, ellipse.semi_major_m, ellipse.semi_minor_m, math.radians(90.0 - ellipse.azimuth_deg)]
        layers.append(draw.ellipses(shape, plots.ESTIMATE, width=2, name=f"{100 * ellipse.confidence:g} % ellipse"))
    layers.append(draw.points([[x, y]], plots.ESTIMATE, size=5, name="emitter"))
    layers.append(
        draw.points(places, "--wall", marker="square", size=4, name="sensor", texts=[sites.names[one] for one in used])
    )
    axes = ("x, east", "y, north")
    panels = [
        draw.plane("Sensors and bearings", whole, layers, axes=axes),
        draw.plane("The emitter", (x - near, x + near, y - near, y + near), layers, axes=axes),
    ]
    write_picture(path, draw.drawing("", [0.0], panels), f"{name}: {x:.1f} m east, {y:.1f} m north")


def _lines(located: Located, heard: Sequence[PlaceSet], start: Array, length: float) -> list[draw.Layer]:
    """Return the bearings; what is taken for a stray is faint, and of many only some are drawn."""
    _, _, azimuth = bearings_of(heard)
    far = start + length * np.column_stack([np.sin(azimuth), np.cos(azimuth)])
    rows = np.arange(0, len(azimuth), max(1, -(-len(azimuth) // FEW)))
    stray = located.fix.weights[rows] <= 0.5
    return [
        draw.segments(np.column_stack([start, far])[rows[chosen]], "--plot", alpha=alpha, width=1.3, name=name)
        for name, alpha, chosen in (("bearing", 0.7, ~stray), ("bearing of little weight", 0.25, stray))
        if chosen.any()
    ]
