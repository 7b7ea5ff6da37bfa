"""What a filter assumes of the charted coast's error: new at every step, persistent, or one bias everywhere.

Bootsveld (2012), section 2.1 (bias and imprecision) and 8.3 (what he leaves open). One function joins motion and
knowledge, so that the states carry what the knowledge reads.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np
from pydantic import Field

from elusive.charts import BiasedWater, Coast, CoastBias, DisplacedWater, WaterModel
from elusive.contracts import Array, Knowledge, Motion, X, Y
from elusive.filters.particle.parts import AnyKnowledge, Belief
from elusive.model import Model, Positive
from elusive.motion import WithCoastError


class CoastError(Model):
    """How the error of the charted coast behaves along a target's way."""

    coast_error: Literal["fresh", "persistent", "bias"] = Field(
        "persistent",
        description="The coast's error: new at every step (a chart taken as exact: by default); the same along a "
        "stretch; or, besides one new at every step, one shift of the whole chart, which is estimated",
    )
    coast_correlation_m: Positive = Field(
        200.0, description="Distance over which the correlation of the coast's error falls to 1/e [m]; not if fresh"
    )
    coast_share: float = Field(
        0.9, gt=0, lt=1, description="Persistent: share of the coast's variance that persists; of a hard coast's, all"
    )
    bias_sd_m: Positive = Field(30.0, description="Bias: its deviation on each axis before anything is measured [m]")


def with_coast(
    motion: Motion, water_model: WaterModel, coast: Coast, parameters: CoastError
) -> tuple[Motion, Knowledge]:
    """Join a motion and what is known of the coast for a particle filter.

    Parameters
    ----------
    motion
        How the target moves.
    water_model
        How the probability of water is computed.
    coast
        Land and its imprecision.
    parameters
        How the coast's error behaves.

    Returns
    -------
    motion, knowledge
        For a persistent error, the motion carries it in its two last components, and the knowledge reads it there.
        For a bias, the knowledge is to be replaced after each step by what :func:`learn_bias` gives.
    """
    if parameters.coast_error == "persistent":
        carrying = WithCoastError(motion=motion, correlation_m=parameters.coast_correlation_m)
        return carrying, DisplacedWater.persistent(water_model, coast, parameters.coast_share)
    if parameters.coast_error == "bias":
        return motion, BiasedWater(water_model, coast, parameters.bias_sd_m)
    return motion, water_model.bind(coast)


def learn_bias(
    knowledge: tuple[AnyKnowledge, ...],
    steps: Iterable[tuple[Belief, Belief]],
    parameters: CoastError,
) -> tuple[AnyKnowledge, ...]:
    """Return a filter's knowledge after some ships moved; it is given back as it is where no bias is estimated.

    Parameters
    ----------
    knowledge
        Of the filter: what :func:`with_coast` gave, or this function, and whatever else it knows.
    steps
        Belief before and after one step, of each ship that is believed in.
    parameters
        How the coast's error behaves: places close by meet the same error, and their evidence counts once.
    """
    if not any(isinstance(member, BiasedWater) for member in knowledge):
        return knowledge
    for before, after in steps:
        moved_m = float(np.hypot(*(after.mean - before.mean)[[X, Y]]))
        kept = math.exp(-moved_m / parameters.coast_correlation_m)
        knowledge = tuple(
            member.learn(after.particles, after.weights, kept) if isinstance(member, BiasedWater) else member
            for member in knowledge
        )
    return knowledge


def coast_bias(knowledge: tuple[AnyKnowledge, ...]) -> CoastBias | None:
    """Return the estimate of the chart's bias; None where none is estimated."""
    return next((member.bias for member in knowledge if isinstance(member, BiasedWater)), None)


def anchored_probability(state_names: Sequence[str], particles: Array, weights: Array) -> float | None:
    """Probability that the target lies at anchor, from weighted particles; None where its motion knows no anchor."""
    if "anchored" not in state_names:
        return None
    return float(np.clip(weights @ particles[:, list(state_names).index("anchored")], 0.0, 1.0))
