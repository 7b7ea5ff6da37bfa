import numpy as np
import pytest
from scipy.special import ndtri

from elusive.errors import DataError
from elusive.preprocess import Whitener
from elusive.preprocess.background import LEVELS
from elusive.preprocess.response import matched_response
from tests.preprocess.scenes import recording
from tests.reference import preprocess as reference


def whitened(scene, **options):
    return list(Whitener(**options).whiten(scene.frames))


def test_follows_the_scene_over_many_frames():
    scene = recording(n=40)
    for frame in whitened(scene):
        assert np.abs(frame.offset_px - scene.offsets[frame.number]).max() < 0.25


def test_response_to_noise_alone_is_standard_normal():
    frames = whitened(recording(n=30), sigmas_px=(1.1,))[12:]
    quantiles = np.mean([frame.quantiles[1] for frame in frames], axis=0)
    np.testing.assert_allclose(quantiles, ndtri(LEVELS), atol=0.35)


def test_noise_map_grows_with_the_noise():
    quiet, loud = (np.median(whitened(recording(n=20, noise=s))[-1].noise) for s in (1.5, 6.0))
    assert 2.5 < loud / quiet < 4.5


def test_target_stands_out_where_it_is():
    scene = recording(height=20.0)
    for frame in whitened(scene)[10:]:
        response = np.nan_to_num(frame.response)
        row, column = np.unravel_index(response.argmax(), response.shape)
        assert np.hypot(*(scene.target[frame.number] - [column, row])) < 1.5
        assert response.max() > 6


def test_a_defect_is_masked_and_a_target_is_not():
    scene = recording(height=60.0, defect=(70, 20))
    last = whitened(scene)[-1]
    x, y = np.round(scene.target[-1]).astype(int)
    assert last.response[y, x] > 10
    around = last.response[17:24, 67:74]
    assert np.nan_to_num(around).max() < 5


def test_earlier_response_lies_over_the_scene():
    scene = recording(speed=(0.0, 0.0), height=0.0, n=20)
    frames = scene.frames.copy()
    # a point appears in the scene and rests there
    y, x = np.mgrid[: frames.shape[1], : frames.shape[2]]
    for k in range(12, 20):
        px, py = scene.target[k]
        frames[k] += 40 * np.exp(-((x - px) ** 2 + (y - py) ** 2) / 2)
    states = list(Whitener().whiten(frames))
    last = states[-1]
    px, py = np.round(scene.target[19]).astype(int)
    assert last.earlier[py, px] > 0.65 * last.response[py, px] > 5


def test_masked_pixels_and_the_first_frames():
    scene = recording(n=14)
    frames = scene.frames.copy()
    frames[:, 30:33, 50:53] = np.nan
    outputs = list(Whitener().whiten(frames))
    assert len(outputs) == 13
    assert outputs[0].earlier is None
    assert outputs[-1].earlier is not None
    assert np.isnan(outputs[-1].response[31, 51])
    assert np.array_equal(outputs[-1].mask, np.isnan(outputs[-1].response))
    assert np.abs(outputs[-1].offset_px - scene.offsets[-1]).max() < 0.25


def test_is_causal_and_its_memory_flat():
    scene = recording(n=36)
    changed = scene.frames.copy()
    changed[30:] = 0.0
    whitener = Whitener(ring=10)
    state = other = whitener.init()
    sizes = []
    for frame, same in zip(scene.frames[:30], changed[:30], strict=True):
        state, other = whitener.step(state, frame), whitener.step(other, same)
        sizes.append(len(state.ring) + len(state.responses))
    assert np.array_equal(state.output.response, other.output.response, equal_nan=True)
    assert max(sizes) == sizes[-1] == 10 + 6


def test_frames_without_any_noise():
    outputs = list(Whitener().whiten([np.full((60, 70), 9.0)] * 5))
    assert not np.nan_to_num(outputs[-1].response).any()


@pytest.mark.parametrize(
    ("frame", "message"),
    [(np.zeros((60, 71)), "shape"), (np.full((60, 70), np.inf), "infinity"), (np.full((60, 70), np.nan), "NaN")],
)
def test_refuses_frames_with_a_sentence(frame, message):
    whitener = Whitener()
    state = whitener.step(whitener.init(), np.zeros((60, 70)))
    with pytest.raises(DataError, match=rf"frame 1: .*{message}"):
        whitener.step(state, frame)


def test_matched_response_equals_its_twin():
    rng = np.random.default_rng(2)
    variance = rng.uniform(1, 4, (40, 44))
    residual = rng.standard_normal((40, 44)) * np.sqrt(variance)
    seen = rng.random((40, 44)) > 0.05
    found = matched_response(residual, variance, seen, (1.1,), 4001)
    expected = reference.matched(residual, variance, seen, 1.1)
    ratio = (found / expected)[np.isfinite(found) & (np.abs(expected) > 0.1)]
    np.testing.assert_allclose(ratio, np.median(ratio), rtol=2e-3)
