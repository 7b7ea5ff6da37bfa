"""What a motion, a sensor, a piece of knowledge, a birth density and a filter must offer: small Protocols.

States are ``(N, d)`` float64 arrays, one row a particle. Every row begins ``x, vx, y, vy``; a model's own
components follow (accelerations, turn rate), and an intensity, where there is one, stands last. Times are in seconds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.errors import DataError

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
X, VX, Y, VY, INTENSITY = 0, 1, 2, 3, -1

State = TypeVar("State")
Measurement = TypeVar("Measurement", contravariant=True)


@runtime_checkable
class Motion(Protocol):
    """How a state evolves over any time. Its parameters are rates (per second), never an interval."""

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the ``d`` components."""

    def propagate(self, states: Array, interval_s: float, rng: Generator) -> Array:
        """Draw the states an interval later, ``(N, d) -> (N, d)``; over 0 s they stay as they are."""


@runtime_checkable
class Sensor(Protocol):
    """What a measurement says of a state."""

    def log_likelihood(self, states: Array, measurement: Any) -> Array:
        """Log likelihood of each state, ``(N, d) -> (N,)``; for a detector, of present against absent."""


@runtime_checkable
class Linearisable(Protocol):
    """A sensor whose measurement is a function of the state and Gaussian noise: what the Gaussian filters take."""

    def residual(self, state: Array, measurement: Any) -> Array:
        """Measured less expected in a state ``(d,)``, angles wrapped, ``(m,)``."""

    def jacobian(self, state: Array, measurement: Any) -> Array:
        """Differentiate what is expected by the state, ``(m, d)``."""

    def noise(self, measurement: Any) -> Array:
        """Covariance of the noise, ``(m, m)``."""


@runtime_checkable
class AdditiveSensor(Protocol):
    """A sensor whose measurement is the sum of what each target adds to it, and noise.

    What a target adds, and what it is expected to add, are of the sensor's own types: dense values, patches, ...
    ``log_likelihood(states, measurement)`` is ``log_ratio(expected(states), measurement, ())``. NaN in a measurement is
    a missing or masked part of it.
    """

    def expected(self, states: Array) -> Any:
        """Return what a target at each state ``(N, d)`` adds."""

    def effect(self, expected: Any, weights: Array, existence: float) -> Any:
        """Return the mean, and its uncertainty, of what a target adds that exists with a probability.

        ``expected`` is of its states, whose weights ``(N,)`` sum to one.
        """

    def log_ratio(self, expected: Any, measurement: Any, others: Sequence[Any]) -> Array:
        """Log likelihood of one more target at each state, less that of the others alone, ``(N,)``.

        The mean of the others' effects is subtracted, and their uncertainty added to the noise.
        """


class DetectionBirths(NamedTuple):
    """States of new targets that made some detections, drawn from the birth density times the detection's density."""

    states: Array  # (k, n, d) for each of k detections; the components that are drawn, place and velocity first
    log_density: Array  # (k,) log density of each detection, of a new target that is detected; minus infinity: of none
    weights: Array  # (k, n) summing to one: how much more often they should have been drawn


@runtime_checkable
class DetectionSensor(Protocol):
    """A sensor that reports detections (plots, peaks, bearings), some of them false, and misses some targets.

    A measurement holds the m detections of one scan, in whatever form; ``which``, ``(k,)``, are indices of some.
    A sensor may also offer ``gate``: see :class:`~elusive.tracking.detections.GatingSensor`; and ``scans``, where a
    measurement is of several sensors: :class:`~elusive.tracking.detections.ManyScans`.
    """

    def detection_probabilities(self, states: Array, measurement: Any) -> Array:
        """Probability that a target at each state is detected, ``(N, d) -> (N,)``; 0 out of view."""

    def log_densities(self, states: Array, measurement: Any, which: NDArray[np.int64]) -> Array:
        """Log density of some detections, given that a target at each state made them, ``(N, d) -> (N, k)``."""

    def log_clutter(self, measurement: Any) -> Array:
        """Log intensity of false detections where each is, ``(m,)``; minus infinity where there are none."""

    def draw_births(
        self, measurement: Any, which: NDArray[np.int64], n: int, speed_sd_mps: float, rng: Generator
    ) -> DetectionBirths:
        """Draw ``n`` states of a new target for each of some detections; a velocity not measured has this spread."""


class Looked(NamedTuple):
    """Gaussian targets after a look at a map of evidence."""

    mean: Array  # (T, 4) x, vx, y, vy
    covariance: Array  # (T, 4, 4)
    levels: Array  # (T, K) weights of their strengths
    background: Array  # (T, 2) what is remembered of the map about their ways
    log_ratio: Array  # (T,) likelihood of the map with each there, against without
    claimed: NDArray[np.float32]  # how far each cell is explained by them


class Beginnings(NamedTuple):
    """Cells of a map of evidence that may be of new targets."""

    places: Array  # (m, 2)
    covariances: Array  # (m, 2, 2)
    time_s: Array  # (m,) when each was looked at
    ratio: Array  # (m, K) likelihood ratio of a target of each strength
    share: float  # of the view that one stands for
    seen: Array  # (K,) probability that a new target of each strength is among them


@runtime_checkable
class EvidenceSensor(Protocol):
    """A sensor whose measurement is a map of evidence, none of it thresholded, each part of it at its own time."""

    @property
    def ratios(self) -> Array:
        """Strengths of targets that are told apart, to the noise's, ``(K,)``."""

    def arrival_s(self, places: Array, measurement: Any) -> Array:
        """Time at which places ``(T, 2)`` are looked at, ``(T,)``."""

    def density(self, places: Array, measurement: Any) -> Array:
        """Probability density at places ``(T, 2)`` of a target that may be in any part of the view alike, ``(T,)``."""

    def look(
        self, mean: Array, covariance: Array, levels: Array, background: Array, existence: Array,
        number: NDArray[np.int64], measurement: Any, gate: float,
    ) -> Looked:  # fmt: skip
        """Update beliefs, each expected at the time at which its place is looked at, by cells in its gate.

        Those of one ``number`` ``(T,)`` are of one target and exclude each other: none explains another's cells.
        ``background`` ``(T, 2)`` is the sensor's own, 0 of a new target: sums along its way that may be averaged.
        """

    def beginnings(self, measurement: Any, looked: Looked, least: float, most: int) -> Beginnings:
        """Return cells of a least evidence that nobody claims, the strongest, as many as are wanted at most."""


@runtime_checkable
class Knowledge(Protocol):
    """What is known of where a target can be (a map, a lane, a floor plan, a field of view)."""

    def log_probability(self, states: Array) -> Array:
        """Log probability that each state is allowed, ``(N, d) -> (N,)``."""


class Births(NamedTuple):
    """Newborn states and what their weights must carry for having been drawn from a proposal."""

    states: Array  # (N, d)
    log_ratio: Array  # (N,) log p_b / q_b


@runtime_checkable
class Birth(Protocol):
    """Where a target appears."""

    def draw(self, n: int, measurement: Any, sensor: Any, state_names: tuple[str, ...], rng: Generator) -> Births:
        """Draw ``n`` newborn states with these components; ``measurement`` is None where a frame is missing."""


class Filter(Protocol[State, Measurement]):
    """A recursion over measurements. Every state has ``time_s``, the time for which it holds."""

    def init(self, rng: Generator, time_s: float = math.nan) -> State:
        """Return the belief at a time before any measurement; NaN: at the time of the first measurement."""

    def step(self, state: State, time_s: float, measurement: Measurement | None, rng: Generator) -> State:
        """Return the belief at a time, with the measurement made then; without one (``None``), the prediction."""


def interval_since(before_s: float, time_s: float) -> float:
    """Seconds from the time of a state to that of a measurement; 0 where the state's is not known yet (NaN).

    Raises
    ------
    DataError
        If time runs backwards, or the measurement's is not finite.
    """
    if not math.isfinite(time_s):
        raise DataError(f"time_s: a measurement's time must be finite (got {time_s}); give its seconds.")
    interval_s = 0.0 if math.isnan(before_s) else time_s - before_s
    if interval_s < 0:
        raise DataError(f"measurement at {time_s:g} s: comes after {before_s:g} s; sort the measurements by time.")
    return interval_s
