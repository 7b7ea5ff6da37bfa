"""A filter behind each track, against the filters themselves and against each other."""

from __future__ import annotations

import numpy as np
import pytest

from elusive import run
from elusive.filters.gaussian.kalman import KalmanFilter
from elusive.motion import ConstantVelocity
from elusive.sensors.linear import LinearSensor
from elusive.systems.links.smoothing import KalmanSmoothing, ParticleSmoothing
from elusive.tracking.lifecycle import Life
from elusive.tracking.people import PeopleState, PersonTrack

FRAMES = 40


def places_of(seed):
    """Two people, the second one from frame 5 to 30, with gaps."""
    rng = np.random.default_rng(seed)
    truth = np.cumsum(rng.normal(0.3, 0.3, (FRAMES, 2, 2)), axis=0)
    seen = truth + rng.normal(0, 0.3, truth.shape)
    frames = []
    for k in range(FRAMES):
        frame = {1: None if k in (8, 9, 20) else seen[k, 0]}
        if 5 <= k < 30:
            frame[7] = None if k == 12 else seen[k, 1]
        frames.append(frame)
    return truth, frames


def follow(smoothing, frames, seed=0):
    rng = np.random.default_rng(seed)
    state, states, last = {}, [], {}
    for k, frame in enumerate(frames):
        time_s = float(k)
        last |= {track: (tuple(place), time_s) for track, place in frame.items() if place is not None}
        people = [PersonTrack(Life(track, "candidate"), last[track][0], (0.0, 0.0), last[track][1], 1, 1.0)
                  for track in frame]  # fmt: skip
        state = smoothing.step(state, PeopleState(time_s, tuple(people), 0), rng)
        states.append(state)
    return states


def test_kalman_is_the_kalman_filter():
    _, frames = places_of(1)
    smoothing = KalmanSmoothing(q=0.4, place_sd_m=0.3)
    states = follow(smoothing, frames)
    for track, first, last in ((1, 0, FRAMES), (7, 5, 30)):
        whole = KalmanFilter(
            motion=ConstantVelocity(q=0.4),
            sensor=LinearSensor(observed=((1.0, 0, 0, 0), (0, 0, 1.0, 0)), covariance=((0.09, 0), (0, 0.09))),
            prior=smoothing._prior(frames[first][track]),
        )
        seen = [frame[track] for frame in frames[first + 1 : last]]
        expected = run(whole, seen, np.random.default_rng(0), np.arange(1.0, len(seen) + 1), start_s=0.0)
        for state, one in zip(states[first + 1 : last], expected, strict=True):
            np.testing.assert_allclose(state[track].mean, one.mean, atol=1e-12)
            np.testing.assert_allclose(state[track].covariance, one.covariance, atol=1e-12)
    assert set(states[4]) == {1}
    assert set(states[-1]) == {1}


def test_particles_agree_with_kalman():
    """80 000 particles: within six standard errors, a tenth of them effective. The deviation's error is 2 % at most."""
    _, frames = places_of(2)
    exact = follow(KalmanSmoothing(), frames)
    drawn = follow(ParticleSmoothing(particles=80_000), frames)
    for ours, theirs in zip(drawn, exact, strict=True):
        assert set(ours) == set(theirs)
        for track, one in ours.items():
            deviation, exactly = (np.sqrt(np.diag(each.covariance)[[0, 2]]) for each in (one, theirs[track]))
            assert (np.abs(one.mean - theirs[track].mean)[[0, 2]] < 6 * exactly / np.sqrt(8000)).all()
            np.testing.assert_allclose(deviation, exactly, rtol=0.1)


@pytest.mark.parametrize("smoothing", [KalmanSmoothing(), ParticleSmoothing()], ids=lambda one: one.kind)
def test_it_smooths(smoothing):
    """Mean squared error over both tracks below that of the places themselves, for each of ten recordings."""
    for seed in range(10):
        truth, frames = places_of(seed)
        raw, kept = [], []
        for k, (frame, state) in enumerate(zip(frames, follow(smoothing, frames), strict=True)):
            for track, place in frame.items():
                if place is not None:
                    true = truth[k, 0 if track == 1 else 1]
                    raw.append(((place - true) ** 2).sum())
                    kept.append(((state[track].mean[[0, 2]] - true) ** 2).sum())
        assert np.mean(kept) < np.mean(raw)
