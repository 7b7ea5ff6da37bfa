"""Recorded frames: peaks of a frame, and a whole step, against one Gaussian of SciPy's over the same frame.

Reach: 1.7 of them a frame for its peaks, 2.5 for the step, which 100 targets at most double.
"""

from itertools import cycle

import numpy as np
import pytest
from scipy import ndimage

from elusive.preprocess import PeakFinder
from elusive.systems.images.track import ImageTracking, track_images

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


def noise_with(targets, shape, count=40):
    """Yield frames of white noise with targets of 10 deviations, on a grid, that part at .3 px a frame."""
    rng = np.random.default_rng(1)
    y, x = np.mgrid[-5:6, -5:6]
    side = int(np.ceil(np.sqrt(targets)))
    starts = np.stack(np.meshgrid(np.linspace(20, shape[1] - 30, side), np.linspace(20, shape[0] - 30, side)), 2)
    angles = rng.uniform(0, 2 * np.pi, targets)
    for k in range(count):
        frame = 100 + rng.normal(0, 2, shape)
        for start, angle in zip(starts.reshape(-1, 2)[:targets], angles, strict=True):
            at = start + 0.3 * k * np.array([np.cos(angle), np.sin(angle)])
            column, row = np.round(at).astype(int)
            dx, dy = at - (column, row)
            frame[row - 5 : row + 6, column - 5 : column + 6] += 20 * np.exp(-((x - dx) ** 2 + (y - dy) ** 2) / 2)
        yield frame


class Stepper:
    """Tracks through frames, to and fro."""

    def __init__(self, frames, shape):
        steps = track_images(cycle(frames + frames[-2:0:-1]), ImageTracking().bind(shape))
        self.step = lambda: next(steps)
        for _ in range(40):
            self.step()


@pytest.mark.parametrize("shape", [(512, 640), (256, 320)])
def test_a_whole_step(best_of, report, shape):
    camera = Finder(shape, (1.3, -0.7)).frames
    empty, full = (list(noise_with(targets, shape)) for targets in (0, 100))
    scene, none, many, smooth = best_of(
        *(Stepper(frames, shape).step for frames in (camera, empty, full)),
        lambda: ndimage.gaussian_filter(camera[0], 2),
    )
    what = f"whole step of {shape[1]}x{shape[0]}"
    report(f"{what}, camera moves: of the time of 2.5 Gaussians", 2.5 * smooth / scene, 1)
    report(f"{what}, noise alone: of the time of 2.5 Gaussians", 2.5 * smooth / none, 1)
    report(f"{what}, noise alone, of the time with 100 targets", none / many, 0.5)
