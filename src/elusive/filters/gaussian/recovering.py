"""A live filter of bearings that is not sure of what bearings contradict: perhaps the emitter has manoeuvred.

A robust loss takes what a belief does not expect for strays, and with a motion that is too calm all that comes after a
manoeuvre. Here a second belief is opened where bearings contradict the first, with everything that an emitter may have
done since two sensors last agreed (Bar-Shalom, Li and Kirubarajan, 2001, sections 11.2 and 11.6); both go on, as
probable as they predict what is heard, strays included (Bar-Shalom and Tse, 1975, Automatica 11(5)), and their
moments together are the belief.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array, X, Y, interval_since
from elusive.filters.gaussian._bearing_kernels import HEIGHT, bearing_rows, curvature
from elusive.filters.gaussian._block_kernels import marginals
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter, ExtendedState
from elusive.filters.gaussian.fixed_lag import FixedLagSmoother, FixedLagState, Window
from elusive.filters.gaussian.problem import Problem, anchored
from elusive.sensors.bearing_sets import BearingSet
from elusive.sensors.bearing_table import tabulated
from elusive.sensors.bearings import BearingSensors

STRAY = 0.05  # probability that a bearing is of any direction
MANOEUVRE = 0.01  # probability, at a time that contradicts a belief, of a manoeuvre beyond what the motion allows
EXPECTED, CONTRADICTED = 3.0, 4.0  # deviations of a bearing that agrees with a belief, and of one that does not
FORGOTTEN = -7.0  # log odds of a belief that is given up
BENT_MOST = 1.0  # bend of a bearing over a place [rad]: beyond it the direction is not known at all
DESCENT, TOLERANCE = 50, 1e-3  # steps, and length of the last one, to the place that fits after a manoeuvre


class Hypothesis(NamedTuple):
    """One belief of the two."""

    state: ExtendedState | FixedLagState
    reopened: bool = False  # after a manoeuvre, and no two sensors agree with it yet


class RecoveringState(NamedTuple):
    """The belief now, of both hypotheses together."""

    time_s: float  # NaN before the first measurement
    mean: Array  # (d,)
    covariance: Array  # (d, d)
    log_evidence: float  # of the likelier one's measurement; NaN where its filter has none
    started: bool  # whether a place is known
    likelier: Hypothesis
    other: Hypothesis | None
    log_odds: float  # of the other one
    agreed_s: float  # when two sensors last agreed with the likelier one; NaN before

    @property
    def reopened(self) -> bool:
        """Whether it rather has manoeuvred, and no two sensors have agreed since."""
        return self.likelier.reopened


class _Belief(NamedTuple):
    mean: Array
    covariance: Array


def recovers(flt: Any) -> bool:
    """Say whether a filter is one of bearings that takes what contradicts it for strays."""
    live = isinstance(flt, FixedLagSmoother | ExtendedKalmanFilter)
    return live and flt.compiled and isinstance(flt.sensor, BearingSensors) and flt.loss != "squares"


class RecoveringFilter:
    """Steps as its filter does, and opens a second belief where bearings contradict the first.

    Parameters
    ----------
    flt
        The filter; :func:`recovers` holds.
    """

    def __init__(self, flt: ExtendedKalmanFilter | FixedLagSmoother) -> None:
        self.filter, self.state_names = flt, flt.state_names
        shared = {name: getattr(flt, name) for name in Problem.model_fields}
        # a window of one sensor's bearings has no place of its own: after a manoeuvre it begins where two agree
        self._single = flt if isinstance(flt, ExtendedKalmanFilter) else ExtendedKalmanFilter(**shared)
        self._trusting = flt.replace(loss="squares")

    def init(self, rng: Generator, time_s: float = math.nan) -> RecoveringState:
        """Return the belief before the first measurement; nothing is drawn."""
        return self._together(Hypothesis(self.filter.init(rng, time_s)), None, -math.inf, math.nan)

    def step(
        self, state: RecoveringState, time_s: float, measurement: BearingSet | None, rng: Generator
    ) -> RecoveringState:
        """Return the belief at a time and with its measurement; None: without.

        Raises
        ------
        DataError
            If a measurement cannot be used or its time is before the state's.
        """
        interval_since(state.time_s, time_s)
        likelier, other, log_odds, agreed_s = state[5:]
        if not state.started or measurement is None or not len(measurement.sensor):
            likelier = self._stepped(likelier, time_s, measurement, rng)
            other = None if other is None else self._stepped(other, time_s, measurement, rng)
            agreed_s = time_s if math.isnan(agreed_s) and _started(likelier.state) else agreed_s
            return self._together(likelier, other, log_odds, agreed_s)
        expected, far = self._heard(self._ahead(likelier, time_s), time_s, measurement)
        contradicted = any(size > CONTRADICTED for _, size in far)
        if other is not None:
            density, farther = self._heard(self._ahead(other, time_s), time_s, measurement)
            log_odds += density - expected
            # a third explanation is sought where neither will do
            contradicted &= all(size > CONTRADICTED for _, size in farther) or log_odds < math.log(MANOEUVRE)
        after = self._stepped(likelier, time_s, measurement, rng)
        fresh = False
        if contradicted:
            since = agreed_s if agreed_s < time_s else likelier.state.time_s
            free = self._freed(self._ahead(likelier, time_s), time_s - since)
            odds = math.log(MANOEUVRE) + self._heard(free, time_s, measurement)[0] - expected
            if odds > max(FORGOTTEN, log_odds):
                other, log_odds, fresh = self._settled(free, time_s, measurement), odds, True
        if other is not None and not fresh:
            other = self._stepped(other, time_s, measurement, rng)
        if other is not None and log_odds > 0:
            after, other, log_odds = other, after, -log_odds
        if log_odds < FORGOTTEN:
            other, log_odds = None, -math.inf
        if other is None and len({sensor for sensor, size in far if size < EXPECTED}) > 1:
            after, agreed_s = Hypothesis(self._own(after.state)), time_s
        return self._together(after, other, log_odds, agreed_s)

    def _ahead(self, hypothesis: Hypothesis, time_s: float) -> _Belief:
        state = hypothesis.state
        return _Belief(*self.filter.predicted(state.mean, state.covariance, time_s - state.time_s))

    def _stepped(
        self, hypothesis: Hypothesis, time_s: float, measurement: BearingSet | None, rng: Generator
    ) -> Hypothesis:
        """Step one belief; one that is vague is not linearised where it is, but where the bearings cross."""
        state = hypothesis.state
        if hypothesis.reopened and measurement is not None and len(np.unique(measurement.sensor)) > 1:
            return self._settled(self._ahead(hypothesis, time_s), time_s, measurement)
        flt: Any = self._single if isinstance(state, ExtendedState) else self.filter
        return hypothesis._replace(state=flt.step(state, time_s, measurement, rng))

    def _heard(self, belief: _Belief, time_s: float, measurement: BearingSet) -> tuple[float, list[tuple[int, float]]]:
        """Log density of bearings that may be strays, and how many deviations those of each sensor are off."""
        (mean, P), T = belief, self.filter.stepped(0.0)
        table = tabulated((measurement,), self.filter.sensor, (time_s,))
        residual, H = np.empty(2), np.empty((2, len(mean)))
        total, far = 0.0, list[tuple[int, float]]()
        for row in range(len(table.sensor)):
            n = bearing_rows(table, row, mean, T, residual, H, 0)
            if not n:
                continue
            off, slope = residual[:n], H[:n]
            spread = P[X, X] + P[Y, Y] + (P[HEIGHT, HEIGHT] if T.solid else 0.0)
            bend = min(curvature(table, row, mean, spread, T.solid), BENT_MOST)
            S = slope @ P @ slope.T + (table.variance[row] + bend**2) * np.eye(n)
            inverse = np.linalg.inv(S)
            squared = float(off @ inverse @ off)
            its = math.log1p(-STRAY) - 0.5 * (squared + math.log((2 * math.pi) ** n * np.linalg.det(S)))
            stray = math.log(STRAY / (2 * math.pi * (math.pi if n == 2 else 1.0)))
            density = float(np.logaddexp(its, stray))
            total += density
            far.append((int(table.sensor[row]), math.sqrt(squared / n)))
            sure = math.exp(its - density)
            gain = P @ slope.T @ inverse
            moved = gain @ off
            mean = mean + sure * moved
            P = P - sure * gain @ slope @ P + sure * (1 - sure) * np.outer(moved, moved)
        return total, far

    def _freed(self, belief: _Belief, since_s: float) -> _Belief:
        """Return a belief with all that an emitter may have done for so long: any velocity that one starts with."""
        names, P = list(self.state_names), belief.covariance.copy()
        variance = dict(zip(names, self.filter.start_deviations(names) ** 2, strict=True))
        for place, speed in (("x", "vx"), ("y", "vy"), ("z", "vz")):
            if place in names:
                i, j, power = names.index(place), names.index(speed), variance[speed]
                P[i, i] += power * since_s**2 / 3
                P[i, j] += power * since_s / 2
                P[j, i] = P[i, j]
                P[j, j] += power
        for name in {"ax", "ay", "turn_rate"} & set(names):
            P[names.index(name), names.index(name)] += variance[name]
        return _Belief(belief.mean, P)

    def _settled(self, belief: _Belief, time_s: float, measurement: BearingSet) -> Hypothesis:
        """Update a vague belief by damped descents from where all bearings cross, and all but one sensor's.

        Each end has the probability of its surroundings (Laplace): on a sensor any bearing fits, but hardly anywhere.
        """
        vague = belief.mean[None], belief.covariance[None]
        anchor, whole = anchored(*belief), self.filter.stretch([(time_s, measurement)])
        sensors = np.unique(measurement.sensor).tolist()
        means, spreads, logs = list[Array](), list[Array](), list[float]()
        for left_out in (None, *(sensors if len(sensors) > 2 else ())):
            part = self._trusting.stretch([(time_s, _without(measurement, left_out))])
            start = part.settle(*vague, anchor, DESCENT, TOLERANCE)
            end = whole.settle(start.path, vague[1], anchor, DESCENT, TOLERANCE)
            means.append(end.path[-1])
            spreads.append(marginals(end.L, end.Y)[-1])
            logs.append(-float(end.cost) - float(np.log(np.diag(end.L[-1])).sum()))
        weights = np.exp(np.array(logs) - max(logs))
        weights /= weights.sum()
        mean = weights @ np.array(means)
        off = np.array(means) - mean
        P = np.einsum("m,mij->ij", weights, np.array(spreads)) + np.einsum("m,mi,mj->ij", weights, off, off)
        return Hypothesis(ExtendedState(time_s, mean, P, 0.0, None), True)

    def _own(self, state: ExtendedState | FixedLagState) -> ExtendedState | FixedLagState:
        """Return a belief as the filter's own."""
        if isinstance(self.filter, ExtendedKalmanFilter) or isinstance(state, FixedLagState):
            return state
        mean, P, d = state.mean, state.covariance, len(state.mean)
        window = Window(self.filter.stretch([(state.time_s, None)]), anchored(mean, P), mean[None], P[None])
        none = np.empty(0), np.empty((0, d)), np.empty((0, d, d))
        return FixedLagState(state.time_s, mean, P, *none, window, True)

    def _together(
        self, likelier: Hypothesis, other: Hypothesis | None, log_odds: float, agreed_s: float
    ) -> RecoveringState:
        state = likelier.state
        mean, covariance = state.mean, state.covariance
        if other is not None:
            share, away = 1 / (1 + math.exp(-log_odds)), other.state.mean - mean
            mean = mean + share * away
            within = (1 - share) * covariance + share * other.state.covariance
            covariance = within + share * (1 - share) * np.outer(away, away)
        evidence = state.log_evidence if isinstance(self.filter, ExtendedKalmanFilter) else math.nan  # type: ignore[union-attr]
        return RecoveringState(
            state.time_s, mean, covariance, evidence, _started(state), likelier, other, log_odds, agreed_s
        )


def _started(state: ExtendedState | FixedLagState) -> bool:
    return state.started if isinstance(state, FixedLagState) else state.pending is None


def _without(measurement: BearingSet, sensor: int | None) -> BearingSet:
    """Return bearings without those of a sensor."""
    kept = np.flatnonzero(measurement.sensor != (-1 if sensor is None else sensor))
    places = None if measurement.places_m is None else measurement.places_m[kept]
    angles = measurement.azimuth_rad[kept], measurement.elevation_rad[kept]
    return BearingSet(measurement.time_s, measurement.sensor[kept], *angles, places)
