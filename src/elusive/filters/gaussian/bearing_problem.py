"""What every estimator of a path from bearings shares: motion, sensors, what is known at the start, and a first guess.

Bar-Shalom, Li and Kirubarajan (2001), Estimation with applications to tracking and navigation, chapters 6 and 10.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.filters.gaussian._map_kernels import NO_RANGES, Anchor, Loss, inverse_noise, optimise
from elusive.filters.gaussian._start_kernels import Start, begun, guessed
from elusive.filters.gaussian.transitions import AngleBias, Transitions, transitions_of
from elusive.model import Model, NonNegative, Positive
from elusive.motion import ConstantAcceleration, ConstantTurnRateVelocity, ConstantVelocity, CoordinatedTurn
from elusive.motion.altitude import WithAltitude
from elusive.sensors.arrival_times import HybridSensors
from elusive.sensors.bearing_table import BearingTable, PlaceSensor
from elusive.sensors.bearings import BearingSensors

BearingMotion = Annotated[
    ConstantVelocity | ConstantAcceleration | CoordinatedTurn | ConstantTurnRateVelocity | WithAltitude,
    Field(discriminator="kind"),
]
LOSSES = {"squares": 0, "cauchy": 1, "huber": 2}
KEPT_STEPS = 256  # tables of steps remembered


class Settled(NamedTuple):
    """A path of least cost, and Cholesky's factor of its normal equations."""

    path: Array  # (K, d)
    L: Array  # (K, d, d)
    Y: Array  # (K - 1, d, d)
    weights: Array  # (U, d, d) inverse of the noises of the transitions' tables
    cost: float
    iterations: int
    converged: bool


class BearingSetting(Model):
    """What is known of the sensors and of the start, whatever the motion."""

    sensor: PlaceSensor = Field(description="Where bearings or arrivals are taken, and their noise")
    position_noise_m: NonNegative = Field(
        0.0, description="Deviation of a displacement at each step, each axis of the ground, epsilon of eq. 26 [m]"
    )
    bias: AngleBias | None = Field(None, description="Biases of the sensors' angles to estimate with the path")
    loss: Literal["squares", "cauchy", "huber"] = Field("cauchy", description="Loss of a bearing's whitened residual")
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


class BearingProblem(BearingSetting):
    """A path to estimate from bearings."""

    motion: BearingMotion = Field(ConstantVelocity(q=1.0), description="How the target moves")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        solid = "z" in self.motion.state_names
        if solid != (self.sensor.dimensions == 3):
            raise ValueError(
                f"motion: {self.motion.kind} has {'a' if solid else 'no'} height and the sensors have "
                f"{self.sensor.dimensions} dimensions; give kind=altitude with elevations, and only with them"
            )
        if self.bias is not None and not self.biased:
            raise ValueError("bias: is of angles, and these sensors measure none; leave it out")
        return self

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components: the motion's, then each sensor's bias across and upwards."""
        names = self.motion.state_names
        if self.bias is None:
            return names
        n = range(self.biased)
        return (*names, *(f"bias_{way}_{k}" for k in n for way in ("across", "upwards")))

    @property
    def extent_m(self) -> float:
        """Greatest distance between two sensors; for a single one, a kilometre."""
        places = self.sensor.places
        return float(np.linalg.norm(places[:, None] - places[None], axis=2).max()) or 1000.0

    def transitions(self, times_s: Array) -> Transitions:
        """Tables of the motion between times ``(K,)``."""
        return transitions_of(
            self.motion,
            times_s,
            position_noise_m=self.position_noise_m,
            bias=self.bias,
            sensors=self.biased,
        )

    def anchor(self) -> Anchor:
        """Return what is known of the first state before a bearing: a wide Gaussian about the sensors' centre."""
        names = self.state_names
        place = self.start_sd_m or 10 * self.extent_m
        known = {"x": place, "y": place, "z": place, "turn_rate": math.radians(self.start_turn_sd_deg)}
        known |= dict.fromkeys(("vx", "vy", "vz"), self.start_speed_sd_mps)
        known |= dict.fromkeys(("ax", "ay"), self.start_acceleration_sd_mps2)
        deviations = np.array([known.get(name, 1.0) for name in names])
        at = np.zeros(len(names))
        centre = self.sensor.places.mean(axis=0)
        for name, value in zip("xyz", centre, strict=True):
            if name in names:
                at[names.index(name)] = value
        return Anchor(at, np.diag(deviations**-2.0), np.zeros(len(names)))

    @property
    def start(self) -> Start:
        """What a start knows of the sensors and of the target."""
        turn = math.radians(self.start_turn_sd_deg)
        places = self.sensor.places
        return Start(self.extent_m, places.mean(axis=0), min(2, len(places)), self.start_speed_sd_mps * turn, turn)

    def guess(self, table: BearingTable, transitions: Transitions, anchor: Anchor) -> Array:
        """First path ``(K, d)`` to descend from: it needs no guess itself, and turns at no time."""
        return guessed(table, transitions, anchor, self.robust, self.start)

    def settle(
        self,
        path: Array,
        table: BearingTable,
        transitions: Transitions,
        anchor: Anchor,
        iterations: int,
        tolerance: float,
    ) -> Settled:
        """Descend from a path to one of least cost."""
        path, K, d = path.copy(), *path.shape
        weights, L, Y = inverse_noise(transitions), np.empty((K, d, d)), np.empty((K - 1, d, d))
        told = optimise(path, table, NO_RANGES, transitions, weights, anchor, self.robust, iterations, tolerance, L, Y)
        return Settled(path, L, Y, weights, *told)

    def begin(self, table: BearingTable) -> tuple[Settled, bool]:
        """Most probable path of the first bearings, and whether they tell a place: where a live filter starts."""
        transitions = self.transitions(table.times_s)
        path, L, Y, cost, taken, settled, told = begun(table, transitions, self.anchor(), self.robust, self.start)
        return Settled(path, L, Y, inverse_noise(transitions), cost, taken, settled), told

    def stepped(self, interval_s: float) -> Transitions:
        """Tables of the motion over one step; those of late are remembered."""
        key = round(interval_s, 9)
        if key not in self._steps:
            if len(self._steps) >= KEPT_STEPS:
                self._steps.clear()
            self._steps[key] = self.transitions(np.array([0.0, key]))
        return self._steps[key]

    @cached_property
    def _steps(self) -> dict[float, Transitions]:
        return {}
