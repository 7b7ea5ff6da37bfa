"""What an error of a lone moving receiver's own heading would do: its bearings contradict none.

Of one receiver the distance comes from its own turns (Nardone, Lindgren and Gong, 1984): azimuths that are all off by
as much fit a path elsewhere nearly as well, and distances are in proportion to the way it says that it went.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from elusive.checks import Finding
from elusive.contracts import X, Y
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.fitting import apart_by, bias_of, evidence_of, path_of, tried_with
from elusive.systems.bearings.heard import moving, sensors_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.sensor_errors import shifted
from elusive.tracking.track import Step

TIMES = 400  # of the recording's beginning, on which it is tried
LEAST_TIMES = 12
UNSEEN = 5.0  # of log evidence, by which an error of the heading that is there may lie below none
MOVED = 1.0  # deviations that the path moves, from which its ellipses hold for an exact heading alone


def receiver_finding(
    steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, said: str
) -> Finding | None:
    """Say how far a path lies off with a heading as wrong as one bearing is; None: no lone receiver moves."""
    heard = [step.measurement for step in steps[:TIMES] if isinstance(step.measurement, BearingSet)]
    used = set[int]().union(*(set(sensors_of(times).tolist()) for times in heard))
    if bias_of(parameters) or len(heard) < LEAST_TIMES or len(used) != 1 or not moving(heard):
        return None
    asked = tried_with(parameters)
    base = path_of(heard, asked, sites)
    moved = away_m = lost = 0.0
    for size in (-parameters.deviation_deg, parameters.deviation_deg):
        turned = [shifted(times, [*used], np.full(len(times.sensor), np.deg2rad(size))) for times in heard]
        other = path_of(turned, asked, sites)
        if base is None or other is None or evidence_of(base) - evidence_of(other) > UNSEEN:
            continue
        off = np.array([a.tracks[0].mean[[X, Y]] - b.tracks[0].mean[[X, Y]] for a, b in zip(base, other, strict=True)])
        if (by := apart_by(base, other)) > moved:
            moved, away_m = by, float(np.median(np.hypot(*off.T)))
            lost = evidence_of(other) - evidence_of(base)
    return Finding(
        "bearings.receiver", moved <= MOVED, 0.0, moved,
        f"{said}One receiver alone moves, and its heading and places are taken as exact, which nothing here can "
        f"contradict: were all azimuths {parameters.deviation_deg:g} degrees off, they would fit as well (log evidence "
        f"{lost:+.1f}), and the path would lie {away_m:.3g} m away, {moved:.1f} of its deviations. An error of a "
        "hundredth in the receiver's own way is a hundredth of the distance.",
        "Take the ellipses for those of an exact heading; measure it on an emitter whose place is known, or add a "
        "second receiver.",
        grave=False,  # a right heading is told from a wrong one by no bearing
    )  # fmt: skip
