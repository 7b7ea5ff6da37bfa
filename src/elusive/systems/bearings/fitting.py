"""How well bearings fit the most probable path of one emitter, when they are read in another way."""

from __future__ import annotations

from collections.abc import Sequence

from elusive.errors import ElusiveError
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.choices import Estimation, OneEmitter
from elusive.systems.bearings.leftovers import Scale, leftovers, scale_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.track import track
from elusive.tracking.track import Step

BETTER = 3.0  # times by which another reading must fit better, or lie far less often
FITS_HALF, FITS_FAR = 1.8, 0.15  # residuals in the median to what is expected, and share of those that lie far


def fits(scale: Scale) -> bool:
    """Say whether residuals are about as large as they should be."""
    return scale.half < FITS_HALF and scale.far < FITS_FAR


def better(scale: Scale, than: Scale) -> bool:
    """Say whether residuals fit where others did not."""
    return fits(scale) and (scale.half < than.half / BETTER or (than.far > FITS_FAR and scale.far < than.far / BETTER))


def tracked(
    heard: Sequence[object], parameters: BearingTracking, sites: SensorSites
) -> tuple[list[Step], Scale | None]:
    """Return the path and the size of its residuals; nothing where there is none."""
    asked = parameters.replace(motion=parameters.plain_motion, emitters=OneEmitter()).by("map")
    assert isinstance(asked.filter, Estimation)
    try:
        steps = list(track(heard, asked, sites))  # type: ignore[arg-type]
    except ElusiveError:
        return [], None
    sensor = asked.sensor_of(sites, BearingSet, "z" in steps[0].state.state_names)
    return steps, scale_of(leftovers(steps, sensor, asked.filter))
