"""What a camera writes now and then is found by its values, and no target that is as bright is."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import ndimage

from elusive.preprocess import written as module
from elusive.preprocess._written_kernels import sharp_parts
from elusive.preprocess.written import NOTHING, hidden_of, without_written, written
from tests.longer import longer

N, ROWS, COLUMNS = 40, 60, 80
GLYPHS = np.array([[0, 1, 1, 0, 0, 1, 1]] + 3 * [[1, 0, 0, 1, 0, 1, 1]] + [[0, 1, 1, 0, 0, 1, 1]])


def scene(seed=0):
    """Eight bits, in which values come again by chance."""
    frames = 100 + np.random.default_rng(seed).normal(0, 2, (N, ROWS, COLUMNS))
    return np.round(frames + 10 * np.sin(np.arange(COLUMNS) / 9))


def states(frames):
    state, last = NOTHING, None
    for frame in np.minimum(frames, 255).astype(np.float32):
        state, last = written(state, frame, last), frame
        yield state


def mask_of(pixels):
    mask = np.zeros(ROWS * COLUMNS, bool)
    mask[pixels] = True
    return mask.reshape(ROWS, COLUMNS)


def test_a_blinking_mark_is_taken_out_from_when_it_goes():
    frames, over = scene(), np.zeros((ROWS, COLUMNS), bool)
    over[8:13, 10:17] = GLYPHS
    on = np.arange(N) // 6 % 2 == 0
    frames[:, over] = np.where(on[:, None], 255, frames[:, over])
    for k, state in enumerate(states(frames)):
        np.testing.assert_array_equal(mask_of(state.now), over & on[k] & (k > 6))
        np.testing.assert_array_equal(mask_of(state.hidden), over & (not on[k] and on[k - 1]))
        if k > 6 and on[k]:
            assert np.isnan(without_written(frames[k], state)[over]).all()
            for level, hides in enumerate(hidden_of(state, (ROWS, COLUMNS), 3)):
                assert hides[over[:: 2**level, :: 2**level]].all()
                assert not hides[:, 40 >> level :].any()


def test_digits_that_change_are_taken_out_and_what_is_written_beside_them():
    rng, frames, over = np.random.default_rng(1), scene(), np.zeros((N, ROWS, COLUMNS), bool)
    shapes = rng.random((10, 7, 5)) < 0.5
    shapes[:, 0] = shapes[:, 3] = True
    for k in range(N):
        for place, digit in enumerate((k // 10, k % 10)):
            over[k, 40:47, 20 + 6 * place : 25 + 6 * place] = shapes[digit]
    over[:, 42, 33] = over[:, 45, 33] = True
    frames[over] = 235
    found = np.array([mask_of(state.now) for state in states(frames)])
    assert not (found & ~over).any()
    assert (found & over)[20:].sum() > 0.9 * over[20:].sum()


def test_a_box_that_moves_is_taken_out_at_once():
    frames, over = scene(), np.zeros((N, ROWS, COLUMNS), bool)
    for k in range(N):
        over[k, 10 + k // 2 : 22 + k // 2, 5 + k : 20 + k] = True
        over[k, 11 + k // 2 : 21 + k // 2, 6 + k : 19 + k] = False
    frames[over] = 0
    for k, state in enumerate(states(frames)):
        np.testing.assert_array_equal(mask_of(state.now), over[k])


def test_the_edge_of_a_frame_is_no_line():
    frames = scene()
    frames[:, 1, 20:50] = 0
    assert not any(len(state.now) for state in states(frames))


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_line_is_longer_than_chance_makes_one(share):
    """Of every other pixel that has the value of the one before it, as a coder makes them, twenty make no line."""
    frames, over = scene(), np.zeros((ROWS, COLUMNS), bool)
    copies = np.random.default_rng(2).random(frames.shape) < share
    for k in range(1, COLUMNS):
        frames[..., k] = np.where(copies[..., k], frames[..., k - 1], frames[..., k])
    over[20, 4:16] = over[40, 2:62] = True
    frames[:, over] = 0
    over[20] = share == 0
    over[20, :4] = over[20, 16:] = False
    for state in states(frames):
        np.testing.assert_array_equal(mask_of(state.now), over)


def test_text_that_stays_is_taken_out():
    frames, over = scene(), np.zeros((ROWS, COLUMNS), bool)
    for x in (10, 20, 30, 40):
        over[8:13, x : x + 7] = GLYPHS
    over[50, 45] = True  # too far from it
    frames[:, over] = 0
    over[50, 45] = False
    for k, state in enumerate(states(frames)):
        np.testing.assert_array_equal(mask_of(state.now), over & (k >= module.RESTS))


def flashing(frames):
    """Saturated, with the flanks that optics give it, on and off at one place."""
    rows, columns = np.indices((ROWS, COLUMNS))
    frames[::3] += 900 * np.exp(-((columns - 30.3) ** 2 + (rows - 20.4) ** 2) / (2 * 1.3**2))


def narrow(frames):
    """As sharp, on and off at one place, of no more pixels than an undersampled target's."""
    frames[::2, 20:22, 30:33] = 255


def lamps(frames):
    """Cut off, of optics that are sharper than the pixels."""
    rng = np.random.default_rng(3)
    rows, columns = np.indices((ROWS, COLUMNS))
    for x, y in rng.uniform(6, 54, (12, 2)):
        frames += 2000 * np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / (2 * 0.5**2))
    frames[:] = np.round(frames)


def there_and_back(frames):
    """Sharp and of one value, along a row and back, as a square that a program draws."""
    for k in range(N):
        x = 10 + 2 * min(k, N - k)
        frames[k, 30:34, x : x + 4] = 255


def rest_and_go(frames):
    for k in range(N):
        x = 10 + 5 * max(k - 9, 0) // 3
        frames[k, 30:34, x : x + 4] = 255


def still(frames):
    frames[:, 30:34, 40:44] = 255


def panned(frames):
    """Buildings, sharper than optics are, as the camera pans."""
    rng = np.random.default_rng(4)
    row, column, high, wide = rng.integers([5, 5, 3, 3], [50, 150, 9, 9], (25, 4)).T
    wall = np.full((ROWS, 240), np.nan)
    for j, i, h, w in zip(row, column, high, wide, strict=True):
        wall[j : j + h, i : i + w] = 200
    for k in range(N):
        seen = wall[:, k : k + COLUMNS]
        frames[k] = np.where(np.isnan(seen), frames[k], seen + np.random.default_rng(k).normal(0, 2, seen.shape))
    frames[:] = np.round(frames)


@pytest.mark.parametrize("draw", [flashing, narrow, lamps, there_and_back, rest_and_go, still, panned])
def test_no_target_is_taken_out(draw):
    frames = scene(2)
    draw(frames)
    assert not any(len(state.now) or len(state.hidden) for state in states(frames))


def test_what_was_not_seen_for_long_is_forgotten(monkeypatch):
    monkeypatch.setattr(module, "MEMORY", 10)
    frames = scene()
    frames[4:8, 8:13, 10:17][:, GLYPHS > 0] = 255
    sizes = [len(state.pixels) for state in states(frames)]
    assert sizes[7] == GLYPHS.sum()
    assert sizes[-1] == 0


@pytest.mark.parametrize("seed", longer(range(3), 1, 2))
def test_sharp_parts_are_those_of_one_value_with_sharp_outlines(seed):
    rng = np.random.default_rng(seed)
    image = np.round(ndimage.gaussian_filter(rng.normal(0, 20, (40, 50)), 1)).astype(np.float32)
    image[rng.random(image.shape) < 0.1] = 60
    image[5:9, 5:30] = image[20:35, 10] = image[22, 40:46] = 80
    bound, share, left = 15.0, 0.7, 0.2
    wanted = set()
    for value in np.unique(image):
        names, count = ndimage.label(image == value, np.ones((3, 3)))
        for name in range(1, count + 1):
            part, sides = names == name, []
            for turns in range(4):
                inside, values = np.rot90(part, turns), np.rot90(image, turns)
                counts = inside[2:] & ~inside[1:-1] & ~inside[:-2]
                here, first, second = (values[2 - k : len(values) - k][counts] for k in range(3))
                rest = (first - second) * np.sign(here - second)
                sides += list((np.abs(here - first) > bound) & (rest <= left * np.abs(here - second)))
            if sides and np.mean(sides) >= share:
                wanted.add(tuple(np.flatnonzero(part)))
    pixels, ends = sharp_parts(image, np.float32(bound), share, np.float32(left))
    found = {tuple(np.sort(pixels[a:b])) for a, b in pairwise(ends)}
    assert len(wanted) > 5
    assert found == wanted


def test_a_flat_part_of_the_scene_is_none():
    image = np.random.default_rng(0).normal(100, 2, (60, 80)).round().astype(np.float32)
    image[10:50, 10:70] = 0
    image[30, 40:52] = 200
    pixels, ends = sharp_parts(image, np.float32(30), 0.7, np.float32(0.2))
    assert len(ends) == 2
    np.testing.assert_array_equal(pixels // 80, 30)
