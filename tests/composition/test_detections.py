"""The tracker of detections with every motion and knowledge, a radar and a user's own sensor, over uneven times."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import DetectionBirths, DetectionSensor
from elusive.errors import ElusiveError, ParameterError
from elusive.motion import ConstantVelocity
from elusive.sensors.radar import RadarSensor
from elusive.tracking.detections import DetectionTracker
from tests.composition.builders import KNOWLEDGE, MIDDLE, MOTIONS, SIDE, SPREAD

TIMES = [3.0, 3.2, 4.0, 4.0, 5.5, 6.0]
MISSING = 2  # that scan does not come
FURTHER = {**SPREAD, "ax": 0.05, "ay": 0.05, "mood": 1.0}
RADAR = RadarSensor(
    range_sd_m=0.5, bearing_sd_mrad=20.0, detection_probability=0.9, false_alarms=1.0, max_range_m=50.0,
    max_doppler_mps=25.0,
)  # fmt: skip


class OwnPeaks:
    """A user's own sensor, in plain NumPy: peaks of a frame, ``(m, 2)`` x and y, each .7 off."""

    def detection_probabilities(self, states, measurement):
        return np.where(((states[:, [0, 2]] >= 0) & (states[:, [0, 2]] <= SIDE)).all(axis=1), 0.9, 0.0)

    def log_densities(self, states, measurement, which):
        off = states[:, None, [0, 2]] - measurement[which]
        return -0.5 * (off**2).sum(axis=2) / 0.49 - np.log(2 * np.pi * 0.49)

    def log_clutter(self, measurement):
        return np.full(len(measurement), np.log(2.0 / SIDE**2))

    def draw_births(self, measurement, which, n, speed_sd_mps, rng):
        states = speed_sd_mps * rng.standard_normal((len(which), n, 4))
        states[:, :, [0, 2]] = measurement[which, None] + 0.7 * rng.standard_normal((len(which), n, 2))
        return DetectionBirths(states, np.full(len(which), -2 * np.log(SIDE)), np.full((len(which), n), 1 / n))


def peaks(rng, state, time_s):
    """A scan of each sensor: one target, and what is false."""
    false = rng.uniform(0, SIDE, (rng.poisson(2), 2))
    return np.concatenate([state[None, [0, 2]] + 0.7 * rng.standard_normal((1, 2)), false])


SENSORS = {
    "radar": (RADAR, lambda rng, state, time_s: RADAR.simulate(state[None, :4], rng, time_s)),
    "a user's own": (OwnPeaks(), peaks),
}


@pytest.mark.parametrize("name", SENSORS)
def test_it_runs_at_uneven_times_with_every_motion_and_knowledge(name):
    sensor, measure = SENSORS[name]
    assert isinstance(sensor, DetectionSensor)
    state = np.array([MIDDLE["x"], MIDDLE["vx"], MIDDLE["y"], MIDDLE["vy"]])
    for motion_name, motion in MOTIONS.items():
        for known_name, known in KNOWLEDGE.items():
            what = f"{motion_name}, {known_name}"
            tracker = DetectionTracker(
                motion=motion, sensor=sensor, knowledge=known, particles=60, further_sd=FURTHER, births_per_s=1.0,
                speed_sd_mps=0.3,
            )  # fmt: skip
            rng = np.random.default_rng(1)
            belief = tracker.init(rng, 2.5)
            for k, time_s in enumerate(TIMES):
                belief = tracker.step(belief, time_s, None if k == MISSING else measure(rng, state, time_s), rng)
                assert belief.time_s == time_s, what
                for target in belief.targets:
                    assert 0 <= target.existence <= 1, what
                    assert target.mean.shape == (len(motion.state_names),), what
                    assert np.isfinite(target.mean).all(), what
                    assert np.isfinite(target.covariance).all(), what
                    assert target.weights.sum() == pytest.approx(1.0), what
            assert max(target.existence for target in belief.targets) > 0.5, what
            with pytest.raises(ElusiveError, match="sort"):
                tracker.step(belief, TIMES[0], None, rng)


def test_two_targets_among_false_peaks_are_each_found_by_a_users_own_sensor():
    rng, tracker = (
        np.random.default_rng(2),
        DetectionTracker(motion=ConstantVelocity(q=0.001), sensor=OwnPeaks(), particles=500, speed_sd_mps=0.5),
    )
    states = np.array([[4.0, 0.3, 5.0, 0.4], [20.0, -0.4, 12.0, 0.2]])
    belief = tracker.init(rng)
    for k in range(25):
        belief = tracker.step(belief, float(k), np.concatenate([peaks(rng, state, k) for state in states]), rng)
        states[:, [0, 2]] += states[:, [1, 3]]
    found = sorted(track.mean[0] for track in belief.tracks if track.status == "confirmed")
    np.testing.assert_allclose(found, sorted(states[:, 0] - states[:, 1]), atol=1.0)


def test_yaml_is_read_back_or_the_part_that_cannot_be_is_named(tmp_path):
    tracker = DetectionTracker(motion=ConstantVelocity(), sensor=RADAR, lifecycle={"confirm_frames": 4})
    path = tmp_path / "tracker.yaml"
    path.write_text(tracker.to_yaml())
    assert DetectionTracker.from_yaml(path) == tracker
    with pytest.raises(ParameterError, match=r"DetectionTracker\.sensor: holds a OwnPeaks"):
        tracker.replace(sensor=OwnPeaks()).to_yaml()
