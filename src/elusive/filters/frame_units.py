"""Rates that are chosen a frame where nothing is known of time, and those that are given a second.

A recording without a rate has its frames 1 s apart, so that what suits it a frame suits it a second. With a rate known,
defaults still suit a frame, while what somebody has given is meant a second.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any, TypeVar

from elusive.filters.particle.parts import switching
from elusive.model import Model
from elusive.motion import ConstantAcceleration

M = TypeVar("M", bound=Model)
# powers of 1 / s in the units of parameters
POWERS = {
    "q": 3, "q_speed": 4, "q_turn": 4, "q_intensity": 1, "turn_rate_deg": 1, "max_speed": 1, "acceleration_sd": 2,
    "turn_rate_sd_deg": 1, "max_velocity": 1, "min_velocity": 1, "velocity_step": 1, "velocities": 1,
}  # fmt: skip
CHAIN = ("birth_probability", "death_probability")
CHANCES = (*CHAIN, "switching")
ALL_BUT = 1 - 2.0**-50  # a probability of a second that still says how much is forgotten in a part of it


def rescaled(model: M, usual: Model | None, factor: float, *, left_alone: bool, idle: Collection[str] = ()) -> M:
    """Return a model with some of its rates in another unit of time, those of models inside it too.

    Parameters
    ----------
    model
        What was given and left alone.
    usual
        What stands there when nothing is given; the defaults of the model's class are left alone too.
    factor
        New units of time in one of the old: a rate of 1 / s is multiplied by it.
    left_alone
        Whether rates that are as usual change, or those that are not.
    idle
        Names of rates that have no effect, and stay.
    """
    changes: dict[str, Any] = {}
    chosen: dict[str, float] = {}
    for name, field in type(model).model_fields.items():
        value = getattr(model, name)
        default = field.get_default(call_default_factory=True)
        here = getattr(usual, name) if type(usual) is type(model) else default
        if isinstance(value, Model):
            changes[name] = rescaled(value, here, factor, left_alone=left_alone, idle=idle)
        elif (value in (default, here)) is left_alone and value is not None and name not in idle:
            if name in CHANCES:
                chosen[name] = value
            elif name == "smoothing":
                changes[name] = value**factor
            elif name in POWERS:
                power = 5 if name == "q" and isinstance(model, ConstantAcceleration) else POWERS[name]
                changes[name] = _times(value, factor**power)
    if set(CHAIN) <= set(chosen) and getattr(model, "switches", True):
        both = switching(chosen[CHAIN[0]], chosen[CHAIN[1]], factor)
        most = min(1.0, ALL_BUT / max(sum(both), 1e-300))
        changes |= zip(CHAIN, (most * probability for probability in both), strict=True)
    else:
        changes |= {name: -math.expm1(factor * math.log1p(-min(value, ALL_BUT))) for name, value in chosen.items()}
    return model.replace(**changes) if changes else model


def _times(value: Any, factor: float) -> Any:
    return tuple(_times(part, factor) for part in value) if isinstance(value, tuple) else value * factor
