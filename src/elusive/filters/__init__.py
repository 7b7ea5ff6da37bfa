"""How belief evolves: every filter has ``init(rng, time_s)`` and ``step(state, time_s, measurement, rng)``."""

from elusive.filters.accumulate.recurrent import RecurrentFilter, RecurrentState
from elusive.filters.accumulate.trajectories import BatchMaximum, BestTrajectories, Trajectory
from elusive.filters.accumulate.velocity_bank import VelocityBank
from elusive.filters.accumulate.viterbi import BestPaths, Viterbi
from elusive.filters.particle.bernoulli import BernoulliFilter, BernoulliState
from elusive.filters.particle.births import BrightBirth, MeasurementBirth, UniformBirth
from elusive.filters.particle.estimates import (
    credible_ellipse,
    credible_region,
    marginal_map,
    mean_and_covariance,
)
from elusive.filters.particle.existence import ExistenceParticleFilter, ExistenceState
from elusive.filters.particle.mode import densest
from elusive.filters.particle.particle_map import map_estimate, marginal_mode
from elusive.filters.particle.recorded import RecordedFilter, RecordedState
from elusive.filters.particle.resampling import effective_sample_size, resample
from elusive.filters.particle.sir import ParticleFilter, ParticleState
from elusive.filters.priors import GaussianPrior

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
    "map_estimate",
    "marginal_map",
    "marginal_mode",
    "mean_and_covariance",
    "resample",
]
