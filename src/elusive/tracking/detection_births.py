"""New targets of the tracker of detections: each detection may be a target's that was never detected before.

Williams (2015), IEEE Trans. Aerosp. Electron. Syst. 51(3), 1664-1687, eqs. 47 to 52: the intensity of undetected
targets, spread as the sensor's births are, times the density of the detection, under what is known of places.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import Array, DetectionSensor, Knowledge, Motion
from elusive.errors import DataError, ParameterError
from elusive.filters.particle.parts import a_number_a_state, allowed_by
from elusive.motion import complete, kinematic_names


class Newborn(NamedTuple):
    """A target for each of k detections, if it is a new one's."""

    log_intensity: Array  # (k,) of each detection as a new target's; minus infinity: it is none's
    states: Array  # (k, n, d)
    weights: Array  # (k, n) summing to one
    allowed: Array  # (k,) probability that what is known allows it
    detected: float  # mean probability that a new target is detected; NaN without a detection


def newborn(
    sensor: DetectionSensor,
    motion: Motion,
    measurement: Any,
    which: NDArray[np.int64],
    undetected: float,
    known: Sequence[Knowledge],
    least_allowed: float,
    particles: int,
    spread: tuple[float, Mapping[str, float]],
    rng: Generator,
) -> Newborn:
    """Draw a new target for each of some detections, and say how likely it is.

    Parameters
    ----------
    sensor, motion, measurement, which
        What reports the detections, what the states are of, and which of them.
    undetected
        Expected number of targets that were never detected.
    known, least_allowed
        Where targets can be, and the probability of that up to which none begins.
    particles
        How many of each.
    spread
        Deviation of a velocity that is not measured, and of further components by name.
    rng
        Source of the draws.

    Raises
    ------
    DataError
        If the sensor's draws do not fit.
    ParameterError
        If nothing says how to draw one of the motion's components.
    """
    k = len(which)
    drawn = sensor.draw_births(measurement, which, particles, spread[0], rng)
    if drawn.states.shape[:2] != (k, particles) or [part.shape for part in drawn[1:]] != [(k,), (k, particles)]:
        raise DataError(
            f"draw_births: gave states of shape {drawn.states.shape}, densities of shape {drawn.log_density.shape} and "
            f"weights of shape {drawn.weights.shape} for {k} detections; give ({k}, {particles}, d), ({k},) and "
            f"({k}, {particles})."
        )
    flat = completed(motion, drawn.states.reshape(k * particles, drawn.states.shape[-1]), spread[1], rng)
    seen = a_number_a_state(sensor.detection_probabilities(flat, measurement), flat, "detection_probabilities")
    detected = seen.reshape(k, particles) * drawn.weights
    weights, allowed = detected, np.ones(k)
    if known:
        weights = detected * np.exp(allowed_by(known, flat)).reshape(k, particles)
        with np.errstate(invalid="ignore"):
            allowed = np.nan_to_num(weights.sum(axis=1) / detected.sum(axis=1))
    total = np.where(allowed > least_allowed, weights.sum(axis=1), 0.0) if known else weights.sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        log_intensity = np.log(undetected) + drawn.log_density + np.log(total)
        weights = np.where(total[:, None] > 0, weights / total[:, None], 1 / particles)
    share = float(detected.sum(axis=1).mean()) if k else math.nan
    return Newborn(log_intensity, flat.reshape(k, particles, flat.shape[1]), weights, allowed, share)


def completed(motion: Motion, states: Array, further_sd: Mapping[str, float], rng: Generator) -> Array:
    """Append what the sensor did not draw of a motion's components; ``further_sd`` are their deviations."""
    names = kinematic_names(motion)
    for name in names[states.shape[1] :]:
        if name not in further_sd:
            raise ParameterError(
                f"further_sd: does not say how to draw {name!r} of a new target; give further_sd={{{name!r}: ...}}, "
                "its deviation about zero, or a sensor whose draw_births draws it."
            )
        states = np.column_stack([states, rng.normal(0.0, further_sd[name], len(states))])
    return np.asfortranarray(complete(motion, states, rng))
