"""A clutter map: kernels against twins; evidence that is exponential in any clutter, and what a fixed echo is."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import maximum_filter

from elusive.preprocess import _clutter_map_kernels as kernels
from elusive.preprocess.clutter_map import BINS, LOW, WIDTH, ClutterMap
from tests.reference import radar_video as twin

MAP = ClutterMap(sectors=4, bands=4)
SHAPE = (120, 160)


def test_cells_are_counted_and_judged_as_by_the_twin():
    rng = np.random.default_rng(1)
    level = rng.normal(0, 3, (20, 30)).astype(np.float32)
    level[3, 4] = np.nan
    mean, slope = rng.normal(0, 1, (2, 2, 30)).astype(np.float32)
    sector, part = np.repeat([0, 1], 10), np.repeat([0, 1, 2], 10)
    across = rng.uniform(-0.5, 0.5, 20).astype(np.float32)
    own, fixed = rng.normal(0, 1, level.shape).astype(np.float32), rng.random(level.shape) < 0.3
    beside, chosen = fixed & (rng.random(level.shape) < 0.5), rng.random(level.shape) < 0.6
    known = mean, slope, sector, across, part, own, fixed, beside
    middle, block = twin.expected(*known)
    counts = np.zeros((8, 60))
    kernels.count(level, chosen, *known, -6.0, 0.25, counts)
    by = np.where(chosen | fixed, np.where(fixed, np.where(beside, 6, 7), block), -1)
    assert np.abs(counts - twin.counted(level, middle, by, -6.0, 0.25, 0 * counts)).sum() <= 2  # at an edge
    table, found = np.sort(rng.exponential(size=(13, 60)), axis=1), np.full_like(level, -7)
    kernels.judge(level, chosen, *known, -6.0, 0.25, table, found)
    told = twin.judged(level, middle, block, -6.0, 0.25, table)
    np.testing.assert_allclose(found, np.where(chosen, told, -7), rtol=1e-4, atol=1e-5)
    level[5, 6], edge, sea = np.inf, rng.normal(0, 1, 6), np.zeros_like(fixed)
    middle, block = twin.expected(mean, slope, sector, across, part, own, sea, sea)
    stands = kernels.stands(level, mean, slope, sector, across, part, edge)
    assert (stands != (np.isfinite(level) & (level - middle > edge[block]))).sum() <= 2  # at an edge
    level[5, 6] = 0.0
    sums = np.zeros((5, 2, 30))
    kernels.sums(level, chosen & (level == level), sector, across, sums)
    np.testing.assert_allclose(sums, twin.summed(level, chosen & (level == level), sector, across), atol=1e-12)


@pytest.mark.parametrize("steps", [(0.0, 0.0), (0.2, 0.1)])
def test_levels_are_followed_as_by_the_twin(steps):
    rng = np.random.default_rng(2)
    level, own, quiet = rng.normal(0, 3, (3, 20, 30)).astype(np.float32)
    level[3, 4] = np.nan
    told = twin.followed(level, 0.3, *steps, 2.0, own, quiet)
    kernels.follow(level, 0.3, *steps, 2.0, own, quiet)
    np.testing.assert_allclose([own, quiet], told, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("reach", [1, 7])
def test_what_is_beside_cells_is_the_greatest_about_each(reach):
    rng = np.random.default_rng(3)
    for share in (0.0, 0.001, 0.02, 1.0):
        cells = rng.random((40, 50)) < share
        found = maximum_filter(cells, 2 * reach + 1, mode=("wrap", "nearest"))
        np.testing.assert_array_equal(kernels.widened(cells, reach), found)


def power_of(shape, rng, falls=3.0):
    """K clutter, mean falling with range, four looks a cell; other strength and shape in one half."""
    texture = rng.gamma(shape, 1 / shape, SHAPE)
    power = texture * rng.gamma(4.0, 0.25, SHAPE) * (1 + np.arange(SHAPE[1]) / 40) ** -falls
    power[: SHAPE[0] // 2] *= 20
    return power.astype(np.float32)


def learnt(draw, turns=30, clutter=MAP):
    state = None
    for _ in range(turns):
        state = clutter.learnt(state, draw())
    return state


@pytest.mark.parametrize("shape", [0.5, 1.0, 5.0, 100.0])
def test_evidence_is_exponential_whatever_the_clutter(shape):
    rng = np.random.default_rng(2)
    state = learnt(lambda: power_of(shape, rng))
    fresh = np.array([MAP.evidence(state, power_of(shape, rng)) for _ in range(60)])
    for level in (1.0, 2.5, 5.0):
        seen, expected = (fresh > level).mean(), np.exp(-level)
        cells = fresh.size * expected, 19 * fresh[0].size * expected  # that were seen, and that were learnt from
        assert seen == pytest.approx(expected, rel=4 * np.sqrt(1 / cells[0] + 1 / cells[1])), level
    # beyond what was counted: no more than twice what it says, and not far less
    for level in (8.0, 10.0):
        seen, expected = float((fresh > level).sum()), fresh.size * np.exp(-level)
        assert seen < 1.6 * expected + 4 * np.sqrt(expected), level
        assert seen > 0.25 * expected - 4 * np.sqrt(expected), level
    assert state.fixed.mean() < 1e-3


def test_clutter_that_rises_along_azimuth_is_no_stronger_at_the_edge_of_a_sector():
    """A sector's mean was a step: where the sea is strong upwind alone, edges of sectors were sure ships."""
    rng = np.random.default_rng(5)
    wind = np.exp(1.5 * np.cos(2 * np.pi * np.arange(SHAPE[0]) / SHAPE[0]))[:, None].astype(np.float32)
    clutter = MAP.replace(sectors=8)
    state = learnt(lambda: wind * rng.exponential(size=SHAPE).astype(np.float32), clutter=clutter)
    fresh = [clutter.evidence(state, wind * rng.exponential(size=SHAPE).astype(np.float32)) for _ in range(60)]
    beyond = (np.array(fresh) > 5).mean(axis=(0, 2)) / np.exp(-5)  # by row
    assert beyond == pytest.approx(1.0, abs=0.35 + 4 / np.sqrt(60 * SHAPE[1] * np.exp(-5)))
    assert beyond.mean() == pytest.approx(1.0, abs=0.1)


def test_clutter_that_goes_over_into_noise_is_as_rare_at_both_ends_of_a_band():
    """One law for a whole band told what is spikier at its near end of too much evidence, its far end of too little."""
    rng, far = np.random.default_rng(6), np.arange(SHAPE[1])

    def draw():
        texture = rng.gamma(0.5, 2.0, SHAPE) * (5 * (1 + far / 40) ** -3.0)
        return ((1 + texture) * rng.gamma(4.0, 0.25, SHAPE)).astype(np.float32)

    state = learnt(draw, turns=60)
    fresh = np.array([MAP.evidence(state, draw()) for _ in range(60)])
    width = SHAPE[1] // MAP.bands
    for band in range(1, MAP.bands):
        near, end = (fresh[:, :, band * width + k : band * width + k + 8] for k in (0, width - 8))
        seen = np.array([(part > 5.0).sum() for part in (near, end)])
        expected = near.size * np.exp(-5.0)
        assert seen / expected == pytest.approx(1.0, abs=0.15 + 4 / np.sqrt(expected)), band


def test_quantised_and_saturated_amplitudes_are_taken_as_they_are():
    rng = np.random.default_rng(3)

    def draw():
        return np.minimum(np.round(1.5 * np.sqrt(power_of(1.0, rng, falls=0.0))), 15).astype(np.float32) ** 2

    state = learnt(draw)
    fresh = np.array([MAP.evidence(state, draw()) for _ in range(40)])
    for level in (2.0, 4.0, 6.0):  # of a few values the share above a level is no more than it says
        assert (fresh > level).mean() < 1.15 * np.exp(-level)
    for ratio in (1.0, 4.0):
        assert np.exp(fresh.astype(float) * ratio / (1 + ratio)).mean() / (1 + ratio) < 1.1


def test_a_ship_is_evidence_and_a_rock_is_not():
    rng = np.random.default_rng(4)
    rocks, reached = (np.arange(25, 55), 40 + rng.integers(80, size=30)), []
    state = None
    for number in range(40):
        power = power_of(5.0, rng, falls=0.0)
        power[rocks] *= 200 * rng.gamma(4, 0.25, 30)
        power[70, 20 + 2 * number] *= 60
        state = MAP.learnt(state, power)
        evidence = MAP.evidence(state, power)
        if number > 10:
            reached.append([evidence[rocks].mean(), evidence[70, 20 + 2 * number]])
    rock_s, ship_s = np.array(reached).T
    assert state.fixed[rocks].all()
    assert not state.fixed[70].any()
    assert rock_s.mean() < 1.3
    assert np.median(ship_s) > 6


def test_the_edge_of_a_saturated_echo_that_flickers_is_no_evidence():
    """A pier in four bits over silence, whose edge comes and goes by many cells at a time."""
    rng = np.random.default_rng(8)

    def draw():
        amplitude = np.zeros(SHAPE)
        for row in range(20, 60):
            amplitude[row, 40 : 70 + round(float(rng.normal(0, 4)))] = 15
        return (amplitude**2 + 0.1).astype(np.float32)

    state = learnt(draw)
    fresh = np.array([MAP.evidence(state, draw()) for _ in range(40)])
    assert state.fixed[30, 40:64].all()
    for level in (2.0, 4.0, 6.0):
        assert (fresh[:, state.fixed] > level).mean() < 1.15 * np.exp(-level)


def test_what_was_not_received_says_nothing():
    rng = np.random.default_rng(5)

    def draw():
        power = power_of(1.0, rng)
        power[10:14] = np.nan
        return power

    state = learnt(draw, 6)
    evidence = MAP.evidence(state, draw())
    assert np.isnan(evidence[10:14]).all()
    assert np.isfinite(np.delete(evidence, np.s_[10:14], axis=0)).all()


def test_the_shape_tells_spiky_clutter():
    rng = np.random.default_rng(6)
    shapes = []
    for shape in (0.5, 50.0):
        state = learnt(lambda shape=shape: power_of(shape, rng))
        shapes.append(np.nanmedian(MAP.shape_of(state.counts)))
    assert shapes[0] < 0.9 < shapes[1]


def test_the_law_is_that_of_the_counts():
    counts = np.zeros((3, BINS))
    rng = np.random.default_rng(7)
    level = np.log(rng.exponential(size=200_000))
    counts[0] = np.histogram(level, LOW + WIDTH * np.arange(BINS + 1))[0]
    law = ClutterMap(sectors=1, bands=1).laws(counts)[0]
    edges = np.exp(LOW + WIDTH * np.arange(BINS))
    body = (edges > 0.1) & (edges < 5)
    np.testing.assert_allclose(law[body], edges[body], rtol=0.03)
    assert (np.diff(law) >= 0).all()


def test_the_level_near_the_radar_is_not_that_of_further_off():
    """Clutter that falls with the cube of the range from ten cells on: the first stands out no more than others."""
    rng, level = np.random.default_rng(7), (10.0 + np.arange(60.0)) ** -3
    clutter, state = ClutterMap(), None
    for _ in range(8):
        state = clutter.learnt(state, (level * rng.exponential(size=(180, 60))).astype(np.float32))
    turns = [clutter.evidence(state, (level * rng.exponential(size=(180, 60))).astype(np.float32)) for _ in range(5)]
    assert np.mean([turn[:, 0] for turn in turns]) == pytest.approx(1.0, abs=4 / np.sqrt(900))
