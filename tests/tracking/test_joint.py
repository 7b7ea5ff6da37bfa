"""Targets that overlap weighed together, beside the sum over all pairs of their particles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import logsumexp

from elusive.sensors import ImageSensor
from elusive.tracking.joint import DRAWS, jointly
from elusive.tracking.lifecycle import Life
from elusive.tracking.sought import Sought, Update

SENSOR = ImageSensor(rows=24, columns=24, psf_sigma=1.0, noise_sigma=1.0)
N = 200
PLACES = ((11.0, 12.0), (12.5, 12.0))


def sought(sensor, place, prior, rng):
    states = np.zeros((N, 5))
    states[:, [0, 2]] = np.array(place) + 0.5 * rng.standard_normal((N, 2))
    states[:, 4] = sensor.intensity_of(7.0)
    even = np.full(N, -math.log(N))
    return Sought(Life(), prior, prior, np.asfortranarray(states), even, np.exp(even))


def updated(sensor, frame, rng, priors=(0.9, 0.6), places=PLACES):
    update = Update(sensor, frame, None, rng)
    predicted = [update.opened(sought(sensor, place, prior, rng)) for place, prior in zip(places, priors, strict=True)]
    return update, update.of(predicted, 2)


def over_all_pairs(frame, targets, templates):
    """Existence and weights of each target by sums over all pairs of particles, each there or not."""
    seen, frame = np.isfinite(frame), np.where(np.isfinite(frame), frame, 0.0)
    log_mass = np.empty((N + 1, N + 1))  # the last: not there
    for i in range(N + 1):
        left = frame - templates[0][i]
        log_mass[i] = -0.5 * (((left - templates[1]) ** 2) * seen).sum(axis=(1, 2))
    for axis, target in enumerate(targets):
        share = np.append(np.full(N, math.log(target.prior / N)), math.log1p(-target.prior))
        log_mass += share[:, None] if axis == 0 else share
    mass = np.exp(log_mass - logsumexp(log_mass))
    for axis in (1, 0):
        marginal = mass.sum(axis=axis)
        yield 1 - marginal[N], marginal[:N] / marginal[:N].sum()


@pytest.mark.parametrize("masked", [False, True])
def test_overlapping_targets_have_the_marginals_of_their_joint_posterior(masked):
    errors = []
    for seed in range(12):
        rng = np.random.default_rng([41, seed])
        true = np.zeros((2, 5))
        true[:, [0, 2]], true[:, 4] = PLACES, SENSOR.intensity_of(7.0)
        frame = SENSOR.simulate(true, rng)
        if masked:
            frame[12, 10:13] = np.nan
        update, found = updated(SENSOR, frame, rng)
        templates = [
            np.array([*(SENSOR.template(state[None]) for state in target.particles), np.zeros(SENSOR.shape)])
            for target in found
        ]
        exact = over_all_pairs(frame, found, templates)
        for target, (existence, weights) in zip(jointly(found, update), exact, strict=True):
            places = target.particles[:, [0, 2]]
            mean, told = weights @ places, target.weights @ places
            variance = weights @ (places - mean) ** 2
            errors.append(
                [
                    *((told - mean) / np.sqrt(variance)),
                    *np.log((target.weights @ (places - told) ** 2) / variance),
                    target.existence - existence,
                ]
            )
    errors = np.array(errors)
    # half of the draws are effective: a mean shifts by less than the deviation over their root
    assert np.abs(errors.mean(axis=0)).max() < 3 / math.sqrt(DRAWS / 2) / math.sqrt(len(errors)) + 0.02
    assert errors[:, :2].std() < 1 / math.sqrt(DRAWS / 2)
    assert errors[:, 2:4].std() < 2 / math.sqrt(DRAWS / 2)
    assert errors[:, 4].std() < 0.5 / math.sqrt(DRAWS / 2)


@pytest.mark.parametrize(
    ("sensor", "places"), [(SENSOR, ((5.0, 12.0), (19.0, 12.0))), (SENSOR.replace(noise="rayleigh"), PLACES)]
)
def test_targets_apart_or_in_an_envelope_stay_as_they_are(sensor, places):
    rng = np.random.default_rng(5)
    frame = sensor.simulate(np.zeros((0, 5)), rng)
    update, found = updated(sensor, frame, rng, places=places)
    assert all(after is before for after, before in zip(jointly(found, update), found, strict=True))


def test_a_crowd_costs_as_its_square(monkeypatch):
    asked = []
    overlap = ImageSensor.overlap

    def counted(self, *given):
        asked.append(1)
        return overlap(self, *given)

    monkeypatch.setattr(ImageSensor, "overlap", counted)
    rng = np.random.default_rng(47)
    n = 12
    places = [(6.0 + k, 12.0) for k in range(n)]
    update, found = updated(SENSOR, rng.normal(0, 1, SENSOR.shape) + 3, rng, [0.9] * n, places)
    assert len(jointly(found, update)) == n
    assert len(asked) <= 2 * n * n
