"""Slow twins of the field's sensors and of what additive sensors say, by the definitions."""

from __future__ import annotations

import numpy as np
from scipy.stats import multivariate_normal


def power_at(places, x, y, power, core2):
    """Power of a target at each place, sensor by sensor."""
    found = np.empty((len(places), len(x)))
    for i, (px, py) in enumerate(places):
        for j in range(len(x)):
            found[i, j] = power / ((px - x[j]) ** 2 + (py - y[j]) ** 2 + core2)
    return found


def covariance_of(effect):
    """Whole covariance of what a target adds."""
    return effect.factor.T @ effect.factor + np.diag(effect.rest)


def log_ratio(added, measurement, noise_variance, others):
    """Gaussian log densities with the whole covariance, of one more target less none; NaN readings left out."""
    seen = np.isfinite(measurement)
    mean = sum((other.mean for other in others), np.zeros(len(measurement)))[seen]
    covariance = np.diag(noise_variance) + sum((covariance_of(other) for other in others), 0.0)
    covariance = covariance[np.ix_(seen, seen)]
    without = multivariate_normal.logpdf(measurement[seen], mean, covariance)
    return (
        np.array([multivariate_normal.logpdf(measurement[seen], mean + h[seen], covariance) for h in added]) - without
    )
