"""How far each sensor's north is off, from the bearings of one emitter or of several together.

Each emitter's own bearings tell its path and the norths at once; what they say of the norths is put together as of
Gaussian likelihoods. How far norths are off at all is unknown: sizes are weighed by their evidence (MacKay, 2003,
section 28.1), which few lines hardly tell apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from scipy.special import softmax

from elusive.contracts import Array, X, Y
from elusive.errors import ParameterError
from elusive.filters.gaussian.map_smoother import SmoothedPath
from elusive.filters.gaussian.transitions import AngleBias
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import Estimation, IgnoreElevations, SeveralEmitters
from elusive.systems.bearings.heard import sensors_of
from elusive.systems.bearings.own import slope_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import LEAST_TIMES, NORTHS, whole, whole_path
from elusive.tracking.track import Step, Track

AnySet = TypeVar("AnySet", bound=PlaceSet)
LEAST_SENSORS = 3
TWENTY_TO_ONE = 3.0  # of log odds, against norths of each emitter's own
SIZES = (0.1, 0.3, 1.0, 3.0)  # deviations of norths that are tried, in that of a bearing


class Norths(NamedTuple):
    """What azimuths of each sensor are too large by, and how sure that is."""

    off_deg: tuple[float, ...]  # (n,)
    spread_deg2: tuple[tuple[float, ...], ...]  # (n, n) covariance

    @property
    def sd_deg(self) -> Array:
        """Deviations, ``(n,)``."""
        return np.asarray(np.sqrt(np.diag(self.spread_deg2)))

    def alike(self, other: Norths, within_deg: float) -> bool:
        """Say whether norths are no further off than others are."""
        return bool((np.abs(np.subtract(self.off_deg, other.off_deg)) < within_deg).all())

    def righted(self, measurement: AnySet) -> AnySet:
        """Return bearings as they were if norths were right; times of arrival have none."""
        return self._turned(measurement, -1.0)

    def as_heard(self, measurement: AnySet) -> AnySet:
        """Return bearings that were turned so as they came."""
        return self._turned(measurement, 1.0)

    def wider(self, step: Step, sites: SensorSites) -> Step:
        """Return a step whose places are as uncertain as norths leave them: each moves what is seen from its sensor."""
        return step._replace(tracks=tuple(self._wider(track, sites) for track in step.tracks))

    def _wider(self, track: Track, sites: SensorSites) -> Track:
        shift = np.linalg.pinv(slope_of(track.mean[[X, Y]] - sites.positions_m[:, :2]))
        covariance = track.covariance.copy()
        covariance[np.ix_([X, Y], [X, Y])] += shift @ np.array(self.spread_deg2) @ shift.T * math.radians(1) ** 2
        return track._replace(covariance=covariance)

    def _turned(self, measurement: AnySet, way: float) -> AnySet:
        if not isinstance(measurement, BearingSet):
            return measurement
        by = way * np.deg2rad(self.off_deg)[measurement.sensor]
        return measurement._replace(azimuth_rad=measurement.azimuth_rad + by)


def exact(sites: SensorSites) -> Norths:
    """Return norths that are right."""
    none = (0.0,) * len(sites.names)
    return Norths(none, (none,) * len(sites.names))


def norths_of(parameters: BearingTracking, sites: SensorSites) -> Norths:
    """Return the norths that several emitters are tracked with.

    Raises
    ------
    ParameterError
        If they are not of these sensors.
    """
    emitters, right, n = parameters.emitters, exact(sites), len(sites.names)
    assert isinstance(emitters, SeveralEmitters)
    norths = Norths(emitters.norths_deg or right.off_deg, emitters.norths_spread_deg2 or right.spread_deg2)
    if len(norths.off_deg) != n:
        raise ParameterError(f"norths_deg: has {len(norths.off_deg)} numbers for {n} sensors.")
    if {len(norths.spread_deg2), *map(len, norths.spread_deg2)} != {n}:
        raise ParameterError(f"norths_spread_deg2: is not of {n} rows of {n} numbers, as there are sensors.")
    return norths


def with_norths(parameters: BearingTracking, norths: Norths) -> BearingTracking:
    """Return the parameters of several emitters with norths."""
    assert isinstance(parameters.emitters, SeveralEmitters)
    emitters = parameters.emitters.replace(norths_deg=norths.off_deg, norths_spread_deg2=norths.spread_deg2)
    return parameters.replace(emitters=emitters)


def norths_found(parameters: BearingTracking, sites: SensorSites, alone: Sequence[Sequence[PlaceSet]]) -> Norths:
    """Find the norths that each emitter's own bearings tell.

    Parameters
    ----------
    parameters
        Of how emitters are tracked; a bias that is told is how far norths may be off, and for how long.
    sites
        Where the sensors stand.
    alone
        The bearings of each emitter, as they came; none, or of two sensors: norths are as uncertain as beforehand.
    """
    asked, sigma_deg = whole(parameters.replace(elevations=IgnoreElevations())), parameters.deviation_deg
    assert isinstance(asked.filter, Estimation)
    flt, told, n = asked.filter, asked.filter.bias, len(sites.names)
    sizes = [told.sd_deg] if told else [size * sigma_deg for size in SIZES]
    biases = [(told or AngleBias()).replace(sd_deg=sd_deg) for sd_deg in sizes]
    ways = [asked.replace(filter=flt.replace(bias=bias)) for bias in biases]
    # any two lines cross: what two sensors tell of norths is how emitters would have to move
    used = {number for part in alone for one in part for number in sensors_of(one).tolist()}
    tell = [part for part in alone if len(part) >= LEAST_TIMES and len(used) >= LEAST_SENSORS]
    parts = [[whole_path(way, part, sites) for way in ways] for part in tell]
    known = [[path for path in row if path is not None and math.isfinite(path.log_evidence)] for row in parts]
    by_size = list(zip(*(row for row in known if len(row) == len(sizes)), strict=True)) or [()] * len(sizes)
    # what errs by the direction, as beside a mast, is another north to each emitter
    found = [_together(paths, n) for paths in by_size]
    found += [_apart(paths, by_size[0], n) for paths in by_size if len(paths) > 1]
    sizes = (2 * sizes)[: len(found)]
    beforehand = [-0.5 * (math.log(sd_deg / sigma_deg) / NORTHS) ** 2 for sd_deg in sizes]
    beforehand[len(by_size) :] = [level - TWENTY_TO_ONE for level in beforehand[len(by_size) :]]
    weight = softmax([level + more for (level, _, _), more in zip(found, beforehand, strict=True)])
    each = np.array([sd_deg * off for sd_deg, (_, off, _) in zip(sizes, found, strict=True)])
    off_deg = weight @ each
    spread_deg2 = np.einsum("s,si,sj->ij", weight, each - off_deg, each - off_deg)
    spread_deg2 += np.einsum("s,sij->ij", weight * np.array(sizes) ** 2, [spread for _, _, spread in found])
    return Norths(tuple(off_deg.round(4).tolist()), tuple(map(tuple, spread_deg2.round(6).tolist())))


def _apart(paths: Sequence[SmoothedPath], least: Sequence[SmoothedPath], n: int) -> tuple[float, Array, Array]:
    """Return the same where each emitter has norths of its own: their mean, and how far one emitter's are from it.

    Most emitters have to say so, beside the least norths: who took another's bearings seems to err.
    """
    levels = np.array([path.log_evidence for path in least])
    gain = float(np.median([path.log_evidence for path in paths] - levels))
    means = np.array([path.states[-1, -n:] for path in paths])
    spread = np.mean([path.covariances[-1, -n:, -n:] for path in paths], axis=0) + np.cov(means.T)
    return float(levels.sum()) + len(levels) * gain, means.mean(axis=0), np.asarray(spread)


def _together(paths: Sequence[SmoothedPath], n: int) -> tuple[float, Array, Array]:
    """Return the log evidence of all emitters together, the norths of n sensors and their covariance, in their size."""
    level, information, pull = 0.0, np.eye(n), np.zeros(n)
    for path in paths:
        # of all times the last knows the most of what stays
        mean, spread = path.states[-1, -n:], path.covariances[-1, -n:, -n:]
        inverse = np.asarray(np.linalg.inv(spread), np.float64)
        information += inverse - np.eye(n)
        pull += inverse @ mean
        level += path.log_evidence - 0.5 * float(np.linalg.slogdet(spread)[1] + mean @ inverse @ mean)
    together = np.asarray(np.linalg.inv(information), np.float64)
    off = together @ pull
    return level + 0.5 * float(np.linalg.slogdet(together)[1] + pull @ off), off, together
