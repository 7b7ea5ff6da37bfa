"""Ships beyond the unambiguous range, whose echoes come after the next pulse: they go straight only farther away."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import Array
from elusive.systems.radar.second_time import second_time_finding

TIMES_S, ERRORS, REACH_M, UNAMBIGUOUS_M = 2.5 * np.arange(160), (10.0, 3e-3), 8000.0, 9000.0


def recording(seed: int, beyond: int, times_s: Array = TIMES_S, *, turn: bool = False) -> dict[int, Array]:
    """Sightings of four ships and some beyond, numbered from 101, each slowly, now here, now there, or once, by far."""
    rng = np.random.default_rng([seed, 15])
    rows = dict[int, Array]()
    for number in [*range(4), *range(101, 101 + beyond)]:
        near = UNAMBIGUOUS_M if number > 100 else 0.0
        far, angle, course, speed = rng.uniform([1500, 0, 0, 4], [6000, 2 * np.pi, 2 * np.pi, 10])
        heading = course + np.cumsum(np.cumsum(rng.normal(0, 3e-5, len(times_s))))
        if turn:
            begin, lasts, circle = rng.uniform([0, 60, 180], [400, 150, 500])
            heading = course + rng.choice([-1, 1]) * 2 * np.pi / circle * (times_s - begin).clip(0, lasts)
        way = np.cumsum(2.5 * speed * np.column_stack([np.sin(heading), np.cos(heading)]), axis=0)
        places = (near + far) * np.array([np.sin(angle), np.cos(angle)]) + way
        r = np.hypot(*places.T) - near + rng.normal(0, ERRORS[0], len(times_s))
        b = np.arctan2(*places.T) + rng.normal(0, ERRORS[1], len(times_s))
        seen = (r > 100) & (r < REACH_M) & (rng.random(len(times_s)) < 0.85)
        rows[number] = np.column_stack([times_s, r * np.sin(b), r * np.cos(b)])[seen]
    return rows


def test_echoes_of_the_pulse_before_are_named_and_ships_are_not() -> None:
    found = [second_time_finding(recording(seed, 3), REACH_M, *ERRORS) for seed in range(4)]
    assert sum(not one.holds for one in found) >= 3
    for one in found:
        if not one.holds:
            assert "beyond the unambiguous range" in one.sentence
            names = one.sentence.split(" go")[0].split(" ", 1)[1].split(", ")
            assert sum(int(name) > 100 for name in names) > len(names) / 2
    assert all(second_time_finding(recording(seed, 0), REACH_M, *ERRORS).holds for seed in range(4))


@pytest.mark.thorough
def test_echoes_of_ships_that_turn_are_named_and_ships_that_turn_are_not() -> None:
    """A ship keeps its speed as it turns, and its echo, shown too near, does not seem to."""
    times_s = 2.5 * np.arange(220)
    named = [second_time_finding(recording(seed, 3, times_s, turn=True), REACH_M, *ERRORS) for seed in range(60, 63)]
    assert sum(not one.holds for one in named) >= 2
    assert all(second_time_finding(recording(seed, 0, times_s, turn=True), REACH_M, *ERRORS).holds for seed in (63, 64))


def test_what_rests_and_what_is_short_say_nothing() -> None:
    rng = np.random.default_rng(0)
    rows = recording(0, 3)
    places = np.array([3000.0, 2000.0]) + rng.normal(0, 10.0, (len(TIMES_S), 2))
    assert second_time_finding({1: np.column_stack([TIMES_S, places])}, REACH_M, *ERRORS).holds
    assert second_time_finding({number: one[:14] for number, one in rows.items()}, REACH_M, *ERRORS).holds
    assert second_time_finding({}, REACH_M, *ERRORS).holds


@pytest.mark.thorough
def test_what_lies_at_anchor_or_hardly_sails_is_no_ship_beyond() -> None:
    """It hardly changes its bearing, as what is far away, and that alone says nothing."""
    for seed in range(5):
        rng = np.random.default_rng([seed, 17])
        rows = {}
        for number in range(6):
            far, angle, along, aside = rng.uniform([1500, 0, -1, -0.5], [7000, 2 * np.pi, 1, 0.5])
            r = far + along * TIMES_S[:80] + rng.normal(0, ERRORS[0], 80)
            b = angle + aside / far * TIMES_S[:80] + rng.normal(0, ERRORS[1], 80)
            rows[number] = np.column_stack([TIMES_S[:80], r * np.sin(b), r * np.cos(b)])
        assert second_time_finding(rows, REACH_M, *ERRORS).holds, seed


def test_echoes_of_a_shore_that_go_here_and_there_are_no_ship() -> None:
    """Of one place and then another, mostly in range: another power of the acceleration explains them."""
    for seed in range(10):
        rng = np.random.default_rng([seed, 16])
        rows = {}
        for number in range(3):
            from_to = rng.normal(0, [40.0, 10.0], (4, 2))
            at = from_to[rng.integers(0, 4, 60)]
            places = np.array([0.0, 4000.0]) + at[:, ::-1] + rng.normal(0, [12.0, 10.0], (60, 2))
            places[:6] += [60.0, 40.0]
            rows[number] = np.column_stack([TIMES_S[:60], places])
        assert second_time_finding(rows, REACH_M, *ERRORS).holds, seed
