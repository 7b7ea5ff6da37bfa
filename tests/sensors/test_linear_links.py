"""Linear links: against the full sum over voxels, and what is simulated against the moments."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from elusive.contracts import AdditiveSensor
from elusive.errors import DataError, ParameterError
from elusive.sensors.linear_links import LinkRadiation
from elusive.sensors.link_effects import Effect
from tests.reference.links import bell, linear_log_ratio

BOUNDS, VOXEL = (-3.0, 3.0, 0.0, 4.0), 0.5
X, Y = np.meshgrid(np.arange(-2.75, 3, 0.5), np.arange(0.25, 4, 0.5))
CENTRES = np.column_stack([X.ravel(), Y.ravel()])


def weights_of(rng, links=15):
    return np.where(rng.random((links, len(CENTRES))) < 0.2, rng.uniform(0.5, 2, (links, len(CENTRES))), 0.0)


@pytest.mark.parametrize(
    "model",
    [
        LinkRadiation(),
        LinkRadiation(amplitude_db=3.0, width_x_m=0.3, width_y_m=0.6, rotation_deg=30.0, spread=0.0, temper=1.0),
    ],
)
def test_the_ratio_is_that_of_the_densities(model):
    rng = np.random.default_rng(0)
    weights = weights_of(rng)
    sensor = model.links(sparse.csr_array(weights), BOUNDS, VOXEL)
    change = rng.normal(0, 30, 15)
    change[3] = np.nan
    places = rng.uniform((-3.2, -0.2), (3.2, 4.2), (40, 2))
    others = Effect(rng.normal(0, 10, 15), rng.uniform(1, 40, 15))
    states = np.column_stack([places[:, 0], np.ones(40), places[:, 1], np.ones(40)])
    variance = others.variance + model.noise_sd_db**2 + model.voxel_sd_db**2 * (weights**2).sum(axis=1)
    wanted = linear_log_ratio(model, weights, CENTRES, places, change, others.mean, variance)
    # the bell is cut at 3.5 deviations, where it is .002 of its height
    np.testing.assert_allclose(
        sensor.log_ratio(sensor.expected(states), change, (others,)) / sensor.temper, wanted, rtol=0.01, atol=1.0
    )
    np.testing.assert_array_equal(
        sensor.log_likelihood(states, change), sensor.log_ratio(sensor.expected(states), change, ())
    )


@pytest.mark.parametrize("model", [LinkRadiation(), LinkRadiation(noise_sd_db=0.3, voxel_sd_db=0.6, spread=0.0)])
def test_links_that_share_voxels_noise_count_for_as_much_as_they_tell(model):
    """Against the covariance of all links, at the voxels' centres."""
    weights = weights_of(np.random.default_rng(5))
    noise = model.noise_sd_db**2 * np.eye(15) + model.voxel_sd_db**2 * weights @ weights.T
    told, truly = 0.0, 0.0
    for place in CENTRES:
        response = bell(model, CENTRES, place[None])[0]
        covariance = noise + np.diag((model.spread * weights @ response) ** 2)
        for axis, width in enumerate((model.width_x_m, model.width_y_m)):
            slope = weights @ (response * (CENTRES - place)[:, axis] / width**2)
            score = slope / np.diag(covariance)
            told, truly = told + score @ slope, truly + score @ covariance @ score
    temper = model.links(weights, BOUNDS, VOXEL).temper
    assert temper == pytest.approx(told / truly, rel=0.01)
    assert temper < 0.95
    assert model.replace(voxel_sd_db=0.0).links(weights, BOUNDS, VOXEL).temper == pytest.approx(1.0)
    assert model.replace(temper=0.3).links(weights, BOUNDS, VOXEL).temper == 0.3


def test_the_effect_of_a_cloud_has_its_moments():
    rng = np.random.default_rng(1)
    model, weights, existence = LinkRadiation(), weights_of(rng), 0.3
    places = rng.uniform((-2, 1), (2, 3), (25, 2))
    shares, sensor = rng.dirichlet(np.ones(25)), model.links(weights, BOUNDS, VOXEL)
    states = np.column_stack([places[:, 0], np.zeros(25), places[:, 1], np.zeros(25)])
    effect = sensor.effect(sensor.expected(states), shares, existence)
    response = bell(model, CENTRES, places) @ weights.T
    assert isinstance(sensor, AdditiveSensor)
    np.testing.assert_allclose(effect.mean, existence * shares @ response, rtol=2e-3, atol=0.1)
    square = existence * (1 + model.spread**2) * (shares @ response**2)
    np.testing.assert_allclose(effect.variance, square - (existence * shares @ response) ** 2, rtol=5e-3, atol=2.0)


def test_what_is_simulated_has_the_model_s_moments():
    rng = np.random.default_rng(2)
    weights = weights_of(rng)
    sensor = LinkRadiation(noise_sd_db=2.0, voxel_sd_db=1.5).links(weights, BOUNDS, VOXEL)
    people = np.array([[-1.0, 0, 1.0, 0], [1.5, 0, 3.0, 0]])
    draws = np.array([sensor.simulate(people, rng) for _ in range(4000)])
    responses = bell(sensor.model, CENTRES, people[:, [0, 2]]) @ weights.T
    spread = sensor.model.spread**2 * (responses**2).sum(axis=0)
    deviation = np.sqrt(4 + 1.5**2 * (weights**2).sum(axis=1) + spread)
    # four standard errors of a mean and of a deviation over 4000 draws
    assert np.abs((draws.mean(axis=0) - responses.sum(axis=0)) / deviation).max() < 4 / np.sqrt(4000) + 0.02
    np.testing.assert_allclose(draws.std(axis=0) / deviation, 1, atol=4 / np.sqrt(8000))


def test_what_does_not_fit_is_refused():
    weights = weights_of(np.random.default_rng(3))
    sensor = LinkRadiation().links(weights, BOUNDS, VOXEL)
    for change in (np.zeros(14), np.full(15, np.inf)):
        with pytest.raises(DataError, match="frame: has shape"):
            sensor.log_likelihood(np.zeros((1, 4)), change)
    with pytest.raises(DataError, match="not the 8 x 12 of the area"):
        LinkRadiation().links(weights[:, 1:], BOUNDS, VOXEL)
    with pytest.raises(DataError, match="not finite, or all zero"):
        LinkRadiation().links(weights * np.nan, BOUNDS, VOXEL)
    with pytest.raises(DataError, match="not finite, or all zero"):
        LinkRadiation().links(np.zeros_like(weights), BOUNDS, VOXEL)
    with pytest.raises(ParameterError, match="width_x_m"):
        LinkRadiation(width_x_m=0)


def test_links_are_spared_that_people_hardly_change():
    rng, model = np.random.default_rng(5), LinkRadiation(width_x_m=0.3, width_y_m=0.3)
    weights = np.where(rng.random((60, len(CENTRES))) < 0.04, rng.uniform(0.5, 2, (60, len(CENTRES))), 0.0)
    sensor = model.links(sparse.csr_array(weights), BOUNDS, VOXEL)
    noise = np.sqrt(model.noise_sd_db**2 + model.voxel_sd_db**2 * (weights**2).sum(axis=1))
    places = np.array([[-2.0, 1.0], [-1.0, 1.5]])
    changed = (bell(model, CENTRES, places) @ weights.T).sum(axis=0)
    np.testing.assert_array_equal(sensor.spared(places), changed < 0.1 * noise)
    assert 0 < sensor.spared(places[:1]).sum() < len(weights)
    assert sensor.spared(np.empty((0, 2))).all()
