import numpy as np
import pytest
from scipy import ndimage

from elusive.errors import DataError, ParameterError
from elusive.filters import BernoulliFilter, MeasurementBirth
from elusive.filters.particle.mode import densest
from elusive.motion import ConstantVelocity
from elusive.sensors import _clutter_kernels
from elusive.sensors.clutter import ClutterSensor
from elusive.sensors.noise_tail import NoiseTail, fit_tail

TAIL = NoiseTail(0.0, 1.0, 2.58, 0.3, 0.005)
SENSOR = ClutterSensor(rows=40, columns=50)


def test_ratio_never_falls_and_levels_off():
    z = np.linspace(-8, 80, 500)
    ratio = SENSOR.response_ratio(z, TAIL)
    assert (np.diff(ratio) >= 0).all()
    assert ratio[0] == pytest.approx(np.log(SENSOR.missed))
    assert ratio[-1] < -np.log(SENSOR.lookalike) + 4
    assert SENSOR.response_ratio(np.array([3.0]), TAIL)[0] < 0 < SENSOR.response_ratio(np.array([7.0]), TAIL)[0]


def test_a_heavier_tail_asks_for_more():
    heavy = TAIL._replace(scale=1.5)
    assert SENSOR.response_ratio(np.array([7.0]), heavy)[0] < SENSOR.response_ratio(np.array([7.0]), TAIL)[0] - 0.5


def test_the_tail_is_recovered_from_draws():
    rng = np.random.default_rng(0)
    draws = rng.standard_normal(200_000)
    beyond = draws > 2.5758
    draws[beyond] = 2.5758 + rng.exponential(0.8, beyond.sum())
    tail = fit_tail(draws)
    assert tail.median == pytest.approx(0.0, abs=0.01)
    assert tail.deviation == pytest.approx(1.0, abs=0.01)
    assert tail.knee == pytest.approx(2.576, abs=0.06)
    assert tail.scale == pytest.approx(0.8, rel=0.1)
    with pytest.raises(DataError, match="at least 1000"):
        fit_tail(draws[:500])


def one_point(z=20.0):
    response = np.random.default_rng(1).standard_normal((40, 50)) * 0.5
    y, x = np.mgrid[:40, :50]
    return response + z * np.exp(-((x - 30) ** 2 + (y - 12) ** 2) / 4)


def test_evidence_peaks_at_the_point_and_reads_as_the_map():
    evidence = SENSOR.evidence(one_point(), TAIL)
    assert np.unravel_index(evidence.argmax(), evidence.shape) == (12, 30)
    assert evidence[12, 33] < evidence[12, 31] < evidence[12, 30]
    states = np.array([[30.0, 0, 12.0, 0], [30.5, 0, 12.0, 0], [-3.0, 0, 12.0, 0], [30.0, 0, 39.2, 0]])
    read = SENSOR.log_likelihood(states, evidence)
    expected = [evidence[12, 30], evidence[12, 30:32].mean(), np.log(SENSOR.missed), np.log(SENSOR.missed)]
    np.testing.assert_allclose(read, expected)
    np.testing.assert_array_equal(SENSOR.birth_map(evidence), 2 * evidence)


def test_what_rests_in_the_scene_or_is_not_seen_counts_as_a_miss():
    response = one_point()
    floor = np.log(SENSOR.missed)
    assert SENSOR.evidence(response, TAIL, response)[12, 30] == pytest.approx(floor)
    moved = np.roll(response, 4, axis=1)
    assert SENSOR.evidence(response, TAIL, moved)[12, 30] > 5
    response[12, 30] = np.nan
    assert SENSOR.evidence(response, TAIL)[12, 30] == pytest.approx(floor)


def test_refuses_other_shapes_and_senseless_bounds():
    with pytest.raises(DataError, match="earlier: shape"):
        SENSOR.evidence(one_point(), TAIL, np.zeros((3, 3)))
    with pytest.raises(DataError, match="measurement: shape"):
        SENSOR.log_likelihood(np.zeros((1, 4)), np.zeros((3, 3)))
    with pytest.raises(ParameterError, match="lowest_snr"):
        ClutterSensor(rows=4, columns=4, lowest_snr=50.0)


@pytest.mark.parametrize("z", [0.0, 12.0])
def test_the_filter_finds_a_mover_and_nothing_else(z):
    model = BernoulliFilter(
        motion=ConstantVelocity(q=0.0025), sensor=SENSOR, birth=MeasurementBirth(max_speed=2.0), particles=1500
    )
    rng = np.random.default_rng(4)
    state = model.init(rng, 0.0)
    y, x = np.mgrid[:40, :50]
    existence = []
    for k in range(20):
        response = rng.standard_normal((40, 50)) + z * np.exp(-((x - 8 - 1.3 * k) ** 2 + (y - 20) ** 2) / 4)
        state = model.step(state, state.time_s + 1, SENSOR.evidence(response, fit_tail(response)), rng)
        existence.append(state.existence)
    if z:
        assert min(existence[6:]) > 0.9
        place = densest(state.particles, state.weights)
        assert np.hypot(place[0] - 8 - 1.3 * 19, place[2] - 20) < 1.5
    else:
        assert max(existence) < 0.3


def test_densest_takes_a_clump_not_the_middle():
    rng = np.random.default_rng(5)
    states = np.zeros((1000, 4))
    states[:, 0] = np.where(np.arange(1000) < 600, 10.0, 60.0) + rng.standard_normal(1000)
    states[:, 2] = 20 + rng.standard_normal(1000)
    found = densest(states, np.full(1000, 1e-3))
    assert np.hypot(found[0] - 10, found[2] - 20) < 0.5
    with pytest.raises(ParameterError, match="radius_px"):
        densest(states, np.full(1000, 1e-3), 0.0)


def test_a_map_is_read_between_its_pixels_as_scipy_reads_it():
    rng = np.random.default_rng(8)
    image = rng.normal(size=(7, 9))
    states = np.zeros((300, 4))
    states[:, 0], states[:, 2] = rng.uniform(-1, 9, 300), rng.uniform(-1, 7, 300)
    expected = ndimage.map_coordinates(image, [states[:, 2], states[:, 0]], order=1, mode="nearest")
    inside = (states[:, 0] >= 0) & (states[:, 0] <= 8) & (states[:, 2] >= 0) & (states[:, 2] <= 6)
    read = _clutter_kernels.sample_places(image, states[:, [0, 2]])
    np.testing.assert_allclose(read[inside], expected[inside], atol=1e-12)
