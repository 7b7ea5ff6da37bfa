"""Powers of an emitter's motion, found by the evidence of its path: those it flew with, and none of bearings of two."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.metrics.consistency import squared_deviations
from elusive.motion import ConstantVelocity
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearings import BearingSensors
from elusive.systems.bearings.live_checks import checked
from elusive.systems.bearings.live_fit import FIRST
from elusive.systems.bearings.live_one import OneFit
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import powers_found
from elusive.systems.bearings.track import track, track_labelled
from elusive.tracking.memory import Memory
from tests.longer import longer

PLACES = ((-400.0, -350.0, 0.0), (450.0, -300.0, 0.0), (380.0, 420.0, 0.0), (-420.0, 380.0, 0.0))
SITES = SensorSites(("sw", "se", "ne", "nw"), np.array(PLACES))
SENSORS = BearingSensors(positions_m=PLACES, sigma_deg=1.0)
ONE = BearingTracking(sigma_deg=1.0, emitters={"kind": "one"})


def flown(seed: int, q: float, times: int = 60) -> tuple[np.ndarray, list[BearingSet]]:
    """States of an emitter that flies as the motion says, ``(times, 4)``, and what is heard of it."""
    rng, motion = np.random.default_rng([seed, 31]), ConstantVelocity(q=q)
    states = [np.array([[rng.uniform(-100, 100), 5.0, rng.uniform(-100, 100), -5.0]])]
    for _ in range(times - 1):
        states.append(motion.propagate(states[-1], 1.0, rng))
    way = np.concatenate(states)
    return way, SENSORS.simulate(way, np.arange(float(times)), rng)


@pytest.mark.parametrize("q", longer([0.05, 1.0, 30.0], 0.05))
def test_the_power_that_was_flown_is_found_and_a_little_more(q):
    """It is taken two deviations greater than it is likeliest: in 97.7 % it is at least what was flown."""
    found = np.array([powers_found(ONE, SITES, [flown(seed, q)[1]]).motion.q for seed in range(10)])
    assert (found < q).sum() <= 2  # of 10 by chance with 1e-3 more
    # sixty times, two axes: the logarithm's deviation is at least sqrt(2 / 120), and bearings tell less
    assert 1.0 < np.median(found) / q < 10.0


def test_ellipses_hold_an_emitter_that_manoeuvres_and_nothing_is_found_wrong():
    squares, told = [], []
    for seed in range(5):
        way, heard = flown(seed, 60.0)
        for q, kept in ((None, squares), (1.0, told)):
            steps = list(track(heard, ONE.replace(motion={"kind": "cv", "q": q}), SITES))
            off = np.array([step.tracks[0].mean[[0, 2]] for step in steps]) - way[:, [0, 2]]
            spread = np.array([step.tracks[0].covariance[np.ix_([0, 2], [0, 2])] for step in steps])
            kept.append(squared_deviations(off, spread).mean())
    # the mean of 5 flights of some 30 independent places each has a deviation of 2 / sqrt(150)
    assert np.mean(squares) < 2 + 4 * 2 / math.sqrt(150)
    assert np.mean(told) > 10
    steps = list(track(flown(0, 60.0)[1], ONE, SITES))
    assert all(one.holds for one in checked(ONE, SITES, steps))


def test_bearings_of_two_emitters_tell_no_power():
    """Each is heard at every second time: a path that fits them flies to and fro."""
    _, one = flown(5, 0.5)
    _, two = flown(6, 0.5)  # some 300 m away
    mixed = [one[k] if k % 2 else two[k] for k in range(len(one))]
    assert powers_found(ONE, SITES, [mixed]).motion.q == 1.0


def test_one_sensor_or_a_few_times_tell_no_power():
    _, heard = flown(3, 30.0)
    alone = [BearingSet(one.time_s, one.sensor[:1], one.azimuth_rad[:1], one.elevation_rad[:1]) for one in heard]
    for sets in (alone, heard[:5]):
        assert powers_found(ONE, SITES, [sets]).motion.q == 1.0
    assert powers_found(ONE, SITES, [heard[:5]]).elevations.q_vertical is None  # there are none


def test_what_is_given_is_kept():
    _, heard = flown(4, 30.0)
    given = ONE.replace(motion={"kind": "cv", "q": 0.25})
    assert powers_found(given, SITES, [heard]) == given
    turning = ONE.replace(motion={"kind": "ctrv"})
    assert powers_found(turning, SITES, [heard]) == turning


def test_each_labelled_emitter_moves_in_its_own_way():
    calm, wild = flown(5, 0.05)[1], flown(6, 50.0)[1]
    followed = track_labelled({"van": calm, "drone": wild}, ONE, SITES)
    assert followed["van"][1].motion.q < 2 < 20 < followed["drone"][1].motion.q


@pytest.mark.thorough
def test_live_it_is_learnt_never_below_the_usual_and_kept_over_a_restart():
    for q, least in ((0.01, 1.0), (50.0, 20.0)):
        heard = flown(7, q, 250)[1]
        fit, due = OneFit(ONE, SITES, heard[0]), []
        for number, one in enumerate(heard, 1):
            before = fit.parameters, fit.norths
            if fit.heed({1: one}):
                due.append(number)
                assert (fit.parameters, fit.norths) != before
        assert fit.parameters.motion.q >= least
        assert set(due) <= {FIRST, 2 * FIRST, 4 * FIRST, 8 * FIRST, 16 * FIRST}
    heard, flying = flown(8, 50.0, 90)[1], ONE.by("fixed-lag")
    whole = [step.tracks for step in track(heard, flying, SITES, live=True)]
    memory = Memory()
    begun = [step.tracks for step in track(heard[:45], flying, SITES, live=True, memory=memory)]
    ended = [step.tracks for step in track(heard, flying, SITES, live=True, memory=Memory(*memory.kept[:3]))]
    assert len(begun + ended) == len(whole)
    for one, other in zip(begun + ended, whole, strict=True):
        np.testing.assert_array_equal(one[0].mean, other[0].mean)
