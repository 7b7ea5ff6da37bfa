"""A camera's plain noise on a pedestal: without any option a faint target is found, and nothing else; what is declared
wrongly is named."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.sensors import ImageSensor
from elusive.systems.images.checks import FrameChecks
from elusive.systems.images.simulate import ImageSimulation, draw_images
from elusive.systems.images.track import ImageTracking, track_images

PEDESTAL, SIGMA, NEAR_PX, SEEDS = 1000, 25.0, 4.0, 20
SMALL, LARGE = (64, 64), (256, 320)  # rows, columns


def drawn(seed, frames, psf_sigma=1.0, shape=SMALL, noise="gaussian"):
    """Frames with a target of 10 dB that moves .5 px a frame, and where it is."""
    scene = ImageSimulation(
        rows=shape[0], columns=shape[1], frames=frames, appears=0, leaves=frames - 1, snr_db=10.0,
        start_x=20, start_y=20, velocity_x=0.45, velocity_y=0.25,
        sensor=ImageSensor(noise_sigma=SIGMA, psf_sigma=psf_sigma, noise=noise), seed=seed,
    )  # fmt: skip
    images = draw_images(scene)
    return PEDESTAL + images.frames, images.truth[:, 0]


def shown(frames):
    """Places of what is shown, of each frame."""
    return [
        [track.mean[[0, 2]] for track in step.tracks if track.status == "confirmed" and track.extra["shown"]]
        for step in track_images(frames, ImageTracking().bind(frames.shape[1:]))
    ]


def found_and_false(psf_sigma, frames, seeds, shape=SMALL):
    """Share of the frames after the tenth in which the target is shown; other things shown in all of them."""
    found, false = [], 0
    for seed in range(seeds):
        images, truth = drawn(seed, frames, psf_sigma, shape)
        for k, places in enumerate(shown(images)):
            near = [np.hypot(*(place - truth[k])) <= NEAR_PX for place in places]
            false += len(near) - sum(near)
            if k > 10:
                found.append(any(near))
    return np.mean(found), false


def test_a_faint_target_is_found_and_nothing_else():
    """Share .99 of a recording, deviation .02: chance moves the mean of six by less than .03."""
    found, false = found_and_false(1.0, 30, 6)
    assert found >= 0.9
    assert false == 0


@pytest.mark.thorough
@pytest.mark.parametrize("shape", [SMALL, LARGE])
@pytest.mark.parametrize("psf_sigma", [0.7, 1.0, 1.5, 2.0])
def test_a_faint_target_is_found_whatever_the_point_spread(psf_sigma, shape):
    found, false = found_and_false(psf_sigma, 60, SEEDS, shape)
    assert found >= 0.9
    assert false == 0


@pytest.mark.thorough
def test_where_nothing_is_nothing_is_shown():
    for seed in range(2 * SEEDS):
        noise = np.random.default_rng(seed).standard_normal((60, *SMALL))
        assert not any(shown(PEDESTAL + SIGMA * noise))


DECLARED = {  # noise, deviation and pedestal that are declared, and what is to be said
    "half the noise": ("gaussian", SIGMA / 2, PEDESTAL, {"noise.scale"}),
    "twice the noise": ("gaussian", 2 * SIGMA, PEDESTAL, {"noise.scale"}),
    "Rayleigh as Gaussian": ("rayleigh", SIGMA, PEDESTAL, {"noise.law"}),
    "a pedestal left in": ("gaussian", SIGMA, 0, {"frames.pedestal"}),
    "nothing wrong": ("gaussian", SIGMA, PEDESTAL, set()),
}


@pytest.mark.thorough
@pytest.mark.parametrize("declared", DECLARED)
def test_what_is_declared_wrongly_is_named_alone(declared):
    noise, sigma, pedestal, names = DECLARED[declared]
    white = {"kind": "several", "sensor": {"kind": "white", "noise_sigma": sigma, "psf_sigma": 1.0}}
    for seed in range(SEEDS):
        frames, _ = drawn(seed, 40, noise=noise)
        checks = FrameChecks(ImageTracking(pedestal=pedestal, filter=white).bind(SMALL))
        for frame in frames:
            checks.add(frame)
        said = {found.name for found in checks.findings() if not found.holds}
        assert said - {"targets.left-over"} == names  # that one needs tracks
