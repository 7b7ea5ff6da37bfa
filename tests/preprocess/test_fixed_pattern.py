"""A pattern on the sensor while the scene goes by: told from the scene, and taken away."""

import numpy as np
import pytest
from scipy import ndimage

from elusive.preprocess import PeakFinder
from tests.longer import longer

SHAPE, NOISE = (80, 96), 2.0
STEP = np.array([-0.7, 0.3])  # of the scene, each frame


def scene_of(seed, sigma=3.0):
    rough = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=(200, 240)), sigma)
    return 20 * rough / rough.std()


def panned(scene, k, step=STEP):
    x, y = k * step
    return ndimage.shift(scene, (y, x), order=3, mode="nearest")[60 : 60 + SHAPE[0], 70 : 70 + SHAPE[1]]


def stepped(frames):
    finder = PeakFinder()
    state, states = finder.init(), []
    for frame in frames:
        state = finder.step(state, frame)
        states.append(state)
    return states


def pattern_of(seed):
    """Neighbouring pixels alike, as one amplifier's: a white one hardly holds the coarser map."""
    rough = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=SHAPE), 0.8)
    return 5 * NOISE * rough / rough.std()


@pytest.mark.parametrize("seed", longer([1, 2, 3], 2, 3))
def test_the_scene_is_followed_under_a_pattern(seed):
    rng = np.random.default_rng(seed)
    pattern = pattern_of(seed)
    states = stepped(100 + panned(scene_of(seed), k) + pattern + rng.normal(0, NOISE, SHAPE) for k in range(50))
    assert states[-1].pattern.taken
    turns = [state.output.number for state in states if state.output.anew]
    assert len(turns) == 1
    # beyond, the scene is where it truly is; steps alone tell: where it was before is not known
    steps = np.array([state.step_px for state in states[turns[0] + 3 :]])
    assert np.median(np.hypot(*(steps - STEP).T)) < 0.1
    assert np.hypot(*(steps - STEP).sum(axis=0)) < 3.0


def test_a_right_camera_has_no_pattern():
    rng = np.random.default_rng(5)
    for step in (STEP, np.zeros(2)):
        states = stepped(100 + panned(scene_of(5), k, step) + rng.normal(0, NOISE, SHAPE) for k in range(40))
        assert not any(state.pattern.taken or state.output.anew for state in states)


@pytest.mark.parametrize("seed", longer([1, 2, 3], 2, 3))
def test_clouds_over_ground_at_rest_make_no_pattern(seed):
    rng = np.random.default_rng(seed)
    clouds, ground = scene_of(seed), 2 * panned(scene_of(seed + 10, 1.5), 0)
    share = 1 / (1 + np.exp(-(np.arange(SHAPE[0])[:, None] - 40.0)))
    states = stepped(
        100 + (1 - share) * panned(clouds, k) + share * ground + rng.normal(0, NOISE, SHAPE) for k in range(50)
    )
    assert not any(state.pattern.taken for state in states)
    assert np.abs(states[-1].offset_px).max() < 1.0
