"""Paths of one emitter with the errors of sensors that its bearings tell, together as probable as each is.

Hoeting, Madigan, Raftery and Volinsky (1999), Statistical Science 14(4): a mean over models by their evidence, each
error's size as uncertain as the curvature of the evidence leaves it (MacKay, 2003, section 27).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import softmax

from elusive.contracts import Array
from elusive.sensors.bearing_sets import SensorSites
from elusive.systems.bearings.faults import Explained, Fault, exactly
from elusive.systems.bearings.fitting import path_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.sensor_errors import Sizes, also_at
from elusive.tracking.track import Step

HARDLY = 7.0  # of log evidence, below which an error is left out


class PathWith(NamedTuple):
    """A path with an error of a sensor."""

    mean: Array  # (K, d)
    spread: Array  # (K, d, d), if the error is exactly as large as is likeliest
    by_size: Array  # (K, d, d) how far it moves as the size is uncertain


def mended(steps: Sequence[Step], fault: Fault | None, parameters: BearingTracking, sites: SensorSites) -> list[Step]:
    """Return the steps of one emitter, of bearings alone, as an error of a sensor leaves them; none: as they are.

    Parameters
    ----------
    steps
        As the path was tracked, of all times.
    fault
        What its bearings tell.
    parameters, sites
        What it was tracked with.
    """
    if fault is None or not all(step.tracks and step.state.started for step in steps):
        return list(steps)
    logs = np.array([fault.claimed, *(one.gain for one in fault.perhaps)])
    names = tuple(name for name in steps[0].state.state_names if not name.startswith("bias"))
    d = len(names)
    means = [np.array([step.tracks[0].mean[:d] for step in steps])]
    spreads = [np.array([step.tracks[0].covariance[:d, :d] for step in steps])]
    kept = [logs[0]]
    for log, one in zip(logs[1:].tolist(), fault.perhaps, strict=True):
        if log > logs.max() - HARDLY and (found := path_with(one, steps, names, parameters, sites)) is not None:
            kept, means, spreads = [*kept, log], [*means, found.mean], [*spreads, found.spread + found.by_size]
    weight = softmax(kept)
    mean = np.einsum("m,mkd->kd", weight, means)
    off = np.array(means) - mean
    spread = np.einsum("m,mkij->kij", weight, spreads) + np.einsum("m,mki,mkj->kij", weight, off, off)
    return [
        step._replace(
            state=step.state._replace(state_names=names, mean=its, covariance=P),
            tracks=(step.tracks[0]._replace(mean=its, covariance=P),),
        )
        for step, its, P in zip(steps, mean, spread, strict=True)
    ]


def path_with(
    one: Explained, steps: Sequence[Step], names: tuple[str, ...], parameters: BearingTracking, sites: SensorSites
) -> PathWith | None:
    """Return a path with an error, at the times of steps of which only what was heard is taken.

    Parameters
    ----------
    one
        The error.
    steps
        Of one emitter.
    names
        Of the state's components: of several motions a path is of one.
    parameters, sites
        What it was tracked with.
    """
    heard, times_s = [step.measurement for step in steps], [step.time_s for step in steps]
    asked = exactly(parameters)

    def along(sizes: Sizes) -> tuple[Array, Array] | None:
        part, places = one.error.without(heard, sites, sizes)
        path = path_of(also_at(times_s, part), asked, places)
        if path is None or path[0].state.state_names != names:
            return None
        at = {step.time_s: step.tracks[0] for step in path}
        tracks = [at[time_s] for time_s in times_s]
        return np.array([track.mean for track in tracks]), np.array([track.covariance for track in tracks])

    found = along(one.sizes)
    if found is None:
        return None
    by_size = np.zeros_like(found[1])
    for axis in one.spread:
        other = along(tuple(np.add(one.sizes, axis).tolist()))
        if other is not None:
            moved = other[0] - found[0]
            by_size += np.einsum("ki,kj->kij", moved, moved)
    return PathWith(*found, by_size)
