"""Those who may be there unseen: no evidence of them is thrown away, and whoever gathers enough is one target."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.motion import ConstantVelocity, WithIntensity
from elusive.sensors import ImageSensor
from elusive.systems.images.several import SeveralImages
from elusive.tracking.frame_births import FrameBirths
from elusive.tracking.sought import LOUD, Update
from elusive.tracking.superposed_state import SuperposedState, Unseen
from elusive.tracking.unseen import Hidden

SENSOR = ImageSensor(rows=24, columns=24, psf_sigma=1.0, noise_sigma=1.0)
MOTION = WithIntensity(motion=ConstantVelocity(q=0.0025))
SIDE = 3.0
AT = np.array([12.0, 0.0, 12.0, 0.0, SENSOR.intensity_of(9.0)])  # on the edge of four cells


def hidden(side=SIDE):
    return Hidden(MOTION, SENSOR, lambda states: np.zeros(len(states)), side, LOUD, 2000)


def cloud(mass, rng, n=2000, spread=0.7):
    states = np.tile(AT, (n, 1))
    states[:, [0, 2]] += spread * rng.standard_normal((n, 2))
    return Unseen(np.asfortranarray(states), np.full(n, mass / n))


def update(frame, rng):
    return Update(SENSOR, frame, None, rng)


def test_nobody_unseen_is_lost_but_who_dies():
    rng = np.random.default_rng(0)
    state = SuperposedState(0.0, (), 0, cloud(0.015, rng))
    seen, unseen = hidden().parted(state, 0.9, 2.0, rng)
    assert seen == []
    assert unseen.masses.sum() == pytest.approx(0.9 * 0.015)
    assert len(unseen.masses) == 2000
    # the mean and the variance of places stay but for the motion's noise, q t^3 / 3
    np.testing.assert_allclose(unseen.particles[:, [0, 2]].mean(axis=0), AT[[0, 2]], atol=0.06)
    np.testing.assert_allclose(unseen.particles[:, [0, 2]].var(axis=0), 0.49 + 0.0025 * 8 / 3, rtol=0.15)


def test_masses_are_those_of_the_evidence_and_are_joined_without_loss():
    rng = np.random.default_rng(1)
    empty, weak = SENSOR.simulate(np.empty((0, 5)), rng), cloud(1e-4, rng)
    found, unseen = hidden().emerged(weak, update(empty, rng), ())
    ratio = SENSOR.log_ratio(SENSOR.expected(weak.particles), empty, ())
    assert found == []
    assert unseen.masses.sum() == pytest.approx(weak.masses @ np.exp(ratio))
    joined = hidden().joined(unseen, [], rng)
    assert joined.masses.sum() == pytest.approx(unseen.masses.sum())


def test_whoever_gathers_enough_is_one_target_across_the_edges_of_cells():
    rng = np.random.default_rng(2)
    for seed in range(20):
        frame = SENSOR.simulate(AT[None], np.random.default_rng(seed))
        before = cloud(0.015, rng)
        found, _ = hidden().emerged(before, update(frame, rng), ())
        log_ratio = SENSOR.log_ratio(SENSOR.expected(before.particles), frame, ())
        odds = 0.015 / 0.985 * np.exp(log_ratio).mean()
        assert len(found) == (odds > LOUD)
        if found:
            assert found[0].existence / (1 - found[0].existence) == pytest.approx(odds, rel=0.05)


def test_a_tracker_without_cells_keeps_nobody_unseen():
    rng = np.random.default_rng(3)
    assert hidden(side=0.0).joined(cloud(0.01, rng), [], rng) is None


def test_what_is_believed_of_a_target_stays_when_its_track_is_deleted():
    """A faint target that is away for two frames is found sooner than anybody who has never been seen."""
    model = SeveralImages(
        motion=MOTION,
        sensor=SENSOR,
        birth=FrameBirths(snr_db=7.5, max_speed=0.5),
        birth_probability=1e-6,
        death_probability=0.01,
    )
    nobody, there = np.empty((0, 5)), np.array([[12.0, 0.0, 12.0, 0.0, SENSOR.intensity_of(7.5)]])
    found = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        state = model.init(rng)
        for k in range(14):
            state = model.step(state, float(k), SENSOR.simulate(there if k < 12 else nobody, rng), rng)
        if state.unseen is None or any(track.status != "deleted" for track in state.tracks):
            continue
        near = np.hypot(state.unseen.particles[:, 0] - 12, state.unseen.particles[:, 2] - 12) < 4
        assert 0 < state.unseen.masses[near].sum() < LOUD
        ways = [state, state._replace(unseen=None)]
        for k in range(14, 16):
            frame = SENSOR.simulate(there, rng)
            ways = [model.step(way, float(k), frame, np.random.default_rng(k)) for way in ways]
        found.append([max((target.existence for target in way.targets), default=0.0) for way in ways])
    kept, fresh = np.array(found).T
    assert len(found) >= 4  # of twelve: others have left no trace, or are not given up yet
    assert (kept > fresh - 0.1).all()  # as far as some hundred particles tell
    assert kept.mean() > fresh.mean() + 0.2
