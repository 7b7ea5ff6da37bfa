"""A camera's stand-in: a process that writes frames of a drifting scene with a moving point into a folder.

python -m tests.frame_writer FOLDER FRAMES RATE_HZ
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

ROWS, COLUMNS = 256, 320


def frames(count: int, rows: int = ROWS, columns: int = COLUMNS) -> Iterator[NDArray[np.uint8]]:
    """Yield frames of 8 bits: a smooth scene that creeps, noise of 2 grey levels, a point of 25 that crosses it."""
    rng = np.random.default_rng(0)
    wide = np.cumsum(np.cumsum(rng.normal(0, 1, (rows, columns + count)), axis=0), axis=1)
    wide = 60 + 100 * (wide - wide.min()) / np.ptp(wide)
    noise = rng.normal(0, 2, (8, rows, columns))
    y, x = np.mgrid[:rows, :columns]
    for k in range(count):
        at_x, at_y = 20 + 0.8 * k % (columns - 40), rows / 2 + 20 * np.sin(k / 40)
        spot = 25 * np.exp(-((y - at_y) ** 2 + (x - at_x) ** 2) / 2)
        drifted = wide[:, k // 20 : k // 20 + columns]
        seen = np.roll(noise[k % 8], int(rng.integers(rows)), axis=0)
        yield np.clip(np.rint(drifted + seen + spot), 0, 255).astype(np.uint8)


def write(folder: Path, count: int, rate_hz: float) -> None:
    """Write so many frames at a steady rate, each at its time, with names that are numbered without zeros."""
    start_s = time.monotonic()
    for k, pixels in enumerate(frames(count)):
        time.sleep(max(0.0, start_s + k / rate_hz - time.monotonic()))
        beside = folder / f".frame{k}.png"
        Image.fromarray(pixels).save(beside, compress_level=1)
        os.replace(beside, folder / f"frame{k}.png")


if __name__ == "__main__":
    write(Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]))
