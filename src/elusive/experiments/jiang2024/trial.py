"""One run of Jiang et al. (2024), section 4: a flight, and every estimator on the same bearings."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.random import Generator

from elusive.campaign import Scenario
from elusive.contracts import Array, X, Y
from elusive.experiments.jiang2024.scenario import STEP_NOISE_M, Flight, FlightCase, MotionName
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.factor_graph import FactorGraphFilter
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.filters.gaussian.parts import BuiltInMotion
from elusive.metrics.consistency import squared_deviations
from elusive.motion import ConstantAcceleration, ConstantTurnRateVelocity, ConstantVelocity

EstimatorName = Literal["fg-ekf", "fg-eks", "iekf", "rts", "map"]
ESTIMATORS: dict[EstimatorName, str] = {
    "fg-ekf": "FG-EKF, the paper's filter",
    "fg-eks": "FG-EKS, the paper's smoother",
    "iekf": "iterated EKF on the bearings",
    "rts": "RTS smoother on it",
    "map": "batch MAP on the factor graph",
}
GROUND = [X, Y]
# each flight's own motion; the noise is in the displacements, so what drives the velocities is next to nothing
MOVES: dict[MotionName, BuiltInMotion] = {
    "cv": ConstantVelocity(q=1e-4),
    "ca": ConstantAcceleration(q=1e-6),
    "ctrv": ConstantTurnRateVelocity(q_speed=1e-4, q_turn=1e-8),
}
IEKF_ITERATIONS = 10


class Estimators(NamedTuple):
    """Those of a case."""

    graph: FactorGraphFilter
    kalman: ExtendedKalmanFilter
    batch: MapSmoother


def trial(case: FlightCase, rng: Generator) -> dict[str, Array]:
    """Draw a flight and estimate it.

    Returns
    -------
    dict
        ``estimate (estimator, step, axis)`` and ``truth (step, axis)`` [m]; ``mean_square (estimator,)`` [m^2] and
        ``nees (estimator,)``, over the steps of the flight.
    """
    flight = case.simulate(rng)
    truth = flight.states[:, GROUND]
    found = [estimate(name, case, flight) for name in ESTIMATORS]
    off = [places - truth for places, _ in found]
    nees = [squared_deviations(each, spread).mean() for each, (_, spread) in zip(off, found, strict=True)]
    return {
        "estimate": np.stack([places for places, _ in found]),
        "truth": truth,
        "mean_square": np.array([(each**2).sum(axis=1).mean() for each in off]),
        "nees": np.array(nees),
    }


def estimate(name: EstimatorName, case: FlightCase, flight: Flight) -> tuple[Array, Array]:
    """Places ``(T, 2)`` and covariances ``(T, 2, 2)`` by an estimator that knows how the flight moves."""
    by = _estimators(case)
    if name in ("fg-ekf", "fg-eks"):
        path = by.graph.replace(smooth=name == "fg-eks").track(flight.azimuth_rad)
        return path.mean, path.variance[..., None] * np.eye(2)
    if name == "map":
        whole = by.batch.smooth(flight.sets)
        return _ground(whole.states, whole.covariances)
    filtered = by.kalman.track(flight.sets, smooth=name == "rts")
    return _ground(filtered.states, filtered.covariances)


@lru_cache(maxsize=16)
def _estimators(case: FlightCase) -> Estimators:
    graph = FactorGraphFilter(sensor=case.sensors, accelerates=case.motion != "cv", step_noise_m=STEP_NOISE_M)
    known = {"motion": MOVES[case.motion], "sensor": case.mean_sensors, "position_noise_m": STEP_NOISE_M}
    kalman = ExtendedKalmanFilter(iterations=IEKF_ITERATIONS, loss="squares", **known)
    return Estimators(graph, kalman, MapSmoother(loss="squares", **known))


def _ground(states: Array, covariances: Array) -> tuple[Array, Array]:
    return states[:, GROUND], covariances[:, GROUND][:, :, GROUND]


SCENARIO = Scenario(
    trial,
    FlightCase,
    {
        "estimate": ("estimator", "step", "axis"),
        "truth": ("step", "axis"),
        "mean_square": ("estimator",),
        "nees": ("estimator",),
    },
)
