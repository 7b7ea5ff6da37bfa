"""Slopes of the log likelihood by the constants: against the reference, and against differences of it."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.sensors.link_shadowing import LinkShadowing
from elusive.sensors.shadowing_slopes import POSITIVE, SLOPE, Placed, log_likelihood
from tests.reference.links import shadowed_log_ratio
from tests.tracking.link_scenes import shadowed_links, states_of

MODEL = LinkShadowing(loss_length_m=0.3, near_length_m=0.2, far_length_m=0.7, temper=0.4)
STEP = 1e-5


def scene(others):
    """A sensor, a frame with readings missing, and where its people may be: the first may not be there at all."""
    rng = np.random.default_rng(3)
    sensor = shadowed_links(3, nodes=6, half=2.0, channels=18, model=MODEL)
    places = [rng.uniform(-2, 2, (many, 2)) for many in (5, 3, 1)[: others + 1]]
    change = sensor.simulate(states_of(np.array([some[0] for some in places])), rng)
    change[rng.random(change.shape) < 0.2] = np.nan
    shares = [rng.dirichlet(np.ones(len(some) + 1))[:-1] for some in places]
    return sensor, change, places, shares


def told(sensor, change, places, shares):
    first, *rest = [Placed(sensor.expected_at(some), share) for some, share in zip(places, shares, strict=True)]
    return log_likelihood(sensor, change, first, rest)


@pytest.mark.parametrize("others", [0, 2])
def test_it_is_the_mean_of_the_log_likelihood(others):
    sensor, change, places, shares = scene(others)
    effects = [
        sensor.effect(sensor.expected_at(some), share / share.sum(), share.sum())
        for some, share in zip(places[1:], shares[1:], strict=True)
    ]
    mean = sum(effect.mean for effect in effects)
    variance = sensor.tables.floor + sum(effect.variance for effect in effects)
    ratio = shadowed_log_ratio(sensor, places[0], change, mean, variance)
    expected = sensor.log_without(change, effects) + shares[0] @ ratio
    assert told(sensor, change, places, shares)[0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("others", [0, 2])
def test_slopes_are_those_of_differences(others):
    sensor, change, places, shares = scene(others)

    def at(name, step):
        value = getattr(MODEL, name)
        constant = value + step if name == SLOPE else value * np.exp(step)
        return told(sensor.with_model(MODEL.replace(**{name: constant})), change, places, shares)[0]

    differences = [(at(name, STEP) - at(name, -STEP)) / (2 * STEP) for name in (*POSITIVE, SLOPE)]
    assert told(sensor, change, places, shares)[1] == pytest.approx(np.array(differences), rel=1e-3, abs=1e-4)
