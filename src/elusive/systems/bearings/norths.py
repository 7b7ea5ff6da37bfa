"""What persists of sensors' errors, as it was found with the path: a north that is off, or what looks like one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.sensors.bearing_sets import SensorSites
from elusive.systems.bearings.fitting import bias_of
from elusive.systems.bearings.found_norths import Norths
from elusive.systems.bearings.geometry import upper
from elusive.systems.bearings.parameters import BearingTracking
from elusive.tracking.track import Step

LARGE, CERTAIN = 2.0, 4.0  # deviations of a bearing, and of what is found of the error, beyond which it is said
NO_NORTH = 5.0  # deviations of a bearing, beyond which another cause is as likely


def norths_finding(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, said: str = "") -> Finding:
    """Say which sensors' azimuths are off by far more than their deviation, by how much, and what else persists.

    The path is estimated with it, as of directions that err; a sensor's place or clock that is wrong looks like that
    for a while.

    Parameters
    ----------
    steps
        Of one emitter; their states are of :class:`~elusive.systems.bearings.track.Emitter`.
    parameters, sites
        What it was tracked with.
    """
    bias, names = bias_of(parameters), steps[0].state.state_names
    off_deg, sure_deg, parts = np.zeros(0), np.zeros(0), list[str]()
    if bias:
        columns = [names.index(f"bias_across_{number}") for number in range(len(sites.names))]
        off_deg = bias.sd_deg * np.mean([step.state.mean[columns] for step in steps], axis=0)
        variances = [step.state.covariance[columns, columns] for step in steps]
        sure_deg = bias.sd_deg * np.sqrt(np.median(variances, axis=0))
        if bias.sd_deg > parameters.deviation_deg and bias.memory_s < float(np.ptp([step.time_s for step in steps])):
            parts = [f"sensors' errors wander by {bias.sd_deg:.2g} degrees and are forgotten in {bias.memory_s:.2g} s"]
    return _finding(off_deg, sure_deg, parameters, sites, said, parts)


def learnt_norths_finding(norths: Norths, parameters: BearingTracking, sites: SensorSites) -> Finding:
    """Say the same of norths that were found beside the tracks, of several emitters or live."""
    return _finding(np.array(norths.off_deg), norths.sd_deg, parameters, sites, "", [])


def _finding(
    off_deg: Array, sure_deg: Array, parameters: BearingTracking, sites: SensorSites, said: str, wander: list[str]
) -> Finding:
    """Say what sensors' norths are off by, ``(n,)`` or none, how sure that is, and what wanders."""
    worst, parts, sigma_deg = 0.0, list[str](), parameters.deviation_deg
    for name, off, sure in zip(sites.names[: len(off_deg)], off_deg.tolist(), sure_deg.tolist(), strict=True):
        if abs(off) > max(LARGE * sigma_deg, CERTAIN * sure):
            worst = max(worst, abs(off) / sigma_deg)
            way = "too large" if off > 0 else "too small"
            parts.append(f"the azimuths of sensor {name} are {abs(off):.2g} degrees {way} (+- {sure:.1g})")
    parts += wander
    return Finding(
        "bearings.norths", not parts, 0.0, worst,
        f"{upper(said + ', '.join(parts))}: so it was found with the path, whose ellipses hold for directions that "
        "err so, and not if sensors stand elsewhere or have another clock.",
        "Look at how norths were found, and at the sensors' places and clocks.", grave=worst > NO_NORTH,
    )  # fmt: skip
