import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from elusive.errors import DataError
from elusive.preprocess import Registration, follow_scene, shift
from elusive.preprocess._kernels import ring_quantiles, sample_shifted
from tests.preprocess.scenes import recording
from tests.reference import preprocess as reference


@given(st.floats(-4, 4), st.floats(-4, 4), st.integers(0, 99))
@settings(max_examples=15, deadline=None)
def test_finds_a_known_shift(dx, dy, seed):
    scene = recording(n=2, camera=(dx, dy), noise=1.0, seed=seed)
    found = Registration().offset(*scene.frames)
    assert np.abs(found - scene.offsets[1]).max() < 0.05


def test_far_shift_and_frames_that_are_not_square():
    scene = recording(n=2, camera=(14.3, -9.6), noise=1.0)
    assert np.abs(Registration().offset(*scene.frames) - [14.3, -9.6]).max() < 0.1


def test_shift_lays_the_frame_over_the_reference():
    first, second = recording(n=2, camera=(2.4, 1.3), noise=0.0).frames
    laid = shift(second, np.array([2.4, 1.3]))
    inside = np.isfinite(laid)
    assert inside.mean() > 0.9
    assert np.abs(laid - first)[inside].mean() < 0.1 * np.abs(second - first)[inside].mean()


def test_a_bright_mover_does_not_pull_the_offset():
    scene = recording(n=2, camera=(1.2, 0.4), speed=(6.0, -3.0), height=500.0)
    assert np.abs(Registration().offset(*scene.frames) - scene.offsets[1]).max() < 0.1


def test_without_texture_the_offset_is_zero():
    flat = np.full((40, 50), 7.0)
    assert np.array_equal(Registration().offset(flat, flat), [0.0, 0.0])


@pytest.mark.parametrize("bad", [np.zeros((40, 51)), np.full((40, 50), np.nan), np.zeros((8, 8)), np.zeros(40)])
def test_refuses_what_cannot_be_registered(bad):
    with pytest.raises(DataError, match="reference"):
        Registration().offset(bad, np.zeros((40, 50)))


@pytest.mark.parametrize(
    ("frames", "rows", "columns"), [(1, 17, 23), (2, 16, 20), (7, 17, 23), (20, 9, 30), (3, 4, 600)]
)
def test_sampling_and_quantiles_equal_their_twins(frames, rows, columns):
    rng = np.random.default_rng(frames)
    ring = rng.standard_normal((frames, rows, columns)).astype(np.float32)
    ring[-1, 2, 6], ring[0, :, -1] = np.nan, np.nan
    shifts = rng.uniform(-5, 5, (frames, 2))
    shifts[::3] = np.round(shifts[::3])  # at a whole shift the neighbours have no weight
    shifts[1::3, 0] = columns - 1.5
    for frame, by in zip(ring[:3], shifts, strict=False):
        np.testing.assert_allclose(sample_shifted(frame, *by), reference.shifted(frame, *by), rtol=0, atol=1e-12)
    found, expected = ring_quantiles(ring, shifts, 0.15, 0.4), reference.ring_quantiles(ring, shifts, 0.15, 0.4)
    np.testing.assert_array_equal(found[2], expected[2])
    for one, two in zip(found[:2], expected[:2], strict=True):
        np.testing.assert_allclose(one, two, rtol=0, atol=1e-12)
    assert len(np.unique(found[2])) > 1


def test_a_shift_that_is_whole_but_for_rounding_is_whole():
    frame = np.arange(48.0).reshape(6, 8)
    for by in (1 - 1e-15, 1 + 1e-15):
        np.testing.assert_allclose(sample_shifted(frame, by, -by)[1:, :-1], frame[:-1, 1:], rtol=0, atol=1e-9)
    assert np.isfinite(sample_shifted(frame, 1e-15, -1e-15)).all()


def test_states_follow_the_scene():
    states = np.tile([10.0, 1.0, 20.0, -1.0, 5.0], (20000, 1))
    moved = follow_scene(states, np.array([2.0, -3.0]), 0.3, np.random.default_rng(0))
    assert np.array_equal(moved[:, [1, 3, 4]], states[:, [1, 3, 4]])
    np.testing.assert_allclose(moved[:, [0, 2]].mean(axis=0), [12.0, 17.0], atol=0.01)
    np.testing.assert_allclose(moved[:, [0, 2]].std(axis=0), 0.3, rtol=0.03)


def test_noise_without_a_scene_does_not_move():
    rng = np.random.default_rng(0)
    model = Registration()
    for _ in range(20):
        reference, frame = rng.standard_normal((2, 60, 72))
        np.testing.assert_array_equal(model.offset(reference, frame), [0.0, 0.0])


def test_a_scene_as_faint_as_the_noise_is_still_followed():
    # 4000 pixels of it: the smoothing leaves noise of .28 under a scene of deviation .8
    rng = np.random.default_rng(1)
    wide = ndimage.gaussian_filter(rng.standard_normal((100, 110)), 1.5)
    wide *= 1.0 / wide.std()
    model = Registration()
    for shift_y, shift_x in ((0, 3), (-2, 1), (4, -5)):
        reference = wide[20:80, 20:90] + rng.standard_normal((60, 70))
        frame = wide[20 - shift_y : 80 - shift_y, 20 - shift_x : 90 - shift_x] + rng.standard_normal((60, 70))
        np.testing.assert_allclose(model.offset(reference, frame), [shift_x, shift_y], atol=0.4)
