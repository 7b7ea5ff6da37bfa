"""Parameters of tracking ships by radar, filled from the recording where they are not given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from elusive.charts import Coast, ExactWater, FieldWater, GridWater, HardWater, NearestWater, WaterModel
from elusive.charts.charted_area import ChartedAreaParameters
from elusive.charts.constraints import Constraint
from elusive.contracts import Array, Knowledge, Motion
from elusive.errors import ParameterError
from elusive.filters.particle.coast_error import CoastError, with_coast
from elusive.model import FROM_RECORDING, Model, NonNegative
from elusive.motion import ConstantVelocity, MovingOrAnchored
from elusive.motion.extent import WithExtent
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_hulls import HullRadar
from elusive.systems.radar.land import LandEchoes
from elusive.systems.radar.recorded import RecordedRadar
from elusive.tracking.detections import DetectionRules, DetectionTracker
from elusive.tracking.fixed_echoes import Backdrop

FEWER, FEWEST = 4, 300  # times fewer particles where less has to be known, and how many there are at least then
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

    @property
    def fewer(self) -> int:
        """Number of particles of what begins, and of tracks by which a radar is judged: few plots are a ship's."""
        return max(self.particles // FEWER, min(self.particles, FEWEST))

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
        backdrop: Backdrop | None = self.radar.ground(sensor)
        if coast is None:
            self.check_uncharted()
        elif isinstance(self.knowledge, WaterModel):
            motion, *knowledge = with_coast(motion, self.knowledge, coast, self.coast)
            if land_plots:
                backdrop = LandEchoes(sensor, self.knowledge.bind(coast), land_plots, way)
        rules = {name: getattr(self.tracker, name) for name in DetectionRules.model_fields}
        return DetectionTracker(
            **rules, motion=motion, sensor=sensor, knowledge=(*knowledge, *self.constraints), backdrop=backdrop,
            trails=self.radar.trails(sensor), particles=self.particles,
            fewer=None if isinstance(sensor, HullRadar) else self.fewer,  # a hull's length is known by few of them
        )  # fmt: skip


def _told(name: str, value: object, usual: object) -> str:
    """Return the name of the first field in which a value is not the usual one; empty where it is."""
    if isinstance(value, Model) and type(value) is type(usual):
        fields = (_told(field, getattr(value, field), getattr(usual, field)) for field in type(value).model_fields)
        return next(filter(None, fields), "")
    return "" if value == usual else name
