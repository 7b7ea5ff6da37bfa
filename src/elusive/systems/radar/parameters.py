"""Parameters of tracking ships by radar, filled from the recording where they are not given."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from elusive.charts import Coast, ExactWater, FieldWater, GridWater, HardWater, NearestWater, Water, WaterModel
from elusive.charts.charted_area import ChartedAreaParameters
from elusive.charts.constraints import Constraint
from elusive.contracts import Array, Knowledge, Motion
from elusive.errors import ParameterError
from elusive.filters.particle.coast_error import CoastError, with_coast
from elusive.model import FROM_RECORDING, Model, NonNegative, Positive, Probability
from elusive.motion import ConstantVelocity, MovingOrAnchored
from elusive.motion.extent import WithExtent
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_hulls import HullRadar
from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar import bunches
from elusive.systems.radar.bunches import Bunches, at_sea
from elusive.systems.radar.given import Gathered, Given
from elusive.systems.radar.land import LandEchoes, land_share
from elusive.systems.radar.registered import FixedPlaces
from elusive.systems.radar.triples import PlotErrors, Triples
from elusive.tracking.detections import DetectionRules, DetectionTracker

ROOM = 1.05  # greatest range in view, to the greatest of a plot
HALF = 0.5  # P(water) below which a plot is on charted land
PASSED = 10_000  # scans of which what stands still is looked for
DOPPLER_ROOM = 1.5  # greatest range rate, to the greatest of a plot
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


class RadarSurvey(NamedTuple):
    """What a look through a recording's scans says before they are tracked."""

    scans: int
    plots: int
    max_range_m: float
    max_doppler_mps: float  # 0 where there is none
    on_chart: int  # plots on a chart
    on_land: int  # plots on charted land
    radar_on_chart: bool
    bearings_deg: tuple[float, float] = (math.nan, math.nan)  # least and greatest
    errors: PlotErrors | None = None  # that the plots show; None: too few follow each other
    way: Array = np.zeros((1, 3))  # (S, 3) times and places of the radar itself [s, m]; one row where it rests
    given: Given = Given()
    fixed: Array = np.zeros((0, 2))  # (n, 2) places of echoes that stay, where the radar rests and there is a chart [m]
    bunched: float = math.nan  # plots near a plot, off charted land, that chance does not explain; NaN: not known
    passed: tuple[RadarScan, ...] = ()  # the first scans of a radar that moves

    @property
    def hulls(self) -> bool:
        """Whether plots come in bunches, as those of ships that are seen by several echoes."""
        return self.bunched > bunches.MOST and self.max_range_m > 2 * bunches.NEAR_M

    def land_plots(self, sensor: RadarSensor, water: Water | None) -> float:
        """Mean number of plots that a scan has of land, beside false alarms there; none where there are none ever."""
        if water is None or not self.scans or not sensor.false_alarms:
            return 0.0
        return max(0.0, self.on_land / self.scans - sensor.false_alarms * land_share(sensor, water, self.way[:, 1:]))


def survey(scans: Iterable[RadarScan], water: Water | None = None) -> RadarSurvey:
    """Look through a radar's scans, and where its plots fall on a chart."""
    count, plots, furthest, fastest, on_chart, on_land = 0, 0, 0.0, 0.0, 0, 0
    triples, low, high, way = Triples(), math.inf, -math.inf, list[tuple[float, float, float]]()
    bunched, gathered, fixed, scans_kept = Bunches(), Gathered(), FixedPlaces(), list[RadarScan]()
    for scan in scans:
        count, plots = count + 1, plots + scan.detections
        if not way or way[-1][1:] != (scan.own.x_m, scan.own.y_m):
            way.append((scan.time_s, scan.own.x_m, scan.own.y_m))
        triples.add(scan)
        gathered.add(scan)
        if count <= PASSED:
            scans_kept.append(scan)
        low, high = float(scan.bearing_rad.min(initial=low)), float(scan.bearing_rad.max(initial=high))
        places = RadarSensor().places(scan)[0]
        if water is not None:
            fixed.add(places)
            known = water.known(places)
            on_chart += int(known.sum())
            on_land += int((known & (water.probability(places) < HALF)).sum())
        bunched.add(scan, places, at_sea(places, water))
        furthest = max(furthest, float(scan.range_m.max(initial=0.0)))
        doppler = scan.doppler_mps[np.isfinite(scan.doppler_mps)]
        fastest = max(fastest, float(np.abs(doppler).max(initial=0.0)))
    where = np.array(way).reshape(-1, 3) if way else np.zeros((1, 3))
    itself = water is not None and bool(water.known(where[:, 1:]).any())
    bearings = math.degrees(low), math.degrees(high)
    return RadarSurvey(
        count, plots, furthest, fastest, on_chart, on_land, itself, bearings, triples.fit(), where, gathered.given,
        fixed.places if len(where) == 1 else np.zeros((0, 2)), bunched.share,
        tuple(scans_kept) if len(where) > 1 else (),
    )  # fmt: skip


class RecordedRadar(RadarSensor):
    """The radar of a recording; its limits, where they are not given, are those of the plots."""

    detection_probability: Probability = Field(0.9, description="Probability that a scan sees a ship, P_D")
    false_alarms: NonNegative = Field(1.0, description="Mean number of false alarms a scan; 0: none ever")
    max_range_m: Positive | None = Field(None, description="Greatest range in view [m]")
    max_doppler_mps: Positive | None = Field(
        None, description="Greatest range rate told apart, either sign: beyond it Doppler folds [m/s]"
    )
    doppler_probability: Probability = Field(1.0, description="Of simulations", json_schema_extra=FROM_RECORDING)

    def _check_range(self) -> None:
        """Take none as that of the recording."""

    def bind(self, seen: RadarSurvey) -> RadarSensor:
        """Return the sensor, with the limits of a recording where none are given."""
        fields = {name: getattr(self, name) for name in type(self).model_fields}
        if self.max_range_m is None:
            fields["max_range_m"] = max(ROOM * seen.max_range_m, self.min_range_m + 2 * self.range_sd_m)
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
