"""Particle filters: SIR, Bernoulli, births, resampling, estimates."""
