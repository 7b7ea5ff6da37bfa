"""The one loop, and the dataset made of what it yields."""

from __future__ import annotations

import math
from itertools import count, islice
from typing import NamedTuple

import numpy as np
import pytest

from elusive import DataError, collect, run
from elusive.contracts import interval_since


class Tally(NamedTuple):
    time_s: float
    existence: float
    mean: np.ndarray
    covariance: np.ndarray


class Adder:
    """A filter that adds up what it is given, and draws once a step."""

    def init(self, rng, time_s=math.nan):
        return Tally(time_s, 0.0, np.zeros(2), np.eye(2))

    def step(self, state, time_s, measurement, rng):
        drawn = rng.random()
        if measurement is None:
            return state._replace(time_s=time_s, existence=drawn)
        return Tally(time_s, drawn, state.mean + measurement, state.covariance * 2)


class Bare(NamedTuple):
    mean: np.ndarray


def test_states_come_one_a_measurement_in_order():
    states = list(run(Adder(), [1.0, None, 2.0], np.random.default_rng(0)))
    assert [state.mean[0] for state in states] == [1.0, 1.0, 3.0]
    drawn = np.random.default_rng(0).random(3)
    assert [state.existence for state in states] == list(drawn)


def test_the_loop_is_lazy_over_a_stream_without_end():
    asked = []

    def stream():
        for value in count():
            asked.append(value)
            yield float(value)

    states = list(islice(run(Adder(), stream(), np.random.default_rng(0)), 3))
    assert len(states) == 3
    assert asked == [0, 1, 2]


class Scan(NamedTuple):
    time_s: float
    value: float

    def __radd__(self, other):
        return other + self.value


def test_times_are_the_measurements_own_else_those_given_else_seconds():
    rng = np.random.default_rng(0)
    assert [state.time_s for state in run(Adder(), [1.0, None, 2.0], rng)] == [0, 1, 2]
    assert [state.time_s for state in run(Adder(), [1.0, None, 2.0], rng, [3.0, 3.5, 9.0])] == [3, 3.5, 9]
    own = [Scan(7.0, 1.0), Scan(8.5, 1.0)]
    assert [state.time_s for state in run(Adder(), own, rng)] == [7, 8.5]
    gapped = [own[0], None, own[1]]
    assert [state.time_s for state in run(Adder(), gapped, rng, [7.0, 8.0, 8.5])] == [7, 8, 8.5]
    with pytest.raises(DataError, match="measurement 1: has no time_s, as earlier ones have; give times_s"):
        list(run(Adder(), gapped, rng))
    with pytest.raises(DataError, match="times_s: ends before measurement 1"):
        list(run(Adder(), [1.0, 2.0], rng, [0.0]))


def test_the_belief_starts_when_it_is_said_to():
    started = []

    class Noting(Adder):
        def init(self, rng, time_s=math.nan):
            started.append(time_s)
            return super().init(rng, time_s)

    for given in ({}, {"start_s": -2.0}):
        list(run(Noting(), [1.0], np.random.default_rng(0), **given))
    assert math.isnan(started[0])
    assert started[1] == -2.0


def test_an_interval_is_forwards_or_refused():
    assert interval_since(math.nan, 5.0) == 0.0
    assert interval_since(5.0, 5.0) == 0.0
    assert interval_since(5.0, 5.25) == 0.25
    with pytest.raises(DataError, match="measurement at 4 s: comes after 5 s; sort the measurements by time"):
        interval_since(5.0, 4.0)
    with pytest.raises(DataError, match=r"time_s: a measurement's time must be finite \(got nan\)"):
        interval_since(5.0, math.nan)


def test_no_measurement_no_state():
    assert list(run(Adder(), [], np.random.default_rng(0))) == []


def test_collect_labels_what_was_reported():
    data = collect(run(Adder(), [1.0, 2.0], np.random.default_rng(0)), state_names=["x", "y"], times_s=[0.5, 1.5])
    assert dict(data.sizes) == {"time": 2, "state": 2, "state_": 2}
    assert data["mean"].sel(state="y").values.tolist() == [1.0, 3.0]
    assert data["covariance"].sel(time=1.5, state="x", state_="x") == 4.0
    assert data["existence"].dtype == np.float64
    assert data["time"].attrs["units"] == "s"
    assert data["time"].values.tolist() == [0.5, 1.5]


def test_collect_takes_what_is_there_and_numbers_the_rest():
    data = collect([Bare(np.arange(3.0))] * 2)
    assert set(data.data_vars) == {"mean"}
    assert data["state"].values.tolist() == ["s0", "s1", "s2"]
    assert data["time"].values.tolist() == [0.0, 1.0]
    assert collect(run(Adder(), [Scan(7.0, 1.0)], np.random.default_rng(0)))["time"].values.tolist() == [7.0]


@pytest.mark.parametrize(
    ("states", "names", "times", "words"),
    [
        ([], None, None, "nothing to collect: no state came"),
        ([(1, 2)], None, None, "report none of existence, mean, covariance"),
        ([Bare(np.zeros(2))], ["x"], None, "state_names: 1 names were given for 2 components"),
        ([Bare(np.zeros(2))], None, [1.0, 2.0], "times_s: 2 times were given for 1 states"),
    ],
)
def test_collect_refuses_what_does_not_fit(states, names, times, words):
    with pytest.raises(DataError, match=words):
        collect(states, state_names=names, times_s=times)
