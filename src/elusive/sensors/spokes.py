"""Radar video: what a radar receives along each direction in which its antenna looks, before any detection."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError

MOST_BITS = {"uint8": 8, "uint16": 16, "uint32": 32, "float32": 0}


class Spokes(NamedTuple):
    """Consecutive spokes of radar video with one range scale: n spokes of m samples.

    Examples
    --------
    A radar that turns once in 2.4 s, seen for a sixteenth of a turn; a ship fills one sample of three spokes:

    >>> import numpy as np
    >>> from elusive.sensors.spokes import Spokes, check_spokes
    >>> amplitude = np.zeros((16, 512), np.uint8)
    >>> amplitude[7:10, 300] = 13, 15, 12
    >>> spokes = check_spokes(Spokes(
    ...     time_s=2.4 * np.arange(16) / 256,
    ...     azimuth_rad=2 * np.pi * np.arange(16) / 256,
    ...     from_north=True,
    ...     start_m=0.0,
    ...     step_m=12.0,
    ...     amplitude=amplitude,
    ...     bits=4,
    ...     heading_rad=np.full(16, np.nan),
    ...     lonlat_deg=np.full((16, 2), np.nan),
    ... ))
    >>> spokes.top, float(spokes.range_m[300])
    (15.0, 3600.0)
    """

    time_s: Array  # (n,) of each spoke, going forwards; since 1970 (UTC), or the recording's start
    azimuth_rad: Array  # (n,) clockwise, from 0 to below 2 pi; from north where from_north, else from the bow
    from_north: bool
    start_m: float  # where sample 0 lies: the middle of its cell
    step_m: float  # from sample to sample
    amplitude: NDArray[Any]  # (n, m) uint8, uint16, uint32 or float32, as recorded
    bits: int  # of quantisation; 0: not quantised (float32)
    heading_rad: Array  # (n,) of the radar's carrier, clockwise from north; NaN where unknown
    lonlat_deg: Array  # (n, 2) where the radar is; NaN where unknown

    @property
    def range_m(self) -> Array:
        """Where each sample lies, ``(m,)``."""
        return self.start_m + self.step_m * np.arange(self.amplitude.shape[1], dtype=np.float64)

    @property
    def top(self) -> float:
        """The largest amplitude that can be recorded: what has it may have been more. Infinite if not quantised."""
        return float(2**self.bits - 1) if self.bits else math.inf

    def select_spokes(self, chosen: NDArray[Any] | slice) -> Spokes:
        """Return some of the spokes: their numbers, whether each is chosen, or a slice."""
        return self._replace(
            time_s=self.time_s[chosen],
            azimuth_rad=self.azimuth_rad[chosen],
            amplitude=self.amplitude[chosen],
            heading_rad=self.heading_rad[chosen],
            lonlat_deg=self.lonlat_deg[chosen],
        )


def check_spokes(spokes: Spokes, where: str = "spokes") -> Spokes:
    """Return spokes that hold what :class:`Spokes` says.

    Parameters
    ----------
    spokes
        Of anyone's making.
    where
        They came from, for the sentence of a failure.

    Raises
    ------
    DataError
        If shapes, types or values contradict each other.
    """
    fault = _fault_of(spokes)
    if fault:
        raise DataError(f"{where}: {fault}.")
    return spokes


def _fault_of(spokes: Spokes) -> str:
    amplitude, bits = spokes.amplitude, spokes.bits
    kind = str(amplitude.dtype)
    if amplitude.ndim != 2 or not amplitude.size:
        return f"amplitude has the shape {amplitude.shape}; give spokes by samples, one of each at least"
    n = len(amplitude)
    for name, shape in (("time_s", (n,)), ("azimuth_rad", (n,)), ("heading_rad", (n,)), ("lonlat_deg", (n, 2))):
        found = np.shape(getattr(spokes, name))
        if found != shape:
            return f"{name} has the shape {found} and amplitude {amplitude.shape}; give {shape}"
    if kind not in MOST_BITS:
        return f"amplitude is of {kind}; give one of {', '.join(MOST_BITS)}"
    most = MOST_BITS[kind]
    if not (1 <= bits <= most if most else bits == 0):
        return f"bits={bits} does not fit amplitudes of {kind}; give {f'1 to {most}' if most else '0'}"
    if 0 < bits < most and int(amplitude.max()) >> bits:
        return f"amplitude reaches {int(amplitude.max())}, more than {bits} bits hold; give more bits"
    if not most and not np.isfinite(amplitude).all():
        return "amplitude has values that are not finite; put 0 where nothing was received"
    if not most and amplitude.min() < 0:
        return f"amplitude goes down to {amplitude.min():.4g}; give magnitudes: of decibels, 10 ** (dB / 20)"
    if not (math.isfinite(spokes.start_m) and math.isfinite(spokes.step_m) and spokes.step_m > 0):
        return f"start_m={spokes.start_m:g}, step_m={spokes.step_m:g}: give finite numbers, the step above 0"
    if not np.isfinite(spokes.time_s).all() or (np.diff(spokes.time_s) < 0).any():
        return "time_s is not finite or goes backwards; sort the spokes by time"
    if not ((spokes.azimuth_rad >= 0) & (spokes.azimuth_rad < 2 * math.pi)).all():
        return "azimuth_rad is outside 0 to 2 pi; give radians, clockwise"
    lon, lat = np.abs(spokes.lonlat_deg).T
    if np.isinf(spokes.heading_rad).any() or (lon > 180).any() or (lat > 90).any():
        return "heading_rad or lonlat_deg is out of bounds; leave what is unknown NaN"
    return ""


def join_spokes(parts: Sequence[Spokes]) -> Spokes:
    """Join spokes of one range scale that follow on each other.

    Raises
    ------
    DataError
        If there are none, or scales, samples or bits differ.
    """
    if not parts:
        raise DataError("There are no spokes to join; give one part at least.")
    first = parts[0]
    kinds = {(p.from_north, p.start_m, p.step_m, p.bits, p.amplitude.shape[1], p.amplitude.dtype) for p in parts}
    if len(kinds) > 1:
        raise DataError("The spokes to join differ in range scale, samples, bits or what azimuths count from.")
    together = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("time_s", "azimuth_rad", "amplitude", "heading_rad", "lonlat_deg")
    )
    time_s, azimuth_rad, amplitude, heading_rad, lonlat_deg = together
    return first._replace(
        time_s=time_s, azimuth_rad=azimuth_rad, amplitude=amplitude, heading_rad=heading_rad, lonlat_deg=lonlat_deg
    )
