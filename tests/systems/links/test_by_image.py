"""What the image tracker makes of multipath fading."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.geometry.areas import Area
from elusive.preprocess.link_calibration import Calibration
from elusive.sensors.radio_network import radio_nodes
from elusive.systems.links.by_image import FADED_DB, ImageMethod, channel_deviation
from tests.reference import tomography as reference

AREA = Area.rectangle(-3, 3, -3, 3)
NODES = radio_nodes(reference.border_nodes(8, 3.0))
RAYLEIGH_DB = 5.57  # deviation of the level of a Rayleigh amplitude: 10 / ln 10 * pi / sqrt(6)


def levels(fading: bool, channels: int = 8) -> np.ndarray:
    rng = np.random.default_rng(0)
    amplitude = np.abs(rng.normal(size=(2000, channels, 2)) @ (1, 1j)) if fading else np.ones((2000, channels))
    return rng.uniform(-80, -40, (2000, 1)) + 20 * np.log10(amplitude)


def test_deviation_between_channels():
    # its standard error is .6 %: 14 000 degrees of freedom, a kurtosis of 5.4
    assert channel_deviation(levels(True)) == pytest.approx(RAYLEIGH_DB, rel=0.03)
    assert channel_deviation(levels(False)) == pytest.approx(0.0, abs=1e-9)
    assert channel_deviation(levels(True, channels=1)) == 0.0
    some = np.array([[-50.0, -53.0, np.nan], [np.nan, -70.0, np.nan], [np.nan] * 3, [-60.0, -62.0, -64.0]])
    assert channel_deviation(some) == pytest.approx(np.sqrt((2 * 1.5**2 + 2 * 2.0**2) / 3))


def image_of(method: ImageMethod, *empty_dbm: np.ndarray) -> np.ndarray:
    known = [Calibration(0.0, levels_dbm, np.ones_like(levels_dbm), ()) for levels_dbm in empty_dbm]
    chain = method.bind(NODES, AREA, *known)
    return chain.projector.image(np.random.default_rng(0).normal(size=28))


def test_fading_is_noise_of_the_links():
    fading, quiet = levels(True), levels(False)
    deviation = channel_deviation(fading)
    assert deviation > FADED_DB
    told = image_of(ImageMethod(fading_db=deviation))
    np.testing.assert_array_equal(image_of(ImageMethod(), fading), told)
    prior = ImageMethod().image.prior.replace(noise_sd_db=np.hypot(1.0, deviation))
    image = ImageMethod().image.replace(prior=prior)
    np.testing.assert_allclose(image_of(ImageMethod(image=image)), told, rtol=1e-6)
    np.testing.assert_array_equal(image_of(ImageMethod(), quiet), image_of(ImageMethod()))
    np.testing.assert_array_equal(image_of(ImageMethod(fading_db=0.0), fading), image_of(ImageMethod()))
    assert not np.allclose(told, image_of(ImageMethod()), rtol=0.1)


@pytest.mark.parametrize(("fading_db", "heads"), [(0.9 * FADED_DB, 2), (1.1 * FADED_DB, 1)])
def test_where_links_fade_fainter_heads_are_left_out(fading_db, heads):
    """Two people, one half as bright: the fainter one may be a fluctuation of the other's links."""
    chain = ImageMethod(fading_db=fading_db).bind(NODES, AREA)
    rng = np.random.default_rng(0)
    state = chain.init(rng.normal(0, 0.05, (20, 28)), rng)
    weights = ImageMethod().weights.sparse(NODES, chain.grid)
    seen = sum(
        height * np.exp(-2 * ((chain.grid.centres - place) ** 2).sum(axis=1))
        for place, height in (((-1.75, -1.75), 20.0), ((1.75, 1.75), 12.0))
    )
    state = chain.step(state, 0.0, weights @ seen, rng)
    assert len(state.heads.positions) == heads


def test_where_links_fade_places_are_trusted_less():
    rng, deviations = np.random.default_rng(0), []
    for fading_db in (0.0, 5.0):
        chain = ImageMethod(fading_db=fading_db).bind(NODES, AREA)
        weights = ImageMethod().weights.sparse(NODES, chain.grid)
        seen = 20 * np.exp(-2 * (chain.grid.centres**2).sum(axis=1))
        state = chain.step(chain.init(rng.normal(0, 0.05, (20, 28)), rng), 0.0, weights @ seen, rng)
        deviations.append(np.sqrt(np.diag(state.tracks[0].covariance)[[0, 2]]))
    np.testing.assert_allclose(deviations, [(0.3, 0.3), (1.0, 1.0)])


def test_rounding_alone_is_nobody():
    """Readings in whole dB that hardly ever vary in the empty room: a further step of a link is no person."""
    rng, empty = np.random.default_rng(0), np.zeros((20, 28))
    empty[3, 5] = 1.0
    chain = ImageMethod(fading_db=0.0).bind(NODES, AREA)
    state = chain.init(empty, rng)
    for link in range(28):
        assert not len(chain.step(state, 0.0, np.eye(28)[link], rng).heads.positions)
    weights = ImageMethod().weights.sparse(NODES, chain.grid)
    somebody = weights @ (10.0 * np.exp(-2 * (chain.grid.centres**2).sum(axis=1)))
    assert len(chain.step(state, 0.0, somebody, rng).heads.positions) == 1
