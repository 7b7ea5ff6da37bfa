"""The radar sensor against SciPy's densities, brute-force integrals, expectations that must be one, and Kalman."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.stats import kstest, norm

from elusive import run
from elusive.contracts import DetectionSensor, Sensor
from elusive.errors import DataError, ParameterError
from elusive.filters.particle.sir import ParticleFilter
from elusive.filters.priors import Prior
from elusive.io import RadarPlot, RadarScan
from elusive.motion import ConstantVelocity
from elusive.sensors import RadarSensor, ScanPrior
from elusive.sensors.radar_scans import OwnShip
from tests.longer import longer
from tests.reference import radar as reference

CLUTTERED = {"detection_probability": 0.8, "false_alarms": 6.0, "max_range_m": 400.0, "max_doppler_mps": 20.0}
SECTOR = {"from_bearing_deg": 300.0, "to_bearing_deg": 45.0, "min_range_m": 30.0}
WIDE = {"range_sd_m": 20.0, "bearing_sd_mrad": 300.0, "doppler_sd_mps": 2.0}
SENSORS = {
    "the thesis's": RadarSensor(),
    "elsewhere": RadarSensor(x_m=-120.0, y_m=75.0, range_sd_m=25.0, bearing_sd_mrad=40.0, detection_probability=0.9),
    "clutter": RadarSensor(**CLUTTERED),
    "certain": RadarSensor(**CLUTTERED | {"detection_probability": 1.0}),
    "wide errors": RadarSensor(**CLUTTERED, **WIDE),
    "sector": RadarSensor(**CLUTTERED, **WIDE, **SECTOR),
    "sector elsewhere": RadarSensor(**CLUTTERED, **WIDE, **SECTOR, x_m=30.0, y_m=-60.0),
    "nearly all round": RadarSensor(**CLUTTERED, **WIDE, from_bearing_deg=5.0),
    "bands": RadarSensor(**CLUTTERED, **WIDE, **SECTOR, false_alarm_shares=(0.5, 0.2, 0.3)),
    "upwind": RadarSensor(**CLUTTERED, **WIDE, **SECTOR, false_alarm_sectors=(0.7, 0.1, 0.2)),
    "patches": RadarSensor(
        **CLUTTERED,
        **WIDE,
        **SECTOR,
        false_alarm_shares=(0.5, 0.5),
        false_alarm_patches=((50.0, 200.0, 350.0, 40.0, 3.0), (100.0, 399.0, 20.0, 380.0, 5.0)),
    ),
    "worst angle": RadarSensor(**CLUTTERED, bearing_sd_mrad=500.0, to_bearing_deg=350.0),
}


def scan(*plots, time_s=0.0):
    """A scan of plots (time, range, bearing, Doppler)."""
    return RadarScan(time_s, *np.array(plots, dtype=np.float64).reshape(-1, 4).T)


def states_near(sensor, n=700, seed=1):
    """States all over and out of the field, some within metres of the radar."""
    rng = np.random.default_rng(seed)
    distance, angle = rng.uniform(0, 450, n) * rng.choice([1.0, 0.05], n), rng.uniform(-np.pi, np.pi, n)
    x, y = sensor.x_m + distance * np.sin(angle), sensor.y_m + distance * np.cos(angle)
    return np.column_stack([x, rng.normal(0, 8, n), y, rng.normal(0, 8, n)])


@pytest.mark.parametrize("name", SENSORS)
def test_it_equals_the_twin(name):
    sensor, rng = SENSORS[name], np.random.default_rng(2)
    states = states_near(sensor)
    scans = [scan(time_s=4.0), scan((7.5, 180.0, 0.02, np.nan), time_s=7.0), scan((7.0, 20.0, 6.27, -9.0), time_s=7.0)]
    if sensor.false_alarms:
        many = rng.uniform([6.0, 0.0, 0.0, -20.0], [8.0, 420.0, 2 * np.pi, 20.0], (40, 4))
        many[::5, 3] = np.nan
        scans.append(scan(*many, time_s=7.0))
    for looked in scans:
        kept = sensor.detections_in_view(looked)
        with np.errstate(invalid="ignore"):
            expected = reference.log_ratio(sensor, states, kept)
        np.testing.assert_allclose(sensor.log_likelihood(states, looked), expected, rtol=1e-9, atol=2e-9)
        columns = np.asfortranarray(np.column_stack([states, states[:, :2]]))
        np.testing.assert_array_equal(sensor.log_likelihood(columns, looked), sensor.log_likelihood(states, looked))
    inside = reference.in_view(sensor, *reference.measured(sensor, states)[:2])
    if name not in ("the thesis's", "elsewhere"):
        assert 0.05 < inside.mean() < 0.95


@pytest.mark.parametrize("name", SENSORS)
def test_it_is_a_detection_sensor(name):
    sensor, rng = SENSORS[name], np.random.default_rng(21)
    assert isinstance(sensor, DetectionSensor)
    states = states_near(sensor, n=50)
    looked = sensor.simulate(states[:3], rng) if sensor.false_alarms else sensor.simulate(states[:1], rng)
    there = sensor.in_view(states)
    seen = np.where(reference.in_view(sensor, *reference.measured(sensor, states)[:2]), sensor.detection_probability, 0)
    np.testing.assert_array_equal(sensor.detection_probabilities(states, looked), seen)
    densities, clutter = sensor.log_densities(states, looked), sensor.log_clutter(looked)
    some = np.arange(looked.detections)[::-2]
    np.testing.assert_array_equal(sensor.log_densities(states, looked, some), densities[:, some])
    assert densities.shape == (50, looked.detections)
    for found, time_s, *plot in zip(densities.T, *looked.plots, strict=True):
        known = reference.log_density(sensor, states[there], plot, time_s)
        np.testing.assert_allclose(found[there], known, rtol=1e-9, atol=1e-9)
        assert (found[~there] == -np.inf).all()
    if sensor.false_alarms:  # the ratio is made of these
        with np.errstate(divide="ignore"):
            missed = np.log(1 - sensor.detection_probability * there)
        terms = np.log(sensor.detection_probability) + densities - clutter
        expected = np.logaddexp.reduce(np.column_stack([missed, terms]), axis=1)
        np.testing.assert_allclose(sensor.log_likelihood(states, looked), expected, rtol=1e-9, atol=1e-9)
    else:
        assert (clutter == -np.inf).all()


def test_a_plot_alone_is_three_gaussians_with_the_thesis_deviations():
    states = np.array([[-37.0, 1.0, 10_000.0, 7.0], [3_000.0, -4.0, -4_000.0, 9.0], [0.0, 0.0, -5_000.0, 3.0]])
    distance, bearing = [10_000.06845, 5_000.0, 5_000.0], [-0.0037, 2.4980915, np.pi]
    rate = [(-37.0 + 70_000.0) / 10_000.06845, -9.6, -3.0]
    plot = RadarPlot(3.0, 9_991.0, 6.2805, 5.5)
    expected = norm.logpdf(plot.range_m, distance, 10) + norm.logpdf(plot.doppler_mps, rate, 3)
    off = (plot.bearing_rad - np.array(bearing) + np.pi) % (2 * np.pi) - np.pi
    expected += norm.logpdf(off, 0, 1e-3)
    np.testing.assert_allclose(RadarSensor().log_likelihood(states, plot), expected, rtol=1e-6, atol=1e-4)
    silent = RadarSensor().log_likelihood(states, plot._replace(doppler_mps=np.nan))
    np.testing.assert_allclose(silent, expected - norm.logpdf(5.5, rate, 3), rtol=1e-6, atol=1e-4)


def test_the_error_of_a_bearing_is_an_arc_at_any_range():
    sensor, off = RadarSensor(bearing_sd_mrad=400.0, x_m=5.0), np.linspace(-np.pi + 1e-9, np.pi, 300)
    for distance in (130.0, 5_000.0):
        bearing = (0.3 + off) % (2 * np.pi)
        zero = np.zeros(300)
        states = np.column_stack([5 + distance * np.sin(bearing), zero, distance * np.cos(bearing), zero])
        log = sensor.log_likelihood(states, RadarPlot(0.0, distance, 0.3))
        expected = norm.logpdf(off, 0, 0.4) - np.log(10 * np.sqrt(2 * np.pi))
        np.testing.assert_allclose(log, expected, rtol=0, atol=1e-8)


def test_what_goes_the_longer_way_round_is_nothing():
    state, off = np.array([[0.0, 0.0, 100.0, 0.0]]), np.linspace(0, 2 * np.pi, 200, endpoint=False)
    log = [RadarSensor(bearing_sd_mrad=500.0).log_likelihood(state, RadarPlot(0.0, 100.0, b))[0] for b in off]
    every_way = norm.pdf(off[:, None] + reference.TURNS, 0, 0.5).sum(axis=1) * norm.pdf(0, 0, 10)
    np.testing.assert_allclose(np.exp(log), every_way, rtol=0, atol=4e-9 * every_way[0])


@pytest.mark.parametrize("zero", [0.0, -0.0])
@pytest.mark.parametrize("sector", [{}, {"from_bearing_deg": 350.0, "to_bearing_deg": 20.0}])
def test_a_target_at_the_radar_itself_has_a_likelihood(zero, sector):
    state = np.array([[zero, 3.0, zero, 4.0]])
    value = RadarSensor(**sector).log_likelihood(state, RadarPlot(0.0, 6.0, 0.0, 4.0))
    # the line of sight runs north, and half of the range's density lies below zero
    expected = norm.logpdf(6, 0, 10) + np.log(2) + norm.logpdf(0, 0, 1e-3) + norm.logpdf(0, 0, 3)
    assert value[0] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("name", ["wide errors", "sector", "nearly all round"])
def test_the_density_of_a_plot_integrates_to_one_over_the_field(name):
    sensor = SENSORS[name].replace(detection_probability=1.0)
    first, width = reference.sector(sensor)
    low, (m, n, k) = sensor.min_range_m, (48, 32, 16)
    grid = np.stack(np.meshgrid(np.arange(m), np.arange(n), np.arange(k)), axis=-1).reshape(-1, 3) + 0.5
    ranges, bearings, dopplers = (grid / [m, n, k] * [400 - low, width, 40] + [low, first, -20]).T
    looked = RadarScan(0.0, 0 * ranges, ranges, bearings % (2 * np.pi), dopplers)
    # of one plot a cell, with one false alarm a cell, the ratio is the midpoint sum of the density
    sensor = sensor.replace(false_alarms=float(m * n * k))
    places = np.array([[150, 0.2], [35, 5.3], [398, 0.78], [60, 0.1], [250, 0.05], [250, 6.2], [250, 0.12]])
    x, y = places[:, 0] * np.sin(places[:, 1]), places[:, 0] * np.cos(places[:, 1])
    states = np.column_stack([x, 0 * x + 3, y, 0 * y - 8])
    seen = reference.in_view(sensor, *reference.measured(sensor, states)[:2])
    ratio = np.exp(sensor.log_likelihood(states, looked))
    assert seen.sum() > 4
    np.testing.assert_allclose(ratio[seen], 1, atol=5e-3)
    assert np.all(ratio[~seen] == 1)


def test_a_target_that_is_never_detected_is_told_by_nothing():
    blind = SENSORS["clutter"].replace(detection_probability=0.0)
    looked = blind.simulate(np.zeros((0, 4)), np.random.default_rng(3))
    assert len(looked.range_m) > 0
    assert np.all(blind.log_likelihood(states_near(blind), looked) == 0)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "name", longer(["wide errors", "sector", "nearly all round"], "wide errors", "nearly all round")
)
def test_ratios_have_expectation_one(name):
    sensor, rng, runs = SENSORS[name].replace(doppler_probability=0.7), np.random.default_rng(4), 4000
    place = np.array([[14.0, 3.0, 34.0, -8.0], [-12.0, 0.0, 395.0, 3.0]])
    assert reference.in_view(sensor, *reference.measured(sensor, place)[:2]).all()
    nothing = np.exp([sensor.log_likelihood(place, sensor.simulate(place[:0], rng)) for _ in range(runs)])
    assert np.all(abs(nothing.mean(axis=0) - 1) < 4.5 * nothing.std(axis=0) / np.sqrt(runs))
    assert np.all(nothing.std(axis=0) / np.sqrt(runs) < 0.1)
    # with the target the inverse has: it is bounded by 1 / (1 - P_D)
    for k in range(len(place)):
        target = place[k : k + 1]
        inverse = np.exp([-sensor.log_likelihood(target, sensor.simulate(target, rng))[0] for _ in range(runs)])
        assert abs(inverse.mean() - 1) < 4.5 * inverse.std() / np.sqrt(runs)
        assert inverse.std() > 0.5


def test_an_empty_scan_says_that_a_target_in_view_was_missed():
    sensor = RadarSensor(detection_probability=0.9, max_range_m=100.0)
    states = np.array([[0.0, 0, 50.0, 0], [0.0, 0, 150.0, 0]])
    np.testing.assert_allclose(sensor.log_likelihood(states, scan()), [np.log(0.1), 0])
    np.testing.assert_array_equal(
        sensor.replace(detection_probability=1.0).log_likelihood(states, scan()), [-np.inf, 0]
    )
    np.testing.assert_array_equal(sensor.log_likelihood(states, RadarPlot(0, 101.0, 0.0)), [np.log(1 - 0.9), 0])
    seen = sensor.log_likelihood(states, RadarPlot(0, 60.0, 0.0))
    assert np.isfinite(seen[0])
    assert seen[1] == -np.inf


def test_improbable_plots_neither_overflow_nor_vanish():
    sensor = RadarSensor(**CLUTTERED | {"max_range_m": 1e6, "detection_probability": 1.0})
    states = np.array([[0.0, 0, 5e5, 0], [0.0, 0, 50.0, 0]])
    looked = scan((0, 1e5, 2.0, 3.0), (0, 1.001e5, 2.0, 3.0))
    value = sensor.log_likelihood(states, looked)
    assert np.all(value < -1e6)
    np.testing.assert_allclose(value, reference.log_ratio(sensor, states, looked), rtol=1e-9)


def test_a_plot_at_another_time_belongs_to_where_the_target_is_then():
    sensor = RadarSensor()
    state, then = np.array([[100.0, 20.0, 3_000.0, -10.0]]), np.array([[140.0, 20.0, 2_980.0, -10.0]])
    plot = (52.0, 2_985.0, 0.047, -9.0)
    moved = sensor.log_likelihood(state, scan(plot, time_s=50.0))
    np.testing.assert_allclose(moved, sensor.log_likelihood(then, RadarPlot(*plot)), rtol=1e-9)
    assert abs(moved - sensor.log_likelihood(state, RadarPlot(*plot))) > 10


def test_simulated_plots_have_the_stated_errors_and_shares():
    sensor = RadarSensor(detection_probability=0.7, doppler_probability=0.4, x_m=1_000.0)
    target, rng, n = np.array([[1_000.0, 3.0, 9_000.0, -5.0]]), np.random.default_rng(5), 4000
    looks = [sensor.simulate(target, rng, time_s=8.0) for _ in range(n)]
    counts = np.array([len(looked.range_m) for looked in looks])
    assert counts.max() == 1
    assert abs(counts.mean() - 0.7) < 5 * np.sqrt(0.21 / n)
    ranges, bearings, dopplers = (np.concatenate(part) for part in list(zip(*looks, strict=True))[2:5])
    assert all(looked.time_s == 8 and np.all(looked.times_s == 8) for looked in looks)
    told = np.isfinite(dopplers)
    assert abs(told.mean() - 0.4) < 5 * np.sqrt(0.24 / len(told))
    assert bearings.min() >= 0
    assert bearings.max() < 2 * np.pi
    off = (bearings + np.pi) % (2 * np.pi) - np.pi
    for values, mean, sd in ((ranges, 9_000, 10), (off, 0, 1e-3), (dopplers[told], -5, 3)):
        assert kstest(values, norm(mean, sd).cdf).pvalue > 1e-4


def test_simulated_false_alarms_are_poisson_and_uniform_over_the_field():
    sensor, rng, n = SENSORS["sector"], np.random.default_rng(6), 1500
    unseen = np.array([[0.0, 0, 500.0, 0], [0.0, 0, -100.0, 0], [0.0, 0, 20.0, 0]])
    looks = [sensor.simulate(unseen, rng) for _ in range(n)]
    counts = np.array([len(looked.range_m) for looked in looks])
    assert abs(counts.mean() - 6) < 5 * np.sqrt(6 / n)
    assert abs(counts.var() - 6) < 5 * np.sqrt(78 / n)
    ranges, bearings, dopplers = (np.concatenate(part) for part in list(zip(*looks, strict=True))[2:5])
    off = (bearings - np.deg2rad(300)) % (2 * np.pi) / np.deg2rad(105)
    for values in ((ranges - 30) / 370, off, (dopplers + 20) / 40):
        assert kstest(values, "uniform").pvalue > 1e-4
    assert all(np.all(np.diff(looked.bearing_rad) >= 0) for looked in looks)
    again = [sensor.simulate(unseen, g) for g in map(np.random.default_rng, (7, 7))]
    np.testing.assert_equal(again[0], again[1])


def test_false_alarms_have_their_shares_of_each_band_and_are_uniform_in_it():
    sensor, rng, n = SENSORS["bands"], np.random.default_rng(26), 1500
    looks = [sensor.simulate(np.zeros((0, 4)), rng) for _ in range(n)]
    ranges = np.concatenate([looked.range_m for looked in looks])
    edges = 30 + 370 * np.array([0, 1, 3, 7]) / 7
    counts = np.histogram(ranges, edges)[0]
    assert counts.sum() == len(ranges)
    for count, share, low, high in zip(counts, (0.5, 0.2, 0.3), edges, edges[1:], strict=False):
        assert abs(count - share * 6 * n) < 5 * np.sqrt(share * 6 * n)
        inside = ranges[(ranges >= low) & (ranges < high)]
        assert kstest((inside - low) / (high - low), "uniform").pvalue > 1e-4
    # the density integrates to their number
    at = np.linspace(30.2, 399.8, 4001)
    log_clutter = sensor.log_clutter(scan(*((0.0, distance, 0.0, np.nan) for distance in at)))
    assert np.exp(log_clutter).mean() * 370 * np.deg2rad(105) == pytest.approx(6.0, rel=2e-3)


def test_false_alarms_have_their_shares_of_each_sector_and_are_uniform_in_it():
    sensor, rng, n = SENSORS["upwind"], np.random.default_rng(27), 1500
    bearings = np.concatenate([sensor.simulate(np.zeros((0, 4)), rng).bearing_rad for _ in range(n)])
    turned = np.rad2deg(bearings) - 300.0
    turned %= 360.0
    for number, share in enumerate((0.7, 0.1, 0.2)):
        inside = turned[(turned >= 35 * number) & (turned < 35 * (number + 1))]
        assert abs(len(inside) - share * 6 * n) < 5 * np.sqrt(share * 6 * n)
        assert kstest(inside / 35 - number, "uniform").pvalue > 1e-4
    # the density integrates to their number
    at = np.deg2rad(300 + (np.arange(4200) + 0.5) / 40) % (2 * np.pi)
    log_clutter = sensor.log_clutter(scan(*((0.0, 200.0, bearing, np.nan) for bearing in at)))
    assert np.exp(log_clutter).mean() * 370 * np.deg2rad(105) == pytest.approx(6.0, rel=2e-3)


def test_patches_add_their_false_alarms_where_they_are():
    """Uniform over a part of the ranges and bearings, which may pass north; what is out of view is not seen."""
    patch, n = (50.0, 200.0, 350.0, 10.0, 3.0), 1500
    law = RadarSensor(**CLUTTERED, **SECTOR)
    sensor, rng = law.replace(false_alarm_patches=(patch, (10.0, 400.0, 90.0, 120.0, 50.0))), np.random.default_rng(28)
    looks = [sensor.simulate(np.zeros((0, 4)), rng) for _ in range(n)]
    ranges, turned = (
        np.concatenate(part) for part in ([one.range_m for one in looks], [one.bearing_rad for one in looks])
    )
    turned = (np.rad2deg(turned) - 350.0) % 360.0
    inside = (ranges >= 50) & (ranges < 200) & (turned < 20)
    wanted = 3.0 + 6.0 * 150 / 370 * 20 / 105
    assert abs(inside.sum() - wanted * n) < 5 * np.sqrt(wanted * n)
    assert abs(len(ranges) - 9.0 * n) < 5 * np.sqrt(9.0 * n)
    for values in ((ranges[inside] - 50) / 150, turned[inside] / 20):
        assert kstest(values, "uniform").pvalue > 1e-4
    within, beside = (scan((0.0, 100.0, bearing, np.nan)) for bearing in (0.1, 0.3))
    assert np.exp(sensor.log_clutter(within) - law.log_clutter(within)) == pytest.approx(
        wanted / (wanted - 3.0), rel=1e-12
    )
    np.testing.assert_allclose(sensor.log_clutter(beside), law.log_clutter(beside), rtol=1e-14)


def test_states_drawn_from_a_plot_have_its_errors():
    sensor, n = RadarSensor(x_m=500.0, bearing_sd_mrad=200.0), 20_000
    looked = scan((3.0, 2_000.0, 6.2, -6.0), time_s=5.0)
    states = ScanPrior(sensor, looked, 4.0).sample(n, np.random.default_rng(8))
    distance, bearing, rate = reference.measured(sensor, states, later=-2.0)
    x, y = states[:, 0] - 2 * states[:, 1] - 500, states[:, 2] - 2 * states[:, 3]
    across = (states[:, 1] * y - states[:, 3] * x) / distance
    off = (bearing - 6.2 + np.pi) % (2 * np.pi) - np.pi
    for values, mean, sd in ((distance, 2_000, 10), (off, 0, 0.2), (rate, -6, 3), (across, 0, 4)):
        assert kstest(values, norm(mean, sd).cdf).pvalue > 1e-4
    unmeasured = looked._replace(doppler_mps=np.array([np.nan]))
    silent = ScanPrior(sensor, unmeasured, 4.0).sample(n, np.random.default_rng(9))
    assert kstest(reference.measured(sensor, silent, later=-2.0)[2], norm(0, 4).cdf).pvalue > 1e-4
    two = scan((0, 100.0, 0.1, 0.0), (0, 900.0, 0.1, 0.0))
    near = ScanPrior(RadarSensor(), two).sample(n, np.random.default_rng(10))[:, 2] < 500
    assert abs(near.mean() - 0.5) < 5 * 0.5 / np.sqrt(n)
    assert isinstance(ScanPrior(sensor, looked), Prior)
    born = RadarSensor().draw_births(two, np.array([1, 0]), n, 4.0, np.random.default_rng(8))
    assert born.states.shape == (2, n, 4)
    for drawn, range_m in zip(born.states, (900, 100), strict=True):
        assert kstest(reference.measured(RadarSensor(), drawn)[0], norm(range_m, 10).cdf).pvalue > 1e-4


def test_new_targets_are_as_uniform_as_false_alarms_and_none_out_of_view():
    sensor, rng = SENSORS["sector"], np.random.default_rng(3)
    looked = scan((0, 5_000.0, 5.9, 0.0), (0, 200.0, 5.9, 2.0), (0, 200.0, 3.0, 2.0))
    born = sensor.draw_births(looked, np.arange(3), 40, 4.0, rng)
    np.testing.assert_allclose(born.log_density, sensor.log_uniform(looked))
    np.testing.assert_array_equal(np.isfinite(born.log_density), [False, True, False])
    assert sensor.in_view(born.states[1]).all()
    unbounded = RadarSensor().draw_births(looked, np.arange(3), 40, 4.0, rng)
    assert np.isfinite(unbounded.log_density).all()


@pytest.mark.parametrize(("km", "published"), [(1, 0.92), (2, 1.70), (5, 3.73), (10, 6.62), (20, 11.6)])
def test_a_particle_filter_reaches_the_kalman_deviation(km, published):
    """Across the line of sight the filter is linear: T = 1 s, q = (5/3)^2, sigma_b R; x and its filtered deviation."""
    motion, sensor = ConstantVelocity(q=(5 / 3) ** 2), RadarSensor()
    F, Q, H = motion.F(1.0)[:2, :2], motion.Q(1.0)[:2, :2], np.array([[1.0, 0.0]])
    P = solve_discrete_are(F.T, H.T, Q, np.array([[km**2]]))
    exact = np.sqrt(P[0, 0] * km**2 / (P[0, 0] + km**2))
    assert exact == pytest.approx(published, rel=0.006)
    rng, truth = np.random.default_rng(km), np.array([[0.0, 0.0, 1_000.0 * km, 0.0]])
    deviations = []
    for _ in range(3):
        looks = [sensor.simulate(truth, rng, time_s=k) for k in range(40)]
        model = ParticleFilter(motion=motion, sensor=sensor, prior=ScanPrior(sensor, looks[0]), particles=6000)
        deviations += [np.sqrt(state.covariance[0, 0]) for state in list(run(model, looks[1:], rng, start_s=0.0))[19:]]
    assert np.mean(deviations) == pytest.approx(exact, rel=0.02)


def test_a_particle_filter_follows_the_converted_measurement_kalman_filter():
    motion, sensor, rng = ConstantVelocity(q=(5 / 3) ** 2), RadarSensor(), np.random.default_rng(15)
    truth = np.array([[-37.0, 0.0, 5_000.0 + 7.0 * k, 7.0] for k in range(60)])[:, None]
    looks = [sensor.simulate(state, rng, time_s=k) for k, state in enumerate(truth)]
    model = ParticleFilter(motion=motion, sensor=sensor, prior=ScanPrior(sensor, looks[0]), particles=6000)
    states = list(run(model, looks[1:], rng, start_s=0.0))
    m, P = None, None
    differences = []
    for k, looked in enumerate(looks):
        (r,), (b,), (d,) = looked.range_m, looked.bearing_rad, looked.doppler_mps
        u, w = np.array([np.sin(b), np.cos(b)]), np.array([np.cos(b), -np.sin(b)])
        turn = np.array([[u[0], 0, u[1], 0], [w[0], 0, w[1], 0], [0, u[0], 0, u[1]]])
        if m is None:
            m = np.array([r * u[0], d * u[0], r * u[1], d * u[1]])
            P = np.zeros((4, 4))
            P[np.ix_([0, 2], [0, 2])] = 100 * np.outer(u, u) + (r * 1e-3) ** 2 * np.outer(w, w)
            P[np.ix_([1, 3], [1, 3])] = 9 * np.outer(u, u) + 25 * np.outer(w, w)
            continue
        m, P = motion.F(1.0) @ m, motion.F(1.0) @ P @ motion.F(1.0).T + motion.Q(1.0)
        S = turn @ P @ turn.T + np.diag([100, (r * 1e-3) ** 2, 9])
        K = P @ turn.T @ np.linalg.inv(S)
        m, P = m + K @ (np.array([r, 0, d]) - turn @ m), P - K @ S @ K.T
        differences.append((states[k - 1].mean - m) / np.sqrt(np.diag(P)))
        np.testing.assert_allclose(np.sqrt(np.diag(states[k - 1].covariance)), np.sqrt(np.diag(P)), rtol=0.15)
    assert np.sqrt(np.mean(np.square(differences))) < 0.06
    assert abs(np.mean(differences)) < 0.02


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"false_alarms": 3.0}, "max_range_m: is not given"),
        ({"false_alarm_shares": (0.5, -1.0)}, "false_alarm_shares.1: must be greater than 0"),
        ({"false_alarm_shares": ()}, "at least 1 item"),
        ({"false_alarm_sectors": (0.0, 1.0)}, "false_alarm_sectors.0: must be greater than 0"),
        ({**CLUTTERED, "false_alarm_patches": ((50.0, 50.0, 0.0, 9.0, 1.0),)}, "a greater furthest one"),
        (
            {**CLUTTERED, "false_alarm_patches": ((20.0, 50.0, 0.0, 9.0, 0.0),)},
            "false_alarm_patches.0: .* a number above zero",
        ),
        (
            {**CLUTTERED, "false_alarm_patches": ((20.0, 50.0, 0.0, float("nan"), 1.0),)},
            "false_alarm_patches.0.3: must be a finite number",
        ),
        ({"false_alarm_patches": ((20.0, 50.0, 0.0, 9.0, 1.0),)}, "beside false_alarms above zero"),
        ({"min_range_m": 100.0, "max_range_m": 105.0}, "narrower than range_sd_m=10"),
        ({"from_bearing_deg": 90.0, "to_bearing_deg": 90.0}, "wider one"),
        ({"max_doppler_mps": 15.0}, "too narrow"),
        ({"bearing_sd_mrad": 600.0}, "bearing_sd_mrad"),
        ({"detection_probability": 1.2}, "detection_probability"),
        ({"range_sd": 3.0}, "did you mean 'range_sd_m'"),
    ],
)
def test_bad_parameters_are_refused(fields, said):
    with pytest.raises(ParameterError, match=said):
        RadarSensor(**fields)


@pytest.mark.parametrize(
    ("measurement", "said"),
    [
        (scan((0, 50.0, 7.0, 0.0)), "plot 0: .* bearing 7 rad"),
        (scan((0, 50.0, 1.0, 0.0), (0, -1.0, 1.0, 0.0)), "plot 1: .* range -1 m"),
        (scan((0, 50.0, 1.0, np.inf)), "Doppler inf m/s"),
        (scan((np.nan, 50.0, 1.0, 0.0)), "time nan s"),
        (scan(time_s=np.nan), "finite time"),
        (scan((0, 50.0, 1.0, 0.0))._replace(range_m=np.zeros(2)), "a number for each plot"),
        (scan((0, 50.0, 1.0, 0.0), (0, 60.0, 1.0, 0.0)), "give false_alarms"),
        (np.zeros(3), "give a RadarScan or a RadarPlot"),
    ],
)
def test_bad_measurements_are_refused(measurement, said):
    assert isinstance(RadarSensor(), Sensor)
    with pytest.raises(DataError, match=said):
        RadarSensor().log_likelihood(np.zeros((1, 4)), measurement)


def test_bad_states_and_missing_numbers_are_refused():
    rng, state = np.random.default_rng(16), np.array([[0.0, 0.0, 50.0, 0.0]])
    plot = RadarPlot(0.0, 50.0, 1.0, 2.0)
    with pytest.raises(DataError, match="not finite"):
        RadarSensor().log_likelihood(np.array([[0.0, 0.0, np.nan, 0.0]]), plot)
    with pytest.raises(DataError, match="beginning x, vx, y, vy"):
        RadarSensor().simulate(np.zeros((2, 2)), rng)
    untold = RadarSensor(**CLUTTERED | {"max_doppler_mps": None})
    with pytest.raises(ParameterError, match=r"simulation: .* max_doppler_mps"):
        untold.simulate(state, rng)
    with pytest.raises(ParameterError, match=r"scan at 0 s: .* max_doppler_mps"):
        untold.log_likelihood(state, plot)
    assert np.isfinite(untold.log_likelihood(state, plot._replace(doppler_mps=np.nan))).all()
    assert np.isnan(untold.replace(doppler_probability=0.0).simulate(state, rng).doppler_mps).all()
    with pytest.raises(DataError, match="no plot in the field"):
        ScanPrior(untold, scan((0, 500.0, 1.0, 0.0))).sample(5, rng)


def test_each_plot_is_seen_at_its_own_time_whatever_the_others():
    """A plot at the scan's own time that comes after one at another: the states are taken back to the scan's time."""
    sensor = RadarSensor(**CLUTTERED)
    states = np.random.default_rng(17).normal([30.0, 10.0, 50.0, -8.0], 3.0, (300, 4))
    looked = scan((0, 60.0, 0.5, 0.0), (1, 60.0, 0.6, 1.0), (2, 55.0, 0.7, np.nan), (1, 50.0, 0.6, 1.0), time_s=1.0)
    np.testing.assert_allclose(
        sensor.log_likelihood(states, looked), reference.log_ratio(sensor, states, looked), atol=1e-9
    )


# ------------------------------------------------------------------------------------------------- on a moving ship


def test_a_radar_that_moves_sees_what_a_resting_one_sees_of_relative_states():
    rng = np.random.default_rng(11)
    sensor = RadarSensor(x_m=40.0, y_m=-20.0, max_range_m=3000.0, false_alarms=3.0, max_doppler_mps=40.0)
    own = OwnShip(500.0, 6.0, -300.0, 8.0)
    relative = np.column_stack([rng.normal(0, 800, 50), rng.normal(0, 5, 50), rng.normal(0, 800, 50), np.ones(50)])
    there = sensor.simulate(relative, rng)
    times_s = np.linspace(-1.0, 1.0, there.detections)  # plots of a turn have their own times
    there = there._replace(times_s=times_s)
    here, moved = there._replace(own=own), relative + np.array(own)
    which = np.arange(there.detections)
    for ask in (sensor.log_likelihood, sensor.detection_probabilities, sensor.log_densities):
        np.testing.assert_allclose(ask(moved, here), ask(relative, there), rtol=1e-9, atol=1e-9)
    for seed in range(3):
        born, before = (
            sensor.draw_births(scan, which, 20, 5.0, np.random.default_rng(seed)).states for scan in (here, there)
        )
        np.testing.assert_allclose(born, before + np.array(own), rtol=1e-9, atol=1e-9)
    places = sensor.places(here)[0] - sensor.places(there)[0]
    np.testing.assert_allclose(places, np.array([500, -300]) + times_s[:, None] * np.array([6, 8]), atol=1e-9)
    covariances = np.tile(np.diag([400.0, 4, 400, 4]), (50, 1, 1))
    near = [sensor.gate(states, covariances, scan, 3.0) for states, scan in ((moved, here), (relative, there))]
    np.testing.assert_array_equal(*near)
    one = which[:1]
    for ask in (sensor.residual, sensor.jacobian):
        found = ask(moved[0], here.select_detections(one))
        np.testing.assert_allclose(found, ask(relative[0], there.select_detections(one)), rtol=1e-9, atol=1e-9)


def test_a_radar_whose_own_place_is_no_number_is_refused():
    looked = RadarSensor().simulate(np.zeros((0, 4)), np.random.default_rng(0))._replace(own=OwnShip(math.nan))
    with pytest.raises(DataError, match="place of its radar"):
        RadarSensor().judged(looked)
