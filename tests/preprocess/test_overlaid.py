"""What is drawn with soft edges is found where the scene goes by, and no part of the scene, nor what is followed."""

import numpy as np
import pytest
from PIL import Image, ImageDraw
from scipy import ndimage

from elusive.preprocess._overlaid_kernels import vote
from elusive.preprocess.overlaid import overlaid, without_overlaid
from tests.reference import preprocess as reference

N, ROWS, COLUMNS, STEP = 30, 96, 128, np.array([0.8, -0.5])  # the scene's, x and y a frame
ROW, COLUMN = np.indices((ROWS, COLUMNS))


def scene(seed=0):
    """A camera that pans over clouds, with noise of a deviation of two."""
    rng = np.random.default_rng(seed)
    clouds = ndimage.gaussian_filter(rng.standard_normal((160, 200)), 3.0)
    clouds *= 9 / clouds.std()
    at = ([ROW - k * STEP[1] + 30, COLUMN - k * STEP[0] + 50] for k in range(N))
    return 120 + np.array([ndimage.map_coordinates(clouds, where, order=1) for where in at]) + rng.normal(
        0, 2, (N, ROWS, COLUMNS)
    )  # fmt: skip


def soft(draw):
    """How far each pixel is covered, of what is drawn at three times the size."""
    image = Image.new("L", (3 * COLUMNS, 3 * ROWS))
    draw(ImageDraw.Draw(image))
    whole = np.asarray(image, float).reshape(ROWS, 3, COLUMNS, 3).mean(axis=(1, 3)) / 255
    return ndimage.gaussian_filter(whole, 0.5)


def words(pen, text="CAM 12:34"):
    pen.text((30, 15), text, fill=255, font_size=36)


def corners(pen):
    for x, y in ((-1, -1), (-1, 1), (1, -1), (1, 1), (-1, 0), (1, 0)):
        corner = 192 + 100 * x, 144 + 80 * y
        pen.line((*corner, corner[0] - 40 * x, corner[1]), fill=255, width=4)
        pen.line((*corner, corner[0], corner[1] - 40 * (y or 0.5)), fill=255, width=4)


def last_of(frames):
    """What is taken out of the last frame, by what those before tell."""
    state = None
    for k, frame in enumerate(frames[:-1].astype(np.float32)):
        state = overlaid(state, frame, k * STEP)
    return np.isnan(without_overlaid(frames[-1].astype(np.float32), state))


@pytest.mark.parametrize(("draw", "ink", "share"), [(words, 255, 1.0), (words, 0, 0.6), (corners, 235, 1.0)])
def test_soft_strokes_are_taken_out_and_little_beside_them(draw, ink, share):
    cover = soft(draw)
    taken = last_of(scene() + share * cover * (ink - scene()))
    assert taken[cover > 0.5].mean() > 0.9
    assert taken[ndimage.distance_transform_edt(cover < 0.05) > 4].mean() < 0.03


def test_digits_that_change_are_taken_out_with_what_is_beside_them():
    frames = scene()
    covers = [soft(lambda pen, k=k: words(pen, f"12:34:{k:02d}")) for k in range(N)]
    taken = last_of(np.array([frame + cover * (255 - frame) for frame, cover in zip(frames, covers, strict=True)]))
    assert taken[covers[-1] > 0.5].mean() > 0.9


def followed(k, frames):
    """A long, thin target, off the middle, that the camera follows exactly."""
    return 100 * np.exp(-((COLUMN - 30) ** 2) / (2 * 6**2) - (ROW - 70) ** 2 / (2 * 1.2**2))


def cross(k, frames):
    """A reticle, with a target in its middle that the camera follows."""
    lines = (np.abs(ROW - 48) < 1) | (np.abs(COLUMN - 64) < 1)
    about = np.maximum(abs(ROW - 48), abs(COLUMN - 64))
    return 90.0 * (lines & (about > 5) & (about < 15)) + 60 * np.exp(-((COLUMN - 64) ** 2 + (ROW - 48) ** 2) / 3)


def horizon(k, frames):
    """Along which the camera pans."""
    return np.where(ROW > 50, -60.0, 0.0) + 80 * (np.abs(ROW - 20 - k * STEP[1]) < 1)


def posts(k, frames):
    return 80.0 * (np.abs((COLUMN - k * STEP[0]) % 31 - 10) < 1.2)


def far(k, frames):
    """The upper half does not go by."""
    return np.where(ROW < 48, frames[0] - frames[k], 0.0)


@pytest.mark.parametrize("add", [followed, cross, horizon, posts, far])
@pytest.mark.parametrize("seed", range(2))
def test_nothing_of_the_scene_is(add, seed):
    frames = scene(seed)
    noise = np.random.default_rng([seed, 1]).normal(0, 2, frames.shape)
    assert not last_of(np.array([frame + add(k, frames) for k, frame in enumerate(frames)]) + noise).any()


def test_what_has_gone_is_forgotten():
    frames, cover = np.concatenate([scene(), scene(1), scene(2), scene(3)]), soft(words)
    frames[:N] += cover * (255 - frames[:N])
    assert not last_of(frames).any()


def test_votes_are_those_of_the_twin():
    rng = np.random.default_rng(2)
    before, votes = rng.normal(0, 10, (2, 20, 25)).astype(np.float32)
    image = np.where(rng.random(before.shape) < 0.5, before, np.roll(before, (1, -2), (0, 1))) + np.float32(3)
    image[4, 5] = before[9, 9] = np.nan
    numbers = 5.0, 0.25, 0.98, 4.0
    found = vote(image, before, 1, -2, np.float32(3), np.abs(votes), *(np.float32(number) for number in numbers))
    expected = reference.voted(image, before, (1, -2), 3.0, np.abs(votes), *numbers)
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert len(np.unique(np.sign(np.round(found - np.abs(votes), 3)))) == 3
