"""How belief evolves: every filter has ``init(rng)`` and ``step(state, measurement, rng)``."""

from elusive.filters.bernoulli import BernoulliFilter, BernoulliState
from elusive.filters.births import BrightBirth, MeasurementBirth, UniformBirth
from elusive.filters.existence import ExistenceParticleFilter, ExistenceState
from elusive.filters.particle import GaussianPrior, ParticleFilter, ParticleState
from elusive.filters.resampling import effective_sample_size, resample

__all__ = [
    "BernoulliFilter",
    "BernoulliState",
    "BrightBirth",
    "ExistenceParticleFilter",
    "ExistenceState",
    "GaussianPrior",
    "MeasurementBirth",
    "ParticleFilter",
    "ParticleState",
    "UniformBirth",
    "effective_sample_size",
    "resample",
]
