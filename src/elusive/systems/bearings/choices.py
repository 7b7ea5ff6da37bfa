"""How emitters move, how many there are, and by which filter one is followed: each with its own settings."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.factor_graph import FactorGraphFilter
from elusive.filters.gaussian.fixed_lag import FixedLagSmoother
from elusive.filters.gaussian.interacting import InteractingFilter
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.filters.gaussian.problem import Setting
from elusive.filters.gaussian.transitions import AngleBias
from elusive.model import FROM_RECORDING, Model, NonNegative, Positive, Probability
from elusive.motion import ConstantAcceleration, ConstantTurnRateVelocity, ConstantVelocity, CoordinatedTurn
from elusive.sensors.arrival_times import ArrivalTimeSensors
from elusive.sensors.crowded_bearings import CrowdedBearings
from elusive.tracking.detections import DetectionRules
from elusive.tracking.lifecycle import Lifecycle

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

    usual_q: ClassVar[float] = 1.0
    q: Positive | None = Field(  # type: ignore[assignment]
        None, description="Power of the white acceleration [m^2 / s^3]; none: found, within imm 1"
    )


class Manoeuvre(ConstantAcceleration):
    """An emitter of nearly constant acceleration."""

    usual_q: ClassVar[float] = 0.1
    q: Positive | None = Field(  # type: ignore[assignment]
        None, description="Power of the white jerk [m^2 / s^5]; none: found, within imm 0.1"
    )


class KnownTurn(CoordinatedTurn):
    """An emitter that turns at a known rate."""

    usual_q: ClassVar[float] = 1.0
    q: Positive | None = Field(  # type: ignore[assignment]
        None, description="Power of the white acceleration [m^2 / s^3]; none: found"
    )


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


Powered = Cruise | Manoeuvre | KnownTurn  # motions of one power, which a recording tells
PlainMotion = Powered | Turn
EmitterMotion = Annotated[Cruise | Manoeuvre | KnownTurn | Turn | Interacting, Field(discriminator="kind")]


class Estimation(Model):
    """Settings of every estimator of the Gaussian family."""

    position_noise_m: NonNegative = _as_in(Setting, "position_noise_m")
    bias: AngleBias | None = _as_in(Setting, "bias")
    loss: Literal["squares", "cauchy", "huber"] = _as_in(Setting, "loss")
    loss_k: float = _as_in(Setting, "loss_k")
    start_sd_m: Positive | None = _as_in(Setting, "start_sd_m")
    start_speed_sd_mps: Positive = _as_in(Setting, "start_speed_sd_mps")
    made: ClassVar[type[MapSmoother | FixedLagSmoother | ExtendedKalmanFilter]] = ExtendedKalmanFilter


class BatchMap(Estimation):
    """The most probable path given all bearings at once."""

    made = MapSmoother
    kind: Literal["map"] = "map"
    iterations: int = _as_in(MapSmoother, "iterations")
    tolerance: Positive = _as_in(MapSmoother, "tolerance")


class FixedLag(Estimation):
    """The same over the last seconds, again at each time."""

    made = FixedLagSmoother
    kind: Literal["fixed-lag"] = "fixed-lag"
    lag_s: Positive = _as_in(FixedLagSmoother, "lag_s")
    iterations: int = _as_in(FixedLagSmoother, "iterations")


class IteratedKalman(Estimation):
    """The iterated extended Kalman filter."""

    kind: Literal["iekf"] = "iekf"
    iterations: int = _as_in(ExtendedKalmanFilter, "iterations")


class RtsSmoother(IteratedKalman):
    """The same, and Rauch, Tung and Striebel's smoother behind it."""

    kind: Literal["rts"] = "rts"  # type: ignore[assignment]


class PlainKalman(Estimation):
    """The plain extended Kalman filter."""

    kind: Literal["ekf"] = "ekf"


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


class AsHeard(Model):
    """Several emitters where a sensor's bearings of one time lie apart; where they agree, samples of one."""

    kind: Literal["auto"] = "auto"


class OneEmitter(Model):
    """All that is heard is of one emitter: a sensor's bearings of one time are averaged."""

    kind: Literal["one"] = "one"


class SeveralEmitters(Model):
    """Any number of emitters, which appear and go, and false bearings: each track has its probability."""

    kind: Literal["several"] = "several"
    detection_probability: Probability | None = Field(
        None, gt=0, description="Probability that a sensor hears an emitter at a time; none: found, live 0.9"
    )
    false_bearings: Positive | None = Field(
        None, description="Mean number of false bearings of a sensor at a time; none: found, live 1"
    )
    manoeuvre_share: Probability | None = Field(
        None, description="With cv: how often an emitter accelerates 30 times as hard; none: found, 0 or 0.1, live 0"
    )
    norths_deg: tuple[float, ...] | None = Field(
        None,
        description="What azimuths of each sensor are too large by [deg]; none: found",
        json_schema_extra=FROM_RECORDING,
    )
    norths_spread_deg2: tuple[tuple[float, ...], ...] | None = Field(
        None, description="Covariance of these [deg^2]; none: found, or 0", json_schema_extra=FROM_RECORDING
    )
    persisting: Positive | None = Field(
        None,
        ge=1,
        description="Times by which places are less sure as errors persist; none: found",
        json_schema_extra=FROM_RECORDING,
    )
    reach_m: Positive | None = _as_in(CrowdedBearings, "reach_m")
    births_per_s: Positive = Field(0.05, description="Mean number of new emitters a second")
    usual_speed_mps: ClassVar[float] = 15.0
    speed_sd_mps: Positive | None = Field(
        None,
        description="Deviation of a new emitter's velocity, on each axis [m/s]; none: found, at least "
        f"{usual_speed_mps:g}",
    )
    mean_life_s: Positive = Field(600.0, description="Mean time that an emitter stays [s]")
    merge_within: NonNegative = _as_in(DetectionRules, "merge_within")
    forget_below: float = Field(
        0.005, gt=0, lt=1, description="A beginning is given up once its odds fall below this share of its first"
    )
    particles: int = Field(1000, ge=10, description="Number of particles of each emitter, N")
    lifecycle: Lifecycle = _as_in(DetectionRules, "lifecycle")
    seed: int = Field(1, ge=0, description="Root of all random numbers")


Emitters = Annotated[AsHeard | OneEmitter | SeveralEmitters, Field(discriminator="kind")]


class UseElevations(Model):
    """The track has heights where the bearings have elevations."""

    kind: Literal["use"] = "use"
    usual_q: ClassVar[float] = 0.5
    q_vertical: Positive | None = Field(
        None, description="Power of the white vertical acceleration [m^2 / s^3]; none: found"
    )


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
