"""Recorded frames: peaks of a frame against one Gaussian of SciPy's over the same frame; reach: 1.7 of them a frame."""

import numpy as np
import pytest
from scipy import ndimage

from elusive.preprocess import PeakFinder

RNG = np.random.default_rng(0)


class Finder:
    """Steps through frames of a textured scene, again and again, some while past the first."""

    def __init__(self, shape, camera):
        scene = 40 * ndimage.gaussian_filter(RNG.standard_normal((shape[0] + 80, shape[1] + 80)), 2.5) * 9
        steps = np.array(camera) * np.arange(8)[:, None]
        self.frames = [
            100 + ndimage.shift(scene, (y, x), order=1)[40:-40, 40:-40] + RNG.normal(0, 2, shape) for x, y in steps
        ]
        # to and fro, so that the camera does not jump
        self.frames += self.frames[-2:0:-1]
        self.finder, self.number = PeakFinder(), 0
        self.state = self.finder.init()
        for _ in range(30):
            self()

    def __call__(self):
        self.state = self.finder.step(self.state, self.frames[self.number % len(self.frames)])
        self.number += 1


@pytest.mark.parametrize("shape", [(512, 640), (256, 320)])
@pytest.mark.parametrize("camera", [(0.0, 0.0), (1.3, -0.7)])
def test_peaks_of_a_frame(benchmark, best_of, report, shape, camera):
    ours = Finder(shape, camera)
    frame = ours.frames[0]
    step, smooth = best_of(ours, lambda: ndimage.gaussian_filter(frame, 2))
    what = f"peaks of {shape[1]}x{shape[0]}, camera {'moves' if any(camera) else 'rests'}: of the time of 1.7 Gaussians"
    report(what, 1.7 * smooth / step, 1)
    benchmark.pedantic(ours, rounds=3)
