"""What to do with bearings and arrivals of emitters: how they move, by which filter, how precise the bearings are.

Jiang, Keerativoranan, Matsumoto and Takada (2024), and what its filters are to be measured against.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.filters.gaussian.factor_graph import FactorGraphFilter
from elusive.filters.gaussian.interacting import InteractingFilter
from elusive.filters.gaussian.parts import BuiltInMotion
from elusive.model import FROM_RECORDING, Model, Positive
from elusive.motion.altitude import WithAltitude
from elusive.sensors.arrival_times import ArrivalSet, ArrivalTimeSensors
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSensor, PlaceSet
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.hybrid import HybridSensors
from elusive.systems.bearings.choices import (
    FACTOR_GRAPH,
    FLAT,
    ONE_PASS,
    WHOLE,
    Arrivals,
    AsHeard,
    BatchMap,
    Cruise,
    EmitterFilter,
    EmitterMotion,
    Emitters,
    Estimation,
    Estimator,
    FilterName,
    GraphFilter,
    GraphSmoother,
    IgnoreElevations,
    Interacting,
    OneEmitter,
    PlainKalman,
    PlainMotion,
    Powered,
    SeveralEmitters,
    UseElevations,
)


def usual_filter(motion: str | None, *, live: bool = False) -> str:
    """Name the filter where none is chosen."""
    return "iekf" if motion == "imm" else "fixed-lag" if live else "map"


class BearingTracking(Model):
    """Parameters of `elusive track bearings`."""

    main_options: ClassVar[tuple[str, ...]] = (
        "emitters", "filter", "motion", "sigma_deg", "q", "bias_sd_deg", "elevations", "loss", "start_sd_m", "lag_s",
    )  # fmt: skip

    motion: EmitterMotion = Field(
        Cruise(), description="How the emitter moves; imm: cv and manoeuvres, as probable as each predicts the bearings"
    )
    filter: EmitterFilter = Field(
        BatchMap(), description="Estimator; where none is chosen fixed-lag live, and iekf with imm"
    )
    emitters: Emitters = Field(
        AsHeard(), description="How many; auto: several where a sensor's bearings of one time lie apart, and it is said"
    )
    usual_sigma_deg: ClassVar[float] = 1.0
    most_sigma_deg: ClassVar[float] = 90.0
    sigma_deg: Positive | None = Field(
        None, le=most_sigma_deg, description="Deviation of a bearing [deg]; none: found, live from 1 on"
    )
    sensor_times: tuple[Positive, ...] | None = Field(
        None,
        description="Times of the deviation that bearings of each sensor err by; none: found, or alike",
        json_schema_extra=FROM_RECORDING,
    )
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
        """Return the same of one emitter by another filter; settings all of the Gaussian family share are kept."""
        if kind == self.filter.kind:
            return self.replace(emitters=OneEmitter())
        shared = Estimation.model_fields if isinstance(self.filter, Estimation) and kind not in FACTOR_GRAPH else ()
        kept = {name: getattr(self.filter, name) for name in shared}
        return self.replace(emitters=OneEmitter(), filter={"kind": kind, **kept})

    def check(self, *, live: bool) -> None:
        """Refuse a filter that does not take the motion or, live, needs all bearings.

        Raises
        ------
        ParameterError
            If so.
        """
        name = self.filter.kind
        if isinstance(self.emitters, SeveralEmitters):
            if isinstance(self.motion, Interacting):
                raise ParameterError(
                    "--motion imm: is of one emitter; with --emitters several take cv, ca, ct or ctrv."
                )
            if self.emitters.manoeuvre_share and not isinstance(self.motion, Cruise):
                raise ParameterError(
                    f"--manoeuvre-share: is of --motion cv, and not of {self.motion.kind}; leave it out."
                )
            return
        if live and name in WHOLE:
            raise ParameterError(f"--filter {name}: needs all bearings; live, take fixed-lag or iekf.")
        if isinstance(self.motion, Interacting) and name not in ONE_PASS:
            raise ParameterError(f"--motion imm: is filtered, and {name} does not take it; use --filter iekf or ekf.")

    def remarks(self, *, elevations: bool) -> tuple[str, ...]:
        """Say what of the bearings is passed over, and what is not to be relied on."""
        name = self.filter.kind
        said = []
        if isinstance(self.emitters, SeveralEmitters):
            return (
                ("Elevations are passed over: several emitters are told apart over the ground.",) if elevations else ()
            )
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
        solid, flt = elevations and self._solid, self.filter
        sensor = self.sensor_of(sites, heard, solid)
        settings = dict(flt) | ({"iterations": 1} if isinstance(flt, PlainKalman) else {})
        del settings["kind"]
        if isinstance(flt, GraphFilter):
            if not isinstance(sensor, BearingSensors):
                raise ParameterError(f"--filter {flt.kind}: is of bearings alone; with arrivals take map or iekf.")
            accelerates, smooth = self.motion.kind != "cv", isinstance(flt, GraphSmoother)
            return FactorGraphFilter(sensor=sensor, accelerates=accelerates, smooth=smooth, **settings)
        if not isinstance(self.motion, Interacting):
            return flt.made(motion=self.over_ground(self.motion, solid=solid), sensor=sensor, **settings)
        motions: list[PlainMotion] = [self.motion.cv, self.motion.ca, *([] if solid else [self.motion.ctrv])]
        return InteractingFilter(
            motions=tuple(self.over_ground(motion, solid=solid) for motion in motions), stay_s=self.motion.stay_s,
            sensor=sensor, **settings,
        )  # fmt: skip

    @property
    def deviation_deg(self) -> float:
        """Deviation of a bearing, the usual one where none is given [deg]."""
        return self.usual_sigma_deg if self.sigma_deg is None else self.sigma_deg

    @property
    def sensor_sigma_deg(self) -> tuple[float, ...] | None:
        """Deviation of each sensor's bearing [deg]; None: they are alike."""
        return None if self.sensor_times is None else tuple(self.deviation_deg * one for one in self.sensor_times)

    def sigmas_rad(self, sensors: int) -> Array:
        """Deviations of bearings of so many sensors, ``(n,)`` [rad]."""
        return np.deg2rad(self.sensor_sigma_deg or (self.deviation_deg,) * sensors)

    @property
    def plain_motion(self) -> PlainMotion:
        """The motion, of several the plainest; a power that is not given is the usual one."""
        return _powered(self.motion.cv if isinstance(self.motion, Interacting) else self.motion)

    @property
    def moves(self) -> str:
        """Name the motion, with its power where there is one."""
        q = self.motion.q if isinstance(self.motion, Powered) else None
        return self.motion.kind if q is None else f"{self.motion.kind} with q {q:g}"

    @property
    def _solid(self) -> bool:
        """Whether there are heights, given elevations."""
        flat = self.filter.kind in FACTOR_GRAPH or self.motion.kind in FLAT
        return isinstance(self.elevations, UseElevations) and not flat

    def sensor_of(self, sites: SensorSites, heard: type[PlaceSet], solid: bool) -> PlaceSensor:
        """Return the sensors of a recording, with heights or over the ground."""
        shared: dict[str, Any] = {
            "positions_m": [tuple(place) for place in sites.positions_m.tolist()], "dimensions": 3 if solid else 2,
        }  # fmt: skip
        bearings = BearingSensors(sigma_deg=self.deviation_deg, sensor_sigma_deg=self.sensor_sigma_deg, **shared)
        if heard is BearingSet:
            return bearings
        arrivals = ArrivalTimeSensors(**shared, **dict(self.arrivals))
        return arrivals if heard is ArrivalSet else HybridSensors(bearings=bearings, arrivals=arrivals)

    def over_ground(self, motion: PlainMotion, *, solid: bool) -> BuiltInMotion:
        """Return the motion itself, of the class with rates of its own; with heights where there are some.

        A power that is not given is the usual one.
        """
        own: Any = type(motion).__bases__[0](**dict(_powered(motion)))
        if solid and isinstance(self.elevations, UseElevations):
            return WithAltitude(motion=own, q_vertical=self.elevations.q_vertical or self.elevations.usual_q)
        return own  # type: ignore[no-any-return]


def _powered(motion: PlainMotion) -> PlainMotion:
    """Give a motion the usual power where it has none."""
    return motion.replace(q=motion.usual_q) if isinstance(motion, Powered) and motion.q is None else motion
