"""The columns that a track has at a time, by the names of the states: their units, their cells, their sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.results.spool import Records
from elusive.tracking.track import Status, Step, Track

Unit = Literal["m", "px", "samples"]
SPEEDS = {"m": "mps", "px": "pxps", "samples": "samplesps"}
STATUSES: tuple[Status, ...] = ("candidate", "confirmed", "deleted")
CONFIRMED, DELETED = 1, 2  # of them, as rows number them
HEAD = ("time_s", "track", "status", "existence")


class Columns(NamedTuple):
    """What a table of tracks holds.

    Rows are records with ``step`` (number of the step, from 0), ``time_s``, ``track``, ``status`` (a number among
    STATUSES), ``existence``, ``position`` (k,), ``velocity`` (k,), ``covariance`` (k, k) of the position and ``added``.
    """

    state_names: tuple[str, ...]
    unit: Unit
    added: tuple[str, ...] = ()  # names with units; "score" is the track's own, others come from its ``extra``

    @property
    def axes(self) -> tuple[str, ...]:
        """Those of x, y, z that the states have."""
        return tuple(name for name in self.state_names if name in ("x", "y", "z"))

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of a row."""
        k = len(self.axes)
        numbers = (("position", (k,)), ("velocity", (k,)), ("covariance", (k, k)), ("added", (len(self.added),)))
        head = [("step", np.int64), ("time_s", np.float64), ("track", np.int64), ("status", np.int8)]
        return np.dtype([*head, ("existence", np.float64), *((name, np.float64, shape) for name, shape in numbers)])

    @property
    def names(self) -> tuple[str, ...]:
        """The head of the table; a third axis stands among what is added."""
        u, speed = self.unit, SPEEDS[self.unit]
        flat = [axis for axis in self.axes if axis != "z"]
        return (
            *HEAD,
            *(f"{axis}_{u}" for axis in flat),
            *(f"v{axis}_{speed}" for axis in flat),
            *(f"sd_{axis}_{u}" for axis in flat),
            *(("correlation_xy",) if "y" in flat else ()),
            *((f"z_{u}", f"vz_{speed}", f"sd_z_{u}") if "z" in self.axes else ()),
            *self.added,
        )

    def checked(self) -> Columns:
        """Refuse names and units that make no table.

        Raises
        ------
        ParameterError
            If so.
        """
        if self.unit not in SPEEDS:
            raise ParameterError(f"unit={self.unit!r}: tracks are in {', '.join(SPEEDS)}.")
        if "x" not in self.axes or len(set(self.names)) < len(self.names):
            raise ParameterError(f"tracks: states {self.state_names} and {self.added} do not make a table; name an x.")
        return self

    def rows(self, step: Step, number: int) -> Records:
        """Lay the tracks of a step out as rows.

        Raises
        ------
        DataError
            If a track contradicts itself.
        """
        at = [self.state_names.index(axis) for axis in self.axes]
        tracks, known = step.tracks, set(self.added)
        rows = np.empty(len(tracks), self.dtype)
        if not tracks:
            return rows
        for track in tracks:
            fault = _fault(track, len(self.state_names), known)
            if fault:
                raise DataError(f"track {track.track} at {step.time_s:g} s: {fault}.")
        mean, covariance = np.array([track.mean for track in tracks]), np.array([track.covariance for track in tracks])
        for wrong, fault in _misplaced(mean, covariance, at):
            if wrong.any():
                raise DataError(f"track {tracks[int(wrong.argmax())].track} at {step.time_s:g} s: {fault}.")
        rows["step"], rows["time_s"] = number, step.time_s
        rows["track"] = [track.track for track in tracks]
        rows["status"] = [STATUSES.index(track.status) for track in tracks]
        rows["existence"] = [track.existence for track in tracks]
        rows["position"], rows["covariance"] = mean[:, at], covariance[:, at][:, :, at]
        for k, axis in enumerate(self.axes):
            speed = f"v{axis}"
            rows["velocity"][:, k] = mean[:, self.state_names.index(speed)] if speed in self.state_names else math.nan
        for k, name in enumerate(self.added):
            rows["added"][:, k] = [
                track.score if name == "score" else track.extra.get(name, math.nan) for track in tracks
            ]
        if len({track.track for track in step.tracks}) < len(rows):
            raise DataError(f"tracks at {step.time_s:g} s: a number is there twice; give each target its own.")
        return rows

    def cells(self, rows: Records) -> Iterator[list[Any]]:
        """Give rows by their columns' ``names``; what is not known is None, which the csv module leaves empty."""
        deviation, correlation = spread(rows["covariance"])
        flat = [k for k, axis in enumerate(self.axes) if axis != "z"]
        parts = [rows["position"][:, flat], rows["velocity"][:, flat], deviation[:, flat]]
        if "y" in self.axes:
            parts.append(correlation[:, None])
        if "z" in self.axes:
            z = self.axes.index("z")
            parts.append(np.column_stack([rows["position"][:, z], rows["velocity"][:, z], deviation[:, z]]))
        numbers = np.column_stack([rows["existence"], *parts, rows["added"]])
        known = numbers.astype(object)
        known[np.isnan(numbers)] = None
        head = zip(rows["time_s"].tolist(), rows["track"].tolist(), rows["status"].tolist(), strict=True)
        for (time_s, track, status), values in zip(head, known.tolist(), strict=True):
            yield [time_s, track, STATUSES[status], *values]


def spread(covariance: Array) -> tuple[Array, Array]:
    """Return deviations ``(n, k)`` and the correlation of the first two axes ``(n,)``, NaN where there is none."""
    deviation = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0))
    if covariance.shape[1] < 2:
        return deviation, np.full(len(covariance), np.nan)
    product = deviation[:, 0] * deviation[:, 1]
    return deviation, np.divide(covariance[:, 0, 1], product, out=np.full(len(product), np.nan), where=product > 0)


def columns_of(header: Sequence[str]) -> Columns | None:
    """Find the columns by their names; None where they are none of a table of tracks."""
    for unit in SPEEDS:
        for axes in ("x", "xy", "xyz"):
            bare = Columns(tuple(name for axis in axes for name in (axis, f"v{axis}")), unit)  # type: ignore[arg-type]
            if tuple(header[: len(bare.names)]) == bare.names and f"z_{unit}" not in header[len(bare.names) :]:
                return bare._replace(added=tuple(header[len(bare.names) :]))
    return None


def _fault(track: Track, d: int, added: set[str]) -> str | None:
    """Say how a track contradicts itself, or None."""
    mean, covariance = track.mean, track.covariance
    if track.track < 1:
        return "its number is below 1; count from 1"
    if not (math.isnan(track.existence) or 0.0 <= track.existence <= 1.0):
        return f"has the existence {track.existence}; a probability is from 0 to 1, NaN where it is not known"
    if mean.shape != (d,) or covariance.shape != (d, d):
        return f"has a mean of shape {mean.shape} and a covariance of {covariance.shape} for {d} names of states"
    if not track.extra.keys() <= added:
        return f"has {', '.join(sorted(track.extra.keys() - added))}, which the log was not told of"
    return None


def _misplaced(mean: Array, covariance: Array, places: list[int]) -> Iterator[tuple[NDArray[np.bool_], str]]:
    """Yield which of the tracks have means ``(n, d)`` and covariances ``(n, d, d)`` that are none, and how."""
    lost = np.isnan(mean[:, places]).any(axis=1) | np.isinf(mean).any(axis=1) | np.isinf(covariance).any(axis=(1, 2))
    yield np.asarray(lost), "has no finite place; leave out targets whose place is not known"
    yield np.asarray((np.diagonal(covariance, axis1=1, axis2=2) < 0).any(axis=1)), "has a negative variance"
