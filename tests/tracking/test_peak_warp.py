"""A scene that deforms as a whole: maps against closed forms and chance; targets before cameras that zoom or roll."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.preprocess.peaks import Peaks
from elusive.tracking.peak_motions import PeakMotions
from elusive.tracking.peak_targets import PeakTargets
from elusive.tracking.peak_warp import Warp, carried, warp_of
from elusive.tracking.peaks import PeakBelief, SceneTracker

SHAPE, MIDDLE = (120, 160), np.array([80.0, 60.0])


def targets_at(places: np.ndarray) -> PeakTargets:
    """Make sure targets at rest."""
    n, motions = len(places), PeakMotions()
    kinds = len(motions.table)
    none = PeakTargets.none(kinds, int(motions.rests.sum()))
    return none._replace(
        age=np.full(n, 9), place=np.repeat(places[:, None], kinds, axis=1), velocity=np.zeros((n, kinds, 2)),
        weight=np.tile(motions.first_weights, (n, 1)), visible=np.ones(n), hidden=np.zeros(n), level=np.full(n, 2.0),
        bright=np.ones(n, np.bool_),
    )  # fmt: skip


def found(rng: np.random.Generator, places: np.ndarray, now: np.ndarray, sd_px: float) -> Warp:
    """Find the map of some places, most of which are seen now, among as many peaks elsewhere."""
    n = len(places)
    seen = now[rng.random(n) < 0.9]
    peaks = np.concatenate([seen + rng.normal(0, sd_px, seen.shape), rng.uniform((0, 0), SHAPE[::-1], (n, 2))])
    targets = targets_at(places)
    looks = np.full(len(peaks), 2.0), np.ones(len(peaks), np.bool_)
    return warp_of(targets, targets, peaks, *looks, Warp.none(), Warp.none())


@pytest.mark.parametrize(
    "linear", [[[0.01, 0.0], [0.0, 0.01]], [[0.0, 0.012], [-0.012, 0.0]], [[0.0, 0.0], [0.01, 0.0]]]
)
def test_zoom_roll_and_ground_are_found_within_their_error(linear: list[list[float]]) -> None:
    for seed in range(5):
        rng = np.random.default_rng(seed)
        places = rng.uniform((10, 10), (150, 110), (60, 2))
        warp = found(rng, places, places + (places - MIDDLE) @ np.array(linear), 0.2)
        # of least squares over some fifty points; what is elsewhere and the weights widen it by less than two
        error = 0.2 / np.sqrt(50) / places.std(axis=0)[:, None]
        assert np.all(np.abs(warp.linear - linear) < 4 * 2 * error)
        np.testing.assert_allclose(warp.way(MIDDLE), 0.0, atol=4 * 2 * 0.2 / np.sqrt(50))


def test_a_scene_that_does_not_deform_is_left_and_so_is_one_of_two_layers() -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        places = rng.uniform((10, 10), (150, 110), (60, 2))
        assert not found(rng, places, places, 0.3).deforms
        layers = np.where(rng.random(60) < 0.5, 1.5, -1.5)[:, None] * [1.0, 0.2]
        assert not found(rng, places, places + layers, 0.3).deforms
        assert not found(rng, places, rng.uniform((0, 0), SHAPE[::-1], (60, 2)), 0.3).deforms


def test_a_way_does_not_grow_by_a_zoom_and_turns_with_a_roll() -> None:
    """What hopped over ten pixels once was sure to move after the camera had zoomed in for long."""
    rng = np.random.default_rng(0)
    places = rng.uniform((10, 10), (150, 110), (30, 2))
    targets = targets_at(places)
    targets = targets._replace(
        origin=places - [6.0, 8.0],
        lately=np.repeat(places[:, None], 6, axis=1),
        usual=np.stack([places, places], axis=1),
    )
    for linear in (0.02 * np.eye(2), np.array([[0.0, 0.02], [-0.02, 0.0]])):
        now = targets
        for _ in range(50):
            now = carried(now, now, Warp(np.zeros(2), linear))
        gone = now.mean_place - now.origin
        np.testing.assert_allclose(np.hypot(*gone.T), 10.0)
        turned = 50 * np.arctan2(linear[0, 1], 1 + linear[0, 0])
        np.testing.assert_allclose(np.arctan2(gone[:, 1], gone[:, 0]), np.arctan2(8.0, 6.0) + turned)


def seen_by(view: np.ndarray, rng: np.random.Generator, *, target: bool) -> list[tuple[PeakBelief, np.ndarray]]:
    """Follow a target among what rests, seen by a camera whose view is multiplied by one a frame; and its place."""
    scene = rng.uniform((-60, -60), (220, 180), (160, 2))
    tracker = SceneTracker()
    belief, seen, now = tracker.begin(), [], np.linalg.matrix_power(np.linalg.inv(view), 25)
    for k in range(50):
        place = MIDDLE + np.array([0.8 * (k - 25), 10.0])
        places = np.concatenate(
            [(scene - MIDDLE) @ now.T + MIDDLE, place[None], rng.uniform((0, 0), (160, 120), (60, 2))]
        )
        strength = np.concatenate([rng.normal(7, 0.4, 160), [8.0], 2 + rng.exponential(0.6, 60)])
        there = np.all((places > 1) & (places < [158, 118]), axis=1)
        there[160] = target
        order = np.flatnonzero(there)[np.argsort(-strength[there], kind="stable")]
        places = places[order] + rng.normal(0, 0.2, (len(order), 2))
        one, flag, zero = np.ones(len(order)), np.ones(len(order), np.bool_), np.zeros(2)
        peaks = Peaks(
            k, places, strength[order], one, flag, ~flag, strength[order], zero, zero, k == 0, 1.0, 0.0, np.zeros(11)
        )
        belief = tracker.follow(belief, float(k), peaks, SHAPE, 1.0)
        seen.append((belief, place))
        now = view @ now
    return seen


@pytest.mark.parametrize(
    "view",
    [
        np.array([[1.0, -0.015], [0.015, 1.0]]),
        *(pytest.param(zoom * np.eye(2), marks=pytest.mark.thorough) for zoom in (1.008, 0.992)),
    ],
)
def test_a_camera_that_zooms_or_rolls_shows_what_moves_alone(view: np.ndarray) -> None:
    for belief, _ in seen_by(view, np.random.default_rng(3), target=False)[10:]:
        assert not any(track.extra["shown"] for track in belief.tracks)
    for belief, place in seen_by(view, np.random.default_rng(4), target=True)[35:]:
        (shown,) = (track for track in belief.tracks if track.extra["shown"])
        assert np.hypot(*(shown.mean[[0, 2]] - place)) < 2
        assert shown.existence > 0.8
