"""Radiation of people and link budgets: closed forms, and the noise's moments."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import sparse

from elusive.errors import DataError, ParameterError
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.link_budget import (
    LinkBudget,
    exponential_attenuation,
    gaussian_attenuation,
    power_law_attenuation,
)
from elusive.sensors.radiation import Radiation

GRID = VoxelGrid(x0=-3, x1=3, y0=-2, y1=2)
CLEAN = Radiation(voxel_noise_db=0)


def rng():
    return np.random.default_rng(0)


def test_people_are_bells_that_add_up():
    people = [(0.3, -0.4), (math.nan, math.nan), (1.2, 0.7)]
    x, y = GRID.centres.T
    expected = sum(20 * np.exp(-0.5 * ((x - a) ** 2 + (y - b) ** 2) / 0.5**2) for a, b in (people[0], people[2]))
    np.testing.assert_allclose(CLEAN.image(people, GRID, rng()), expected, rtol=1e-12)
    assert not CLEAN.image(np.empty((0, 2)), GRID, rng()).any()
    assert not CLEAN.image([(math.nan, math.nan)], GRID, rng()).any()


def test_a_wide_target_turns():
    model = CLEAN.replace(width_x_m=2.0, width_y_m=0.6, rotation_rad=0.5)
    found = model.image([(0.0, 0.0)], GRID, rng())
    turn = np.array([[math.cos(0.5), -math.sin(0.5)], [math.sin(0.5), math.cos(0.5)]])
    precision = turn @ np.diag([1.0, 1 / 0.3**2]) @ turn.T
    expected = 20 * np.exp(-0.5 * np.einsum("vi,ij,vj->v", GRID.centres, precision, GRID.centres))
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("kind", "share"),
    [("gaussian", math.exp(-2)), ("exponential", math.exp(-2)), ("power-law", 1 / math.sqrt(1 + 2**4))],
)
def test_attenuation_at_two_half_widths(kind, share):
    voxel = VoxelGrid(x0=0.75, x1=1.25, y0=-0.25, y1=0.25)
    found = CLEAN.replace(attenuation=kind).image([(0.0, 0.0)], voxel, rng())
    assert found == pytest.approx([20 * share])


def test_attenuation_models():
    x = np.array([0.0, 0.5, 3.0])
    np.testing.assert_allclose(exponential_attenuation(x, 2.0), np.exp(-2 * x))
    np.testing.assert_allclose(power_law_attenuation(x, 2.0, 3.0), (1 + 8 * x**3) ** -0.5)
    np.testing.assert_allclose(gaussian_attenuation(x, 2.0, 0.5), np.exp(-((x - 0.5) ** 2) / 8))
    for bad in (lambda: exponential_attenuation(x, 0), lambda: power_law_attenuation(x, 1, -1)):
        with pytest.raises(ParameterError, match="must be above zero and finite"):
            bad()
    with pytest.raises(ParameterError, match="sd_m: must be above zero"):
        gaussian_attenuation(x, math.nan)


def test_noise_of_voxels_and_links():
    grid = VoxelGrid(x0=0, x1=100, y0=0, y1=100)
    noise = Radiation(voxel_noise_db=0.25).image([], grid, rng())
    assert noise.std() == pytest.approx(0.25, rel=4 / math.sqrt(2 * 40_000))
    W = sparse.csr_array((40_000, 3))
    changes = Radiation(link_noise_db=0.7).links(np.zeros(3), W, rng())
    assert changes.min() > 0
    assert changes.mean() == pytest.approx(0.7, rel=4 / 200)
    assert changes.std() == pytest.approx(0.7, rel=4 * math.sqrt(2 / 40_000))


@pytest.mark.parametrize("channels", [1, 4])
def test_rayleigh_fading_is_that_of_an_amplitude(channels):
    """20 log10 of a Rayleigh amplitude has deviation 10 / ln 10 pi / sqrt 6 = 5.57 dB."""
    W = sparse.csr_array((40_000, 3))
    changes = Radiation(fading="rayleigh", channels=channels).links(np.zeros(3), W, rng())
    sd = 10 / math.log(10) * math.pi / math.sqrt(6) / math.sqrt(channels)
    assert changes.mean() == pytest.approx(0.0, abs=4 * sd / 200)
    assert changes.std() == pytest.approx(sd, rel=0.03)


def test_links_sum_their_voxels():
    W = rng().random((7, 96))
    image = rng().random(96)
    np.testing.assert_allclose(CLEAN.links(image, W, rng()), W @ image)
    np.testing.assert_allclose(CLEAN.links(image, sparse.csr_array(W), rng()), W @ image)
    with pytest.raises(DataError, match=r"image: has shape \(5,\), the weights 96 voxels"):
        CLEAN.links(np.zeros(5), W, rng())


@pytest.mark.parametrize("bad", [[(1.0, math.nan)], [(1.0, math.inf)], [(1.0, 2.0, 3.0)], [1.0, 2.0]])
def test_bad_positions_are_refused(bad):
    with pytest.raises(DataError, match="positions: must be"):
        CLEAN.image(bad, GRID, rng())


def test_link_budget_is_friiss():
    budget = LinkBudget(
        transmitted_dbm=4,
        transmitter_gain_db=2,
        receiver_gain_db=3,
        transmitter_loss_db=0.5,
        receiver_loss_db=0.25,
        other_loss_db=1,
        frequency_hz=299_792_458.0,
    )
    assert budget.wavelength_m == 1.0
    # Friis: P_RX / P_TX = G G (lambda / 4 pi R)^2
    friis = 10 * math.log10(10**0.4 * 10**0.2 * 10**0.3 * (1 / (4 * math.pi * 20)) ** 2) - 1.75
    assert budget.received_dbm(20.0) == pytest.approx(friis)
    # the known figure of 2.4 GHz at a kilometre
    assert LinkBudget(frequency_hz=2.4e9).free_space_loss_db(1000.0) == pytest.approx(100.05, abs=0.01)
    assert budget.received_dbm([10.0, 20.0])[0] - budget.received_dbm(20.0) == pytest.approx(20 * math.log10(2))
    with pytest.raises(DataError, match="distance: must be above zero and finite"):
        budget.received_dbm([1.0, 0.0])
