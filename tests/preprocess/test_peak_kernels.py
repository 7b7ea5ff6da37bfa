"""Kernels of peaks against their plain twins."""

import numpy as np
import pytest

from elusive.preprocess import (
    _impulse_kernels,
    _past_kernels,
    _repair_kernels,
    _scale_kernels,
    _scene_kernels,
    _summit_kernels,
    _tail_kernels,
    scales,
)
from elusive.preprocess.peak_maps import BORDER, NO_MAP, RINGS
from elusive.preprocess.peak_tails import EDGES, EXCESS, HEAVY, LEAST, POWER
from tests.reference import peaks as reference

RNG = np.random.default_rng(1)
SHAPES = [(33, 50), (40, 64), (35, 37)]
STILL = np.zeros(2, dtype=np.int64)


def image_of(shape, seed=0):
    return np.random.default_rng(seed).normal(0, 20, shape).astype(np.float32)


@pytest.mark.parametrize("shape", SHAPES)
def test_scales(shape):
    image = image_of(shape)
    half = _scale_kernels.halve(image)
    np.testing.assert_allclose(half, reference.smoothed(image, [1 / 16, 1 / 4, 3 / 8])[::2, ::2], atol=1e-4)
    smooth = _scale_kernels.smooth(image, scales.FINEST)
    np.testing.assert_allclose(smooth, reference.smoothed(image, scales.FINEST), atol=1e-4)
    np.testing.assert_allclose(_scale_kernels.subtract(image, half), reference.subtracted(image, half), atol=1e-4)


def test_means_along_rows_and_columns():
    image = image_of((33, 50))
    for ours, axis in zip(_scale_kernels.along(image, 15.0), (1, 0), strict=True):
        np.testing.assert_allclose(ours, np.clip(image, -15, 15).mean(axis), atol=1e-4)


@pytest.mark.parametrize(("rows", "columns"), [(0, 0), (30, 0), (0, 30), (30, 30)])
def test_offsets_of_rows_and_columns_are_taken_away_where_they_are_plain(rows, columns):
    image = image_of((64, 80))
    image += rows * image_of((64, 1), 1) / 20 + columns * image_of((1, 80), 2) / 20
    given = (3000, scales.MEAN_ROOT, scales.CLIP, scales.ALIKE, scales.PLAIN)
    levelled = _scale_kernels.level_lines(image, *given)
    np.testing.assert_allclose(levelled, reference.level_lines(image, *given), atol=1e-3)
    assert np.array_equal(levelled, image) == (rows == columns == 0)


@pytest.mark.parametrize("shape", [*SHAPES, (9, 7)])
def test_local_noise(shape):
    image = image_of(shape)
    blocks = _scale_kernels.block_roots(image)
    np.testing.assert_allclose(blocks, reference.block_roots(image), rtol=1e-5)
    for share, least in ((0.05, 1e-9), (0.9, 1.0), (0.05, 1e4)):
        ours = _scale_kernels.local_variance(image, scales.MEAN_ROOT, share, least)
        np.testing.assert_allclose(ours, reference.local_variance(image, scales.MEAN_ROOT, share, least), rtol=1e-4)
    many = image_of((7, 9))
    np.testing.assert_array_equal(_scale_kernels.middle(many), reference.middle(many))
    white = _scale_kernels.whiten(image, blocks)
    np.testing.assert_allclose(white, image * reference.spread_blocks(blocks, shape), rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize(("part", "roll"), [((0, 0), (0, 0)), ((0.3, -0.4), (2, -1)), ((-0.5, 0.5), (-40, 3))])
def test_what_differs_from_the_past_and_what_is_learnt(part, roll):
    shape = (33, 38)
    image, mean = image_of(shape), image_of(shape, 1)
    variance, local = image_of(shape, 2) ** 2, image_of((4, 4), 3) ** 2 + 1
    seen = np.random.default_rng(4).integers(0, 21, shape).astype(np.uint8)
    seen[:20] = 20  # what is of one count along a row takes another way
    seen[26:, 7:30] = 20
    part, roll = np.array(part, dtype=float), np.array(roll)
    deviation = _past_kernels.deviate(image, mean, seen, part, roll)
    past, known = reference.moved(mean, roll, 0.0), reference.moved(seen, roll, 0.0) >= 1
    np.testing.assert_allclose(deviation, np.where(known, reference.read_between(image, part) - past, 0), atol=1e-3)
    learnt = _past_kernels.learn(deviation, image, mean, variance, seen, roll, local, 20)
    expected = reference.learn(deviation, image, mean, variance, seen, roll, local, 20)
    for ours, theirs in zip(learnt, expected, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=2e-4, atol=2e-4)


@pytest.mark.parametrize("shift", [(0.0, 0.0), (1.4, -2.3), (-0.6, 0.2)])
def test_alignment_with_the_past(shift):
    image, mean = image_of((40, 44)), image_of((40, 44), 1)
    seen = (image_of((40, 44), 2) > -10).astype(np.uint8)
    shift = np.array(shift)
    ours = _scene_kernels.alignment(image, mean, seen, shift, 9.0, 1, 2)
    np.testing.assert_allclose(ours, reference.alignment(image, mean, seen, shift, 9.0, 2), rtol=1e-3, atol=0.5)
    gain, squares = _scene_kernels.preference(image, mean, seen, shift, -shift, 9.0, 1, 2)
    margin = int(np.ceil(np.abs(shift).max())) + 2
    right, wrong = (reference.errors(image, mean, seen, sign * shift, margin)[0] / 9 for sign in (1, -1))
    better = np.minimum(wrong**2, 9) - np.minimum(right**2, 9)
    assert gain == pytest.approx(better.sum(), rel=1e-3, abs=1e-2)
    assert squares == pytest.approx((better**2).sum(), rel=1e-3, abs=1e-2)


@pytest.mark.parametrize("way", [np.zeros((3, 2)), np.array([[1.3, -0.4], [0.5, 2.1], [-1.7, 0.2]])])
def test_an_affine_step_against_the_last_frame(way):
    image, last = image_of((40, 44)), image_of((40, 44), 1)
    ours = _scene_kernels.deforming(image, last, way, 9.0, 1, 2)
    for value, expected in zip(ours, reference.deforming(image, last, way, 9.0, 2), strict=True):
        np.testing.assert_allclose(value, expected, rtol=1e-5, atol=1e-5 * np.abs(expected).max())


def test_summits_are_extrema_over_place_and_scale():
    maps = [image_of(shape, k) / 15 for k, shape in enumerate([(80, 96), (40, 48), (20, 24)])]
    nowhere = np.zeros(2)
    grid = (2, 3, 100, 200)
    finer, coarser = ((maps[k], nowhere) for k in (0, 2))
    found, kinds = _summit_kernels.summits(
        maps[1], maps[1], nowhere, *finer, *coarser, 1.0, BORDER, RINGS, grid, 1, *scales.moments_of(1), 5
    )
    expected = reference.summits(maps[1], maps[0], maps[2], 1.0, BORDER)
    assert len(found) == len(expected) > 3
    for ours, (row, column, x, y) in zip(found, expected, strict=True):
        assert ours[:2] == pytest.approx([2 * x, 2 * y], abs=1e-4)
        assert ours[2] <= abs(maps[1][row, column]) + 1e-6
        assert ours[3] == np.sign(maps[1][row, column])
        assert ours[6] == 100 + reference.kind(maps[1], row, column, RINGS, _summit_kernels.RING)
        assert ours[7] == 200 + row * 2 // 40 * 3 + column * 3 // 48
    counted = [
        reference.kind(maps[1], j, i, RINGS, _summit_kernels.RING) for j in range(2, 40, 5) for i in range(2, 48, 5)
    ]
    np.testing.assert_array_equal(kinds, np.bincount(counted, minlength=8))


def test_a_line_is_no_point():
    y, x = np.mgrid[:64, :64] - 32.0
    point = 20 * np.exp(-(x**2 + y**2) / 3)
    line = 20 * np.exp(-((0.8 * x + 0.6 * y) ** 2) / 3) * np.exp(-(x**2 + y**2) / 2000)
    height = {}
    for name, image in (("point", point), ("line", line)):
        found, _ = _summit_kernels.summits(
            image.astype("f4"),
            image.astype("f4"),
            np.zeros(2),
            *NO_MAP,
            *NO_MAP,
            2.5,
            2,
            RINGS,
            (1, 1, 0, 0),
            0,
            0.75,
            3.5,
            16,
        )
        height[name] = found[np.hypot(found[:, 0] - 32, found[:, 1] - 32) < 3, 2].max()
    assert height["point"] == pytest.approx(20)
    assert height["line"] < 20 / 4


def test_peaks_that_are_one():
    n = 300
    x, y, sign = RNG.uniform(0, 60, n), RNG.uniform(0, 50, n), RNG.choice([-1.0, 1.0], n)
    radius = RNG.choice([2.0, 12.0], n)
    for most in (n, 40):
        kept = _summit_kernels.apart(x, y, sign, radius, 60, 50, most)
        assert np.flatnonzero(kept).tolist() == reference.apart(x, y, sign, radius, most)


def test_quantile_plots():
    over = RNG.exponential(EXCESS, 3000)
    histogram = np.stack([np.bincount(np.searchsorted(EDGES, k * over), minlength=len(EDGES) + 1) for k in (1, 4)])
    plots = _tail_kernels.quantile_plots(histogram.astype(float), EDGES, LEAST, 30.0, 20.0, POWER)
    for plot, counts in zip(plots, histogram, strict=True):
        np.testing.assert_allclose(plot, reference.quantile_plot(counts, EDGES, LEAST, 30.0, 20.0, POWER), rtol=1e-3)


def test_rating_and_counting():
    n, groups = 400, 12
    heights = LEAST + RNG.exponential(1.0, n)
    pool, kind, tile = RNG.integers(0, 4, n), RNG.integers(0, 5, n), RNG.integers(5, groups, n)
    scale = RNG.integers(0, 2, n)
    log_middle, log_local = RNG.normal(-1, 0.7, (4, groups)), RNG.normal(-6, 1, (4, groups))
    places = LEAST + np.cumsum(RNG.uniform(0, 0.1, (12, len(EDGES))), axis=1)
    log_rate = np.array([-4.0, -5.0])
    strength, middle, row, column = _tail_kernels.rate(
        heights, pool, kind, tile, scale, log_middle, log_local, places, EDGES, HEAVY, LEAST, EXCESS, log_rate
    )
    both = [0.5 * (values[pool, kind] + values[pool, tile]) for values in (log_middle, log_local)]
    np.testing.assert_allclose(middle, np.exp(both[0]))
    np.testing.assert_array_equal(row, 3 * pool + np.searchsorted(HEAVY * EXCESS, middle))
    scaled = (heights - LEAST) / middle * EXCESS
    np.testing.assert_array_equal(column, np.searchsorted(EDGES, scaled))
    for k in range(n):
        at = np.interp(np.log(max(scaled[k], 1e-300)), np.log(EDGES), places[row[k]])
        if scaled[k] < EDGES[0]:
            at = LEAST + scaled[k] / EDGES[0] * (places[row[k], 0] - LEAST)
        dense = both[1][k] + reference.log_left(at, LEAST)
        assert strength[k] == pytest.approx(reference.invert(log_rate[scale[k]] - dense), abs=0.01)
    peaks, excess, histogram = np.zeros((4, groups)), np.zeros((4, groups)), np.zeros((12, len(EDGES) + 1))
    _tail_kernels.count(heights, pool, kind, tile, middle, row, column, LEAST, 4.0, 3, peaks, excess, histogram)
    assert histogram.sum() == n
    for p in range(4):
        mine = np.flatnonzero(pool == p)
        counted = mine[np.argsort((heights[mine] - LEAST) / middle[mine])[:-3]]
        for groups_of in (kind, tile):
            expected = np.bincount(groups_of[counted], minlength=groups)
            assert (peaks[p][np.unique(groups_of)] == expected[np.unique(groups_of)]).all()
            over = np.minimum(heights - LEAST, 4 * middle)[counted]
            np.testing.assert_allclose(
                excess[p][np.unique(groups_of)],
                np.bincount(groups_of[counted], over, groups)[np.unique(groups_of)],
            )


@pytest.mark.parametrize("shape", SHAPES)
def test_neighbours_of_pixels_and_their_median(shape):
    image = image_of(shape)
    pixels = np.concatenate([[0, shape[1] - 1, image.size - 1], RNG.integers(0, image.size, 50)])
    near, middle = _repair_kernels.surroundings(image, pixels)
    around = np.pad(image, 1, mode="reflect")
    windows = np.lib.stride_tricks.sliding_window_view(around, (3, 3)).reshape(-1, 9)[pixels]
    np.testing.assert_array_equal(near.T, np.delete(windows, 4, axis=1))
    np.testing.assert_array_equal(middle, np.median(near, axis=0))


@pytest.mark.parametrize(("every", "masked"), [(1, False), (3, True)])
def test_flashes_are_those_of_the_twin(every, masked):
    rng = np.random.default_rng(21)
    last, image = rng.normal(100, 1, (2, 24, 19)).astype(np.float32)
    at = rng.random((24, 19)) < 0.08
    image[at] += rng.choice(np.float32([-12, 12]), at.sum())
    image[4:6, 7:9] = np.nan if masked else 100
    last[np.roll(at & (rng.random(at.shape) < 0.3), (1, -2), (0, 1))] += 12
    bent = _impulse_kernels.bends(image, every)
    lines = image[::every]
    np.testing.assert_allclose(bent, np.abs(lines[:, 1:-1] - (lines[:, :-2] + lines[:, 2:]) / 2), rtol=1e-4, atol=1e-4)
    step = np.array([2, -1])
    found = _impulse_kernels.flashes(image, last, bent, every, np.float32(5), 4.0, 0.5, step)
    assert found.tolist() == reference.flashes(image, last, step, every, 5, 4.0, 0.5)
    assert len(found) > 3
