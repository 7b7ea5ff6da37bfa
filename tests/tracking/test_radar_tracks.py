"""Tracks of several ships: the recursion against its formulas, and what it makes of clutter, misses and neighbours."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import expit, logit
from scipy.stats import norm

from elusive.errors import DataError, ParameterError
from elusive.filters.particle.sir import ParticleFilter
from elusive.filters.priors import GaussianPrior
from elusive.motion import ConstantVelocity
from elusive.sensors.field_of_view import FieldOfView
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarPlot, scan_of
from elusive.tracking.radar_claims import claims, densities, gated
from elusive.tracking.radar_tracks import RadarTracker
from tests.reference import radar as reference
from tests.reference import radar_claims as reference_claims

NOWHERE = GaussianPrior(mean=(0, 0, 0, 0), covariance=tuple(map(tuple, np.eye(4))))
ALONE = RadarSensor()  # the thesis's radar: every scan sees the ship, and nothing else
CLUTTER = RadarSensor(detection_probability=0.9, false_alarms=3.0, max_range_m=8000.0, max_doppler_mps=40.0)


class Shore:
    """Water east of x = 0, the coast's error Gaussian."""

    floor = 1e-6

    def __init__(self, sigma_m):
        self.sigma_m = sigma_m

    def log_probability(self, states):
        return np.log(self.floor + (1 - self.floor) * norm.cdf(states[:, 0] / self.sigma_m))


def follower(sensor, knowledge=None, q=0.4, particles=1000):
    return ParticleFilter(
        motion=ConstantVelocity(q=q),
        sensor=sensor,
        prior=NOWHERE,
        knowledge=() if knowledge is None else (knowledge,),
        particles=particles,
    )


def sail(ships, sensor, scans, seed, interval_s=1.0):
    """Scans of ships that sail straight, and where each was."""
    rng, states = np.random.default_rng(seed), np.array(ships, dtype=float).reshape(-1, 4)
    looks, places = [], []
    for number in range(scans):
        looks.append(sensor.simulate(states, rng, time_s=number * interval_s))
        places.append(states[:, [0, 2]].copy())
        states = states + interval_s * states[:, [1, 1, 3, 3]] * [1, 0, 1, 0]
    return looks, np.array(places)


def track(looks, flt, tracker=None, seed=0):
    """Tracks after each scan."""
    tracker, rng = tracker or RadarTracker(), np.random.default_rng(seed)
    tracks, found = tracker.init(flt), []
    for look in looks:
        tracks = tracker.step(tracks, look.time_s, look, rng)
        found.append(tracks)
    return found


def confirmed(found):
    """Scan and place of each track where it is confirmed."""
    paths = {}
    for number, tracks in enumerate(found):
        for one in tracks.targets:
            if one.life.status == "confirmed":
                paths.setdefault(one.life.track, []).append((number, *one.state.mean[[0, 2]]))
    return {track: np.array(path) for track, path in paths.items()}


def test_one_plot_a_scan_is_the_particle_filter_itself():
    looks, _ = sail([[4000, 3, 5000, -6]], ALONE, 30, seed=1)
    flt, tracker, rng = follower(ALONE, Shore(20.0)), RadarTracker(), np.random.default_rng(2)
    state = tracker.step(tracker.init(flt), looks[0].time_s, looks[0], rng).targets[0].state
    for look, tracks in zip(looks[1:], track(looks, flt, tracker, seed=2)[1:], strict=True):
        state = flt.step(state, look.time_s, look, rng)
        (one,) = tracks.targets
        np.testing.assert_array_equal(one.state.particles, state.particles)
        np.testing.assert_array_equal(one.state.weights, state.weights)
        assert one.existence == pytest.approx(1.0)
        assert one.life.track == 1


@pytest.mark.parametrize("knowledge", [None, Shore(15.0)])
def test_existence_follows_its_formula(knowledge):
    """Odds of existence: the survivors', times the scan's ratio, averaged over the particles that the map allows."""
    looks, _ = sail([[25, 1, 5000, -6]], CLUTTER, 8, seed=3)
    flt = follower(CLUTTER, knowledge, q=0.0)  # without process noise the prediction can be repeated
    tracker = RadarTracker(mean_life_s=50.0, forget_below=1e-9, gate=50.0, merge_within=0.0, births_per_s=1e-3)
    before = None
    checked = 0
    for tracks in track(looks, flt.replace(resample_below=0.0), tracker):
        for one in tracks.targets:
            if before is None or one.before is one.state:
                continue
            (old,) = (other for other in before.targets if other.state is one.before)
            particles = old.state.particles.copy()
            interval_s = tracks.time_s - before.time_s
            particles[:, [0, 2]] += interval_s * particles[:, [1, 3]]
            seen = reference.log_ratio(CLUTTER, particles, one.scan)
            chart = np.ones(len(particles)) if knowledge is None else np.exp(knowledge.log_probability(particles))
            weights = old.state.weights * chart
            ratio = float(weights @ np.exp(seen) / weights.sum())
            expected = expit(logit(math.exp(-interval_s / 50.0) * old.existence) + math.log(ratio))
            if not one.state.forbidden:
                assert one.existence == pytest.approx(min(expected, 1 - 1e-12), rel=1e-6)
                checked += 1
        before = tracks
    assert checked > 10


def test_a_beginning_is_as_likely_as_births_false_alarms_and_water_say():
    shore, tracker = Shore(100.0), RadarTracker(births_per_s=0.2)
    places = [(-60.0, 4000.0), (20.0, 5000.0), (900.0, 6000.0)]
    scan = scan_of(0.0, [RadarPlot(0.0, math.hypot(*place), math.atan2(*place) % math.tau, 1.0) for place in places])
    (tracks,) = track([scan], follower(CLUTTER, shore, particles=20_000), tracker)
    assert len(tracks.targets) == 3
    _, errors = CLUTTER.places(scan)
    for one, (x, _), error in zip(tracks.targets, places, errors, strict=True):
        water = norm.cdf(x / math.hypot(shore.sigma_m, math.sqrt(error[0, 0])))
        assert one.existence == pytest.approx(0.2 * water / (0.2 * water + 3.0), rel=0.02)


def test_on_land_no_track_begins():
    looks, _ = sail([[-200, 0, 5000, -6]], ALONE, 10, seed=4)
    assert all(not tracks.targets for tracks in track(looks, follower(ALONE, Shore(10.0))))
    assert confirmed(track(looks, follower(ALONE, Shore(200.0))))


def test_a_ship_that_goes_far_inland_is_followed_and_it_is_said():
    looks, places = sail([[150, -8, 5000, 0]], ALONE, 60, seed=5)
    found = track(looks, follower(ALONE, Shore(5.0), q=2.8, particles=2000))
    (path,) = confirmed(found).values()
    assert np.abs(path[-10:, 1:] - places[-10:, 0]).max() < 40
    left_out = [any(one.state.forbidden for one in tracks.targets) for tracks in found]
    assert not any(left_out[:18])  # on water
    assert all(left_out[-20:])  # 170 m inland and more, 34 deviations


def test_claims_are_those_of_the_plain_formulas():
    rng = np.random.default_rng(6)
    ships = [[3000, 0, 4000, 7], [3030, 0, 4010, 7], [-2000, 3, 5000, 0]]
    looks, _ = sail(ships, CLUTTER, 2, seed=7)
    flt = follower(CLUTTER, particles=300)
    states = [flt.replace(prior=_Cloud(np.array(ship))).init(rng) for ship in ships]
    gates = gated(states, looks[1], CLUTTER, 6.0)
    assert gates.any(axis=1).all()
    ratio = densities(states, looks[1], gates, CLUTTER, CLUTTER.log_clutter(looks[1]))
    for row, state in enumerate(states):
        for plot in range(gates.shape[1]):
            known = reference_claims.density(CLUTTER, state.particles, state.weights, looks[1], plot)
            if gates[row, plot]:
                assert ratio[row, plot] == pytest.approx(known, rel=1e-9)
            else:
                assert ratio[row, plot] == 0
                assert known < 1e-6  # nothing is lost beyond the gate
    existence = np.array([0.99, 0.4, 1.0])
    np.testing.assert_allclose(claims(ratio, existence, 0.9), reference_claims.claims(ratio, existence, 0.9), rtol=1e-9)


class _Cloud(SimpleNamespace):
    """States round one."""

    def __init__(self, centre):
        super().__init__(centre=centre)

    def sample(self, n, rng):
        return self.centre + rng.normal(size=(n, 4)) * [15, 2, 15, 2]


def test_what_others_claim_counts_as_clutter_there():
    target, rng = np.array([[3000.0, 0.0, 4000.0, 7.0]]), np.random.default_rng(8)
    scan = CLUTTER.replace(detection_probability=1.0, false_alarms=0.0).simulate(target, rng)
    states = target + rng.normal(size=(500, 4)) * [20, 3, 20, 3]
    for claimed in (0.0, 0.7, 1e6):
        found = CLUTTER.log_likelihood(states, scan._replace(claimed=np.full(1, claimed)))
        likely = np.exp(CLUTTER.log_likelihood(states, scan)) - 0.1
        np.testing.assert_allclose(np.exp(found), 0.1 + likely / (1 + claimed), rtol=1e-9)
    with pytest.raises(DataError, match="claims from 0"):
        CLUTTER.log_likelihood(states, scan._replace(claimed=np.full(1, -0.1)))


def test_ships_in_clutter_are_each_found_once_and_nothing_else():
    rng = np.random.default_rng(9)
    ships = np.column_stack(
        [rng.uniform(-5000, 5000, 8), rng.normal(0, 5, 8), rng.uniform(-5000, 5000, 8), rng.normal(0, 5, 8)]
    )
    looks, places = sail(ships, CLUTTER.replace(false_alarms=10.0), 40, seed=10)
    paths = confirmed(track(looks, follower(CLUTTER.replace(false_alarms=10.0))))
    assert len(paths) == 8
    met = set()
    for path in paths.values():
        off = np.hypot(*(path[:, None, 1:] - places[path[:, 0].astype(int)]).transpose(2, 0, 1))
        ship = int(off.mean(axis=0).argmin())
        met.add(ship)
        assert np.sqrt((off[:, ship] ** 2).mean()) < 12
        assert path[0, 0] < 10
        assert path[-1, 0] == 39
    assert met == set(range(8))


def test_clutter_alone_makes_no_track():
    looks, _ = sail([], CLUTTER.replace(false_alarms=20.0), 60, seed=11)
    assert confirmed(track(looks, follower(CLUTTER.replace(false_alarms=20.0), particles=500))) == {}


@pytest.mark.parametrize("seed", [12, 13, 17])
def test_ships_side_by_side_keep_their_own_tracks(seed):
    looks, places = sail([[3000, 0, 4000, 7], [3050, 0, 4000, 7]], CLUTTER, 50, seed=seed)
    found = track(looks, follower(CLUTTER))
    settled = {n: path[path[:, 0] >= 20] for n, path in confirmed(found).items() if path[-1, 0] >= 20}
    assert len(settled) == 2  # a first one may have begun between them
    nearest = [np.abs(path[:, None, 1] - places[20:, :, 0]).argmin(axis=1) for path in settled.values()]
    assert sorted(set(one) for one in nearest) == [{0}, {1}]


def test_two_tracks_of_one_ship_become_one():
    looks, _ = sail([[3000, 0, 4000, 7]], CLUTTER, 12, seed=13)
    flt, tracker, rng = follower(CLUTTER), RadarTracker(), np.random.default_rng(0)
    found = track(looks[:6], flt, tracker)[-1]
    (one,) = [one for one in found.targets if one.life.track is not None]
    twin = one._replace(life=one.life._replace(track=2), existence=0.99)
    doubled = found._replace(targets=(*found.targets, twin), born=2)
    for look in looks[6:]:
        doubled = tracker.step(doubled, look.time_s, look, rng)
    assert [other.life.track for other in doubled.targets if other.life.track is not None] == [1]


def test_a_ship_that_goes_away_loses_its_track_and_a_number_is_never_given_twice():
    looks, _ = sail([[3000, 0, 4000, 7]], CLUTTER, 20, seed=14)
    empty, _ = sail([], CLUTTER, 12, seed=15)
    later, _ = sail([[-3000, 0, 4000, 7]], CLUTTER, 15, seed=16)
    gone = [look._replace(time_s=20.0 + k, times_s=look.times_s + 20) for k, look in enumerate(empty)]
    back = [look._replace(time_s=32.0 + k, times_s=look.times_s + 32) for k, look in enumerate(later)]
    found = track([*looks, *gone, *back], follower(CLUTTER))
    statuses = [{one.life.track: one.life.status for one in tracks.targets if one.life.track} for tracks in found]
    assert statuses[19][1] == "confirmed"
    ended = [number for number, status in enumerate(statuses) if status.get(1) == "deleted"]
    assert len(ended) == 1  # shown once
    assert 20 < ended[0] < 30
    last = [number for number, status in statuses[-1].items() if status == "confirmed"]
    assert len(last) == 1
    assert last[0] > 1


def test_scans_at_irregular_times_and_plots_with_times_of_their_own():
    rng, state = np.random.default_rng(17), np.array([[3000.0, 2.0, 4000.0, 7.0]])
    looks, truth, time_s = [], [], 0.0
    for number in range(40):
        when = time_s + rng.uniform(0, 0.4)  # the plot's own time, later in the scan
        there = state + when * state[:, [1, 1, 3, 3]] * [1, 0, 1, 0]
        look = ALONE.simulate(there, rng, time_s=when)
        looks.append(look._replace(time_s=time_s))
        truth.append((state + time_s * state[:, [1, 1, 3, 3]] * [1, 0, 1, 0])[0, [0, 2]])
        time_s += (0.5, 4.0, 1.0)[number % 3]
    (path,) = confirmed(track(looks, follower(ALONE, q=0.05))).values()
    off = np.hypot(*(path[:, 1:] - np.array(truth)[path[:, 0].astype(int)]).T)
    assert np.sqrt((off**2).mean()) < 8


def test_refusals():
    looks, _ = sail([[3000, 0, 4000, 7], [-3000, 0, 4000, 7]], CLUTTER, 2, seed=18)
    tracker, rng, flt = RadarTracker(), np.random.default_rng(0), follower(CLUTTER, particles=100)
    tracks = tracker.step(tracker.init(flt), 1.0, looks[1], rng)
    with pytest.raises(DataError, match="comes after 1 s; sort"):
        tracker.step(tracks, 0.0, looks[0], rng)
    with pytest.raises(DataError, match="give false_alarms, however few"):
        tracker.step(tracker.init(follower(ALONE, particles=100)), 0.0, looks[0], rng)
    with pytest.raises(ParameterError, match="its sensor is a _Blind, which does not report detections"):
        tracker.init(flt.replace(sensor=_Blind()))


def test_a_sensor_of_ones_own_is_tracked_with():
    """What delegates to the radar, plain, gives the same as the radar."""
    looks, _ = sail([[3000, 0, 4000, 7]], CLUTTER, 8, seed=19)
    ours, theirs = (track(looks, follower(sensor, particles=200)) for sensor in (CLUTTER, _Own()))
    for mine, other in zip(ours, theirs, strict=True):
        assert [one.existence for one in mine.targets] == [one.existence for one in other.targets]


def test_over_no_time_nothing_moves_and_without_a_scan_targets_are_predicted():
    looks, _ = sail([[3000, 0, 4000, 7]], CLUTTER, 6, seed=20)
    last = track(looks, follower(CLUTTER))[-1]
    (ship,) = [one for one in last.targets if one.life.status == "confirmed"]
    again = RadarTracker().step(last, last.time_s, looks[-1], np.random.default_rng(0))
    (same,) = [one for one in again.targets if one.life.track == ship.life.track]
    np.testing.assert_array_equal(same.state.particles, ship.state.particles)
    assert np.trace(same.state.covariance) < np.trace(ship.state.covariance)
    later = RadarTracker(mean_life_s=60.0).step(last, last.time_s + 30.0, None, np.random.default_rng(0))
    (gone_on,) = [one for one in later.targets if one.life.track == ship.life.track]
    assert gone_on.existence == pytest.approx(math.exp(-0.5) * ship.existence)
    ahead = ship.state.mean[[0, 2]] + 30.0 * ship.state.mean[[1, 3]]
    np.testing.assert_allclose(gone_on.state.mean[[0, 2]], ahead, atol=15.0)


@pytest.mark.parametrize("seed", [21, 22, 23])
def test_a_ship_that_leaves_the_field_of_view_is_absent_where_the_view_is_known(seed):
    sector = CLUTTER.replace(false_alarms=1.0, from_bearing_deg=300.0, to_bearing_deg=40.0)
    looks, places = sail([[-3280, -6, 2000, 0]], sector, 45, seed=seed)
    assert not sector.sees(np.hypot(*places[31, 0]), np.arctan2(*places[31, 0]))  # from the 31st scan on
    for knowledge, remain in ((None, 1), (FieldOfView(), 0)):
        last = track(looks, follower(sector, knowledge, particles=500))[-1]
        assert sum(one.life.status == "confirmed" for one in last.targets) == remain


class _Own:
    """A user's sensor: the methods alone."""

    detection_probability = CLUTTER.detection_probability

    def __init__(self):
        for name in ("log_likelihood", "log_densities", "log_clutter", "log_uniform", "detections_in_view", "places"):
            setattr(self, name, getattr(CLUTTER, name))
        self.draw_births = CLUTTER.draw_births


class _Blind:
    def log_likelihood(self, states, measurement):
        return np.zeros(len(states))
