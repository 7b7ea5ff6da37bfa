"""What persists of sensors' errors, as it was found with the path: a north that is off, or what looks like one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from elusive.checks import Finding
from elusive.sensors.bearing_sets import SensorSites
from elusive.systems.bearings.fitting import bias_of
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
    worst, parts, sigma_deg = 0.0, list[str](), parameters.deviation_deg
    for number, name in enumerate(sites.names if bias else ()):
        assert bias is not None
        column = names.index(f"bias_across_{number}")
        means = np.array([step.state.mean[column] for step in steps])
        spread = np.sqrt([step.state.covariance[column, column] for step in steps])
        off_deg, sure_deg = bias.sd_deg * float(means.mean()), bias.sd_deg * float(np.median(spread))
        if abs(off_deg) > max(LARGE * sigma_deg, CERTAIN * sure_deg):
            worst = max(worst, abs(off_deg) / sigma_deg)
            way = "too large" if off_deg > 0 else "too small"
            parts.append(f"the azimuths of sensor {name} are {abs(off_deg):.2g} degrees {way} (+- {sure_deg:.1g})")
    if bias and bias.sd_deg > sigma_deg and bias.memory_s < float(np.ptp([step.time_s for step in steps])):
        parts.append(f"sensors' errors wander by {bias.sd_deg:.2g} degrees and are forgotten in {bias.memory_s:.2g} s")
    return Finding(
        "bearings.norths", not parts, 0.0, worst,
        f"{upper(said + ', '.join(parts))}: so it was found with the path, whose ellipses hold for directions that "
        "err so, and not if sensors stand elsewhere or have another clock.",
        "Look at how norths were found, and at the sensors' places and clocks.", grave=worst > NO_NORTH,
    )  # fmt: skip
