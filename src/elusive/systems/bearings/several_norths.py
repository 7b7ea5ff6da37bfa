"""How far each sensor's north is off, from the bearings of several emitters together.

Each emitter's own bearings tell its path and the norths at once; what they say of the norths is put together as of
Gaussian likelihoods, and how far norths are off at all has the size of most evidence (MacKay, 2003, section 28.1).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.filters.gaussian.transitions import AngleBias
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.choices import Estimation, IgnoreElevations, SeveralEmitters
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import LEAST_TIMES, NORTHS, whole, whole_path
from elusive.tracking.track import Step, Track

SIZES = (0.1, 0.3, 1.0, 3.0)  # deviations of norths that are tried, in that of a bearing


class _Norths(NamedTuple):
    """What azimuths of each sensor are too large by."""

    level: float  # log evidence of all emitters together
    off_deg: Array  # (n,)
    sd_deg: Array  # (n,)


def norths_found(
    parameters: BearingTracking, sites: SensorSites, alone: Sequence[Sequence[BearingSet]]
) -> BearingTracking:
    """Return the parameters with the norths that each emitter's own bearings tell, and how precise these are.

    Parameters
    ----------
    parameters
        Of how emitters are tracked; a bias that is told is how far norths may be off.
    sites
        Where the sensors stand.
    alone
        The bearings of each emitter, as they came.
    """
    flat = parameters.replace(elevations=IgnoreElevations())
    asked, emitters, sigma_deg = whole(flat), parameters.emitters, parameters.deviation_deg
    assert isinstance(emitters, SeveralEmitters)
    assert isinstance(asked.filter, Estimation)
    told = asked.filter.bias
    parts = [part for part in alone if len(part) >= LEAST_TIMES]
    sizes = [told.sd_deg] if told else [size * sigma_deg for size in SIZES]
    found = [_with(sd_deg, asked, sites, parts) for sd_deg in sizes]
    likely = [one.level - 0.5 * (math.log(sd / sigma_deg) / NORTHS) ** 2 for sd, one in zip(sizes, found, strict=True)]
    best = found[int(np.argmax(likely))]
    norths = {"norths_deg": best.off_deg.round(3).tolist(), "norths_sd_deg": best.sd_deg.round(3).tolist()}
    return parameters.replace(emitters=emitters.replace(**norths))


def _with(sd_deg: float, asked: BearingTracking, sites: SensorSites, alone: Sequence[Sequence[BearingSet]]) -> _Norths:
    """Find the norths where they are off by a deviation."""
    n = len(sites.names)
    assert isinstance(asked.filter, Estimation)
    asked = asked.replace(filter=asked.filter.replace(bias=AngleBias(sd_deg=sd_deg)))
    level, information, pull = 0.0, np.eye(n), np.zeros(n)
    for part in alone:
        path = whole_path(asked, part, sites)
        if path is None or not math.isfinite(path.log_evidence):
            continue
        # of all times the last knows the most of what stays
        mean, spread = path.states[-1, -n:], path.covariances[-1, -n:, -n:]
        inverse = np.linalg.inv(spread)
        information += inverse - np.eye(n)
        pull += inverse @ mean
        level += path.log_evidence - 0.5 * float(np.linalg.slogdet(spread)[1] + mean @ inverse @ mean)
    together = np.linalg.inv(information)
    off = together @ pull
    level += 0.5 * float(np.linalg.slogdet(together)[1] + pull @ off)
    return _Norths(level, sd_deg * off, sd_deg * np.sqrt(np.diag(together)))


def widened(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites) -> list[Step]:
    """Return the steps with places as uncertain as norths leave them: each moves all places that it is seen from."""
    emitters = parameters.emitters
    assert isinstance(emitters, SeveralEmitters)
    variance = np.deg2rad(emitters.norths_sd_deg or np.zeros(len(sites.names))) ** 2

    def wider(track: Track) -> Track:
        off = track.mean[[X, Y]] - sites.positions_m[:, :2]
        slope = np.column_stack([off[:, 1], -off[:, 0]]) / np.maximum((off**2).sum(axis=1), 1e-9)[:, None]
        shift = np.linalg.pinv(slope)
        covariance = track.covariance.copy()
        covariance[np.ix_([X, Y], [X, Y])] += (shift * variance) @ shift.T
        return track._replace(covariance=covariance)

    return [step._replace(tracks=tuple(map(wider, step.tracks))) for step in steps]
