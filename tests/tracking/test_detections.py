"""Several targets in detections: the recursion against all associations; what it makes of clutter and neighbours."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.stats import norm

from elusive.contracts import DetectionBirths, DetectionSensor
from elusive.errors import DataError, ParameterError
from elusive.filters.particle import _kernels
from elusive.filters.particle.sir import ParticleFilter
from elusive.filters.priors import GaussianPrior
from elusive.motion import ConstantVelocity
from elusive.sensors.field_of_view import FieldOfView
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarPlot, scan_of
from elusive.tracking._detection_kernels import associate, clusters
from elusive.tracking.association import marginals
from elusive.tracking.detection_targets import Target, expected
from elusive.tracking.detections import DetectionTracker, GatingSensor
from elusive.tracking.lifecycle import Life, Lifecycle
from tests.reference import detections as twin

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


def follower(sensor, knowledge=None, q=0.4, particles=1000, **rules):
    known = () if knowledge is None else (knowledge,)
    return DetectionTracker(motion=ConstantVelocity(q=q), sensor=sensor, knowledge=known, particles=particles, **rules)


def sail(ships, sensor, scans, seed, interval_s=1.0):
    """Scans of ships that sail straight, and where each was."""
    rng, states = np.random.default_rng(seed), np.array(ships, dtype=float).reshape(-1, 4)
    looks, places = [], []
    for number in range(scans):
        looks.append(sensor.simulate(states, rng, time_s=number * interval_s))
        places.append(states[:, [0, 2]].copy())
        states = states + interval_s * states[:, [1, 1, 3, 3]] * [1, 0, 1, 0]
    return looks, np.array(places)


def track(looks, tracker, seed=0):
    """Belief after each scan."""
    rng = np.random.default_rng(seed)
    state, found = tracker.init(rng), []
    for look in looks:
        state = tracker.step(state, look.time_s, look, rng)
        found.append(state)
    return found


def confirmed(found):
    """Scan and place of each track where it is confirmed."""
    paths = {}
    for number, tracks in enumerate(found):
        for one in tracks.targets:
            if one.life.status == "confirmed":
                paths.setdefault(one.life.track, []).append((number, *one.mean[[0, 2]]))
    return {track: np.array(path) for track, path in paths.items()}


def test_one_plot_a_scan_is_the_particle_filter_itself():
    looks, _ = sail([[4000, 3, 5000, -6]], ALONE, 30, seed=1)
    tracker = follower(ALONE, Shore(20.0), kernel_width=0.0)
    alone = ParticleFilter(
        motion=tracker.motion, sensor=ALONE, prior=NOWHERE, knowledge=tracker.knowledge, particles=tracker.particles
    )
    rng = np.random.default_rng(2)
    first = tracker.step(tracker.init(rng), looks[0].time_s, looks[0], rng).targets[0]
    state = alone.start(first.particles, looks[0].time_s)._replace(weights=first.weights)
    following = np.random.default_rng(2)
    found = tracker.step(tracker.init(following), looks[0].time_s, looks[0], following)
    for look in looks[1:]:
        # every scan, the tracker draws a new target that its plot might be of before it moves those that it has
        moved = np.random.default_rng(look.time_s.__hash__())
        found = tracker.step(found, look.time_s, look, np.random.default_rng(look.time_s.__hash__()))
        state = alone.step(state, look.time_s, look, moved)
        (one,) = found.targets
        np.testing.assert_allclose(one.particles, state.particles, rtol=1e-12)
        np.testing.assert_allclose(one.weights, state.weights, rtol=1e-9, atol=1e-15)
        assert one.existence == pytest.approx(1.0)
        assert one.life.track == 1


TREE = [(0, 0), (0, 1), (1, 1), (1, 2), (2, 2), (2, 3)]
RINGS = [[(0, 0), (0, 1), (1, 0), (1, 1)], [(i, j) for i in range(3) for j in range(3)]]


def draws(pairs, seeds=20):
    target, detection = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    for seed in range(seeds):
        yield target, detection, np.random.default_rng(seed).uniform(math.log(1e-3), math.log(1e3), len(pairs))


@pytest.mark.parametrize(
    "pairs", [[], [(0, 0), (0, 1), (0, 2)], TREE, *RINGS, [(i, j + i // 2) for i in range(4) for j in range(3)]]
)
def test_association_is_that_of_all_associations(pairs):
    for target, detection, log_odds in draws(pairs):
        found = marginals(target, detection, log_odds, 4, 5)
        exact = twin.marginals(target, detection, log_odds, 4, 5)
        for ours, theirs in zip(found, exact, strict=True):
            np.testing.assert_allclose(ours, theirs, atol=1e-5)


def test_messages_are_exact_without_loops_and_near_with_them():
    """Mean error of a probability over draws of odds from 1e-3 to 1e3: .02 and less, as Williams and Lau find."""
    for pairs, bound in ((TREE, 1e-5), (RINGS[0], 0.02), (RINGS[1], 0.02)):
        off = []
        for target, detection, log_odds in draws(pairs):
            found = associate(target, detection, log_odds, 3, 4, 1e-6, 500)
            exact = twin.marginals(target, detection, log_odds, 3, 4)
            off.append(
                np.concatenate([np.abs(ours - theirs) for ours, theirs in zip(found, exact, strict=True)]).mean()
            )
            np.testing.assert_allclose(np.bincount(target, found[0], 3) + found[1], 1.0, rtol=1e-9)
        assert np.mean(off) < bound


@pytest.mark.parametrize(("targets", "detections"), [(3, 12), (12, 3)])
def test_clusters_of_few_targets_or_few_detections_are_summed_exactly(targets, detections):
    """Against the sum over sets of the smaller side, which the enumeration of up to four targets covers above."""
    rng = np.random.default_rng(1)
    target, detection = (part.ravel() for part in np.indices((targets, detections)))
    log_odds = rng.normal(0, 3, target.size)
    found = marginals(target, detection, log_odds, targets, detections)
    if targets < detections:
        exact = twin.marginals(target, detection, log_odds, targets, detections)
    else:
        order = np.lexsort((target, detection))
        turned = twin.marginals(detection[order], target[order], log_odds[order], detections, targets)
        pairs = np.empty(target.size)
        pairs[order] = turned[0]
        exact = pairs, turned[2], turned[1]
    for ours, theirs in zip(found, exact, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-9)


def test_clusters_are_what_pairs_join():
    rng = np.random.default_rng(4)
    for _ in range(50):
        target, detection = rng.integers(8, size=7), rng.integers(9, size=7)
        by_target, by_detection = clusters(target, detection, 8, 9)
        joined = coo_array((np.ones(7), (target, 8 + detection)), shape=(17, 17))
        _, label = connected_components(joined, directed=False)
        found = np.concatenate([by_target, by_detection])
        np.testing.assert_array_equal(found[:, None] == found, label[:, None] == label)


def test_certain_odds_stay_numbers():
    """A detection that nothing but one of two targets explains."""
    found = marginals(np.array([0, 1]), np.array([0, 0]), np.array([800.0, 800.0 - math.log(3)]), 2, 1)
    np.testing.assert_allclose(found.pairs, [0.75, 0.25], rtol=1e-6)
    assert found.unclaimed[0] < 1e-200


@pytest.mark.parametrize("knowledge", [None, Shore(15.0)])
def test_a_scan_is_that_of_all_associations(knowledge):
    """Two targets apart, each with a detection, and a false one: no loop, so that the tracker is exact."""
    rng = np.random.default_rng(3)
    looks, _ = sail([[25, 1, 5000, -6], [2500, 0, 3000, 5]], CLUTTER, 9, seed=3)
    rules = {"forget_below": 1e-9, "merge_within": 0.0, "gate": 50.0, "mean_life_s": 50.0}
    drawn = {"resample_below": 0.0, "redraw_below": 0.0}
    tracker = follower(CLUTTER, knowledge, q=0.0, particles=400, **rules, **drawn)  # the prediction can be repeated
    states = track(looks[:-1], tracker)
    for before, look in zip(states[2:], looks[3:], strict=True):
        # one target of each ship, and what the tracker makes of them alone
        best = sorted(before.targets, key=lambda one: one.existence)[-2:]
        after = tracker.step(before._replace(targets=tuple(best)), look.time_s, look, rng)
        moved = []
        for one in best:
            particles, weights, existence = one.particles.copy(), one.weights, math.exp(-1 / 50) * one.existence
            particles[:, [0, 2]] += particles[:, [1, 3]]
            if knowledge is not None:
                weights = weights * np.exp(knowledge.log_probability(particles))
                allowed = weights.sum()
                weights, existence = weights / allowed, existence * allowed / (1 - existence + existence * allowed)
            moved.append((existence, particles, weights))
        begun = {one.detection: one for one in after.targets[2:]}
        water = np.array([begun[k].allowed if k in begun else 0.0 for k in range(look.detections)])
        undetected = math.exp(-1 / 50) * before.undetected + tracker.births_per_s
        density = CLUTTER.draw_births(look, np.arange(look.detections), 1, 8.0, rng).log_density
        with np.errstate(divide="ignore"):
            born = np.log(0.9 * undetected * water) + density
        found, new = twin.step(CLUTTER, look, moved, np.logaddexp(born, CLUTTER.log_clutter(look)), born)
        for one, (existence, weights) in zip(after.targets, found, strict=False):
            assert one.existence == pytest.approx(min(existence, 1 - 1e-12), rel=1e-5)
            np.testing.assert_allclose(one.weights, weights, rtol=1e-4, atol=1e-12)
        for k, one in begun.items():
            assert one.existence == pytest.approx(new[k], rel=1e-4, abs=1e-12)


def test_a_beginning_is_as_likely_as_births_false_alarms_and_water_say():
    shore = Shore(100.0)
    places = [(-60.0, 4000.0), (20.0, 5000.0), (900.0, 6000.0)]
    scan = scan_of(0.0, [RadarPlot(0.0, math.hypot(*place), math.atan2(*place) % math.tau, 1.0) for place in places])
    (tracks,) = track([scan], follower(CLUTTER, shore, particles=20_000, births_per_s=0.2))
    assert len(tracks.targets) == 3
    _, errors = CLUTTER.places(scan)
    for one, (x, _), error in zip(tracks.targets, places, errors, strict=True):
        water = norm.cdf(x / math.hypot(shore.sigma_m, math.sqrt(error[0, 0])))
        assert one.existence == pytest.approx(0.18 * water / (0.18 * water + 3.0), rel=0.02)


def test_on_land_no_track_begins():
    looks, _ = sail([[-200, 0, 5000, -6]], ALONE, 10, seed=4)
    assert all(not tracks.targets for tracks in track(looks, follower(ALONE, Shore(10.0))))
    assert confirmed(track(looks, follower(ALONE, Shore(200.0))))


def test_a_ship_that_goes_far_inland_is_followed_and_it_is_said():
    looks, places = sail([[150, -8, 5000, 0]], ALONE, 60, seed=5)
    found = track(looks, follower(ALONE, Shore(5.0), q=2.8, particles=2000))
    (path,) = confirmed(found).values()
    assert np.abs(path[-10:, 1:] - places[-10:, 0]).max() < 40
    left_out = [any(one.forbidden for one in tracks.targets) for tracks in found]
    assert not any(left_out[:18])  # on water
    assert all(left_out[-20:])  # 170 m inland and more, 34 deviations


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
    assert sorted(sorted(set(one)) for one in nearest) == [[0], [1]]


def test_two_tracks_of_one_ship_become_one():
    looks, _ = sail([[3000, 0, 4000, 7]], CLUTTER, 12, seed=13)
    tracker, rng = follower(CLUTTER), np.random.default_rng(0)
    found = track(looks[:6], tracker)[-1]
    (one,) = [one for one in found.targets if one.life.track is not None]
    twin_of = one._replace(life=one.life._replace(track=2), existence=0.99)
    doubled = found._replace(targets=(*found.targets, twin_of), numbered=2)
    for look in looks[6:]:
        doubled = tracker.step(doubled, look.time_s, look, rng)
    assert [other.life.track for other in doubled.targets if other.life.track is not None] == [1]


class TwoLooks(RadarSensor):
    """A radar whose measurement is two scans of one time."""

    def scans(self, measurement):
        return measurement


def test_scans_of_one_time_are_steps_over_no_time_after_which_tracks_are_judged_once():
    looks, _ = sail([[3000, 0, 4000, 7], [4500, 2, 3000, -3]], CLUTTER, 10, seed=14)
    both = TwoLooks(**CLUTTER.model_dump())
    rules = {"lifecycle": Lifecycle(candidate_from=1.0, confirm_from=1.0, delete_below=0.0)}  # none is ever numbered
    together, single = follower(both, **rules), follower(CLUTTER, **rules)
    rngs = [np.random.default_rng(3) for _ in range(2)]
    states = [together.init(rngs[0]), single.init(rngs[1])]
    for first, second in zip(looks[::2], looks[1::2], strict=True):
        later = second._replace(time_s=first.time_s, times_s=first.time_s + second.times_s - second.time_s)
        states[0] = together.step(states[0], first.time_s, (first, later), rngs[0])
        for look in (first, later):
            states[1] = single.step(states[1], first.time_s, look, rngs[1])
        for one, other in zip(*(state.targets for state in states), strict=True):
            assert one.existence == other.existence
            np.testing.assert_array_equal(one.particles, other.particles)
    assert states[0].undetected == states[1].undetected
    once = follower(both, lifecycle=Lifecycle(confirm_frames=2))
    assert not any(track.status == "confirmed" for track in once.step(once.init(rngs[0]), 0.0, looks, rngs[0]).tracks)


@pytest.mark.parametrize(("apart", "moved"), [(0.0, True), (200.0, False)])
def test_kernels_spread_a_belief_of_one_mode_alone_and_leave_its_moments(apart, moved):
    rng, n = np.random.default_rng(4), 4000
    states = rng.normal(0, (5, 1, 5, 1), (n, 4)) + np.where(rng.random((n, 1)) < 0.5, apart, 0.0)
    weights = np.exp(-0.5 * ((states[:, 0] - states[:, 0].mean()) / states[:, 0].std()) ** 2)
    weights /= weights.sum()
    moments = _kernels.moments(states, weights)
    target = Target(Life(), 0.9, states, weights, *moments, weights, -1, 0.0, 1.0, False, 0.0)
    after = expected(target, ConstantVelocity(q=1e-12), 1e-9, 1.0, (), len(target.weights), 1.0, 1.0, rng)
    fresh = np.abs(after.particles[:, :1] - states[:, 0]).min(axis=1) > 1e-6
    assert fresh.mean() > 0.9 if moved else not fresh.any()
    error = 5 / np.sqrt(n * 0.5)
    np.testing.assert_allclose(after.mean, moments[0], atol=error * np.sqrt(np.diag(moments[1])).max())
    np.testing.assert_allclose(np.diag(after.covariance), np.diag(moments[1]), rtol=2 * error)


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
    tracker, rng = follower(CLUTTER, particles=100), np.random.default_rng(0)
    tracks = tracker.step(tracker.init(rng), 1.0, looks[1], rng)
    with pytest.raises(DataError, match="comes after 1 s; sort"):
        tracker.step(tracks, 0.0, looks[0], rng)
    with pytest.raises(ParameterError, match=r"DetectionTracker\.sensor"):
        follower(_Blind())
    with pytest.raises(ParameterError, match="further_sd: does not say how to draw 'mood'"):
        tracker.replace(motion=_Moody()).step(tracker.init(rng), 1.0, looks[1], rng)
    wrong = _Own()
    wrong.log_densities = lambda states, measurement, which: np.zeros((len(states), 99))
    with pytest.raises(DataError, match="log_densities: gave an array of shape"):
        tracker.replace(sensor=wrong).step(tracks, 2.0, looks[0], rng)
    wrong = _Own()
    wrong.log_densities = lambda states, measurement, which: np.full((len(states), len(which)), np.nan)
    with pytest.raises(DataError, match="is NaN or plus infinity for some state"):
        tracker.replace(sensor=wrong).step(tracks, 2.0, looks[0], rng)
    one = DetectionBirths(np.zeros((1, 1, 4)), np.zeros(1), np.ones((1, 1)))
    wrong.draw_births = lambda measurement, which, n, speed, rng: one
    with pytest.raises(DataError, match="draw_births: gave states of shape"):
        tracker.replace(sensor=wrong).step(tracker.init(rng), 2.0, looks[0], rng)


def test_without_false_alarms_every_plot_is_a_targets():
    sure = CLUTTER.replace(false_alarms=0.0)
    looks, places = sail([[3000, 0, 4000, 7], [-3000, 0, 4000, 7]], sure, 20, seed=18)
    paths = confirmed(track(looks, follower(sure)))
    assert len(paths) == 2
    for path in paths.values():
        assert np.hypot(*(path[-1, None, 1:] - places[-1]).T).min() < 15


def test_a_sensor_of_ones_own_is_tracked_with():
    """What delegates to the radar, plain, gives the same as the radar; without gates, as if all were within them."""
    looks, _ = sail([[3000, 0, 4000, 7]], CLUTTER, 8, seed=19)
    assert isinstance(CLUTTER, GatingSensor)
    assert isinstance(_Own(), DetectionSensor)
    assert not isinstance(_Own(), GatingSensor)
    ours, theirs = (track(looks, follower(sensor, particles=200)) for sensor in (CLUTTER, _Own()))
    for mine, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(
            [one.existence for one in mine.targets], [one.existence for one in other.targets], atol=1e-4
        )


def test_over_no_time_nothing_moves_and_without_a_scan_targets_are_predicted():
    looks, _ = sail([[3000, 0, 4000, 7]], CLUTTER, 6, seed=20)
    last = track(looks, follower(CLUTTER))[-1]
    (ship,) = [one for one in last.targets if one.life.status == "confirmed"]
    tracker = follower(CLUTTER, mean_life_s=60.0)
    again = tracker.step(last, last.time_s, looks[-1], np.random.default_rng(0))
    (same,) = [one for one in again.targets if one.life.track == ship.life.track]
    np.testing.assert_array_equal(same.particles, ship.particles)
    assert np.trace(same.covariance) < np.trace(ship.covariance)
    later = tracker.step(last, last.time_s + 30.0, None, np.random.default_rng(0))
    (gone_on,) = [one for one in later.targets if one.life.track == ship.life.track]
    assert gone_on.existence == pytest.approx(math.exp(-0.5) * ship.existence)
    ahead = ship.mean[[0, 2]] + 30.0 * ship.mean[[1, 3]]
    np.testing.assert_allclose(gone_on.mean[[0, 2]], ahead, atol=15.0)


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

    def __init__(self):
        for name in ("detection_probabilities", "log_densities", "log_clutter", "draw_births"):
            setattr(self, name, getattr(CLUTTER, name))


class _Moody:
    state_names = ("x", "vx", "y", "vy", "mood")

    def propagate(self, states, interval_s, rng):
        return states


class _Blind:
    def log_likelihood(self, states, measurement):
        return np.zeros(len(states))
