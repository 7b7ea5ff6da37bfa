"""Constants of the shadowed links from a log without labels, by maximum likelihood: the walkers are summed over.

Expectation maximisation: where people were, given the whole log (:mod:`elusive.systems.links.hidden_walkers`), then the
constants under which the readings are likeliest. The likelihood is tempered as the filter's own is, and so a composite
one (Varin, Reid and Firth (2011), Statistica Sinica 21, 5-42).

Two people whom a fit takes for one make everybody's effect wide, and are seen as one from then on. So it starts from
lesser spreads too, with a person more than it finds, and the likeliest goes on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from pydantic import Field
from scipy.optimize import minimize

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.areas import Area
from elusive.model import Model, Positive, Probability
from elusive.sensors.link_likeness import Likeness
from elusive.sensors.link_shadowing import ROUNDING_SD_DB, LinkShadowing, ShadowedLinks
from elusive.sensors.shadowing_slopes import POSITIVE, SLOPE, log_likelihood
from elusive.systems.links.hidden_walkers import LEAST_MASS, Chain, Walkers

LEAST_FRAMES = 20
MOST_FACTOR = 3.0  # by which a constant changes in one iteration
LESSER = 0.5  # spreads of a further start, over the others'
TRIAL = 2  # iterations after which starts are compared
SURE = 0.5  # presence in a frame from which somebody's place counts
THERE = 0.05  # share of the frames from which one more than is found is looked for


class LinkFit(NamedTuple):
    """Constants fitted to a log, and how well they explain it."""

    model: LinkShadowing
    log_likelihood: Array  # (iterations done + 1,) tempered, of the constants before each iteration and at the end
    presence: Array  # (T,) probability that somebody was there, given the whole log
    people: int  # found, at a time


class LinkFitting(Model):
    """How constants are fitted to a log without labels."""

    pitch_m: Positive = Field(0.3, description="Side of a cell in which the walker may be [m]")
    spread_m: Positive = Field(
        0.6, description="Deviation of the walker's way in a second, each axis; it grows with the root of time [m]"
    )
    birth_probability: Probability = Field(0.016, description="Probability that somebody comes, in a second")
    death_probability: Probability = Field(0.016, description="Probability that they leave, in a second")
    people: int = Field(3, ge=1, le=5, description="People at a time, at most")
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
            ``(T, D, C)`` changes from the empty room, NaN where missing [dB]. People
            are there in a part of them. The frames of the calibration are left out: they are no evidence of
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
        rates = self.birth_probability, self.death_probability
        walkers = Walkers(area, self.pitch_m, self.spread_m, rates, times_s[: len(changes)])
        most = min(2, self.people)
        starts = sensor, _spread_less(sensor)
        trials = [_Fitting(start, changes, walkers, most).gone_on(self, TRIAL) for start in starts]
        best = max(trials, key=lambda trial: trial.history[-1])
        for many in range(most + 1, self.people + 1):
            if best.people < many - 1:
                break
            # what one more does was taken for spread
            trial = _Fitting(_spread_less(best.sensor), changes, walkers, many).gone_on(self, TRIAL)
            if trial.evidence <= best.evidence:
                break
            best = trial
        best.gone_on(self, self.iterations, on_iteration)
        if best.presence.sum() < 1:
            raise DataError("log: nobody seems to have been there in any frame; fit to a log in which somebody walks.")
        return LinkFit(best.sensor.model, np.array(best.history), best.presence, best.people)


def _spread_less(sensor: ShadowedLinks) -> ShadowedLinks:
    """Return the links with constants of lesser spread, from which a fit starts."""
    model = sensor.model
    return sensor.with_model(model.replace(near_sd_db=LESSER * model.near_sd_db, far_sd_db=LESSER * model.far_sd_db))


class _Fitting:
    """A fit under way, from constants and with so many people."""

    def __init__(self, sensor: ShadowedLinks, changes: Array, walkers: Walkers, people: int) -> None:
        self.sensor, self._changes, self._walkers = sensor, changes, walkers
        chains, _ = walkers.found(sensor, changes, [walkers.nobody()] * people)
        self._chains, first = walkers.found(sensor, changes, chains) if people > 1 else (chains, _)
        self.history = [first]  # log likelihood
        self._settled = False

    @property
    def presence(self) -> Array:
        """Probability that somebody was there, ``(T,)``."""
        absent: Array = np.prod([1 - chain.presence for chain in self._chains], axis=0)
        return 1 - absent

    @property
    def people(self) -> int:
        """How many are there in more than a few frames."""
        return sum(chain.presence.mean() > THERE for chain in self._chains)

    @property
    def evidence(self) -> float:
        """Log likelihood, tempered, less what errors that last gain for everybody beside the first."""
        likeness, walkers, sensor = Likeness(), self._walkers, self.sensor
        for change, *frame in zip(self._changes, *(chain.frames for chain in self._chains), strict=True):
            there = [one.weights @ walkers.centres[one.cells] / one.presence for one in frame if one.presence > SURE]
            if there:
                states = np.array([[x, 0.0, y, 0.0] for x, y in there])
                likeness = sensor.likeness_after(likeness, change, states)
            else:
                likeness = likeness._replace(last=None)
        gains = [sensor.temper_of(rise) * sensor.tempered(rise, likeness, 0.0).optimism for rise in self._changes]
        owed = sum(gains) / len(gains)
        present = [float(chain.presence.sum()) for chain in self._chains]
        return self.history[-1] - owed * (sum(present) - max(present))

    def gone_on(self, asked: LinkFitting, until: int, on_iteration: Callable[[int], None] | None = None) -> _Fitting:
        """Iterate until so many have been done, or nothing is gained; return itself."""
        while not self._settled and len(self.history) <= min(until, asked.iterations) and self.presence.sum() >= 1:
            sensor = self.sensor.with_model(_maximise(self.sensor, self._changes, self._walkers, self._chains))
            chains, total = self._walkers.found(sensor, self._changes, self._chains)
            gain = total - self.history[-1]
            self._settled = gain < asked.tolerance * abs(self.history[-1])
            if gain > 0:
                self.sensor, self._chains = sensor, chains
                self.history.append(total)
                if on_iteration is not None:
                    on_iteration(len(self.history) - 1)
        return self


def _maximise(sensor: ShadowedLinks, changes: Array, walkers: Walkers, people: Sequence[Chain]) -> LinkShadowing:
    """Return the constants under which the readings are likeliest, given where people were."""
    start, places = sensor.model, [walkers.placed(sensor, chain) for chain in people]
    origin = np.append([math.log(max(getattr(start, name), LEAST_MASS)) for name in POSITIVE], start.fade_slope)

    def model_at(point: Array) -> LinkShadowing:
        constants = dict(zip(POSITIVE, np.exp(point[:-1]).tolist(), strict=True))
        return start.replace(**constants, **{SLOPE: float(point[-1])})

    def loss(point: Array) -> tuple[float, Array]:
        trial = sensor.with_model(model_at(point))
        total, slopes = 0.0, np.zeros(len(point))
        for change, first, *rest in zip(changes, *places, strict=True):
            told = log_likelihood(trial, change, first, [one for one in rest if len(one.weights)])
            total, slopes = total + told[0], slopes + told[1]
        return -total, -slopes

    reach = math.log(MOST_FACTOR)
    bounds = [(x - reach, x + reach) for x in origin[:-1]] + [(-3.0, 3.0)]
    bounds[POSITIVE.index("floor_sd_db")] = (math.log(ROUNDING_SD_DB), math.log(30.0))
    origin = np.clip(origin, *np.transpose(bounds))
    return model_at(minimize(loss, origin, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 5}).x)
