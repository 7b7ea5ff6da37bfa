"""Plain twin of the tracker of detections: every association of targets and detections, one after the other."""

from __future__ import annotations

import itertools

import numpy as np


def marginals(target, detection, log_odds, targets, detections):
    """Probability of each pair, of each target missed and of each detection unclaimed, by enumeration."""
    odds = np.zeros((targets, detections))
    odds[target, detection] = np.exp(log_odds)
    pairs, missed, unclaimed, total = np.zeros_like(odds), np.zeros(targets), np.zeros(detections), 0.0
    for made in itertools.product([-1, *range(detections)], repeat=targets):
        taken = [j for j in made if j >= 0]
        if len(set(taken)) < len(taken):
            continue
        weight = np.prod([odds[i, j] for i, j in enumerate(made) if j >= 0])
        total += weight
        for i, j in enumerate(made):
            if j >= 0:
                pairs[i, j] += weight
            else:
                missed[i] += weight
        for j in set(range(detections)) - set(taken):
            unclaimed[j] += weight
    return pairs[target, detection] / total, missed / total, unclaimed / total


def step(sensor, measurement, targets, log_new, born):
    """One scan of Williams (2015), section IV, over all associations.

    ``targets`` are (existence, particles, weights); returns existence and weights of each, and the existence of a new
    target at each detection, ``born`` its log intensity and ``log_new`` that with clutter.
    """
    m = len(log_new)
    hypotheses = []
    for existence, particles, weights in targets:
        seen = sensor.detection_probabilities(particles, measurement)
        likely = np.exp(sensor.log_densities(particles, measurement, np.arange(m)))
        missed = existence * weights * (1 - seen)
        made = [existence * weights * seen * likely[:, j] for j in range(m)]
        hypotheses.append((1 - existence + missed.sum(), missed, made))
    found = [[0.0, np.zeros(len(weights))] for _, _, weights in targets]
    new, total = np.zeros(m), 0.0
    for made in itertools.product([-1, *range(m)], repeat=len(targets)):
        taken = [j for j in made if j >= 0]
        if len(set(taken)) < len(taken):
            continue
        rest = [j for j in range(m) if j not in taken]
        weight = np.exp(sum(log_new[j] for j in rest))
        for (absent, _, mass), j in zip(hypotheses, made, strict=True):
            weight *= absent if j < 0 else mass[j].sum()
        total += weight
        for (absent, missed, mass), j, one in zip(hypotheses, made, found, strict=True):
            part = missed / absent if j < 0 else mass[j] / max(mass[j].sum(), 1e-300)
            one[0] += weight * part.sum()
            one[1] = one[1] + weight * part
        for j in rest:
            new[j] += weight * np.exp(born[j] - log_new[j])
    return [(existence / total, weights / weights.sum()) for existence, weights in found], new / total
