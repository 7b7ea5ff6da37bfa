"""Targets that turn: how strongly is read off the recording itself, and a track is not sure where they are not."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.stats import binom

from elusive.checks import broken
from elusive.io import open_frames
from elusive.motion import ConstantVelocity, WithIntensity
from elusive.runner import run
from elusive.sensors.image import ImageSensor
from elusive.systems.images.fit import fit_images
from elusive.systems.images.parameters import SLOW, ImageTracking
from elusive.systems.images.run import track_recording
from elusive.systems.images.scene import held_frames
from elusive.systems.images.several import SeveralImages
from elusive.systems.images.turning import LEAST, power_of, reach_of, turning_as_seen
from elusive.tracking.frame_births import FrameBirths

SIGMA, PSF, SIZE = 10.0, 1.6, 64
SENSOR = {"kind": "white", "noise_sigma": SIGMA, "psf_sigma": PSF}


def paths(q, count=4, frames=60, seed=0, jitter=0.0):
    """Places ``(frames, count, 2)`` of targets of white acceleration that begin at rest, kept apart by where."""
    rng = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(count)))
    at = (np.stack(np.meshgrid(*2 * [np.arange(side)]), -1).reshape(-1, 2)[:count] + 0.5) * SIZE / side
    states = np.column_stack([at[:, 0], np.zeros(count), at[:, 1], np.zeros(count)])
    motion, found = ConstantVelocity(q=q), []
    for _ in range(frames):
        found.append(states[:, 0::2] + rng.normal(0, jitter, (count, 2)))
        states = motion.propagate(states, 1.0, rng)
        # a pull home, as of a spring, that second differences hardly see
        states[:, 1::2] -= 0.02 * (states[:, 0::2] - at)
    return np.array(found)


def drawn(places, seed=0, amplitude=100.0):
    """Frames of white noise with points at places ``(frames, count, 2)``."""
    rng, (y, x) = np.random.default_rng(seed + 1), np.mgrid[:SIZE, :SIZE]
    frames = rng.normal(0, SIGMA, (len(places), SIZE, SIZE))
    for frame, points in zip(frames, places, strict=True):
        for across, down in points:
            frame += amplitude * np.exp(-((x - across) ** 2 + (y - down) ** 2) / (2 * PSF**2))
    return frames


def bound(**filter):
    """Parameters of white frames of the size, one a second."""
    return ImageTracking(filter={"kind": "several", "sensor": SENSOR, **filter}).bind((SIZE, SIZE), 1.0)


@pytest.mark.parametrize("q", [0.3, 1.0])
def test_the_power_is_that_of_the_paths(q):
    found = power_of(held_frames("frames", drawn(paths(q))), bound())
    assert found.clear
    assert abs(found.q - q) < 4 * found.deviation
    assert found.deviation < 0.5 * q


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("amplitude", [40.0, 100.0])
def test_steady_targets_are_left_at_what_is_usual(seed, amplitude):
    rng = np.random.default_rng(seed)
    steps = rng.uniform(-0.1, 0.1, (4, 2)) * np.arange(60)[:, None, None]
    source = held_frames("frames", drawn(paths(0.0) + steps, seed, amplitude))
    found = power_of(source, bound())
    assert found.differences > LEAST
    assert not found.clear
    assert turning_as_seen(source, bound()) == bound()


def test_how_far_a_point_goes_is_what_was_told_of_its_speed():
    assert reach_of(bound()) == pytest.approx(4.0)  # a default counts a frame
    faster = ImageTracking(filter={"kind": "several", "sensor": SENSOR, "birth": {"max_speed": 30.0}})
    assert reach_of(faster.bind((SIZE, SIZE), 0.1)) == pytest.approx(3.0)
    usual = ImageTracking(filter={"kind": "single", "sensor": SENSOR}).bind((SIZE, SIZE), 0.1)
    assert reach_of(usual) == pytest.approx(4.0)


def test_what_is_told_stays():
    source, told = held_frames("frames", drawn(paths(1.0))), bound(motion={"motion": {"kind": "cv", "q": 0.1}})
    assert turning_as_seen(source, told) == told
    recorded = ImageTracking().bind((SIZE, SIZE), 1.0)
    assert turning_as_seen(source, recorded) == recorded
    assert turning_as_seen(held_frames("few", drawn(paths(1.0, count=1, frames=20))), bound()) == bound()


def test_the_fit_says_it_and_a_second_is_a_second():
    fit = fit_images(held_frames("frames", drawn(paths(1.0))))
    (value,) = [one for one in fit.values if one.option == "--q"]
    assert abs(float(value.value) - 1.0) < 4 * value.deviation
    assert ImageTracking(**fit.tree).filter.motion.motion.q == float(value.value)
    slow = ImageTracking(filter={"kind": "several", "sensor": SENSOR}).bind((SIZE, SIZE), 0.1)
    learnt = turning_as_seen(held_frames("frames", drawn(paths(1.0))), slow)
    assert learnt.filter.motion.motion.q == pytest.approx(1000, rel=0.3)  # [px^2 / s^3], ten frames a second
    assert learnt.recursion.motion.motion.q == pytest.approx(learnt.filter.motion.motion.q)
    steady = fit_images(held_frames("frames", drawn(paths(0.0))))
    assert "motion" not in steady.tree["filter"]
    assert SLOW.motion.q < 0.01


def random_walks(count, frames, step_px, seed):
    """Places of points that walk at random, each about its own."""
    rng = np.random.default_rng(seed)
    return paths(0.0, count, frames) + np.cumsum(rng.normal(0, step_px, (frames, count, 2)), axis=0)


@pytest.mark.thorough
def test_what_walks_at_random_is_followed_to_a_part_of_a_pixel(tmp_path):
    places = random_walks(2, 36, 0.7, seed=5)
    np.save(tmp_path / "frames.npy", drawn(places, 5))
    source = open_frames(tmp_path / "frames.npy")
    parameters = ImageTracking(filter={"kind": "several", "sensor": SENSOR, "particles": 500})
    outcome = track_recording(source, parameters, tmp_path / "out")
    assert not broken(outcome.findings)
    off, inside = [], 0
    for row in outcome.log.rows:
        if row["track"] and row["step"] >= 4:
            away = np.hypot(*(places[row["step"]] - row["position"]).T)
            covariance, error = row["covariance"][:2, :2], places[row["step"]][away.argmin()] - row["position"]
            off.append(away.min())
            inside += error @ np.linalg.solve(covariance, error) < 5.99
    assert 0.9 * 64 <= len(off) <= 64
    assert np.sqrt(np.mean(np.square(off))) < 0.25
    assert inside >= binom.ppf(1e-3, len(off), 0.9)
    told = parameters.replace(filter=parameters.filter.replace(motion=WithIntensity(motion=ConstantVelocity(q=0.003))))
    outcome = track_recording(source, told, tmp_path / "told")
    assert "targets.beside" in {one.name for one in broken(outcome.findings)}
    named = json.loads((tmp_path / "told" / "checks.json").read_text())
    assert any(one["name"] == "targets.beside" and one["grave"] and not one["holds"] for one in named)


def test_no_cloud_is_one_particle():
    """A place is told ten times as well as predicted, by a right model: 22 of 246 clouds were one particle before."""
    count = inside = 0
    tracker = SeveralImages(
        motion=WithIntensity(motion=ConstantVelocity(q=1.9)), birth=FrameBirths(max_speed=4.0),
        sensor=ImageSensor(rows=SIZE, columns=SIZE, noise_sigma=SIGMA, psf_sigma=PSF),
    )  # fmt: skip
    for seed in (11, 12):
        places = random_walks(1, 30, 0.8, seed)
        for k, state in enumerate(run(tracker, drawn(places, seed), np.random.default_rng(seed))):
            for target in state.targets if k >= 3 else ():
                if target.life.status == "confirmed":
                    error, covariance = target.mean[0:4:2] - places[k, 0], target.covariance[0:4:2, 0:4:2]
                    assert np.sqrt(covariance[0, 0]) > 0.01
                    count, inside = count + 1, inside + (error @ np.linalg.solve(covariance, error) < 5.99)
    assert count >= 50
    assert inside >= binom.ppf(1e-3, count, 0.9)


class OneAcceleration:
    """A motion of one's own, whose acceleration holds for an interval: place and velocity are one draw on each axis."""

    state_names = ("x", "vx", "y", "vy", "intensity")

    def F(self, interval_s):
        return np.kron(np.diag([1.0, 1.0, 0.0]), [[1, interval_s], [0, 1]])[:5, :5] + np.diag([0, 0, 0, 0, 1.0])

    def Q(self, interval_s):
        push = np.array([0.5 * interval_s**2, interval_s])
        found = np.zeros((5, 5))
        found[:2, :2] = found[2:4, 2:4] = np.outer(push, push)
        found[4, 4] = 0.01
        return found

    def propagate(self, states, interval_s, rng):
        push = np.array([[0.5 * interval_s**2, interval_s]])
        noise = np.hstack([rng.normal(size=(len(states), 1)) @ push for _ in range(2)])
        noise = np.hstack([noise, 0.1 * rng.normal(size=(len(states), 1))])
        return np.asfortranarray(states @ self.F(interval_s).T + noise)


def test_a_motion_whose_noise_is_of_fewer_axes_than_its_state_is_followed_on():
    tracker = SeveralImages(
        motion=OneAcceleration(), birth=FrameBirths(max_speed=4.0),
        sensor=ImageSensor(rows=SIZE, columns=SIZE, noise_sigma=SIGMA, psf_sigma=PSF),
    )  # fmt: skip
    places = random_walks(1, 20, 0.8, 11)
    states = list(run(tracker, drawn(places, 11), np.random.default_rng(11)))
    sure = [max(state.targets, key=lambda one: one.existence) for state in states[3:]]
    off = [np.hypot(*(one.mean[0:4:2] - places[k, 0])) for k, one in enumerate(sure, 3)]
    assert np.median(off) < 0.3
