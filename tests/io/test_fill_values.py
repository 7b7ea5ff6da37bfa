"""What files hold where nothing was measured is no measurement; what is bright is."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.io import open_frames, open_signal
from elusive.io.fill_values import without_fill

SCENE = np.random.default_rng(1).normal(1000, 25, (30, 40))


@pytest.mark.parametrize(
    "fill", [0.0, -9999.0, -32768.0, 65535.0, np.float32(9.969209968386869e36), 1e20, -3.4e38, -999.0]
)
def test_a_value_that_stands_for_none_is_nan(fill):
    values = SCENE.copy()
    values[:, :9] = fill
    np.testing.assert_array_equal(without_fill(values), np.where(np.arange(40) < 9, np.nan, SCENE))


def test_two_are_and_what_was_missing_stays():
    values = SCENE.copy()
    values[0, :4] = [-9999.0, -32768.0, np.nan, np.inf]
    found = without_fill(values)
    assert np.isnan(found[0, :3]).all()
    np.testing.assert_array_equal(np.delete(found.ravel(), [0, 1, 2]), np.delete(values.ravel(), [0, 1, 2]))


@pytest.mark.parametrize(
    "values",
    [
        SCENE,
        np.where(SCENE > 1060, 2000.0, SCENE),  # no custom
        np.where(np.arange(1200).reshape(30, 40) // 5 == 61, 0.0, SCENE),  # a target as dark as can be
        np.append(np.linspace(0, 60_000, 100), 65535.0),  # a saturated pixel with others on the way there
        np.array([0.0, 0.0, 65535.0]),  # black and white
        np.full(5, -9999.0),
        np.full(3, np.nan),
        np.empty(0),
    ],
)
def test_other_values_stay(values):
    np.testing.assert_array_equal(without_fill(values), values)


def test_frames_and_signals_are_read_without(tmp_path):
    frames = np.random.default_rng(2).normal(0, 3, (4, 20, 20)).astype(np.float32)
    frames[:, :, 5] = -32768
    np.save(tmp_path / "frames.npy", frames)
    for frame in open_frames(tmp_path / "frames.npy"):
        np.testing.assert_array_equal(np.isnan(frame), np.arange(20)[None] == np.full((20, 1), 5))
    np.save(tmp_path / "signal.npy", frames.reshape(4, 400))
    assert all(np.isnan(frame.samples).sum() == 20 for frame in open_signal(tmp_path / "signal.npy"))
