"""A recording of bearings of an emitter that stands still: its place, error ellipse, table, GeoJSON and figure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import Field

from elusive.contracts import Array, X, Y
from elusive.errors import DataError, ParameterError
from elusive.filters.gaussian.geolocation import Ellipse, Fix, Geolocation
from elusive.geometry.local_frame import LocalFrame
from elusive.io import atomic_folder
from elusive.io.bearings import BearingSource, radians_suspected
from elusive.sensors.arrival_times import ArrivalSet
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.sensors.bearings import wrapped
from elusive.systems.bearings.choices import Arrivals, BatchMap, Cruise
from elusive.systems.bearings.emitter import Emitter
from elusive.systems.bearings.given import units_finding
from elusive.systems.bearings.heard import bearings_of, sensors_of, starts_of
from elusive.systems.bearings.locate_checks import place_findings
from elusive.systems.bearings.located_files import Located, write_located
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.run import warnings_heard
from elusive.systems.bearings.track import track

RADIANS_AFTER = 3  # azimuths, none of them above 2 pi, after which radians are suspected
STANDING_Q, STANDING_MPS = 1e-12, 1e-6  # of an emitter that stays
WIDE = 1e3  # deviation of its place before it is heard, to the sensors' extent


class EmitterLocation(Geolocation):
    """Parameters of `elusive locate`."""

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
        _, sensor, azimuth = bearings_of(heard)
        east, north = (emitter.mean[[X, Y]] - sites.positions_m[sensor, :2]).T
        residual = wrapped(azimuth - np.arctan2(east, north))
        sigma = math.radians(tracking.deviation_deg) if len(azimuth) else math.nan
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
        Folder for ``emitter.csv``, ``emitter.geojson``, ``emitter.png``, ``checks.json`` and ``config.yaml``; None
        writes nothing.
    confidence
        Probability of the ellipse.
    origin_deg
        Longitude and latitude of the sensors' (0, 0); the GeoJSON is then geographic, as it is where the sensors have
        longitudes and latitudes.

    Raises
    ------
    DataError
        If a line cannot be used, or what is heard tells no place (bearings parallel, of one sensor, diverging).
    """
    with warnings_heard() as warned:
        heard = list(source)
        said = list(warned())
    sites, (_, _, azimuth) = source.sites, bearings_of(heard)
    greatest = float(np.rad2deg(np.abs(azimuth)).max(initial=0.0))
    if len(azimuth) >= RADIANS_AFTER and greatest <= 2 * math.pi and not said:
        said.append(radians_suspected(source.name, f"{len(azimuth)} azimuths", greatest))
    frame = sites.frame if origin_deg is None else LocalFrame.at(*origin_deg)
    if isinstance(heard[0], BearingSet):
        fix = parameters.locate(azimuth, starts_of(heard, sites))
    else:
        fix = parameters.of_arrivals(heard, sites)
    ellipse = fix.ellipse(confidence)
    lonlat = None if frame is None else frame.to_lonlat(fix.position_m)[0]
    bearings = [times for times in heard if isinstance(times, BearingSet)]
    whole = len(bearings) == len(heard)
    findings = place_findings(fix, bearings, sites, parameters) if whole else (units_finding(sites),)
    table = _table(fix, ellipse, lonlat, parameters, sites)
    located = Located(fix, ellipse, lonlat, (*said, *fix.remarks), table, findings)
    if out is not None:
        with atomic_folder(out) as folder:
            write_located(folder, located, heard, sites, frame, Path(source.name).name)
            (folder / "config.yaml").write_text(parameters.to_yaml(), encoding="utf-8")
    return located


def _table(
    fix: Fix, ellipse: Ellipse, lonlat: Array | None, parameters: EmitterLocation, sites: SensorSites
) -> list[tuple[str, str]]:
    how = "given" if parameters.sigma_deg is not None else "estimated from the bearings"
    known, sure = bool(np.isfinite(fix.covariance).all()), math.isfinite(fix.sigma_rad)
    rows = [("Place", f"{fix.position_m[0]:.2f} m east, {fix.position_m[1]:.2f} m north")]
    if lonlat is not None:
        rows.append(("Longitude, latitude", f"{lonlat[0]:.6f}, {lonlat[1]:.6f}"))
    sd = np.sqrt(np.diag(fix.covariance))
    rows += [
        ("Deviation", f"{sd[0]:.2f} m east, {sd[1]:.2f} m north" if known else "not known"),
        (
            f"Error ellipse, {100 * ellipse.confidence:g} %",
            f"half axes {ellipse.semi_major_m:.2f} and {ellipse.semi_minor_m:.2f} m, the longer one towards "
            f"{ellipse.azimuth_deg:.0f} degrees; {ellipse.area_m2:.4g} m²"
            if known
            else "not known",
        ),
        ("Deviation of a bearing", f"{math.degrees(fix.sigma_rad):.2f} degrees, {how}" if sure else "not known"),
        ("Bearings", f"{len(fix.weights)}, of {len(sites.names)} sensors in the table"),
        ("Estimator", f"{parameters.estimator}, {fix.iterations} steps"),
    ]
    return rows
