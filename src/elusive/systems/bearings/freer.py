"""Whether an emitter turns harder than its motion allows, by the evidence of its path (MacKay, 2003, section 28.1)."""

from __future__ import annotations

import math
from collections.abc import Sequence

from elusive.checks import Finding
from elusive.sensors.bearing_sets import SensorSites
from elusive.systems.bearings.choices import Powered
from elusive.systems.bearings.faults import LEAST_TIMES, LONGEST
from elusive.systems.bearings.fitting import apart_by, evidence_of, path_of, tried_with
from elusive.systems.bearings.parameters import BearingTracking
from elusive.tracking.track import Step

FREER = 4.0  # times the power of the motion's noise that is tried
MANOEUVRES, HARDLY = 20.0, 0.5  # of log evidence (flights with sharp corners reach 14), and deviations of the path


def motion_finding(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, said: str) -> Finding:
    """Check that the emitter moves as it may, by the evidence of its path where it may manoeuvre more."""
    heard = [step.measurement for step in steps[:LONGEST]]
    motion = parameters.plain_motion
    gain = moved = 0.0
    tried = FREER * (motion.q or 0.0) if isinstance(motion, Powered) else math.nan
    if len(heard) >= LEAST_TIMES and isinstance(parameters.motion, Powered):
        asked = tried_with(parameters)
        freer = asked.replace(motion=motion.replace(q=tried))
        base, other = path_of(heard, asked, sites), path_of(heard, freer, sites)
        if base is not None and other is not None:
            gain, moved = evidence_of(other) - evidence_of(base), apart_by(base, other)
    return Finding(
        "bearings.motion", gain <= MANOEUVRES or moved <= HARDLY, 0.0, gain,
        f"{said}The emitter turns harder than the motion allows: with {FREER:g} times the --q the bearings' log "
        f"evidence rises by {gain:.0f}, and the path moves by {moved:.1f} of its deviations. Corners are cut, and the "
        "ellipses there too small.", f"Tell --q {tried:.3g} or more; "
        "elusive fit bearings finds it.",
    )  # fmt: skip
