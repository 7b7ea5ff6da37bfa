"""What a sequence of frames is, by its first ones, before it is tracked."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from itertools import islice
from pathlib import Path

from elusive.checks import Looked
from elusive.io import open_frames
from elusive.systems.images.checks import order_finding
from elusive.systems.images.frame_facts import FrameFacts

FRAMES = 33  # looked at: axes are compared at the 2nd, 3rd, 5th, 9th, 17th and 33rd


def look(path: Path, given: Mapping[str, str | bool]) -> Looked:
    """Look at a recording's first frames: their number and size, the order of axes, the last of them as a picture.

    Raises
    ------
    DataError
        If it cannot be read.
    """
    frames = open_frames(path)
    facts, seen = FrameFacts(), None
    with closing(iter(frames)) as every:  # type: ignore[type-var]
        for frame in islice(every, FRAMES):
            if frame is not None:
                facts.look(frame)
                seen = frame
    rows, columns = frames.shape
    many = "Frames" if frames.length is None else f"{frames.length} frames"
    rate = "" if frames.rate_hz is None else f", {frames.rate_hz:g} a second"
    count = facts.count if frames.length is None else frames.length
    return Looked(f"{many} of {columns} x {rows} pixels{rate}.", (order_finding(facts, count),), seen)
