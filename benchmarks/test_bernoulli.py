"""The Bernoulli step on 20 x 20 frames with 1500 + 500 particles, against NumPy and Stone Soup; and its memory."""

from __future__ import annotations

import os
import tracemalloc
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from time import perf_counter

import numpy as np
import pytest
from scipy.ndimage import correlate1d

from benchmarks.stone_soup import Opponent, frame_model, patch_model
from elusive import run
from elusive.experiments.amrouche2018.scenario import WeakTarget
from elusive.filters.particle.bernoulli import BernoulliFilter
from elusive.motion import square_root
from tests.reference.filters import bernoulli_step

MODEL = BernoulliFilter()
ROOT = square_root(MODEL.motion.Q(1.0))
FRAMES = WeakTarget().simulate(np.random.default_rng(0)).frames


def quick_map(frame, sensor, intensity):
    """The birth map by SciPy's separable correlation: what one would write in NumPy for whole frames."""
    k = np.arange(-sensor.patch_cells, sensor.patch_cells + 1)
    g_x, g_y = (np.exp(-0.5 * (k * step / sensor.psf_sigma) ** 2) for step in (sensor.dx, sensor.dy))
    peak, ones = sensor.gain * intensity, np.ones_like(frame)
    cross = correlate1d(correlate1d(frame, g_y, 0, mode="constant"), g_x, 1, mode="constant")
    square = correlate1d(correlate1d(ones, g_y**2, 0, mode="constant"), g_x**2, 1, mode="constant")
    return (peak * cross - 0.5 * peak**2 * square) / sensor.noise_sigma**2


def numpy_step(state, frame, rng):
    return bernoulli_step(MODEL, ROOT, state, frame, rng, quick_map)


@pytest.fixture
def belief():
    rng = np.random.default_rng(1)
    *_, state = run(MODEL, FRAMES[:15], rng, start_s=-1.0)
    return state


def test_step_against_numpy(benchmark, belief, best_of, report):
    frame, rng = FRAMES[15], np.random.default_rng(2)
    ours, twin = (
        MODEL.step(belief, 15.0, frame, np.random.default_rng(3)),
        numpy_step(belief, frame, np.random.default_rng(3)),
    )
    np.testing.assert_allclose(ours.weights, twin[3], rtol=1e-10, atol=1e-12)
    mine, theirs = best_of(lambda: MODEL.step(belief, 15.0, frame, rng), lambda: numpy_step(belief, frame, rng))
    report("Bernoulli step, 1500 + 500 particles, against NumPy", theirs / mine, 6)
    benchmark(MODEL.step, belief, 15.0, frame, rng)


@pytest.mark.parametrize(
    ("image", "how"),
    [(patch_model, "measurement model in patches, written for speed"), (frame_model, "its Gaussian measurement model")],
)
def test_step_against_stone_soup(benchmark, belief, best_of, report, image, how):
    frame, rng = FRAMES[15], np.random.default_rng(2)
    opponent = Opponent(image(MODEL.sensor), belief.particles, frame)
    mine, theirs = best_of(lambda: MODEL.step(belief, 15.0, frame, rng), opponent)
    report(f"the same, against Stone Soup's ParticleUpdater, {how}", theirs / mine, 20)
    benchmark.pedantic(opponent, rounds=10)


def one_run(seed):
    """Existence at the end of one run over the 30 frames."""
    *_, state = run(MODEL, FRAMES, np.random.default_rng(seed), start_s=-1.0)
    return state.existence


def some_runs(seeds):
    return [one_run(seed) for seed in seeds]


def numpy_run(seed):
    rng = np.random.default_rng(seed)
    state = tuple(MODEL.init(rng, -1.0))
    for frame in FRAMES:
        state = numpy_step(state, frame, rng)
    return state[1]


def test_batch_of_runs_against_numpy(benchmark, report):
    runs, workers = 200, os.cpu_count() or 1
    shares = [range(first, runs, 4 * workers) for first in range(4 * workers)]
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        list(pool.map(one_run, range(4 * workers)))
        start = perf_counter()
        found = benchmark.pedantic(lambda: list(pool.map(some_runs, shares)), rounds=3)
        ours = (perf_counter() - start) / 3
    twins, start = 10, perf_counter()
    expected = [numpy_run(seed) for seed in range(twins)]
    theirs = (perf_counter() - start) * runs / twins
    existence = {
        seed: value
        for share, values in zip(shares, found, strict=True)
        for seed, value in zip(share, values, strict=True)
    }
    np.testing.assert_allclose([existence[seed] for seed in range(twins)], expected, rtol=1e-6)
    report(f"batch of 200 runs of 30 frames on {workers} processes, against NumPy on one", theirs / ours, 15)


def test_memory_over_a_long_stream(benchmark, report):
    small = MODEL.replace(particles=150, newborns=50)
    stream = run(small, (FRAMES[k % 30] for k in range(100_000)), np.random.default_rng(4))
    for _ in range(1000):
        next(stream)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    benchmark.pedantic(lambda: sum(1 for _ in stream), rounds=1)
    grown = max(tracemalloc.get_traced_memory()[0] - before, 1)
    tracemalloc.stop()
    # one state takes 10 kB: a tenth of a byte a frame is no growth
    report("bytes of one state over bytes kept a frame, 100 000 frames", 10_000 / (grown / 99_000), 10_000)
