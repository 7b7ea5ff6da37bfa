"""How several targets whose readings add up are tracked, whatever they are and whatever sees them."""

from __future__ import annotations

from pydantic import Field

from elusive.model import Model, NonNegative, Positive, Probability
from elusive.tracking.lifecycle import Lifecycle


class SuperposedSettings(Model):
    """What a tracker of readings that add up takes besides its parts."""

    death_probability: Probability = Field(0.01, description="Probability that a target disappears in 1 s")
    particles: int = Field(1000, ge=10, le=1_000_000, description="Particles of a target, N")
    spread_within: NonNegative | None = Field(
        None,
        description="Side of the cells of place in which a cloud is spread over what it stands for, mean and "
        "covariance kept; 0: it stays as resampled; not given: three point spreads, 0 for a sensor without [px]",
    )
    sweeps: int = Field(2, ge=1, le=20, description="Updates of a target given the others, a measurement, at most")
    forget_below: float = Field(
        1e-3, gt=0, lt=1, description="Existence below which a target is not sought, or forgotten"
    )
    merge_within: Positive = Field(
        0.5, description="Two targets nearer than this that are together one at most are one [deviations]"
    )
    most_targets: int = Field(50, ge=1, le=1000, description="Targets at a time, at most")
    separation: NonNegative = Field(0.0, description="Distance from a target within which no other appears [m or px]")
    effective: Probability = Field(
        0.5, description="Share of the particles that stays effective in a stage of drawing them"
    )
    lifecycle: Lifecycle = Field(Lifecycle(), description="When a track begins, is confirmed and ends")
