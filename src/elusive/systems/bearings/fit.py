"""How precise bearings are and how an emitter manoeuvres, from a recording itself: the evidence of its path.

MacKay (2003), Information theory, inference and learning algorithms, section 27: settings of most evidence, and how
sure they are by its curvature. Errors that persist are no more precise for being many: the deviation covers them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.optimize import minimize

from elusive.checks.fitted import Fit, Fitted
from elusive.contracts import Array
from elusive.errors import DataError
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import BatchMap, Cruise, OneEmitter, UseElevations
from elusive.systems.bearings.heard import have_elevations
from elusive.systems.bearings.leftovers import Scale, leftovers, scale_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import whole_path
from elusive.systems.bearings.track import track

TIMES, EVALUATIONS = 800, 120  # of the recording's middle; of the evidence
FIRST = (1.0, 1.0, 0.5)  # deviation [deg], q, q_vertical [m^2 / s^3] that the search begins from
LEAST, GREATEST = 1e-3, 90.0  # deviation [deg]
CALM, WILD = 1e-6, 1e6  # q
COVER, ROUNDS = 0.6, 4  # what is left of a deviation by errors that persist, and how often it is sought
STEP = 0.3  # of logarithms, over which curvature is taken


def fit_bearings(heard: Sequence[PlaceSet], sites: SensorSites) -> Fit:
    """Fit the deviation of a bearing and the power of an emitter's acceleration.

    Parameters
    ----------
    heard
        Bearings of one emitter.
    sites
        Where the sensors stand.

    Raises
    ------
    DataError
        If they are not of bearings alone, or of a single sensor, or too few.
    """
    if not all(isinstance(times, BearingSet) for times in heard):
        raise DataError("fit: is of bearings; leave times of arrival out.")
    if len({number for times in heard for number in times.sensor.tolist()}) < 2:  # type: ignore[union-attr]
        raise DataError("fit: all bearings are of one sensor, whose errors nothing contradicts; add a sensor.")
    start = max(0, (len(heard) - TIMES) // 2)
    part, solid = list(heard[start : start + TIMES]), have_elevations(heard)
    count = 3 if solid else 2

    def cost(logs: Array) -> float:
        path = whole_path(_parameters(logs, solid), part, sites)
        if path is None:
            return math.inf
        return -path.log_evidence if math.isfinite(path.log_evidence) else 1e300

    begun = np.log(FIRST[:count])
    bounds = [(math.log(LEAST), math.log(GREATEST)), *[(math.log(CALM), math.log(WILD))] * (count - 1)]
    corners = np.vstack([begun, *(begun + row for row in np.diag([-1.5, 2.0, 2.0][:count]))])
    options = {"maxfev": EVALUATIONS, "xatol": 0.02, "fatol": 0.1, "initial_simplex": corners}
    found = minimize(cost, begun, method="Nelder-Mead", bounds=bounds, options=options)
    if not found.fun < 1e299:
        raise DataError("fit: no path of one emitter explains the bearings; look at the azimuths and the places.")
    errors = np.array([_error(cost, found.x, found.fun, row) for row in np.eye(count)])
    logs, scale = found.x.copy(), _scale(part, found.x, solid, sites)
    # the robust loss, heavier in its tails than the noise, likes a deviation that is too small
    logs[0] += math.log(max(scale.half, 1.0))
    for _ in range(ROUNDS if scale.persists else 0):
        again = _scale(part, logs, solid, sites)
        logs[0] += math.log(max(again.lasting, 1e-3) / COVER)
    sigma_deg, *powers = np.exp(logs).tolist()
    how = "evidence"
    if scale.persists:
        how = f"evidence, and errors that persist (correlation {scale.correlation:.2f}), which it covers"
    values = [
        Fitted("--sigma-deg", "deviation of a bearing [deg]", f"{sigma_deg:.3g}", sigma_deg * float(errors[0]), how)
    ]
    names = (("--q", "power of the acceleration [m^2/s^3]"), ("--q-vertical", "the same upwards [m^2/s^3]"))
    for (option, what), power, error in zip(names, powers, errors[1:].tolist(), strict=False):
        values.append(Fitted(option, what, f"{power:.3g}", power * error, "evidence"))
    tree: dict[str, Any] = {
        "sigma_deg": float(f"{sigma_deg:.3g}"),
        "motion": {"kind": "cv", "q": float(f"{powers[0]:.3g}")},
    }
    if solid:
        tree["elevations"] = {"kind": "use", "q_vertical": float(f"{powers[1]:.3g}")}
    return Fit(tuple(values), tree)


def _parameters(logs: Array, solid: bool) -> BearingTracking:
    sigma_deg, q, *vertical = np.exp(logs).tolist()
    elevations = UseElevations(q_vertical=vertical[0]) if solid else UseElevations()
    return BearingTracking(
        sigma_deg=sigma_deg, motion=Cruise(q=q), elevations=elevations, emitters=OneEmitter(), filter=BatchMap()
    )


def _scale(heard: Sequence[PlaceSet], logs: Array, solid: bool, sites: SensorSites) -> Scale:
    parameters = _parameters(logs, solid)
    steps = list(track(heard, parameters, sites))
    return scale_of(leftovers(steps, parameters.sensor_of(sites, BearingSet, solid), BatchMap()))


def _error(cost: Any, at: Array, least: float, way: Array) -> float:
    """Deviation of a logarithm, by the evidence's curvature along it."""
    curvature = (cost(at + STEP * way) + cost(at - STEP * way) - 2 * least) / STEP**2
    return 1 / math.sqrt(curvature) if 0 < curvature < 1e200 else math.nan
