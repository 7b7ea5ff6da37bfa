"""Interacting multiple models of any motion and sensor: a manoeuvre need not be known beforehand.

Blom and Bar-Shalom (1988), IEEE Trans. Automat. Contr. 33(8): a bank of extended Kalman filters, one a model, mixed
before each step. The models may differ in their states. It starts as the extended Kalman filter does.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field, model_validator

from elusive.contracts import Array, interval_since
from elusive.filters.gaussian._block_kernels import marginals
from elusive.filters.gaussian._interacting_kernels import Bank, advanced, combined, mixed
from elusive.filters.gaussian.parts import AnyMotion
from elusive.filters.gaussian.problem import Problem, Setting
from elusive.filters.priors import GaussianPrior
from elusive.model import Positive
from elusive.motion import ConstantAcceleration, ConstantTurnRateVelocity, ConstantVelocity
from elusive.runner import timed
from elusive.sensors.bearing_table import tabulated

DEFAULT_MOTIONS = (
    ConstantVelocity(q=0.1),
    ConstantAcceleration(q=1.0),
    ConstantTurnRateVelocity(q_speed=1.0, q_turn=0.003),
)


class InteractingState(NamedTuple):
    """A Gaussian belief over what all models have in common, and the belief of each model."""

    time_s: float  # NaN before the first measurement, where the prior has no time
    mean: Array  # (n,)
    covariance: Array  # (n, n)
    log_evidence: float  # log p(measurement | earlier ones); 0 while the filter has not started, and without one
    bank: Bank
    pending: tuple[tuple[float, Any], ...] | None  # bearings before they gave a place; None once it has started


class ModelPath(NamedTuple):
    """A belief at each time, and the probability of each model."""

    times_s: Array  # (K,)
    states: Array  # (K, n)
    covariances: Array  # (K, n, n)
    probabilities: Array  # (K, m)
    log_evidence: float
    started: int  # row of the time from which on the filter ran


class InteractingFilter(Setting):
    """Several motions at once, each as probable as it predicts the measurements.

    A prior is of the components that all motions have; what a motion has beside them starts at nought.
    """

    motions: tuple[AnyMotion, ...] = Field(
        DEFAULT_MOTIONS, min_length=1, description="Motions between which the target changes"
    )
    stay_s: Positive = Field(10.0, description="Mean time for which a motion lasts; then any other follows [s]")
    iterations: int = Field(3, gt=0, le=100, description="Linearisations of an update; 1: plain extended filters")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self.problems  # noqa: B018 - each refuses what does not fit it
        return self

    @cached_property
    def problems(self) -> tuple[Problem, ...]:
        """The same problem with each motion."""
        shared = {name: getattr(self, name) for name in Setting.model_fields if name != "prior"}
        return tuple(Problem(motion=motion, prior=self._prior(motion), **shared) for motion in self.motions)

    def _prior(self, motion: Any) -> GaussianPrior | None:
        if self.prior is None:
            return None
        names, common = motion.state_names, _common([motion.state_names for motion in self.motions])
        if len(self.prior.mean) != len(common):
            raise ValueError(
                f"prior: its mean has {len(self.prior.mean)} components; give those that all motions have, "
                f"{', '.join(common)}"
            )
        own = [names.index(name) for name in common]
        mean, covariance = np.zeros(len(names)), np.diag(self.start_deviations(names) ** 2)
        mean[own], covariance[np.ix_(own, own)] = self.prior.mean, self.prior.covariance
        return GaussianPrior(mean=mean.tolist(), covariance=covariance.tolist())

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the components that all motions have."""
        return _common([problem.state_names for problem in self.problems])

    @cached_property
    def _columns(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """Columns of each model's components among all, how many it has, and the columns that all have."""
        names = [problem.state_names for problem in self.problems]
        every = list(dict.fromkeys(name for own in names for name in own))
        columns = np.zeros((len(names), len(every)), np.intp)
        for row, own in zip(columns, names, strict=True):
            row[: len(own)] = [every.index(name) for name in own]
        return columns, np.array([len(own) for own in names]), np.array([every.index(n) for n in self.state_names])

    def init(self, rng: Generator, time_s: float = math.nan) -> InteractingState:
        """Return the belief before the first measurement; nothing is drawn."""
        bank = self._bank([problem.first() for problem in self.problems])
        pending = () if math.isnan(time_s) else ((time_s, None),)
        return self._state(time_s, bank, 0.0, pending if self.prior is None else None)

    def step(self, state: InteractingState, time_s: float, measurement: Any | None, rng: Generator) -> InteractingState:
        """Return the belief at a time and with its measurement; None: without.

        Raises
        ------
        DataError
            If a measurement cannot be used or its time is before the state's.
        """
        interval_s = interval_since(state.time_s, time_s)
        if state.pending is not None:
            if measurement is None and not state.pending:
                return state
            pending = (*state.pending, (time_s, measurement))
            found = [problem.started(problem.stretch(pending)) for problem in self.problems]
            bank = self._bank([(path.path[-1], marginals(path.L, path.Y)[-1]) for path, _ in found])
            return self._state(time_s, bank, 0.0, None if all(placed for _, placed in found) else pending)
        columns, sizes, _ = self._columns
        if all(problem.compiled for problem in self.problems):
            nothing = self.sensor.nothing(time_s) if measurement is None else measurement
            table = tabulated((nothing,), self.sensor, (time_s,))
            models = tuple(problem.stepped(interval_s) for problem in self.problems)
            bank, log_evidence = advanced(
                state.bank, table, 0, 0, models, columns, sizes, self.stay_s, self.robust, self.iterations
            )
            return self._state(time_s, bank, log_evidence, None)
        bank = mixed(state.bank, columns, sizes, math.exp(-interval_s / self.stay_s))
        densities = np.empty(len(sizes))
        for j, problem in enumerate(self.problems):
            own = columns[j, : sizes[j]]
            belief = problem.predicted(bank.means[j, own], bank.covariances[j][np.ix_(own, own)], interval_s)
            mean, covariance, densities[j] = problem.updated(time_s, *belief, measurement, self.iterations)
            bank.means[j, own], bank.covariances[j][np.ix_(own, own)] = mean, covariance
        weights = np.log(bank.probabilities) + densities
        log_evidence = float(np.logaddexp.reduce(weights))
        return self._state(time_s, bank._replace(probabilities=np.exp(weights - log_evidence)), log_evidence, None)

    def track(self, measurements: Iterable[Any | None], times_s: Iterable[float] | None = None) -> ModelPath:
        """Filter a recording; arguments and errors as of :meth:`Problem.recorded`."""
        rng, recorded = np.random.default_rng(0), list(timed(measurements, times_s))
        self.problems[0].recorded([m for m, _ in recorded], [time_s for _, time_s in recorded])
        state, path, log_evidence = self.init(rng), list[InteractingState](), 0.0
        for measurement, time_s in recorded:
            if path and path[-1].time_s == time_s:
                path.pop()
            state = self.step(state, time_s, measurement, rng)
            log_evidence += state.log_evidence
            path.append(state)
        return ModelPath(
            np.array([state.time_s for state in path]),
            np.array([state.mean for state in path]),
            np.array([state.covariance for state in path]),
            np.array([state.bank.probabilities for state in path]),
            log_evidence,
            min(sum(state.pending is not None for state in path), len(path) - 1),
        )

    def _state(self, time_s: float, bank: Bank, log_evidence: float, pending: Any) -> InteractingState:
        return InteractingState(time_s, *combined(bank, self._columns[2]), log_evidence, bank, pending)

    def _bank(self, beliefs: list[tuple[Array, Array]]) -> Bank:
        columns, sizes, _ = self._columns
        m, whole = columns.shape
        means, covariances = np.zeros((m, whole)), np.zeros((m, whole, whole))
        for j, (mean, covariance) in enumerate(beliefs):
            own = columns[j, : sizes[j]]
            means[j, own] = mean
            covariances[j][np.ix_(own, own)] = covariance
        return Bank(np.full(m, 1 / m), means, covariances)


def _common(names: list[tuple[str, ...]]) -> tuple[str, ...]:
    return tuple(name for name in names[0] if all(name in other for other in names))
