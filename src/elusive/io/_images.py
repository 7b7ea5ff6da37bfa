"""Frames from a folder or a list of image files, one file a frame."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from elusive.errors import DataError
from elusive.io._order import natural_key
from elusive.io._pillow import open_pillow, pixels
from elusive.io._stack import EXPORT_AGAIN, Stack, check_same, check_size, decoding
from elusive.io._tiff import read_single_tiff, tiff_shape, tiff_times

TIFF = (".tif", ".tiff")
IMAGES = (".png", *TIFF, ".jpg", ".jpeg", ".bmp", ".pgm")
NAMED = 3  # other files of a folder without images
# Named, because Pillow left to guess would hand a hostile file to decoders such as EPS, which runs Ghostscript.
FORMATS = ("PNG", "JPEG", "BMP", "PPM")


def find_images(folder: Path, pattern: str | None) -> list[Path]:
    """Return the images of a folder in natural order; ``pattern`` (``"*.png"``) chooses among them."""
    with decoding(str(folder), "check its permissions."):
        files = [file for file in folder.glob(pattern or "*") if file.is_file() and not file.name.startswith(".")]
    images = sorted((file for file in files if file.suffix.lower() in IMAGES), key=lambda file: natural_key(str(file)))
    if not images:
        sought = f"no image that matches {pattern!r}" if pattern else "no image"
        held = sorted(file.name for file in files)[:NAMED]
        advice = f"it holds {', '.join(held)}: give a recording's own name" if held else "check the folder"
        raise DataError(f"{folder}: holds {sought} (of {', '.join(IMAGES)}); {advice}.")
    kinds = sorted({file.suffix.lower() for file in images})
    if pattern is None and len(kinds) > 1:
        raise DataError(f"{folder}: mixes {' and '.join(kinds)} images; choose with pattern='*{kinds[0]}'.")
    return images


def open_images(files: list[Path], name: str) -> Stack:
    """Read image files in the order given; each is opened when its frame is due."""
    others = [file for file in files if file.suffix.lower() not in IMAGES]
    if others:
        raise DataError(f"{others[0]}: is no image (of {', '.join(IMAGES)}); match images only.")
    shape = _shape(files[0])
    check_size(shape, str(files[0]))

    def read(start: int, stop: int | None) -> Iterator[tuple[str, Any]]:
        for k in range(start, len(files) if stop is None else stop):
            where = f"{files[k]} (frame {k})"
            with decoding(where, EXPORT_AGAIN):
                raw = read_image(files[k], where, shape)
            yield where, raw

    tiff = all(file.suffix.lower() in TIFF for file in files)
    return Stack(name, shape, len(files), None, read, tagged=(lambda: tiff_times(files)) if tiff else lambda: None)


def _shape(path: Path) -> tuple[int, int]:
    if path.suffix.lower() in TIFF:
        return tiff_shape(path)
    with decoding(str(path), EXPORT_AGAIN), path.open("rb") as file, open_pillow(file, FORMATS) as image:
        return image.height, image.width


def read_image(path: Path, where: str, shape: tuple[int, int] | None = None) -> np.ndarray[Any, Any]:
    """Read the one frame of a file, of the shape that is due; the caller puts in words what its decoder raises."""
    if path.suffix.lower() in TIFF:
        return read_single_tiff(path, shape, where)
    data = path.read_bytes()
    with open_pillow(io.BytesIO(data), FORMATS) as image:
        if shape is not None:
            check_same((image.height, image.width), shape, where)
        check_size((image.height, image.width), where)
        if getattr(image, "n_frames", 1) > 1:
            raise DataError(f"{where}: holds {image.n_frames} pictures; keep one picture a file.")  # type: ignore[attr-defined]
        if image.format == "PNG":
            if data[24] == 16 and data[25] != 0:  # bit depth and colour type of the IHDR chunk
                raise DataError(
                    f"{where}: is a 16-bit colour PNG, of which only 8 bits can be read; export 16-bit grey."
                )
            image.verify()  # decoding alone passes over a wrong checksum of the pixels
    with open_pillow(io.BytesIO(data), FORMATS) as image:
        return pixels(image)
