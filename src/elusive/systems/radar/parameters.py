"""Parameters of tracking ships by radar, filled from the recording where they are not given."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from elusive.charts import Coast, ExactWater, FieldWater, GridWater, HardWater, NearestWater, WaterModel
from elusive.charts.charted_area import ChartedAreaParameters
from elusive.charts.constraints import Constraint
from elusive.contracts import Array, Knowledge, Motion
from elusive.errors import ParameterError
from elusive.filters.particle.coast_error import CoastError, with_coast
from elusive.model import FROM_RECORDING, Model, NonNegative, Positive, Probability
from elusive.motion import ConstantVelocity, MovingOrAnchored
from elusive.motion.extent import WithExtent
from elusive.sensors.alarm_patches import Patch
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_hulls import HullRadar
from elusive.systems.radar.land import LandEchoes
from elusive.systems.radar.survey import RadarSurvey
from elusive.tracking.detections import DetectionRules, DetectionTracker

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
    "false_alarm_lives": (),
}
LEAST = 0.1  # of these, that errors are taken to be: particles find nothing by plots without any
BEHAVIOURS = {  # of the coast's error, with which each of its parameters counts
    "coast_correlation_m": ("persistent", "bias"),
    "coast_share": ("persistent",),
    "bias_sd_m": ("bias",),
}
SHIP_Q = Field(
    (2 / 3) ** 2,
    description="Power of the white acceleration while under way, (a_max / 3)^2 of a greatest acceleration a_max, "
    "2 m/s^2 by default [m^2 / s^3]",
)


class NoMap(Model):
    """No chart is used."""

    kind: Literal["none"] = "none"


class UnderWay(ConstantVelocity):
    """A ship that is under way all the time."""

    q: NonNegative = SHIP_Q


class UnderWayOrAnchored(MovingOrAnchored):
    """A ship that lies at anchor at times."""

    q: NonNegative = SHIP_Q


MapUse = Annotated[NoMap | HardWater | NearestWater | GridWater | ExactWater | FieldWater, Field(discriminator="kind")]
ShipMotion = Annotated[UnderWay | UnderWayOrAnchored, Field(discriminator="kind")]


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
    false_alarm_lives: tuple[NonNegative, ...] | None = Field(  # type: ignore[assignment]
        None,
        description="Those that are tracked, as groups of waves are: scans that they last, and how many come to a "
        "ship, in six bands of range; none: as a first pass shows",
        json_schema_extra=FROM_RECORDING,
    )
    max_range_m: Positive | None = Field(None, description="Greatest range in view [m]")
    max_doppler_mps: Positive | None = Field(
        None, description="Greatest range rate told apart, either sign: beyond it Doppler folds [m/s]"
    )
    doppler_probability: Probability = Field(1.0, description="Of simulations", json_schema_extra=FROM_RECORDING)

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
        return RadarSensor(**fields)


class RadarTracking(Model):
    """Parameters of `elusive track radar`."""

    main_options: ClassVar[tuple[str, ...]] = (
        "motion", "q", "range_sd_m", "bearing_sd_mrad", "detection_probability", "false_alarms",
        "coast_sigma_m", "coast_error", "knowledge", "seed",
    )  # fmt: skip

    knowledge: MapUse = Field(FieldWater(), description="How the chart is used, where there is one")
    charted: ChartedAreaParameters = Field(ChartedAreaParameters(), description="What the charts are taken to say")
    coast: CoastError = Field(CoastError(), description="How the coast's error behaves over time")
    constraints: tuple[Constraint, ...] = Field(
        (),
        description="What else bounds ships: speed, course, a lane; keys of a configuration",
        json_schema_extra=FROM_RECORDING,
    )
    radar: RecordedRadar = Field(RecordedRadar(), description="The radar")
    motion: ShipMotion = Field(
        UnderWay(), description="How ships move: under way all the time, or lying at anchor at times"
    )
    extent: Literal["point", "hull"] | None = Field(
        None,
        description="What ships are: points of a plot each, or hulls, along which several plots lie; none: hulls where "
        "the recording's plots come in bunches",
    )
    particles: int = Field(2000, ge=100, description="Number of particles of each track, N")
    estimate: Literal["mean", "map"] = Field("mean", description="What is written as a track's place: mean or MAP")
    tracker: DetectionRules = Field(DetectionRules(), description="When a track begins and ends")
    seed: int = Field(0, ge=0, description="Root of all random numbers")

    @model_validator(mode="before")
    @classmethod
    def _exact_is_exact(cls, given: Any) -> Any:
        """Give a chart that is taken as exact no error that persists, if none is asked for."""
        knowledge = given.get("knowledge") if isinstance(given, Mapping) else None
        kind = knowledge.get("kind") if isinstance(knowledge, Mapping) else getattr(knowledge, "kind", None)
        coast = given.get("coast", {}) if kind == "hard" else None
        if isinstance(coast, Mapping) and "coast_error" not in coast:
            return {**given, "coast": {**coast, "coast_error": "fresh"}}
        return given

    @model_validator(mode="after")
    def _takes_effect(self) -> Self:
        fields = type(self.coast).model_fields
        behaviour = self.coast.coast_error
        unused = {name: f"coast_error {behaviour!r}" for name, kinds in BEHAVIOURS.items() if behaviour not in kinds}
        if self.extent == "hull" and not isinstance(self.motion, ConstantVelocity):
            raise ParameterError("extent: hulls point where ships go, which at anchor is nowhere; leave motion out.")
        if isinstance(self.knowledge, NoMap):
            unused = dict.fromkeys(fields, "knowledge 'none'")
        for name, reason in unused.items():
            if getattr(self.coast, name) != fields[name].default:
                raise ParameterError(f"{name}: has no meaning for {reason}; leave it out.")
        return self

    def check_uncharted(self) -> None:
        """Refuse what was told of the use of a chart, where there is none.

        Raises
        ------
        ParameterError
            If something was.
        """
        for name in () if isinstance(self.knowledge, NoMap) else ("knowledge", "charted", "coast"):
            if told := _told(name, getattr(self, name), type(self).model_fields[name].default):
                raise ParameterError(
                    f"{told}: says how a chart is used, and no chart is given; give --chart, or leave it out."
                )

    def bind(
        self,
        sensor: RadarSensor,
        coast: Coast | None,
        land_plots: float = 0.0,
        way: Array | None = None,
        *,
        hulls: bool = False,
    ) -> DetectionTracker:
        """Return the tracker for a radar and a coast, and for the mean number of plots that a scan has of land.

        The radar's ``way``, places ``(S, 2)`` [m] beside the sensor's own, says how much land it has seen. Ships have
        ``hulls`` if nothing else is asked for.

        Raises
        ------
        ParameterError
            If there is no coast, and it was told how to use one.
        """
        motion: Motion = self.motion
        if isinstance(self.motion, ConstantVelocity) and self.extent != "point" and (hulls or self.extent == "hull"):
            motion = WithExtent(motion=ConstantVelocity(q=self.motion.q))
            sensor = HullRadar(**{name: getattr(sensor, name) for name in type(sensor).model_fields})
        knowledge: Sequence[Knowledge] = ()
        backdrop = None
        if coast is None:
            self.check_uncharted()
        elif isinstance(self.knowledge, WaterModel):
            motion, *knowledge = with_coast(motion, self.knowledge, coast, self.coast)
            if land_plots:
                backdrop = LandEchoes(sensor, self.knowledge.bind(coast), land_plots, way)
        rules = {name: getattr(self.tracker, name) for name in DetectionRules.model_fields}
        return DetectionTracker(
            **rules, motion=motion, sensor=sensor, knowledge=(*knowledge, *self.constraints), backdrop=backdrop,
            particles=self.particles,
        )  # fmt: skip


def _told(name: str, value: object, usual: object) -> str:
    """Return the name of the first field in which a value is not the usual one; empty where it is."""
    if isinstance(value, Model) and type(value) is type(usual):
        fields = (_told(field, getattr(value, field), getattr(usual, field)) for field in type(value).model_fields)
        return next(filter(None, fields), "")
    return "" if value == usual else name
