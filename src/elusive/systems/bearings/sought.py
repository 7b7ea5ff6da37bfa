"""Settings of bearings that are likeliest by the evidence of one emitter's path, sought on logarithmic axes.

MacKay (2003), Information theory, inference and learning algorithms, section 27: settings of most evidence, and how
sure they are by its curvature. Nelder and Mead (1965) for the search.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from elusive.contracts import Array
from elusive.filters.gaussian.map_smoother import SmoothedPath
from elusive.filters.gaussian.transitions import AngleBias
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import Cruise, UseElevations
from elusive.systems.bearings.fitting import bias_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import NORTHS, whole_path

EVALUATIONS = 120  # of the evidence
STEP = 0.3  # of logarithms, over which curvature is taken
STAYS, MEMORIES = 10.0, math.log(5.0)  # intervals after which what wanders is forgotten, and of its logarithm


class Setting(NamedTuple):
    """What is sought on a logarithmic axis."""

    option: str
    what: str
    step: float  # of the logarithm, that is tried first
    least: float
    greatest: float


SETTINGS = {
    "sigma_deg": Setting("--sigma-deg", "deviation of a bearing [deg]", -1.0, 1e-3, BearingTracking.most_sigma_deg),
    "q": Setting("--q", "power of the acceleration [m^2/s^3]", 2.0, 1e-6, 1e6),
    "q_vertical": Setting("--q-vertical", "the same upwards [m^2/s^3]", 2.0, 1e-6, 1e6),
    "north": Setting("--bias-sd-deg", "deviation of what persists of a sensor's errors [deg]", 1.0, 1e-2, 1e2),
    "memory": Setting("--bias-memory-s", "time over which that is forgotten [s]", 1.0, 2.0, 50.0),
}  # north: to the deviation of a bearing; memory: in intervals of the recording
FIRST = {"sigma_deg": 1.0, "q": 1.0, "q_vertical": 0.5, "north": 1.0, "memory": STAYS}  # from which a search begins


class Found(NamedTuple):
    """Settings of most evidence."""

    names: tuple[str, ...]
    logs: Array
    level: float  # of log evidence, with the log density beforehand
    parameters: BearingTracking
    cost: Callable[[Array], float]

    @property
    def values(self) -> dict[str, float]:
        """The settings by name."""
        return dict(zip(self.names, np.exp(self.logs).tolist(), strict=True))

    @property
    def errors(self) -> Array:
        """Deviations of the logarithms, by the evidence's curvature along each."""
        ways = STEP * np.eye(len(self.names))
        bends = [(self.cost(self.logs + way) + self.cost(self.logs - way) + 2 * self.level) / STEP**2 for way in ways]
        return np.array([1 / math.sqrt(bend) if 0 < bend < 1e200 else math.nan for bend in bends])


def most_evidence(
    asked: BearingTracking,
    names: tuple[str, ...],
    first: dict[str, float],
    heard: Sequence[PlaceSet],
    sites: SensorSites,
) -> Found:
    """Seek the settings that are named, each path near the likeliest before.

    Parameters
    ----------
    asked
        All other settings.
    names, first
        Of ``SETTINGS``, and where each begins.
    heard, sites
        Bearings of one emitter, and where the sensors stand.
    """
    settings, last = [SETTINGS[name] for name in names], list[tuple[SmoothedPath, float]]()
    least, width = math.inf, 6 if "q_vertical" in names else 4

    def cost(logs: Array) -> float:
        nonlocal least
        parameters = _with(asked, names, logs, heard)
        path = whole_path(parameters, heard, sites, _scaled(last[-1], parameters, width) if last else None)
        if path is None or not math.isfinite(path.log_evidence):
            return 1e300
        found = -path.log_evidence - _beforehand(names, logs)
        if found < least:
            least, last[:] = found, [(path, _bias_deg(parameters))]
        return found

    begun = np.log([first[name] for name in names])
    bounds = [(math.log(setting.least), math.log(setting.greatest)) for setting in settings]
    corners = np.vstack([begun, *(begun + row for row in np.diag([setting.step for setting in settings]))])
    options = {"maxfev": EVALUATIONS, "xatol": 0.05, "fatol": 0.2, "initial_simplex": corners}
    found = minimize(cost, begun, method="Nelder-Mead", bounds=bounds, options=options)
    level = -found.fun if found.fun < 1e299 else -math.inf
    return Found(names, found.x, level, _with(asked, names, found.x, heard), cost)


def _with(asked: BearingTracking, names: Sequence[str], logs: Array, heard: Sequence[PlaceSet]) -> BearingTracking:
    """Return the parameters with settings."""
    value = dict(zip(names, np.exp(logs).tolist(), strict=True))
    changes: dict[str, Any] = {"motion": Cruise(q=value["q"])}
    if "sigma_deg" in value:
        changes["sigma_deg"] = value["sigma_deg"]
    if "q_vertical" in value:
        changes["elevations"] = UseElevations(q_vertical=value["q_vertical"])
    if "north" in value:
        sd_deg = value["north"] * value.get("sigma_deg", asked.deviation_deg)
        memory = {"memory_s": value["memory"] * _interval(heard)} if "memory" in value else {}
        changes["filter"] = asked.filter.replace(bias=AngleBias(sd_deg=sd_deg, **memory))
    return asked.replace(**changes)


def _beforehand(names: Sequence[str], logs: Array) -> float:
    """Log density of what persists, before anything is heard: norths are about as good as a bearing is."""
    value = dict(zip(names, logs.tolist(), strict=True))
    density = -0.5 * (value["north"] / NORTHS) ** 2 if "north" in value else 0.0
    if "memory" in value:
        density -= 0.5 * ((value["memory"] - math.log(STAYS)) / MEMORIES) ** 2
    return density


def _bias_deg(parameters: BearingTracking) -> float:
    bias = bias_of(parameters)
    return bias.sd_deg if bias else 1.0


def _scaled(last: tuple[SmoothedPath, float], parameters: BearingTracking, width: int) -> SmoothedPath:
    """Return a path with its errors, which are counted in their deviation, in that of other parameters."""
    path, sd_deg = last
    states = path.states.copy()
    states[:, width:] *= sd_deg / _bias_deg(parameters)
    return path._replace(states=states)


def _interval(heard: Sequence[PlaceSet]) -> float:
    """Return the usual time from one measurement to the next [s]."""
    return float(np.median(np.diff([times.time_s for times in heard]))) if len(heard) > 1 else 1.0
