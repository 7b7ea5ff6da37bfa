"""What plainly moves against its scene is confirmed early; what rests, drifts with the scene or jumps is not."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import Array, X, Y
from elusive.tracking import Life, Lifecycle
from elusive.tracking.plain_motion import PlainMotion, Start
from elusive.tracking.superposed_state import Target

SLOW = Lifecycle(confirm_frames=8)
PLAIN = PlainMotion(Lifecycle(), reach=3.0)


def confirmed_at(places: Array, sd: float = 0.5, existence: float = 0.99, scene: Array | None = None) -> int | None:
    """Update, from 1, at which a track at places ``(T, 2)`` is confirmed early; None: never."""
    life, starts = Life(), {}
    for k, (x, y) in enumerate(places):
        life, _ = SLOW.step(life, existence, 0)
        mean = np.zeros(4)
        mean[[X, Y]] = x, y
        if scene is not None and k:
            starts = {track: start.carried(scene[k] - scene[k - 1], 0.0) for track, start in starts.items()}
        target = Target(life, existence, np.zeros((1, 4)), np.ones(1), mean, sd**2 * np.eye(4))
        ((target,), starts) = PLAIN.judged([target], starts)
        if target.life.status == "confirmed":
            return k + 1
        life = target.life
    return None


def straight(speed: float, updates: int = 7) -> Array:
    return speed * np.arange(updates)[:, None] * np.array([0.6, 0.8])


@pytest.mark.parametrize(
    ("speed", "sd", "update"),
    [
        # reach 3 and three deviations of a difference, 3 sqrt(2) sd, are passed
        (8.0, 0.5, 3),  # 16 > 5.1; at least as long as any other track
        (2.0, 0.5, 4),  # 6 > 5.1
        (2.0, 1.0, 5),  # 8 > 7.2
        (1.0, 1.0, None),  # 6 < 7.2
        (0.0, 0.1, None),
    ],
)
def test_a_track_is_confirmed_where_its_displacement_leaves_no_doubt(speed, sd, update):
    assert confirmed_at(straight(speed), sd) == update


def test_what_hardly_exists_is_not_confirmed():
    assert confirmed_at(straight(8.0), existence=0.8) is None


def test_what_is_carried_with_the_scene_rests():
    path = straight(4.0)
    assert confirmed_at(path, scene=path) is None
    assert confirmed_at(np.zeros((7, 2)), scene=path) is not None


def test_what_comes_back_has_jumped():
    assert confirmed_at(np.array([[0.0, 0], [20, 0], [9, 0]])) is None


def test_the_place_of_a_start_is_known_the_less_the_longer_it_is_carried():
    start = Start(np.zeros(2), 0.04 * np.eye(2))
    for _ in range(4):
        start = start.carried(np.array([1.0, -2.0]), 0.3)
    np.testing.assert_allclose(start.place, [4.0, -8.0])
    np.testing.assert_allclose(start.covariance, (0.04 + 4 * 0.09) * np.eye(2))
