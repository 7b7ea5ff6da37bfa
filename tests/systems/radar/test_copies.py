"""Tracks that are second echoes of others, and ships that sail in company, which are not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from elusive.contracts import Array
from elusive.systems.radar.copies import copies_finding
from tests.longer import longer

RANGE_SD_M, BEARING_SD, DETECTED, TURN_S, SCANS = 10.0, 2e-3, 0.85, 2.5, 120
TIMES_S = TURN_S * np.arange(SCANS)


def sailed(rng: np.random.Generator, place: Array, velocity: Array, wander: float = 0.02) -> Array:
    """Places of ships ``(SCANS, n, 2)`` whose velocities wander, each by itself [m s^-3/2]."""
    drawn = rng.normal(0, wander * TURN_S**0.5, (SCANS, *place.shape))
    return np.asarray(place + np.cumsum(TURN_S * (velocity + np.cumsum(drawn, axis=0)), axis=0))


def apart(rng: np.random.Generator, ships: int = 5) -> Array:
    angle = rng.uniform(0, 2 * np.pi, ships)
    speed = rng.uniform(4, 9, ships)[:, None]
    return sailed(rng, rng.uniform(-3000, 3000, (ships, 2)), speed * np.column_stack([np.sin(angle), np.cos(angle)]))


def lanes(rng: np.random.Generator) -> Array:
    """Two columns of three ships 400 m apart, one against the other; each keeps its station to 20 m."""
    along = 400.0 * np.arange(3)[:, None] * [0.6, 0.8]
    place = np.concatenate([along + np.array([-2000.0, -1500.0]), np.array([1500.0, 1800.0]) - along]) + rng.normal(
        0, 20, (6, 2)
    )
    return sailed(rng, place, np.repeat([[4.2, 5.6], [-3.0, -4.0]], 3, axis=0), 0.005)


def fairway(rng: np.random.Generator) -> Array:
    """Four ships come in on one bearing, four on others, as fast."""
    sight = np.array([0.6, 0.8])
    place = np.concatenate([sight * np.array([[2500], [3200], [4000], [4700]]), rng.uniform(-4000, 4000, (4, 2))])
    return sailed(rng, place, -6.5 * place / np.hypot(*place.T)[:, None], 0.005)


def tacking(rng: np.random.Generator) -> Array:
    """Ten boats of one speed that tack at the same moments."""
    heading = np.radians(np.where(TIMES_S // 60 % 2, 45, -45))
    way = np.cumsum(6 * TURN_S * np.column_stack([np.sin(heading), np.cos(heading)]), axis=0)
    return np.asarray(np.array([2000.0, -500.0]) + rng.normal(0, 400, (10, 2)) + way[:, None])


def abreast(rng: np.random.Generator) -> Array:
    """Five ships beside each other come straight on, the radar in their midst."""
    place = np.column_stack([np.cumsum(rng.uniform(200, 700, 5)) - 1100, np.full(5, -3000.0)])
    return sailed(rng, place, np.tile([0.0, 7.0], (5, 1)), 0.002)


def convoy(rng: np.random.Generator) -> Array:
    """Six ships that go exactly alike, and others."""
    close = sailed(
        rng, np.array([1500.0, -2000.0]) + rng.uniform(-1500, 1500, (6, 2)), np.tile([3.0, 6.0], (6, 1)), 0.0
    )
    return np.concatenate([close, apart(rng, 3)], axis=1)


def seen(rng: np.random.Generator, places: Array, radar: Array | None = None) -> list[Array]:
    """Ranges and bearings of each ship ``(SCANS, 2)``; NaN where it is missed."""
    off = places - (np.zeros(2) if radar is None else radar)
    exact = np.stack([np.hypot(off[..., 0], off[..., 1]), np.arctan2(off[..., 0], off[..., 1])], axis=-1)
    plots = exact + rng.normal(0, [RANGE_SD_M, BEARING_SD], exact.shape)
    plots[rng.random(plots.shape[:2]) > DETECTED] = np.nan
    return list(plots.transpose(1, 0, 2))


def judged(plots: list[Array]) -> tuple[bool, int, str]:
    """Whether no track is a copy, how many are, and what is said."""
    rows = [
        np.column_stack([TIMES_S, r * np.sin(b), r * np.cos(b)])[np.isfinite(r)] for r, b in (one.T for one in plots)
    ]
    found = copies_finding(dict(enumerate(rows, 1)), RANGE_SD_M, BEARING_SD)
    return found.holds, int(found.seen), found.sentence


@pytest.mark.parametrize("ships", longer([apart, lanes, fairway, tacking, abreast, convoy], lanes, tacking, convoy))
def test_ships_in_company_are_no_copies(ships: Callable[[np.random.Generator], Array]) -> None:
    """In ten recordings of each kind; told by the shape of tracks alone, nine of 24 were accused."""
    for seed in range(10):
        rng = np.random.default_rng([seed, 61])
        assert judged(seen(rng, ships(rng)))[0], seed


def echo(rng: np.random.Generator, plots: Array, way: Callable[[Array], Array]) -> Array:
    """A second echo with the range error of the first, in three of four scans."""
    found = way(plots) + rng.normal(0, [0.0, BEARING_SD], plots.shape)
    found[rng.random(len(plots)) > 0.75] = np.nan
    return np.asarray(found)


SINGLE: dict[str, Callable[[Array], Array]] = {
    "turned by 9 degrees": lambda plots: plots + np.radians([0, 9]),
    "bearing of 130 degrees": lambda plots: (
        np.where(np.isfinite(plots), [1.0, 0.0], np.nan) * plots + [5.0, np.radians(130)]
    ),
    "twice the range": lambda plots: plots * [2.0, 1.0],
}


@pytest.mark.parametrize("said", SINGLE)
def test_one_echo_of_one_ship_is_named_by_the_errors_it_shares(said: str) -> None:
    """Of ten ships; those that hardly near the radar, or whose echo is beside them, cannot be told."""
    named = 0
    for seed in range(10):
        rng = np.random.default_rng([seed, 62])
        places = np.concatenate([[[[1500.0, 1800.0]]] + TIMES_S[:, None, None] * [[[4.0, -6.0]]], apart(rng)], axis=1)
        plots = seen(rng, places)
        holds, copies, sentence = judged([*plots, echo(rng, plots[0], SINGLE[said])])
        named += not holds and said in sentence and copies == 1
    assert named >= 9


def test_side_lobes_of_a_ship_that_passes_by_are_named_though_its_range_hardly_changes() -> None:
    for seed in range(10):
        rng = np.random.default_rng([seed, 64])
        passes = np.array([1500.0, -450.0]) + TIMES_S[:, None, None] * [[[0.0, 3.0]]]
        places = np.concatenate([passes, apart(rng, 3)], axis=1)
        lobes = [(seen(rng, passes)[0] + np.radians([0, turn])) for turn in (-9, 8)]
        holds, copies, sentence = judged([*seen(rng, places), *lobes])
        assert not holds
        assert copies >= 2
        assert "side lobes" in sentence


def test_side_lobes_whose_bearings_err_more_are_named() -> None:
    """An echo by a side lobe is weaker and broader than its ship's."""
    for seed in range(10):
        rng = np.random.default_rng([seed, 65])
        passes = np.array([1500.0, -450.0]) + TIMES_S[:, None, None] * [[[1.0, 3.0]]]
        places = np.concatenate([passes, apart(rng, 3)], axis=1)
        wider = [[0.0, 2 * BEARING_SD]] * len(TIMES_S)
        lobes = [(seen(rng, passes)[0] + np.radians([0, turn]) + rng.normal(0, wider)) for turn in (-9, 8)]
        holds, copies, sentence = judged([*seen(rng, places), *lobes])
        assert not holds
        assert copies >= 2
        assert "side lobes" in sentence


@pytest.mark.parametrize("said", ["turned by 9 degrees", "bearing of 130 degrees"])
def test_one_echo_whose_errors_are_its_own_is_named_by_the_bends_of_its_range(said: str) -> None:
    """Of ten ships that pass by; bearings err twice as much as theirs."""
    named = 0
    for seed in range(10):
        rng = np.random.default_rng([seed, 67])
        passes = np.array([1200.0, 1500.0]) + TIMES_S[:, None, None] * [[[1.0, -9.0]]]
        plots = seen(rng, np.concatenate([passes, apart(rng)], axis=1))
        other = SINGLE[said](seen(rng, passes)[0]) + rng.normal(0, [[0.0, 1.7 * BEARING_SD]] * SCANS)
        other[rng.random(SCANS) > 0.75] = np.nan
        holds, _, sentence = judged([*plots, other])
        named += not holds and said in sentence
    assert named >= 9


def test_one_side_lobe_of_each_of_two_ships_is_named() -> None:
    """Each at its ship's range, which changes, and by itself like a ship in company; to different sides."""
    named = 0
    for seed in range(10):
        rng = np.random.default_rng([seed, 66])
        places = apart(rng, 3)
        ships = [np.array([[[1500.0, 1800.0]]]), np.array([[[-1800.0, 600.0]]])]
        lanes = [np.array([[[4.0, -6.0]]]), np.array([[[5.0, 4.0]]])]
        two = [start + TIMES_S[:, None, None] * lane for start, lane in zip(ships, lanes, strict=True)]
        wider = [[0.0, 2 * BEARING_SD]] * len(TIMES_S)
        lobes = [
            seen(rng, way)[0] + np.radians([0, turn]) + rng.normal(0, wider)
            for way, turn in zip(two, (-9, 14), strict=True)
        ]
        for lobe in lobes:
            lobe[rng.random(len(lobe)) > 0.6] = np.nan
        named += not judged([*seen(rng, np.concatenate([*two, places], axis=1)), *lobes])[0]
    assert named >= 8


def test_ships_twice_by_a_second_radar_or_antenna_are_named_though_no_error_is_shared() -> None:
    for seed in range(10):
        rng = np.random.default_rng([seed, 63])
        places = apart(rng)
        holds, copies, sentence = judged(seen(rng, places) + seen(rng, places, np.array([3000.0, 500.0])))
        assert not holds
        assert copies >= 3
        assert "two radars" in sentence
        turned = [one + np.radians([0, 20]) for one in seen(rng, places)]
        holds, copies, sentence = judged(seen(rng, places) + turned)
        assert not holds
        assert copies >= 3
        assert "turned by 20 degrees" in sentence


def test_nothing_is_said_of_tracks_that_are_seldom_seen_together() -> None:
    rng = np.random.default_rng(1)
    plots = seen(rng, apart(rng, 2))
    plots[1][14:] = np.nan
    assert judged(plots)[0]
