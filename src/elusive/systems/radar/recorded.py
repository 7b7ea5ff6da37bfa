"""The radar of a recording: what is not told of it is as its plots show, or as is usual."""

from __future__ import annotations

import math
from typing import Self

from pydantic import Field, model_validator

from elusive.errors import ParameterError
from elusive.model import FROM_RECORDING, NonNegative, Positive, Probability
from elusive.sensors.alarm_patches import Patch
from elusive.sensors.radar import RadarSensor
from elusive.sensors.range_bands import BANDS
from elusive.systems.radar.ground import Ground
from elusive.systems.radar.ground_echoes import GroundEchoes
from elusive.systems.radar.survey import RadarSurvey
from elusive.systems.radar.wakes import START, Wakes

ROOM = 1.05  # greatest range in view, to the greatest of a plot
DOPPLER_ROOM = 1.5  # greatest range rate, to the greatest of a plot
USUAL = {  # of a radar, where the recording does not show it
    "range_sd_m": 10.0,
    "bearing_sd_mrad": 1.0,
    "detection_probability": 0.9,
    "false_alarms": 1.0,
}
PLACED = {  # anywhere alike, and none lasts
    "false_alarm_shares": (1.0,),
    "false_alarm_sectors": (1.0,),
    "false_alarm_patches": (),
    "false_alarm_ground": (),
    "false_alarm_lives": (),
    "false_alarm_wakes": (),
}
DRIFT = 4  # numbers that tell how clutter that lasts moves
LEAST = 0.1  # of these, that errors are taken to be: particles find nothing by plots without any


class RecordedRadar(RadarSensor):
    """The radar of a recording; what is not given is as its plots show."""

    range_sd_m: Positive | None = Field(  # type: ignore[assignment]
        None, description="Deviation of a range, sigma_r; none: as the plots show, or 10 [m]"
    )
    bearing_sd_mrad: Positive | None = Field(  # type: ignore[assignment]
        None, le=500, description="Deviation of a bearing, sigma_b; none: as the plots show, or 1 [mrad]"
    )
    detection_probability: Probability | None = Field(  # type: ignore[assignment]
        None, description="Probability that a scan sees a ship, P_D; none: as a first pass shows, or .9"
    )
    false_alarms: NonNegative | None = Field(  # type: ignore[assignment]
        None, description="Mean number of false alarms a scan, 0: none ever; none: as a first pass shows, or 1"
    )
    false_alarm_shares: tuple[Positive, ...] | None = Field(  # type: ignore[assignment]
        None,
        min_length=1,
        max_length=12,
        description="Their shares in bands of range, each twice as wide as the one nearer, one: uniform; none: as a "
        "first pass shows, or uniform",
    )
    false_alarm_sectors: tuple[Positive, ...] | None = Field(  # type: ignore[assignment]
        None,
        min_length=1,
        max_length=36,
        description="Their shares in equal sectors of the view, clockwise from its beginning, one: uniform; none: as a "
        "first pass shows, or uniform",
    )
    false_alarm_patches: tuple[Patch, ...] | None = Field(  # type: ignore[assignment]
        None,
        description="Patches of more of them, beside that number: nearest and furthest range [m], first and last "
        "bearing clockwise [deg], and how many a scan has; none: as a first pass shows",
        json_schema_extra=FROM_RECORDING,
    )
    false_alarm_ground: Ground | None = Field(
        None,
        description="Places of shores, bridges and quays, where there is no chart: east and north of the origin [m], "
        "how far plots spread there, xx, yy, xy [m^2], and how many a scan has; none: as a first look shows",
        json_schema_extra=FROM_RECORDING,
    )
    false_alarm_lives: tuple[float, ...] | None = Field(
        None,
        description="Those that are tracked, as groups of waves are: velocity of most, its deviation [m/s], share of "
        "the others, scans that they last, and how many come to a ship, in six bands of range; none: as a first pass "
        "shows",
        json_schema_extra=FROM_RECORDING,
    )
    false_alarm_wakes: tuple[Positive, ...] | None = Field(
        None,
        description="Plots that trail behind ships: how many a ship and scan, and how far behind on the mean [m], or "
        "nothing; none: as a first pass shows",
        json_schema_extra=FROM_RECORDING,
    )
    standing_echoes: Ground | None = Field(
        None,
        description="Places at which plots come all along, as those of ground: what lies there is as likely land or a "
        "buoy as a ship; none: as a first look shows, where ground is not told either",
        json_schema_extra=FROM_RECORDING,
    )
    max_range_m: Positive | None = Field(None, description="Greatest range in view [m]")
    max_doppler_mps: Positive | None = Field(
        None, description="Greatest range rate told apart, either sign: beyond it Doppler folds [m/s]"
    )
    doppler_probability: Probability = Field(1.0, description="Of simulations", json_schema_extra=FROM_RECORDING)

    @model_validator(mode="after")
    def _lives_and_wakes(self) -> Self:
        lives = self.false_alarm_lives or ()
        if lives and (len(lives) != DRIFT + 1 + BANDS or not min(lives[2], lives[DRIFT]) > 0):
            raise ParameterError(
                f"false_alarm_lives: must be a velocity, its deviation above zero, a share, scans above zero "
                f"and {BANDS} numbers, or nothing."
            )
        if len(self.false_alarm_wakes or START) != len(START):
            raise ParameterError("false_alarm_wakes: must be plots a ship and scan and a distance, or nothing.")
        return self

    @property
    def untold(self) -> tuple[str, ...]:
        """What of the radar is as the recording shows, by name, but for where its false alarms lie."""
        return tuple(name for name in USUAL if getattr(self, name) is None)

    @property
    def unplaced(self) -> tuple[str, ...]:
        """What is not told of where false alarms lie, by name; of none at all nothing is asked."""
        return tuple(name for name in PLACED if getattr(self, name) is None and self.false_alarms != 0)

    def _check_view(self) -> None:
        """Take none as that of the recording; the sensor that is made of both is checked."""

    def _check_range(self) -> None:
        """As well."""

    def trails(self, sensor: RadarSensor) -> Wakes | None:
        """Return the wakes that a sensor sees; None where there are none."""
        return Wakes(sensor, *self.false_alarm_wakes) if self.false_alarm_wakes else None

    def ground(self, sensor: RadarSensor) -> GroundEchoes | None:
        """Return the ground that a sensor sees; None where there is none."""
        return GroundEchoes.of(sensor, self.false_alarm_ground) if self.false_alarm_ground else None

    def standing(self, sensor: RadarSensor) -> GroundEchoes | None:
        """Return what stands where a sensor sees it; None where nothing does."""
        return GroundEchoes.of(sensor, self.standing_echoes) if self.standing_echoes else None

    def bind(self, seen: RadarSurvey) -> RadarSensor:
        """Return the sensor, with the errors and limits of a recording where none are given."""
        fields = {name: getattr(self, name) for name in type(self).model_fields}
        shown = {} if seen.errors is None else dict(zip(USUAL, seen.errors.told, strict=False))
        for name, usual in USUAL.items():
            if fields[name] is None:
                fields[name] = max(shown.get(name, usual), LEAST * usual)
        for name, anywhere in PLACED.items():
            fields[name] = fields[name] or anywhere
        if self.max_range_m is None:
            fields["max_range_m"] = max(ROOM * seen.max_range_m, self.min_range_m + 2 * fields["range_sd_m"])
        if self.max_doppler_mps is None:
            fields["max_doppler_mps"] = max(DOPPLER_ROOM * seen.max_doppler_mps, 2.01 * math.pi * self.doppler_sd_mps)
        return RadarSensor(**{name: fields[name] for name in RadarSensor.model_fields})
