"""How precise bearings are, what errors of a sensor persist, how an emitter manoeuvres: by the evidence of its path.

MacKay (2003), Information theory, inference and learning algorithms, section 27: settings of most evidence, and how
sure they are by its curvature. A sensor's north that is off, and an error that wanders: Gelb (1974), section 3.8.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from elusive.checks.fitted import Fit, Fitted
from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.gaussian.map_smoother import SmoothedPath
from elusive.filters.gaussian.transitions import AngleBias
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import BatchMap, Cruise, Estimation, OneEmitter, UseElevations
from elusive.systems.bearings.faults import TWENTY_TO_ONE, bias_of
from elusive.systems.bearings.heard import have_elevations
from elusive.systems.bearings.leftovers import Scale, leftovers, scale_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import whole_path
from elusive.systems.bearings.track import track

TIMES, FEWEST, WORK = 400, 100, 3.5e5  # of the recording's middle; as many times the cube of a state as are tried
EVALUATIONS = 120  # of the evidence
MOST_DEG = 90.0
STEP = 0.3  # of logarithms, over which curvature is taken
NORTHS = math.log(3.0)  # deviation of the logarithm of norths' deviation about that of a bearing, beforehand
STAYS, MEMORIES = 10.0, math.log(5.0)  # intervals after which what wanders is forgotten, and of its logarithm
BY_CHANCE = 2.0  # deviations of a correlation that is none
COVER = 0.6  # what is left of a deviation by errors that persist and are not told
ROUNDS = 4  # in which that is sought


class Setting(NamedTuple):
    """What is sought on a logarithmic axis."""

    option: str
    what: str
    step: float  # of the logarithm, that is tried first
    least: float
    greatest: float


SETTINGS = {
    "sigma_deg": Setting("--sigma-deg", "deviation of a bearing [deg]", -1.0, 1e-3, MOST_DEG),
    "q": Setting("--q", "power of the acceleration [m^2/s^3]", 2.0, 1e-6, 1e6),
    "q_vertical": Setting("--q-vertical", "the same upwards [m^2/s^3]", 2.0, 1e-6, 1e6),
    "north": Setting("--bias-sd-deg", "deviation of what persists of a sensor's errors [deg]", 1.0, 1e-2, 1e2),
    "memory": Setting("--bias-memory-s", "time over which that is forgotten [s]", 1.0, 2.0, 50.0),
}  # north: to the deviation of a bearing; memory: in intervals of the recording
FIRST = {"sigma_deg": 1.0, "q": 1.0, "q_vertical": 0.5, "north": 1.0, "memory": STAYS}  # from which a search begins


class _Found(NamedTuple):
    names: tuple[str, ...]
    logs: Array
    errors: Array  # deviations of the logarithms
    level: float  # of log evidence, with the log density beforehand
    parameters: BearingTracking


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
    solid = have_elevations(heard)
    width = 6 + 2 * len(sites.names) if solid else 4 + len(sites.names)
    times = int(min(max(WORK / width**3, FEWEST), TIMES))
    start = max(0, (len(heard) - times) // 2)
    part = list(heard[start : start + times])
    given = given or BearingTracking()
    kept = given.filter if isinstance(given.filter, Estimation) else BatchMap()
    asked = BearingTracking(
        sigma_deg=given.sigma_deg, emitters=OneEmitter(), filter=BatchMap(bias=kept.bias, loss=kept.loss)
    )
    names = ["q"] if given.sigma_deg else ["sigma_deg", "q"]
    names += ["q_vertical"] if solid else []
    plain = best = _most_evidence(asked, tuple(names), FIRST, part, sites)
    if not math.isfinite(plain.level):
        raise DataError("fit: no path of one emitter explains the bearings; look at the azimuths and the places.")
    # two lines cross wherever their sensors err: an error that wanders looks like a path
    crossed = np.median([len(set(times.sensor.tolist())) for times in heard]) > 2  # type: ignore[union-attr]
    if not kept.bias:
        begun = FIRST | dict(zip(plain.names, np.exp(plain.logs).tolist(), strict=True))
        best = _most_evidence(asked, (*names, "north"), begun, part, sites)
        left = _scale(part, best.parameters, sites, solid)
        if crossed and left.correlation > BY_CHANCE / math.sqrt(max(left.number, 1.0)):
            # what wanders is no part of the bearings' own deviation
            parted = begun | {"sigma_deg": begun["sigma_deg"] / 2, "north": 2 * begun["north"]}
            other = _most_evidence(asked, (*names, "north", "memory"), parted, part, sites)
            best = max(best, other, key=lambda one: one.level)
        if given.sigma_deg:
            freer = _most_evidence(asked.replace(sigma_deg=None), ("sigma_deg", *names), FIRST, part, sites)
            # the deviation that is told is wrong, which is another thing to say
            told_less = freer.parameters.deviation_deg > given.sigma_deg
            best = plain if told_less and best.level < freer.level + TWENTY_TO_ONE else best
    scale = _scale(part, best.parameters, sites, solid)
    covered = scale.persists and not crossed
    if covered:
        best, scale = plain, _scale(part, plain.parameters, sites, solid)
    sigma_deg = best.parameters.deviation_deg
    if not given.sigma_deg:
        # the robust loss, heavier in its tails than the noise, likes a deviation that is too small
        sigma_deg = min(sigma_deg * max(scale.half, 1.0), MOST_DEG)
        for _ in range(ROUNDS if covered else 0):
            again = _scale(part, best.parameters.replace(sigma_deg=sigma_deg), sites, solid)
            sigma_deg = min(sigma_deg * max(again.lasting, 1e-3) / COVER, MOST_DEG)
    return _told(best, sigma_deg)


def _scale(part: Sequence[PlaceSet], parameters: BearingTracking, sites: SensorSites, solid: bool) -> Scale:
    assert isinstance(parameters.filter, Estimation)
    steps = list(track(part, parameters, sites))
    return scale_of(leftovers(steps, parameters.sensor_of(sites, BearingSet, solid), parameters.filter))


def _most_evidence(
    asked: BearingTracking,
    names: tuple[str, ...],
    first: dict[str, float],
    part: Sequence[PlaceSet],
    sites: SensorSites,
) -> _Found:
    """Seek the settings of most evidence, each path near the likeliest before."""
    settings, last = [SETTINGS[name] for name in names], list[tuple[SmoothedPath, float]]()
    least, width = math.inf, 6 if "q_vertical" in names else 4

    def cost(logs: Array) -> float:
        nonlocal least
        parameters = _with(asked, names, logs, part)
        path = whole_path(parameters, part, sites, _scaled(last[-1], parameters, width) if last else None)
        if path is None or not math.isfinite(path.log_evidence):
            return 1e300
        found = -path.log_evidence - _beforehand(names, logs)
        if found < least and "north" in names:  # where nothing persists a path is found at once
            least, last[:] = found, [(path, _bias_deg(parameters))]
        return found

    begun = np.log([first[name] for name in names])
    bounds = [(math.log(setting.least), math.log(setting.greatest)) for setting in settings]
    corners = np.vstack([begun, *(begun + row for row in np.diag([setting.step for setting in settings]))])
    options = {"maxfev": EVALUATIONS, "xatol": 0.05, "fatol": 0.2, "initial_simplex": corners}
    found = minimize(cost, begun, method="Nelder-Mead", bounds=bounds, options=options)
    level = -found.fun if found.fun < 1e299 else -math.inf
    errors = np.array([_error(cost, found.x, found.fun, row) for row in np.eye(len(names))])
    return _Found(names, found.x, errors, level, _with(asked, names, found.x, part))


def _with(asked: BearingTracking, names: Sequence[str], logs: Array, part: Sequence[PlaceSet]) -> BearingTracking:
    """Return the parameters with settings."""
    value = dict(zip(names, np.exp(logs).tolist(), strict=True))
    changes: dict[str, Any] = {"motion": Cruise(q=value["q"])}
    if "sigma_deg" in value:
        changes["sigma_deg"] = value["sigma_deg"]
    if "q_vertical" in value:
        changes["elevations"] = UseElevations(q_vertical=value["q_vertical"])
    if "north" in value:
        sd_deg = value["north"] * value.get("sigma_deg", asked.deviation_deg)
        memory = {"memory_s": value["memory"] * _interval(part)} if "memory" in value else {}
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


def _interval(part: Sequence[PlaceSet]) -> float:
    """Return the usual time from one measurement to the next [s]."""
    return float(np.median(np.diff([times.time_s for times in part]))) if len(part) > 1 else 1.0


def _told(best: _Found, sigma_deg: float) -> Fit:
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


def _error(cost: Callable[[Array], float], at: Array, least: float, way: Array) -> float:
    """Deviation of a logarithm, by the evidence's curvature along it."""
    curvature = (cost(at + STEP * way) + cost(at - STEP * way) - 2 * least) / STEP**2
    return 1 / math.sqrt(curvature) if 0 < curvature < 1e200 else math.nan
