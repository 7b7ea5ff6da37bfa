"""Four corners that move as one are one thing, at its middle."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.tracking.peak_boxes import boxes, leave_boxes
from tests.tracking.test_peak_bodies import targets_at

CORNERS = np.array([[-9.0, -6.0], [9.0, -6.0], [-9.0, 6.0], [9.0, 6.0]])
MIDDLE = np.array([70.0, 50.0])


def seen(places: np.ndarray, before: int = -1, velocity: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """What is shown of targets at places, and where, one of which was shown ``before``."""
    n = len(places)
    way = np.full((n, 2), 1.0) if velocity is None else velocity
    targets = targets_at(places, way, 8.0 - 0.1 * np.arange(n), np.ones(n, np.bool_))
    targets = targets._replace(level=np.zeros(n), origin=places, shown=np.arange(n) == before)
    shown = np.ones(n, np.bool_)
    boxed = leave_boxes(targets, shown, np.ones(n, np.bool_))
    assert not boxed.shows[~shown].any()
    return shown, places + boxed.way


def test_of_four_corners_the_middle_is_shown_by_the_one_that_was_before() -> None:
    rng = np.random.default_rng(0)
    places = MIDDLE + CORNERS + rng.uniform(-0.5, 0.5, (4, 2))
    for before in range(4):
        shown, at = seen(places, before)
        assert np.flatnonzero(shown).tolist() == [before]
        np.testing.assert_allclose(at[before], MIDDLE, atol=0.5)


def test_what_is_in_the_middle_is_shown_where_it_is() -> None:
    places = MIDDLE + np.vstack([CORNERS, [[0.0, -6.0], [1.0, 0.5]]])
    shown, at = seen(places, 2)
    assert np.flatnonzero(shown).tolist() == [5]
    np.testing.assert_array_equal(at[5], places[5])


def test_what_passes_behind_it_stays() -> None:
    places = MIDDLE + np.vstack([CORNERS, [[5.0, 3.0], [40.0, 0.0]]])
    velocity = np.array([[1.0, 1.0]] * 4 + [[-2.0, 0.5], [1.0, 1.0]])
    shown, _ = seen(places, 0, velocity)
    assert np.flatnonzero(shown).tolist() == [0, 4, 5]


@pytest.mark.parametrize(
    "spoilt",
    [
        MIDDLE + CORNERS[:3],
        MIDDLE + CORNERS * [[1, 1], [1, 1], [1, 1], [1.4, 1]],
        MIDDLE + CORNERS @ np.array([[0.8, -0.6], [0.6, 0.8]]),
        MIDDLE + 0.3 * CORNERS,
        MIDDLE + 8 * CORNERS,
    ],
    ids=["three", "not upright", "tilted", "small", "large"],
)
def test_what_is_no_upright_box_stays(spoilt: np.ndarray) -> None:
    shown, at = seen(spoilt)
    assert shown.all()
    np.testing.assert_array_equal(at, spoilt)


def test_what_goes_apart_is_none() -> None:
    shown, _ = seen(MIDDLE + CORNERS, velocity=np.array([[3.0, 0.0], [-3.0, 0.0], [0.0, 3.0], [0.0, -3.0]]))
    assert shown.all()


def test_what_moves_anywhere_makes_no_box() -> None:
    """Ten things that go alike, as a swarm does, in a frame: four at corners by chance are one swarm in a hundred."""
    rng, found = np.random.default_rng(1), 0
    for _ in range(400):
        places = rng.uniform(0, (160, 128), (10, 2))
        targets = targets_at(places, np.full((10, 2), 1.0), np.full(10, 8.0), np.ones(10, np.bool_))
        found += bool(boxes(targets._replace(level=np.zeros(10)), np.ones(10, np.bool_)))
    # 2520 boxes of four of ten, of which a fourth has sides that fit, by (2 * 4 px / 160) (2 * 4 px / 128) squared
    assert found <= 12
