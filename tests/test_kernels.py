"""The kernels that rooms share: against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from elusive._kernels import BLOCK, add_product, exponentiate, take_logarithms


@pytest.mark.parametrize("n", [0, 1, BLOCK - 1, BLOCK, 3 * BLOCK + 5])
def test_exponentials_equal_numpys(n):
    values = np.random.default_rng(n).uniform(-700, 700, n)
    found = values.copy()
    exponentiate(found)
    np.testing.assert_allclose(found, np.exp(values), rtol=5e-16, atol=0)


def test_exponentials_of_extremes():
    values = np.array([0.0, -0.0, 700.0, -700.0, -700.1, -1e300, -np.inf, np.nan, 5e-324])
    exponentiate(values)
    np.testing.assert_allclose(values, [1, 1, np.exp(700), np.exp(-700), 0, 0, 0, np.nan, 1], rtol=5e-16, atol=0)


@pytest.mark.parametrize("n", [0, 1, BLOCK - 1, BLOCK, 3 * BLOCK + 5])
def test_logarithms_equal_numpys(n):
    values = np.exp(np.random.default_rng(n).uniform(-700, 700, n))
    found = values.copy()
    take_logarithms(found)
    np.testing.assert_allclose(found, np.log(values), rtol=5e-16, atol=0)


def test_logarithms_about_one_and_of_extremes():
    values = np.concatenate(
        [1 + np.linspace(-0.3, 0.5, 1001), [1.0, np.finfo(float).tiny, np.finfo(float).max, 2.0**-30]]
    )
    found = values.copy()
    take_logarithms(found)
    np.testing.assert_allclose(found, np.log(values), rtol=5e-16, atol=1e-17)


@pytest.mark.parametrize("factor", [-2.5, 0.0])
def test_a_product_is_added_in_place(factor):
    row, other = np.random.default_rng(0).normal(size=(2, 37))
    expected = row + factor * other
    add_product(row, factor, other)
    np.testing.assert_allclose(row, expected, rtol=1e-15, atol=1e-15)
    if factor == 0.0:
        add_product(row, factor, np.full(37, np.nan))
        np.testing.assert_array_equal(row, expected)
