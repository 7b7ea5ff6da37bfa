"""How precise bearings are, what errors of a sensor persist, how an emitter manoeuvres: by the evidence of its path.

A sensor's north that is off, and an error that wanders: Gelb (1974), section 3.8.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from elusive.checks.fitted import Fit, Fitted
from elusive.errors import DataError
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import BatchMap, Cruise, Estimation, OneEmitter, UseElevations
from elusive.systems.bearings.emitter import whole_steps
from elusive.systems.bearings.faults import TWENTY_TO_ONE
from elusive.systems.bearings.fitting import bias_of
from elusive.systems.bearings.heard import have_elevations
from elusive.systems.bearings.leftovers import Scale, leftovers, scale_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import ROUGHLY
from elusive.systems.bearings.sought import FIRST, SETTINGS, Found, most_evidence

TIMES, FEWEST, WORK = 400, 100, 3.5e5  # of the recording's middle; as many times the cube of a state as are tried
COVER = 0.6  # what is left of a deviation by errors that persist and are not told
ROUNDS = 4  # in which that is sought


def fit_bearings(heard: Sequence[PlaceSet], sites: SensorSites, given: BearingTracking | None = None) -> Fit:
    """Fit the deviation of a bearing, what persists of sensors' errors, and the power of an emitter's acceleration.

    What persists is a north that is off, or wanders and is forgotten after some time, whichever is likelier.

    Parameters
    ----------
    heard
        Bearings of one emitter.
    sites
        Where the sensors stand.
    given
        Its deviation and its bias are kept where it has them; none: nothing is given.

    Raises
    ------
    DataError
        If they are not of bearings alone, or of a single sensor, or too few.
    """
    if not all(isinstance(times, BearingSet) for times in heard):
        raise DataError("fit: is of bearings; leave times of arrival out.")
    if len({number for times in heard for number in times.sensor.tolist()}) < 2:  # type: ignore[union-attr]
        raise DataError("fit: all bearings are of one sensor, whose errors nothing contradicts; add a sensor.")
    given = given or BearingTracking()
    search = _Search(heard, sites, given)
    best = plain = search.found(search.names, FIRST)
    if math.isfinite(plain.level) and bias_of(given) is None:
        best = search.persisting(plain)
    scale = search.scale(best.parameters)
    if not (math.isfinite(plain.level) and math.isfinite(scale.half)):
        raise DataError("fit: no path of one emitter explains the bearings; look at the azimuths and the places.")
    covered = scale.persists and not search.crossed
    if covered:
        best, scale = plain, search.scale(plain.parameters)
    sigma_deg = best.parameters.deviation_deg
    if not given.sigma_deg:
        # the robust loss, heavier in its tails than the noise, likes a deviation that is too small
        sigma_deg = min(sigma_deg * max(scale.half, 1.0), given.most_sigma_deg)
        for _ in range(ROUNDS if covered else 0):
            again = search.scale(best.parameters.replace(sigma_deg=sigma_deg))
            sigma_deg = min(sigma_deg * max(again.lasting, 1e-3) / COVER, given.most_sigma_deg)
    return _told(best, sigma_deg)


class _Search:
    """Settings of most evidence of a recording's middle, with one or another of them left free."""

    def __init__(self, heard: Sequence[PlaceSet], sites: SensorSites, given: BearingTracking) -> None:
        self._sites, self._solid = sites, have_elevations(heard)
        width = 6 + 2 * len(sites.names) if self._solid else 4 + len(sites.names)
        times = int(min(max(WORK / width**3, FEWEST), TIMES))
        start = max(0, (len(heard) - times) // 2)
        self._part = list(heard[start : start + times])
        kept = given.filter if isinstance(given.filter, Estimation) else BatchMap()
        whole = BatchMap(bias=kept.bias, loss=kept.loss, tolerance=ROUGHLY)
        self._asked = BearingTracking(
            sigma_deg=given.sigma_deg, sensor_times=given.sensor_times, emitters=OneEmitter(), filter=whole
        )
        self.names = (*(() if given.sigma_deg else ("sigma_deg",)), "q", *(("q_vertical",) if self._solid else ()))
        # two lines cross wherever their sensors err: an error that wanders looks like a path
        self.crossed = np.median([len(set(times.sensor.tolist())) for times in heard]) > 2  # type: ignore[union-attr]

    def found(self, names: tuple[str, ...], first: dict[str, float], asked: BearingTracking | None = None) -> Found:
        """Seek the settings that are named."""
        return most_evidence(asked or self._asked, names, first, self._part, self._sites)

    def scale(self, parameters: BearingTracking) -> Scale:
        """Compare what bearings leave beside their path with what is expected."""
        assert isinstance(parameters.filter, Estimation)
        steps = whole_steps(self._part, parameters, self._sites)
        sensor = parameters.sensor_of(self._sites, BearingSet, self._solid)
        return scale_of(leftovers(steps, sensor, parameters.filter))

    def persisting(self, plain: Found) -> Found:
        """Seek what persists beside what was found without: norths, or errors that wander, whichever is likelier."""
        begun = FIRST | plain.values
        best = self.found((*self.names, "north"), begun)
        if self.crossed:
            # what wanders is no part of the bearings' own deviation
            parted = begun | {"sigma_deg": begun["sigma_deg"] / 2, "north": 2 * begun["north"]}
            wandering = self.found((*self.names, "north", "memory"), parted)
            best = best if best.level > wandering.level + TWENTY_TO_ONE else wandering
        told_deg = self._asked.sigma_deg
        if not told_deg:
            return best
        freer = self.found(("sigma_deg", *self.names), FIRST, self._asked.replace(sigma_deg=None))
        # the deviation that is told is wrong, which is another thing to say
        told_less = freer.parameters.deviation_deg > told_deg
        return plain if told_less and best.level < freer.level + TWENTY_TO_ONE else best


def _told(best: Found, sigma_deg: float) -> Fit:
    """Return the values as a table and as a configuration."""
    north = bias_of(best.parameters)
    motion, elevations = best.parameters.motion, best.parameters.elevations
    assert isinstance(motion, Cruise)
    found = {"sigma_deg": sigma_deg, "q": motion.q}
    if isinstance(elevations, UseElevations):
        found["q_vertical"] = elevations.q_vertical
    if north is not None:
        found |= {"north": north.sd_deg, "memory": north.memory_s}
    rounded = {name: float(f"{found[name]:.3g}") for name in best.names}
    values = []
    for name, error in zip(best.names, best.errors.tolist(), strict=True):
        setting = SETTINGS[name]
        values.append(Fitted(setting.option, setting.what, f"{found[name]:.3g}", rounded[name] * error, "evidence"))
    tree: dict[str, Any] = {"motion": {"kind": "cv", "q": rounded["q"]}}
    if "sigma_deg" in rounded:
        tree = {"sigma_deg": rounded["sigma_deg"]} | tree
    if "q_vertical" in rounded:
        tree["elevations"] = {"kind": "use", "q_vertical": rounded["q_vertical"]}
    if "north" in rounded:
        memory = {"memory_s": rounded["memory"]} if "memory" in rounded else {}
        tree["filter"] = {"bias": {"sd_deg": rounded["north"]} | memory}
    return Fit(tuple(values), tree)
