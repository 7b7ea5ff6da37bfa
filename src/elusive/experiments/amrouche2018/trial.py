"""One Monte Carlo trial of Amrouche, Khenchaf and Berkani (2018), section 5, with any filter of the table."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.campaign import Scenario
from elusive.contracts import Array, Filter, X, Y
from elusive.experiments.amrouche2018.scenario import WeakTarget
from elusive.filters import BernoulliFilter, BrightBirth, ExistenceParticleFilter, MeasurementBirth, UniformBirth
from elusive.runner import run

FilterName = Literal[
    "paper",
    "paper-bright",
    "paper-measurement",
    "bernoulli-uniform",
    "bernoulli-measurement",
    "bernoulli-smoothed",
    "near-optimal",
]


class Row(NamedTuple):
    """What a filter of the table is, in words."""

    label: str
    births: type[UniformBirth]
    particles: int
    newborns: int | None  # None: the paper's filter, where each particle carries existence
    spread_within: float | None = 0.0  # of survivors; None: the usual one


FILTERS: dict[FilterName, Row] = {
    "paper": Row("the paper's filter, uniform births", UniformBirth, 2000, None),
    "paper-bright": Row("the paper's filter, births on bright cells", BrightBirth, 2000, None),
    "paper-measurement": Row("the paper's filter, measurement births", MeasurementBirth, 2000, None),
    "bernoulli-uniform": Row("Bernoulli filter, uniform births", UniformBirth, 1500, 500),
    "bernoulli-measurement": Row("Bernoulli filter, measurement births", MeasurementBirth, 1500, 500),
    "bernoulli-smoothed": Row("the same, survivors smoothed", MeasurementBirth, 1500, 500, None),
    "near-optimal": Row("Bernoulli filter, 20 000 + 20 000 particles", MeasurementBirth, 20_000, 20_000),
}


class WeakTargetTrial(WeakTarget):
    """The scenario, and the filter that looks at it."""

    filter: FilterName = Field("bernoulli-measurement", description="Filter, a row of the table")

    def build(self) -> BernoulliFilter | ExistenceParticleFilter:
        """Put the filter together; it knows the target's motion, noise and mean intensity, as in the paper."""
        row = FILTERS[self.filter]
        birth = row.births(snr_db=self.snr_db)
        parts = {"motion": self.target_motion, "sensor": self.sensor, "birth": birth, "particles": row.particles}
        if row.newborns is None:
            return ExistenceParticleFilter(**parts)
        return BernoulliFilter(**parts, newborns=row.newborns, spread_within=row.spread_within)


def trial(parameters: WeakTargetTrial, rng: Generator) -> dict[str, Array]:
    """Draw a recording and filter it.

    Returns
    -------
    dict
        ``existence (30,)``, ``estimate (30, 2)`` and ``truth (30, 2)`` in cells; the truth is NaN while absent.
    """
    recording = parameters.simulate(rng)
    chosen: Filter[Any, Array] = parameters.build()
    states = list(run(chosen, recording.frames, rng, start_s=-1.0))
    return {
        "existence": np.array([state.existence for state in states]),
        "estimate": np.array([state.mean[[X, Y]] for state in states]),
        "truth": recording.truth[:, [X, Y]],
    }


SCENARIO = Scenario(
    trial,
    WeakTargetTrial,
    {"existence": ("frame",), "estimate": ("frame", "axis"), "truth": ("frame", "axis")},
)
