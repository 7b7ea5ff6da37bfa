"""Radar video as spokes: what contradicts itself is named, parts are joined."""

from __future__ import annotations

import doctest
import math

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.sensors import spokes as module
from elusive.sensors.spokes import Spokes, check_spokes, join_spokes


def made(n: int = 8, m: int = 16, bits: int = 4) -> Spokes:
    rng = np.random.default_rng(n)
    return Spokes(
        time_s=np.arange(n) / 100,
        azimuth_rad=2 * np.pi * np.arange(n) / 64,
        from_north=False,
        start_m=5.0,
        step_m=10.0,
        amplitude=rng.integers(0, 2**bits, (n, m), dtype=np.uint8),
        bits=bits,
        heading_rad=np.full(n, np.nan),
        lonlat_deg=np.full((n, 2), np.nan),
    )


def test_the_example_runs():
    assert doctest.testmod(module).failed == 0


def test_ranges_and_the_top():
    spokes = check_spokes(made())
    np.testing.assert_array_equal(spokes.range_m[:3], [5, 15, 25])
    assert spokes.top == 15
    assert math.isinf(spokes._replace(amplitude=spokes.amplitude.astype(np.float32), bits=0).top)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"amplitude": np.zeros(8, np.uint8)}, "shape"),
        ({"amplitude": np.zeros((0, 16), np.uint8)}, "shape"),
        ({"amplitude": np.zeros((9, 16), np.uint8)}, "time_s has the shape"),
        ({"amplitude": np.zeros((8, 16))}, "float64"),
        ({"bits": 9}, "bits=9"),
        ({"bits": 0}, "bits=0"),
        ({"bits": 2}, "more than 2 bits"),
        ({"amplitude": np.full((8, 16), np.nan, np.float32), "bits": 0}, "not finite"),
        ({"step_m": 0.0}, "step_m"),
        ({"start_m": math.nan}, "start_m"),
        ({"time_s": np.arange(8)[::-1] / 1.0}, "backwards"),
        ({"azimuth_rad": np.full(8, 7.0)}, "azimuth_rad"),
        ({"lonlat_deg": np.full((8, 2), 181.0)}, "lonlat_deg"),
        ({"heading_rad": np.zeros(3)}, "heading_rad has the shape"),
    ],
)
def test_a_contradiction_is_a_sentence(change, said):
    with pytest.raises(DataError, match=said):
        check_spokes(made()._replace(**change), "somewhere")


def test_parts_are_joined_again():
    spokes = made()
    joined = join_spokes([spokes.select_spokes(slice(0, 3)), spokes.select_spokes(np.arange(3, 8))])
    for before, after in zip(spokes, joined, strict=True):
        np.testing.assert_array_equal(before, after)
    with pytest.raises(DataError, match="differ"):
        join_spokes([spokes, spokes._replace(step_m=2.0)])
    with pytest.raises(DataError, match="one part"):
        join_spokes([])
