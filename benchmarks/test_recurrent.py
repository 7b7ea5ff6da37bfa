"""The recurrent filter's step against the copy bandwidth of this run and against NumPy; a long signal's step.

Share of the copy bandwidth: bytes that the update reads and writes (each velocity's plane once each) over its time,
against bytes that ``np.copyto`` reads and writes between two arrays of the same size over its time; one thread each,
in alternating rounds. A step includes the maximum over velocities and where it is from; the copy has nothing to do.
"""

from __future__ import annotations

import numpy as np
import pytest

from elusive.filters.accumulate.recurrent import RecurrentFilter

RNG = np.random.default_rng(0)


class Numpy:
    """Eq. 7 as it is written in NumPy: every map rolled, then the maximum over the stack."""

    def __init__(self, model, evidence):
        number = evidence.dtype.type
        self.alpha, self.evidence = number(model.smoothing), number(1 - model.smoothing) * evidence
        vectors = model.motion_vectors(evidence.ndim)[:, ::-1].astype(int)
        self.shifts = [tuple(vector) for vector in vectors.tolist()]
        self.axes = tuple(range(evidence.ndim))
        self.planes = np.zeros((len(vectors), *evidence.shape), number)

    def __call__(self):
        moved = [np.roll(*pair, axis=self.axes) for pair in zip(self.planes, self.shifts, strict=True)]
        self.planes = np.stack(moved)
        self.planes *= self.alpha
        self.planes += self.evidence
        self.best, self.which = self.planes.max(axis=0), self.planes.argmax(axis=0)


class NumpyMapByMap(Numpy):
    """The same written for the cache: no temporary is larger than one map, the maximum is kept alongside."""

    def __call__(self):
        best, which = np.full_like(self.evidence, -np.inf), np.zeros(self.evidence.shape, np.int32)
        for v, shift in enumerate(self.shifts):
            plane = np.roll(self.planes[v], shift, axis=self.axes)
            plane *= self.alpha
            plane += self.evidence
            self.planes[v] = plane
            which[plane > best] = v
            np.maximum(best, plane, out=best)
        self.best, self.which = best, which


class Ours:
    """A running filter; every call is a step."""

    def __init__(self, model, evidence):
        self.model, self.evidence = model, evidence
        self.state = model.init(RNG, 0.0)

    def __call__(self):
        self.state = self.model.step(self.state, self.state.time_s + 1, self.evidence, RNG)


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("velocities", [9, 15, 21])
@pytest.mark.parametrize("side", [256, 512])
def test_step_against_copy_and_numpy(benchmark, best_of, report, side, velocities, precision):
    model = RecurrentFilter(max_velocity=(velocities - 1) / 2, precision=precision)
    evidence = RNG.standard_normal((side, side)).astype("f4" if precision == "single" else "f8")
    ours, twin, lean = Ours(model, evidence), Numpy(model, evidence), NumpyMapByMap(model, evidence)
    for _ in range(2):
        ours()
        twin()
        lean()
    for rival in (twin, lean):
        np.testing.assert_array_equal(ours.state.velocity, rival.which)
        np.testing.assert_allclose(ours.state.score * ours.state.deviation, rival.best, rtol=1e-5)
    what = f"recurrent step, {velocities}x{velocities} velocities x {side}x{side}, {precision}"
    step, whole, by_map = best_of(ours, twin, lean, rounds=3)
    report(f"{what}: against NumPy", whole / step, 6)
    report(f"{what}: against NumPy map by map", by_map / step, 6)
    del twin
    source, target = lean.planes, np.ones_like(lean.planes)
    step, copy = best_of(ours, lambda: np.copyto(target, source))
    report(f"{what}: % of the copy bandwidth", 100 * copy / step, 60)
    benchmark.pedantic(ours, rounds=3)


def test_step_of_a_signal(benchmark, best_of, report):
    model = RecurrentFilter(min_velocity=0.0, max_velocity=10.0)
    evidence = RNG.standard_normal(1200).astype(np.float32)
    ours, twin = Ours(model, evidence), Numpy(model, evidence)
    step, numpy_step = best_of(ours, twin)
    report("recurrent step, 11 velocities x 1200 samples, single: against NumPy", numpy_step / step, 6)
    benchmark(ours)
