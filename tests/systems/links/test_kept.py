"""How much of the errors of readings a belief keeps until the next frame."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.geometry.areas import Area
from elusive.motion.walk import Walk
from elusive.systems.links.by_links import KEPT, LinksChain, LinksMethod
from elusive.tracking.lifecycle import Life
from elusive.tracking.superposed_state import SuperposedState, Target
from tests.longer import longer
from tests.tracking.link_scenes import shadowed_links

AREA = Area.rectangle(-4.0, 4.0, -4.0, 4.0)


def kept(*people, interval_s=0.5):
    """The share, of people of an existence and a deviation of place [m] and of velocity [m/s] on each axis."""
    chain = LinksChain(LinksMethod().tracker(shadowed_links(), AREA), AREA, 1.0, True)
    targets = [
        Target(Life(), existence, np.zeros((1, 4)), np.ones(1), np.zeros(4), np.diag([x**2, v**2, x**2, v**2]))
        for existence, x, v in people
    ]
    return chain._kept(SuperposedState(0.0, tuple(targets), 0), interval_s)


def ahead(walk, interval_s, sd_m, sd_mps):
    """Deviation of a place on an axis an interval later, by draws of the walk."""
    rng = np.random.default_rng(0)
    states = rng.normal(0, [sd_m, sd_mps, sd_m, sd_mps], (200_000, 4))
    return float(walk.propagate(states, interval_s, rng)[:, [0, 2]].std())


@pytest.mark.parametrize(("interval_s", "sd_mps"), longer([(0.1, 0.3), (0.5, 0.8), (2.0, 0.8)], (0.1, 0.3)))
def test_it_is_what_the_walk_has_not_lost(interval_s, sd_mps):
    """The share of the variance of the place ahead that was there before: the filter's gain leaves that of an error."""
    expected = 0.4**2 / ahead(Walk(), interval_s, 0.4, sd_mps) ** 2
    assert kept((1.0, 0.4, sd_mps), interval_s=interval_s) == pytest.approx(expected, rel=0.05)


def test_a_place_where_hardly_anybody_is_keeps_nothing():
    """A lost person's cloud is wide, and would keep all of it."""
    sure = kept((1.0, 3.0, 0.8))
    assert sure > 0.9
    assert kept((0.2, 3.0, 0.8)) == pytest.approx(0.2 * sure)
    assert kept((1.0, 0.4, 0.8), (0.03, 3.0, 0.8)) < kept((1.0, 0.4, 0.8), (0.9, 3.0, 0.8))


def test_of_nobody_it_is_not_known():
    assert kept() == kept((0.001, 0.4, 0.8)) == KEPT
