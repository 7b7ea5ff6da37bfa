"""How belief evolves: every filter has ``init(rng)`` and ``step(state, measurement, rng)``."""

from elusive.filters.bernoulli import BernoulliFilter, BernoulliState
from elusive.filters.births import BrightBirth, MeasurementBirth, UniformBirth
from elusive.filters.estimates import (
    credible_ellipse,
    credible_region,
    joint_map,
    marginal_map,
    mean_and_covariance,
)
from elusive.filters.existence import ExistenceParticleFilter, ExistenceState
from elusive.filters.mode import densest
from elusive.filters.particle import GaussianPrior, ParticleFilter, ParticleState
from elusive.filters.particle_map import map_estimate, marginal_mode
from elusive.filters.recorded import RecordedFilter, RecordedState
from elusive.filters.recurrent import RecurrentFilter, RecurrentState
from elusive.filters.resampling import effective_sample_size, resample
from elusive.filters.trajectories import BatchMaximum, BestTrajectories, Trajectory
from elusive.filters.velocity_bank import VelocityBank
from elusive.filters.viterbi import BestPaths, Viterbi

__all__ = [
    "BatchMaximum",
    "BernoulliFilter",
    "BernoulliState",
    "BestPaths",
    "BestTrajectories",
    "BrightBirth",
    "ExistenceParticleFilter",
    "ExistenceState",
    "GaussianPrior",
    "MeasurementBirth",
    "ParticleFilter",
    "ParticleState",
    "RecordedFilter",
    "RecordedState",
    "RecurrentFilter",
    "RecurrentState",
    "Trajectory",
    "UniformBirth",
    "VelocityBank",
    "Viterbi",
    "credible_ellipse",
    "credible_region",
    "densest",
    "effective_sample_size",
    "joint_map",
    "map_estimate",
    "marginal_map",
    "marginal_mode",
    "mean_and_covariance",
    "resample",
]
