"""Images from links: against the thesis's formulas in NumPy, at full size and with links missing."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from scipy import sparse

from elusive.errors import DataError, ParameterError
from elusive.geometry.areas import Area
from elusive.preprocess import tomography
from elusive.preprocess.image_priors import ExponentialCovariance, Tikhonov
from elusive.preprocess.link_weights import EllipseWeights
from elusive.preprocess.tomography import RegularisedImage
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.radio_network import links_of, radio_nodes
from tests.longer import longer
from tests.reference import tomography as reference

GRID = VoxelGrid(x0=-12, x1=12, y0=-12, y1=12)
SMALL = VoxelGrid(x0=0, x1=5.5, y0=0, y1=4)
ODD = VoxelGrid(x0=0, x1=3.5, y0=0, y1=2.5)
PLAIN = RegularisedImage(equalised="none", precision="double")


@functools.cache
def thesis():
    """Weights of the thesis's 41 nodes."""
    return EllipseWeights().sparse(radio_nodes(reference.border_nodes()), GRID).toarray()


@functools.cache
def thesis_projector(**fields):
    return RegularisedImage(**fields).projection(thesis(), GRID)


def small(grid=SMALL, nodes=9):
    places = np.random.default_rng(nodes).uniform((-0.5, -0.5), (grid.x1 + 0.5, grid.y1 + 0.5), (nodes, 2))
    return EllipseWeights(excess_m=0.5).sparse(radio_nodes(places), grid).toarray()


def whole(lower):
    """Symmetric matrix of its lower triangle."""
    return lower + np.tril(lower, -1).T


def person(position, amplitude, sd, grid=GRID):
    return amplitude * np.exp(-0.5 * ((grid.centres - position) ** 2).sum(axis=1) / sd**2)


@pytest.fixture
def factored(monkeypatch):
    """Every network is a large one."""
    monkeypatch.setattr(tomography, "STORED_MOST", 0)


@pytest.mark.thorough
def test_projection_is_that_of_eq_316_at_full_size():
    C = reference.covariance(GRID.centres, 0.25, 3.0)
    expected = reference.projection(thesis(), np.linalg.inv(C))
    for system in ("links", "voxels"):
        found = thesis_projector(equalised="none", precision="double", system=system).matrix
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("grid", [SMALL, ODD, VoxelGrid(x0=0, x1=4, y0=0, y1=0.5)])
def test_the_priors_terms_equal_numpys(grid):
    prior = ExponentialCovariance(noise_sd_db=1.7, voxel_sd_db=0.4, correlation_m=2.0)
    C = reference.covariance(grid.centres, 0.4, 2.0)
    np.testing.assert_allclose(prior.roughness(grid), np.tril(1.7**2 * np.linalg.inv(C)), atol=1e-9)
    images = np.random.default_rng(0).normal(size=(7, len(C)))
    np.testing.assert_allclose(prior.spread(images, grid), images @ C / 1.7**2, atol=1e-13)
    rows, columns = grid.shape
    slopes = whole(Tikhonov(weight=3.0).roughness(grid))
    image = images[0].reshape(rows, columns)
    energy = (np.diff(image, axis=0) ** 2).sum() + (np.diff(image, axis=1) ** 2).sum()
    assert images[0] @ slopes @ images[0] == pytest.approx(3.0 * energy)
    np.testing.assert_array_equal(Tikhonov(weight=3.0, of="amplitude").roughness(grid), 3.0 * np.eye(rows * columns))


def test_spreading_in_parts_is_the_same(monkeypatch):
    images = np.random.default_rng(0).normal(size=(7, 88))
    whole = ExponentialCovariance().spread(images, SMALL)
    monkeypatch.setattr("elusive.preprocess.image_priors.TRANSFORMED", 1000)
    np.testing.assert_array_equal(ExponentialCovariance().spread(images, SMALL), whole)


@pytest.mark.parametrize(
    ("prior", "system"),
    [
        (Tikhonov(weight=2.0), "voxels"),
        (Tikhonov(weight=2.0), "smaller"),
        (Tikhonov(weight=2.0, of="amplitude"), "links"),
        (Tikhonov(weight=2.0, of="amplitude"), "voxels"),
        (ExponentialCovariance(noise_sd_db=3.0), "links"),
        (ExponentialCovariance(noise_sd_db=3.0), "voxels"),
    ],
)
def test_each_prior_in_each_system(prior, system):
    W = small()
    found = PLAIN.replace(prior=prior, system=system).projection(W, SMALL)
    np.testing.assert_allclose(found.matrix, reference.projection(W, whole(prior.roughness(SMALL))), atol=1e-11)
    from_sparse = PLAIN.replace(prior=prior, system=system).projection(sparse.csr_array(W), SMALL)
    np.testing.assert_array_equal(from_sparse.matrix, found.matrix)


@pytest.mark.parametrize(("sd", "peak"), [(0.35, 5.1), (0.5, 8.4), (1.0, 16.8)])
def test_peak_of_a_person_of_20_db(sd, peak):
    """The peak shrinks with the person; the correction makes it alike everywhere."""
    rng = np.random.default_rng(0)
    seen = np.array([person(place, 20.0, sd) for place in rng.uniform(-12, 12, (300, 2))]) @ thesis().T
    plain = thesis_projector(equalised="none").images(seen).max(axis=1)
    # standard error of a median of 300, whose deviation is a quarter
    assert np.median(plain) == pytest.approx(peak, rel=0.05)
    even = thesis_projector(equalised="person").images(seen).max(axis=1)
    if sd == 0.5:
        assert np.std(plain) / plain.mean() > 0.12
        assert np.std(even) / even.mean() < 0.05
        assert even.mean() == pytest.approx(20.0, rel=0.05)


@pytest.mark.thorough
def test_noise_is_as_bright_anywhere():
    """Of noise on every link, each voxel has the same deviation; a person is as bright as otherwise in the middle."""
    noise = np.random.default_rng(0).normal(size=(4000, 820))
    by_noise, by_person = thesis_projector(), thesis_projector(equalised="person")
    seen = (by_noise.coverage > 0) & (by_noise.gain > by_noise.gain.min())
    # smoothed over a person's width, not over single voxels; a deviation of 4000 is known to 1.1 %
    even, uneven = (
        (spread / np.median(spread))[seen] for spread in (p.images(noise).std(axis=0) for p in (by_noise, by_person))
    )
    assert np.std(even) < 0.08
    assert np.std(even) < 0.7 * np.std(uneven)
    assert np.median(by_noise.gain[seen] / by_person.gain[seen]) == pytest.approx(1.0, abs=0.1)


def test_response_to_noise_is_that_of_the_formula(factored):
    W = small(nodes=12)
    expected = np.sqrt((reference.projection(W, whole(PLAIN.prior.roughness(SMALL))) ** 2).sum(axis=1))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tomography, "STORED_MOST", 10**9)
        np.testing.assert_allclose(PLAIN.projection(W, SMALL).noise_response(), expected, rtol=1e-9)
    large = PLAIN.projection(W, SMALL).noise_response()
    # 128 frames of noise: standard error 1 / sqrt(256)
    np.testing.assert_allclose(large, expected, rtol=5 / 16)


@pytest.mark.parametrize("prior", [ExponentialCovariance(noise_sd_db=2.0), Tikhonov(weight=3.0, of="amplitude")])
def test_further_noise_of_the_links(prior):
    """The estimate is that of links with a covariance of noise as much larger, in NumPy."""
    W = small(nodes=12)
    first = prior.noise_sd_db**2 if prior.kind == "exponential" else 1.0
    covariance = first * np.linalg.inv(whole(prior.roughness(SMALL)))  # of the voxels
    expected = covariance @ W.T @ np.linalg.inv(W @ covariance @ W.T + (first + 3.0**2) * np.eye(len(W)))
    found = PLAIN.replace(prior=prior.with_noise(3.0)).projection(W, SMALL)
    np.testing.assert_allclose(found.matrix, expected, atol=1e-11)


def test_many_frames_at_once_and_single_precision():
    changes = np.random.default_rng(0).normal(size=(5, 820))
    double = thesis_projector(equalised="none", precision="double").images(changes)
    single = thesis_projector(equalised="none")
    one_by_one = np.array([single.image(change) for change in changes])
    np.testing.assert_allclose(one_by_one, double, atol=1e-5 * np.abs(double).max())
    np.testing.assert_allclose(single.images(changes), one_by_one, atol=1e-5 * np.abs(double).max())
    assert single.images(changes).dtype == np.float64


@pytest.mark.parametrize("equalised", ["none", "person", "noise"])
@pytest.mark.parametrize("system", ["links", "voxels"])
def test_missing_links_are_left_out(system, equalised):
    """The image equals that of a network without those links."""
    model = RegularisedImage(system=system, precision="double", equalised=equalised)
    W, rng = small(nodes=12), np.random.default_rng(3)
    projector = model.projection(W, SMALL)
    changes = rng.normal(size=(6, len(W)))
    gone = rng.random((3, len(W))) < np.array([[0.05], [0.5], [0.95]])
    changes[:3][gone] = np.nan
    changes[4:][:, gone[1]] = np.nan
    for change, image in zip(changes, projector.images(changes), strict=True):
        kept = np.isfinite(change)
        fewer = model.replace(equalised="none").projection(W[kept], SMALL)
        np.testing.assert_allclose(image * projector.gain, fewer.image(change[kept]), atol=1e-9)
        np.testing.assert_allclose(projector.image(change), image, atol=1e-12)


@pytest.mark.thorough
def test_nodes_fail_one_after_another_until_none_is_left():
    projector, place = thesis_projector(), np.array([2.1, -3.3])
    change = thesis() @ person(place, 20.0, 0.5)
    links, errors = links_of(41), []
    for node in np.random.default_rng(0).permutation(41):
        image = projector.image(change)
        assert np.isfinite(image).all()
        errors.append(np.hypot(*(GRID.centres[image.argmax()] - place)))
        change[(links == node).any(axis=1)] = np.nan
    assert max(errors[:21]) < 0.5  # half of them have failed
    assert not projector.image(np.full(820, np.nan)).any()


@pytest.mark.parametrize("system", longer(["links", "voxels"], "links"))
# noise is estimated from 128 frames: standard error 1 / sqrt(256) of a voxel, before it is smoothed
@pytest.mark.parametrize(("equalised", "most", "all_of"), [("person", 0.03, 0.15), ("noise", 1.645 / 16, 4 / 16)])
def test_a_large_network_sees_the_same(factored, system, equalised, most, all_of):
    """Single precision in the factor, and a gain that is estimated."""
    W, rng = thesis(), np.random.default_rng(0)
    large = RegularisedImage(system=system, equalised=equalised).projection(W, GRID)
    stored = thesis_projector(equalised=equalised)
    seen = (large.coverage > 0) & (stored.gain > stored.gain.min())
    off = np.abs(large.gain / stored.gain - 1)[seen]
    assert np.quantile(off, 0.9) < most
    assert off.max() < all_of
    changes = W @ person((3.0, 1.0), 20.0, 0.5) + rng.normal(0, 2, (3, 820))
    changes[1, rng.random(820) < 0.3] = np.nan
    changes[2] = np.nan
    expected = stored.images(changes) * stored.gain
    np.testing.assert_allclose(large.images(changes) * large.gain, expected, atol=3e-4 * expected.max())


def test_a_grid_with_an_area_shows_nothing_out_of_it(factored):
    grid = VoxelGrid(x0=0, x1=5.5, y0=0, y1=4, area=Area(corners_m=((0, 0), (5.5, 0), (0, 4))))
    nodes = radio_nodes(np.random.default_rng(0).uniform(0, 4, (12, 2)))
    W = EllipseWeights(excess_m=0.5).sparse(nodes, grid).toarray()
    inside = grid.inside
    C = reference.covariance(grid.centres[inside], 0.25, 3.0)
    expected = reference.projection(W[:, inside], np.linalg.inv(C))
    change = np.random.default_rng(1).normal(size=len(W))
    for most in (0, 10**9):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(tomography, "STORED_MOST", most)
            image = PLAIN.projection(W, grid).image(change)
        assert not image[~inside].any()
        np.testing.assert_allclose(image[inside], expected @ change, atol=1e-5)


def test_bad_weights_are_refused():
    W = small()
    with pytest.raises(DataError, match=r"weights: have shape \(36, 88\), the grid 2304 voxels"):
        PLAIN.projection(W, GRID)
    with pytest.raises(DataError, match="hold NaN or infinity"):
        PLAIN.projection(W * np.nan, SMALL)
    with pytest.raises(DataError, match="are all zero"):
        PLAIN.projection(0 * W, SMALL)
    with pytest.raises(ParameterError, match="'links' needs a term that has an inverse"):
        PLAIN.replace(prior=Tikhonov(), system="links").projection(W, SMALL)
    with pytest.raises(ParameterError, match="covariance has no inverse"):
        PLAIN.replace(prior=ExponentialCovariance(correlation_m=1e18), system="voxels").projection(W, SMALL)


def test_too_large_a_system_is_refused(monkeypatch):
    monkeypatch.setattr(tomography, "SYSTEM_MOST", 30)
    with pytest.raises(ParameterError, match="36 links and 88 voxels make a system of 36 unknowns, more than 30"):
        PLAIN.projection(small(), SMALL)


def test_bad_changes_are_refused():
    projector = PLAIN.projection(small(), SMALL)
    with pytest.raises(DataError, match=r"changes: have shape \(1, 35\), the network 36 links"):
        projector.image(np.zeros(35))
    with pytest.raises(DataError, match=r"change: has shape \(2, 36\); give one change a link, 36 of them"):
        projector.image(np.zeros((2, 36)))
    with pytest.raises(DataError, match="hold infinity"):
        projector.image(np.full(36, np.inf))
