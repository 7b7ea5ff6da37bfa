"""What a camera draws over its scene is found by its values, and moves neither the registration nor anything shown."""

import numpy as np
import pytest
from scipy import ndimage

from elusive.preprocess._drawn_kernels import keep, leave_round, long_lines
from elusive.preprocess.drawn import (
    FIRST,
    FRAMES,
    LONG_PX,
    PASSED_PX,
    SHARP,
    STRAIGHT,
    WIDE_PX,
    drawn,
    margins,
    without_drawn,
)
from elusive.preprocess.peaks import PeakFinder
from tests.longer import longer
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


@pytest.mark.parametrize(("sigma", "height"), [(4.0, 600.0), (3.0, 3000.0), (12.0, 600.0)])
def test_what_is_cut_off_and_round_is_of_the_scene(sigma, height):
    """A target that the camera follows to a tenth of a pixel, and a sun: as wide as a line is long, and wider."""
    rng = np.random.default_rng(3)
    frames = 100 + recording(n=14).frames
    rows, columns = np.indices(frames.shape[1:])
    for frame in frames:
        x, y = rng.normal([50.0, 44.0], 0.1)
        frame += height * np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / (2 * sigma**2))
    frames = np.minimum(frames, 255.0)
    assert np.count_nonzero((frames == 255).all(axis=0)) > LONG_PX**2 / 2
    assert all(mask is None or not mask[34:54, 40:60].any() for mask in masks(frames))


def test_boxes_crosses_and_their_lines_are_drawn_whatever_lies_beside_them():
    """A dark part of the scene that has a margin's value does not make that round."""
    frames = 100 + recording(n=14).frames
    rows, columns = np.indices(frames.shape[1:])
    over = np.zeros(frames.shape[1:], bool)
    over[30:52, 20:60] = True  # a box
    over[10:17, 62:96] = over[2:29, 76:83] = True  # a cross, thick
    over[60, 10:40] = over[50:72, 25] = True  # lines
    frames[:, over] = 255.0
    frames[:, np.hypot(columns - 98, rows - 60) < 12] = 0.0
    frames[:, :, 100:] = 0.0
    *_, mask = masks(frames)
    assert mask[over].all()
    assert mask[:, 100:].all()
    assert not mask[~over][(columns < 86)[~over]].any()


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


def views(image):
    """From each of the four sides, rows first."""
    return image, image[::-1], image.T, image.T[::-1]


def of_the_scene(kept, image, blank, lines, bound):
    """Lines of wide parts that are bent and have flanks, one part after the other."""
    taken = np.zeros(lines.shape, bool)
    for first in np.argwhere(lines & ~blank):
        if taken[*first]:
            continue
        alike = (kept == FRAMES) & ~blank & (np.abs(image - image[*first]) <= bound)
        names, _ = ndimage.label(alike)
        part = names == names[*first]
        taken |= part & lines
        every = straight = whole = beyond = 0.0
        for turned, values in (
            (part, image),
            (part.T, image.T),
            (part[::-1], image[::-1]),
            (part.T[::-1], image.T[::-1]),
        ):
            ends = turned[:-1] & ~turned[1:]
            every += ends.sum()
            straight += ndimage.binary_opening(ends, np.ones((1, LONG_PX), bool)).sum()
            seen = ends[:-1] & ~turned[2:]
            inside, near, far = (values[k : len(values) - 2 + k][seen] for k in range(3))
            whole += np.abs(inside - far).sum()
            beyond += ((near - far) * np.sign(inside - far)).sum()
        wide = ndimage.binary_erosion(part, np.ones((WIDE_PX, WIDE_PX), bool)).any()
        if wide and straight < STRAIGHT * every and beyond > SHARP * whole:
            yield part & lines


@pytest.mark.parametrize("seed", longer(range(4), 1, 2, 3))
def test_wide_parts_with_bent_outlines_and_flanks_are_left(seed):
    rng = np.random.default_rng(seed)
    kept = np.full((70, 90), FRAMES, np.uint8)
    rows, columns = np.indices(kept.shape)
    image = 10 * ndimage.gaussian_filter(rng.normal(size=kept.shape), 5)
    image += np.minimum(60 * np.exp(-((rows - 50) ** 2 + (columns - 40) ** 2) / 60), 30)
    image = np.round(image).astype(np.float32)
    image[8:20, 30:62] = image[30:60, 70:78] = 9.0
    image[np.hypot(rows - 30, columns - 15) < 8] = -7.0
    image[64, 5:50] = -9.0
    kept[rng.random(kept.shape) < 0.01] = 0
    blank = np.zeros(kept.shape, bool)
    blank[:4] = True
    lines, _ = long_lines(kept, FRAMES, LONG_PX)
    wanted, left = lines.copy(), 0
    for part in of_the_scene(kept, image, blank, lines, 0.25):
        wanted &= ~part
        left += 1
    assert left
    assert wanted[12, 45]
    assert wanted[30, 15]
    limits = LONG_PX, WIDE_PX, STRAIGHT, SHARP
    assert leave_round(lines, kept, image, blank, FRAMES, np.float32(0.25), *limits)
    np.testing.assert_array_equal(lines, wanted)
