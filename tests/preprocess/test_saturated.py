"""Rims of what is saturated: no peaks there, and all others as before."""

import numpy as np
import pytest

from elusive.preprocess import PeakFinder
from elusive.preprocess.saturated import rims_of

SHAPE, END = (192, 256), 255.0
ROWS, COLUMNS = np.indices(SHAPE)


def bell(x, y, sigma, height):
    return height * np.exp(-((COLUMNS - x) ** 2 + (ROWS - y) ** 2) / (2 * sigma**2))


def camera(scene, rng, noise=3.0):
    """What a camera of eight bits gives of a scene."""
    return np.clip(np.round(scene + rng.normal(0, noise, SHAPE)), 0, END).astype(np.uint8)


def sun(x, y, radius):
    """A disc far beyond the range, its glare about it."""
    away = np.hypot(COLUMNS - x, ROWS - y) - radius
    return 1000.0 / (1 + np.exp(2 * away)) + 60 * np.exp(-np.maximum(away, 0) / 10)


def found_in(frames):
    state, found = PeakFinder().init(), []
    for frame in frames:
        state = PeakFinder().step(state, frame)
        found.append(state.output)
    return found


def at(peaks, x, y, within_px=2.0):
    """Strength of the strongest peak at a place, 0 where there is none."""
    near = np.hypot(*(peaks.places_px - [x, y]).T) < within_px
    return float(peaks.strength[near].max(initial=0.0))


def test_a_suns_rim_has_no_peaks_and_a_point_beside_it_keeps_its_own():
    rng = np.random.default_rng(5)
    ways = 40 + 1.13 * np.arange(40)
    found = found_in(camera(80 + sun(x, 64, 13) + bell(x + 34, 64, 1.0, 30), rng) for x in ways)
    for peaks, x in zip(found, ways, strict=True):
        off = np.hypot(*(peaks.places_px - [x, 64]).T) - 13
        assert not ((peaks.scale_px < 1.2) & (np.abs(off) < 2)).any()
        assert not ((peaks.scale_px < 2.4) & (np.abs(off) < 1)).any()
    met = [at(peaks, x + 34, 64) > 5.5 for peaks, x in zip(found, ways, strict=True)]
    assert np.mean(met) > 0.9


@pytest.mark.parametrize("sigma", [1.0, 2.0, 4.0])
def test_a_target_that_is_saturated_itself_is_found(sigma):
    rng = np.random.default_rng(6)
    ways = 60 + 2.5 * np.arange(12)
    found = found_in(camera(80 + bell(x, 60, sigma, 600), rng) for x in ways)
    for peaks, x in zip(found, ways, strict=True):
        assert np.hypot(*(peaks.places_px[0] - [x, 60])) < 1.5
        assert peaks.strength[0] > 10


def test_what_passes_before_the_sun_is_found_as_a_hole_in_it():
    rng = np.random.default_rng(7)
    ways = 60 + 1.0 * np.arange(20)
    found = found_in(camera(np.minimum(80 + sun(70, 60, 24), 400) - bell(x, 58, 1.5, 350), rng) for x in ways)
    assert all(at(peaks, x, 58) > 5 for peaks, x in zip(found, ways, strict=True))


def test_a_point_in_a_sky_that_is_cut_off_is_found_everywhere():
    rng = np.random.default_rng(8)
    found = found_in(camera(-3 + bell(70, 60, 1.5, 80), rng) for _ in range(5))
    assert all(at(peaks, 70, 60) > 5 for peaks in found)


def test_levels_of_a_smooth_frame_are_no_plateaus():
    hill = np.round(bell(80, 64, 30, 20) + 100 + 0.1 * COLUMNS).astype(np.float32)
    assert np.count_nonzero(hill == hill.max()) > 100
    assert rims_of(hill, 1.0, 3) is None


def test_a_rim_is_known_in_any_units_of_either_sign_and_beside_gaps():
    rng = np.random.default_rng(9)
    frame = camera(80 + sun(70, 60, 13), rng).astype(np.float32)
    rims = rims_of(frame, 1.0, 3)
    assert rims is not None
    assert rims[0][60, 70 - 14]
    assert not rims[0][60, 70]
    assert not rims[0][60, 70 - 20]
    for other, quantum in ((-frame, 1.0), (frame * 1e-4 + 7, 1e-4)):
        again = rims_of(other.astype(np.float32), quantum, 3)
        assert again is not None
        assert all((one == two).all() for one, two in zip(rims, again, strict=True))
    frame[:4] = np.nan
    beside = rims_of(frame, 1.0, 3)
    assert beside is not None
    assert (beside[0] == rims[0]).all()
