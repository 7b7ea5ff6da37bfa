"""A recorded signal in memory, no more of it than a page can keep."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io import open_signal
from elusive.systems.signals.scene import VALUES_AT_MOST

KINDS = (".npy", ".wav", ".csv", ".tsv", ".txt")
TRUTHS = (".txt", ".csv")


class Recorded(NamedTuple):
    """A recording."""

    frames: Array  # (T, samples)
    times: Array  # (T,)
    rate_hz: float | None
    timed: bool


def read_recorded(path: Path, frame_samples: int | None, channel: int | None, rate_hz: float | None) -> Recorded:
    """Read all frames.

    Raises
    ------
    DataError
        If they cannot be read, or are more than a page keeps.
    """
    source = open_signal(path, frame_samples=frame_samples, channel=channel, rate_hz=rate_hz)
    most = VALUES_AT_MOST // source.samples
    frames: list[Array] = []
    times: list[float] = []
    for time_s, samples in source:
        if len(frames) == most:
            raise DataError(
                f"{path}: has more than {most} frames of {source.samples} samples, too many for a page; cut it, or "
                "track it with elusive track signal."
            )
        frames.append(samples)
        times.append(time_s)
    return Recorded(np.stack(frames), np.array(times), source.rate_hz, source.timed)
