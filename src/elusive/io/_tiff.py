"""Frames of a multi-page TIFF, one page at a time."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from elusive.errors import DataError
from elusive.io._pillow import open_pillow, pixels
from elusive.io._stack import EXPORT_AGAIN, Stack, check_same, check_size, decoding
from elusive.io.frame_times import tagged_times

SAVE_GREY = "save it as grey pages, uncompressed or deflated."
UNHEARD = logging.NullHandler()
MINISWHITE, MINISBLACK, RGB, YCBCR = 0, 1, 2, 6


def open_tiff(path: Path) -> Stack:
    """Read the pages of a TIFF; an ImageJ stack with one header for all its frames is mapped, its interval believed."""
    tifffile = _tifffile()
    with decoding(str(path), EXPORT_AGAIN), tifffile.TiffFile(path) as tif:
        shape = _shape(tif.pages[0])
        check_size(shape, str(path))
        series = tif.series[0]
        axes = [(axis, n) for axis, n in zip(series.axes, series.shape, strict=True) if axis not in "YXS" and n > 1]
        if len(axes) > 1:
            held = ", ".join(f"{axis} {n}" for axis, n in axes)
            raise DataError(
                f"{path}: has several axes beside rows and columns ({held}); save one sequence of grey frames."
            )
        length = len(tif.pages)
        interval_s = (tif.imagej_metadata or {}).get("finterval")
        rate_hz = 1 / interval_s if isinstance(interval_s, int | float) and interval_s > 0 else None
        mapped: dict[str, Any] | None = None
        if length == 1 and axes:
            length = axes[0][1]
            if series.dataoffset is None:
                raise DataError(f"{path}: holds {length} frames behind one compressed header; {SAVE_GREY}")
            mapped = {
                "dtype": series.dtype.newbyteorder(tif.byteorder),
                "offset": series.dataoffset,
                "shape": (length, *tif.pages[0].shape),
            }
        else:
            _check_chain(tif, path)

    def read(start: int, stop: int | None) -> Iterator[tuple[str, Any]]:
        last = length if stop is None else stop
        if mapped is not None:
            with decoding(str(path), EXPORT_AGAIN):
                frames = np.memmap(path, mode="r", **mapped)
            for k in range(start, last):
                yield f"{path}, frame {k}", frames[k]
            return
        with ExitStack() as stack:
            with decoding(str(path), EXPORT_AGAIN):
                tif = stack.enter_context(tifffile.TiffFile(path))
            for k in range(start, last):
                where = f"{path}, page {k}"
                with decoding(where, EXPORT_AGAIN):
                    raw = _page(tif.pages[k], shape, where, path, k, stack)
                yield where, raw

    def tagged() -> NDArray[np.float64] | None:
        with decoding(str(path), EXPORT_AGAIN), tifffile.TiffFile(path) as tif:
            return tagged_times((f"{path}, page {k}", tif.pages[k]) for k in range(length))

    return Stack(str(path), shape, length, rate_hz, read, tagged=tagged if mapped is None else lambda: None)


def tiff_times(files: list[Path]) -> NDArray[np.float64] | None:
    """Return the times of single pages by their tags, seconds after the first; None where they do not tell."""
    tifffile = _tifffile()

    def pages() -> Iterator[tuple[str, Any]]:
        for file in files:
            with decoding(str(file), EXPORT_AGAIN), tifffile.TiffFile(file) as tif:
                yield str(file), tif.pages[0]

    return tagged_times(pages())


def tiff_shape(path: Path) -> tuple[int, int]:
    """Return the (rows, cols) of the first page."""
    tifffile = _tifffile()
    with decoding(str(path), EXPORT_AGAIN), tifffile.TiffFile(path) as tif:
        return _shape(tif.pages[0])


def read_single_tiff(path: Path, shape: tuple[int, int] | None, where: str) -> np.ndarray[Any, Any]:
    """Read a TIFF that is one frame of a folder; refuse one of several pages."""
    tifffile = _tifffile()
    with tifffile.TiffFile(path) as tif, ExitStack() as stack:
        if len(tif.pages) > 1:
            raise DataError(f"{where}: holds {len(tif.pages)} pages; open this file alone, or keep one page a file.")
        page = tif.pages[0]
        ends = (start + size for start, size in zip(page.dataoffsets, page.databytecounts, strict=True))
        if max(ends, default=0) > tif.filehandle.size:
            raise DataError(f"{where}: is cut short; {EXPORT_AGAIN}")
        found = _shape(page)
        check_size(found, where)
        return _page(page, shape or found, where, path, 0, stack)


def _tifffile() -> Any:
    import tifffile

    # Without a handler, what tifffile logs of a damaged file would reach the terminal beside our sentence.
    logging.getLogger("tifffile").addHandler(UNHEARD)
    return tifffile


def _shape(page: Any) -> tuple[int, int]:
    return int(page.imagelength), int(page.imagewidth)


def _check_chain(tif: Any, path: Path) -> None:
    """Refuse a file whose last page points on: tifffile ends quietly where the chain of pages is cut."""
    sizes, file = tif.tiff, tif.filehandle
    order: Literal["little", "big"] = "little" if tif.byteorder == "<" else "big"
    file.seek(tif.pages[-1].offset)
    entries = int.from_bytes(file.read(sizes.tagnosize), order)
    file.seek(entries * sizes.tagsize, 1)
    following = file.read(sizes.offsetsize)
    if len(following) < sizes.offsetsize or any(following):
        raise DataError(f"{path}: is cut short after page {len(tif.pages) - 1}; copy or export it again.")


def _page(page: Any, shape: tuple[int, int], where: str, path: Path, k: int, stack: ExitStack) -> np.ndarray[Any, Any]:
    check_same(_shape(page), shape, where)
    if page.photometric not in (MINISWHITE, MINISBLACK, RGB, YCBCR):
        raise DataError(f"{where}: its colours are coded as {page.photometric.name}; {SAVE_GREY}")
    try:
        raw: np.ndarray[Any, Any] = page.asarray()
    except (ValueError, KeyError) as error:
        if "imagecodecs" not in str(error):
            raise
        return _page_by_pillow(page, where, path, k, stack)
    if page.axes.startswith("S"):
        raw = np.moveaxis(raw, 0, -1)
    if page.photometric == MINISWHITE and raw.dtype.kind in "bu":
        raw = ~raw if raw.dtype.kind == "b" else (2**page.bitspersample - 1) - raw
    return raw


def _page_by_pillow(page: Any, where: str, path: Path, k: int, stack: ExitStack) -> np.ndarray[Any, Any]:
    """Decode what tifffile alone cannot (LZW, JPEG), where Pillow keeps the depth and the polarity."""
    if page.photometric == MINISWHITE or (page.samplesperpixel > 1 and page.bitspersample > 8):
        raise DataError(
            f"{where}: its {page.compression.name} compression needs the package imagecodecs; or {SAVE_GREY}"
        )
    image = stack.enter_context(open_pillow(stack.enter_context(path.open("rb")), ("TIFF",)))
    image.seek(k)
    return pixels(image)
