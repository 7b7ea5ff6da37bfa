"""A recording of bearings of an emitter that stands still: its place, error ellipse, table, GeoJSON and figure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array, X, Y
from elusive.errors import DataError, ParameterError
from elusive.filters.gaussian.geolocation import Ellipse, Fix, Geolocation
from elusive.geometry.local_frame import LocalFrame
from elusive.io import atomic_folder
from elusive.io.bearings import BearingSource, radians_suspected
from elusive.io.csv_files import write_csv
from elusive.io.emitter import write_emitter_geojson
from elusive.report import plots
from elusive.sensors.arrival_times import ArrivalSet
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.sensors.bearings import wrapped
from elusive.systems.bearings.parameters import Arrivals, BatchMap, BearingTracking, Cruise, angles_of, sensors_of
from elusive.systems.bearings.run import warnings_heard
from elusive.systems.bearings.track import Emitter, track

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FEW = 30  # bearings that are drawn one by one
RADIANS_AFTER = 3  # azimuths, none of them above 2 pi, after which radians are suspected
CORNERS = 72
STANDING_Q, STANDING_MPS = 1e-12, 1e-6  # of an emitter that stays
WIDE = 1e3  # deviation of its place before it is heard, to the sensors' extent


class Located(NamedTuple):
    """Where the emitter is."""

    fix: Fix
    ellipse: Ellipse
    lonlat_deg: Array | None  # (2,) where an origin is known
    remarks: tuple[str, ...]
    table: list[tuple[str, str]]


class EmitterLocation(Geolocation):
    """Everything `elusive locate` can be told."""

    arrivals: Arrivals = Field(Arrivals(), description="Times of arrival, where the table has them")

    def of_arrivals(self, heard: Sequence[PlaceSet], sites: SensorSites) -> Fix:
        """Estimate the place from times of arrival, with bearings or without: the path of an emitter that stays.

        Raises
        ------
        ParameterError
            If the estimator is of bearings alone.
        DataError
            If an arrival cannot be used, or they are too few to tell a place.
        """
        if self.estimator == "stansfield":
            raise ParameterError(
                "--estimator stansfield: is of bearings alone; with times of arrival take ml or huber."
            )
        count = len(np.unique(np.concatenate([sensors_of(times) for times in heard])))
        least = 2 + (isinstance(heard[0], ArrivalSet) and not self.arrivals.emission_known)
        if count < least:
            raise DataError(f"arrivals: are of {count} sensors, and a place needs {least}; add a sensor.")
        extent = float(np.linalg.norm(sites.positions_m[:, None] - sites.positions_m[None], axis=2).max())
        tracking = BearingTracking(
            motion=Cruise(q=STANDING_Q), sigma_deg=self.sigma_deg or 1.0, arrivals=self.arrivals,
            filter=BatchMap(
                loss="squares" if self.estimator == "ml" else "cauchy" if self.estimator == "andrews" else "huber",
                start_sd_m=WIDE * extent, start_speed_sd_mps=STANDING_MPS,
            ),
        )  # fmt: skip
        emitter: Emitter = list(track(heard, tracking, sites))[-1].state
        angles = [angles_of(times) for times in heard]
        sensor, azimuth = (np.concatenate([part[k] for part in angles]) for k in (1, 2))
        east, north = (emitter.mean[[X, Y]] - sites.positions_m[sensor.astype(np.intp), :2]).T
        residual = wrapped(azimuth - np.arctan2(east, north))
        sigma = math.radians(tracking.sigma_deg) if len(azimuth) else math.nan
        covariance = emitter.covariance[np.ix_([X, Y], [X, Y])]
        return Fix(emitter.mean[[X, Y]], covariance, sigma, np.ones(len(azimuth)), residual, 1, ())


def locate_recording(
    source: BearingSource,
    parameters: EmitterLocation,
    out: Path | None = None,
    *,
    confidence: float = 0.95,
    origin_deg: tuple[float, float] | None = None,
) -> Located:
    """Locate the emitter of all bearings or times of arrival of a recording; elevations are passed over.

    Parameters
    ----------
    source
        From :func:`~elusive.io.bearings.open_bearings`.
    parameters
        How.
    out
        Folder for ``emitter.csv``, ``emitter.geojson``, ``emitter.png`` and ``config.yaml``; None writes nothing.
    confidence
        Probability of the ellipse.
    origin_deg
        Longitude and latitude of the sensors' (0, 0); the GeoJSON is then geographic.

    Raises
    ------
    DataError
        If a line cannot be used, or what is heard tells no place (bearings parallel, of one sensor, diverging).
    """
    with warnings_heard() as warned:
        heard = list(source)
        said = list(warned())
    sites = source.sites
    angles = [angles_of(times) for times in heard]
    sensor, azimuth = (np.concatenate([part[k] for part in angles]) for k in (1, 2))
    greatest = float(np.rad2deg(np.abs(azimuth)).max(initial=0.0))
    if len(azimuth) >= RADIANS_AFTER and greatest <= 2 * math.pi and not said:
        said.append(radians_suspected(source.name, f"{len(azimuth)} azimuths", greatest))
    frame = None if origin_deg is None else LocalFrame.at(*origin_deg)
    if isinstance(heard[0], BearingSet):
        fix = parameters.locate(azimuth, sites.positions_m[sensor, :2])
    else:
        fix = parameters.of_arrivals(heard, sites)
    ellipse = fix.ellipse(confidence)
    lonlat = None if frame is None else frame.to_lonlat(fix.position_m)[0]
    located = Located(fix, ellipse, lonlat, (*said, *fix.remarks), _table(fix, ellipse, lonlat, parameters, sites))
    if out is not None:
        with atomic_folder(out) as folder:
            numbers = _numbers(located)
            write_csv(folder / "emitter.csv", list(numbers), [numbers.values()])
            _write_geojson(folder / "emitter.geojson", located, frame)
            reporting = np.concatenate([sensors_of(times) for times in heard])
            _draw(folder / "emitter.png", located, sites, reporting, sensor, azimuth, Path(source.name).name)
            (folder / "config.yaml").write_text(parameters.to_yaml(), encoding="utf-8")
    return located


def _table(
    fix: Fix, ellipse: Ellipse, lonlat: Array | None, parameters: EmitterLocation, sites: SensorSites
) -> list[tuple[str, str]]:
    how = "given" if parameters.sigma_deg is not None else "estimated from the bearings"
    told, sure = bool(np.isfinite(fix.covariance).all()), math.isfinite(fix.sigma_rad)
    rows = [("Place", f"{fix.position_m[0]:.2f} m east, {fix.position_m[1]:.2f} m north")]
    if lonlat is not None:
        rows.append(("Longitude, latitude", f"{lonlat[0]:.6f}, {lonlat[1]:.6f}"))
    sd = np.sqrt(np.diag(fix.covariance))
    rows += [
        ("Deviation", f"{sd[0]:.2f} m east, {sd[1]:.2f} m north" if told else "not known"),
        (
            f"Error ellipse, {100 * ellipse.confidence:g} %",
            f"half axes {ellipse.semi_major_m:.2f} and {ellipse.semi_minor_m:.2f} m, the longer one towards "
            f"{ellipse.azimuth_deg:.0f} degrees; {ellipse.area_m2:.4g} m²"
            if told
            else "not known",
        ),
        ("Deviation of a bearing", f"{math.degrees(fix.sigma_rad):.2f} degrees, {how}" if sure else "not known"),
        ("Bearings", f"{len(fix.weights)}, of {len(sites.names)} sensors in the table"),
        ("Estimator", f"{parameters.estimator}, {fix.iterations} steps"),
    ]
    return rows


def _numbers(located: Located) -> dict[str, float | None]:
    """Every number of the result; None where it is not told."""
    fix, ellipse, lonlat = located.fix, located.ellipse, located.lonlat_deg
    covariance = fix.covariance
    values = {
        "x_m": fix.position_m[0],
        "y_m": fix.position_m[1],
        "sd_x_m": math.sqrt(covariance[0, 0]),
        "sd_y_m": math.sqrt(covariance[1, 1]),
        "correlation": covariance[0, 1] / math.sqrt(covariance[0, 0] * covariance[1, 1]),
        "semi_major_m": ellipse.semi_major_m,
        "semi_minor_m": ellipse.semi_minor_m,
        "azimuth_deg": ellipse.azimuth_deg,
        "confidence": ellipse.confidence,
        "sigma_deg": math.degrees(fix.sigma_rad),
    }
    if lonlat is not None:
        values |= {"lon_deg": lonlat[0], "lat_deg": lonlat[1]}
    return {name: float(value) if math.isfinite(value) else None for name, value in values.items()}


def _write_geojson(path: Path, located: Located, frame: LocalFrame | None) -> None:
    outline = _outline(located.fix, located.ellipse.confidence)
    place = located.fix.position_m
    if frame is not None:
        place = frame.to_lonlat(place)[0]
        outline = None if outline is None else frame.to_lonlat(outline)
    write_emitter_geojson(path, place, outline, _numbers(located), geographic=frame is not None)


def _outline(fix: Fix, confidence: float) -> Array | None:
    if not np.isfinite(fix.covariance).all():
        return None
    angle = np.linspace(0, 2 * np.pi, CORNERS, endpoint=False)
    circle = math.sqrt(-2 * math.log1p(-confidence)) * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.asarray(fix.position_m + circle @ np.linalg.cholesky(fix.covariance).T)


def _draw(
    path: Path, located: Located, sites: SensorSites, reporting: NDArray[np.intp], sensor: NDArray[np.intp],
    azimuth: Array, name: str,
) -> None:  # fmt: skip
    fix = located.fix
    outline = _outline(fix, located.ellipse.confidence)
    places, used = sites.positions_m[:, :2], np.unique(reporting)
    shown = np.concatenate([places[used], fix.position_m[None]])
    middle, half = 0.5 * (shown.min(axis=0) + shown.max(axis=0)), 0.6 * np.ptp(shown, axis=0).max()
    with plots.figure(path, 10.0, 5.2, 1, 2) as (figure, ((whole, near),)):
        _draw_lines(whole, located, places[sensor], azimuth, 4 * half)
        for label, place in zip(sites.names, places, strict=True):
            if np.abs(place - middle).max() <= half:
                whole.annotate(label, tuple(place), (5, 4), textcoords="offset points", color=plots.MUTED, size=8)
        whole.plot(*places[used].T, "s", color="#334155", markersize=5.5, label="sensor", zorder=4)
        whole.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half))
        _draw_lines(near, located, places[sensor], azimuth, 4 * half)
        reach = 0.05 * half if outline is None else 1.4 * float(np.abs(outline - fix.position_m).max())
        near.set(
            xlim=(fix.position_m[0] - reach, fix.position_m[0] + reach),
            ylim=(fix.position_m[1] - reach, fix.position_m[1] + reach),
        )
        for axes, title in ((whole, "Sensors and bearings"), (near, "The emitter")):
            if outline is not None:
                axes.fill(*outline.T, facecolor=plots.ESTIMATE, alpha=0.15, linewidth=0, zorder=2)
                label = f"{100 * located.ellipse.confidence:g} % ellipse"
                axes.plot(*np.concatenate([outline, outline[:1]]).T, color=plots.ESTIMATE, lw=1.3, label=label)
            axes.plot(*fix.position_m, "o", color=plots.ESTIMATE, markersize=6, label="emitter", zorder=5)
            axes.set(title=title, xlabel="x, east [m]", ylabel="y, north [m]", aspect="equal")
        figure.legend(*whole.get_legend_handles_labels(), loc="outside lower left", ncols=6)
        x, y = fix.position_m
        figure.suptitle(f"{name}: {x:.1f} m east, {y:.1f} m north", x=0.01, ha="left", size=12, weight="bold")


def _draw_lines(axes: Axes, located: Located, places: Array, azimuth: Array, length: float) -> None:
    """Draw the bearings; what is taken for a stray is dotted, and of many only some are drawn."""
    named = set[str]()
    for row in range(0, len(azimuth), max(1, -(-len(azimuth) // FEW))):
        weight = float(located.fix.weights[row])
        label = "bearing" if weight > 0.5 else "bearing of little weight"
        far = places[row] + length * np.array([math.sin(azimuth[row]), math.cos(azimuth[row])])
        axes.plot(
            *np.stack([places[row], far]).T, color=plots.MUTED, lw=1.0, alpha=0.7,
            linestyle="-" if weight > 0.5 else (0, (1, 2)), label=None if label in named else label, zorder=1,
        )  # fmt: skip
        named.add(label)
