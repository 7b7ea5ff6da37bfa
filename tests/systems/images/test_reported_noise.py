"""The report says how near the whitened pixels come to what the noise model takes them for."""

from __future__ import annotations

import numpy as np
import xarray as xr
from scipy.special import ndtri

from elusive.io import open_frames
from elusive.preprocess.background import LEVELS
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.results import QUANTILES
from elusive.systems.images.run import track_recording

FRAMES, ROWS, COLUMNS = 14, 60, 72


def test_gaussian_frames_are_reported_as_gaussian(tmp_path):
    rng = np.random.default_rng(0)
    scene = 20.0 * np.add.outer(np.sin(np.arange(ROWS) / 9.0), np.cos(np.arange(COLUMNS) / 7.0))
    np.save(tmp_path / "frames.npy", 100.0 + scene + 3.0 * rng.standard_normal((FRAMES, ROWS, COLUMNS)))
    parameters = ImageTracking(filter={"kind": "single", "particles": 200, "newborns": 100})

    outcome = track_recording(open_frames(tmp_path / "frames.npy"), parameters, tmp_path / "out")

    assert any(name.startswith("Whitened pixels at") for name, _ in outcome.tracked.rows)
    with xr.open_dataset(tmp_path / "out" / "result.nc") as result:
        quantiles = np.column_stack([result[f"step_{name}"].values for name in QUANTILES])
    assert quantiles.shape == (FRAMES, len(LEVELS))
    assert np.isnan(quantiles[0]).all()
    # in the middle 98 %; the noise is the largest of three estimates, so that the pixels come out a little small
    middle = slice(1, -1)
    found = np.nanmean(quantiles[8:], axis=0)[middle]
    np.testing.assert_allclose(found, ndtri(LEVELS)[middle], atol=0.6)
    assert (np.abs(found) <= np.abs(ndtri(LEVELS)[middle]) + 0.15).all()
