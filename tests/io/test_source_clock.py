"""The clock of a source may be set back, and a time may be wrong: neither leaves a live run deaf."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io.sources import Feed, in_order, lines_of
from elusive.io.sources.clock import LASTS_S


def ordered(times, *, moves=True, paces=None, **known):
    """Hand over (time, name) as they come at those moments of this machine; what came out, and what was said."""
    said = []
    feed = Feed(say=said.append, **known)
    moments = iter(paces)
    items = [(time_s, number) for number, time_s in enumerate(times)]
    moved = (lambda item, by_s: (item[0] + by_s, item[1])) if moves else None
    found = in_order(items, lambda item: item[0], lambda item: item[1], feed, moved, lambda: next(moments))
    return list(found), feed.counts, said


def at_pace(times, moments=None):
    """The moments of the clock's making and of each item."""
    return [0.0, *(moments or times)]


def test_a_time_far_ahead_that_nothing_follows_is_left_out():
    times = [*range(10), 9e9, *range(10, 20)]
    found, counts, said = ordered(times, paces=at_pace(None, [0.1 * k for k in range(21)]))
    assert [time_s for time_s, _ in found] == list(range(20))
    assert counts["spoilt"] == 1
    assert "9e+09 s comes before one of 10 s" in said[0]


def test_a_jump_that_is_followed_and_one_at_the_end_are_times():
    times = [0.0, 1.0, 1e4, 1e4, 1e4 + 1, 3e4]
    found, counts, said = ordered(times, paces=at_pace(None, [0, 1, 2, 2, 3, 4]))
    assert [time_s for time_s, _ in found] == times
    assert not said
    assert not counts


def test_a_device_that_was_silent_is_heard_at_once():
    feed = Feed()
    moments = iter([0.0, 0.0, 1.0, 3600.0])
    items = iter([(0.0, 0), (1.0, 1), (3599.5, 2)])
    found = in_order(items, lambda item: item[0], lambda item: item[1], feed, None, lambda: next(moments))
    assert [next(found) for _ in range(3)][-1] == (3599.5, 2)  # nothing later was asked for


def test_a_clock_that_was_set_back_is_counted_on():
    before, after = [100.0 + 0.5 * k for k in range(20)], [0.5 * k for k in range(40)]
    moments = [0.5 * k for k in range(20)] + [40 + 0.5 * k for k in range(40)]  # silent for half a minute
    found, counts, said = ordered([*before, *after], paces=at_pace(None, moments))
    times = [time_s for time_s, _ in found]
    assert times[:20] == before
    assert counts["late"] == 10  # 5 s, until it is sure
    assert times[20:] == pytest.approx([140.0 + 0.5 * k for k in range(10, 40)])  # by this machine's time
    assert any("The source's clock went back" in sentence and "140.000 s are added" in sentence for sentence in said)


@pytest.mark.parametrize(("jumble_s", "hold_s"), [(0.3, 0.0), (0.3, 0.5), (2.5, 3.0)])
def test_so_is_one_whose_times_the_network_jumbles(jumble_s, hold_s):
    """A run was deaf from then on: three sensors, ten times a second, each a little late."""
    rng = np.random.default_rng(0)
    came = sorted((k / 10 + rng.uniform(0, jumble_s), k / 10) for k in range(1000) for _ in range(3))
    times = [time_s - 3600.0 * (time_s >= 60) for _, time_s in came]
    found, counts, _ = ordered(times, paces=at_pace(None, [moment for moment, _ in came]), hold_s=hold_s)
    assert counts["clock set back"] == 1
    heard = [number for time_s, number in found if time_s > 60]
    assert came[heard[0]][0] < 60 + LASTS_S + jumble_s + 0.1
    assert [time_s for time_s, _ in found] == pytest.approx([came[number][1] for _, number in found], abs=2 * jumble_s)
    if hold_s:
        assert counts["late"] < 30 * (LASTS_S + 2 * jumble_s)


def test_where_it_cannot_be_counted_on_that_is_said():
    times = [*range(100, 110), *range(10)]
    with pytest.raises(DataError, match=r"clock went back.*Start anew"):
        ordered(times, moves=False, paces=at_pace(None, list(range(20))))


@pytest.mark.parametrize(
    ("late", "moments"),
    [
        ([0.1 * k for k in range(300)], [10 + 0.05 * k / 3 for k in range(300)]),  # what waited, all at once
        ([5.0, 4.0] * 20, [10 + 0.5 * k for k in range(40)]),  # in no order
    ],
)
def test_what_comes_late_is_no_clock_that_was_set_back(late, moments):
    now = [100.0 + k for k in range(10)]
    found, counts, _ = ordered([*now, *late, 111.0], paces=at_pace(None, [*range(10), *moments, 31.0]))
    assert [time_s for time_s, _ in found] == [*now, 111.0]
    assert counts["late"] == len(late)


def test_one_sensor_whose_clock_lags_is_late_and_no_more():
    times = [part for k in range(40) for part in (100.0 + k, 50.0 + k)]
    found, counts, _ = ordered(times, paces=at_pace(None, [k / 2 for k in range(80)]))
    assert len(found) == 40
    assert "clock set back" not in counts


def test_a_run_that_goes_on_hears_a_clock_that_began_anew_meanwhile():
    times, moments = [0.5 * k for k in range(40)], [0.5 * k for k in range(40)]
    found, counts, _ = ordered(times, paces=at_pace(None, moments), known_s=1000.0, passed_s=1060.0)
    assert counts["clock set back"] == 1
    assert len(found) == 30
    assert found[0][0] >= 1060.0  # the tracker knows all until 1000 s, a minute ago


def test_a_run_that_goes_on_from_a_file_hears_one_of_a_new_clock(tmp_path):
    """The file is read from its start: what is known of it, or was there already, is no news."""
    path, said = tmp_path / "log.csv", []
    path.write_text("".join(f"{k / 2}\n" for k in range(100)))
    feed = Feed(idle_s=0.0, say=said.append, known_s=1000.0, passed_s=1060.0, again=True)
    assert feed.comes_again
    there = [float(text) for _, text in lines_of(str(path), feed)]
    assert not feed.comes_again  # its end is seen
    feed.comes_again = True

    def items():
        yield from there
        feed.comes_again = False
        yield from (50.0 + k / 2 for k in range(40))

    moments = iter([0.0, *[0.0] * len(there), *[k / 2 for k in range(40)]])
    found = list(in_order(items(), float, float, feed, lambda time_s, by_s: time_s + by_s, lambda: next(moments)))
    assert found[:100] == there  # which the tracker passes over
    assert feed.counts["late"] == 10  # 5 s, until it is sure
    assert len(found) == 100 + 30
    assert found[100] >= 1060.0
    assert "nothing but times before 1000 s has come" in said[-1]
