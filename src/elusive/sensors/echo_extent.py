"""How far an echo reaches in range and azimuth, from one turn of spokes: what the pulse and the beam make of a point.

Echoes are no shorter than the radar's resolution, and speckle of single samples has none of it: in patches, the lag at
which the correlation of amplitudes falls to half of what it is beside the sample itself; the lower quartile of patches
in which there is any, since land and piers are longer. Patches of rain, a squall or swell say nothing of it: what is
alike along the one way is alike two echoes further across it as well. Along azimuth, where a patch is many beams long,
it is less the plane through it. A point's amplitude that a Gaussian pulse of width w between half powers makes has half
its correlation at w, one that a beam makes, both ways, at w / sqrt(2) (Richards, 2014, Fundamentals of radar signal
processing, section 4.2); clutter that is constant over a pulse or beam at w / 2.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.sensors.spokes import Spokes

TURN_RAD = 2 * math.pi
SECTORS, BANDS = 8, 8  # patches of a turn
LEAST = 16  # samples of a patch each way
SIGNIFICANT = 5.0  # of a correlation, in deviations of that of as many independent samples
FEWEST = 6  # patches that show a correlation
QUARTILE = 25.0
# width to the lag of half correlation, between a point's and constant clutter's
OF_PULSE, OF_BEAM = math.sqrt(2.0), 2.0
SHORTEST = 2.0  # samples of a pulse
AWAY, OF_ECHO = 2.0, 0.5  # lags at which what is alike is no echo's, and the share of likeness that is less than it


class EchoExtent(NamedTuple):
    """What a point looks like; NaN where nothing says so."""

    pulse_m: float  # between half powers
    beam_deg: float  # the same, of the beam one way


def first_turn(spokes: Iterable[Spokes]) -> list[Spokes]:
    """Take spokes until the antenna has turned once and a little, or they end."""
    found, swept, before = list[Spokes](), 0.0, math.nan
    for part in spokes:
        found.append(part)
        steps = np.diff(part.azimuth_rad, prepend=before) % TURN_RAD
        swept += float(steps[steps < math.pi].sum())
        before = float(part.azimuth_rad[-1])
        if swept > 1.02 * TURN_RAD:
            break
    return found


def echo_extent(spokes: Sequence[Spokes]) -> EchoExtent:
    """Return how far echoes reach in spokes of the first one's range scale, at least one turn of them.

    Samples that are NaN say nothing.
    """
    first = spokes[0]
    alike = [
        one for one in spokes
        if (one.start_m, one.step_m, one.amplitude.shape[1]) == (first.start_m, first.step_m, first.amplitude.shape[1])
    ]  # fmt: skip
    amplitude = np.concatenate([one.amplitude for one in alike])
    steps = np.diff(np.concatenate([one.azimuth_rad for one in alike])) % TURN_RAD
    steps = steps[steps < math.pi]
    if not len(steps) or min(amplitude.shape) < 2 * LEAST:
        return EchoExtent(math.nan, math.nan)
    tall, wide = (max(LEAST, n // parts) for n, parts in zip(amplitude.shape, (SECTORS, BANDS), strict=True))
    patches = [
        _filled(amplitude[i : i + tall, j : j + wide].astype(np.float32))
        for i in range(0, amplitude.shape[0] - tall + 1, tall)
        for j in range(0, amplitude.shape[1] - wide + 1, wide)
    ]
    level = [_less_plane(patch) for patch in patches]
    along, across = [_half(patch - patch.mean()) for patch in patches], [_half(patch.T) for patch in level]
    seen = _lowest(across)
    pulse = _lowest([lag for lag, patch in zip(along, level, strict=True) if _of_echoes(patch.T, seen)])
    beam = _lowest([lag for lag, patch in zip(across, level, strict=True) if _of_echoes(patch, pulse)])
    return EchoExtent(
        max(OF_PULSE * pulse, SHORTEST) * first.step_m, math.degrees(OF_BEAM * beam * float(steps.mean()))
    )


def _filled(patch: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a patch, its mean where a sample is missing."""
    missing = np.isnan(patch)
    if missing.any():
        patch[missing] = patch[~missing].mean() if not missing.all() else 0.0
    return patch


def _less_plane(patch: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return what the plane through a patch leaves of it."""
    down, right = (np.linspace(-1, 1, n) for n in patch.shape)
    rise, tilt = down @ patch.mean(axis=1) / (down @ down), patch.mean(axis=0) @ right / (right @ right)
    return np.asarray(patch - patch.mean() - (rise * down)[:, None] - tilt * right, np.float32)


def _half(patch: NDArray[np.float32]) -> float:
    """Lag along the rows at which their correlation is half of that beside a sample; NaN where there is none."""
    n = patch.shape[1]
    spectrum = np.abs(np.fft.rfft(patch, 2 * n, axis=1)) ** 2
    product = np.fft.irfft(spectrum.sum(axis=0))[: n // 2] / (patch.shape[0] * (n - np.arange(n // 2)))
    if not product[1] * math.sqrt(patch.size) > SIGNIFICANT * product[0]:
        return math.nan
    level = max(product[1], min(2 * product[1] - product[2], product[0]))  # without the speckle of single samples
    below = np.flatnonzero(product[1:] < 0.5 * level)
    if not len(below):
        return math.nan
    k = int(below[0]) + 1
    before = level if k == 1 else product[k - 1]
    return float(k - 1 + (before - 0.5 * level) / (before - product[k]))


def _of_echoes(patch: NDArray[np.float32], lag: float) -> bool:
    """Whether what is alike from row to row is less so two echoes, of half correlation at a lag, further along them."""
    away = min(math.ceil(AWAY * max(lag, 1.0)) if math.isfinite(lag) else round(AWAY), patch.shape[1] // 4)
    above, below = patch[:-1], patch[1:]
    aside = 0.5 * float((above[:, away:] * below[:, :-away]).mean() + (above[:, :-away] * below[:, away:]).mean())
    return aside < OF_ECHO * float((above * below).mean())


def _lowest(lags: Sequence[float]) -> float:
    known = [lag for lag in lags if math.isfinite(lag)]
    return float(np.percentile(known, QUARTILE)) if len(known) >= FEWEST else math.nan
