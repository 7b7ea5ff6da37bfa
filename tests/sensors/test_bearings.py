"""Bearings: their geometry, their noise, their likelihood as a density, their information as its curvature."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import circmean, norm

from elusive.errors import DataError, ParameterError
from elusive.motion import ConstantVelocity
from elusive.motion.altitude import WithAltitude
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import tabulated
from elusive.sensors.bearings import BearingSensors, wrapped
from tests.longer import longer

PLACES = ((0.0, 0.0, 1.0), (70.0, 12.0, 0.0), (-60.0, 81.0, 5.0))
FLAT = BearingSensors(positions_m=PLACES, sigma_deg=2.0)
SOLID = BearingSensors(positions_m=PLACES, sigma_deg=2.0, dimensions=3)
STATE = np.array([[30.0, 1.0, 40.0, -1.0, 25.0, 0.5]])


def test_azimuths_are_clockwise_from_north():
    around = np.array([[0, 0, 9, 0.0], [9, 0, 0, 0], [0, 0, -9, 0], [-9, 0, 0, 0]])
    azimuth, elevation = BearingSensors(positions_m=((0, 0, 0),)).measured(around)
    np.testing.assert_allclose(np.rad2deg(azimuth[:, 0]), [0, 90, 180, -90])
    assert not elevation.any()
    _, up = BearingSensors(positions_m=((0, 0, 0),), dimensions=3).measured(np.array([[3.0, 0, 4, 0, 5, 0]]))
    assert np.rad2deg(up[0, 0]) == pytest.approx(45)


def test_simulated_noise_has_its_deviation_across_and_upwards():
    rng, n = np.random.default_rng(1), 4000
    sensors = SOLID.replace(sensor_sigma_deg=(1.0, 2.0, 4.0))
    sets = sensors.simulate(np.repeat(STATE, n, axis=0), np.arange(n), rng)
    azimuth, elevation = sensors.measured(STATE)
    across = wrapped(np.array([s.azimuth_rad for s in sets]) - azimuth) * np.cos(elevation)
    upwards = np.array([s.elevation_rad for s in sets]) - elevation
    for error in (across, upwards):
        np.testing.assert_allclose(np.rad2deg(error.std(axis=0)), [1, 2, 4], rtol=4 / np.sqrt(2 * n))
        assert (np.abs(error.mean(axis=0)) < 4 * np.deg2rad([1, 2, 4]) / np.sqrt(n)).all()


def test_misses_strays_and_biases_are_as_frequent_as_told():
    n, path = 3000, np.repeat(STATE[:, :4], 3000, axis=0)
    seen = FLAT.replace(detection_probability=0.7).simulate(path, np.arange(n), np.random.default_rng(2))
    assert sum(len(s.sensor) for s in seen) / (3 * n) == pytest.approx(0.7, abs=4 * np.sqrt(0.21 / (3 * n)))
    stray = FLAT.replace(outlier_probability=0.2).simulate(path, np.arange(n), np.random.default_rng(3))
    truth = FLAT.measured(path[:1])[0][0]
    far = np.mean([np.abs(wrapped(s.azimuth_rad - truth)) > np.deg2rad(10) for s in stray])
    assert far == pytest.approx(0.2 * (1 - 20 / 360), abs=4 * np.sqrt(0.16 / (3 * n)))
    drawn = [
        FLAT.replace(bias_sd_deg=30.0, samples=50, sigma_deg=0.01).simulate(path[:1], [0.0], np.random.default_rng(k))
        for k in range(300)
    ]
    errors = np.array([wrapped(s.azimuth_rad[::50] - truth) for (s,) in drawn])
    assert np.rad2deg(errors.std()) == pytest.approx(30, rel=4 / np.sqrt(1800))


def test_averaging_is_circular_and_divides_the_variance():
    rng = np.random.default_rng(4)
    sensors = FLAT.replace(samples=20, sigma_deg=8.0)
    north = np.array([[0.0, 0, 500.0, 0]])
    (measurement,) = sensors.simulate(north, [0.0], rng)
    row, azimuth, elevation, variance = sensors.averaged(measurement)
    assert row.tolist() == [0, 1, 2]
    for k in range(3):
        expected = circmean(measurement.azimuth_rad[measurement.sensor == k], high=np.pi, low=-np.pi)
        assert azimuth[k] == pytest.approx(expected)
    assert np.isnan(elevation).all()
    np.testing.assert_allclose(variance, np.deg2rad(8.0) ** 2 / 20)
    table = tabulated([measurement], sensors)
    assert table.first.tolist() == [0, 3]
    assert table.places.tolist() == [list(place) for place in PLACES]


def test_a_stray_among_samples_is_none_of_their_mean():
    sensors, rng = FLAT.replace(samples=5, sigma_deg=1.0), np.random.default_rng(6)
    sets = sensors.simulate(np.repeat(STATE[:, :4], 40, axis=0), np.arange(40.0), rng)
    far = [rng.uniform(1, 5) * (np.arange(len(one.sensor)) == 2) for one in sets]
    strays = [one._replace(azimuth_rad=one.azimuth_rad + off) for one, off in zip(sets, far, strict=True)]
    table = tabulated(strays, sensors)
    kept = [one.azimuth_rad[[0, 1, 3, 4]] for one in sets]
    np.testing.assert_allclose(table.azimuth_rad[::3], [circmean(one, high=np.pi, low=-np.pi) for one in kept])
    np.testing.assert_allclose(np.deg2rad(1.0) ** 2 / table.variance, np.tile([4, 5, 5], 40))
    assert (np.array([sensors.averaged(one)[3][0] for one in strays]) >= np.deg2rad(1.0) ** 2 / 4).all()


def test_a_sample_without_elevation_leaves_the_others_mean():
    measurement = BearingSet(0.0, np.array([1, 1]), np.array([0.1, 0.3]), np.array([0.2, np.nan]))
    _, azimuth, elevation, _ = SOLID.averaged(measurement)
    assert (azimuth[0], elevation[0]) == (pytest.approx(0.2), pytest.approx(0.2))


@pytest.mark.parametrize("outliers", longer([0.0, 0.3], 0.0))
def test_likelihood_integrates_to_one(outliers):
    flat = FLAT.replace(outlier_probability=outliers, positions_m=PLACES[:1])
    angles = np.linspace(-np.pi, np.pi, 2001)[:-1]
    density = [
        np.exp(flat.log_likelihood(STATE[:, :4], BearingSet(0.0, np.array([0]), np.array([a]), np.array([np.nan]))))
        for a in angles
    ]
    assert np.sum(density) * (angles[1] - angles[0]) == pytest.approx(1, abs=1e-6)
    solid = SOLID.replace(outlier_probability=outliers, positions_m=PLACES[:1])
    rng = np.random.default_rng(5)
    azimuth, elevation = (part[0, 0] for part in solid.measured(STATE))
    reach, n = np.deg2rad(12), 5000
    around, up = azimuth + rng.uniform(-reach, reach, n), elevation + rng.uniform(-reach, reach, n)
    mass = [
        np.exp(solid.log_likelihood(STATE, BearingSet(0.0, np.array([0]), np.array([a]), np.array([e]))))[0] * np.cos(e)
        for a, e in zip(around, up, strict=True)
    ]
    area = (2 * reach) ** 2
    patch = outliers * 2 * reach * (np.sin(elevation + reach) - np.sin(elevation - reach)) / (4 * np.pi)
    assert np.mean(mass) * area == pytest.approx(1 - outliers + patch, abs=4 * np.std(mass) * area / np.sqrt(n))


def test_likelihood_sees_through_north_and_passes_over_what_is_not_measured():
    single = FLAT.replace(positions_m=((0, 0, 0),))
    for_north = BearingSet(0.0, np.array([0]), np.array([np.deg2rad(359.0)]), np.array([np.nan]))
    state = np.array([[np.sin(np.deg2rad(1.0)), 0, np.cos(np.deg2rad(1.0)), 0]])
    assert single.log_likelihood(state, for_north)[0] == pytest.approx(norm(0, np.deg2rad(2)).logpdf(np.deg2rad(2)))
    none = BearingSet(0.0, np.empty(0, int), np.empty(0), np.empty(0))
    assert single.log_likelihood(np.repeat(state, 3, axis=0), none).tolist() == [0, 0, 0]


@pytest.mark.parametrize("sensors", [FLAT, SOLID], ids=["flat", "solid"])
def test_information_is_the_curvature_of_the_exact_measurement(sensors):
    d = 2 * sensors.dimensions
    state = STATE[:, :d]
    azimuth, elevation = sensors.measured(state)
    sets = BearingSet(0.0, np.arange(3), azimuth[0], elevation[0] if d == 6 else np.full(3, np.nan))
    step, curvature = 1e-3, np.empty((d, d))
    for i in range(d):
        for j in range(d):
            corners = np.array(
                [state[0] + step * (a * np.eye(d)[i] + b * np.eye(d)[j]) for a in (1, -1) for b in (1, -1)]
            )
            pp, pm, mp, mm = sensors.log_likelihood(corners, sets)
            curvature[i, j] = -(pp - pm - mp + mm) / (4 * step**2)
    np.testing.assert_allclose(sensors.information(state)[0], curvature, atol=1e-5 * curvature.max())
    np.testing.assert_allclose(sensors.replace(samples=9).information(state), 9 * sensors.information(state))


def test_height_rides_on_any_plane():
    motion = WithAltitude(motion=ConstantVelocity(q=0.3), q_vertical=0.2)
    assert motion.state_names == ("x", "vx", "y", "vy", "z", "vz")
    plane, up = ConstantVelocity(q=0.3), ConstantVelocity(q=0.2)
    for whole, part, vertical in ((motion.F(0.5), plane.F(0.5), up.F(0.5)), (motion.Q(0.5), plane.Q(0.5), up.Q(0.5))):
        np.testing.assert_array_equal(whole[:4, :4], part)
        np.testing.assert_array_equal(whole[4:, 4:], vertical[:2, :2])
        assert not whole[:4, 4:].any()
        assert not whole[4:, :4].any()
    accelerating = WithAltitude(motion={"kind": "ca"})
    assert accelerating.state_names == ("x", "vx", "y", "vy", "z", "vz", "ax", "ay")
    moved = accelerating.F(1.0) @ np.array([0, 1, 0, 2, 5, 3, 4, 0.0])
    np.testing.assert_allclose(moved, [3, 5, 2, 2, 8, 3, 4, 0])


def test_refused():
    rng = np.random.default_rng(0)
    good = BearingSet(0.0, np.array([0]), np.array([1.0]), np.array([np.nan]))
    for bad, sentence in (
        (good._replace(azimuth_rad=np.array([np.inf])), "a number is not finite"),
        (good._replace(elevation_rad=np.array([np.inf])), "a number is not finite"),
        (good._replace(sensor=np.array([3])), "sensors are numbered 0 to 2"),
        (good._replace(azimuth_rad=np.empty(0)), "give each bearing a sensor"),
        ((1.0, 2.0), "give a BearingSet"),
    ):
        with pytest.raises(DataError, match=sentence):
            FLAT.log_likelihood(STATE, bad)
    with pytest.raises(DataError, match="come after 0 s; sort"):
        tabulated([good, good._replace(time_s=-1.0)], FLAT)
    assert tabulated([good, good], FLAT).first.tolist() == [0, 2]
    with pytest.raises(DataError, match="have shapes"):
        SOLID.simulate(STATE[:, :4], [0.0], rng)
    with pytest.raises(ParameterError, match="has 1 numbers for 3 sensors"):
        FLAT.replace(sensor_sigma_deg=(1.0,))
    with pytest.raises(ParameterError, match="positions_m"):
        BearingSensors(positions_m=())


def test_stands_at_a_tables_places():
    sites = SensorSites(("a", "b"), np.array([[1.0, 2, 3], [4, 5, 6]]))
    assert BearingSensors.at(sites, sigma_deg=3.0).positions_m == ((1, 2, 3), (4, 5, 6))
