"""Interacting multiple models on bearings and arrivals: a manoeuvre need not be known beforehand.

Blom and Bar-Shalom (1988), IEEE Trans. Automat. Contr. 33(8): a bank of extended Kalman filters, one a model, mixed
before each step. The models may differ in their states. It starts as the extended Kalman filter does.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.gaussian._block_kernels import marginals
from elusive.filters.gaussian._interacting_kernels import Bank, advanced, combined
from elusive.filters.gaussian.bearing_problem import BearingMotion, BearingProblem, BearingSetting
from elusive.model import Positive
from elusive.motion import ConstantAcceleration, ConstantTurnRateVelocity, ConstantVelocity
from elusive.sensors.bearing_table import BearingTable, PlaceSet, tabulated

DEFAULT_MOTIONS = (
    ConstantVelocity(q=0.1),
    ConstantAcceleration(q=1.0),
    ConstantTurnRateVelocity(q_speed=1.0, q_turn=0.003),
)


class InteractingState(NamedTuple):
    """A Gaussian belief over what all models have in common, and the belief of each model."""

    time_s: float  # NaN before the first bearing
    mean: Array  # (n,)
    covariance: Array  # (n, n)
    log_evidence: float  # log p(bearings | earlier ones); 0 while the filter has not begun
    bank: Bank
    pending: tuple[PlaceSet, ...] | None  # bearings before the place was told; None once the filter has begun


class ModelPath(NamedTuple):
    """A belief at each time, and the probability of each model."""

    times_s: Array  # (K,)
    states: Array  # (K, n)
    covariances: Array  # (K, n, n)
    probabilities: Array  # (K, m)
    log_evidence: float
    begun: int  # row of the time from which on the filter ran


class InteractingFilter(BearingSetting):
    """Several motions at once, each as probable as it predicts the bearings."""

    motions: tuple[BearingMotion, ...] = Field(
        DEFAULT_MOTIONS, min_length=1, description="Motions between which the target changes"
    )
    stay_s: Positive = Field(10.0, description="Mean time for which a motion lasts; then any other follows [s]")
    iterations: int = Field(3, gt=0, le=100, description="Linearisations of an update; 1: plain extended filters")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self.problems  # noqa: B018 - each refuses what does not fit it
        return self

    @cached_property
    def problems(self) -> tuple[BearingProblem, ...]:
        """The same problem with each motion."""
        shared = {name: getattr(self, name) for name in BearingSetting.model_fields}
        return tuple(BearingProblem(motion=motion, **shared) for motion in self.motions)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the components that all motions have."""
        names = [problem.state_names for problem in self.problems]
        return tuple(name for name in names[0] if all(name in other for other in names))

    @cached_property
    def _columns(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """Columns of each model's components among all, how many it has, and the columns that all have."""
        names = [problem.state_names for problem in self.problems]
        every = list(dict.fromkeys(name for each in names for name in each))
        columns = np.zeros((len(names), len(every)), np.intp)
        for row, each in zip(columns, names, strict=True):
            row[: len(each)] = [every.index(name) for name in each]
        return columns, np.array([len(each) for each in names]), np.array([every.index(n) for n in self.state_names])

    def init(self, rng: Generator, time_s: float = np.nan) -> InteractingState:
        """Return the belief before the first bearing; nothing is drawn."""
        anchors = [problem.anchor() for problem in self.problems]
        bank = self._bank([(anchor.at, np.asarray(np.linalg.inv(anchor.information))) for anchor in anchors])
        return InteractingState(np.nan, *combined(bank, self._columns[2]), 0.0, bank, ())

    def step(
        self, state: InteractingState, time_s: float, measurement: PlaceSet | None, rng: Generator
    ) -> InteractingState:
        """Return the belief at the time of the bearings, with them; None: the prediction.

        Raises
        ------
        DataError
            If a bearing cannot be used or its time is not after the state's.
        """
        if measurement is None and np.isnan(state.time_s):
            return state
        if measurement is None:
            measurement = self.sensor.nothing(time_s)
        if measurement.time_s <= state.time_s:
            raise DataError(f"bearings at {measurement.time_s:g} s: come after {state.time_s:g} s; sort them by time.")
        columns, sizes, common = self._columns
        now = measurement.time_s
        if state.pending is not None:
            pending = (*state.pending, measurement)
            bank, told = self._begin(tabulated(pending, self.sensor))
            return InteractingState(now, *combined(bank, common), 0.0, bank, None if told else pending)
        table = tabulated((measurement,), self.sensor)
        models = tuple(problem.stepped(now - state.time_s) for problem in self.problems)
        bank, worth = advanced(
            state.bank, table, 0, 0, models, columns, sizes, self.stay_s, self.robust, self.iterations
        )
        return InteractingState(now, *combined(bank, common), worth, bank, None)

    def track(self, sets: Iterable[PlaceSet]) -> ModelPath:
        """Filter a recording.

        Raises
        ------
        DataError
            If a bearing cannot be used, times do not go forwards, or there is no bearing at all.
        """
        table = tabulated(sets, self.sensor)
        if not len(table.sensor):
            raise DataError("bearings: there is none; a path needs at least one.")
        columns, sizes, common = self._columns
        models = tuple(problem.transitions(table.times_s) for problem in self.problems)
        path = list[tuple[Array, Array]]()
        probabilities, log_evidence, begun, told = list[Array](), 0.0, 0, False
        bank = self.init(np.random.default_rng(0)).bank
        for k in range(len(table.times_s)):
            if told:
                bank, worth = advanced(
                    bank, table, k, k - 1, models, columns, sizes, self.stay_s, self.robust, self.iterations
                )
                log_evidence += worth
            else:
                begun = k
                bank, told = self._begin(table.between(0, k + 1))
            path.append(combined(bank, common))
            probabilities.append(bank.probabilities)
        means, covariances = (np.array(part) for part in zip(*path, strict=True))
        return ModelPath(table.times_s, means, covariances, np.array(probabilities), log_evidence, begun)

    def _begin(self, table: BearingTable) -> tuple[Bank, bool]:
        beliefs, all_told = list[tuple[Array, Array]](), True
        for problem in self.problems:
            found, told = problem.begin(table)
            beliefs.append((found.path[-1], marginals(found.L, found.Y)[-1]))
            all_told &= told
        return self._bank(beliefs), all_told

    def _bank(self, beliefs: list[tuple[Array, Array]]) -> Bank:
        columns, sizes, _ = self._columns
        m, whole = columns.shape
        means, covariances = np.zeros((m, whole)), np.zeros((m, whole, whole))
        for j, (mean, covariance) in enumerate(beliefs):
            own = columns[j, : sizes[j]]
            means[j, own] = mean
            covariances[j][np.ix_(own, own)] = covariance
        return Bank(np.full(m, 1 / m), means, covariances)
