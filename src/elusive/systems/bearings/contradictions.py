"""Whether the bearings contradict that they are of one emitter: how far they lie from its track."""

from __future__ import annotations

import math

import numpy as np

from elusive.contracts import Array
from elusive.systems.bearings.choices import Estimation
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.report import BearingsTracked

FAR, STRAYS = 5.0, 0.1  # deviations from the track, and the share of bearings that may be as far


def contradictions(tracked: BearingsTracked, parameters: BearingTracking) -> list[str]:
    """Say that many bearings are not the track's, if so: of another emitter, or their noise is told too small."""
    flt, sigma = parameters.filter, parameters.sigma_deg
    if isinstance(flt, Estimation) and flt.bias is not None:
        sigma = math.hypot(sigma, flt.bias.sd_deg)
    known = np.repeat(tracked.known, np.diff(tracked.first)) & np.isfinite(tracked.residual_deg)
    far = np.abs(tracked.residual_deg[known]) > FAR * np.hypot(sigma, _seen_deg(tracked)[known])
    if not len(far) or far.mean() <= STRAYS:
        return []
    return [
        f"{100 * far.mean():.0f} % of the bearings are further than {FAR:g} deviations from the track: of another "
        "emitter, or less precise than --sigma-deg. Do not rely on it; --emitters several follows more than one."
    ]


def _seen_deg(tracked: BearingsTracked) -> Array:
    """Deviation of the place as each bearing's sensor sees it, ``(M,)``."""
    rows = np.repeat(np.arange(len(tracked.times_s)), np.diff(tracked.first))
    away = np.hypot(*(tracked.places[rows] - tracked.sensors[tracked.sensor]).T)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.rad2deg(np.arctan(tracked.deviation[rows] / away)))
