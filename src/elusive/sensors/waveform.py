"""A noise object in a signal or an image: zero mean on a background of zero mean, told by its variance alone.

Mazurek (2013), sections 2 and 4: Gaussian noise of its own, added to the background's or in its place.

The object's place is its centre: one at x covers sample i where ``x - size/2 <= i < x + size/2``, which is always
``size`` samples. An odd object stands centred on a sample where x is whole, an even one where x lies midway between
two. In two dimensions the object is a square; sample (row r, column c) lies at ``(x, y) = (c, r)``.
"""

from __future__ import annotations

from typing import Literal, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from elusive.contracts import VX, Array, X, Y
from elusive.errors import DataError, ParameterError
from elusive.model import FROM_RECORDING, Model, Positive


class NoiseRecording(NamedTuple):
    """Frames with the truth behind them."""

    frames: Array  # (T, samples) or (T, rows, columns)
    truth: Array  # (T, objects, d) x, vx(, y, vy); NaN where the object is absent


class NoiseObjectPath(Model):
    """A straight path of one object, from the frame in which it appears to the one in which it is last there."""

    start: tuple[float, ...] = Field(description="Centre when it appears: (x,) or (x, y) [samples]")
    velocity: tuple[float, ...] = Field(description="Velocity: (vx,) or (vx, vy) [samples / frame]")
    appears: int = Field(0, ge=0, description="First frame with the object, from 0")
    leaves: int | None = Field(None, ge=0, description="Last frame with the object; none: it stays")


class NoiseObject(Model):
    """Frames that see objects made of noise, in Gaussian noise of zero mean."""

    kind: Literal["noise-object"] = "noise-object"
    shape: tuple[int, ...] = Field(
        (1200,), description="Shape of a frame: (samples,) or (rows, columns)", json_schema_extra=FROM_RECORDING
    )
    object_size: int = Field(5, gt=0, description="Length of the object, along each axis [samples]")
    object_deviation: Positive = Field(1.0, description="Deviation of the object's noise [the signal's unit]")
    background_deviation: Positive = Field(
        1.0, description="Deviation of the background's noise, s [the signal's unit]"
    )
    mode: Literal["additive", "replacing"] = Field(
        "additive", description="Whether the object adds to the background or takes its place"
    )
    border: Literal["circular", "bounded"] = Field(
        "circular", description="Whether what leaves on one side comes back on the other"
    )

    @field_validator("shape")
    @classmethod
    def _line_or_image(cls, value: tuple[int, ...]) -> tuple[int, ...]:
        if len(value) not in (1, 2) or min(value) < 1:
            raise ParameterError(f"shape: must be (samples,) or (rows, columns), each above zero (got {value}).")
        return value

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.border == "circular" and self.object_size > min(self.shape):
            raise ParameterError(
                f"object_size: {self.object_size} samples go more than once round a frame of {self.shape}; "
                "use a smaller object, or a bounded frame."
            )
        return self

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the components that a state begins with."""
        return ("x", "vx") if len(self.shape) == 1 else ("x", "vx", "y", "vy")

    @property
    def covered_deviation(self) -> float:
        """Deviation of a sample that the object covers, u."""
        background = self.background_deviation if self.mode == "additive" else 0.0
        return float(np.hypot(self.object_deviation, background))

    def simulate(self, states: Array, rng: Generator) -> Array:
        """Draw one frame with an object for each row of ``states`` (``(0, d)``: the background alone).

        Where objects overlap, added noises add up; of those that take the background's place, the last one shows.

        Parameters
        ----------
        states
            ``(N, d)``; x in column 0 and, in two dimensions, y in column 2 [samples].
        rng
            Source of the noise.

        Returns
        -------
        ndarray
            Of the sensor's shape, float64.

        Raises
        ------
        DataError
            If the states have too few components, or a place is no finite number.
        """
        places = self._places(states)
        if not np.isfinite(places).all():
            raise DataError("states: a place is not finite; leave out the rows of objects that are absent.")
        frame = self.background_deviation * rng.standard_normal(self.shape)
        for place in places:
            spans = [self._span(centre, length) for centre, length in zip(place[::-1], self.shape, strict=True)]
            noise = self.object_deviation * rng.standard_normal((self.object_size,) * len(self.shape))
            at = np.ix_(*(samples for samples, _ in spans))
            kept = noise[np.ix_(*(inside for _, inside in spans))]
            frame[at] = kept if self.mode == "replacing" else frame[at] + kept
        return frame

    def simulate_sequence(self, frames: int, paths: list[NoiseObjectPath], rng: Generator) -> NoiseRecording:
        """Draw a sequence of frames with objects that move on straight paths, appear and leave.

        Parameters
        ----------
        frames
            Number of frames, T.
        paths
            One an object; none at all gives the background alone.
        rng
            Source of the noise.

        Raises
        ------
        ParameterError
            If a path's places have not as many numbers as a frame has dimensions.
        DataError
            If there is no frame to draw.
        """
        if frames < 1:
            raise DataError(f"frames: must be at least 1 (got {frames}).")
        axes = (X, Y)[: len(self.shape)]
        truth = np.full((frames, len(paths), len(self.state_names)), np.nan)
        for number, path in enumerate(paths):
            if not len(path.start) == len(path.velocity) == len(axes):
                raise ParameterError(
                    f"paths: path {number} needs {len(axes)} numbers for its start and for its velocity, "
                    f"as frames of shape {self.shape} have axes."
                )
            here = np.arange(path.appears, frames if path.leaves is None else min(path.leaves + 1, frames))
            for axis, start, velocity, length in zip(axes, path.start, path.velocity, self.shape[::-1], strict=True):
                along = start + velocity * (here - path.appears)
                truth[here, number, axis] = along % length if self.border == "circular" else along
                truth[here, number, axis + VX] = velocity
        drawn = [self.simulate(row[np.isfinite(row[:, X])], rng) for row in truth]
        return NoiseRecording(np.stack(drawn), truth)

    def log_ratio(self, measurement: Array) -> Array:
        """Log likelihood ratio of covered against not covered, sample by sample, of the frame's shape.

        ``M^2/2 (1/s^2 - 1/u^2) - ln(u/s)``; samples that are NaN or infinite are masked: they say nothing.

        Raises
        ------
        DataError
            If the frame has another shape than the sensor's.
        """
        frame = np.asarray(measurement, dtype=np.float64)
        if frame.shape != self.shape:
            raise DataError(
                f"frame: has shape {frame.shape}, the sensor expects {self.shape}; "
                "use frames of one size, or a sensor with this size."
            )
        s, u = self.background_deviation, self.covered_deviation
        seen = np.isfinite(frame)
        ratio = 0.5 * np.where(seen, frame, 0.0) ** 2 * (1 / s**2 - 1 / u**2) - np.log(u / s)
        return np.where(seen, ratio, 0.0)

    def log_likelihood(self, states: Array, measurement: Array) -> Array:
        """Log likelihood ratio of one object at each state against none, exact: the sum over what it covers.

        Parameters
        ----------
        states
            ``(N, d)``; x in column 0 and, in two dimensions, y in column 2 [samples].
        measurement
            Frame of the sensor's shape.

        Returns
        -------
        ndarray
            ``(N,)``; 0 where the object lies off a bounded frame.

        Raises
        ------
        DataError
            If the frame has another shape, or the states too few components.
        """
        from elusive.sensors import _waveform_kernels

        places, size = self._places(states), self.object_size
        ratio = np.atleast_2d(self.log_ratio(measurement))
        line = len(self.shape) == 1
        x = np.ascontiguousarray(places[:, 0])
        y = np.zeros(len(x)) if line else np.ascontiguousarray(places[:, 1])
        return _waveform_kernels.covered_sums(ratio, x, y, size, 1 if line else size, self.border == "circular")

    def log_in_view(self, states: Array) -> Array:
        """0 where the object covers a sample of the frame, else minus infinity."""
        if self.border == "circular":
            return np.zeros(len(states))
        first = np.ceil(self._places(states) - 0.5 * self.object_size)
        inside = (first > -self.object_size) & (first < self.shape[::-1])
        return np.where(inside.all(axis=1), 0.0, -np.inf)

    def _places(self, states: Array) -> Array:
        """Centres of the states, ``(N, 1)`` or ``(N, 2)``: x, y."""
        columns = [X, Y][: len(self.shape)]
        if states.ndim != 2 or states.shape[1] <= columns[-1]:
            raise DataError(
                f"states: have shape {np.shape(states)}; give one row a state, "
                f"beginning {', '.join(self.state_names)}, for frames of shape {self.shape}."
            )
        return np.asarray(states[:, columns], dtype=np.float64)

    def _span(self, centre: float, length: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the samples of one axis that an object there covers, and which of the object's own they are."""
        own = np.arange(self.object_size)
        samples = np.ceil(centre - 0.5 * self.object_size).astype(np.int64) + own
        if self.border == "circular":
            return samples % length, own
        inside = (samples >= 0) & (samples < length)
        return samples[inside], own[inside]
