"""The scenario of Mazurek (2013), section 4: a noise object on a straight path through 80 signals of 1200 samples."""

from __future__ import annotations

from typing import Literal, NamedTuple, Self

from numpy.random import Generator
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.model import Model, Positive
from elusive.sensors.waveform import NoiseObject, NoiseObjectPath

LOWEST_SIGMA, HIGHEST_SIGMA = 0.1, 3.0  # the range that the background's deviation is drawn from


class Case(NamedTuple):
    """Frames with the truth behind them."""

    frames: Array  # (iterations, samples)
    positions: Array  # (iterations,) centre of the object [samples]
    velocity: float  # [samples / iteration]
    background_sigma: float


class NoiseObjectCase(Model):
    """One noise object with a random start, velocity and background.

    The paper gives neither where paths begin nor what happens at the signal's ends. Circular, the object starts
    anywhere and comes back on the other side; bounded, it starts anywhere from where it stays inside to the end.
    """

    object_size: int = Field(5, gt=0, description="Length of the object [samples]")
    background_deviation: Positive | None = Field(
        None, description="Deviation of the background, s; none: drawn for each case, uniform from .1 to 3"
    )
    object_deviation: Positive = Field(1.0, description="Deviation of the object's own noise")
    mode: Literal["additive", "replacing"] = Field(
        "additive", description="Whether the object adds to the background or takes its place"
    )
    border: Literal["circular", "bounded"] = Field("circular", description="What happens at the signal's ends")
    samples: int = Field(1200, gt=0, description="Samples of the signal in an iteration")
    iterations: int = Field(80, gt=0, description="Iterations after which the error is taken")
    max_velocity: int = Field(10, ge=0, description="Largest velocity; the smallest is 0 [samples / iteration]")

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        needed = self.object_size
        if self.border == "bounded":
            needed += self.max_velocity * (self.iterations - 1)
        if needed > self.samples:
            raise ParameterError(
                f"samples: an object needs {needed} of them on its way (got {self.samples}); "
                "take more samples, fewer iterations or a lower max_velocity."
            )
        return self

    def sensor(self, background_sigma: float) -> NoiseObject:
        """Sensor that sees the object on this background."""
        return NoiseObject(
            shape=(self.samples,),
            object_size=self.object_size,
            object_deviation=self.object_deviation,
            background_deviation=background_sigma,
            mode=self.mode,
            border=self.border,
        )

    def simulate(self, rng: Generator) -> Case:
        """Draw the case: velocity, start and background, then the frames.

        The background is drawn in any case, so that cases on different backgrounds have the same noise otherwise.
        """
        drawn = float(rng.uniform(LOWEST_SIGMA, HIGHEST_SIGMA))
        sigma = self.background_deviation or drawn
        velocity = int(rng.integers(self.max_velocity + 1))
        first, after = 0, self.samples
        if self.border == "bounded":
            half = self.object_size // 2
            first, after = half, self.samples - self.object_size + half - velocity * (self.iterations - 1) + 1
        path = NoiseObjectPath(start=(float(rng.integers(first, after)),), velocity=(float(velocity),))
        frames, truth = self.sensor(sigma).simulate_sequence(self.iterations, [path], rng)
        return Case(frames, truth[:, 0, 0], float(velocity), sigma)

    def distance(self, one: float, other: float) -> float:
        """Distance between two places, the shorter way round where the signal is circular [samples]."""
        apart = abs(one - other)
        return min(apart, self.samples - apart) if self.border == "circular" else apart
