"""An emitter followed by every estimator, from bearings, times of arrival and both: within what is claimed."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from elusive.errors import DataError, ParameterError
from elusive.motion import ConstantVelocity
from elusive.sensors.arrival_times import ArrivalTimeSensors
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.hybrid import HybridSensors
from elusive.systems.bearings.locate import EmitterLocation
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.track import track
from tests.bearing_flight import NAMES, PLACES_M, STEPS, path
from tests.longer import longer

SITES = SensorSites(NAMES, np.array(PLACES_M))
SENSORS = BearingSensors(positions_m=PLACES_M, sigma_deg=0.5)
METRE_S = 1.0 / 299_792_458.0  # of light


def heard(seed=0, sensors=SENSORS, solid=False):
    times, states = path(solid)
    return sensors.simulate(states, times, np.random.default_rng(seed))


def off_and_spread(steps, states):
    """Errors and covariances over the ground while a place is known."""
    known = [k for k, step in enumerate(steps) if step.state.started]
    axes = [steps[0].state.state_names.index(axis) for axis in "xy"]
    off = np.array([steps[k].tracks[0].mean[axes] - states[k, [0, 2]] for k in known])
    return off, np.array([steps[k].tracks[0].covariance[np.ix_(axes, axes)] for k in known])


@pytest.mark.parametrize(
    ("name", "motion"),
    [
        ("map", "cv"), ("rts", "cv"), ("iekf", "cv"), ("ekf", "cv"), ("fixed-lag", "cv"), ("map", "ca"), ("map", "ct"),
        ("iekf", "ctrv"), ("fg-ekf", "cv"), ("fg-eks", "ca"), ("iekf", "imm"),
    ],
)  # fmt: skip
def test_the_flight_is_tracked(name, motion):
    kind = {"kind": motion} | ({"turn_rate_deg": 1.0} if motion == "ct" else {})
    parameters = BearingTracking(filter={"kind": name}, motion=kind, sigma_deg=0.5)
    times, states = path()
    squares, claimed = [], []
    for seed in range(3):
        steps = list(track(heard(seed), parameters, SITES))
        assert [step.time_s for step in steps] == times.tolist()
        off, spread = off_and_spread(steps, states)
        # a turn rate has to show itself first: a filter that knows of turns starts some seconds later
        assert len(off) >= (0.8 if motion in ("ctrv", "imm") else 0.9) * STEPS
        squares.append((off**2).sum(axis=1).mean())
        claimed.append(np.trace(spread, axis1=1, axis2=2).mean())
        assert np.hypot(*off.T).mean() < 3
        shown = [step.tracks[0] for step in steps if step.tracks]
        assert {found.track for found in shown} == {1}
        assert np.isnan([found.existence for found in shown]).all()  # it is known to be there: no posterior is computed
    # a track's errors hang together, so that three runs say little; the factor graph's deviations are too small
    assert np.mean(squares) < (10 if name.startswith("fg") else 2.5) * np.mean(claimed)


@pytest.mark.parametrize("name", ["map", "rts", "fixed-lag", "iekf", "ekf"])
def test_uneven_times_are_tracked_within_what_is_claimed(name):
    parameters = BearingTracking(
        motion={"kind": "cv", "q": 0.02}, filter={"kind": name, "loss": "squares"}, sigma_deg=0.5
    )
    motion, normalised = ConstantVelocity(q=0.02), []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        times = rng.uniform(0.2, 8.0, STEPS).cumsum()
        states = np.array([[-30.0, 0.3, 20.0, 0.2]])
        for interval_s in np.diff(times).tolist():
            states = np.vstack([states, motion.propagate(states[-1:], interval_s, rng)])
        off, spread = off_and_spread(list(track(SENSORS.simulate(states, times, rng), parameters, SITES)), states)
        assert len(off) > 0.8 * STEPS
        normalised.append((off * np.linalg.solve(spread, off[..., None])[..., 0]).sum(axis=1).mean())
    # chi-square of two, deviation 2, and at least ten independent errors a flight
    band = 4 * 2 / np.sqrt(80)
    assert np.mean(normalised) < 2 + band
    if name != "ekf":  # what it adds for the bend of bearings is of its wide prediction, and too much after long gaps
        assert np.mean(normalised) > 2 - band


@pytest.mark.parametrize("name", ["iekf", "ekf", "fg-ekf", "fg-eks"])
def test_live_and_a_recording_are_the_same_loop(name):
    # live norths are learnt, unless they are told to be exact
    exact = {} if name.startswith("fg") else {"bias": {"sd_deg": 0.001}}
    parameters = BearingTracking(filter={"kind": name, **exact}, motion={"kind": "cv", "q": 1.0}, sigma_deg=0.5)
    whole = list(track(heard(), parameters, SITES))
    taken = []

    def coming():
        for measurement in heard():
            taken.append(measurement)
            yield measurement

    for number, (step, expected) in enumerate(
        zip(track(coming(), parameters, SITES, live=True), whole, strict=True), 1
    ):
        assert len(taken) == number
        np.testing.assert_array_equal(step.state.mean, expected.state.mean)
        np.testing.assert_array_equal(step.state.covariance, expected.state.covariance)
        assert step.state.started == expected.state.started


@pytest.mark.parametrize(
    ("chosen", "names", "remark"),
    [
        ({}, ("x", "vx", "y", "vy", "z", "vz"), ""),
        ({"elevations": {"kind": "ignore"}}, ("x", "vx", "y", "vy"), ""),
        ({"filter": {"kind": "fg-eks"}}, ("x", "vx", "y", "vy"), "passed over: fg-eks is of two dimensions"),
        ({"motion": {"kind": "ctrv"}}, ("x", "vx", "y", "vy", "turn_rate"), "passed over: motion ctrv is of two"),
        ({"motion": {"kind": "imm"}}, ("x", "vx", "y", "vy", "z", "vz"), ""),
    ],
)
def test_elevations_are_used_where_motion_and_filter_have_heights(chosen, names, remark):
    parameters = BearingTracking(sigma_deg=0.5, **chosen)
    solid = heard(0, SENSORS.replace(dimensions=3), solid=True)
    assert list(track(solid[:8], parameters, SITES))[-1].state.state_names == names
    assert remark in " ".join(parameters.remarks(elevations=True))
    assert bool(remark) == bool([said for said in parameters.remarks(elevations=True) if "passed over" in said])


SENSED = {
    "toa": ArrivalTimeSensors(positions_m=PLACES_M, sigma_s=METRE_S),
    "tdoa": ArrivalTimeSensors(positions_m=PLACES_M, sigma_s=METRE_S, emission_known=False),
    "both": HybridSensors(
        bearings=SENSORS, arrivals=ArrivalTimeSensors(positions_m=PLACES_M, sigma_s=METRE_S, emission_known=False)
    ),
}


def arrivals_of(sense):
    return {"sigma_s": METRE_S, "emission_known": sense == "toa"}


@pytest.mark.parametrize(
    ("sense", "name"),
    longer(
        itertools.product(SENSED, ("map", "fixed-lag", "iekf")),
        ("toa", "fixed-lag"),
        ("toa", "iekf"),
        ("tdoa", "map"),
        ("both", "map"),
        ("both", "fixed-lag"),
    ),
)
def test_times_of_arrival_are_tracked_within_what_is_claimed(sense, name):
    parameters = BearingTracking(filter={"kind": name}, sigma_deg=0.5, arrivals=arrivals_of(sense))
    states = path()[1]
    normalised = []
    for seed in range(4):
        steps = list(track(heard(seed, SENSED[sense]), parameters, SITES))
        off, spread = off_and_spread(steps, states)
        assert len(off) >= 0.8 * STEPS
        normalised.append((off * np.linalg.solve(spread, off[..., None])[..., 0]).sum(axis=1).mean())
    # 2 if right; over some ten independent stretches of each of four flights the mean is within .9 of that
    assert np.mean(normalised) < 2.9


def test_the_factor_graph_is_of_bearings_alone():
    with pytest.raises(ParameterError, match="fg-eks: is of bearings alone"):
        list(track(heard(0, SENSED["toa"]), BearingTracking(filter={"kind": "fg-eks"}), SITES))


@pytest.mark.parametrize("sense", longer(SENSED, "toa", "both"))
def test_an_emitter_that_stays_is_located_by_times_of_arrival(sense):
    method = EmitterLocation(arrivals=arrivals_of(sense), sigma_deg=0.5)
    place = np.array([20.0, 0.0, 30.0, 0.0])
    squares, spreads = [], []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        sets = SENSED[sense].simulate(np.tile(place, (4, 1)), np.arange(4.0), rng)
        fix = method.of_arrivals(sets, SITES)
        off = fix.position_m - place[[0, 2]]
        squares.append(off @ np.linalg.solve(fix.covariance, off))
        spreads.append(np.trace(fix.covariance))
    assert np.mean(squares) == pytest.approx(2.0, abs=4 * 2 / np.sqrt(40))  # chi-square of two: deviation 2
    if sense == "toa":  # four arrivals of a metre at each of three sensors
        information = 4 * sum(
            np.outer(unit, unit) for unit in (place[[0, 2]] - np.array(PLACES_M)[:, :2])
            / np.linalg.norm(place[[0, 2]] - np.array(PLACES_M)[:, :2], axis=1)[:, None]
        )  # fmt: skip
        assert np.mean(spreads) == pytest.approx(np.trace(np.linalg.inv(information)), rel=0.02)


def test_too_few_arrivals_tell_no_place():
    rng = np.random.default_rng(0)
    two = SENSED["tdoa"].replace(positions_m=PLACES_M[:2])
    sets = two.simulate(np.tile([20.0, 0.0, 30.0, 0.0], (4, 1)), np.arange(4.0), rng)
    with pytest.raises(DataError, match="arrivals: are of 2 sensors, and a place needs 3"):
        EmitterLocation().of_arrivals(sets, SITES)
    with pytest.raises(ParameterError, match="stansfield: is of bearings alone"):
        EmitterLocation(estimator="stansfield").of_arrivals(sets, SITES)
