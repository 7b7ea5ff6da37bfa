"""What stands out of recorded frames: rarity in noise, places, scales, cameras that move, gaps."""

import numpy as np
import pytest
from scipy import ndimage, optimize
from scipy.special import ndtri

from elusive.errors import DataError
from elusive.preprocess import PeakFinder, scales
from elusive.preprocess.dead_lines import dead_lines
from elusive.preprocess.impulses import without_impulses
from elusive.preprocess.peaks import LEVELS
from elusive.preprocess.repair import without_stuck
from tests.longer import longer
from tests.preprocess.scenes import recording


def bell(shape, x, y, sigma, height):
    rows, columns = np.indices(shape)
    return height * np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / (2 * sigma**2))


def found_in(frames, finder=None):
    finder = PeakFinder() if finder is None else finder
    state, found = finder.init(), []
    for frame in frames:
        state = finder.step(state, frame)
        found.append(state.output)
    return found


def nearest(peaks, place, within_px=3.0):
    """Index of the strongest peak near a place, None where there is none."""
    near = np.flatnonzero(np.hypot(*(peaks.places_px - place).T) < within_px)
    return near[0] if len(near) else None


def texture(shape, seed=0, sigma=2.5):
    scene = ndimage.gaussian_filter(np.random.default_rng(seed).normal(0, 1, shape), sigma)
    return 100 + 30 * scene / scene.std()


def test_noise_on_a_pedestal_is_rated_as_what_it_is():
    rng = np.random.default_rng(3)
    found = found_in(rng.normal(1000, 25, (128, 160)) for _ in range(50))[10:]
    assert np.mean([peaks.noise for peaks in found]) == pytest.approx(25, rel=0.03)
    assert np.mean([peaks.pedestal for peaks in found]) == pytest.approx(1000, abs=2)
    core = slice(2, -2)
    quantiles = np.mean([peaks.quantiles for peaks in found], axis=0)
    np.testing.assert_allclose(quantiles[core], ndtri(LEVELS)[core], atol=0.05)
    assert all((peaks.offset_px == 0).all() for peaks in found)
    # strengths of which two maps of Gaussian noise hold so many peaks of each polarity; neighbouring ones are one
    density = 128 * 160 * sum(np.exp(scales.log_rate(k)) for k in range(scales.count_of((128, 160))))
    for n in (3, 10):
        strength = optimize.brentq(lambda u, n=n: density * u * np.exp(-0.5 * u**2) - n, 1.0, 10.0)
        seen = np.mean([(peaks.strength > strength).sum() for peaks in found])
        assert n < seen < 4 * n


def test_a_dim_point_has_about_a_matched_filters_strength():
    rng = np.random.default_rng(4)
    height = 25 * 10**0.5  # 10 dB at a spread of one pixel
    paths = np.stack([10 + 0.7 * np.arange(60), 20 + 0.5 * np.arange(60)], axis=1)
    found = found_in(1000 + rng.normal(0, 25, (64, 64)) + bell((64, 64), *p, 1.0, height) for p in paths)
    ranks = [nearest(peaks, place) for peaks, place in zip(found[10:], paths[10:], strict=True)]
    assert np.mean([rank is not None and rank < 5 for rank in ranks]) >= 0.9
    strength = np.median([found[10 + k].strength[i] for k, i in enumerate(ranks) if i is not None])
    assert strength > 0.8 * height * np.sqrt(np.pi) / 25


@pytest.mark.parametrize("sigma", [0.9, 2.0, 4.0, 7.5])
def test_scale_contrast_and_place_of_a_point(sigma):
    rng = np.random.default_rng(5)
    shape, place = (400, 480), np.array([201.3, 170.6])
    frame = 500 + rng.normal(0, 1, shape) - bell(shape, *place, sigma, 60)
    peaks = found_in([frame])[0]
    i = nearest(peaks, place)
    assert i == 0
    assert not peaks.bright[i]
    assert abs(np.log2(peaks.scale_px[i] / sigma)) < 0.5
    assert peaks.contrast[i] == pytest.approx(-60, rel=0.45)
    assert np.abs(peaks.places_px[i] - place).max() < 3 * 0.1 * peaks.scale_px[i]


def test_a_negative_image_has_the_same_peaks():
    frames = [texture((96, 120), k) for k in range(4)]
    for ours, theirs in zip(found_in(frames), found_in(255 - frame for frame in frames), strict=True):
        np.testing.assert_allclose(ours.strength, theirs.strength, rtol=0.02)
        assert (ours.bright == ~theirs.bright).mean() > 0.99


@pytest.mark.parametrize("unit", [2.0**-40, 2.0**30])
def test_other_units_have_the_same_peaks(unit):
    """A power of two changes no digit: all but what is in grey levels is the same to the last bit."""
    frames = [texture((96, 120), k) for k in range(4)]
    frames[2][10:20, :9] = np.nan
    for ours, theirs in zip(found_in(frames), found_in(unit * frame for frame in frames), strict=True):
        for name, ours_of in ours._asdict().items():
            its = getattr(theirs, name)
            if ours_of is None:  # a deformation, where none is seen
                assert its is None
                continue
            np.testing.assert_array_equal((unit if name in ("contrast", "noise", "pedestal") else 1.0) * ours_of, its)


def test_what_moves_among_resting_points_is_seen_against_the_past():
    rng = np.random.default_rng(6)
    rest = sum(bell((120, 120), *p, 1.0, 80) for p in rng.uniform(10, 110, (40, 2)))
    paths = np.stack([20 + 1.3 * np.arange(40), 30 + 0.9 * np.arange(40)], axis=1)
    found = found_in(rest + rng.normal(100, 2, (120, 120)) + bell((120, 120), *p, 1.0, 40) for p in paths)
    ranks = [nearest(peaks, p) for peaks, p in zip(found[10:], paths[10:], strict=True)]
    assert np.mean([rank is not None and rank < 3 for rank in ranks]) > 0.9
    assert (
        np.mean([peaks.temporal[rank] for peaks, rank in zip(found[10:], ranks, strict=True) if rank is not None]) > 0.9
    )


def test_a_camera_that_moves_jumps_and_cuts():
    rng = np.random.default_rng(7)
    scene, other = texture((300, 340)), texture((300, 340), 1)
    steps = np.array([0.37, -0.81]) * np.arange(24)[:, None]
    steps[12:] += [21.0, 13.0]
    frames = [
        ndimage.shift(scene, (40 + y, 40 + x), order=3, mode="nearest")[60:220, 60:250] + rng.normal(0, 2, (160, 190))
        for x, y in steps
    ]
    found = found_in([*frames, *[other[60:220, 60:250] + rng.normal(0, 2, (160, 190)) for _ in range(3)]])
    offsets = np.array([peaks.offset_px for peaks in found[:24]])
    np.testing.assert_allclose(offsets, steps, atol=0.15)
    assert [peaks.number for peaks in found if peaks.cut] == [0, 24]
    assert (found[24].offset_px == 0).all()


@pytest.mark.parametrize("way", [[-0.85, 0.15], *longer([[0.0, 0.0], [0.15, 0.4]], [0.0, 0.0], [0.15, 0.4])])
def test_a_soft_scene_whose_finest_detail_is_lost_in_noise_is_followed(way):
    """A small frame's finest map is nearly all noise: a clouded sky; what is coarser tells how the camera pans."""
    rng, steps = np.random.default_rng(11), np.arange(50)[:, None] * np.array(way)
    scene = 0.3 * texture((300, 340), 5, 5.0)
    row, column = np.indices((144, 176))
    views = [ndimage.map_coordinates(scene, [row + 60 - y, column + 60 - x], order=3) for x, y in steps]
    found = found_in(np.round(view + rng.normal(0, 2.5, view.shape)) for view in views)
    off = np.array([peaks.offset_px for peaks in found]) - steps
    # a fifth of the way from which on a track is taken to have left its place in the scene
    assert np.sqrt(np.square(off).sum(axis=1).mean()) < 1.0
    assert not any(peaks.cut for peaks in found[1:])


def test_in_noise_alone_nothing_is_followed():
    for spread in (0.0, 1.5):
        rng = np.random.default_rng(12)
        noise = (ndimage.gaussian_filter(rng.normal(0, 20, (144, 176)), spread) for _ in range(40))
        assert all((peaks.offset_px == 0).all() for peaks in found_in(np.round(1000 + frame) for frame in noise))


def test_gaps_hold_no_peaks():
    rng = np.random.default_rng(8)
    frames = [texture((80, 90)) + rng.normal(0, 2, (80, 90)) for _ in range(6)]
    for frame in frames[2:5]:
        frame[20:40, 30:60] = np.nan
    for peaks in found_in(frames)[2:5]:
        x, y = peaks.places_px.T
        assert not ((x > 29) & (x < 60) & (y > 19) & (y < 40) & (peaks.scale_px < 1.3)).any()
        assert len(x) > 20


@pytest.mark.parametrize("missing", longer([0.02, 0.1, 0.2], 0.02, 0.1))
def test_pixels_missing_here_and_there_hide_nothing(missing):
    """A moving target of 14 dB keeps the strength that the known share of its pixels leaves it, within a fifth."""
    rng = np.random.default_rng(6)
    paths = np.stack([10 + 0.7 * np.arange(60), 20 + 0.5 * np.arange(60)], axis=1)
    whole = [1000 + rng.normal(0, 25, (64, 64)) + bell((64, 64), *p, 1.0, 125) for p in paths]
    known = [np.where(rng.random(frame.shape) < missing, np.nan, frame) for frame in whole]
    strength = []
    for found in (found_in(whole), found_in(known)):
        ranks = [nearest(peaks, place) for peaks, place in zip(found[10:], paths[10:], strict=True)]
        assert np.mean([rank is not None and rank < 5 for rank in ranks]) >= 0.9
        strength.append(np.median([found[10 + k].strength[i] for k, i in enumerate(ranks) if i is not None]))
    assert strength[1] > 0.8 * np.sqrt(1 - missing) * strength[0]


def test_pixels_that_flash_do_not_hide_a_target():
    """One in fifty is off by 16 deviations, each time another: the target keeps its strength within a fifth."""
    rng = np.random.default_rng(6)
    paths = np.stack([10 + 0.7 * np.arange(60), 20 + 0.5 * np.arange(60)], axis=1)
    whole = [1000 + rng.normal(0, 25, (64, 64)) + bell((64, 64), *p, 1.0, 125) for p in paths]
    snow = [frame + 400 * (rng.random((64, 64)) < 0.02) * rng.choice([-1, 1], (64, 64)) for frame in whole]
    strength = []
    for found in (found_in(whole), found_in(snow)):
        ranks = [nearest(peaks, place) for peaks, place in zip(found[10:], paths[10:], strict=True)]
        assert np.mean([rank is not None and rank < 5 for rank in ranks]) >= 0.9
        strength.append(np.median([found[10 + k].strength[i] for k, i in enumerate(ranks) if i is not None]))
    assert strength[1] > 0.8 * strength[0]


@pytest.mark.parametrize("step_px", [(0, 0), (2, -1)])
def test_many_sharp_points_that_come_again_are_no_flashes(step_px):
    rng = np.random.default_rng(9)
    stars = 300 * (rng.random((120, 120)) < 0.01)
    first, second = (np.roll(stars, k * np.array(step_px)[::-1], (0, 1)) for k in (0, 1))
    last, image = (np.float32(100 + one + rng.normal(0, 2, one.shape)) for one in (first, second))
    kept = without_impulses(image, last, np.array(step_px, float))
    assert np.isfinite(kept[4:-4, 4:-4]).all()
    # and are, as the camera did not move so: the points of this frame, less those in each other's way
    assert np.isnan(without_impulses(image, last, np.array([5.0, 5.0]))).sum() > 0.7 * (stars > 0).sum()


def test_a_stuck_pixel_is_no_point_once_the_camera_has_moved():
    scene = recording(n=30, defect=(70, 33))
    found = found_in(scene.frames)
    assert nearest(found[1], (70, 33), 1.0) is not None
    assert all(nearest(peaks, (70, 33), 1.5) is None for peaks in found[15:])


def test_a_stuck_pair_and_a_blinking_pixel_are_no_points_either():
    frames = recording(n=60, defect=(70, 33)).frames
    frames[:, 33, 71] = 400.0
    frames[np.random.default_rng(3).random(60) < 0.7, 60, 40] += 300.0
    finder = PeakFinder()
    state = finder.init()
    for frame in frames:
        state = finder.step(state, frame)
    last = frames[-1].astype(np.float32)
    changed = np.argwhere(without_stuck(last, finder.stuck, state.stuck) != last)
    assert changed.tolist() == [[33, 70], [33, 71], [60, 40]]


def test_offsets_of_rows_and_columns_hide_nothing():
    rng = np.random.default_rng(9)
    paths = np.stack([20 + 0.9 * np.arange(30), 40 + 0.6 * np.arange(30)], axis=1)
    strength = {}
    for name, offset in (("none", 0.0), ("rows and columns", 8.0)):
        rows, columns = offset * rng.standard_normal((30, 120, 1)), offset * rng.standard_normal((1, 1, 160))
        noise = rng.normal(1000, 8, (30, 120, 160)) + rows + columns
        found = found_in(frame + bell((120, 160), *p, 1.0, 45) for frame, p in zip(noise, paths, strict=True))
        ranks = [nearest(peaks, p) for peaks, p in zip(found[5:], paths[5:], strict=True)]
        strength[name] = np.median(
            [peaks.strength[k] if k is not None else 0 for peaks, k in zip(found[5:], ranks, strict=True)]
        )
    assert strength["rows and columns"] > 0.8 * strength["none"] > 5


def test_a_step_leaves_the_state_before_it_alone():
    frames = [texture((64, 64), k) for k in range(5)]
    finder = PeakFinder()
    state = finder.init()
    for frame in frames[:4]:
        state = finder.step(state, frame)
    first, second = (finder.step(state, frames[4]).output for _ in range(2))
    assert first is not None
    for ours, theirs in zip(first, second, strict=True):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize("shape", [(32, 32), (33, 47), (32, 700), (129, 65)])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32, bool])
def test_frames_of_any_shape_and_type(shape, kind):
    rng = np.random.default_rng(10)
    found = found_in((rng.random(shape) * (1 if kind is np.float32 else 200) > 0).astype(kind) * 3 for _ in range(3))
    assert all(len(peaks.strength) == 0 for peaks in found)
    found = found_in(np.clip(rng.normal(100, 9, shape), 0, 255).astype(kind) for _ in range(5))
    assert all(np.isfinite(peaks.strength).all() for peaks in found)


@pytest.mark.parametrize(
    ("frames", "sentence"),
    [
        ([np.zeros((20, 64))], "frame 0: shape"),
        ([np.zeros((64, 64)), np.zeros((64, 65))], "frame 1: shape"),
        ([np.full((64, 64), np.nan)], "no pixel is finite"),
    ],
)
def test_frames_that_cannot_be_searched_are_refused(frames, sentence):
    with pytest.raises(DataError, match=sentence):
        found_in(frames)


@pytest.mark.parametrize("transposed", longer([False, True], False))
def test_dead_lines_do_not_hold_the_registration(transposed):
    """Two columns side by side, two others and a row, with noise of their own, against the same frames without."""
    rng = np.random.default_rng(8)
    scene = texture((160, 260), seed=8, sigma=4) / 3
    frames = [scene[10 + k // 3 : 138 + k // 3, 10 + k : 170 + k] + rng.normal(0, 1.5, (128, 160)) for k in range(30)]
    frames = [frame.T.copy() if transposed else frame for frame in frames]
    assert all(len(dead_lines(view)) == 0 for frame in frames for view in (frame, frame.T))
    whole = found_in(frames)[-1]
    dead, level = ([30, 31, 90, 120], [55]), (0, 80)
    for frame in frames:
        across = frame.T if transposed else frame
        for lines, numbers, grey in zip((across.T, across), dead, level, strict=True):
            lines[numbers] = grey + rng.normal(0, 1.5, (len(numbers), lines.shape[1]))
    views = (frames[-1], frames[-1].T) if transposed else (frames[-1].T, frames[-1])
    assert tuple(dead_lines(view).tolist() for view in views) == dead
    np.testing.assert_allclose(found_in(frames)[-1].offset_px, whole.offset_px, atol=0.1)
    np.testing.assert_allclose(whole.offset_px, (-9, -29) if transposed else (-29, -9), atol=0.5)
