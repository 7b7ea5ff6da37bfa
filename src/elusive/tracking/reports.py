"""Places that targets report of themselves, with a name, taken into tracks of detections at their own times.

A report is a target's, Gaussian about its place, or wrong and anywhere round it: each target's share is
the posterior probability of that (the outlier model of Box and Tiao, 1968, Biometrika 55(1), 119-129). A report moves
what is tracked and never says that it exists: one that is wrong is wrong again, and many are no more evidence than one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from elusive.contracts import VX, VY, Array, X, Y, interval_since
from elusive.filters.particle import _kernels
from elusive.tracking.detection_births import completed
from elusive.tracking.detection_targets import Target, expected
from elusive.tracking.detections import DetectionState, DetectionTracker
from elusive.tracking.extended_scan import ExtendedSensor
from elusive.tracking.lifecycle import Life

PLACE_SD_M, SPEED_SD_MPS = 15.0, 1.0  # of what ships report: position and aerial; speed, which begins tracks alone
WRONG, WRONG_SD_M = 0.05, 500.0
SURE = 0.5
NEW = 0.95  # existence of what reports where nobody looks
PLACE, SPEED = np.array([X, Y]), np.array([VX, VY])


class Report(NamedTuple):
    """What a target says of itself."""

    time_s: float
    name: int
    place: Array  # (2,) [m]
    velocity: Array  # (2,) [m/s]; NaN where it is not told


class Fused(NamedTuple):
    """A report taken in."""

    state: DetectionState
    taker: int | None  # place among the state's targets of the one that took it; None: none did


def fused(
    state: DetectionState, report: Report, tracker: DetectionTracker, rng: Generator, *, begins: bool
) -> Fused:  # fmt: skip
    """Take a report into the tracks, at its time, which is none before the state's.

    Parameters
    ----------
    state, tracker
        Of the tracks.
    report
        To take in.
    rng
        Source of the draws.
    begins
        Whether a report that is no track's begins one: where no sensor looks.
    """
    interval_s = interval_since(state.time_s, report.time_s)
    survival = math.exp(-interval_s / tracker.mean_life_s)
    alive = [
        expected(
            one, tracker.motion, interval_s, survival, (), tracker.particles, tracker.resample_below,
            tracker.kernel_width, rng,
        )
        for one in state.targets
        if one.life.status != "deleted"
    ]  # fmt: skip
    log_wrong = math.log(WRONG) - math.log(2 * math.pi * WRONG_SD_M**2)
    logs = [_log_density(one.particles, report, tracker) for one in alive]
    with np.errstate(divide="ignore"):
        made = np.array(
            [
                (1 - WRONG) * one.existence * float(one.weights @ np.exp(its - log_wrong))
                for one, its in zip(alive, logs, strict=True)
            ]
        )
    shares = made / (1 + made.sum())
    targets = []
    for one, its, share in zip(alive, logs, shares.tolist(), strict=True):
        weights = one.weights
        if share > 0:
            likely = np.exp(its - its.max())
            weights = weights * ((1 - share) + share * likely / float(weights @ likely))
            weights = weights / weights.sum()
        moments = _kernels.moments(one.particles, weights)
        targets.append(
            one.target._replace(
                existence=one.existence, particles=one.particles, weights=weights, mean=moments[0],
                covariance=moments[1], predicted=weights, detection=-1,
            )
        )  # fmt: skip
    taker = int(shares.argmax()) if len(shares) and shares.max() > SURE else None
    if taker is None and begins:
        targets.append(_begun(report, tracker, rng))
        taker = len(targets) - 1
    after = state._replace(
        time_s=report.time_s, targets=tuple(targets),
        undetected=survival * state.undetected + tracker.births_per_s * interval_s,
    )  # fmt: skip
    return Fused(after, taker)


def _log_density(states: Array, report: Report, tracker: DetectionTracker) -> Array:
    """Log density of a report as that of a target at each state, whose aerial is anywhere on it."""
    off = report.place - states[:, PLACE]
    spread = np.broadcast_to(PLACE_SD_M**2 * np.eye(2), (len(states), 2, 2))
    if isinstance(tracker.sensor, ExtendedSensor):
        spread = spread + tracker.sensor.room(states)
    xx, yy, xy = spread[:, 0, 0], spread[:, 1, 1], spread[:, 0, 1]
    size = xx * yy - xy**2
    squared = (yy * off[:, 0] ** 2 - 2 * xy * off[:, 0] * off[:, 1] + xx * off[:, 1] ** 2) / size
    return np.asarray(-0.5 * (squared + np.log(size)) - math.log(2 * math.pi))


def _begun(report: Report, tracker: DetectionTracker, rng: Generator) -> Target:
    """Begin a target at a report."""
    n = tracker.particles
    states = np.zeros((n, 4))
    states[:, PLACE] = report.place + PLACE_SD_M * rng.standard_normal((n, 2))
    told = not np.isnan(report.velocity).any()
    velocity, sd = (report.velocity, SPEED_SD_MPS) if told else (np.zeros(2), tracker.speed_sd_mps)
    states[:, SPEED] = velocity + sd * rng.standard_normal((n, 2))
    if isinstance(tracker.sensor, ExtendedSensor):
        states = tracker.sensor.extended(states, rng)
    further: Mapping[str, float] = tracker.further_sd
    particles = completed(tracker.motion, states, further, rng)
    weights = np.full(n, 1 / n)
    moments = _kernels.moments(particles, weights)
    least = tracker.forget_below * NEW / (1 - NEW)
    return Target(Life(), NEW, particles, weights, *moments, weights, -1, 0.0, 1.0, False, least)
