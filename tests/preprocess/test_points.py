"""Points in white noise: found without a false one, their width and height known to their Monte Carlo error."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.preprocess.points import PointFinder, peaks_of, responses_of, single_width_of, width_of

COUNT, SIZE = 40, 64


def frames(width, height, seed=0):
    """Frames of noise of deviation one, each with a point at a random place."""
    rng = np.random.default_rng(seed)
    grid = np.arange(SIZE)
    for _ in range(COUNT):
        x, y = rng.uniform(12, SIZE - 12, 2)
        along_x, along_y = (np.exp(-0.5 * ((grid - place) / width) ** 2) for place in (x, y))
        yield height * along_y[:, None] * along_x + rng.standard_normal((SIZE, SIZE))


def find_points(images):
    """Points of frames."""
    images = list(images)
    finder = PointFinder(sum(image.size for image in images))
    for image in images:
        finder.add(image)
    return finder.points


@pytest.mark.parametrize(("width", "height"), [(0.7, 6.0), (1.0, 4.0), (1.0, 10.0), (1.8, 3.0), (3.0, 4.0)])
def test_width_and_height_are_those_of_the_points(width, height):
    points = find_points(frames(width, height))
    responses = responses_of(points)
    energy = height * np.sqrt(np.pi) * width  # root of the point's summed squares, in deviations
    assert len(responses) > 0.7 * COUNT
    found = width_of(responses)
    # Cramer-Rao: the information on log width is energy^2 a point; places are from a grid a quarter pixel wide
    assert found == pytest.approx(width, rel=4 / (energy * np.sqrt(len(responses))) + 0.04)
    if energy > 8:  # fainter ones are found where noise lifts them
        seen = peaks_of(responses, found)
        assert np.median(seen) == pytest.approx(height, rel=0.06 + 4 / (energy * np.sqrt(len(responses))))
    assert points.bright.all()


def test_dark_points_are_told_from_bright_ones():
    mixed = [frame * (-1) ** k for k, frame in enumerate(frames(1.0, 10.0))]
    points = find_points(mixed)
    assert points.bright.sum() == (~points.bright).sum() == COUNT / 2
    assert width_of(responses_of(points)) == pytest.approx(1.0, abs=0.05)


def test_noise_alone_makes_hardly_a_point():
    rng = np.random.default_rng(3)
    counts = [len(find_points(rng.standard_normal((30, 48, 48))).frame) for _ in range(10)]
    assert np.mean(counts) < 0.5 + 3 * np.sqrt(0.5 / 10)  # Poisson of at most a half


def test_points_that_overlap_in_places_do_not_widen_the_others():
    alone, others = list(frames(1.0, 10.0, seed=4)), list(frames(1.0, 10.0, seed=4))
    # in every third frame a second point, 3 px beside the first
    mixed = [
        frame + (np.roll(other, 3, axis=1) if k % 3 == 0 else 0)
        for k, (frame, other) in enumerate(zip(alone, others, strict=True))
    ]
    responses = responses_of(find_points(mixed))
    assert width_of(responses) > 1.15
    assert single_width_of(responses) == pytest.approx(1.0, abs=0.06)


def test_places_are_as_far_off_as_is_told():
    rng, grid = np.random.default_rng(5), np.arange(SIZE)
    off, told = [], []
    for _ in range(60):
        x, y = rng.uniform(12, SIZE - 12, 2)
        along_x, along_y = (np.exp(-0.5 * ((grid - place) / 1.6) ** 2) for place in (x, y))
        found = PointFinder(60 * SIZE**2).add(8 * along_y[:, None] * along_x + rng.standard_normal((SIZE, SIZE)))
        assert found.bright.all()
        off.append(found.places_px[0] - (x, y))
        told.append(found.deviation_px[0])
    ratio = np.mean(np.square(off)) / np.mean(np.square(told))
    assert 0.6 < ratio < 2.2  # chi-square of 120: 1 +- .13; a parabola and four widths err beside the bound
