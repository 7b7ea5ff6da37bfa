"""What every Gaussian filter shares: motion, sensor, what is known at the start, and how a belief moves and is updated.

Bar-Shalom, Li and Kirubarajan (2001), Estimation with applications to tracking and navigation, chapters 6 and 10. Any
motion and any linearisable sensor are taken as they are; bearings and arrivals with a linear motion or the constant
turn rate run compiled, and start from the sensors' geometry alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import cached_property
from typing import Any, Literal, Self

import numpy as np
from pydantic import ConfigDict, Field, model_validator
from scipy.linalg import block_diag

from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.filters.gaussian import _extended_kernels as kernels
from elusive.filters.gaussian._bearing_kernels import move
from elusive.filters.gaussian._map_kernels import Anchor, Descent, Loss, inverse_noise
from elusive.filters.gaussian._start_kernels import Start, guessed, started
from elusive.filters.gaussian.bearing_stretch import BearingStretch
from elusive.filters.gaussian.linearised import updated
from elusive.filters.gaussian.moments import Moved, moved
from elusive.filters.gaussian.parts import PLACE_SENSORS, AnyMotion, AnySensor, check_fits
from elusive.filters.gaussian.plain_stretch import PlainStretch
from elusive.filters.gaussian.robust import LOSSES
from elusive.filters.gaussian.transitions import FLOOR, STEP_DIGITS, AngleBias, Transitions, tabled, transitions_of
from elusive.filters.priors import GaussianPrior
from elusive.model import Model, NonNegative, Positive
from elusive.motion import ConstantVelocity
from elusive.runner import timed
from elusive.sensors.bearing_table import tabulated
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.hybrid import HybridSensors

KEPT_STEPS = 256  # tables of steps remembered
Stretch = BearingStretch | PlainStretch


class Setting(Model):
    """What is known of the sensors and of the start, whatever the motion."""

    model_config = ConfigDict(arbitrary_types_allowed=True)

    sensor: AnySensor = Field(description="Where bearings or arrivals are taken; or any sensor that is linearisable")
    prior: GaussianPrior | None = Field(
        None, description="Belief before the first measurement; none: bearings and arrivals start by themselves"
    )
    position_noise_m: NonNegative = Field(
        0.0, description="Deviation of a displacement at each step, each axis of the ground, epsilon of eq. 26 [m]"
    )
    bias: AngleBias | None = Field(None, description="Biases of the sensors' angles to estimate with the path")
    loss: Literal["squares", "cauchy", "huber"] = Field("cauchy", description="Loss of a reading's whitened residual")
    loss_k: float = Field(2.0, gt=1.5, le=100, description="Residual at which the robust loss bends, k [deviations]")
    start_sd_m: Positive | None = Field(
        None, description="Deviation of the first place about the sensors' centre; none: ten times their extent [m]"
    )
    start_speed_sd_mps: Positive = Field(30.0, description="Deviation of the first velocity, each axis [m/s]")
    start_acceleration_sd_mps2: Positive = Field(5.0, description="Deviation of the first acceleration [m/s^2]")
    start_turn_sd_deg: Positive = Field(20.0, description="Deviation of the first turn rate [deg/s]")

    @property
    def biased(self) -> int:
        """Sensors whose angles may have a bias."""
        sensor = self.sensor.bearings if isinstance(self.sensor, HybridSensors) else self.sensor
        return len(sensor.positions_m) if isinstance(sensor, BearingSensors) else 0

    @property
    def robust(self) -> Loss:
        """The loss, as compiled filters read it."""
        return Loss(LOSSES[self.loss], self.loss_k)

    def start_deviations(self, names: Iterable[str]) -> Array:
        """Deviations of a first state's components where no prior is given, ``(d,)``."""
        place = self.start_sd_m or (10 * self.extent_m if type(self.sensor) in PLACE_SENSORS else 1.0)
        known = {"x": place, "y": place, "z": place, "turn_rate": math.radians(self.start_turn_sd_deg)}
        known |= dict.fromkeys(("vx", "vy", "vz"), self.start_speed_sd_mps)
        known |= dict.fromkeys(("ax", "ay"), self.start_acceleration_sd_mps2)
        return np.array([known.get(name, 1.0) for name in names])

    @property
    def extent_m(self) -> float:
        """Greatest distance between two sensors; for a single one, a kilometre."""
        places = self.sensor.places
        return float(np.linalg.norm(places[:, None] - places[None], axis=2).max()) or 1000.0


class Problem(Setting):
    """A state to estimate."""

    motion: AnyMotion = Field(ConstantVelocity(q=1.0), description="How the target moves")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        check_fits(self.motion, self.sensor, self.prior)
        names, sensor, motion = self.motion.state_names, type(self.sensor).__name__, type(self.motion).__name__
        if type(self.sensor) in PLACE_SENSORS and ("z" in names) != (self.sensor.dimensions == 3):
            kind = getattr(self.motion, "kind", motion)
            raise ValueError(
                f"motion: {kind} has {'a' if 'z' in names else 'no'} height and the sensors have "
                f"{self.sensor.dimensions} dimensions; give kind=altitude with elevations, and only with them"
            )
        if self.bias is not None and not self.biased:
            raise ValueError("bias: is of angles, and these sensors measure none; leave it out")
        if self.bias is not None and not self.compiled:
            raise ValueError(f"bias: is estimated with a linear motion or ctrv, and not with {motion}; leave it out")
        if self.prior is None and not self.compiled:
            raise ValueError(
                f"prior: is needed with {sensor} and {motion}; only bearings and arrivals start by themselves, with a "
                "linear motion or ctrv"
            )
        return self

    @cached_property
    def compiled(self) -> bool:
        """Whether compiled code knows this sensor and this motion."""
        return type(self.sensor) in PLACE_SENSORS and tabled(self.motion)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components: the motion's, then each sensor's bias across and, with heights, upwards."""
        names = tuple(self.motion.state_names)
        if self.bias is None:
            return names
        n, ways = range(self.biased), ("across", "upwards") if "z" in names else ("across",)
        return (*names, *(f"bias_{way}_{k}" for k in n for way in ways))

    def first(self) -> tuple[Array, Array]:
        """Mean and covariance before a measurement: the prior, or a wide Gaussian about the sensors' centre."""
        names = self.state_names
        if self.prior is not None:
            biases = len(names) - len(self.prior.mean)
            return np.append(self.prior.mean, np.zeros(biases)), block_diag(self.prior.covariance, np.eye(biases))
        mean, centre = np.zeros(len(names)), self.sensor.places.mean(axis=0)
        for name, value in zip("xyz", centre, strict=True):
            if name in names:
                mean[names.index(name)] = value
        return mean, np.diag(self.start_deviations(names) ** 2)

    def anchor(self) -> Anchor:
        """Return the same as information."""
        return anchored(*self.first())

    def moved(self, mean: Array, covariance: Array, interval_s: float) -> Moved:
        """Linearise the motion about a belief."""
        if self.compiled:
            d = len(mean)
            ahead, F, Q = np.empty(d), np.empty((d, d)), np.empty((d, d))
            move(self.stepped(interval_s), 0, mean, ahead, F, Q)
            return Moved(ahead, F, Q)
        step = moved(self.motion, mean, covariance, interval_s)
        noise = np.full(len(mean), FLOOR)
        if interval_s:
            noise[[X, Y]] += self.position_noise_m**2
        return step._replace(Q=step.Q + np.diag(noise))

    def carried(self, mean: Array, covariance: Array, interval_s: float) -> tuple[Array, Array]:
        """Carry on a belief that a descent starts from: compiled ones ask for no covariance, which then stays."""
        if self.compiled and (step := self.stepped(interval_s)).turn < 0:
            return step.F[0] @ mean, covariance
        ahead = self.moved(mean, covariance, interval_s)
        return ahead.mean, covariance if self.compiled else ahead.covariance(covariance)

    def predicted(self, mean: Array, covariance: Array, interval_s: float) -> tuple[Array, Array]:
        """Carry a belief on; over 0 s it stays. The arrays are new."""
        if not interval_s:
            return mean.copy(), covariance.copy()
        if self.compiled:
            return kernels.predict(self.stepped(interval_s), 0, mean, covariance, np.empty_like(covariance))
        step = self.moved(mean, covariance, interval_s)
        return step.mean, step.covariance(covariance)

    def updated(
        self, time_s: float, mean: Array, covariance: Array, measurement: Any | None, iterations: int
    ) -> tuple[Array, Array, float]:
        """Update a belief, perhaps in place; last comes the measurement's log density, 0 without one."""
        if measurement is None:
            return mean, covariance, 0.0
        if not self.compiled:
            return updated(self.sensor, mean, covariance, measurement, self.robust, iterations)
        table = tabulated((measurement,), self.sensor, (time_s,))
        return mean, covariance, kernels.update(table, 0, self._still, self.robust, iterations, mean, mean, covariance)

    @property
    def start(self) -> Start:
        """What a start knows of the sensors and of the target."""
        turn = math.radians(self.start_turn_sd_deg)
        places = self.sensor.places
        return Start(self.extent_m, places.mean(axis=0), min(2, len(places)), self.start_speed_sd_mps * turn, turn)

    def guess(self, stretch: BearingStretch, anchor: Anchor) -> Array:
        """First path ``(K, d)`` to descend from: it needs no guess itself, and turns at no time."""
        return guessed(stretch.table, stretch.transitions, anchor, self.robust, self.start)

    def started(self, stretch: Any) -> tuple[Descent, bool]:
        """Most probable path of the first bearings, and whether they give a place: where a live filter starts."""
        anchor = self.anchor()
        path = self.guess(stretch, anchor)
        return started(path, stretch.table, stretch.transitions, anchor, self.robust, self.start)

    def stretch(self, placed: Iterable[tuple[float, Any | None]]) -> Stretch:
        """Measurements, None where one is missing, with their times and what moves between."""
        placed = tuple(placed)
        if self.compiled:
            table = tabulated([m for _, m in placed], self.sensor, [time_s for time_s, _ in placed])
            T = self.transitions(table.times_s)
            return BearingStretch(self, table, T, inverse_noise(T))
        stretch = PlainStretch(self, np.empty(0), ())
        for time_s, measurement in placed:
            stretch = stretch.joined(time_s, measurement)
        return stretch

    def recorded(self, measurements: Iterable[Any | None], times_s: Iterable[float] | None = None) -> Stretch:
        """Take a whole recording; measurements of equal times are taken together.

        Parameters
        ----------
        measurements
            In the order of time.
        times_s
            Times of measurements that have none of their own [s].

        Raises
        ------
        DataError
            If a measurement cannot be used, times run backwards, or there is none at all.
        """
        stretch = self.stretch((time_s, measurement) for measurement, time_s in timed(measurements, times_s))
        if stretch.empty:
            raise DataError("measurements: there is none; a path needs at least one.")
        return stretch

    def transitions(self, times_s: Array) -> Transitions:
        """Tables of the motion between times ``(K,)``."""
        noise, sensors = self.position_noise_m, self.biased
        return transitions_of(self.motion, times_s, position_noise_m=noise, bias=self.bias, sensors=sensors)

    def stepped(self, interval_s: float) -> Transitions:
        """Tables of the motion over one step; those of late are remembered."""
        key = round(float(interval_s), STEP_DIGITS)  # of a NumPy number it takes ten times as long
        if key not in self._steps:
            if len(self._steps) >= KEPT_STEPS:
                self._steps.clear()
            self._steps[key] = self.transitions(np.array([0.0, key]))
        return self._steps[key]

    @cached_property
    def _still(self) -> Transitions:
        return self.stepped(0.0)

    @cached_property
    def _steps(self) -> dict[float, Transitions]:
        return {}


def anchored(mean: Array, covariance: Array) -> Anchor:
    """Return a Gaussian belief as information; a component that is certain is so to within a little."""
    if np.linalg.eigvalsh(covariance)[0] <= 0:
        covariance = covariance + FLOOR * np.eye(len(mean))
    return Anchor(mean, np.asarray(np.linalg.inv(covariance)), np.zeros(len(mean)))
