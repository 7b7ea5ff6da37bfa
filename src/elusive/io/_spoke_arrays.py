"""Spokes from arrays of a .npz archive or a netCDF 4 file, some at a time."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.errors import DataError
from elusive.io._arrays import ZIP_AGAIN, array_header, read_array
from elusive.io._spoke_parts import MAX_SAMPLES
from elusive.io._stack import decoding
from elusive.sensors.spokes import Spokes, check_spokes

ZIP, HDF5 = b"PK\x03\x04", b"\x89HDF\r\n\x1a\n"
AMPLITUDE = "amplitude"
TOGETHER = 256  # spokes that are read at once
SMALL = 1 << 28  # octets of the other arrays at most
EVEN = 0.01  # of a step, by which ranges may be uneven
RADIANS_SHORT = 0.05  # rad, by which the azimuths of a turn may fall short of 2 pi: one step of 126 spokes
TURN_S = 0.05, 900.0  # a turn of an antenna takes
UNSIGNED = {1: np.uint8, 2: np.uint16, 4: np.uint32, 8: np.uint32}
NEEDED = "give amplitude (spokes x samples), azimuth_deg, time_s and range_m"

Slices = Callable[[int, int], NDArray[Any]]  # spokes from, to


class _Arrays(NamedTuple):
    shape: tuple[int, int]  # of the amplitude
    amplitude: Slices
    small: dict[str, NDArray[Any]]


def is_arrays(head: bytes) -> bool:
    """Whether a file's first octets are those of an archive or of HDF5, which netCDF 4 is."""
    return head.startswith((ZIP, HDF5))


def spokes_of_arrays(path: Path, rotation_s: float | None) -> Iterator[Spokes]:
    """Yield the spokes that arrays hold; see :mod:`elusive.io.radar_video_arrays` for their names.

    Raises
    ------
    DataError
        If the file cannot be read, an array is missing, or arrays contradict each other.
    """
    with ExitStack() as stack:
        with decoding(str(path), "write it again, without pickled objects."):
            with path.open("rb") as file:
                is_zip = file.read(4) == ZIP
            arrays = _of_zip(path, stack) if is_zip else _of_hdf5(path, stack)
        spokes, samples = arrays.shape
        if not 0 < samples <= MAX_SAMPLES:
            raise DataError(f"{path}: amplitude has {samples} samples a spoke; 1 to {MAX_SAMPLES} are read.")
        start_m, step_m = _scale(arrays.small, samples, path)
        columns = _columns(arrays.small, arrays.shape, rotation_s, path)
        for at in range(0, spokes, TOGETHER):
            with decoding(f"{path}, spoke {at}", "write it again."):
                raw = arrays.amplitude(at, min(at + TOGETHER, spokes))
            part = slice(at, at + TOGETHER)
            amplitude, bits = _unsigned(raw, int(_one(arrays.small, "bits", 0, path)), f"{path}, spoke {at}")
            yield check_spokes(
                Spokes(
                    time_s=columns["time_s"][part],
                    azimuth_rad=np.radians(columns["azimuth_deg"][part] % 360.0) % (2 * math.pi),
                    from_north=bool(_one(arrays.small, "from_north", True, path)),
                    start_m=start_m,
                    step_m=step_m,
                    amplitude=amplitude,
                    bits=bits,
                    heading_rad=np.radians(columns["heading_deg"][part] % 360.0),
                    lonlat_deg=np.column_stack([columns["lon_deg"][part], columns["lat_deg"][part]]),
                ),
                f"{path}, from spoke {at}",
            )


def _of_zip(path: Path, stack: ExitStack) -> _Arrays:
    archive = stack.enter_context(zipfile.ZipFile(path))
    names = [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]
    small = {}
    for name in names:
        with archive.open(f"{name}.npy") as file:
            header = array_header(file)
            size = math.prod(header.shape) * header.dtype.itemsize
            if name == AMPLITUDE:
                shape, kind = header.shape, header
            elif size <= SMALL and header.dtype.kind in "biuf":
                small[name] = read_array(file, header, header.shape)
    if AMPLITUDE not in names:
        raise DataError(f"{path}: holds {', '.join(names) or 'no array'}; {NEEDED}.")
    _check_axes(shape, path)
    if kind.fortran:
        raise DataError(f"{path}: amplitude is stored by columns; {ZIP_AGAIN} Use numpy.ascontiguousarray before.")
    file = stack.enter_context(archive.open(f"{AMPLITUDE}.npy"))
    array_header(file)
    return _Arrays((shape[0], shape[1]), lambda at, to: read_array(file, kind, (to - at, shape[1])), small)


def _of_hdf5(path: Path, stack: ExitStack) -> _Arrays:
    import h5py

    file = stack.enter_context(h5py.File(path, "r"))
    found = file.get(AMPLITUDE)
    if not isinstance(found, h5py.Dataset):
        raise DataError(f"{path}: holds {', '.join(file) or 'no variable'}; {NEEDED}.")
    _check_axes(found.shape or (), path)
    small = {
        name: np.asarray(item[()])
        for name, item in file.items()
        if isinstance(item, h5py.Dataset) and name != AMPLITUDE and item.dtype.kind in "biuf" and item.nbytes <= SMALL
    }
    small |= {name: np.asarray(found.attrs[name]) for name in ("bits", "from_north") if name in found.attrs}
    return _Arrays((found.shape[0], found.shape[1]), lambda at, to: np.asarray(found[at:to]), small)


def _check_axes(shape: tuple[int, ...], path: Path) -> None:
    if len(shape) != 2:
        raise DataError(f"{path}: amplitude has the shape {shape}; give spokes x samples, turn after turn.")


def _scale(small: dict[str, NDArray[Any]], samples: int, path: Path) -> tuple[float, float]:
    """Return where the first sample lies and how far it is from each to the next."""
    if "range_m" in small:
        ranges = np.asarray(small["range_m"], np.float64).ravel()
        steps = np.diff(ranges)
        if len(ranges) != samples or samples < 2 or not np.ptp(steps) <= 2 * EVEN * abs(steps.mean()):
            raise DataError(f"{path}: range_m must be {samples} ranges [m], evenly spaced: one for each sample.")
        return float(ranges[0]), float(steps.mean())
    if "step_m" not in small:
        raise DataError(f"{path}: tells no ranges; {NEEDED}.")
    return _one(small, "start_m", 0.0, path), _one(small, "step_m", 0.0, path)


def _one(small: dict[str, NDArray[Any]], name: str, absent: float, path: Path) -> float:
    values = np.asarray(small.get(name, absent)).ravel()
    if len(values) != 1 or not np.isfinite(values[0]):
        raise DataError(f"{path}: {name} has {len(values)} values or is not finite; give one number.")
    return float(values[0])


def _columns(
    small: dict[str, NDArray[Any]], shape: tuple[int, int], rotation_s: float | None, path: Path
) -> dict[str, NDArray[np.float64]]:
    spokes, samples = shape
    columns = {}
    for name in ("time_s", "azimuth_deg", "heading_deg", "lon_deg", "lat_deg"):
        values = np.asarray(small.get(name, np.nan), np.float64).ravel()
        if len(values) not in (1, spokes):
            hint = f", as amplitude has samples: is it spokes x samples, {shape}?" if len(values) == samples else "."
            raise DataError(f"{path}: {name} has {len(values)} values for {spokes} spokes; give one for each{hint}")
        columns[name] = np.broadcast_to(values, spokes)
    if np.isnan(columns["azimuth_deg"]).any():
        raise DataError(f"{path}: tells no azimuth_deg, or not of every spoke; {NEEDED}.")
    azimuth_deg = columns["azimuth_deg"]
    low, high = (azimuth_deg.min(), azimuth_deg.max()) if spokes else (0.0, 0.0)
    if 0 <= low < RADIANS_SHORT and 0 <= 2 * math.pi - (high - low) < RADIANS_SHORT:
        raise DataError(f"{path}: azimuth_deg goes from {low:.4g} to {high:.4g}, a turn in radians; give degrees.")
    if np.isnan(columns["time_s"]).all() and rotation_s is not None:
        turned = np.cumsum(np.diff(azimuth_deg, prepend=azimuth_deg[:1]) % 360.0)
        columns["time_s"] = turned / 360.0 * rotation_s
    if np.isnan(columns["time_s"]).any():
        raise DataError(f"{path}: tells no time_s, or not of every spoke; {NEEDED}, or the antenna's period.")
    turns = abs(float(((np.diff(azimuth_deg) + 180.0) % 360.0 - 180.0).sum())) / 360.0
    turn_s = float(np.ptp(columns["time_s"])) / turns if turns > 0.5 else math.nan
    if turn_s < TURN_S[0] or turn_s > TURN_S[1]:
        raise DataError(f"{path}: by time_s a turn of the antenna takes {turn_s:.3g} s; give time_s in seconds.")
    return columns


def _unsigned(raw: NDArray[Any], bits: int, where: str) -> tuple[NDArray[Any], int]:
    """Return amplitudes as spokes have them, and their bits; of complex samples, how large they are."""
    if raw.dtype.kind in "fc":
        return np.ascontiguousarray(np.abs(raw) if raw.dtype.kind == "c" else raw, np.float32), 0
    if raw.dtype.kind not in "iub":
        raise DataError(f"{where}: amplitude is of {raw.dtype}; give whole or real numbers.")
    kind = UNSIGNED[raw.dtype.itemsize]
    if raw.dtype.kind == "i" and raw.size and (raw.min() < 0 or int(raw.max()) >> 8 * np.dtype(kind).itemsize):
        raise DataError(f"{where}: amplitude is from {raw.min()} to {raw.max()}; give magnitudes from 0 on.")
    return np.ascontiguousarray(raw, kind), bits or 8 * np.dtype(kind).itemsize
