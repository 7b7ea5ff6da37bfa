"""Bearings to the track of one emitter: which estimator, how it moves, how precise the bearings are.

Jiang, Keerativoranan, Matsumoto and Takada (2024), and what its filters are to be measured against.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.factor_graph import FactorGraphFilter
from elusive.filters.gaussian.fixed_lag import FixedLagSmoother
from elusive.filters.gaussian.interacting import InteractingFilter
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.filters.gaussian.parts import BuiltInMotion
from elusive.filters.gaussian.transitions import AngleBias
from elusive.model import Model, NonNegative, Positive
from elusive.motion import ConstantAcceleration, ConstantTurnRateVelocity, ConstantVelocity
from elusive.motion.altitude import WithAltitude
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearings import BearingSensors

FilterName = Literal["fg-eks", "fg-ekf", "ekf", "iekf", "rts", "map", "fixed-lag"]
MotionName = Literal["cv", "ca", "ctrv", "imm"]
FACTOR_GRAPH = ("fg-eks", "fg-ekf")
WHOLE = ("rts", "map")  # they need all bearings
ONE_PASS = ("ekf", "iekf")
IEKF_ITERATIONS = 10
Estimator = ExtendedKalmanFilter | InteractingFilter | FixedLagSmoother | FactorGraphFilter | MapSmoother


class Estimates(NamedTuple):
    """The track of a recording."""

    times_s: Array  # (K,)
    names: tuple[str, ...]  # of the state's components
    states: Array  # (K, d), NaN before there is any
    covariances: Array  # (K, d, d)
    begun: int  # row from which on a place is told
    log_evidence: float  # NaN where an estimator has none


class BearingTracking(Model):
    """What to do with a recording of bearings."""

    main_options: ClassVar[tuple[str, ...]] = (
        "filter", "motion", "sigma_deg", "q", "bias_sd_deg", "elevations", "loss", "start_sd_m", "lag_s",
    )  # fmt: skip

    filter: FilterName | None = Field(
        None, description="Estimator; none: map of a recording (iekf with imm), fixed-lag live (iekf with imm)"
    )
    motion: MotionName = Field(
        "cv", description="How the target moves; imm: cv and a manoeuvre, told from the bearings"
    )
    sigma_deg: Positive = Field(1.0, le=90, description="Deviation of a bearing [deg]")
    elevations: Literal["use", "ignore"] = Field(
        "use", description="What to do with elevations, where the bearings have them; used, the track has heights"
    )
    q: Positive = Field(1.0, description="cv: power of the white acceleration [m^2 / s^3]")
    q_jerk: Positive = Field(0.1, description="ca: power of the white jerk [m^2 / s^5]")
    q_speed: Positive = Field(0.1, description="ctrv: variance of the acceleration along the track [m^2 / s^4]")
    q_turn: Positive = Field(1e-3, description="ctrv: variance of the angular acceleration [rad^2 / s^4]")
    q_vertical: Positive = Field(0.5, description="Power of the white vertical acceleration [m^2 / s^3]")
    stay_s: Positive = Field(10.0, description="imm: mean time for which a motion lasts [s]")
    position_noise_m: NonNegative = Field(
        0.0, description="Deviation of a displacement at each step, each axis, epsilon of eq. 26 [m]"
    )
    bias_sd_deg: NonNegative = Field(0.0, description="Deviation of each sensor's bias, estimated if above 0 [deg]")
    bias_memory_s: Positive = Field(1e6, description="Time over which a bias is forgotten; 1e6 is a constant one [s]")
    loss: Literal["squares", "cauchy", "huber"] = Field("cauchy", description="Loss of a bearing's whitened residual")
    loss_k: float = Field(2.0, gt=1.5, le=100, description="Residual at which the loss bends [deviations]")
    start_sd_m: Positive | None = Field(
        None, description="Deviation of the first place about the sensors; none: ten times their extent [m]"
    )
    start_speed_sd_mps: Positive = Field(30.0, description="Deviation of the first velocity, each axis [m/s]")
    lag_s: Positive = Field(2.0, description="fixed-lag: time after which a state is final [s]")
    graph_iterations: int = Field(50, gt=0, le=10_000, description="fg: exchanges of messages of a fix")
    forgetting: float = Field(1.0, gt=0, le=1, description="fg: forgetting factor alpha of eq. 12")

    def choice(self, *, live: bool) -> FilterName:
        """Return the estimator, the usual one where none is named.

        Raises
        ------
        ParameterError
            If it cannot do what is asked.
        """
        usual: FilterName = "iekf" if self.motion == "imm" else "fixed-lag" if live else "map"
        name = self.filter or usual
        if live and name in WHOLE:
            raise ParameterError(f"--filter {name}: needs all bearings; live, take fixed-lag or iekf.")
        if self.motion == "imm" and name not in ONE_PASS:
            raise ParameterError(f"--motion imm: is filtered, and {name} does not take it; use --filter iekf or ekf.")
        if name in FACTOR_GRAPH and self.bias_sd_deg > 0:
            raise ParameterError(f"--bias-sd-deg: {name} estimates no bias; use --filter map, or leave it out.")
        return name

    def remarks(self, *, elevations: bool, live: bool) -> tuple[str, ...]:
        """Say what of the bearings is passed over, and what is not to be relied on."""
        name = self.choice(live=live)
        said = []
        if elevations and self.elevations == "use" and not self._solid(name, elevations=True):
            what = name if name in FACTOR_GRAPH else f"motion {self.motion}"
            said.append(f"Elevations are passed over: {what} is of two dimensions.")
        if name in FACTOR_GRAPH:
            said.append(f"{name} is as its paper has it: its ellipses are too small. To rely on them take map or iekf.")
        return tuple(said)

    def on(self, sites: SensorSites, *, elevations: bool, live: bool) -> Estimator:
        """Build the estimator.

        Parameters
        ----------
        sites
            Where the sensors stand.
        elevations
            Whether the bearings have any.
        live
            Whether bearings come one time after another.

        Raises
        ------
        ParameterError
            If the estimator cannot do what is asked.
        """
        name = self.choice(live=live)
        solid = self._solid(name, elevations=elevations)
        sensor = BearingSensors.at(sites, dimensions=3 if solid else 2, sigma_deg=self.sigma_deg)
        if name in FACTOR_GRAPH:
            return FactorGraphFilter(
                sensor=sensor, iterations=self.graph_iterations, smooth=name == "fg-eks", forgetting=self.forgetting,
                accelerates=self.motion != "cv", step_noise_m=self.position_noise_m or 0.5,
            )  # fmt: skip
        shared: dict[str, Any] = {
            "sensor": sensor, "position_noise_m": self.position_noise_m, "loss": self.loss, "loss_k": self.loss_k,
            "start_sd_m": self.start_sd_m, "start_speed_sd_mps": self.start_speed_sd_mps,
            "bias": AngleBias(sd_deg=self.bias_sd_deg, memory_s=self.bias_memory_s) if self.bias_sd_deg else None,
        }  # fmt: skip
        iterations = 1 if name == "ekf" else IEKF_ITERATIONS
        if self.motion == "imm":
            motions = [self._motion(name, solid) for name in (("cv", "ca") if solid else ("cv", "ca", "ctrv"))]
            return InteractingFilter(motions=motions, stay_s=self.stay_s, iterations=iterations, **shared)
        motion = self._motion(self.motion, solid)
        if name == "map":
            return MapSmoother(motion=motion, **shared)
        if name == "fixed-lag":
            return FixedLagSmoother(motion=motion, lag_s=self.lag_s, **shared)
        return ExtendedKalmanFilter(motion=motion, iterations=iterations, **shared)

    def estimate(self, sets: list[BearingSet], sites: SensorSites) -> Estimates:
        """Estimate the path of a recording.

        Raises
        ------
        ParameterError
            If the estimator cannot do what is asked.
        DataError
            If a bearing cannot be used, or the factor graph's times are uneven.
        """
        estimator = self.on(sites, elevations=have_elevations(sets), live=False)
        if isinstance(estimator, FactorGraphFilter):
            return _by_graph(estimator, sets)
        names = estimator.state_names
        if isinstance(estimator, MapSmoother):
            path = estimator.smooth(sets)
            return Estimates(path.times_s, names, path.states, path.covariances, 0, path.log_evidence)
        if isinstance(estimator, FixedLagSmoother):
            lagged = estimator.track(sets)
            return Estimates(lagged.times_s, names, lagged.states, lagged.covariances, 0, math.nan)
        if isinstance(estimator, InteractingFilter):
            mixed = estimator.track(sets)
            return Estimates(mixed.times_s, names, mixed.states, mixed.covariances, mixed.started, mixed.log_evidence)
        smooth = self.choice(live=False) == "rts"
        filtered = estimator.track(sets, smooth=smooth)
        begun = 0 if smooth else filtered.started
        return Estimates(filtered.times_s, names, filtered.states, filtered.covariances, begun, filtered.log_evidence)

    def _solid(self, name: FilterName, *, elevations: bool) -> bool:
        return elevations and self.elevations == "use" and name not in FACTOR_GRAPH and self.motion != "ctrv"

    def _motion(self, name: str, solid: bool) -> BuiltInMotion:
        if name == "ctrv":
            return ConstantTurnRateVelocity(q_speed=self.q_speed, q_turn=self.q_turn)
        motion = ConstantAcceleration(q=self.q_jerk) if name == "ca" else ConstantVelocity(q=self.q)
        return WithAltitude(motion=motion, q_vertical=self.q_vertical) if solid else motion


def have_elevations(sets: list[BearingSet]) -> bool:
    """Say whether any bearing has an elevation."""
    return any(np.isfinite(each.elevation_rad).any() for each in sets)


def _by_graph(graph: FactorGraphFilter, sets: list[BearingSet]) -> Estimates:
    times, path = graph.track_sets(sets)
    interval = float(times[1] - times[0]) if len(times) > 1 else 1.0
    told = np.array([each.time_s for each in sets])
    rows = np.searchsorted(times, told - interval / 2)
    states = np.stack(
        [path.mean[:, 0], path.velocity[:, 0] / interval, path.mean[:, 1], path.velocity[:, 1] / interval], axis=1
    )[rows]
    spread = np.stack(
        [
            path.variance[:, 0], path.velocity_variance[:, 0] / interval**2,
            path.variance[:, 1], path.velocity_variance[:, 1] / interval**2,
        ],
        axis=1,
    )[rows]  # fmt: skip
    known = np.isfinite(states[:, 0])
    begun = int(np.argmax(known)) if known.any() else len(known)
    return Estimates(told, ("x", "vx", "y", "vy"), states, spread[:, :, None] * np.eye(4), begun, math.nan)
