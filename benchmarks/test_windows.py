"""Sliding windows: the cost does not grow with the window, and the ratio to NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.preprocess import ChiSquare, DotProduct, LikelihoodRatio, LocalDeviation

FLAT = 0.8  # short over long window: 1 where the cost is the same, and longer chains of sums overlap less


@pytest.mark.parametrize(("shape", "short", "long"), [((1200,), 3, 501), ((256, 256), 3, 51)], ids=["signal", "image"])
@pytest.mark.parametrize("model", [LocalDeviation, ChiSquare, DotProduct, LikelihoodRatio])
def test_cost_is_flat_in_the_window(benchmark, best_of, report, model, shape, short, long):
    frame = np.random.default_rng(0).standard_normal(shape)
    brief, wide = model(window=short), model(window=long)
    few, many = best_of(lambda: brief.evidence(frame), lambda: wide.evidence(frame))
    report(f"{brief.kind}, {'x'.join(map(str, shape))}: time at window {short} over {long}", few / many, FLAT)
    benchmark(brief.evidence, frame)


def test_local_deviation_against_numpy(benchmark, best_of, report):
    frame = np.random.default_rng(0).standard_normal((256, 256))
    model = LocalDeviation(window=9)

    def gathered():
        return np.lib.stride_tricks.sliding_window_view(np.pad(frame, 4, mode="wrap"), (9, 9)).std(axis=(2, 3))

    np.testing.assert_allclose(model.statistic(frame), gathered(), rtol=1e-12)
    mine, theirs = best_of(lambda: model.statistic(frame), gathered)
    report("std, 256x256, window 9, against NumPy over all windows", theirs / mine, 6)
    benchmark(model.statistic, frame)
