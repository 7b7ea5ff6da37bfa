"""The opponent at sea: Stone Soup's particle predictor and updater, with its range, bearing and range rate model."""

from __future__ import annotations

import datetime

import numpy as np
from stonesoup.models.measurement.nonlinear import CartesianToBearingRangeRate2D
from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
from stonesoup.predictor.particle import ParticlePredictor
from stonesoup.resampler.particle import ESSResampler, SystematicResampler
from stonesoup.types.angle import Bearing
from stonesoup.types.array import StateVector, StateVectors
from stonesoup.types.detection import Detection
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.state import ParticleState
from stonesoup.updater.particle import ParticleUpdater

START = datetime.datetime(2012, 1, 1, tzinfo=datetime.UTC)


class RadarOpponent:
    """Predict, update, and resample where the effective size asks for it, over a recording of single plots."""

    def __init__(self, model, particles, plots):
        sensor, motion = model.sensor, model.motion
        axis = ConstantVelocity(motion.q)
        self.predictor = ParticlePredictor(CombinedLinearGaussianTransitionModel([axis, axis]))
        radar = CartesianToBearingRangeRate2D(
            ndim_state=4,
            mapping=(0, 2),
            velocity_mapping=(1, 3),
            noise_covar=np.diag([sensor.bearing_sd_rad, sensor.range_sd_m, sensor.doppler_sd_mps]) ** 2,
        )
        resampler = ESSResampler(model.resample_below * len(particles), SystematicResampler())
        self.updater = ParticleUpdater(radar, resampler=resampler)
        self.particles = StateVectors(particles.T)
        self.weights = np.full(len(particles), 1 / len(particles))
        self.seen = []
        for k, plot in enumerate(plots, 1):
            # its bearing runs from east to north
            seen = StateVector([Bearing(np.pi / 2 - plot.bearing_rad), plot.range_m, plot.doppler_mps])
            time = START + datetime.timedelta(seconds=k)
            self.seen.append(Detection(seen, timestamp=time, measurement_model=radar))

    def __call__(self):
        """Mean of the belief after each plot."""
        # a state of its own: the predictor remembers what it drew for one that it has seen
        state = ParticleState(self.particles, weight=self.weights, timestamp=START)
        means = []
        for seen in self.seen:
            predicted = self.predictor.predict(state, timestamp=seen.timestamp)
            state = self.updater.update(SingleHypothesis(predicted, seen))
            means.append((state.mean, state.covar))
        return np.array([mean for mean, _ in means], dtype=float)[:, :, 0]
