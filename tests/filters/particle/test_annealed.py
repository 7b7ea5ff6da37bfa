"""Annealed importance sampling with moves: Gaussians have their posterior and their evidence in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.filters.particle.annealed import anneal


def gaussian(places, centre, sd):
    return -0.5 * ((places - centre) ** 2).sum(axis=1) / sd**2 - 2 * math.log(sd) - math.log(2 * math.pi)


@pytest.mark.parametrize("sd", [3.0, 0.3, 0.003])
def test_a_narrow_posterior_and_its_evidence_are_found(sd):
    rng, centre, n = np.random.default_rng(0), np.array([1.5, -0.7]), 2000
    found = anneal(
        rng.normal(0, 1, (n, 2)),
        lambda places, _: gaussian(places, 0.0, 1.0),
        lambda places: gaussian(places, centre, sd),
        rng,
    )
    variance = sd**2 / (1 + sd**2)
    # particles share ancestors: as good as a fifth of them
    tolerance = 4 * math.sqrt(variance / (n / 5))
    np.testing.assert_allclose(found.states.mean(axis=0), centre / (1 + sd**2), atol=tolerance)
    np.testing.assert_allclose(found.states.std(axis=0), math.sqrt(variance), rtol=0.15)
    exact = float(gaussian(centre[None], 0.0, math.hypot(1, sd))[0])
    assert found.log_evidence == pytest.approx(exact, abs=0.25)


def test_particles_keep_the_row_that_they_descend_from():
    rng = np.random.default_rng(1)
    ancestors = np.repeat([[-5.0, 0.0], [5.0, 0.0]], 500, axis=0)
    found = anneal(
        ancestors + rng.normal(0, 0.5, (1000, 2)),
        lambda places, origin: gaussian(places, ancestors[origin], 0.5),
        lambda places: gaussian(places, np.array([5.5, 0.0]), 0.01),
        rng,
    )
    assert (found.origin >= 500).all()
    np.testing.assert_allclose(found.states.mean(axis=0), [5.5, 0.0], atol=0.01)


def test_a_proposal_is_paid_for():
    rng, n = np.random.default_rng(2), 4000
    places = rng.uniform(-1, 1, (n, 2)) * [2.0, 1.0]
    # uniform over a square, drawn twice as often on its left
    places = np.concatenate([places[places[:, 0] < 0], places[places[:, 0] < 0], places[places[:, 0] >= 0]])
    share = np.where(places[:, 0] < 0, 4 / 3, 2 / 3)
    found = anneal(
        places,
        lambda there, _: np.where(np.abs(there).max(axis=1) <= 2, 0.0, -math.inf),
        lambda there: np.where(there[:, 0] < 0, math.log(3.0), 0.0),
        rng,
        log_weight=-np.log(share),
    )
    assert found.log_evidence == pytest.approx(math.log(2.0), abs=0.05)
    assert (found.states[:, 0] < 0).mean() == pytest.approx(0.75, abs=0.04)


def test_where_the_prior_excludes_everything_there_is_no_evidence():
    nowhere = anneal(
        np.zeros((20, 2)),
        lambda places, _: np.full(len(places), -math.inf),
        lambda places: np.zeros(len(places)),
        np.random.default_rng(3),
    )
    assert nowhere.log_evidence == -math.inf
