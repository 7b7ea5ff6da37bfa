"""What is learnt live of one emitter's bearings: as of a recording, from the latest times."""

from __future__ import annotations

from collections.abc import Sequence

from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.deviation import errors_found
from elusive.systems.bearings.faults import LEAST_TIMES
from elusive.systems.bearings.fitting import bias_of
from elusive.systems.bearings.found_norths import Norths, exact, norths_found
from elusive.systems.bearings.live_fit import LiveFit
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import powers_found


class OneFit(LiveFit):
    """Learns unless something else explains what bearings leave; a bias that is told is estimated with the path."""

    def __init__(self, parameters: BearingTracking, sites: SensorSites, first: PlaceSet | None) -> None:
        super().__init__(parameters, sites, first, exact(sites), seeks=bias_of(parameters) is None)

    def _learnt(self, alone: Sequence[Sequence[PlaceSet]]) -> tuple[BearingTracking, Norths]:
        found, norths, (heard,) = self.given, self._told, alone
        if len(heard) < LEAST_TIMES:
            norths = self.norths
        elif self._tells(alone):
            found = errors_found(found, self._sites, heard)
            norths = norths_found(found, self._sites, alone) if self._seeks and bias_of(found) else norths
            found = found.replace(filter=self.given.filter)
        return powers_found(found, self._sites, [[norths.righted(one) for one in heard]]), norths
