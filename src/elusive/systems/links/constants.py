"""Constants of the shadowed links from a log without labels, by maximum likelihood: the walker is summed over.

Expectation maximisation over a hidden Markov model (Rabiner (1989), Proc. IEEE 77(2), 257-286): one person at most,
absent or in a cell of a grid, walking at random; forwards and backwards over the log, then the constants under which
the readings are likeliest. The likelihood is tempered as the filter's own is, and so a composite one (Varin, Reid and
Firth (2011), Statistica Sinica 21, 5-42).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.optimize import minimize

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.particle.parts import switching
from elusive.geometry.areas import Area
from elusive.model import Model, Positive, Probability
from elusive.sensors.link_shadowing import LinkShadowing, ShadowedLinks

POSITIVE = (
    "loss_db", "loss_length_m", "near_sd_db", "near_length_m", "far_sd_db", "far_length_m", "floor_sd_db",
)  # fmt: skip
SLOPE = "fade_slope"
LEAST_FRAMES = 20
MOST_FACTOR = 3.0  # by which a constant changes in one iteration
LEAST_MASS = 1e-3  # of a cell that counts
ROUNDING_SD_DB = 1 / math.sqrt(12)  # of readings in whole dB: a lesser spread would be that of no reading at all


class LinkFit(NamedTuple):
    """Constants fitted to a log, and how well they explain it."""

    model: LinkShadowing
    log_likelihood: Array  # (iterations done + 1,) tempered, of the constants before each iteration and at the end
    presence: Array  # (T,) probability that somebody was there, given the whole log


class LinkFitting(Model):
    """How constants are fitted to a log without labels."""

    pitch_m: Positive = Field(0.3, description="Side of a cell in which the walker may be [m]")
    spread_m: Positive = Field(
        0.25, description="Deviation of the walker's way in a second, each axis; it grows with the root of time [m]"
    )
    birth_probability: Probability = Field(0.016, description="Probability that somebody comes, in a second")
    death_probability: Probability = Field(0.016, description="Probability that they leave, in a second")
    iterations: int = Field(20, ge=1, le=1000, description="Most iterations of expectation and maximisation")
    tolerance: Positive = Field(1e-5, description="Relative gain of log likelihood below which it ends")
    frames: int = Field(2000, ge=LEAST_FRAMES, description="Most frames used, from the first on")

    def fit(
        self,
        sensor: ShadowedLinks,
        times_s: Array,
        changes: Array,
        area: Area,
        *,
        on_iteration: Callable[[int], None] | None = None,
    ) -> LinkFit:
        """Fit the constants.

        Parameters
        ----------
        sensor
            The network, calibrated; its constants are where the fit starts. Degrees of freedom and temper stay.
        times_s
            ``(T,)`` of the frames, increasing.
        changes
            ``(T, D, C)`` changes from the empty room, NaN where missing [dB]. One person at most
            is there at a time, for a part of them. The frames of the calibration are left out: they are no evidence of
            the spread that they were used to measure.
        area
            Where the walker can be.
        on_iteration
            Called with the number of iterations done.

        Returns
        -------
        LinkFit
            The constants of greatest likelihood found.

        Raises
        ------
        DataError
            If there are too few frames, none has a reading, no cell lies in the area, or nobody seems to have been
            there.
        """
        changes = np.asarray(changes, dtype=np.float64)[: self.frames]
        if changes.ndim != 3 or len(changes) < LEAST_FRAMES:
            raise DataError(
                f"log: has {len(changes)} frames; the fit needs at least {LEAST_FRAMES}, with people in some."
            )
        if not np.isfinite(changes).any():
            raise DataError("log: has no reading after the calibration; fit to a log in which the links are heard.")
        cells = _Cells(area, self.pitch_m, self.spread_m)
        # before the first frame, a second in which somebody may have come
        intervals_s = np.diff(times_s[: len(changes)], prepend=times_s[0] - 1.0)
        history: list[float] = []
        while True:
            where, presence, total = self._expect(sensor, intervals_s, changes, cells)
            history.append(total)
            if presence.sum() < 1:
                raise DataError(
                    "log: nobody seems to have been there in any frame; fit to a log in which somebody walks."
                )
            settled = len(history) > 1 and total - history[-2] < self.tolerance * abs(history[-2])
            if settled or len(history) > self.iterations:
                break
            sensor = sensor.with_model(_maximise(sensor, changes, cells.centres, where))
            if on_iteration is not None:
                on_iteration(len(history))
        return LinkFit(sensor.model, np.array(history), presence)

    def _expect(
        self, sensor: ShadowedLinks, intervals_s: Array, changes: Array, cells: _Cells
    ) -> tuple[list[_Where], Array, float]:
        """Return where the walker was in each frame, whether, and the log likelihood of the log."""
        absent = np.array([sensor.log_without(change, ()) for change in changes])
        somebody = sensor.expected_at(cells.centres)
        ratio = np.array([sensor.log_ratio(somebody, change, ()) for change in changes])
        ratio[:, ~cells.inside] = -math.inf
        size, anywhere = len(cells.centres), cells.inside / cells.inside.sum()
        chances = [switching(self.birth_probability, self.death_probability, dt) for dt in intervals_s]
        top = np.maximum(ratio.max(axis=1), 0.0)
        seen, unseen = np.exp(ratio - top[:, None]), np.exp(-top)
        forward = np.empty((len(changes), size + 1))
        belief = np.append(np.zeros(size), 1.0)
        total = float((absent + top).sum())
        for k, (born, died) in enumerate(chances):
            away = died * belief[:-1].sum() + (1 - born) * belief[-1]
            there = (1 - died) * cells.spread(belief[:-1], intervals_s[k]) + born * anywhere * belief[-1]
            belief = np.append(there * seen[k], away * unseen[k])
            mass = belief.sum()
            total += math.log(mass)
            belief = belief / mass
            forward[k] = belief
        after = np.ones(size + 1)
        where: list[_Where] = []
        presence = np.empty(len(changes))
        for k in range(len(changes) - 1, -1, -1):
            smoothed = forward[k] * after
            smoothed /= smoothed.sum()
            presence[k] = 1 - smoothed[-1]
            kept = np.flatnonzero(smoothed[:-1] > LEAST_MASS).astype(np.int64)
            where.append(_Where(kept, smoothed[kept], float(smoothed[-1])))
            ahead, none, (born, died) = seen[k] * after[:-1], unseen[k] * after[-1], chances[k]
            back = cells.spread_back(ahead, intervals_s[k])
            after = np.append((1 - died) * back + died * none, born * anywhere @ ahead + (1 - born) * none)
            after /= after.max()
        return where[::-1], presence, total


class _Where(NamedTuple):
    """Where the walker was in a frame, given the whole log."""

    cells: NDArray[np.int64]
    weights: Array
    absent: float


class _Cells:
    """The grid and a random walk on it."""

    def __init__(self, area: Area, pitch_m: float, spread_m: float) -> None:
        self.centres, _ = area.cells(pitch_m)
        self.inside, self._spread_m = area.contains(self.centres), spread_m
        if not self.inside.any():
            raise DataError(f"area: no cell of {pitch_m:g} m lies in it; choose smaller cells.")
        self._axes = [np.unique(axis) for axis in self.centres.T]
        self._shape = tuple(map(len, self._axes[::-1]))

    def spread(self, mass: Array, interval_s: float) -> Array:
        x, y = self._moves(interval_s)
        moved: Array = y.T @ mass.reshape(self._shape) @ x
        return moved.ravel()

    def spread_back(self, value: Array, interval_s: float) -> Array:
        x, y = self._moves(interval_s)
        expected: Array = y @ value.reshape(self._shape) @ x.T
        return expected.ravel()

    def _moves(self, interval_s: float) -> list[Array]:
        """Probabilities of moving from cell to cell in an interval, along each axis."""
        moves = []
        for axis in self._axes:
            variance = self._spread_m**2 * max(interval_s, 1e-9)
            move = np.exp(-0.5 * (axis[:, None] - axis) ** 2 / variance)
            moves.append(move / move.sum(axis=1, keepdims=True))
        return moves


def _maximise(sensor: ShadowedLinks, changes: Array, centres: Array, where: list[_Where]) -> LinkShadowing:
    """Return the constants under which the readings are likeliest, given where the walker was."""
    start = sensor.model
    origin = np.append([math.log(max(getattr(start, name), LEAST_MASS)) for name in POSITIVE], start.fade_slope)

    def model_at(point: Array) -> LinkShadowing:
        constants = dict(zip(POSITIVE, np.exp(point[:-1]).tolist(), strict=True))
        return start.replace(**constants, **{SLOPE: float(point[-1])})

    def loss(point: Array) -> float:
        trial = sensor.with_model(model_at(point))
        total = 0.0
        for change, frame in zip(changes, where, strict=True):
            total += trial.log_without(change, ())
            if len(frame.cells):
                total += float(frame.weights @ trial.log_ratio(trial.expected_at(centres[frame.cells]), change, ()))
        return -total

    reach = math.log(MOST_FACTOR)
    bounds = [(x - reach, x + reach) for x in origin[:-1]] + [(-3.0, 3.0)]
    bounds[POSITIVE.index("floor_sd_db")] = (math.log(ROUNDING_SD_DB), math.log(30.0))
    origin = np.clip(origin, *np.transpose(bounds))
    found = minimize(
        loss, origin, method="L-BFGS-B", bounds=bounds, options={"maxiter": 5, "eps": 1e-4},
    )  # fmt: skip
    return model_at(found.x if found.fun < loss(origin) else origin)
