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
from elusive.systems.images.recurrent import SeveralState
from elusive.systems.images.report import Tracked

LIVING = ("candidate", "confirmed")


class FrameTrack(NamedTuple):
    """What is known of one track after a frame, in pixels and pixels a frame.

    Of several tracks it is the first one, ``others`` the rest.
    """

    existence: float
    mean: Array  # (d,) given presence
    covariance: Array  # (d, d) given presence, NaN where it is not known
    track: int | None
    status: str
    quantiles: Array | None = None  # of the whitened pixels at LEVELS [noise deviations], where frames are whitened
    others: tuple[FrameTrack, ...] | None = None  # None from a filter that follows one target alone


def several_tracks(state: SeveralState) -> FrameTrack:
    """Lay the tracks out that are known after a frame, the oldest confirmed one first."""
    seen = state.whitener.output
    quantiles = None if seen is None else seen.quantiles[0]
    unknown = np.full((4, 4), np.nan)
    order = {"confirmed": 0, "candidate": 1, "deleted": 2}
    tracks = []
    for track, existence in sorted(
        zip(state.tracks, state.existences, strict=True), key=lambda pair: (order[pair[0].status], pair[0].track)
    ):
        (x, y), (vx, vy) = track.position, track.velocity
        tracks.append(FrameTrack(existence, np.array([x, vx, y, vy]), unknown, track.track, track.status))
    first, *others = tracks or [FrameTrack(state.existence, state.mean, unknown, None, "none")]
    return first._replace(quantiles=quantiles, others=tuple(others))


def row_of(result: FrameTrack, time_s: float, rate_hz: float | None) -> TrackRow:
    """Lay a result out as a row of the table; speeds are a second where the rate is known, else a frame."""
    if result.track is None:
        return TrackRow(time_s, None, "none", result.existence)
    rate = 1.0 if rate_hz is None else rate_hz
    x, y = result.mean[[X, Y]]
    vx, vy = rate * result.mean[[VX, VY]]
    sd_x, sd_y = np.sqrt(np.maximum(np.diag(result.covariance)[[X, Y]], 0.0))
    return TrackRow(time_s, result.track, result.status, result.existence, *map(float, (x, y, vx, vy, sd_x, sd_y)))


def rows_of(result: FrameTrack, time_s: float, rate_hz: float | None) -> list[TrackRow]:
    """Lay a result out as rows of the table, one a track."""
    return [row_of(one, time_s, rate_hz) for one in (result, *(result.others or ()))]


def tracked_of(
    title: str,
    results: Sequence[FrameTrack],
    frames: Sequence[Sequence[TrackRow]],
    shape: tuple[int, int],
    rate_hz: float | None,
    truth: Array | None,
) -> Tracked:
    """Gather a table of tracks, the rows of each frame, for the report."""
    rows = [first for first, *_ in frames]
    several = any(result.others is not None for result in results)
    living = np.array([row.status in LIVING for row in rows])
    estimate = np.where(living[:, None], [(row.x, row.y) for row in rows], np.nan)
    tracked = Tracked(
        Path(title).name or title,
        np.array([row.time_s for row in rows]),
        "frame" if rate_hz is None else "s",
        np.array([_of_the_living(of_frame) if several else of_frame[0].existence for of_frame in frames]),
        estimate,
        np.where(living[:, None], [(row.sd_x, row.sd_y) for row in rows], np.nan),
        truth,
        shape,
        (),
        tracks=_paths(frames) if several else None,
    )
    return tracked._replace(rows=[*_table(frames, tracked), *_noise(results)])


def _of_the_living(rows: Sequence[TrackRow]) -> float:
    """Highest existence of the tracks that live; NaN where none does."""
    return max((row.existence for row in rows if row.status in LIVING), default=np.nan)


def _paths(frames: Sequence[Sequence[TrackRow]]) -> dict[int, Array]:
    """Path of each track that was ever confirmed, ``(T, 2)``, NaN where it does not live."""
    confirmed = {row.track for rows in frames for row in rows if row.status == "confirmed" and row.track is not None}
    paths = {track: np.full((len(frames), 2), np.nan) for track in sorted(confirmed)}
    for number, rows in enumerate(frames):
        for row in rows:
            if row.track in paths and row.status in LIVING:
                paths[row.track][number] = row.x, row.y
    return paths


def _table(frames: Sequence[Sequence[TrackRow]], tracked: Tracked) -> list[tuple[str, str]]:
    rows = [row for of_frame in frames for row in of_frame]
    confirmed = sorted({row.track for row in rows if row.status == "confirmed" and row.track is not None})
    if tracked.tracks is None:
        there, sign = tracked.existence > 0.5, "P above .5"
    else:
        lives = [np.isfinite(path[:, 0]) for path in tracked.tracks.values()]
        there, sign = np.any([np.zeros(len(frames), dtype=bool), *lives], axis=0), "a track lives"
    table = [
        ("Frames", f"{len(frames)}, {tracked.shape[1]} x {tracked.shape[0]} pixels"),
        ("Is something there?", f"{sign} in {int(there.sum())} of {len(frames)} frames"),
        ("Confirmed tracks", _listed(confirmed)),
    ]
    first = next((row for row in rows if row.status == "confirmed"), None)
    if first is not None:
        when = f"frame {first.time_s:g}" if tracked.time_unit == "frame" else f"{first.time_s:.2f} s"
        table.append(("First confirmed", f"{when}, at x {first.x:.1f}, y {first.y:.1f}"))
    if tracked.truth is not None and tracked.error is not None:
        present = np.isfinite(tracked.truth[:, 0])
        near = there & (tracked.error < 4.0)
        if present.any():
            table.append((f"Found: {sign}, within 4 px", f"{100 * near[present].mean():.0f} % of the frames with it"))
        if (~present).any():
            false = there[~present].mean()
            table.append((f"False: {sign} without it", f"{100 * false:.0f} % of the frames without it"))
        if tracked.tracks:
            away = [np.hypot(*(path - tracked.truth).T) for path in tracked.tracks.values()]
            never = sum(not (apart < 4.0).any() for apart in away)
            table.append(("Confirmed tracks never within 4 px of it", str(never)))
        if np.isfinite(tracked.error).any():
            table.append(("Error where tracked, RMS", f"{np.sqrt(np.nanmean(tracked.error**2)):.2f} px"))
    return table


def _listed(numbers: Sequence[int], most: int = 12) -> str:
    """Write numbers, and how many there are where they are too many to write."""
    shown = ", ".join(map(str, numbers[:most]))
    return f"{len(numbers)}: {shown}, ..." if len(numbers) > most else shown or "none"


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
