"""What a live run is not told of its radar, learnt while scans come: from the first, and then from the latest sixty.

The first scans are tracked as a recording's are (:mod:`elusive.systems.radar.first_pass`); from then on what the run
itself counts replaces what was found, and errors of plots are fitted again whenever the scans have doubled.
"""

from __future__ import annotations

from collections.abc import Sequence

from elusive.charts import Water
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.range_bands import BANDS, SECTORS
from elusive.systems.radar.counted import Counts
from elusive.systems.radar.first_pass import FEWEST, TRIALS, fitted, possible, spread, standing_asked, stood
from elusive.systems.radar.ground import Fixed
from elusive.systems.radar.land import land_shares
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.patches import beside
from elusive.systems.radar.righted import Righting
from elusive.systems.radar.ships import Surroundings
from elusive.systems.radar.survey import RadarSurvey
from elusive.systems.radar.triples import Triples
from elusive.tracking.track import Step

LOOK = 10  # scans that are waited for, and after which what is counted is taken over
TELLING = 40  # by which ships of several echoes are told from patches of false alarms
MEMORY = 60  # scans: in them a thirtieth of thirty alarms a scan is known, and a rising sea within minutes
DOUBLED = 640  # scans at which errors are fitted last


class Learnt:
    """What is known of a radar by now.

    Parameters
    ----------
    asked
        The run's parameters; what they tell of the radar stays.
    first
        Scans, see :data:`LOOK`.
    seen, around, outline
        Of a look through these, and the charts.
    """

    def __init__(
        self,
        asked: RadarTracking,
        first: Sequence[RadarScan],
        seen: RadarSurvey,
        around: Surroundings,
        outline: Water | None,
    ) -> None:
        self.told = asked.radar
        self.parameters, self.seen = fitted(asked, first, seen, around, outline)
        self._asked = standing_asked(asked.radar, charted=around.charted is not None)
        self._fixed = Fixed.of(asked.radar.bind(self.seen), first) if self._asked else None
        self.counts, self.headings = Counts(memory_scans=MEMORY), Righting()
        self._errors: Triples | None = Triples()
        self._scans, self._first, self._fit_at = 0, len(first), len(first)

    def add(self, step: Step, sensor: RadarSensor, water: Water | None) -> bool:
        """Take a step in; return whether what is known of the radar has changed."""
        self._scans += 1
        if self._fixed is not None:
            self._fixed.add(step.measurement, sensor.places(step.measurement)[0])
        rest = self.counts.add(step, sensor, water, self.parameters.radar)
        if not (self.told.untold or self.told.unplaced):
            return False
        if self._errors is not None:
            self._errors.add(beside(rest, self.parameters.radar.false_alarm_patches or ()))
        if self._scans < self._first:  # of which more is known than is counted again by now
            return False
        if not self.counts.risen() and self._scans % LOOK:
            return False
        if self._errors is not None and self._scans == self._fit_at:
            self.seen = self.seen._replace(errors=self._errors.fit() or self.seen.errors)
            self._fit_at *= 2
            if self._fit_at > DOUBLED:
                self._errors = None
        heard = self.counts.heard(land_shares(sensor, water, BANDS, SECTORS, self.seen.way[:, 1:]), sensor)
        shown = self.told.bind(self.seen)
        found: dict[str, object] = {name: getattr(shown, name) for name in ("range_sd_m", "bearing_sd_mrad")}
        if self.told.false_alarms is None:
            found["false_alarms"] = max(heard.alarms.false, FEWEST)
        found |= spread(self.told, heard)
        if self._fixed is not None:
            found |= stood(self._fixed, sensor, self._asked)
        if self.told.detection_probability is None and heard.trials >= TRIALS:
            found["detection_probability"] = possible(heard.detected)
        self.parameters = self.parameters.replace(radar=self.parameters.radar.replace(**found))
        return True
