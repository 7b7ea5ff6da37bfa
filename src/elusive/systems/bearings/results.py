"""What tracking an emitter by its bearings came to: the table of the track, its scores, and its files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.io import TrackRow, write_netcdf, write_tracks_csv
from elusive.io.csv_files import number_text, write_csv
from elusive.io.path_truth import PathTruth
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.parameters import BearingTracking, Estimates
from elusive.systems.bearings.report import BearingsTracked, write_bearings_html, write_bearings_png

TRACK = 1
HEIGHT_COLUMNS = ("time_s", "track", "z_m", "vz_mps", "sd_z_m")
RADIUS2_95 = {2: 5.991, 3: 7.815}  # chi-square, 95 %


class BearingOutcome(NamedTuple):
    """A tracked recording."""

    verdict: str
    table: list[tuple[str, str]]
    remarks: tuple[str, ...]
    estimates: Estimates
    rows: list[TrackRow]
    tracked: BearingsTracked  # what the report shows


def outcome_of(
    name: str,
    sets: list[BearingSet],
    sites: SensorSites,
    parameters: BearingTracking,
    estimates: Estimates,
    remarks: Sequence[str],
    truth: PathTruth | None,
) -> BearingOutcome:
    """Lay out tables and report of a recording."""
    column = {component: k for k, component in enumerate(estimates.names)}
    ground = [column["x"], column["y"]]
    places = estimates.states[:, ground]
    covariances = estimates.covariances[:, ground][:, :, ground]
    heights = None
    if "z" in column:
        z = column["z"]
        heights = np.column_stack([estimates.states[:, z], np.sqrt(estimates.covariances[:, z, z])])
    counts = np.array([len(each.sensor) for each in sets])
    sensor = np.concatenate([each.sensor for each in sets])
    azimuth = np.concatenate([each.azimuth_rad for each in sets])
    east, north = (np.repeat(places, counts, axis=0) - sites.positions_m[sensor, :2]).T
    residual = (azimuth - np.arctan2(east, north) + np.pi) % (2 * np.pi) - np.pi
    true = None if truth is None else truth.at(estimates.times_s)
    tracked = BearingsTracked(
        Path(name).name or name, "", sites.names, sites.positions_m[:, :2], estimates.times_s, places, covariances,
        heights, estimates.begun, np.concatenate([[0], np.cumsum(counts)]).astype(np.intp), sensor, azimuth,
        np.rad2deg(residual), true, [],
    )  # fmt: skip
    verdict = _verdict(tracked)
    table = _table(tracked, parameters, estimates, sets)
    if true is not None:
        table += _scores(estimates, tracked, np.array([len(set(each.sensor.tolist())) for each in sets]))
    tracked = tracked._replace(verdict=" ".join([verdict, *remarks]), rows=table)
    return BearingOutcome(verdict, table, tuple(remarks), estimates, _rows(estimates), tracked)


def write_outcome(folder: Path, outcome: BearingOutcome, config: str) -> None:
    """Write everything into a folder."""
    write_tracks_csv(folder / "tracks.csv", outcome.rows, unit="m")
    if "z" in outcome.estimates.names:
        _write_heights(folder / "heights.csv", outcome.estimates)
    (folder / "config.yaml").write_text(config, encoding="utf-8")
    _write_dataset(folder / "result.nc", outcome, config)
    write_bearings_png(folder / "report.png", outcome.tracked)
    write_bearings_html(folder / "report.html", outcome.tracked)


def track_row(time_s: float, names: Sequence[str], state: Array, covariance: Array, *, told: bool) -> TrackRow:
    """Return a time's row of the table: a candidate until a place is told, of status none without one."""
    x, y = names.index("x"), names.index("y")
    if not math.isfinite(state[x]):
        return TrackRow(time_s, None, "none", 0.0)
    return TrackRow(
        time_s, TRACK, "confirmed" if told else "candidate", 1.0, float(state[x]), float(state[y]),
        float(state[names.index("vx")]), float(state[names.index("vy")]), math.sqrt(covariance[x, x]),
        math.sqrt(covariance[y, y]),
    )  # fmt: skip


def _rows(estimates: Estimates) -> list[TrackRow]:
    each = enumerate(zip(estimates.times_s.tolist(), estimates.states, estimates.covariances, strict=True))
    return [
        track_row(time_s, estimates.names, state, covariance, told=row >= estimates.begun)
        for row, (time_s, state, covariance) in each
    ]


def height_cells(time_s: float, names: Sequence[str], state: Array, covariance: Array) -> list[str]:
    """Return a time's line of the table of heights."""
    z, vz = names.index("z"), names.index("vz")
    values = (float(state[z]), float(state[vz]), math.sqrt(covariance[z, z]))
    return [number_text(time_s), str(TRACK), *map(number_text, values)]


def _write_heights(path: Path, estimates: Estimates) -> None:
    at_each = zip(estimates.times_s.tolist(), estimates.states, estimates.covariances, strict=True)
    write_csv(path, HEIGHT_COLUMNS, (height_cells(one, estimates.names, *moments) for one, *moments in at_each))


def _verdict(tracked: BearingsTracked) -> str:
    told = tracked.told
    if not told.any():
        return "The bearings tell no place."
    first, last = tracked.times_s[told][[0, -1]]
    deviation = float(np.median(tracked.deviation[told]))
    walked = float(np.hypot(*np.diff(tracked.places[told], axis=0).T).sum())
    said = f"A track from {first:g} to {last:g} s"
    if len(np.unique(tracked.sensor)) > 1:
        said += f", {walked:.0f} m long, sure to {deviation:.2g} m (median deviation)"
    else:  # its deviations are those of the start that was assumed, and too small close to the sensor
        said += " by one sensor alone, which tells directions and no distance"
    error = tracked.error
    if error is not None and np.isfinite(error[told]).any():
        said += f"; {math.sqrt(np.nanmean(error[told] ** 2)):.2f} m RMSE from the truth over the ground"
    return said + "."


def _table(
    tracked: BearingsTracked, parameters: BearingTracking, estimates: Estimates, sets: list[BearingSet]
) -> list[tuple[str, str]]:
    counts = np.bincount(tracked.sensor, minlength=len(tracked.names))
    step = float(np.median(np.diff(tracked.times_s))) if len(tracked.times_s) > 1 else math.nan
    longest = float(np.diff(tracked.times_s).max(initial=0.0))
    by_sensor = ", ".join(f"{name}: {n}" for name, n in zip(tracked.names, counts, strict=True) if n)
    residual = tracked.residual_deg[np.isfinite(tracked.residual_deg)]
    rows = [
        ("Times", f"{len(sets)}, mostly {step:.3g} s apart, at most {longest:.3g} s"),
        ("Bearings by sensor", by_sensor[:200]),
        ("Estimator", f"{parameters.choice(live=False)}, motion {parameters.motion}, {parameters.sigma_deg:g} degrees"),
        ("Dimensions", "3: heights from elevations" if tracked.heights is not None else "2"),
    ]
    if len(residual):
        rows.append(
            ("Residuals", f"{np.sqrt(np.mean(residual**2)):.3g} degrees RMS, {np.median(np.abs(residual)):.3g} median")
        )
    if estimates.begun:
        rows.append(("A place is told", f"from {tracked.times_s[min(estimates.begun, len(sets) - 1)]:g} s on"))
    if math.isfinite(estimates.log_evidence):
        rows.append(("Log evidence", f"{estimates.log_evidence:.2f}, to compare settings by"))
    return rows


def _scores(estimates: Estimates, tracked: BearingsTracked, sensors: Array) -> list[tuple[str, str]]:
    """Score against the truth, over all dimensions that both have."""
    assert tracked.truth is not None
    solid = tracked.heights is not None and bool(np.isfinite(tracked.truth[:, 2]).any())
    axes = [estimates.names.index(name) for name in ("xyz" if solid else "xy")]
    d = len(axes)
    off = estimates.states[:, axes] - tracked.truth[:, :d]
    scored = tracked.told & np.isfinite(off).all(axis=1)
    if not scored.any():
        return [("Scores", "none: the truth has no time of the track")]
    spread = estimates.covariances[:, axes][:, :, axes][scored]
    nees = (off[scored] * np.linalg.solve(spread, off[scored][..., None])[..., 0]).sum(axis=1)
    error = np.linalg.norm(off[scored], axis=1)
    what = "in space" if solid else "over the ground"
    rows = [
        (f"Error {what}", f"{_rms(error):.2f} m RMSE, {np.median(error):.2f} m median, over {len(error)} times"),
        (f"Truth in the 95 % {'ellipsoid' if solid else 'ellipse'}", f"{100 * np.mean(nees < RADIUS2_95[d]):.1f} %"),
        ("NEES", f"{nees.mean():.2f} on average, {d} if the deviations are right"),
    ]
    several = sensors[scored] > 1
    if several.any() and not several.all():
        rows.insert(
            1,
            (
                f"The same by sensors {what}",
                f"{_rms(error[several]):.2f} m RMSE where two or more report, {_rms(error[~several]):.2f} m where one",
            ),
        )
    return rows


def _rms(values: Array) -> float:
    return math.sqrt(float(np.mean(values**2)))


def _write_dataset(path: Path, outcome: BearingOutcome, config: str) -> None:
    import xarray as xr

    estimates, tracked = outcome.estimates, outcome.tracked
    each = np.repeat(np.arange(len(tracked.times_s)), np.diff(tracked.first))
    units = "m, m/s, then m, m/s of the height, m/s^2, rad/s and shares of a bias where there are any"
    dataset = xr.Dataset(
        {
            "state": (("time", "component"), estimates.states, {"units": units}),
            "covariance": (("time", "component", "component2"), estimates.covariances),
            "told": ("time", tracked.told),
            "bearing_time": ("bearing", tracked.times_s[each], {"units": "s"}),
            "sensor": ("bearing", np.array(tracked.names)[tracked.sensor].astype("U")),
            "azimuth": ("bearing", np.rad2deg(tracked.azimuth_rad), {"units": "degrees clockwise from north"}),
            "residual": ("bearing", tracked.residual_deg, {"units": "degrees"}),
        },
        coords={
            "time": ("time", estimates.times_s, {"units": "s"}),
            "component": list(estimates.names),
            "component2": list(estimates.names),
        },
        attrs={"title": tracked.title, "config": config},
    )
    write_netcdf(path, dataset)
