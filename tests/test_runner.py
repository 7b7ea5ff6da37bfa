"""The one loop, and the dataset made of what it yields."""

from __future__ import annotations

from itertools import count, islice
from typing import NamedTuple

import numpy as np
import pytest

from elusive import DataError, collect, run


class Tally(NamedTuple):
    existence: float
    mean: np.ndarray
    covariance: np.ndarray


class Adder:
    """A filter that adds up what it is given, and draws once a step."""

    def init(self, rng):
        return Tally(0.0, np.zeros(2), np.eye(2))

    def step(self, state, measurement, rng):
        drawn = rng.random()
        if measurement is None:
            return state._replace(existence=drawn)
        return Tally(drawn, state.mean + measurement, state.covariance * 2)


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
