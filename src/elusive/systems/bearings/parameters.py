"""What to do with bearings and arrivals of one emitter: how it moves, by which filter, how precise they are.

Jiang, Keerativoranan, Matsumoto and Takada (2024), and what its filters are to be measured against.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from elusive.errors import ParameterError
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.factor_graph import FactorGraphFilter
from elusive.filters.gaussian.fixed_lag import FixedLagSmoother
from elusive.filters.gaussian.interacting import InteractingFilter
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.filters.gaussian.parts import BuiltInMotion
from elusive.filters.gaussian.problem import Setting
from elusive.filters.gaussian.transitions import AngleBias
from elusive.model import Model, NonNegative, Positive
from elusive.motion import ConstantAcceleration, ConstantTurnRateVelocity, ConstantVelocity, CoordinatedTurn
from elusive.motion.altitude import WithAltitude
from elusive.sensors.arrival_times import ArrivalSet, ArrivalTimeSensors
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSensor, PlaceSet
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.hybrid import HybridSensors, HybridSet

Estimator = ExtendedKalmanFilter | InteractingFilter | FixedLagSmoother | FactorGraphFilter | MapSmoother
FilterName = Literal["map", "fixed-lag", "iekf", "ekf", "rts", "fg-ekf", "fg-eks"]
FACTOR_GRAPH = ("fg-eks", "fg-ekf")
WHOLE = ("rts", "map")  # they need all bearings
ONE_PASS = ("ekf", "iekf")  # they take several motions at once
FLAT = ("ctrv",)  # motions over the ground alone


def _as_in(model: type[Model], name: str) -> Any:
    """Return a field as another model declares it."""
    return model.model_fields[name]


class Cruise(ConstantVelocity):
    """An emitter of nearly constant velocity."""

    q: Positive = Field(1.0, description="Power of the white acceleration [m^2 / s^3]")


class Manoeuvre(ConstantAcceleration):
    """An emitter of nearly constant acceleration."""

    q: Positive = Field(0.1, description="Power of the white jerk [m^2 / s^5]")


class KnownTurn(CoordinatedTurn):
    """An emitter that turns at a known rate."""

    q: Positive = Field(1.0, description="Power of the white acceleration [m^2 / s^3]")


class Turn(ConstantTurnRateVelocity):
    """An emitter that turns at a rate to be found."""

    q_speed: Positive = Field(0.1, description="Variance of the acceleration along the track [m^2 / s^4]")
    q_turn: Positive = Field(1e-3, description="Variance of the angular acceleration [rad^2 / s^4]")


class Interacting(Model):
    """Several motions at once, each as probable as it predicts the bearings; with heights without the turn."""

    kind: Literal["imm"] = "imm"
    cv: Cruise = Field(Cruise(), description="Nearly constant velocity")
    ca: Manoeuvre = Field(Manoeuvre(), description="Nearly constant acceleration")
    ctrv: Turn = Field(Turn(), description="Turn at a rate to be found")
    stay_s: Positive = _as_in(InteractingFilter, "stay_s")


EmitterMotion = Annotated[Cruise | Manoeuvre | KnownTurn | Turn | Interacting, Field(discriminator="kind")]


class Estimation(Model):
    """What all estimators of the Gaussian family can be told."""

    position_noise_m: NonNegative = _as_in(Setting, "position_noise_m")
    bias: AngleBias | None = _as_in(Setting, "bias")
    loss: Literal["squares", "cauchy", "huber"] = _as_in(Setting, "loss")
    loss_k: float = _as_in(Setting, "loss_k")
    start_sd_m: Positive | None = _as_in(Setting, "start_sd_m")
    start_speed_sd_mps: Positive = _as_in(Setting, "start_speed_sd_mps")


class BatchMap(Estimation):
    """The most probable path given all bearings at once."""

    kind: Literal["map"] = "map"
    iterations: int = _as_in(MapSmoother, "iterations")
    tolerance: Positive = _as_in(MapSmoother, "tolerance")


class FixedLag(Estimation):
    """The same over the last seconds, again at each time."""

    kind: Literal["fixed-lag"] = "fixed-lag"
    lag_s: Positive = _as_in(FixedLagSmoother, "lag_s")
    iterations: int = _as_in(FixedLagSmoother, "iterations")


class IteratedKalman(Estimation):
    """The iterated extended Kalman filter."""

    kind: Literal["iekf"] = "iekf"
    iterations: int = _as_in(ExtendedKalmanFilter, "iterations")


class PlainKalman(Estimation):
    """The plain extended Kalman filter."""

    kind: Literal["ekf"] = "ekf"


class RtsSmoother(Estimation):
    """The iterated filter and Rauch, Tung and Striebel's smoother behind it."""

    kind: Literal["rts"] = "rts"
    iterations: int = _as_in(ExtendedKalmanFilter, "iterations")


class GraphFilter(Model):
    """The paper's messages on a factor graph, FG-EKF."""

    kind: Literal["fg-ekf"] = "fg-ekf"
    iterations: int = Field(50, gt=0, le=10_000, description="Exchanges of messages of a fix")
    forgetting: float = _as_in(FactorGraphFilter, "forgetting")
    step_noise_m: Positive = _as_in(FactorGraphFilter, "step_noise_m")


class GraphSmoother(GraphFilter):
    """The same looking back one step, FG-EKS."""

    kind: Literal["fg-eks"] = "fg-eks"  # type: ignore[assignment]


EmitterFilter = Annotated[
    BatchMap | FixedLag | IteratedKalman | PlainKalman | RtsSmoother | GraphFilter | GraphSmoother,
    Field(discriminator="kind"),
]


class UseElevations(Model):
    """The track has heights where the bearings have elevations."""

    kind: Literal["use"] = "use"
    q_vertical: Positive = Field(0.5, description="Power of the white vertical acceleration [m^2 / s^3]")


class IgnoreElevations(Model):
    """Elevations are passed over."""

    kind: Literal["ignore"] = "ignore"


class Arrivals(Model):
    """How precise times of arrival are."""

    sigma_s: Positive = _as_in(ArrivalTimeSensors, "sigma_s")
    speed_mps: Positive = _as_in(ArrivalTimeSensors, "speed_mps")
    emission_known: bool = Field(
        False, description="Whether times count from the emission (TOA); if not, only their differences do (TDOA)"
    )


def angles_of(measurement: PlaceSet) -> BearingSet:
    """Return the bearings of a measurement, none of times of arrival alone."""
    if isinstance(measurement, BearingSet):
        return measurement
    if isinstance(measurement, HybridSet):
        return measurement.bearings
    return BearingSet(measurement.time_s, np.empty(0, np.intp), np.empty(0), np.empty(0))


def sensors_of(measurement: PlaceSet) -> NDArray[np.intp]:
    """Return the sensors that report a measurement, a sensor as often as it does."""
    if isinstance(measurement, HybridSet):
        return np.concatenate([measurement.bearings.sensor, measurement.arrivals.sensor])
    return measurement.sensor


def usual_filter(motion: str | None, *, live: bool = False) -> str:
    """Name the filter where none is chosen."""
    return "iekf" if motion == "imm" else "fixed-lag" if live else "map"


class BearingTracking(Model):
    """Everything `elusive track bearings` can be told."""

    main_options: ClassVar[tuple[str, ...]] = (
        "filter", "motion", "sigma_deg", "q", "bias_sd_deg", "elevations", "loss", "start_sd_m", "lag_s", "sigma_s",
    )  # fmt: skip

    motion: EmitterMotion = Field(
        Cruise(), description="How the emitter moves; imm: cv and manoeuvres, as probable as each predicts the bearings"
    )
    filter: EmitterFilter = Field(
        BatchMap(), description="Estimator; where none is chosen fixed-lag live, and iekf with imm"
    )
    sigma_deg: Positive = Field(1.0, le=90, description="Deviation of a bearing [deg]")
    elevations: Annotated[UseElevations | IgnoreElevations, Field(discriminator="kind")] = Field(
        UseElevations(), description="What to do with elevations, where the bearings have them"
    )
    arrivals: Arrivals = Field(Arrivals(), description="Times of arrival, where the table has them")

    @model_validator(mode="before")
    @classmethod
    def _usual(cls, given: Any) -> Any:
        """Choose the filter that the motion takes, where none is chosen."""
        if not isinstance(given, Mapping):
            return given
        motion, flt = given.get("motion", {}), given.get("filter", {})
        if not isinstance(flt, Mapping) or "kind" in flt:
            return given
        kind = motion.get("kind") if isinstance(motion, Mapping) else getattr(motion, "kind", None)
        return {**given, "filter": {"kind": usual_filter(kind), **flt}}

    def by(self, kind: FilterName) -> BearingTracking:
        """Return the same by another filter, with what all of the Gaussian family are told alike."""
        if kind == self.filter.kind:
            return self
        shared = Estimation.model_fields if isinstance(self.filter, Estimation) and kind not in FACTOR_GRAPH else ()
        return self.replace(filter={"kind": kind, **{name: getattr(self.filter, name) for name in shared}})

    def check(self, *, live: bool) -> None:
        """Refuse a filter that does not take the motion or, live, needs all bearings.

        Raises
        ------
        ParameterError
            If so.
        """
        name = self.filter.kind
        if live and name in WHOLE:
            raise ParameterError(f"--filter {name}: needs all bearings; live, take fixed-lag or iekf.")
        if isinstance(self.motion, Interacting) and name not in ONE_PASS:
            raise ParameterError(f"--motion imm: is filtered, and {name} does not take it; use --filter iekf or ekf.")

    def remarks(self, *, elevations: bool) -> tuple[str, ...]:
        """Say what of the bearings is passed over, and what is not to be relied on."""
        name = self.filter.kind
        said = []
        if elevations and isinstance(self.elevations, UseElevations) and not self._solid:
            what = name if name in FACTOR_GRAPH else f"motion {self.motion.kind}"
            said.append(f"Elevations are passed over: {what} is of two dimensions.")
        if name in FACTOR_GRAPH:
            said.append(f"{name} is as its paper has it: its ellipses are too small. To rely on them take map or iekf.")
        return tuple(said)

    def bind(self, sites: SensorSites, heard: type[PlaceSet], *, elevations: bool) -> Estimator:
        """Make the estimator of a recording.

        Parameters
        ----------
        sites
            Where the sensors stand.
        heard
            What they report.
        elevations
            Whether a bearing has any.

        Raises
        ------
        ParameterError
            If the estimator cannot take what they report.
        """
        solid = elevations and self._solid
        sensor = self._sensor(sites, heard, solid)
        flt = self.filter
        settings = dict(flt) | ({"iterations": 1} if isinstance(flt, PlainKalman) else {})
        del settings["kind"]
        if isinstance(flt, GraphFilter):
            if not isinstance(sensor, BearingSensors):
                raise ParameterError(
                    f"--filter {flt.kind}: is of bearings alone; for times of arrival take map or iekf."
                )
            accelerates, smooth = self.motion.kind != "cv", isinstance(flt, GraphSmoother)
            return FactorGraphFilter(sensor=sensor, accelerates=accelerates, smooth=smooth, **settings)
        if isinstance(self.motion, Interacting):
            motions = (self.motion.cv, self.motion.ca) if solid else (self.motion.cv, self.motion.ca, self.motion.ctrv)
            return InteractingFilter(
                motions=tuple(self._over_ground(motion, solid) for motion in motions), stay_s=self.motion.stay_s,
                sensor=sensor, **settings,
            )  # fmt: skip
        motion = self._over_ground(self.motion, solid)
        if isinstance(flt, BatchMap):
            return MapSmoother(motion=motion, sensor=sensor, **settings)
        if isinstance(flt, FixedLag):
            return FixedLagSmoother(motion=motion, sensor=sensor, **settings)
        return ExtendedKalmanFilter(motion=motion, sensor=sensor, **settings)

    @property
    def _solid(self) -> bool:
        """Whether there are heights, given elevations."""
        flat = self.filter.kind in FACTOR_GRAPH or self.motion.kind in FLAT
        return isinstance(self.elevations, UseElevations) and not flat

    def _sensor(self, sites: SensorSites, heard: type[PlaceSet], solid: bool) -> PlaceSensor:
        shared: dict[str, Any] = {
            "positions_m": [tuple(place) for place in sites.positions_m.tolist()], "dimensions": 3 if solid else 2,
        }  # fmt: skip
        bearings = BearingSensors(sigma_deg=self.sigma_deg, **shared)
        if heard is BearingSet:
            return bearings
        arrivals = ArrivalTimeSensors(**shared, **dict(self.arrivals))
        return arrivals if heard is ArrivalSet else HybridSensors(bearings=bearings, arrivals=arrivals)

    def _over_ground(self, motion: Model, solid: bool) -> BuiltInMotion:
        """Return the motion itself, of the class with rates of its own; with heights where there are some."""
        own: Any = type(motion).__bases__[0](**dict(motion))
        if solid and isinstance(self.elevations, UseElevations):
            return WithAltitude(motion=own, q_vertical=self.elevations.q_vertical)
        return own  # type: ignore[no-any-return]
