"""A track's life, read from existence: tables of what must come out of what goes in."""

from __future__ import annotations

from typing import Any

import pytest

from elusive.errors import ParameterError
from elusive.tracking import Life, Lifecycle

HITS = {"confirm_frames": 2, "confirm_window": 4, "delete_frames": 3}
LETTERS = {None: ".", "candidate": "c", "confirmed": "C", "deleted": "x"}


def lived(existence: list[float], **levels: Any) -> list[Life]:
    lifecycle = Lifecycle(**levels)
    life, born, lives = Life(), 0, []
    for value in existence:
        life, born = lifecycle.step(life, value, born)
        lives.append(life)
    return lives


def shown(states: list[Life]) -> str:
    """One letter a frame with the number of its track: '.', 'c1', 'C1', 'x1'."""
    return " ".join(LETTERS[state.status] + ("" if state.track is None else str(state.track)) for state in states)


@pytest.mark.parametrize(
    ("existence", "levels", "expected"),
    [
        ([], {}, ""),
        ([0.0, 0.3, 0.49], {}, ". . ."),
        ([0.5, 0.6, 0.3], {}, "c1 c1 c1"),  # the level itself begins a track, and a candidate outlives a dip
        ([0.95, 0.95, 0.95, 0.6], {}, "c1 c1 C1 C1"),  # three in a row confirm; once confirmed it stays so
        ([0.9, 0.9, 0.9], {}, "c1 c1 C1"),  # the level itself counts
        ([0.95, 0.95, 0.8, 0.95, 0.95, 0.95], {}, "c1 c1 c1 c1 c1 C1"),  # a break begins the count anew
        ([0.95, 0.95, 0.95, 0.2, 0.19, 0.1], {}, "c1 c1 C1 C1 x1 ."),  # at the level it lives, under it it ends
        ([0.6, 0.1, 0.1], {}, "c1 x1 ."),  # a candidate ends without having been confirmed
        ([0.6, 0.1, 0.6, 0.1, 0.6], {}, "c1 x1 c2 x2 c3"),  # each comes back under a new number, at once
        ([0.95, 0.1, 0.95, 0.95, 0.95], {}, "c1 x1 c2 c2 C2"),  # frames before the deletion do not confirm the next
        ([0.95], {"confirm_frames": 1}, "C1"),
        ([0.95, 0.1, 0.95], {"confirm_frames": 1}, "C1 x1 C2"),
        ([0.5, 0.5, 0.49, 0.5], {"delete_below": 0.5}, "c1 c1 x1 c2"),  # no hysteresis is allowed
        ([1.0, 1.0, 0.0], {"confirm_from": 1.0, "confirm_frames": 2, "delete_below": 0.0}, "c1 C1 C1"),  # never deleted
        # of a tracker of detections: hits and misses
        ([1, 0, 0, 1, 0, 0, 0, 1], {**HITS, "drop_frames": 3}, "c1 c1 c1 C1 C1 C1 x1 c2"),
        ([1, 0, 1, 1, 0, 0, 1, 0, 0, 0], HITS, "c1 x1 c2 C2 C2 C2 C2 C2 C2 x2"),  # a candidate ends by one miss
        ([1, 0, 0, 0, 1], {**HITS, "delete_frames": 9, "drop_frames": 9}, "c1 c1 c1 c1 c1"),  # the first is too old
        ([0.95] * 4, {"candidate_from": 0.9, "confirm_from": 0.96}, "c1 c1 c1 c1"),
    ],
)
def test_a_life_is_read_from_existence(existence: list[float], levels: dict[str, Any], expected: str) -> None:
    assert shown(lived(existence, **levels)) == expected


def test_tracks_are_counted_and_their_numbers_never_used_twice() -> None:
    states = lived([0.6, 0.1] * 50)
    numbers = [state.track for state in states if state.status == "candidate"]
    assert numbers == list(range(1, 51))


@pytest.mark.parametrize(
    "levels",
    [
        {"candidate_from": 0.95},  # above confirm_from
        {"delete_below": 0.6},  # above candidate_from
        {"confirm_from": 0.1},
    ],
)
def test_levels_out_of_order_are_refused(levels: dict[str, float]) -> None:
    with pytest.raises(ParameterError, match=r"^Lifecycle: the levels must be in order: delete_below <= candidate_fro"):
        Lifecycle(**levels)


@pytest.mark.parametrize(
    ("levels", "sentence"),
    [
        ({"confirm_frames": 0}, "confirm_frames: must be greater than or equal to 1"),
        ({"delete_below": -0.1}, "delete_below: must be greater than or equal to 0"),
        ({"confirm_from": 1.1}, "confirm_from: must be less than or equal to 1"),
        ({"confirm_form": 0.8}, "did you mean 'confirm_from'"),
    ],
)
def test_levels_out_of_bounds_are_refused(levels: dict[str, float], sentence: str) -> None:
    with pytest.raises(ParameterError, match=sentence):
        Lifecycle(**levels)


def test_a_window_shorter_than_the_updates_that_confirm_is_refused() -> None:
    with pytest.raises(ParameterError, match="confirm_window: must be at least confirm_frames"):
        Lifecycle(confirm_frames=3, confirm_window=2)


def test_targets_share_the_numbers_and_a_tracker_s_own_tests_have_their_say() -> None:
    lifecycle = Lifecycle(confirm_frames=1)
    first, born = lifecycle.step(Life(), 0.95, 0, believed=False)
    assert (first.track, first.status) == (1, "candidate")
    second, born = lifecycle.step(Life(), 0.95, born)
    assert (second.track, second.status, born) == (2, "confirmed", 2)
    first, born = lifecycle.step(first, 0.95, born)
    second, born = lifecycle.step(second, 0.95, born, gone=True)
    assert (first.status, second.status, born) == ("confirmed", "deleted", 2)
    assert first.lives
    assert not second.lives
    assert lifecycle.step(Life(), 0.95, born, gone=True) == (Life(recent=1), 2)  # what has gone is given no number
