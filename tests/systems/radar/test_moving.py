"""Tests of whether tracks move over ground."""

import math

import numpy as np
import pytest

from elusive.motion import ConstantVelocity
from elusive.sensors.radar import RadarSensor
from elusive.systems.radar.moving import (
    CHANCE,
    FILTER,
    LASTS_S,
    OFTEN,
    PRIOR,
    RESTING,
    ROCKS,
    SCATTER_M,
    STEADY_Q,
    WANDERS,
    Ways,
)
from elusive.systems.radar.parameters import RadarTracking, UnderWay
from elusive.systems.radar.track import track_radar

SPEED, SD, INTERVAL_S, SCANS = 1.0, 10.0, 2.0, 15
PLACES, H = [0, 2], np.eye(4)[[0, 2]]


def drawn(kinds: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Draw ways at rest, of rocks, of a steady velocity and of the tracker's motion, as the four models have them."""
    states = np.array([0.0, 1.0, 0.0, 1.0]) * rng.normal(0, SPEED, (len(kinds), 4)) * (kinds > ROCKS)[:, None]
    ways = [states]
    for _ in range(SCANS):
        steady, free = (
            motion.propagate(states, INTERVAL_S, rng) for motion in (ConstantVelocity(q=STEADY_Q), UnderWay())
        )
        rest = states + np.array([1.0, 0.0, 1.0, 0.0]) * rng.normal(0, math.sqrt(WANDERS * INTERVAL_S), states.shape)
        states = np.choose(kinds[:, None], [rest, rest, steady, free])
        ways.append(states)
    places, off, stays = np.array(ways), rng.normal(0, SCATTER_M, (len(kinds), 2)), math.exp(-INTERVAL_S / LASTS_S)
    for scan in places:
        scan[:, PLACES] += (kinds == ROCKS)[:, None] * off
        off = stays * off + math.sqrt(1 - stays**2) * rng.normal(0, SCATTER_M, off.shape)
    return places


def followed(ways: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return P(moves) after plots of ways ``(scans, n, 4)``, the tracker being a Kalman filter."""
    motion, error = UnderWay(), np.broadcast_to(SD**2 * np.eye(2), (ways.shape[1], 2, 2))
    F, Q, at_once = motion.F(INTERVAL_S), motion.Q(INTERVAL_S), np.zeros(ways.shape[1])
    plots = ways[..., PLACES] + rng.normal(0, SD, (*ways.shape[:2], 2))
    mean = np.insert(plots[0], [1, 2], 0.0, axis=1)
    covariance = np.tile(np.diag([SD, SPEED, SD, SPEED]) ** 2.0, (len(mean), 1, 1))
    told = Ways.of(mean, covariance, SPEED)
    assert told.moves == pytest.approx(0.5)  # one plot tells no velocity
    for plot in plots[1:]:
        told = told.predicted(mean, covariance, INTERVAL_S)
        mean, covariance = mean @ F.T, F @ covariance @ F.T + Q
        told = told.seen(mean, covariance, plot, error, at_once)
        gain = covariance @ H.T @ np.linalg.inv(H @ covariance @ H.T + error)
        mean = mean + (gain @ (plot - mean @ H.T)[..., None])[..., 0]
        covariance = covariance - gain @ H @ covariance
    return told.moves


def test_what_is_told_with_a_probability_moves_as_often() -> None:
    rng = np.random.default_rng(5)
    kinds = FILTER[rng.choice(5, 4000, p=PRIOR)]
    told = followed(drawn(kinds, rng), rng)
    for low, high in ((0, 0.2), (0.2, 0.8), (0.8, 1)):
        which = (told >= low) & (told <= high)
        sd = math.sqrt(float((told[which] * (1 - told[which])).sum()))
        assert which.sum() > 300
        assert abs((kinds[which] > ROCKS).sum() - told[which].sum()) < 3.5 * sd


@pytest.mark.parametrize("interval_s", [0.0, 1e-3, 60.0, 1e4])
def test_probabilities_stay_such_over_any_interval(interval_s: float) -> None:
    states = np.random.default_rng(1).normal(0, 5, (20, 4)), np.tile(np.diag([10.0, 3.0, 10.0, 3.0]), (20, 1, 1))
    told = Ways.of(*states, 8.0).predicted(*states, interval_s)
    assert told.share.sum(axis=1) == pytest.approx(1.0)
    assert (told.share >= 0).all()
    assert (np.linalg.eigvalsh(told.covariance) > -1e-9).all()


def test_a_buoy_rests_a_slow_ship_moves_and_one_that_anchors_comes_to_rest() -> None:
    """Tracks of a radar that errs by 10 m: all have velocities of metres a second at first."""
    times = np.arange(0.0, 240.0, 2.0)
    slow = np.stack([2000 + 0.8 * times, np.full_like(times, 0.8), np.full_like(times, 1000.0), 0 * times], axis=1)
    buoy = np.tile([-2000.0, 0.0, 500.0, 0.0], (len(times), 1))
    anchors = np.tile([0.0, 5.0, -2500.0, 0.0], (len(times), 1))
    anchors[:, 0] = 5 * np.minimum(times, 80.0)
    anchors[times >= 80, 1] = 0.0
    sensor = RadarSensor(
        bearing_sd_mrad=3, detection_probability=0.9, false_alarms=1, max_range_m=6000, max_doppler_mps=30
    )
    rng = np.random.default_rng(3)
    scans = (
        sensor.simulate(np.array(states), rng, time_s=time_s)
        for time_s, *states in zip(times, slow, buoy, anchors, strict=True)
    )
    parameters = RadarTracking(particles=500)
    found = {10.0: {}, 70.0: {}, 238.0: {}}
    for step in track_radar(scans, parameters.bind(sensor, None), parameters):
        if step.time_s in found:
            for track in step.tracks:
                x, y = track.mean[PLACES]
                name = "buoy" if x < -1000 else "anchors" if y < -1000 else "slow"
                found[step.time_s][name] = track.extra["moves"]
    assert found[70.0]["buoy"] < 0.01 > found[238.0]["buoy"]
    assert found[70.0]["anchors"] > 0.99
    assert found[238.0]["anchors"] < 0.1
    assert found[238.0]["slow"] > 0.99
    assert 0.1 < found[10.0]["slow"] < 0.9


def test_what_stands_is_weighed_by_how_often_plots_come_there() -> None:
    """By Bayes' rule: of the ways of echoes, beside those of ships."""
    told = Ways.of(np.zeros((2, 4)), np.tile(np.diag([10.0, 3.0, 10.0, 3.0]), (2, 1, 1)), 8.0)
    often = np.array([0.0, 0.6])
    ratio = (CHANCE + often) / (CHANCE + OFTEN)
    stands = told.stands * ratio / (told.stands * ratio + 1 - told.stands)
    weighed = told.among(often)
    assert weighed.stands == pytest.approx(stands)
    ship_at_rest = told.share[:, RESTING].sum(axis=1) - told.stands
    assert weighed.moves == pytest.approx(1 - stands - ship_at_rest * (1 - stands) / (1 - told.stands))
