"""Rows and columns of a sensor that are dead, or far off in level: lines that differ from both sides all along.

No source; an own test, of a single frame. They keep their place while the scene goes by, and would hold a registration
there; unlike what a camera draws they have noise. Nothing in a scene is a line from edge to edge along the sensor, but
for a mast or a wire, and to see past that does no harm.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive.preprocess._scale_kernels import Image

SAMPLES, RANKED = 48, 3000  # of a line, from which it is judged; of the frame
WIDE_PX = 2  # lines side by side that may be dead
ALONG = 0.75  # share of a line that differs from both sides by more ...
FACTOR, TAIL = 2.0, 0.95  # ... than so many times what this share of the frame does


def without_dead_lines(image: Image) -> Image:
    """Fill rows and columns that differ from both sides all along, ``(rows, columns)``, from beside them."""
    columns, rows = dead_lines(image.T), dead_lines(image)
    if not len(rows) and not len(columns):
        return image
    whole = image.copy()
    for lines, dead in ((whole, rows), (whole.T, columns)):
        alive = np.setdiff1d(np.arange(len(lines)), dead)
        after = np.searchsorted(alive, dead)
        below, above = alive[after - 1], alive[after]
        part = ((dead - below) / (above - below)).astype(np.float32)[:, None]
        lines[dead] = (1 - part) * lines[below] + part * lines[above]
    return whole


def dead_lines(image: Image) -> NDArray[np.intp]:
    """Return the numbers of the dead rows, none of which is at the edge."""
    some = image[:, :: max(1, image.shape[1] // SAMPLES)].copy(order="K")
    before, middle, after = some[: -2 * WIDE_PX], some[WIDE_PX:-WIDE_PX], some[2 * WIDE_PX :]
    differs = np.minimum(np.abs(middle - before), np.abs(middle - after))
    sample = differs.ravel()[:: max(1, differs.size // RANKED) | 1]
    usual = np.partition(sample, int(TAIL * len(sample)))[int(TAIL * len(sample))]
    # where both sides differ by more, as at a margin, it may be what lies between
    along = (differs > FACTOR * usual) & (np.abs(after - before) < differs)
    least = differs.shape[1] - int((1 - ALONG) * differs.shape[1])
    return np.flatnonzero(np.count_nonzero(along, axis=1) >= least) + WIDE_PX
