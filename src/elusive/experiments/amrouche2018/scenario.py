"""The scenario of Amrouche, Khenchaf and Berkani (2018), section 5: 30 frames of 20 x 20, a target in frames 6-24."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array
from elusive.model import Model
from elusive.motion import ConstantVelocity, CoordinatedTurn, WithIntensity
from elusive.sensors.image import ImageSensor

FRAMES = 30
APPEARS, LEAVES = 6, 24  # first and last frame with the target, counted from one as in the paper
START = (4.2, 0.45, 7.2, 0.25)  # taken in cells counted from zero, as the check values were


class Recording(NamedTuple):
    """Frames with the truth behind them."""

    frames: Array  # (T, rows, columns)
    truth: Array  # (T, 5) x, vx, y, vy, I; NaN where the target is absent
    present: Array  # (T,) 1 where the target is there


class WeakTarget(Model):
    """One weak target that appears, moves and disappears, in Gaussian noise."""

    motion: Literal["cv", "ct"] = Field("cv", description="Constant velocity (section 5.1) or coordinated turn (5.2)")
    snr_db: float = Field(6.71, ge=-40, le=80, description="Peak signal-to-noise ratio at appearance [dB]")
    turn_rate_deg: float = Field(6.0, description="Turn rate of the coordinated turn, Psi [degrees / s]")
    q: float = Field(0.001, ge=0, description="Power of the white acceleration, q1")
    q_intensity: float = Field(0.01, ge=0, description="Power of the intensity's random walk, q2")

    @property
    def sensor(self) -> ImageSensor:
        """The paper's sensor."""
        return ImageSensor()

    @property
    def target_motion(self) -> WithIntensity:
        """The target's motion, which the filter knows."""
        turn = CoordinatedTurn(q=self.q, turn_rate_deg=self.turn_rate_deg)
        kinematic = turn if self.motion == "ct" else ConstantVelocity(q=self.q)
        return WithIntensity(motion=kinematic, q_intensity=self.q_intensity)

    def simulate(self, rng: Generator) -> Recording:
        """Draw the target's path and the frames."""
        sensor, motion = self.sensor, self.target_motion
        truth = np.full((FRAMES, 5), np.nan)
        state = np.array([[*START, sensor.intensity_of(self.snr_db)]])
        for k in range(APPEARS - 1, LEAVES):
            truth[k] = state[0]
            state = motion.propagate(state, 1.0, rng)
        present = np.isfinite(truth[:, 0])
        frames = np.stack(
            [
                sensor.simulate(row[None] if here else np.empty((0, 5)), rng)
                for row, here in zip(truth, present, strict=True)
            ]
        )
        return Recording(frames, truth, present.astype(np.float64))
