"""Shadowed links: against SciPy's densities reading by reading, and what is simulated against the moments."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import AdditiveSensor
from elusive.errors import DataError, ParameterError
from elusive.sensors.link_effects import total
from elusive.sensors.link_likeness import Likeness
from elusive.sensors.link_shadowing import LinkShadowing, fade_levels
from elusive.sensors.radio_network import directed_links_of, radio_nodes
from tests.reference.links import shadowed_log_ratio, shadowing

NODES = radio_nodes(np.array([[0.0, 0.0], [5.0, 0.5], [4.0, 6.0], [-1.0, 4.0], [2.0, 7.0]]))
CHANNELS = 3


def network(rng, model=None, unheard=True):
    mean = rng.uniform(-85, -50, (20, CHANNELS))
    variance = rng.uniform(0, 2, mean.shape)
    if unheard:
        mean[4, 1] = variance[4, 1] = np.nan
    return (LinkShadowing() if model is None else model).links(NODES, mean, variance)


def states_at(places):
    return np.column_stack([places[:, 0], np.zeros(len(places)), places[:, 1], np.zeros(len(places))])


def change_of(rng):
    change = rng.normal(0, 6, (20, CHANNELS))
    change[rng.random(change.shape) < 0.1] = np.nan
    change[7] = np.nan
    return change


@pytest.mark.parametrize(
    "model",
    [LinkShadowing(), LinkShadowing(degrees=9.0, temper=1.0, loss_length_m=0.3, near_length_m=0.5, fade_slope=0)],
)
def test_the_ratio_is_that_of_the_densities(model):
    rng = np.random.default_rng(0)
    sensor = network(rng, model)
    change, places = change_of(rng), rng.uniform(-2, 8, (50, 2))
    places[0] = [2.5, 0.25]  # on a line
    crowd = sensor.effect(sensor.expected(states_at(rng.uniform(0, 5, (30, 2)))), np.full(30, 1 / 30), 0.7)
    floor = np.nan_to_num(sensor.variance_db2) + sensor.model.floor_sd_db**2
    for others in ((), (crowd,), (crowd, crowd)):
        mean, variance = total(others, floor)
        wanted = shadowed_log_ratio(sensor, places, change, mean, variance)
        one_by_one = [sensor.log_ratio(sensor.expected(states_at(place[None])), change, others) for place in places]
        np.testing.assert_allclose(np.concatenate(one_by_one), wanted, rtol=1e-9, atol=1e-9)
        # of a cloud by cubics over an eighth of a doubling of the excess path
        together = sensor.log_ratio(sensor.expected(states_at(places)), change, others)
        np.testing.assert_allclose(together, wanted, rtol=1e-4, atol=1e-3)
    states = np.column_stack([places[:, 0], np.ones(50), places[:, 1], np.ones(50), np.ones(50)])
    np.testing.assert_array_equal(
        sensor.log_likelihood(states, change), sensor.log_ratio(sensor.expected(states), change, ())
    )


@pytest.mark.parametrize("spread_m", [0.1, 1.0])
def test_between_the_knots_a_cloud_s_ratio_is_the_densities_too(spread_m):
    """Cubics over an eighth of a doubling: far below what a cloud's own error comes to."""
    rng = np.random.default_rng(7)
    sensor = network(rng)
    change, places = change_of(rng), rng.normal([2.5, 3.0], spread_m, (4000, 2))
    floor = np.nan_to_num(sensor.variance_db2) + sensor.model.floor_sd_db**2
    found = sensor.log_ratio(sensor.expected(states_at(places)), change, ())
    np.testing.assert_allclose(found, shadowed_log_ratio(sensor, places, change, 0.0, floor), atol=1e-3)


def test_nothing_heard_says_nothing():
    sensor = network(np.random.default_rng(1))
    silent = np.full((20, CHANNELS), np.nan)
    np.testing.assert_array_equal(sensor.log_likelihood(np.zeros((3, 4)), silent), 0)


def test_the_effect_of_a_cloud_has_its_moments():
    rng = np.random.default_rng(2)
    sensor = network(rng, unheard=False)
    places, existence, weights = rng.uniform(0, 5, (40, 2)), 0.6, rng.dirichlet(np.ones(40))
    mean, squared = shadowing(sensor.model, sensor.fade_db, NODES, places)
    effect = sensor.effect(sensor.expected(states_at(places)), weights, existence)
    average = np.tensordot(weights, mean, 1)
    np.testing.assert_allclose(effect.mean, existence * average, rtol=1e-10, atol=1e-12)
    # the law of total variance, over whether they are there and where
    square = existence * np.tensordot(weights, squared + mean**2, 1) - (existence * average) ** 2
    np.testing.assert_allclose(effect.variance, square, rtol=1e-9, atol=1e-12)


def test_what_is_simulated_has_the_model_s_quantiles():
    rng = np.random.default_rng(3)
    sensor = network(rng, LinkShadowing(degrees=4.0))
    people = np.array([[2.5, 0, 0.25, 0, 1.0], [3.0, 0, 4.0, 0, 1.0]])
    draws = np.array([sensor.simulate(people, rng) for _ in range(4000)])
    np.testing.assert_array_equal(np.isnan(draws).all(axis=0), ~np.isfinite(sensor.fade_db))
    mean, squared = shadowing(sensor.model, sensor.fade_db, NODES, people[:, [0, 2]])
    centre, scale = mean.sum(axis=0), np.sqrt(squared.sum(axis=0) + sensor.variance_db2 + sensor.model.floor_sd_db**2)
    standard = ((draws - centre) / scale)[:, np.isfinite(sensor.fade_db)]
    # quartiles of Student's t with four degrees: +-.7407; the error of each of 59 is .02, so 4 of them
    assert np.abs(np.quantile(standard, [0.25, 0.5, 0.75], axis=0).T - [-0.7407, 0, 0.7407]).max() < 0.09
    assert np.isnan(sensor.simulate(np.empty((0, 4)), rng)).sum() == 1


def test_fade_levels_take_the_loss_with_distance_out():
    sender, receiver = directed_links_of(5).T
    apart = np.linalg.norm(NODES.positions_m[sender] - NODES.positions_m[receiver], axis=1)
    fade = np.random.default_rng(4).normal(0, 5, (20, 4))
    fade -= fade.mean(axis=0)
    line = -40 - 27 * np.log10(apart)[:, None]
    np.testing.assert_allclose(fade_levels(NODES, line + np.zeros((20, 4))), 0, atol=1e-10)
    found = fade_levels(NODES, line + fade)
    left = fade - found  # only a straight line over the logarithm of distance may be missing
    design = np.column_stack([np.ones(80), np.repeat(np.log10(apart), 4)])
    assert np.abs(left.ravel() - design @ np.linalg.lstsq(design, left.ravel(), rcond=None)[0]).max() < 1e-9
    assert np.isnan(fade_levels(NODES, np.where(np.arange(20)[:, None] == 3, np.nan, line + fade))[3]).all()


def test_it_is_a_sensor_of_people_whose_effects_add_up():
    sensor = network(np.random.default_rng(5))
    assert isinstance(sensor, AdditiveSensor)
    rise = np.zeros((20, CHANNELS))
    assert sensor.with_model(LinkShadowing(temper=0.5)).temper_of(rise) == 0.5
    # of ten links; the mean over readings of how many there are on a link
    heard = (~sensor.unheard).sum(axis=1)[sensor.tables.ways].sum(axis=1)
    assert heard.sum() == 59
    assert sensor.temper_of(rise) == pytest.approx(59 / (heard**2).sum())


def test_as_much_is_made_of_a_reading_as_its_link_has_in_the_frame():
    """Of radios that hop, a channel a frame: were all channels counted, a third was made of it."""
    sensor, rise = network(np.random.default_rng(5), unheard=False), np.zeros((20, CHANNELS))
    hopping = np.where(np.arange(CHANNELS) == 1, rise, np.nan)
    assert sensor.temper_of(rise) == pytest.approx(1 / 6)
    assert sensor.temper_of(hopping) == sensor.tempered(hopping, Likeness(), 0.0).temper == pytest.approx(1 / 2)
    assert sensor.temper_of(np.full((20, CHANNELS), np.nan)) == 1.0


@pytest.mark.parametrize(
    ("mean", "variance", "said"),
    [
        (np.zeros((19, 2)), np.zeros((19, 2)), r"5 nodes need \(20, C\)"),
        (np.zeros((20, 2)), np.zeros((20, 3)), r"5 nodes need \(20, C\)"),
        (np.full((20, 2), np.nan), np.zeros((20, 2)), "has no reading"),
        (np.zeros((20, 2)), np.full((20, 2), -1.0), "negative variance"),
    ],
)
def test_a_calibration_that_does_not_fit_is_refused(mean, variance, said):
    with pytest.raises(DataError, match=said):
        LinkShadowing().links(NODES, mean, variance)


def test_faulty_frames_and_constants_are_refused():
    sensor = network(np.random.default_rng(6))
    for change in (np.zeros((20, 2)), np.full((20, CHANNELS), np.inf)):
        with pytest.raises(DataError, match="frame: has shape"):
            sensor.log_likelihood(np.zeros((1, 4)), change)
    for constants in ({"temper": 0.0}, {"loss_db": -1}, {"near_length_m": 0.0}, {"floor_sd_db": float("nan")}):
        with pytest.raises(ParameterError, match=next(iter(constants))):
            LinkShadowing(**constants)
