"""How much of an edge there is in a point, against what smooth shapes have exactly."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ndtr

from elusive.preprocess.ridges import BESIDE, ridge_about

SIZE, MIDDLE = 96, np.array([47.3, 46.6])
Y, X = np.mgrid[:SIZE, :SIZE].astype(float)


def across(angle: float, about: np.ndarray = MIDDLE) -> np.ndarray:
    """Distance of each pixel from a line through a place."""
    return np.asarray((X - about[0]) * math.cos(angle) + (Y - about[1]) * math.sin(angle))


@pytest.mark.parametrize("bright", [True, False])
@pytest.mark.parametrize("scale", [0.9, 2.0, 4.0])
def test_a_point_of_any_width_has_what_a_gaussian_has_beside_it(scale: float, bright: bool) -> None:
    away = BESIDE[0] * scale + BESIDE[1]
    for width in (scale, 1.5 * scale):
        frame = (30 if bright else -30) * np.exp(-(across(0) ** 2 + across(math.pi / 2) ** 2) / (2 * width**2))
        total = width**2 + scale**2  # of the point seen through the scale's own Gaussian
        expected = (1 - away**2 / (2 * total)) * math.exp(-(away**2) / (2 * total))
        # pixels sample the narrowest Gaussian to a hundredth
        assert ridge_about(frame, MIDDLE, scale, bright) == pytest.approx(expected, abs=0.01)
        assert math.isnan(ridge_about(frame, MIDDLE, scale, not bright))


@pytest.mark.parametrize("bright", [True, False])
@pytest.mark.parametrize("angle", [0.0, 0.4, 1.1, 2.5])
def test_a_line_and_the_summit_beside_an_edge_go_on_to_both_sides(angle: float, bright: bool) -> None:
    off, sign = across(angle), 1.0 if bright else -1.0
    way = np.array([math.cos(angle), math.sin(angle)])
    line = sign * np.exp(-(off**2) / (2 * 1.2**2))
    assert ridge_about(line, MIDDLE, 1.2, bright) == pytest.approx(1.0, abs=0.02)
    # an edge through optics of .6 px, and scale 1 of the filter: its bend is greatest at their joint deviation
    assert ridge_about(sign * ndtr(off / 0.6), MIDDLE + math.hypot(0.6, 1.0) * way, 1.0, bright) == pytest.approx(
        1.0, abs=0.05
    )


def test_at_the_border_the_side_that_is_seen_counts_and_what_is_masked_is_left_out() -> None:
    place = np.array([2.0, 40.0])
    line = np.exp(-(across(math.pi / 2, place) ** 2) / 2)
    point = line * np.exp(-(across(0, place) ** 2) / 2)
    assert ridge_about(line, place, 1.0, True) == pytest.approx(1.0, abs=0.02)
    assert abs(ridge_about(point, place, 1.0, True)) < 0.1
    masked = point.copy()
    masked[:, 4:] = np.nan
    assert abs(ridge_about(masked, place, 1.0, True)) < 0.2
    assert math.isnan(ridge_about(np.full((SIZE, SIZE), np.nan), place, 1.0, True))
    assert math.isnan(ridge_about(np.ones((SIZE, SIZE)), place, 1.0, True))
