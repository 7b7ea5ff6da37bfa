"""What tracking a sequence of frames came to: a result a frame, its row of the table, and what the report says."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from elusive.contracts import VX, VY, Array, X, Y
from elusive.io import TrackRow
from elusive.preprocess.background import LEVELS
from elusive.report import Tracked


class FrameTrack(NamedTuple):
    """What is known after a frame, in pixels and pixels a frame."""

    existence: float
    mean: Array  # (d,) given presence
    covariance: Array  # (d, d) given presence
    track: int | None
    status: str
    quantiles: Array | None = None  # of the whitened pixels at LEVELS [noise deviations], where frames are whitened


def row_of(result: FrameTrack, time_s: float, rate_hz: float | None) -> TrackRow:
    """Lay a result out as a row of the table; speeds are a second where the rate is known, else a frame."""
    if result.track is None:
        return TrackRow(time_s, None, "none", result.existence)
    rate = 1.0 if rate_hz is None else rate_hz
    x, y = result.mean[[X, Y]]
    vx, vy = rate * result.mean[[VX, VY]]
    sd_x, sd_y = np.sqrt(np.maximum(np.diag(result.covariance)[[X, Y]], 0.0))
    return TrackRow(time_s, result.track, result.status, result.existence, *map(float, (x, y, vx, vy, sd_x, sd_y)))


def tracked_of(
    title: str,
    results: Sequence[FrameTrack],
    rows: Sequence[TrackRow],
    shape: tuple[int, int],
    rate_hz: float | None,
    truth: Array | None,
) -> Tracked:
    """Gather a table of tracks for the report."""
    existence = np.array([row.existence for row in rows])
    living = np.array([row.status in ("candidate", "confirmed") for row in rows])
    estimate = np.where(living[:, None], [(row.x, row.y) for row in rows], np.nan)
    tracked = Tracked(
        Path(title).name or title,
        np.array([row.time_s for row in rows]),
        "frame" if rate_hz is None else "s",
        existence,
        estimate,
        np.where(living[:, None], [(row.sd_x, row.sd_y) for row in rows], np.nan),
        truth,
        shape,
        (),
    )
    return tracked._replace(rows=[*_table(rows, tracked), *_noise(results)])


def _table(rows: Sequence[TrackRow], tracked: Tracked) -> list[tuple[str, str]]:
    confirmed = sorted({row.track for row in rows if row.status == "confirmed" and row.track is not None})
    table = [
        ("Frames", f"{len(rows)}, {tracked.shape[1]} x {tracked.shape[0]} pixels"),
        ("Is something there?", f"P above .5 in {int((tracked.existence > 0.5).sum())} of {len(rows)} frames"),
        ("Confirmed tracks", ", ".join(map(str, confirmed)) or "none"),
    ]
    first = next((row for row in rows if row.status == "confirmed"), None)
    if first is not None:
        when = f"frame {first.time_s:g}" if tracked.time_unit == "frame" else f"{first.time_s:.2f} s"
        table.append(("First confirmed", f"{when}, at x {first.x:.1f}, y {first.y:.1f}"))
    if tracked.truth is not None and tracked.error is not None:
        present = np.isfinite(tracked.truth[:, 0])
        near = (tracked.existence > 0.5) & (tracked.error < 4.0)
        if present.any():
            table.append(
                ("Found: P above .5, within 4 px", f"{100 * near[present].mean():.0f} % of the frames with it")
            )
        if (~present).any():
            false = (tracked.existence > 0.5)[~present].mean()
            table.append(("False: P above .5 without it", f"{100 * false:.0f} % of the frames without it"))
        if np.isfinite(tracked.error).any():
            table.append(("Error where tracked, RMS", f"{np.sqrt(np.nanmean(tracked.error**2)):.2f} px"))
    return table


def _noise(results: Sequence[FrameTrack]) -> list[tuple[str, str]]:
    """Say how near the whitened pixels come to the Gaussian they should be."""
    known = [result.quantiles for result in results if result.quantiles is not None]
    if not known:
        return []
    ends = [0, len(LEVELS) // 2, -1]
    found, normal = np.mean(known, axis=0)[ends], ndtri(np.array(LEVELS)[ends])
    levels = " / ".join(f"{100 * level:g}" for level in np.array(LEVELS)[ends])
    values = [" / ".join(f"{value:.1f}" for value in row) for row in (found, normal)]
    return [(f"Whitened pixels at {levels} %", f"{values[0]} (a Gaussian's: {values[1]})")]
