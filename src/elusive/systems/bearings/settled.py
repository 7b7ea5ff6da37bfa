"""What emitters' own bearings tell of their motion, of how precise they are and of norths, each given the others."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.fitting import left_beside
from elusive.systems.bearings.found_norths import Norths, exact, norths_found
from elusive.systems.bearings.leftovers import HALF
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import LEAST_TIMES, powers_found, whole, whole_path

ROUNDS, LEAST_LEFT = 3, 30  # in which each is sought given the others; residuals that tell a deviation
LARGER = (3.0, 10.0)  # times a deviation that is told
LEAST_DEG, MOST_DEG = 0.01, 6.0  # of a bearing; beyond, azimuths rather mean something else


def settled(
    asked: BearingTracking,
    given: BearingTracking,
    norths: Norths,
    sites: SensorSites,
    alone: Sequence[Sequence[PlaceSet]],
    *,
    straight: bool = False,
) -> tuple[BearingTracking, Norths]:
    """Return the parameters with the powers and the deviation that emitters' bearings tell, and the norths.

    Parameters
    ----------
    asked
        Of how emitters are tracked, from which is begun.
    given
        The same, where what is not given is None: that is sought.
    norths
        From which is begun.
    sites
        Where the sensors stand.
    alone
        The bearings of each emitter, as they came.
    straight
        Whether the norths are known, and not sought.
    """
    for _ in range(1 if straight and given.sigma_deg else ROUNDS):
        own = [[norths.righted(measurement) for measurement in part] for part in alone]
        asked = powers_found(asked.replace(motion=given.motion), sites, own)
        if given.sigma_deg is None:
            asked = asked.replace(sigma_deg=scattered(asked, sites, own))
        if not straight:
            norths = norths_found(asked, sites, alone)
    if given.sigma_deg is not None and not straight and _too_sure(asked, norths, sites, alone):
        norths = exact(sites)
    return asked, norths


def _too_sure(asked: BearingTracking, norths: Norths, sites: SensorSites, alone: Sequence[Sequence[PlaceSet]]) -> bool:
    """Say whether bearings rather are less precise than was told, which is another thing to say than norths."""
    as_told = _evidence(asked, sites, [[norths.righted(one) for one in part] for part in alone])
    larger = [asked.replace(sigma_deg=min(times * asked.deviation_deg, asked.most_sigma_deg)) for times in LARGER]
    return any(_evidence(one, sites, alone) > as_told for one in larger)


def _evidence(asked: BearingTracking, sites: SensorSites, alone: Sequence[Sequence[PlaceSet]]) -> float:
    """Log evidence of emitters' paths."""
    paths = [whole_path(whole(asked), part, sites) for part in alone if len(part) >= LEAST_TIMES]
    return sum(-math.inf if path is None else path.log_evidence for path in paths)


def scattered(parameters: BearingTracking, sites: SensorSites, alone: Sequence[Sequence[PlaceSet]]) -> float:
    """Return by how much bearings lie about their emitters' own paths in the median, the deviation it is of [deg]."""
    left = [left_beside(part, parameters, sites)[1].deviations for part in alone if len(part) >= LEAST_TIMES]
    size = np.abs(np.concatenate([np.empty(0), *left]))
    if len(size) < LEAST_LEFT:
        return parameters.deviation_deg
    found = parameters.deviation_deg * float(np.median(size)) / HALF
    return float(f"{np.clip(found, LEAST_DEG, parameters.most_sigma_deg):.3g}")
