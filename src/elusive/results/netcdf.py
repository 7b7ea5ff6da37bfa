"""Tracks as netCDF: the contiguous ragged array of the CF conventions (1.11, section 9.3.3, appendix H.4.3).

Dimension ``track`` with ``row_size`` rows each, ``obs`` with all rows, track after track, and ``step`` with the times
of all steps, with tracks or without. Any tool that reads netCDF 4 reads it; xarray does with its engine h5netcdf.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive.io.atomic import atomic_path
from elusive.io.netcdf_files import new_netcdf
from elusive.results.log import TrackLog
from elusive.results.table import STATUSES, Columns

ROWS_AT_ONCE = 1 << 16
UNITS = {"m": "m", "mps": "m s-1", "s": "s", "deg": "degree", "degps": "degree s-1", "hz": "Hz", "db": "dB"}
GEOGRAPHIC = {"lon_deg": ("longitude", "degrees_east"), "lat_deg": ("latitude", "degrees_north")}
Variable = tuple[tuple[str, ...], NDArray[Any], Mapping[str, Any]]  # dimensions, values, attributes


def write_result(
    path: str | os.PathLike[str],
    log: TrackLog,
    *,
    title: str,
    config: str,
    more: Mapping[str, Variable] | None = None,
    timed: bool = True,
) -> None:
    """Write the tracks of a log, whole or not at all; the same log gives the same bytes.

    Parameters
    ----------
    path
        File to write.
    log
        What to write.
    title, config
        Global attributes: the recording, and what repeats the run.
    more
        What the system adds: by name its dimensions, values and attributes.
    timed
        Whether times are seconds; else they count frames, and have no unit.

    Raises
    ------
    DataError
        If the file cannot be written.
    """
    found, columns = log.by_track(), log.columns
    with atomic_path(path) as temporary, new_netcdf(temporary) as file:
        file.attrs.update(
            {
                "Conventions": "CF-1.11",
                "featureType": "trajectory",
                "title": title,
                "source": "elusive",
                "config": config,
            }
        )
        k = len(columns.axes)
        sizes = {"track": len(found.numbers), "obs": len(found.rows), "step": len(log.steps), "axis": k, "axis_2": k}
        for dimension, size in sizes.items():
            file.dimensions[dimension] = size
        whole: dict[str, Variable] = {
            "track": (("track",), found.numbers, {"cf_role": "trajectory_id", "long_name": "number of the track"}),
            "row_size": (("track",), found.sizes, {"sample_dimension": "obs", "long_name": "rows of the track"}),
            "step_time": (("step",), log.times_s, {"units": "s" if timed else "1", "long_name": "time of the step"}),
            **{
                f"step_{name}": (("step",), log.steps[name], {"long_name": name, **_units(name)})
                for name in log.step_values
            },
            **(more or {}),
        }
        for name, (dimensions, values, attributes) in whole.items():
            for dimension, size in zip(dimensions, values.shape, strict=True):
                if dimension not in file.dimensions:
                    file.dimensions[dimension] = size
            file.create_variable(name, dimensions, values.dtype, data=values).attrs.update(attributes)
        for name, dimensions, dtype, attributes in _described(columns):
            file.create_variable(name, dimensions, dtype).attrs.update(attributes)
        for start in range(0, len(found.rows), ROWS_AT_ONCE):
            rows = found.rows[start : start + ROWS_AT_ONCE]
            for name, values in _values(columns, rows):
                file[name][start : start + len(rows)] = values


def _described(columns: Columns) -> Iterator[tuple[str, tuple[str, ...], Any, dict[str, Any]]]:
    """Yield name, dimensions, type and attributes of each variable of a row."""
    place, speed, square = {"m": ("m", "m s-1", "m2")}.get(columns.unit, ("1", "s-1", "1"))
    u = columns.unit
    yield "obs_step", ("obs",), np.int64, {"long_name": "number of the step, from 0"}
    yield "time", ("obs",), np.float64, {"units": "s", "long_name": "time of the row", "axis": "T"}
    status = {"flag_values": np.arange(len(STATUSES), dtype=np.int8), "flag_meanings": " ".join(STATUSES)}
    yield "status", ("obs",), np.int8, {"long_name": "status of the track", **status}
    # what is told of recordings, which have a column `moves`, is learnt from what became of their tracks
    learnt = "how often tracks of this recording that were believed as much were there again"
    exists = learnt if "moves" in columns.added else "posterior probability that the target exists"
    yield "existence", ("obs",), np.float64, {"units": "1", "long_name": exists}
    at = {"coordinates": "time"}
    for axis in columns.axes:
        yield axis, ("obs",), np.float64, {"units": place, "long_name": f"{axis} in {u}", **at}
        yield f"v{axis}", ("obs",), np.float64, {"units": speed, "long_name": f"velocity along {axis} in {u} a second"}
    meaning = f"covariance of the position, axes {' '.join(columns.axes)}, in {u} squared"
    yield "position_covariance", ("obs", "axis", "axis_2"), np.float64, {"units": square, "long_name": meaning}
    for name in columns.added:
        yield name, ("obs",), np.float64, {"long_name": name, **_units(name)}


def _values(columns: Columns, rows: NDArray[Any]) -> Iterator[tuple[str, NDArray[Any]]]:
    yield from (("obs_step", rows["step"]), ("time", rows["time_s"]))
    yield from ((name, rows[name]) for name in ("status", "existence"))
    for k, axis in enumerate(columns.axes):
        yield from ((axis, rows["position"][:, k]), (f"v{axis}", rows["velocity"][:, k]))
    yield "position_covariance", rows["covariance"]
    yield from ((name, rows["added"][:, k]) for k, name in enumerate(columns.added))


def _units(name: str) -> dict[str, str]:
    """Take the unit from a name; without one it is a bare number."""
    if name in GEOGRAPHIC:
        standard, units = GEOGRAPHIC[name]
        return {"standard_name": standard, "units": units}
    return {"units": UNITS.get(name.rpartition("_")[2], "1") if "_" in name else "1"}
