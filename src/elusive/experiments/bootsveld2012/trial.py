"""One run of a trial of Bootsveld (2012): the same plots through every filter, each read by three estimators."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field

from elusive.campaign import Scenario
from elusive.contracts import Array, Knowledge, X, Y
from elusive.experiments.bootsveld2012.case import CANAL_METHODS, Method, ShipCase, knowledge, scenery
from elusive.filters.particle.particle_map import map_estimate, marginal_mode
from elusive.filters.particle.sir import ParticleFilter, ParticleState
from elusive.io import RadarScan
from elusive.sensors import ScanPrior

Estimate = Literal["mean", "map", "marginal"]
ESTIMATES: tuple[Estimate, ...] = ("mean", "map", "marginal")


class ShipTrial(ShipCase):
    """The case, and the filters that look at it."""

    methods: tuple[Method, ...] = Field(CANAL_METHODS, min_length=1, description="What the filters know of the chart")
    estimates: tuple[Estimate, ...] = Field(ESTIMATES, min_length=1, description="What is read from each belief")
    particles: int = Field(6000, gt=0, description="Particles of each filter")


class Step(NamedTuple):
    """A filter after one measurement."""

    time_s: int
    state: ParticleState
    before: ParticleState  # one second earlier


class Draw(NamedTuple):
    """What one run draws before any filter: the plots, and a seed that all filters share."""

    scans: Sequence[RadarScan]
    seed: int


def draw(case: ShipCase, rng: Generator) -> Draw:
    """Draw the plots of one run."""
    truth = scenery(case).truth
    scans = [case.radar.simulate(state[None], rng, float(time)) for time, state in enumerate(truth)]
    return Draw(scans, int(rng.integers(2**63)))


def filter_of(case: ShipCase, run: Draw, known: tuple[Knowledge, ...], particles: int) -> ParticleFilter:
    """Return the filter of one run; its prior is the first plot's."""
    prior = ScanPrior(case.radar, run.scans[0])
    return ParticleFilter(motion=case.motion, sensor=case.radar, prior=prior, knowledge=known, particles=particles)


def follow(model: ParticleFilter, run: Draw) -> Iterator[Step]:
    """Filter the plots after the first one, a step a second."""
    rng = np.random.default_rng(run.seed)
    before = model.init(rng, run.scans[0].time_s)
    for time, scan in enumerate(run.scans[1:], 1):
        state = model.step(before, scan.time_s, scan, rng)
        yield Step(time, state, before)
        before = state


def estimate(model: ParticleFilter, step: Step, scan: RadarScan, kind: Estimate, rng: Generator) -> Array:
    """Read a position ``(2,)`` from the belief [m].

    ``map`` is the thesis's: the particle of the greatest posterior density (Saha et al., 2009). ``marginal`` is the
    mode of each coordinate's own kernel density.
    """
    if kind == "mean":
        return step.state.mean[[X, Y]]
    if kind == "marginal":
        return np.array([marginal_mode(step.state, X), marginal_mode(step.state, Y)])
    return map_estimate(model, step.before, step.state, scan, rng)[[X, Y]]


def trial(parameters: ShipTrial, rng: Generator) -> dict[str, Array | NDArray[np.bool_]]:
    """Draw a run and filter it by every method.

    Returns
    -------
    dict
        ``error (method, estimate, time, axis)``, estimate less truth [m]; ``deviation (method, time, axis)``, the
        filter's own [m]; ``apart (method, time)``, the squared Mahalanobis distance of the true position from the
        mean; ``forbidden (method, time)``, whether the map was left out. Times from the first second on.
    """
    truth = scenery(parameters).truth[1:, [X, Y]]
    run = draw(parameters, rng)
    methods, times = len(parameters.methods), len(truth)
    error = np.empty((methods, len(parameters.estimates), times, 2))
    deviation, apart = np.empty((methods, times, 2)), np.empty((methods, times))
    forbidden = np.zeros((methods, times), dtype=bool)
    for number, method in enumerate(parameters.methods):
        model = filter_of(parameters, run, knowledge(parameters, method), parameters.particles)
        estimator = np.random.default_rng([run.seed, 1])
        for step in follow(model, run):
            at = step.time_s - 1
            for kind, name in enumerate(parameters.estimates):
                found = estimate(model, step, run.scans[step.time_s], name, estimator)
                error[number, kind, at] = found - truth[at]
            # a millimetre, where a few particles stand in one place
            covariance = step.state.covariance[np.ix_([X, Y], [X, Y])] + 1e-6 * np.eye(2)
            off = truth[at] - step.state.mean[[X, Y]]
            deviation[number, at] = np.sqrt(np.diag(covariance))
            apart[number, at] = off @ np.linalg.solve(covariance, off)
            forbidden[number, at] = step.state.forbidden
    return {"error": error, "deviation": deviation, "apart": apart, "forbidden": forbidden}


SCENARIO = Scenario(
    trial,
    ShipTrial,
    {
        "error": ("method", "estimate", "time", "axis"),
        "deviation": ("method", "time", "axis"),
        "apart": ("method", "time"),
        "forbidden": ("method", "time"),
    },
)
