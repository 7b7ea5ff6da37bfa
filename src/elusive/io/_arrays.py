"""Frames from arrays: .npy by memory map, .npz streamed from the archive, HDF5 one frame at a time."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from elusive.errors import DataError
from elusive.io._order import natural_key
from elusive.io._stack import Stack, check_same, checked_times, decoding, layout

CLOCKS = ("time_s", "times_s", "time")  # arrays beside the frames that hold their times [s]
SAVE_AGAIN = "save it again with numpy.save, without pickled objects."
ZIP_AGAIN = "save it again with numpy.savez, without pickled objects."
SPOKES = "azimuth_deg"  # in an archive of radar video, which is no sequence of frames
CHECK_HDF5 = "check that it is a complete HDF5 file, closed by its writer, and that h5py has its compression filter."


def open_npy(path: Path) -> Stack:
    """Map a .npy file; a frame is copied when it is read."""
    with decoding(str(path), SAVE_AGAIN):
        array = np.lib.format.open_memmap(path, mode="r")
    length, shape = layout(array.shape, array.dtype, str(path))

    def read(start: int, stop: int | None) -> Iterator[tuple[str, Any]]:
        with decoding(str(path), SAVE_AGAIN):
            array = np.lib.format.open_memmap(path, mode="r")
        for k in range(start, length if stop is None else stop):
            where = f"{path}, frame {k}"
            with decoding(where, SAVE_AGAIN):
                raw = array[k]
            yield where, raw

    return Stack(str(path), shape, length, None, read)


class ArrayHeader(NamedTuple):
    shape: tuple[int, ...]
    fortran: bool
    dtype: np.dtype[Any]


def array_header(file: IO[bytes]) -> ArrayHeader:
    version = np.lib.format.read_magic(file)
    if version == (1, 0):
        return ArrayHeader(*np.lib.format.read_array_header_1_0(file))
    if version == (2, 0):
        return ArrayHeader(*np.lib.format.read_array_header_2_0(file))
    raise ValueError(f"version {version} of the .npy format is of structured arrays")


def open_npz(path: Path, dataset: str | None) -> Stack:
    """Stream one (T, rows, cols) array of a .npz archive, or take its 2-D arrays as frames in natural order.

    An array stored in Fortran order has time running fastest, so it alone is held in memory whole.
    """
    with decoding(str(path), ZIP_AGAIN), zipfile.ZipFile(path) as archive:
        headers: dict[str, ArrayHeader] = {}
        for entry in archive.namelist():
            if not entry.endswith(".npy"):
                raise DataError(f"{path}: holds {entry!r:.80}, which is no array; {ZIP_AGAIN}")
            with archive.open(entry) as file:
                headers[entry.removesuffix(".npy")] = array_header(file)
    if dataset is not None and dataset not in headers:
        raise DataError(f"{path}: holds no array {dataset!r}; it holds {', '.join(headers) or 'none'}.")
    if dataset is None and SPOKES in headers:
        raise DataError(f"{path}: holds {SPOKES}, as radar video does; track that with `elusive track video`.")
    stacks = [name for name, header in headers.items() if len(header.shape) in (3, 4)]
    planes = sorted((name for name, header in headers.items() if len(header.shape) == 2), key=natural_key)
    if dataset is None and not stacks and planes:
        return _npz_of_planes(path, planes, headers)
    name = dataset if dataset is not None else only(stacks, str(path))
    header = headers[name]
    length, shape = layout(header.shape, header.dtype, f"{path}, array {name!r}")
    times = None
    if (clock := next((clock for clock in CLOCKS if clock in headers), None)) is not None:
        with decoding(str(path), ZIP_AGAIN), np.load(path) as arrays:
            times = checked_times(arrays[clock], length, f"{path}, array {clock!r}")

    def read(start: int, stop: int | None) -> Iterator[tuple[str, Any]]:
        with ExitStack() as stack:
            with decoding(str(path), ZIP_AGAIN):
                file = stack.enter_context(stack.enter_context(zipfile.ZipFile(path)).open(f"{name}.npy"))
                array_header(file)
                size = math.prod(header.shape[1:]) * header.dtype.itemsize
                whole = read_array(file, header, header.shape) if header.fortran else None
                if whole is None:
                    file.seek(start * size, 1)
            for k in range(start, length if stop is None else stop):
                where = f"{path}, array {name!r}, frame {k}"
                with decoding(where, ZIP_AGAIN):
                    raw = whole[k] if whole is not None else read_array(file, header, header.shape[1:])
                yield where, raw

    return Stack(str(path), shape, length, None, read, times)


def _npz_of_planes(path: Path, names: list[str], headers: dict[str, ArrayHeader]) -> Stack:
    sizes = [layout((1, *headers[name].shape), headers[name].dtype, f"{path}, array {name!r}")[1] for name in names]

    def read(start: int, stop: int | None) -> Iterator[tuple[str, Any]]:
        for k in range(start, len(names) if stop is None else stop):
            where = f"{path}, array {names[k]!r} (frame {k})"
            check_same(sizes[k], sizes[0], where)
            with (
                decoding(where, ZIP_AGAIN),
                zipfile.ZipFile(path) as archive,
                archive.open(f"{names[k]}.npy") as file,
            ):
                header = array_header(file)
                raw = read_array(file, header, header.shape)
            yield where, raw

    return Stack(str(path), sizes[0], len(names), None, read)


def read_array(file: IO[bytes], header: ArrayHeader, shape: tuple[int, ...]) -> np.ndarray[Any, Any]:
    size = math.prod(shape) * header.dtype.itemsize
    data = file.read(size)
    if len(data) < size:
        raise ValueError(f"the array ends {size - len(data)} bytes early")
    return np.frombuffer(data, header.dtype).reshape(shape, order="F" if header.fortran else "C")


def open_hdf5(path: Path, dataset: str | None) -> Stack:
    """Read one (T, rows, cols) dataset of an HDF5 file, a frame at a time."""
    import h5py

    with decoding(str(path), CHECK_HDF5), h5py.File(path, "r") as file:
        name = dataset if dataset is not None else only(_stacks_in(file), str(path))
        found = file.get(name)
        if not isinstance(found, h5py.Dataset):
            held = ", ".join(_stacks_in(file)) or "none"
            raise DataError(f"{path}: holds no dataset {name!r}; its 3-D datasets are: {held}.")
        length, shape = layout(found.shape or (), found.dtype, f"{path}::{name}")
        beside = (found.parent.get(clock) for clock in CLOCKS)
        clock = next((one for one in beside if isinstance(one, h5py.Dataset) and _in_seconds(one)), None)
        times = None if clock is None else checked_times(clock[()], length, f"{path}::{clock.name}")

    def read(start: int, stop: int | None) -> Iterator[tuple[str, Any]]:
        with ExitStack() as stack:
            with decoding(str(path), CHECK_HDF5):
                frames = stack.enter_context(h5py.File(path, "r"))[name]
            for k in range(start, length if stop is None else stop):
                where = f"{path}::{name}, frame {k}"
                with decoding(where, CHECK_HDF5):
                    raw = frames[k]
                yield where, raw

    return Stack(f"{path}::{name}", shape, length, None, read, times)


def _in_seconds(clock: Any) -> bool:
    """Whether a variable named time counts seconds, also since a date, as the CF conventions have it."""
    units = clock.attrs.get("units", "s")
    words = (units.decode() if isinstance(units, bytes) else str(units)).split()
    return bool(words) and words[0] in ("s", "sec", "second", "seconds")


def _stacks_in(file: Any) -> list[str]:
    found: list[str] = []

    def visit(name: str, item: Any) -> None:
        if len(getattr(item, "shape", None) or ()) in (3, 4):
            found.append(f"/{name}")

    file.visititems(visit)
    return found


def only(names: list[str], where: str) -> str:
    """Return the one name there is; refuse none and several."""
    if len(names) == 1:
        return names[0]
    if not names:
        raise DataError(f"{where}: holds no array (T, rows, cols); save the frames as one 3-D array.")
    raise DataError(f"{where}: holds several 3-D arrays ({', '.join(names)}); say which with dataset=.")
