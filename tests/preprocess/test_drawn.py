"""What a camera draws over its scene is found by its values, and moves neither the registration nor anything shown."""

import numpy as np
import pytest
from scipy import ndimage

from elusive.preprocess._drawn_kernels import keep, long_lines
from elusive.preprocess.drawn import FIRST, FRAMES, PASSED_PX, drawn, margins, without_drawn
from elusive.preprocess.peaks import PeakFinder
from tests.preprocess.scenes import recording


def masks(frames):
    state = None
    for frame in frames:
        state = drawn(state, frame.astype(np.float32))
        yield state.mask


def test_bars_and_lines_are_found_and_little_else():
    frames = recording(n=12).frames
    over = np.zeros(frames.shape[1:], bool)
    over[:9] = over[-9:] = True
    over[40, 20:34] = over[50:64, 60] = True
    bars = over.copy()
    bars[9:-9] = False
    frames[:, over] = 16.0
    for k, mask in enumerate(masks(frames)):
        known = over if k >= FIRST else bars
        np.testing.assert_array_equal(mask, known)
        assert np.isnan(without_drawn(frames[k], mask)[known]).all()


def test_margins_are_known_where_most_of_a_picture_keeps_its_value():
    """Compressed video: half of the pixels and more are as in the frame before."""
    frames = np.repeat(recording(n=2).frames, FRAMES, axis=0)
    over = np.zeros(frames.shape[1:], bool)
    over[:, :12] = over[-5:] = True
    frames[:, over] = 0.0
    for mask in masks(frames):
        np.testing.assert_array_equal(mask, over)


def test_a_flat_sky_in_which_something_lies_is_no_margin():
    frame = recording(n=1).frames[0].astype(np.float32)
    frame[:30] = 0.0
    assert margins(frame)[:30].all()
    frame[20:23, 50:53] = 9.0
    assert not margins(frame).any()
    assert not margins(np.full((40, 40), 7.0, np.float32)).any()


def test_short_pieces_stay_and_a_flat_part_is_seen_where_something_passes():
    frames = recording(n=20).frames
    frames[:, 60:64, 50:54] = 255.0  # a saturated target that the camera follows
    frames[:, :30] = 0.0  # a sky below the least grey level
    frames[14, 15, 55] = 9.0
    found = list(masks(frames))
    assert not any(mask[60:64, 50:54].any() for mask in found[FIRST:])
    assert found[13][15, 55]
    reach = PASSED_PX // 2
    assert not any(mask[:30, 55 - reach : 55 + reach + 1].any() for mask in found[14:])
    assert found[19][10, 5]


def test_nothing_is_drawn_where_most_stays_the_same():
    frames = np.repeat(recording(n=1).frames, 2 * FRAMES, axis=0)
    assert all(mask is None for mask in masks(frames))


@pytest.mark.parametrize("bar", [0, 14])
def test_bars_do_not_hold_the_registration(bar):
    scene = recording(n=16, camera=(0.4, 0.7))
    frames = scene.frames.copy()
    if bar:
        frames[:, :bar] = frames[:, -bar:] = 0.0
    finder = PeakFinder()
    state = finder.init()
    offsets = []
    for frame in frames:
        state = finder.step(state, frame)
        offsets.append(state.output.offset_px)
        if bar and len(offsets) > FIRST:
            y = state.output.places_px[:, 1]
            assert (np.abs(y - bar) > 1).all()
            assert (np.abs(y - (80 - bar)) > 1).all()
    moved = np.diff(offsets, axis=0)[FIRST + 1 :]
    np.testing.assert_allclose(moved.mean(axis=0), [0.4, 0.7], atol=0.05)


@pytest.mark.parametrize("counts", [True, False])
def test_what_keeps_its_value_is_counted(counts):
    rng = np.random.default_rng(5)
    last, change = rng.normal(size=(2, 30, 41)).astype(np.float32)
    last[3, 4] = np.nan
    image = last + change
    kept = rng.integers(0, FRAMES + 1, last.shape).astype(np.uint8)
    blank = rng.random(last.shape) < 0.2
    found, full = keep(image, last, kept, blank, np.float32(0.8), counts, FRAMES)
    wanted = np.minimum(kept + (blank | counts), FRAMES) * (np.abs(image - last) <= np.float32(0.8))
    np.testing.assert_array_equal(found, wanted)
    assert full == np.count_nonzero(wanted == FRAMES)


@pytest.mark.parametrize("share", [0.5, 0.9, 0.97, 1.0])
def test_long_lines_are_openings_by_lines(share):
    still = np.random.default_rng(6).random((33, 47)) < share
    still[12:20] = False  # rows without any are passed over
    lines = [ndimage.binary_opening(still, np.ones(side, bool)) for side in ((1, 10), (10, 1))]
    mask, found = long_lines(still.astype(np.uint8), 1, 10)
    np.testing.assert_array_equal(mask, lines[0] | lines[1])
    assert found == mask.any()
