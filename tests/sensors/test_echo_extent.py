"""How far echoes reach is read from one turn: of points, of clutter constant over a pulse, of nothing at all."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.sensors.echo_extent import echo_extent, first_turn
from elusive.sensors.spokes import Spokes
from elusive.systems.video.sea import SeaState, VideoRadar
from elusive.systems.video.simulate import VideoSimulation, scenario_of, spokes_of


def spokes_with(amplitude, step_m=5.0):
    n = len(amplitude)
    azimuth = 2 * math.pi * (np.arange(n) + 0.5) / n
    unknown = np.full(n, np.nan)
    return Spokes(np.arange(n) / n, azimuth, True, 0.0, step_m, amplitude, 0, unknown, np.full((n, 2), np.nan))


def test_points_of_a_gaussian_beam_and_pulse_are_as_long_as_the_law_says():
    """The correlation of exp(-x^2 / 2 s^2) halves at s sqrt(4 ln 2): of amplitude, the width of power."""
    rng = np.random.default_rng(1)
    field = np.where(rng.random((1024, 512)) < 0.002, rng.exponential(size=(1024, 512)), 0.0)
    beam, pulse = 20.0, 8.0  # samples between half powers, both ways and in range
    spectrum = np.fft.fft2(field)
    for width, axis in ((beam, 0), (pulse, 1)):
        frequency = np.fft.fftfreq(field.shape[axis])
        gain = np.exp(-2 * (math.pi * frequency * width / math.sqrt(4 * math.log(2))) ** 2)
        spectrum *= gain[:, None] if axis == 0 else gain
    found = echo_extent([spokes_with(np.fft.ifft2(spectrum).real.astype(np.float32))])
    # the lower quartile of patches with a dozen points each lies below what many points would show
    assert 0.75 < found.pulse_m / (math.sqrt(2) * pulse * 5.0) < 1.05
    assert 0.75 < found.beam_deg / (2 * beam * 360 / 1024) < 1.05


@pytest.mark.parametrize("coast_north_m", [2500.0, None])
def test_a_radars_own_are_read_from_sea_and_coast(coast_north_m):
    radar = VideoRadar(step_m=5.0, samples=600, spokes=2048, beam_deg=1.5, pulse_m=40.0, bits=8)
    simulation = VideoSimulation(turns=2, coast_north_m=coast_north_m, radar=radar, sea=SeaState(shape=1.0))
    rng = np.random.default_rng(2)
    found = echo_extent(first_turn(spokes_of(scenario_of(simulation, rng), simulation, rng)))
    assert 0.6 < found.pulse_m / 40.0 < 1.5
    assert 0.6 < found.beam_deg / 1.5 < 1.5


def test_samples_of_noise_say_nothing():
    noise = np.random.default_rng(3).rayleigh(size=(512, 256)).astype(np.float32)
    found = echo_extent([spokes_with(noise)])
    assert math.isnan(found.beam_deg)
    assert math.isnan(found.pulse_m)


def test_a_turn_is_taken_and_no_more():
    parts = [spokes_with(np.zeros((64, 40), np.float32)) for _ in range(4)]
    assert len(first_turn(iter(parts))) == 2


def first_of_sea(rng):
    """The first spokes of an open sea with a beam of 2 degrees, and where its samples are, as complex numbers [m]."""
    simulation = VideoSimulation(
        turns=2, ships=0, coast_north_m=None, sea={"shape": 5.0}, radar={"spokes": 512, "samples": 256}
    )
    first = next(iter(spokes_of(scenario_of(simulation, rng), simulation, rng)))
    distance = first.start_m + first.step_m * np.arange(256)
    return first, distance * np.exp(1j * first.azimuth_rad)[:, None]


def beam_in_rain(first, places, cells):
    """The beam that is read where cells of rain, each a middle, a size and a power over the sea's, are added."""
    rain = sum(power * np.exp(-0.5 * np.abs((places - middle) / size) ** 2) for middle, size, power in cells)
    return echo_extent([first._replace(amplitude=(first.amplitude * np.sqrt(1 + rain)).astype(np.float32))]).beam_deg


@pytest.mark.parametrize("seed", range(3))
def test_showers_do_not_make_the_beam_long(seed):
    """They rise over tens of degrees in most of what shows any correlation: a beam of 2 degrees was read as 3."""
    rng = np.random.default_rng(seed)
    first, places = first_of_sea(rng)
    cells = []
    for _ in range(12):
        middle, size = rng.uniform(500, 3500) * np.exp(2j * np.pi * rng.random()), rng.uniform(200, 700)
        cells.append((middle, size, rng.uniform(3, 15)))
    assert 0.75 < beam_in_rain(first, places, cells) / 2.0 < 1.35


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [0, 3])
def test_a_squall_does_not_tell_the_beam(seed):
    """Its cells, wider than a beam, are alike from spoke to spoke: 2 degrees were read as 3 and 3.8."""
    rng = np.random.default_rng(seed)
    first, places = first_of_sea(rng)
    cells = []
    for _ in range(3000):
        middle, size = complex(*rng.uniform(-4000, 4000, 2)), rng.uniform(60, 120)
        cells.append((middle, size, rng.exponential(10)))
    assert 0.75 < beam_in_rain(first, places, cells) / 2.0 < 1.35
