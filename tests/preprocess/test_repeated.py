"""Shapes that come again in each frame are taken out; noise and what is shorter stay."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.preprocess.repeated import nothing_repeated, without_repeated

SAMPLES, FRAMES, LATE = 200, 900, 300
AT = np.arange(SAMPLES)


def run(shape, sizes, complex_=False):
    """Return frames with a shape, as often as large as told, and what is made of them."""
    rng, state, came, left = np.random.default_rng(1), nothing_repeated(SAMPLES, 8), [], []
    for size in sizes:
        noise = rng.standard_normal(SAMPLES)
        if complex_:
            noise = (noise + 1j * rng.standard_normal(SAMPLES)) / np.sqrt(2)
        came.append(noise + size * shape)
        state, frame = without_repeated(state, came[-1])
        left.append(frame)
    return state, np.array(came), np.array(left)


@pytest.mark.parametrize("turn", [-1.0, np.exp(0.7j)])
def test_hum_goes(turn):
    complex_ = np.iscomplexobj(turn)
    shape = 0.3 * (np.exp(1j * AT / 9) if complex_ else np.sin(AT / 9))
    sizes = turn ** np.arange(FRAMES)
    _, _, left = run(shape, sizes, complex_)
    parts = (left @ shape.conj() * np.conj(sizes)).real / np.sum(np.abs(shape) ** 2)
    assert parts[:50].mean() == pytest.approx(1, abs=0.3)
    # along a shape the noise goes too: what is left is the error of the shape
    assert abs(parts[-LATE:].mean()) < 0.2
    assert np.mean(np.abs(left[-LATE:]) ** 2) == pytest.approx(1, abs=4 * np.sqrt(2 / (LATE * SAMPLES)))


def test_noise_stays_as_it_is():
    state, came, left = run(np.zeros(SAMPLES), np.zeros(FRAMES))
    assert not len(state.shapes)
    assert np.array_equal(came, left)


def test_what_is_short_stays():
    state, came, left = run(np.where(AT < 12, 2.0, 0.0), np.random.default_rng(2).standard_normal(FRAMES))
    assert not len(state.shapes)
    assert np.array_equal(came, left)
