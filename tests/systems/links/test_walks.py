"""Random paths: what table 3.1 says of them, in any area."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.errors import ParameterError
from elusive.geometry.areas import Area
from elusive.systems.links.walks import Walks
from tests.longer import longer

L_SHAPE = Area(corners_m=((0, 0), (40, 0), (40, 10), (10, 10), (10, 40), (0, 40)))
SQUARE = Area.rectangle(-12, 12, -12, 12)
HALL = Area.rectangle(-500, 500, -500, 500)


def present(path):
    return np.isfinite(path).all(axis=1)


@pytest.mark.parametrize("area", longer([SQUARE, L_SHAPE], SQUARE))
def test_people_come_in_once_at_the_border_and_stay_inside(area):
    paths = Walks(users=200, area=area, total_positions=100).draw(np.random.default_rng(0))
    assert paths.shape == (100, 200, 2)
    for path in paths.transpose(1, 0, 2):
        there = np.flatnonzero(present(path))
        assert len(there)
        assert there[-1] - there[0] + 1 == len(there)
        assert area.contains(path[there]).all()
        assert abs(area.depth_m(path[there[:1]])[0]) < 1e-9
        steps = np.hypot(*np.diff(path[there], axis=0).T)
        assert np.all((np.abs(steps - 0.85) < 1e-9) | (steps == 0))
    entrances = np.array([path[present(path)][0] for path in paths.transpose(1, 0, 2)])
    starts = np.array([np.flatnonzero(present(path))[0] for path in paths.transpose(1, 0, 2)])
    assert starts.mean() == pytest.approx(49.5, abs=4 * 100 / math.sqrt(12 * 200))
    if area is SQUARE:
        for axis, side in ((0, -12), (0, 12), (1, -12), (1, 12)):
            share = (np.abs(entrances[:, axis] - side) < 1e-9).mean()
            assert share == pytest.approx(0.25, abs=4 * math.sqrt(0.1875 / 200))


def test_who_leaves_is_gone_at_the_next_step_across_the_border():
    """Straight in and straight out: a chord of the square."""
    model = Walks(users=50, mean_distance_steps=1e9, entrance_deg=0, latest_entrance=0, standing_probability=0)
    paths = model.draw(np.random.default_rng(1))
    assert present(paths.transpose(1, 0, 2).reshape(-1, 2)).sum() == 50 * (math.floor(24 / 0.85) + 1)


def test_stretches_turns_and_stands_are_as_long_as_asked():
    model = Walks(
        users=40,
        area=HALL,
        total_positions=400,
        mean_distance_steps=8,
        turn_deg=90,
        standing_probability=0.4,
        mean_standing_steps=5,
        latest_entrance=0,
        entrance_deg=0,
    )
    turns, stretches, stands = [], [], []
    for path in model.draw(np.random.default_rng(2)).transpose(1, 0, 2):
        steps = np.diff(path[present(path)], axis=0)
        moving = np.hypot(*steps.T) > 0
        heading = np.degrees(np.arctan2(steps[moving, 1], steps[moving, 0]))
        turn = (np.diff(heading) + 180) % 360 - 180
        turns.extend(turn[np.abs(turn) > 1e-6])
        stretches.extend(np.diff(np.flatnonzero(np.abs(turn) > 1e-6)))
        edges = np.flatnonzero(np.diff(np.concatenate([[True], moving, [True]]).astype(int)))
        stands.extend(edges[1::2] - edges[::2])
    assert np.abs(turns).max() < 90
    assert np.std(turns) == pytest.approx(180 / math.sqrt(12), rel=0.1)
    assert np.mean(stretches) == pytest.approx(8, rel=4 / math.sqrt(len(stretches)))
    assert np.mean(stands) == pytest.approx(5, rel=4 / math.sqrt(len(stands)) + 0.02)
    assert len(stands) / len(turns) == pytest.approx(0.4, abs=0.08)


def test_one_seed_one_draw():
    draw = [Walks().draw(np.random.default_rng(seed)) for seed in (3, 3, 4)]
    np.testing.assert_array_equal(draw[0], draw[1])
    assert not np.array_equal(draw[0], draw[2], equal_nan=True)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"users": 0}, "Walks.users: must be greater than or equal to 1"),
        ({"step_distance_m": 0}, "Walks.step_distance_m: must be greater than 0"),
        ({"latest_entrance": 150}, "latest_entrance: step 150 is after the last, 149"),
        ({"standing_probability": 1.0}, "Walks.standing_probability: must be less than 1"),
    ],
)
def test_bad_parameters_are_refused(given, sentence):
    with pytest.raises(ParameterError, match=sentence):
        Walks(**given)
