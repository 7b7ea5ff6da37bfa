"""One run of every filter on one route: the same measurements through no map, a hard one and imprecise ones.

Bootsveld (2012), section 6.3.2: PF1 none, PF2 hard, PF3 nearest, PF4 grid; beside them exact, field, and the persistent
error that his section 8.2 asks for.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.campaign import Scenario
from elusive.contracts import Array, Motion, X, Y
from elusive.experiments.imprecise_chart.charts import Case, charts
from elusive.experiments.imprecise_chart.route import Route, Routes
from elusive.filters.particle.sir import ParticleFilter, ParticleState
from elusive.geometry.local_frame import Geometries
from elusive.model import Positive
from elusive.motion import ConstantVelocity, WithCoastError, complete
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.scan_prior import ScanPrior

SIGMAS = (7.0, 20.0)  # the thesis's
CASES = (
    Case("none"),
    Case("hard"),
    *(Case(knowledge, sigma) for sigma in SIGMAS for knowledge in ("nearest", "grid", "exact", "field")),
    Case("field"),  # by quality: a grid for its finest areas is too large, a sum over its coarsest too slow
    *(Case("field", sigma, "persistent") for sigma in (*SIGMAS, None)),
)
LEAST_VARIANCE = 1e-2  # added to a position's variances: a cloud may be a single particle [m^2]


class ImpreciseChartTrial(Routes):
    """The routes, the radar and the filters."""

    fine: str = Field(description="Path of the chart along whose coast the ship goes")
    coarse: str = Field(description="Path of the chart that the filters have")
    cases: tuple[Case, ...] = Field(CASES, min_length=1, description="What each filter knows")
    particles: int = Field(2000, gt=0, description="Number of particles")
    max_acceleration_mps2: Positive = Field(5.0, description="a_max, three deviations of the acceleration [m/s^2]")


class Run(NamedTuple):
    """A ship's route, and what the radar measured of it."""

    route: Route
    sensor: RadarSensor
    scans: list[RadarScan]


def trial(parameters: ImpreciseChartTrial, rng: Generator) -> dict[str, Array]:
    """Draw a route and its measurements, and follow the ship with every filter.

    Returns
    -------
    dict
        Each ``(case, time)``: ``error`` of the position [m]; ``seaward``, its part away from the fine chart's coast;
        ``squared``, its squared Mahalanobis distance by the filter's own covariance; ``left_out``, whether the map was.
        ``depth (time)``: how far into the coarse chart's land the ship is, negative at sea [m].
    """
    drawn = simulate(parameters, rng)
    seed = int(rng.integers(2**63))  # the same for every filter: their differences carry less noise
    places = drawn.route.states[:, [X, Y]]
    away = charts(parameters.fine, parameters.coarse).away(places)
    found = []
    for case in parameters.cases:
        states = follow(parameters, case, drawn, np.random.default_rng(seed))
        off = np.array([state.mean[[X, Y]] for state in states]) - places
        covariance = np.array([state.covariance[np.ix_([X, Y], [X, Y])] for state in states])
        covariance += LEAST_VARIANCE * np.eye(2)
        squared = (off * np.linalg.solve(covariance, off[:, :, None])[:, :, 0]).sum(axis=1)
        left_out = np.array([state.forbidden for state in states])
        found.append((np.hypot(*off.T), (off * away).sum(axis=1), squared, left_out))
    error, seaward, squared, left_out = (np.stack(part) for part in zip(*found, strict=True))
    depth = charts(parameters.fine, parameters.coarse).depth(places)
    return {"error": error, "seaward": seaward, "squared": squared, "left_out": left_out, "depth": depth}


def simulate(parameters: ImpreciseChartTrial, rng: Generator) -> Run:
    """Draw a route along the fine chart's coast, and a plot a second."""
    route = parameters.draw(shores(parameters), rng)
    sensor = RadarSensor(x_m=float(route.radar[0]), y_m=float(route.radar[1]))
    scans = [sensor.simulate(state[None], rng, float(second)) for second, state in enumerate(route.states)]
    return Run(route, sensor, scans)


def follow(parameters: ImpreciseChartTrial, case: Case, drawn: Run, rng: Generator) -> list[ParticleState]:
    """Track a ship; the belief after each measurement, the first included."""
    motion: Motion = ConstantVelocity(q=(parameters.max_acceleration_mps2 / 3) ** 2)
    if case.coast_error == "persistent":
        motion = WithCoastError(motion=motion)
    sensor, (first, *later) = drawn.sensor, drawn.scans
    about_plot = ScanPrior(sensor, first)
    chosen = ParticleFilter(
        motion=motion,
        sensor=sensor,
        prior=about_plot,
        knowledge=charts(parameters.fine, parameters.coarse).knowledge(case),
        particles=parameters.particles,
    )
    started = complete(motion, about_plot.sample(parameters.particles, rng), rng)
    states = [chosen.start(started, first.time_s)]
    for scan in later:
        states.append(chosen.step(states[-1], scan.time_s, scan, rng))
    return states


OF_CASE = ("case", "time")
SCENARIO = Scenario(
    trial,
    ImpreciseChartTrial,
    {"error": OF_CASE, "seaward": OF_CASE, "squared": OF_CASE, "left_out": OF_CASE, "depth": ("time",)},
)


@lru_cache(maxsize=8)
def shores(parameters: ImpreciseChartTrial) -> Geometries:
    """Find the curves that routes are taken from, once a process."""
    both = charts(parameters.fine, parameters.coarse)
    return parameters.curves(both.fine, both.frame)
