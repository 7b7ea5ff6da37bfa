"""What a live tracker is not told, learnt while bearings come: how emitters move, how precise bearings are, norths."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping, Sequence

from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import Estimation, Powered, SeveralEmitters
from elusive.systems.bearings.found_norths import Norths, norths_found, norths_of
from elusive.systems.bearings.heard import sensors_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.persisting import with_persisting
from elusive.systems.bearings.powers import LEAST_TIMES, no_calmer
from elusive.systems.bearings.settled import MOST_DEG, settled
from elusive.systems.bearings.speeds import with_speeds
from elusive.systems.bearings.uneven import with_sensor_times

LATEST, FIRST, EVERY = 200, 10, 100  # times that tell, after how many first, and how often at the rarest
MOST_EMITTERS = 3  # that tell, those that are heard for longest


class LiveFit(ABC):
    """Learns from the latest times, at twice as many, then at each hundred.

    Who has flown calmly may turn: no power is less than the usual one. Norths that are sought are as uncertain as
    beforehand until something is learnt.

    Parameters
    ----------
    parameters
        Of how emitters are tracked.
    sites
        Where the sensors stand.
    first
        What is heard first; None: of a recording, in which nothing is learnt.
    told
        The norths that are tracked with where none are sought.
    seeks
        Whether norths are sought, if bearings can tell them.
    """

    def __init__(
        self, parameters: BearingTracking, sites: SensorSites, first: PlaceSet | None, told: Norths, *, seeks: bool
    ) -> None:
        self.parameters, self.given, self._sites, self._told = parameters, parameters, sites, told
        self._seeks = seeks and first is not None and self._tells([[first]]) and len(sites.names) > 1
        self.norths = norths_found(parameters, sites, []) if self._seeks else told
        self._latest, self._count, self._due = deque[Mapping[int, PlaceSet]](maxlen=LATEST), 0, FIRST

    def heed(self, own: Mapping[int, PlaceSet]) -> bool:
        """Take each emitter's own measurement of a time, as it came, and say whether something else is learnt."""
        self._latest.append({number: one for number, one in own.items() if len(sensors_of(one))})
        self._count += 1
        if self._count < self._due:
            return False
        self._due += min(self._count, EVERY)
        parts = dict[int, list[PlaceSet]]()
        for time in self._latest:
            for number, one in time.items():
                parts.setdefault(number, []).append(one)
        alone = sorted((part for part in parts.values() if len(part) >= LEAST_TIMES), key=len)[-MOST_EMITTERS:]
        if not alone:
            return False
        before = self.parameters, self.norths
        found, self.norths = self._learnt(alone)
        self.parameters = no_calmer(found, self.given)
        return before != (self.parameters, self.norths)

    @abstractmethod
    def _learnt(self, alone: Sequence[Sequence[PlaceSet]]) -> tuple[BearingTracking, Norths]:
        """Learn from the bearings of each emitter, as they came."""

    def _tells(self, heard: Sequence[Sequence[PlaceSet]]) -> bool:
        """Say whether measurements tell a deviation and norths: all, or the first, which is of some sensors."""
        every = [one for part in heard for one in part]
        stand = all(isinstance(one, BearingSet) and one.places_m is None for one in every)
        several = len(every) == 1 or len({row for one in every for row in sensors_of(one).tolist()}) > 1
        known = isinstance(self.given.filter, Estimation) and isinstance(self.given.motion, Powered)
        return stand and several and known


class SeveralFit(LiveFit):
    """The same of several emitters; see :class:`LiveFit`."""

    def __init__(self, parameters: BearingTracking, sites: SensorSites, first: PlaceSet | None) -> None:
        assert isinstance(parameters.emitters, SeveralEmitters)
        seeks = parameters.emitters.norths_deg is None
        super().__init__(parameters, sites, first, norths_of(parameters, sites), seeks=seeks)

    def _learnt(self, alone: Sequence[Sequence[PlaceSet]]) -> tuple[BearingTracking, Norths]:
        given, seeks = self.given, self._seeks and self._tells(alone)
        if not self._tells(alone):
            given = given.replace(sigma_deg=given.deviation_deg)
        begun, norths = given.replace(sigma_deg=self.parameters.deviation_deg), self.norths if seeks else self._told
        found = settled(begun, given, norths, self._sites, alone, straight=not seeks)
        if given.sigma_deg is None and found[0].deviation_deg > MOST_DEG:
            return self.given, self._told
        asked, norths = found
        own = [[norths.righted(one) for one in part] for part in alone]
        assert isinstance(given.emitters, SeveralEmitters)
        asked = with_speeds(asked, given.emitters, self._sites, own)
        asked = asked if given.sigma_deg else with_sensor_times(asked, self._sites, own)
        return with_persisting(asked, given.sigma_deg, self._sites, own[-1:]), norths
