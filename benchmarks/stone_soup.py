"""The opponent: Stone Soup's particle predictor and updater, with an image of a point target as measurement model."""

from __future__ import annotations

import datetime

import numpy as np
from stonesoup.base import Property
from stonesoup.models.measurement.base import MeasurementModel
from stonesoup.models.measurement.nonlinear import NonLinearGaussianMeasurement
from stonesoup.models.transition.linear import (
    CombinedLinearGaussianTransitionModel,
    ConstantVelocity,
    RandomWalk,
)
from stonesoup.predictor.particle import ParticlePredictor
from stonesoup.resampler.particle import SystematicResampler
from stonesoup.types.array import CovarianceMatrix, StateVectors
from stonesoup.types.detection import Detection
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.state import ParticleState
from stonesoup.updater.particle import ParticleUpdater

from tests.reference.image import log_ratio_by_patch, spread

START = datetime.datetime(2018, 1, 1, tzinfo=datetime.UTC)


class ImageModel(MeasurementModel):
    """Log likelihood ratio of the pixels round each particle, in the quickest NumPy."""

    sensor: object = Property()

    @property
    def ndim_meas(self):
        return self.sensor.rows * self.sensor.columns

    @property
    def ndim_state(self):
        return 5

    @property
    def mapping(self):
        return (0, 2, 4)

    def function(self, state, noise=False, **kwargs):
        raise NotImplementedError

    def rvs(self, num_samples=1, **kwargs):
        raise NotImplementedError

    def pdf(self, state1, state2, **kwargs):
        return np.exp(self.logpdf(state1, state2, **kwargs))

    def logpdf(self, state1, state2, **kwargs):
        frame = np.asarray(state1.state_vector, dtype=float).reshape(self.sensor.shape)
        return log_ratio_by_patch(np.asarray(state2.state_vector, dtype=float).T, frame, self.sensor)


class WholeFrame(NonLinearGaussianMeasurement):
    """The same as Stone Soup's own classes have it: the frame each particle predicts, in Gaussian noise."""

    sensor: object = Property()

    @property
    def ndim_meas(self):
        return self.sensor.rows * self.sensor.columns

    def function(self, state, noise=False, **kwargs):
        states = np.asarray(state.state_vector, dtype=float).T
        return StateVectors(spread(states, self.sensor).reshape(len(states), -1).T)


def patch_model(sensor):
    """The measurement model written for speed."""
    return ImageModel(sensor=sensor)


def frame_model(sensor):
    """The measurement model as the library has it."""
    noise = CovarianceMatrix(sensor.noise_sigma**2 * np.eye(sensor.rows * sensor.columns))
    return WholeFrame(ndim_state=5, mapping=(0, 2, 4), noise_covar=noise, sensor=sensor)


class Opponent:
    """Predict, update, resample: one frame a call."""

    def __init__(self, image, particles, frame):
        self.predictor = ParticlePredictor(
            CombinedLinearGaussianTransitionModel([ConstantVelocity(0.001), ConstantVelocity(0.001), RandomWalk(0.01)])
        )
        self.updater = ParticleUpdater(image, resampler=SystematicResampler())
        self.particles = StateVectors(particles.T)
        self.weights = np.full(len(particles), 1 / len(particles))
        self.seen = Detection(
            frame.reshape(-1, 1), timestamp=START + datetime.timedelta(seconds=1), measurement_model=image
        )

    def __call__(self):
        # a state of its own: the predictor remembers what it drew for one that it has seen
        prior = ParticleState(self.particles, weight=self.weights, timestamp=START)
        predicted = self.predictor.predict(prior, timestamp=self.seen.timestamp)
        return self.updater.update(SingleHypothesis(predicted, self.seen)).mean
