"""What every reader of frames hands over, and the checks they share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive.errors import DataError, ElusiveError

MAX_PIXELS = 2**26
EXPORT_AGAIN = "copy or export it again, or leave it out with start and stop."


Reader = Callable[[int, int | None], Iterator[tuple[str, Any]]]  # (start, stop) -> (where, raw frame), one by one


@dataclass(frozen=True)
class Stack:
    """A sequence as a file holds it, before any check of its pixels."""

    name: str
    shape: tuple[int, int]  # rows, cols
    length: int | None  # frames; None where only reading to the end tells
    rate_hz: float | None
    read: Reader
    times_s: NDArray[np.float64] | None = None  # (length,) of the frames, where the file holds times
    tagged: Callable[[], NDArray[np.float64] | None] = lambda: None  # the same by what stands in the frames' headers


def checked_times(times: Any, length: int, where: str) -> NDArray[np.float64]:
    """Return the times of frames that a file holds.

    Raises
    ------
    DataError
        If they are not one for each frame, finite and increasing.
    """
    found = np.asarray(times, dtype=np.float64)
    if found.shape != (length,) or not np.isfinite(found).all() or (np.diff(found) <= 0).any():
        raise DataError(f"{where}: the times are not {length} finite, increasing seconds, one a frame; repair them.")
    return found


@contextmanager
def decoding(where: str, advice: str) -> Iterator[None]:
    """Turn whatever a decoder raises into one sentence: where, why, and the advice."""
    try:
        yield
    except ElusiveError:
        raise
    except Exception as error:  # garbage makes a decoder raise nearly any class: struct, zlib, Syntax, Memory...
        lines = str(getattr(error, "strerror", None) or error).strip().splitlines()
        reason = lines[0][:160].rstrip(".") if lines else type(error).__name__
        raise DataError(f"{where}: cannot be read ({reason}); {advice}") from None


def check_size(shape: tuple[int, int], where: str) -> None:
    """Refuse frames of no pixel, and frames so large that only a broken or hostile header claims them."""
    if shape[0] * shape[1] == 0:
        raise DataError(
            f"{where}: the frames are {shape[0]} x {shape[1]} pixels (rows x cols); there is nothing in them."
        )
    if shape[0] * shape[1] > MAX_PIXELS:
        raise DataError(
            f"{where}: the frames are {shape[0]} x {shape[1]} pixels (rows x cols), more than the {MAX_PIXELS} "
            "that are read; cut out the region of interest."
        )


def check_same(shape: tuple[int, int], first: tuple[int, int], where: str) -> None:
    """Refuse a frame whose size differs from the first one's."""
    if shape != first:
        raise DataError(
            f"{where}: is {shape[0]} x {shape[1]} pixels (rows x cols), but the first frame is {first[0]} x {first[1]}"
            "; all frames must be of one size."
        )


def layout(shape: tuple[int, ...], dtype: np.dtype[Any], where: str) -> tuple[int, tuple[int, int]]:
    """Return the frame count and the frames' (rows, cols) of an array.

    It is ``(T, rows, cols)``, or has 3 or 4 colours last, or one channel, last or before the rows.

    Raises
    ------
    DataError
        If the array is no sequence of numeric frames.
    """
    if dtype.kind not in "buif":
        raise DataError(f"{where}: holds {dtype} values, not real numbers; save a numeric array (T, rows, cols).")
    colour = len(shape) > 2 and shape[-1] in (3, 4)
    if len(shape) == 2 or (len(shape) == 3 and colour):
        raise DataError(f"{where}: holds one image, shape {shape}; a sequence is an array (T, rows, cols).")
    if len(shape) == 4 and 1 in (shape[1], shape[3]) and not colour:
        shape = (shape[0], *(shape[1:3] if shape[3] == 1 else shape[2:]))
    if len(shape) != (4 if colour else 3):
        raise DataError(f"{where}: has {len(shape)} dimensions, shape {shape}; a sequence is an array (T, rows, cols).")
    if shape[0] == 0:
        raise DataError(f"{where}: holds no frame, shape {shape}; a sequence needs at least one.")
    frame = (shape[1], shape[2])
    check_size(frame, where)
    return shape[0], frame
