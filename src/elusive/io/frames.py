"""Image sequences of any usual form, read lazily, frame by frame, and checked as they are read."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io._arrays import open_hdf5, open_npy, open_npz
from elusive.io._gif import open_gif
from elusive.io._images import IMAGES, TIFF, find_images, open_images
from elusive.io._order import natural_key
from elusive.io._stack import Stack, check_same
from elusive.io._tiff import open_tiff
from elusive.io._video import open_video
from elusive.io.fill_values import without_fill
from elusive.io.frame_times import TABLE, counted, read_frame_times

HDF5 = (".h5", ".hdf5", ".hdf", ".nc")
VIDEOS = (".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".wmv", ".ts")
NAMED = (".npz", *HDF5)
SUPPORTED = (".npy", *NAMED, *TIFF, ".gif", *VIDEOS)
MOST = 1e150  # of a grey level: what is greater has no finite square
REC_601 = np.array([299.0, 587.0, 114.0])


class BlankFrameError(DataError):
    """A frame that shows nothing; its sentence is not ended."""


@dataclass(frozen=True)
class FrameSource:
    """A sequence of frames, opened afresh at each iteration and never held whole in memory.

    Iterating yields float64 arrays ``(rows, cols)``, each the caller's own. A pixel that was NaN or infinite in the
    file, or holds what stands for none (-9999, say), is NaN: masked. A frame that shows nothing, as while a shutter is
    closed, is ``None``: missing.
    """

    name: str
    shape: tuple[int, int]
    """Rows and columns of every frame."""
    length: int | None
    """Frames that iterating yields; None for a video, whose end alone tells."""
    rate_hz: float | None
    """Frames a second; None where neither the file nor the caller says, or the file has times."""
    start: int
    """Number in the file, from 0, of the first frame yielded."""
    _stack: Stack = field(repr=False)
    _stop: int | None = field(repr=False)

    def __iter__(self) -> Iterator[Array | None]:
        """Yield the frames; ``None`` where more than half of the pixels are NaN or infinite, or all are equal.

        Raises
        ------
        DataError
            If a frame cannot be decoded or differs in size, or none shows anything.
        """
        number, blank, seen = self.start, None, False
        with closing(self._stack.read(self.start, self._stop)) as raws:  # type: ignore[type-var]
            for where, raw in raws:
                frame = None
                try:
                    frame, seen = clean_frame(raw, self.shape, where), True
                except BlankFrameError as error:
                    blank = blank or error
                yield frame
                number += 1
        if number == self.start:
            raise DataError(f"{self.name}: holds no frame from number {self.start} on; choose an earlier start.")
        if blank is not None and not seen:
            raise DataError(f"{blank}; no other of the {number - self.start} frames shows more: check the file.")

    @property
    def whole(self) -> bool:
        """Whether iterating ends where the file does."""
        return self._stop is None or self._stop == self._stack.length

    @property
    def timed(self) -> bool:
        """Whether times are seconds: from the rate, or from the file; else they are the frames' numbers."""
        return self.rate_hz is not None or self._stack.times_s is not None

    @property
    def interval_s(self) -> float:
        """Usual time between frames; 1 s where nothing is known."""
        if self.rate_hz is None and self._stack.times_s is not None and len(self._stack.times_s) > 1:
            return float(np.median(np.diff(self._stack.times_s)))
        return 1.0 if self.rate_hz is None else 1 / self.rate_hz

    def times_s(self) -> Iterator[float]:
        """Yield the times of the frames: the file's own, or counted from its first at the rate."""
        if self._stack.times_s is not None:
            yield from self._stack.times_s[self.start : self._stop].tolist()
        else:
            numbers = count(self.start) if self.length is None else range(self.start, self.start + self.length)
            for number in numbers:
                yield float(number) if self.rate_hz is None else number / self.rate_hz


def open_frames(
    source: str | os.PathLike[str],
    *,
    dataset: str | None = None,
    pattern: str | None = None,
    start: int = 0,
    stop: int | None = None,
    rate_hz: float | None = None,
    times: str | os.PathLike[str] | None = None,
) -> FrameSource:
    """Open an image sequence without reading its frames.

    Parameters
    ----------
    source
        A stack (``.npy``, ``.npz``, multi-page TIFF, HDF5 or netCDF 4), a GIF, a video (extra ``video``), a folder of
        images, or a glob that matches some. Arrays are ``(T, rows, cols)``, in colour ``(T, rows, cols, 3 or 4)``, with
        one channel ``(T, rows, cols, 1)`` or ``(T, 1, rows, cols)``.
        A folder's files are frames in natural order: frame2 before frame10. ``file.h5::/path`` names a dataset too.
        An array ``time_s`` (or ``time``, in seconds) beside the frames holds their times, and so does ``times.csv`` in
        a folder of images, or the DateTime of TIFF pages where no rate is given and no two are of the same second.
    dataset
        Name of the array in an HDF5 or ``.npz`` file that holds several.
    pattern
        Which files of a folder are frames, such as ``"*.png"``.
    start, stop
        First frame, and frame before which to stop, numbered from 0 as in a Python slice.
    rate_hz
        Frames a second, where the file does not say or says wrong.
    times
        CSV of the frames' times, ``time_s``, a line a frame of the file; in place of all others.

    Returns
    -------
    FrameSource
        Colour is turned to grey by Rec. 601 luma (alpha is ignored); 16 bits stay 16 bits.

    Raises
    ------
    DataError
        If there is no such sequence, or its header is broken, or an argument does not fit it.
    """
    text = os.fspath(source)
    stem, separator, inner = text.partition("::")
    if separator and dataset is None and Path(stem).suffix.lower() in NAMED:
        text, dataset = stem, inner
    if start < 0 or (stop is not None and stop <= start):
        raise DataError(f"start={start}, stop={stop}: choose 0 <= start < stop.")
    if rate_hz is not None and not 0 < rate_hz < float("inf"):
        raise DataError(f"rate_hz={rate_hz}: must be a positive number of frames a second.")
    try:
        stack = _open(text, dataset, pattern)
    except OSError as error:
        raise DataError(f"{text}: cannot be opened ({error.strerror}); check the path and its permissions.") from None
    if stack.length is not None and start >= stack.length:
        raise DataError(f"{stack.name}: has {stack.length} frames, numbered from 0; start={start} is past the last.")
    if stack.length is not None:
        stop = stack.length if stop is None else min(stop, stack.length)
    length = None if stack.length is None or stop is None else stop - start
    stack = _timed(stack, Path(text), times, rate_hz)
    rate = stack.rate_hz if rate_hz is None else rate_hz
    return FrameSource(stack.name, stack.shape, length, rate, start, stack, stop)


def _timed(stack: Stack, path: Path, times: str | os.PathLike[str] | None, rate_hz: float | None) -> Stack:
    """Return a stack with its frames' times, where anything tells them."""
    table = times
    if table is None and path.is_dir() and (path / TABLE).is_file():
        table = path / TABLE
    if rate_hz is not None and (table is not None or stack.times_s is not None):
        raise DataError(f"{table or stack.name}: tells the frames' times; leave rate_hz={rate_hz:g} out.")
    if table is not None:
        found = read_frame_times(table)
        if stack.length is not None and len(found) != stack.length:
            raise DataError(f"{table}: has {len(found)} times for {stack.length} frames; give one a frame of the file.")
        return replace(stack, times_s=found, rate_hz=None, read=counted(stack.read, found, str(table), stack.name))
    if rate_hz is None and stack.rate_hz is None and stack.times_s is None:
        return replace(stack, times_s=stack.tagged())
    return stack


def _open(text: str, dataset: str | None, pattern: str | None) -> Stack:
    path = Path(text)
    suffix = path.suffix.lower()
    if dataset is not None and suffix not in NAMED:
        raise DataError(f"{text}: dataset={dataset!r} names an array in {', '.join(NAMED)} files; leave it out here.")
    if pattern is not None and not path.is_dir():
        raise DataError(f"{text}: pattern={pattern!r} chooses files of a folder, and this is none; leave it out.")
    if path.is_dir():
        return open_images(find_images(path, pattern), text)
    if not path.exists():
        if not glob.has_magic(text):
            raise DataError(f"{text}: there is no such file or folder; check the path.")
        matches = [Path(match) for match in glob.glob(text) if Path(match).is_file()]
        if not matches:
            raise DataError(f"{text}: matches no file; check the pattern.")
        return open_images(sorted(matches, key=lambda file: natural_key(str(file))), text)
    if suffix == ".npy":
        return open_npy(path)
    if suffix == ".npz":
        return open_npz(path, dataset)
    if suffix in HDF5:
        return open_hdf5(path, dataset)
    if suffix in TIFF:
        return open_tiff(path)
    if suffix == ".gif":
        return open_gif(path)
    if suffix in VIDEOS:
        return open_video(path)
    if suffix in IMAGES:
        raise DataError(
            f"{text}: is one image, not a sequence; give its folder, or a glob in quotes ('frames/*{suffix}')."
        )
    raise DataError(
        f"{text}: files of type {suffix or '(none)'} are not read; give one of {', '.join(SUPPORTED)}, or a folder of "
        f"images ({', '.join(IMAGES)})."
    )


def clean_frame(raw: Any, shape: tuple[int, int], where: str) -> Array:
    """Return a raw frame as grey float64 of the right size, with NaN for what is not finite or stands for none.

    Raises
    ------
    DataError
        If it differs in size.
    BlankFrameError
        If it has more than half of its pixels NaN or infinite, or has all pixels equal.
    """
    frame = without_fill(_grey(raw, where))
    check_same((frame.shape[0], frame.shape[1]), shape, where)
    masked = ~(np.abs(frame) <= MOST)
    n_masked = np.count_nonzero(masked)
    if 2 * n_masked > frame.size:
        row, col = np.argwhere(masked)[0]
        raise BlankFrameError(
            f"{where}: {n_masked} of {frame.size} pixels are NaN or infinite, the first at row {row}, column {col}"
        )
    frame[masked] = np.nan
    if n_masked == 0:
        low, high = frame.min(), frame.max()
    else:
        low, high = np.nanmin(frame), np.nanmax(frame)
    if low == high:
        raise BlankFrameError(f"{where}: all its pixels are {low:g}, so there is nothing to see in it")
    return frame


def _grey(raw: Any, where: str) -> Array:
    values = np.asarray(raw)
    if values.dtype.kind not in "buif":
        raise DataError(f"{where}: holds {values.dtype} values, not real numbers; save it as a grey image.")
    if values.ndim == 3 and values.shape[2] not in (3, 4) and 1 in (values.shape[0], values.shape[2]):
        values = values[..., 0] if values.shape[2] == 1 else values[0]  # of one channel
    if values.ndim == 2:
        return np.array(values, dtype=np.float64)
    if values.ndim == 3 and values.shape[2] in (3, 4):
        # Weights in thousandths keep whole numbers exact: a grey pixel (v, v, v) gives v and not v - 1e-14.
        luma: Array = values[..., :3].astype(np.float64) @ REC_601 / 1000.0
        return luma
    raise DataError(f"{where}: has shape {values.shape}, which is no grey or colour image; save (rows, cols).")
