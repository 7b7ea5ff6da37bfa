"""Recorded frames in memory, no more of them than a page can keep."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.checks import broken
from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io import Truth, open_frames, read_truth
from elusive.systems.images.checks import FrameChecks
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.simulate import VALUES_AT_MOST

# read without a decoder of another program, and without a container that can hold anything else
KINDS = (".npy", ".npz", ".tif", ".tiff", ".gif")
LOOKED_AT = 64  # frames, for the order of their axes
TRUTHS = (".txt", ".csv")


class Recorded(NamedTuple):
    """A recording."""

    frames: Array  # (T, rows, columns)
    rate_hz: float | None
    remarks: tuple[str, ...] = ()  # what of it looks as if it were meant otherwise


def read_frames(path: Path) -> Recorded:
    """Read all frames.

    Raises
    ------
    DataError
        If they cannot be read, or are more than a page keeps.
    """
    source = open_frames(path)
    most = VALUES_AT_MOST // (source.shape[0] * source.shape[1])
    kept: list[Array] = []
    for frame in source:
        if len(kept) == most:
            raise DataError(
                f"{path}: has more than {most} frames of {source.shape[1]} x {source.shape[0]} pixels, too many for a "
                "page; cut it, or track it with elusive track images."
            )
        kept.append(frame)
    return Recorded(np.stack(kept), source.rate_hz, _remarks(kept))


def _remarks(frames: list[Array]) -> tuple[str, ...]:
    """Say whether time looks like one of a frame's own axes."""
    try:
        checks = FrameChecks(ImageTracking().bind(frames[0].shape))
    except DataError:  # too small for what a run assumes, which it will say
        return ()
    for frame in frames[:LOOKED_AT]:
        checks.add(frame)
    return tuple(f"{one.sentence} {one.remedy}" for one in broken(checks.findings()) if one.name == "frames.axes")


def read_places(path: Path) -> Truth:
    """Read where targets truly are [px]."""
    return read_truth(path, "px")
