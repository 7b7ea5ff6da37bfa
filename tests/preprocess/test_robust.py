"""Medians of what is known are those of NumPy's slower function."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.preprocess.robust import median_of_known


@pytest.mark.parametrize("n", [1, 2, 5, 8])
@pytest.mark.filterwarnings("ignore:All-NaN slice")
def test_a_median_leaves_out_what_is_missing(n):
    rng = np.random.default_rng(n)
    values = np.where(rng.random((3, 40, n)) < 0.4, np.nan, rng.normal(size=(3, 40, n)))
    np.testing.assert_array_equal(median_of_known(values), np.nanmedian(values, axis=-1))
