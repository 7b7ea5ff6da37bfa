"""A log in whose calibration somebody was: the empty room is learned from all of it, as far as people move about.

What the calibration has shown stays a finding; whoever rests where they are throughout is part of the room learned.
"""

from __future__ import annotations

from itertools import islice

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io.link_logs import LinkLog
from elusive.preprocess.link_calibration import Calibration
from elusive.preprocess.link_presence import BLOCK, emptied
from elusive.sensors.radio_network import RssFrame
from elusive.systems.links.track import LinkTracking

FEWEST_BLOCKS, MOST_BLOCKS = 8, 80  # of the log that the room is learned from


def with_empty_room(log: LinkLog, tracking: LinkTracking) -> tuple[LinkLog, Calibration | None]:
    """Return the log behind frames of the empty room that are learned from it, and the calibration that it has itself.

    None, and the log as it is: nobody seems to have been in it, the log comes once, or is too short.
    """
    if not log.again:
        return log, None
    first = list(islice(log, tracking.calibration_frames))
    try:
        recorded = tracking.calibrate.over(first)
    except DataError:  # tracking says what there is to say
        return log, None
    if not recorded.inside:
        return log, None
    blocks = _blocks(log)
    if len(blocks) < FEWEST_BLOCKS:
        return log, None
    made, step_s = emptied(np.concatenate(blocks), len(first)), (first[-1].time_s - first[0].time_s) / (len(first) - 1)
    frames = [RssFrame(first[0].time_s + step_s * number, level) for number, level in enumerate(made)]
    return log.behind(frames, log.name), recorded


def _blocks(log: LinkLog) -> list[Array]:
    """Return some blocks ``(BLOCK, D, C)`` of successive frames, spread over the log."""
    blocks, every, stream = list[Array](), 1, iter(log)
    for number, frames in enumerate(iter(lambda: list(islice(stream, BLOCK)), [])):
        if number % every or len(frames) < BLOCK:
            continue
        blocks.append(np.array([frame.rss_dbm for frame in frames]))
        if len(blocks) == MOST_BLOCKS:
            blocks, every = blocks[::2], 2 * every
    return blocks
