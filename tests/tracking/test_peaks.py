"""What stands out of frames, followed: kernels beside their slow twins, and made peaks with a known truth."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats
from scipy.spatial import cKDTree

from elusive.errors import DataError
from elusive.preprocess.peaks import Peaks
from elusive.tracking import _peak_kernels as kernels
from elusive.tracking._pair_kernels import absorb, explain
from elusive.tracking._target_kernels import moving, recent, ways
from elusive.tracking.peak_alone import RIVALS, chance_of, chance_of_peaks
from elusive.tracking.peak_motions import PeakMotions
from elusive.tracking.peak_nearer import targets_share
from elusive.tracking.peak_null import MEDIANS, SHAPES, SHARES, EmpiricalNull
from elusive.tracking.peak_persistence import groups_of
from elusive.tracking.peak_targets import HOP, PeakTargets
from elusive.tracking.peaks import PeakBelief, SceneTracker
from tests.reference import scene_targets as reference

MOTIONS = PeakMotions()
SHAPE = (120, 160)


def drawn(rng: np.random.Generator, n: int) -> tuple[np.ndarray, ...]:
    """Draw beliefs of some targets in all motions."""
    kinds = len(MOTIONS.table)
    root = rng.normal(size=(n, kinds, 2, 2))
    joint = root @ root.swapaxes(2, 3) + 0.1 * np.eye(2)
    variance = np.stack([joint[..., 0, 0], joint[..., 0, 1], joint[..., 1, 1]], axis=-1)
    variance[:, MOTIONS.rests, 1:] = 0
    velocity = rng.normal(size=(n, kinds, 2))
    velocity[:, MOTIONS.rests] = 0
    weight = rng.dirichlet(np.ones(kinds), n)
    return rng.normal(50, 1, (n, 1, 2)) + rng.normal(size=(n, kinds, 2)), velocity, variance, weight


def test_targets_are_predicted_as_by_the_twin() -> None:
    before = drawn(np.random.default_rng(0), 5)
    after = tuple(values.copy() for values in before)
    kernels.predict(*after, MOTIONS.table, MOTIONS.switch, 1.5)
    for i in range(5):
        expected = reference.predicted(*(values[i] for values in before), MOTIONS.table, MOTIONS.switch, 1.5)
        for found, value in zip(after, expected, strict=True):
            np.testing.assert_allclose(found[i], value, rtol=1e-9, atol=1e-9)


def test_moments_are_those_of_the_mixture() -> None:
    belief = drawn(np.random.default_rng(2), 5)
    mean, covariance = kernels.moments(*belief)
    for i in range(5):
        expected = reference.mixed(*(values[i] for values in belief))
        np.testing.assert_allclose(mean[i], expected[0], rtol=1e-12)
        np.testing.assert_allclose(covariance[i], expected[1], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("known", [0, 200])
def test_the_nearest_is_found_within_its_reach_alone(known: int) -> None:
    rng = np.random.default_rng(3)
    points, sought = rng.uniform(0, 10, (known, 3)), rng.uniform(-1, 11, (300, 3))
    apart, which = kernels.nearest(points, np.argsort(points[:, 0]), sought, 0.7)
    expected, at = cKDTree(points).query(sought, distance_upper_bound=0.7)
    np.testing.assert_allclose(apart, expected)
    np.testing.assert_array_equal(which, np.where(np.isfinite(expected), at, -1))


def test_peaks_explain_and_update_targets_as_in_the_twin() -> None:
    rng = np.random.default_rng(1)
    place, velocity, variance, weight = drawn(rng, 4)
    places, spread = rng.normal(50, 2, (6, 2)), rng.uniform(0.1, 0.5, 6)
    level, levels = rng.normal(size=4), rng.normal(size=6)
    polarity, bright = np.array([True, False, True, True]), rng.random(6) < 0.6
    clutter, changes = rng.normal(-6, 1, 6), rng.uniform(0.2, 0.6, 4)
    pairs = explain(
        place, velocity, variance, weight, level, polarity, MOTIONS.table, 0.2, places,
        np.argsort(places[:, 0]), spread, levels, bright,
        clutter, changes, 0.9,
    )  # fmt: skip
    made = {}
    for i in range(4):
        for j in range(6):
            if polarity[i] != bright[j]:
                continue
            alike = stats.t.pdf(levels[j], 3, loc=level[i], scale=changes[i])
            found = [
                reference.ratio(
                    place[i, k], velocity[i, k], variance[i, k], MOTIONS.table[k], 0.2, places[j], spread[j]
                )
                for k in range(weight.shape[1])
            ]
            if any(density for density, _ in found):
                scale = 0.9 * alike * np.exp(-clutter[j])
                made[i, j] = [density * scale for density, _ in found], [share for _, share in found]
    target, peak = pairs.target, pairs.peak
    both = list(zip(target.tolist(), peak.tolist(), strict=True))
    assert sorted(both) == list(made)
    assert target.tolist() == sorted(target.tolist())
    ratio, rough = np.zeros((2, len(target), weight.shape[1]))
    of = np.repeat(np.arange(len(target)), np.diff(pairs.begins))
    ratio[of, pairs.motion], rough[of, pairs.motion] = pairs.ratio, pairs.rough
    np.testing.assert_allclose(ratio, [made[pair][0] for pair in both])
    np.testing.assert_allclose(rough, [made[pair][1] for pair in both])
    np.testing.assert_allclose(pairs.likely, (weight[target] * ratio).sum(axis=1))

    message, seen = rng.uniform(0.2, 1, len(target)), rng.uniform(0.3, 0.9, 4)
    after = tuple(values.copy() for values in (place, velocity, variance, weight))
    likelihood = absorb(*after, MOTIONS.table, pairs, message, seen, places, spread)
    for i in range(4):
        mine = np.flatnonzero(target == i)
        for k in range(weight.shape[1]):
            expected = reference.absorbed(
                place[i, k], velocity[i, k], variance[i, k], MOTIONS.table[k], places[peak[mine]], spread[peak[mine]],
                message[mine] * ratio[mine, k], rough[mine, k], 1 - seen[i],
            )  # fmt: skip
            for found, value in zip((*after[:3], likelihood), expected, strict=True):
                np.testing.assert_allclose(found[i, k], value, rtol=1e-8, atol=1e-8)
        updated = weight[i] * likelihood[i]
        np.testing.assert_allclose(after[3][i], updated / updated.sum())


def test_neighbours_are_counted_and_doubles_left_out_as_by_the_twins() -> None:
    rng = np.random.default_rng(2)
    places, bright = rng.uniform(0, 30, (60, 2)), rng.random(60) < 0.5
    np.testing.assert_array_equal(kernels.crowding(places, bright, 7.0), reference.crowd(places, bright, 7.0))
    velocity, scale, rank = rng.normal(0, 0.5, (60, 2)), rng.uniform(1, 4, 60), rng.random(60)
    age, kept = rng.choice([0, 1, 2, 9, 10, 30], 60), rng.random(60) < 0.8
    places[1::2] = places[::2] + rng.uniform(-0.6, 0.6, (30, 2))
    velocity[1::2] *= 0.02
    bright[1::2], rank[::2] = bright[::2], rank[::2] + 1
    velocity[::2] *= 4
    expected = reference.undoubled(places, velocity, scale, bright, age, rank, kept)
    kernels.leave_doubles(np.argsort(-rank), np.argsort(places[:, 0]), places, velocity, scale, bright, age, kept)
    assert kept.tolist() == expected


def test_looks_ways_and_motion_are_those_of_the_twins() -> None:
    rng, n, pairs = np.random.default_rng(5), 7, 15
    target, peak, share = np.sort(rng.integers(0, n - 1, pairs)), rng.integers(0, 9, pairs), rng.uniform(0, 0.3, pairs)
    looks = rng.normal(size=(3, n)), rng.normal(size=(3, 9))
    for value, expected in zip(
        recent(target, peak, share, *looks, 0.15), reference.recent(target, peak, share, *looks, 0.15), strict=True
    ):
        np.testing.assert_allclose(value, expected, rtol=1e-12, atol=1e-12)
    place, _, _, weight = drawn(rng, n)
    origin, lately, usual = rng.normal(50, 3, (n, 2)), rng.normal(50, 3, (n, HOP, 2)), rng.normal(50, 3, (n, 2, 2))
    rest = weight, rng.uniform(0, 1, n), np.array([3.0, -2.0]), origin, lately, usual, rng.uniform(0, 9, (n, 2))
    for value, expected in zip(ways(place, *rest), reference.ways(place, *rest), strict=True):
        np.testing.assert_allclose(value, expected, rtol=1e-12, atol=1e-12)
    evidence, resting = rng.normal(8, 5, n), rng.normal(5, 5, (n, int(MOTIONS.rests.sum())))
    farthest, age = rng.uniform(0, 9, n), rng.integers(0, 20, n)
    known = evidence, resting, place, origin, MOTIONS.leash, farthest, farthest * rng.uniform(0.3, 1, n), age
    np.testing.assert_allclose(moving(*known, HOP, 1e-300), reference.moving(*known), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("gate", [5.0, np.inf])
def test_a_map_is_fitted_as_by_the_twin(gate: float) -> None:
    rng = np.random.default_rng(4)
    at = rng.uniform(0, 200, (40, 2))
    to = at + [1.0, -2.0] + at @ [[0.01, 0.02], [-0.02, 0.01]] + rng.normal(0, 0.3, (40, 2))
    to[:6] += rng.normal(0, 8, (6, 2))
    guess = at + np.array([1.0, -2.0])
    found = kernels.fit_affine(at, to, guess, gate, 2.0, 1e-6, 0.15, 1.0)
    for value, expected in zip(found, reference.affine(at, to, guess, gate), strict=True):
        np.testing.assert_allclose(value, expected, rtol=1e-9, atol=1e-11)


def peaks_of(number: int, places: np.ndarray, strength: np.ndarray, offset: np.ndarray, step: np.ndarray) -> Peaks:
    """Return bright spatial peaks of a pixel's scale."""
    order = np.argsort(-strength)
    m = len(order)
    flag, one = np.ones(m, np.bool_), np.ones(m)
    return Peaks(
        number, places[order], strength[order], one, flag, ~flag, strength[order], offset, step,
        number == 0, 1.0, 0.0, np.zeros(11),
    )  # fmt: skip


def recorded(rng: np.random.Generator, path: np.ndarray, rests: np.ndarray, **settings: Any) -> list[PeakBelief]:
    """Follow a target of strength 8 along a path in the scene (NaN: unseen) among what rests, and noise."""
    tracker = SceneTracker(**settings)
    belief, beliefs, offset = tracker.begin(), [], np.zeros(2)
    for k, place in enumerate(path):
        step = rng.normal(0, 1.0, 2)
        offset = offset + step
        noise = rng.uniform((0, 0), SHAPE[::-1], (60, 2))
        scene = np.concatenate([rests, place[None]]) + rng.normal(0, 0.2, (len(rests) + 1, 2)) + offset
        strength = np.concatenate([rng.normal(7, 0.4, len(rests)), rng.normal(8, 0.4, 1), 2 + rng.exponential(0.6, 60)])
        there = np.concatenate([scene, noise])
        seen = np.isfinite(there[:, 0])
        peaks = peaks_of(k, there[seen], strength[seen], offset, step)
        belief = tracker.follow(belief, float(k), peaks, SHAPE, 1.0)
        beliefs.append(belief)
    return beliefs


def resting(rng: np.random.Generator) -> np.ndarray:
    return rng.uniform((20, 20), (140, 100), (40, 2))


def near(belief: PeakBelief, place: np.ndarray, offset: np.ndarray) -> list[Any]:
    return [track for track in belief.tracks if np.hypot(*(track.mean[[0, 2]] - offset - place)) < 2]


def test_what_moves_is_shown_and_what_rests_is_followed() -> None:
    for seed in range(3):
        rng = np.random.default_rng(seed)
        path = np.array([20.0, 60.0]) + np.outer(np.arange(60), [1.0, -0.4])
        beliefs = recorded(rng, path, resting(rng))
        last = beliefs[-1]
        shown = [track for track in last.tracks if track.extra["shown"]]
        assert len(shown) == 1
        assert shown[0].extra["moves"] > 0.9
        assert 0.9 < shown[0].existence <= shown[0].extra["moves"]  # a target is there if it moves
        np.testing.assert_allclose(shown[0].mean[[1, 3]], (1.0, -0.4), atol=0.3)
        confirmed = [track for track in last.tracks if track.status == "confirmed"]
        assert 38 <= len(confirmed) <= 45
        assert max(track.extra["moves"] for track in confirmed if not track.extra["shown"]) < 0.5


def test_what_crosses_the_frame_in_a_few_frames_is_followed_among_what_is_as_strong() -> None:
    velocity, found = np.array([10.0, 4.0]), 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        path = np.array([8.0, 30.0]) + np.outer(np.arange(14), velocity)
        last = recorded(rng, path, resting(rng)[:10])[-1]
        found += any(
            t.status == "confirmed" and t.existence > 0.5 and np.hypot(*(t.mean[[1, 3]] - velocity)) < 1
            for t in last.tracks
        )
    assert found >= 14  # .875 of forty, less 2.4 deviations; none without a fast motion


@pytest.mark.parametrize("strength", [4.0, 40.0])
def test_a_contrast_may_change_by_its_noise_and_by_what_recordings_show(strength: float) -> None:
    tracker, place, still = SceneTracker(), np.full((1, 2), 60.0), np.zeros(2)
    belief = tracker.begin()
    for k in range(3):
        before, peaks = belief, peaks_of(k, place, np.array([strength]), still, still)
        belief = tracker.follow(belief, float(k), peaks, SHAPE, 1.0)
    other = tracker.follow(before, 2.0, peaks._replace(contrast=peaks.contrast * np.exp(0.6)), SHAPE, 1.0)
    law = stats.t(3, scale=np.hypot(tracker.level_spread, 1 / strength))
    lost = belief.targets.evidence - other.targets.evidence
    np.testing.assert_allclose(lost, law.logpdf(0.0) - law.logpdf(0.6), rtol=0.01)


def test_where_nothing_moves_nothing_is_shown() -> None:
    for seed in range(3):
        rng = np.random.default_rng(seed)
        beliefs = recorded(rng, np.full((60, 2), np.nan), resting(rng))
        assert not any(track.extra["shown"] for belief in beliefs for track in belief.tracks)


@pytest.mark.parametrize(
    ("seen", "rested", "existence", "first"),
    [(True, 90.0, 0.35, True), (True, 90.0, 0.1, False), (False, 90.0, 0.35, False), (False, 80.0, 0.35, True)],
)
def test_what_is_shown_or_moves_keeps_its_number_though_a_younger_one_is_likelier_for_a_frame(
    seen: bool, rested: float, existence: float, first: bool
) -> None:
    """As where it is missed for two frames: a double that had to show anew that it moves took its place."""
    targets = PeakTargets.none(1, 1)._replace(
        number=np.array([1, 2]), age=np.array([40, 4]), place=np.array([[[50.0, 40.0]], [[50.6, 40.3]]]),
        velocity=np.ones((2, 1, 2)), weight=np.ones((2, 1)), visible=np.array([existence, 0.8]), hidden=np.zeros(2),
        evidence=np.array([90.0, 8.0]), scale=np.ones(2), bright=np.ones(2, np.bool_), shown=np.array([seen, False]),
        resting=np.tile([[rested], [8.0]], int(SceneTracker().motions.rests.sum())), farthest=np.full(2, 30.0),
        hop=np.full(2, 3.0),
    )  # fmt: skip
    kept = SceneTracker().kept(targets, np.zeros(2), SHAPE)
    assert kept.tolist() == [first, not first]


def test_a_target_that_is_hidden_for_a_while_keeps_its_number() -> None:
    rng = np.random.default_rng(4)
    path = np.array([20.0, 60.0]) + np.outer(np.arange(60), [1.0, -0.4])
    path[35:39] = np.nan
    beliefs = recorded(rng, path, resting(rng))
    number = {track.track for track in beliefs[34].tracks if track.extra["shown"]}
    assert len(number) == 1
    assert number == {track.track for track in beliefs[-1].tracks if track.extra["shown"]}


def test_in_noise_no_guess_is_kept_for_a_likelier_one_and_what_was_seen_before_is() -> None:
    rng, shape, none = np.random.default_rng(6), (512, 640), np.zeros(2)
    tracker = SceneTracker()
    belief, number = tracker.begin(), 0
    for k in range(20):
        places, strength = rng.uniform((0, 0), shape[::-1], (300, 2)), 2.5 + rng.exponential(0.35, 300)
        if k < 12:
            places[0], strength[0] = (80.0, 60.0), 8.0
        belief = tracker.follow(belief, float(k), peaks_of(k, places, strength, none, none), shape, 1.0)
        targets = belief.targets
        begun = targets.existence[targets.age == 0]
        # a tenth, less what the least that began had before it was left out as a double
        assert (targets.existence[targets.evidence < 0] > 0.06 * begun.min()).all()
        if k < 12:
            number = targets.number[np.hypot(*(targets.mean_place - (80.0, 60.0)).T).argmin()]
        assert number in targets.number


def test_what_has_left_is_given_up() -> None:
    rng = np.random.default_rng(5)
    path = np.array([20.0, 60.0]) + np.outer(np.arange(80), [1.0, -0.4])
    path[40:] = np.nan
    beliefs = recorded(rng, path, resting(rng))
    assert any(track.extra["shown"] for track in beliefs[39].tracks)
    assert not any(track.extra["shown"] for track in beliefs[-1].tracks)


def test_a_target_that_has_gone_far_by_hops_is_not_at_rest() -> None:
    leash = MOTIONS.leash
    kinds, rests = len(MOTIONS.table), len(leash)
    one, place = np.ones(2), np.array([[0.0, 0.0], [8.0, 6.0]])
    targets = PeakTargets.none(kinds, rests)._replace(
        place=np.repeat(place[:, None], kinds, axis=1),
        origin=np.zeros((2, 2)),
        evidence=500 * one,
        resting=np.full((2, rests), 500.0),
        farthest=np.hypot(*place.T),
        age=np.full(2, 100),
        hop=4 * one,
    )
    stayed, went = targets.moving(leash)
    assert stayed == pytest.approx(0.0)
    kept = 500 - 100 / (2 * leash**2)  # 10 px from where it began
    free = 500 - max(np.log(np.mean(np.exp(kept - kept.max()))) + kept.max(), 0)
    way = 10 - (4 - 10 * HOP / 100 - leash.min())  # less what it hopped beyond even motion
    assert went == pytest.approx(min(free, way**2 / (2 * leash.min() ** 2)))
    still = targets._replace(resting=np.zeros((2, rests)), hop=np.array([0.0, 10.6 + leash.min()])).moving(leash)
    np.testing.assert_allclose(still, 0.0)  # all its way was one hop


def test_what_never_went_far_does_not_move_however_it_sways() -> None:
    leash, kinds, rests = MOTIONS.leash, len(MOTIONS.table), len(MOTIONS.leash)
    targets = PeakTargets.none(kinds, rests)._replace(
        place=np.zeros((1, kinds, 2)),
        origin=np.zeros((1, 2)),
        evidence=np.array([500.0]),
        resting=np.zeros((1, rests)),
        farthest=np.array([1.5]),
        age=np.array([100]),
        hop=np.zeros(1),
    )
    assert targets.moving(leash)[0] <= 1.5**2 / 2


def test_what_has_not_rested_for_long_moves_by_all_its_evidence() -> None:
    leash, kinds, rests = MOTIONS.leash, len(MOTIONS.table), len(MOTIONS.leash)
    targets = PeakTargets.none(kinds, rests)._replace(
        place=np.full((1, kinds, 2), 60.0),
        origin=np.zeros((1, 2)),
        evidence=np.array([2000.0]),
        resting=np.full((1, rests), -3000.0),  # its likelihood is less than a number can be
        farthest=np.array([85.0]),
        age=np.array([1800]),
        hop=np.zeros(1),
    )
    assert targets.moving(leash)[0] == 2000.0


def shown_of(beliefs: list[PeakBelief]) -> list[set[int]]:
    return [{track.track for track in belief.tracks if track.extra["shown"]} for belief in beliefs]


def followed(rng: np.random.Generator, scene: Any, rests: np.ndarray, frames: int = 60) -> list[PeakBelief]:
    """Follow what ``scene`` gives of a frame, places and strengths, among what rests and noise, camera at rest."""
    tracker = SceneTracker()
    belief, beliefs, still = tracker.begin(), [], np.zeros(2)
    for k in range(frames):
        places, strength = scene(k)
        noise = rng.uniform((0, 0), SHAPE[::-1], (60, 2))
        there = np.concatenate(
            [np.concatenate([rests, places]) + rng.normal(0, 0.2, (len(rests) + len(places), 2)), noise]
        )
        strengths = np.concatenate([rng.normal(7, 0.4, len(rests)), strength, 2 + rng.exponential(0.6, 60)])
        belief = tracker.follow(belief, float(k), peaks_of(k, there, strengths, still, still), SHAPE, 1.0)
        beliefs.append(belief)
    return beliefs


@pytest.mark.parametrize("unseen", [0, 3])
def test_a_target_that_jumps_keeps_its_number_and_is_shown_again_at_once(unseen: int) -> None:
    rng = np.random.default_rng(7)

    def scene(k: int) -> tuple[np.ndarray, np.ndarray]:
        jump = (-9.0, 8.0) if k >= 40 else (0.0, 0.0)
        there = slice(0 if 40 <= k < 40 + unseen else 1)
        return np.array([[20.0 + k + jump[0], 60.0 - 0.4 * k + jump[1]]])[there], np.array([12.0])[there]

    shown = shown_of(followed(rng, scene, resting(rng)))
    assert len(shown[39]) == 1
    assert shown[46 + unseen] == shown[59] == shown[39]


def test_what_rests_beside_a_target_that_has_gone_is_not_that_target() -> None:
    rng = np.random.default_rng(7)

    def scene(k: int) -> tuple[np.ndarray, np.ndarray]:
        place = [20.0 + k, 60.0 - 0.4 * k] if k < 40 else [51.0, 52.0]
        return np.array([place])[slice(0 if k == 40 else 1)], np.array([12.0])[slice(0 if k == 40 else 1)]

    beliefs = followed(rng, scene, resting(rng))
    (gone,) = shown_of(beliefs)[39]
    assert all(track.track != gone for belief in beliefs[48:] for track in belief.tracks)


def test_what_hops_once_does_not_move() -> None:
    """A point of the scene goes over into its neighbour, as where a video's blocks are coded anew."""
    rng = np.random.default_rng(10)

    def scene(k: int) -> tuple[np.ndarray, np.ndarray]:
        return np.array([[60.0 + 2 * np.clip(k - 40, 0, 4), 60.0]]), np.array([9.0])

    shown = shown_of(followed(rng, scene, resting(rng), 90))
    assert not set().union(*shown[15:])


def passing(rng: np.random.Generator, on_sensor: Any, strengths: np.ndarray) -> list[tuple[np.ndarray, list[Any]]]:
    """Follow what ``on_sensor`` gives of a frame while the scene goes by: those places, and the tracks shown."""
    tracker, way = SceneTracker(), np.array([-2.0, 0.3])
    rests, belief, found = rng.uniform((10, -20), (340, 130), (90, 2)), tracker.begin(), []
    for k in range(80):
        scene = rests + k * way
        inside = scene[(scene > 0).all(axis=1) & (scene < SHAPE[::-1]).all(axis=1)]
        places = on_sensor(k)
        noise = rng.uniform((0, 0), SHAPE[::-1], (60, 2))
        all_places = np.vstack([inside, places])
        there = np.concatenate([all_places + rng.normal(0, 0.15, all_places.shape), noise])
        strength = np.concatenate([rng.normal(7, 0.4, len(inside)), strengths, 2 + rng.exponential(0.6, 60)])
        belief = tracker.follow(belief, float(k), peaks_of(k, there, strength, k * way, way), SHAPE, 1.0)
        found.append((places, [track.mean[[0, 2]] for track in belief.tracks if track.extra["shown"]]))
    return found


@pytest.mark.parametrize("jitter_px", [0.1, 0.3])
def test_a_target_that_the_camera_follows_is_shown_while_the_scene_goes_by(jitter_px: float) -> None:
    """It rests on the sensor as a defect would, but to the pointing's error and its own peaks'."""
    rng = np.random.default_rng(11)
    target = np.array([[80.0, 60.0]])
    frames = passing(rng, lambda k: target + rng.normal(0, jitter_px, 2), np.array([8.0]))[10:]
    assert all(len(seen) <= 1 for _, seen in frames)
    assert np.mean([any(np.hypot(*(at - places[0])) < 2 for at in seen) for places, seen in frames]) > 0.9


def test_marks_on_the_sensor_are_not_shown_and_hide_nothing_that_moves() -> None:
    """Dust, defects and a reticle rest on the sensor, several of them; a target goes over it and through the scene."""
    rng = np.random.default_rng(12)
    marks = np.array([[20.0, 20.0], [60.0, 100.0], [80.0, 30.0], [120.0, 90.0], [140.0, 40.0], [30.0, 70.0]])
    strengths = np.array([9.0, 5.0, 12.0, 6.0, 8.0, 10.0, 7.0])
    frames = passing(rng, lambda k: np.vstack([marks, [150.0 - 0.8 * k, 60.0 + 0.3 * k]]), strengths)
    assert all(np.hypot(*(at - places[-1])) < 2 for places, seen in frames[10:] for at in seen)
    assert np.mean([len(seen) == 1 for _, seen in frames[40:]]) > 0.9


def test_one_defect_aside_is_a_mark_though_taken_now_and_then_for_a_point_of_the_scene() -> None:
    """A cluster of dead pixels alone rests on the sensor; in every eighth frame it is found with what is beside it."""
    rng = np.random.default_rng(13)
    defect = np.array([[30.0, 40.0]])
    frames = passing(rng, lambda k: defect + 1.5 * (k % 8 == 7) * np.array([-1.0, 0.2]), np.array([8.0]))
    assert not [seen for places, seen in frames[20:] for at in seen if np.hypot(*(at - places[0])) < 4]


def test_a_mark_that_is_taken_for_a_point_of_the_scene_does_not_make_that_one_move() -> None:
    """A speck fades when a point of the scene is where it was: the track goes on with that, and is at rest."""
    rng = np.random.default_rng(14)
    speck, way = np.array([[130.0, 40.0]]), np.array([-2.0, 0.3])
    frames = passing(rng, lambda k: speck + max(k - 40, 0) * way, np.array([8.0]))
    assert not [at for _, seen in frames[20:] for at in seen]


@pytest.mark.parametrize("trees", [2, 14])
def test_trees_nearer_than_the_ground_are_not_shown_at_whatever_speed_they_go_by(trees: int) -> None:
    """Each goes the scene's way in the frame, faster by its own distance; a target goes across it."""
    rng = np.random.default_rng(22)
    places, nearer = rng.uniform((150, 20), (330, 100), (trees, 2)), rng.uniform(1.15, 1.6, (trees, 1))

    def seen(k: int) -> np.ndarray:
        return np.vstack([places + k * nearer * [-2.0, 0.3], [140.0 - 1.6 * k, 15.0 + 1.2 * k]])

    frames = passing(rng, seen, np.append(np.full(trees, 7.0), 8.0))[30:]
    at_target = [[np.hypot(*(at - places[-1])) < 2 for at in shown] for places, shown in frames]
    assert np.mean([any(one) for one in at_target]) > 0.9
    assert np.mean([sum(one) < len(one) for one in at_target]) < 0.1


def test_how_likely_a_target_goes_just_the_way_of_what_is_nearer() -> None:
    """By the share of all directions that is so near to it, ten pixels on; none while the camera rests."""
    targets = recorded(np.random.default_rng(4), np.full((12, 2), 50.0), np.zeros((0, 2)))[-1].targets
    ways = 10 * np.array([[1.0, 0.0], [1.0, 0.1], [1.0, 0.3], [0.0, 1.0], [-1.0, 0.0]])
    five = targets.kept(np.zeros(5, np.int64))
    five = five._replace(origin=five.mean_place - ways, farthest=np.full(5, 10.0))
    wide = 2 * np.arctan(0.15) / (2 * np.pi)
    expected = wide / (wide + 1)
    np.testing.assert_allclose(targets_share(five, np.array([0.5, 0.0])), [expected, expected, 1, 1, 1], rtol=1e-9)
    np.testing.assert_array_equal(targets_share(five, np.array([0.1, 0.0])), 1.0)


def test_what_rings_beside_a_target_is_not_shown() -> None:
    rng = np.random.default_rng(8)

    def scene(k: int) -> tuple[np.ndarray, np.ndarray]:
        place = np.array([20.0 + k, 60.0 - 0.4 * k])
        return np.stack([place, place + np.array([6.0, 3.0])]), np.array([15.0, 6.0])

    beliefs = followed(rng, scene, resting(rng))
    assert len(shown_of(beliefs)[-1]) == 1
    assert all(len(shown) <= 1 for shown in shown_of(beliefs))


def test_a_layer_of_clouds_is_not_shown_and_a_target_before_it_is() -> None:
    rng = np.random.default_rng(9)
    clouds = rng.uniform((10, 10), (110, 110), (12, 2))

    def scene(k: int) -> tuple[np.ndarray, np.ndarray]:
        return np.concatenate([clouds + k * np.array([0.7, 0.1]), [[140.0 - k, 60.0]]]), np.append(
            rng.normal(5, 0.3, 12), 8.0
        )

    last = followed(rng, scene, resting(rng))[-1]
    (track,) = (track for track in last.tracks if track.extra["shown"])
    assert track.mean[1] == pytest.approx(-1.0, abs=0.3)


def test_three_that_follow_each_other_are_shown() -> None:
    rng = np.random.default_rng(21)

    def scene(k: int) -> tuple[np.ndarray, np.ndarray]:
        return np.array([[60.0 - 40 * i + k, 50.0] for i in range(3)]), np.full(3, 7.0)

    assert len(shown_of(followed(rng, scene, resting(rng), frames=90))[-1]) == 3


def test_one_target_alone_is_shown_and_its_existence_told() -> None:
    path = np.stack([np.linspace(40, 60, 40), np.full(40, 50.0)], axis=1)
    last = recorded(np.random.default_rng(4), path, np.zeros((0, 2)))[-1]
    (track,) = (track for track in last.tracks if track.extra["shown"])
    np.testing.assert_allclose(track.mean[[1, 3]], (20 / 39, 0.0), atol=0.3)
    assert track.existence > 0.5


@pytest.mark.parametrize("exponent", [0.05, 0.3])
def test_the_strongest_of_one_kind_is_told_from_another_by_chance_alone(exponent: float) -> None:
    """A Pareto tail's greatest value has a p-value that is uniform, however heavy the tail."""
    rng = np.random.default_rng(15)
    chances = []
    for strength in 3.0 * rng.random((4000, 200)) ** -exponent:
        first, *others = np.sort(strength)[::-1][: RIVALS + 2]
        chances.append(chance_of(first, np.array(others)))
    for level in (0.01, 0.1, 0.5):
        share = np.mean(np.array(chances) < level)
        assert share == pytest.approx(level, abs=4 * np.sqrt(level * (1 - level) / 4000))
    assert chance_of(9.0, np.zeros(0)) == 0.0
    assert chance_of(9.0, np.array([9.0, 4.0])) == 1.0
    assert chance_of(9.0, np.array([4.0])) < 0.002 < chance_of(6.0, np.array([4.0]))


def test_how_rarely_clutter_is_as_strong_as_the_strongest_is_told_by_what_is_far_from_it() -> None:
    rng = np.random.default_rng(19)
    places = np.vstack([[[80.0, 60.0], [82.0, 60.0]], 20 + 100 * rng.random((12, 2)) * [0.5, 1.0]])
    strength = np.append([12.0, 9.0], np.linspace(5.0, 4.0, 12))
    peaks = peaks_of(1, places, strength, np.zeros(2), np.zeros(2))
    told = chance_of_peaks(peaks, 1e-6)
    assert told[0] == pytest.approx(chance_of(12.0, strength[2:]))
    assert told[0] < 0.01
    np.testing.assert_array_equal(told[1:], 1.0)
    assert chance_of_peaks(peaks, 0.02)[0] == 0.02
    nothing_else = peaks_of(1, places[:2], strength[:2], np.zeros(2), np.zeros(2))
    np.testing.assert_array_equal(chance_of_peaks(nothing_else, 0.02), 1.0)


@pytest.mark.parametrize("near_px", [6.0, np.inf])
def test_what_stands_out_is_followed_however_it_turns_and_flashes_anywhere_are_not(near_px: float) -> None:
    """A step of 6 px in a new direction each frame, or another place of the frame, of twice the others' strength."""
    shown, at = 0, []
    for seed in range(2):
        rng = np.random.default_rng(seed)
        path = [np.array([80.0, 60.0])]
        while len(path) < 40:
            turn = rng.uniform(0, 2 * np.pi)
            step = near_px * np.array([np.cos(turn), np.sin(turn)])
            place = rng.uniform((0, 0), SHAPE[::-1]) if np.isinf(near_px) else path[-1] + step
            if 5 < place[0] < 155 and 5 < place[1] < 115:
                path.append(place)
        ways = [(place[None], np.array([10.0])) for place in path]
        beliefs = followed(rng, ways.__getitem__, np.zeros((0, 2)), 40)
        shown += sum(len(one) for one in shown_of(beliefs)[10:])
        at += [
            any(t.status == "confirmed" and np.hypot(*(t.mean[[0, 2]] - place)) < 3 for t in belief.tracks)
            for belief, place in zip(beliefs[10:], path[10:], strict=True)
        ]
    if np.isinf(near_px):
        assert shown == 0
    else:
        assert np.mean(at) > 0.9  # none where a frame's strongest is one, however strong it is


@pytest.mark.parametrize("how", ["rests", "new", "blinks"])
def test_what_changes_at_rest_is_not_alone_until_it_is_no_news(how: str) -> None:
    """A digit that changes stands out against earlier frames alone, a mark that blinks is gone for half of them."""
    rng = np.random.default_rng(17)
    rests, still, tracker = resting(rng)[:20], np.zeros(2), SceneTracker()
    belief, alone = tracker.begin(), []
    for k in range(100):
        places = np.vstack([[[80.0, 60.0]], rests]) + rng.normal(0, 0.2, (21, 2))
        there = slice(int(how == "blinks" and k // 7 % 2 == 1), None)
        peaks = peaks_of(k, places[there], np.append(13.0, np.linspace(6.0, 5.0, 20))[there], still, still)
        stands = how == "new" and 30 <= k < 50
        belief = tracker.follow(belief, float(k), peaks._replace(temporal=stands & (peaks.strength > 10)), SHAPE, 1.0)
        alone.append(any(track.extra["shown"] for track in belief.tracks))
    if how == "blinks":
        assert not any(alone)
    else:
        assert all(alone[15:30])
        assert all(alone[90:])
        assert not any(alone[34:70]) if how == "new" else all(alone[15:])


@pytest.mark.parametrize("alike", [True, False])
def test_the_strongest_is_shown_where_the_next_ones_are_alike(alike: bool) -> None:
    """Twice as strong as the next it is either way; where all are so much stronger than another, it is of a kind."""
    rng = np.random.default_rng(16)
    rests = resting(rng)[:20]
    strengths = np.linspace(6.0, 5.0, 20) if alike else np.maximum(12.0 * 0.6 ** np.arange(20.0), 3.5)

    def scene(_: int) -> tuple[np.ndarray, np.ndarray]:
        return np.vstack([[[80.0, 60.0]], rests]), np.append(2.2 * strengths[0], strengths)

    shown = shown_of(followed(rng, scene, np.zeros((0, 2)), 30))
    assert {len(numbers) for numbers in shown[15:]} == {int(alike)}


def test_what_became_of_sure_tracks_is_counted_beyond_chance() -> None:
    persistence = SceneTracker().persistence
    known = persistence.begin()
    assert np.isnan(persistence.sure_again(known)[0])
    outcomes = known.outcomes.copy()
    outcomes[0], outcomes[-1] = (60, 6, 6, 12), (40, 39, 22, 8)  # of the unsure none counts but for chance, .2
    share, number = persistence.sure_again(known._replace(outcomes=outcomes))
    assert (share, number) == (pytest.approx((22 / 40 - 0.2) / 0.8), 40)


def test_a_track_just_missed_is_told_by_those_that_had_been_missed() -> None:
    """As likely to be there by the filter, but unlike those that were just seen it was seldom there again."""
    rng = np.random.default_rng(6)
    path = np.stack([np.linspace(40, 60, 40), np.full(40, 50.0)], axis=1)
    last = recorded(rng, path, np.zeros((0, 2)))[-1]
    targets = last.targets.kept(np.array([0, 0]))._replace(
        age=np.array([5, 5]), visible=np.array([0.65, 0.65]), hidden=np.array([0.0, 0.3])
    )
    persistence = SceneTracker().persistence
    outcomes = np.zeros_like(persistence.begin().outcomes)
    seen, missed = (groups_of(targets)[k] for k in (0, 1))
    outcomes[seen], outcomes[missed] = (60, 39, 54, 0), (60, 39, 6, 0)
    told = persistence.shares(outcomes)[groups_of(targets)]
    pooled = (54 + 3 * 0.65 + 3 * 0.8) / 66, (6 + 3 * 0.65 + 3 * 0.4 + 3 * 0.2) / 69  # with what is supposed beside
    np.testing.assert_allclose(told, pooled)


def test_where_there_is_no_clutter_several_targets_do_not_hide_each_other() -> None:
    """Most of a clean recording's few tracks are targets and what is left of them where they crossed."""
    moved, rate = np.array([60.0, 50.0, 55.0, 45.0, 1.0]), np.array([3.0, 2.5, 2.8, 2.6, 0.4])
    of_all = np.append(moved, [50.0, 40.0]), np.append(rate, [2.6, 2.4])
    moves = EmpiricalNull().moves(moved, rate, *of_all)
    assert (moves[:4] > 0.5).all()
    assert moves[4] < 0.01


def test_little_evidence_is_no_motion_before_anything_is_known_of_the_clutter() -> None:
    moves = EmpiricalNull().moves(np.array([3.0, 6.0]), np.array([2.0, 2.0]), np.zeros(0), np.zeros(0))
    assert (moves < 0.5).all()


def test_the_null_keeps_its_promise() -> None:
    """Of tracks that are all of the null, hardly any is said to move, whatever the width of their evidence."""
    rng = np.random.default_rng(6)
    for width in (0.3, 3.0, 30.0):
        said = 0
        for _ in range(50):
            moved, rate = width * rng.exponential(size=300), rng.normal(2, 0.5, 300)
            said += int((EmpiricalNull().moves(moved, rate, moved, rate) > 0.5).sum())
        assert said <= 50 * 0.5


def pareto(rng: np.random.Generator, exponent: float, n: int) -> np.ndarray:
    """Draw from a generalised Pareto law of width one."""
    upper = 1 - rng.random(n)
    return (upper**-exponent - 1) / exponent


def test_the_null_keeps_its_promise_however_heavy_its_tail_is() -> None:
    rng, runs = np.random.default_rng(7), 60
    for exponent in (0.1, 0.6, 1.0, 1.5):
        said = 0
        for _ in range(runs):
            moved, rate = 2 * pareto(rng, exponent, 2000), rng.normal(2, 0.5, 2000)
            said += int((EmpiricalNull().moves(moved, rate, moved, rate) > 0.5).sum())
        assert said <= 0.5 * runs + 2.4 * np.sqrt(0.5 * runs)  # with a fixed .3: 107, 376, 772 in the last three


@pytest.mark.parametrize("movers", [1, 8, 25])
def test_targets_do_not_hide_each_other(movers: int) -> None:
    """However many move, most are told; where all excesses made one tail, of eight .01 were, of 25 none."""
    rng, found = np.random.default_rng([8, movers]), []
    for _ in range(40):
        clutter = np.append(np.zeros(440), 1 + pareto(rng, 0.3, 60))
        moved = np.append(clutter, np.exp(rng.uniform(np.log(20), np.log(200), movers)))
        rate = np.append(rng.normal(2, 0.5, 500), rng.normal(2.3, 0.3, movers))
        said = EmpiricalNull().moves(moved, rate, moved, rate) > 0.5
        assert said[:500].sum() <= 3
        found.append(said[500:].mean())
    assert np.mean(found) > 0.5  # .70, .74 and .83, errors .07, .05 and .03


def test_what_wanders_and_stands_out_most_of_all_is_seldom_said_to_move() -> None:
    """As parts of clouds do; taken for independent, 3.9 of 800 such tracks were."""
    rng, runs, said = np.random.default_rng(10), 60, 0
    for _ in range(runs):
        moved = 3 * pareto(rng, 0.6, 800)
        rate = rng.normal(2, 0.5, 800) + 0.5 * np.log1p(moved)
        said += int((EmpiricalNull().moves(moved, rate, moved, rate) > 0.5).sum())
    assert said < 2.3 * runs  # 2.1 each, an error of .2


def test_evidence_a_frame_far_beyond_all_others_counts_for_more_than_its_rank() -> None:
    """By ranks it was .85 on the mean."""
    rng = np.random.default_rng(11)
    for _ in range(20):
        moved = np.concatenate([np.zeros(540), 1 + 3 * pareto(rng, 0.6, 60), [20.0]])
        rate = np.append(rng.normal(2, 0.5, 600), 6.0)
        moves = EmpiricalNull().moves(moved, rate, moved, rate)
        assert moves[-1] > 0.99
        assert (moves[:-1] > 0.5).sum() <= 3


@pytest.mark.parametrize("power", [0.4, 0.7])
def test_how_far_two_evidences_go_together_is_found(power: float) -> None:
    """Of tracks over the level, shares of all that have as much evidence a frame are that root of uniform ones."""
    rng, null = np.random.default_rng(12), EmpiricalNull(supposed_independent=0)
    ranked, found = np.arange(5000.0), []
    for _ in range(100):
        share = rng.random(200) ** (1 / power)
        found.append(null._together(ranked, np.floor(5000 * (1 - share))))
    error = power / (math.log(2) * math.sqrt(200))  # of a median of exponentials
    assert np.mean(found) == pytest.approx(power, abs=3 * error / math.sqrt(100) + 0.01)


def test_laws_and_shares_have_the_weights_of_their_likelihood() -> None:
    """By the densities themselves, a bin's at its middle, of all laws and shares that are tried."""
    rng, null = np.random.default_rng(9), EmpiricalNull(supposed_tracks=0)
    excess = np.append(pareto(rng, 0.5, 400), np.exp(rng.uniform(np.log(5), np.log(1000), 40)))
    weight, shape, width, resting = null._tails(excess, 0)
    middle = [max(one, 1e-3) for one in excess]
    log_weight = []
    for xi in null.shape + SHAPES:
        for median in MEDIANS:
            sigma = median * xi / (2**xi - 1)
            rests = (1 + xi * np.array(middle) / sigma) ** (-1 / xi - 1) / sigma
            moves = np.where(excess > null.moved, 1 / (excess * np.log(1000 / null.moved)), 0.0)
            log_weight += [
                (np.log((1 - share) * rests + share * moves).sum() - 4 * xi, xi, share) for share in SHARES.tolist()
            ]
    values = np.array(log_weight)
    exact = np.exp(values[:, 0] - values[:, 0].max())
    exact /= exact.sum()
    # a bin's likelihood is that of its densities but for their change within it
    assert float(weight @ shape[:, 0]) == pytest.approx(float(exact @ values[:, 1]), abs=0.1)
    assert float(weight @ resting[:, 0]) == pytest.approx(440 * float(1 - exact @ values[:, 2]), abs=15)
    assert float(weight @ resting[:, 0]) == pytest.approx(400, abs=3 * np.sqrt(40))
    assert (width > 0).all()


def test_a_target_alone_does_not_make_the_tail_of_a_clean_recording_heavy() -> None:
    """Its own evidence is one of few over the level."""
    rng = np.random.default_rng(9)
    quiet = rng.exponential(0.3, 150)
    moved, rate = np.append(quiet, 40.0), np.append(rng.normal(2, 0.3, 150), 2.5)
    assert EmpiricalNull().moves(moved, rate, moved, rate)[-1] > 0.9


def test_evidence_that_is_weak_moves_nothing_however_rare_it_is() -> None:
    moved, rate = np.append(np.zeros(300), 2.9), np.append(np.full(300, 1.0), 9.0)
    assert EmpiricalNull().moves(moved, rate, moved, rate)[-1] == 0.0


def test_time_does_not_run_backwards() -> None:
    tracker = SceneTracker()
    belief = tracker.follow(tracker.begin(), 1.0, None, SHAPE, 1.0)
    with pytest.raises(DataError, match="time"):
        tracker.follow(belief, 0.5, None, SHAPE, 1.0)
