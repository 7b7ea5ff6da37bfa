"""What a target carries beside its motion: anchored or not, and the coast's error where it is.

Newborns are drawn in place and velocity, and completed here from what holds before anything is measured.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array, Motion
from elusive.errors import DataError
from elusive.motion.anchoring import MovingOrAnchored
from elusive.motion.coast_error import WithCoastError


def kinematic_names(motion: Motion) -> tuple[str, ...]:
    """Names of a motion's components without what is carried: those that a birth density draws."""
    if isinstance(motion, WithCoastError):
        return kinematic_names(motion.motion)
    return motion.state_names[:-1] if isinstance(motion, MovingOrAnchored) else motion.state_names


def complete(motion: Motion, states: Array, rng: Generator) -> Array:
    """Append to states what the motion carries beside them, drawn from what holds before anything is measured.

    Parameters
    ----------
    motion
        Any; one that carries nothing leaves the states as they are.
    states
        ``(N, d)``, of the components that :func:`kinematic_names` gives.
    rng
        Source of the draws.

    Returns
    -------
    Array
        ``(N, D)``, of all the motion's components.

    Raises
    ------
    DataError
        If the states have other components.
    """
    names = kinematic_names(motion)
    if states.ndim != 2 or states.shape[1] != len(names):
        raise DataError(f"states: must be (N, {len(names)}), {', '.join(names)} (got shape {states.shape}).")
    return _completed(motion, states, rng)


def _completed(motion: Any, states: Array, rng: Generator) -> Array:
    if isinstance(motion, WithCoastError):
        return np.column_stack([_completed(motion.motion, states, rng), rng.standard_normal((len(states), 2))])
    if isinstance(motion, MovingOrAnchored):
        return np.column_stack([states, rng.random(len(states)) < motion.anchored_share])
    return states
