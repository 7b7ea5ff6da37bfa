"""Thresholds, clusters and heads: against NumPy, SciPy and people put into an image."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import ndimage
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import pdist

from elusive.errors import DataError
from elusive.preprocess import _blob_kernels
from elusive.preprocess.blobs import Clusters
from elusive.preprocess.link_weights import EllipseWeights
from elusive.preprocess.threshold import Threshold
from elusive.preprocess.tomography import RegularisedImage
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.radio_network import radio_nodes
from tests.reference import tomography as reference

GRID = VoxelGrid(x0=-12, x1=12, y0=-12, y1=12)


def bells(*people, sd=0.7):
    """Image of people ``(x, y, intensity)``."""
    image = np.zeros(len(GRID.centres))
    for x, y, intensity in people:
        image += intensity * np.exp(-0.5 * ((GRID.centres - (x, y)) ** 2).sum(axis=1) / sd**2)
    return image


def same(labels, others):
    return np.array_equal(labels[:, None] == labels, np.asarray(others)[:, None] == others)


@pytest.mark.parametrize("seed", range(20))
def test_clusters_equal_scipys_and_the_definitions(seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, rng.uniform(2, 15), (int(rng.integers(2, 60)), 2))
    width = rng.uniform(0.3, 4)
    labels = Clusters(cluster_width_m=width).label(points)
    assert same(labels, fcluster(linkage(pdist(points), "average"), width, criterion="distance"))
    assert same(labels[:25], Clusters(cluster_width_m=width).label(points)[:25])
    if len(points) < 30:
        assert same(labels, reference.clusters(points, width))


def test_clusters_of_voxels_are_linked_within_the_width_and_apart_beyond():
    """On a lattice many distances are equal, and the clusters not unique: what eq. 3.20 asks of them holds."""
    points = np.random.default_rng(0).permutation(GRID.centres)[:300]
    labels = Clusters(cluster_width_m=1.2).label(points)
    assert set(labels) == set(range(labels.max() + 1))
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    groups = [np.flatnonzero(labels == k) for k in range(labels.max() + 1)]
    between = [apart[np.ix_(a, b)].mean() for k, a in enumerate(groups) for b in groups[:k]]
    assert min(between) > 1.2
    assert max(len(group) for group in groups) > 1


def test_no_voxel_and_one_voxel():
    assert Clusters().label(np.empty((0, 2))).tolist() == []
    assert Clusters().label([(1.0, 2.0)]).tolist() == [0]
    nothing = Clusters().heads(bells(), GRID, 1.0)
    assert nothing.positions.shape == (0, 2)
    assert nothing.intensities.shape == (0,)


def test_heads_are_sorted_and_move_off_their_voxels():
    heads = Clusters().heads(bells((-5.1, 3.3, 10), (4.05, -2.2, 20), (6.6, 8.15, 15)), GRID, 5.0)
    np.testing.assert_allclose(heads.positions, [(4.05, -2.2), (6.6, 8.15), (-5.1, 3.3)], atol=1e-6)
    assert np.all(np.diff(heads.intensities) < 0)
    centroid = Clusters(subvoxel="centroid").heads(bells((4.05, -2.2, 20)), GRID, 5.0)
    np.testing.assert_allclose(centroid.positions, [(4.05, -2.2)], atol=0.03)
    on_voxels = Clusters(subvoxel="none").heads(bells((4.05, -2.2, 20)), GRID, 5.0)
    np.testing.assert_allclose(on_voxels.positions, [(4.25, -2.25)])


def test_of_near_heads_the_brighter_stays():
    image = bells((0.25, 0.25, 20), (1.75, 0.25, 12), (4.25, 0.25, 11), sd=0.3)
    assert len(Clusters(apart_m=1.0).heads(image, GRID, 5.0).positions) == 3
    kept = Clusters(apart_m=2.0).heads(image, GRID, 5.0)
    np.testing.assert_allclose(kept.intensities, [20, 11], atol=0.1)


def test_a_bright_image_is_clustered_at_its_brightest():
    image = 100.0 + bells((2.0, 2.0, 20))
    heads = Clusters(most_voxels=30).heads(image, GRID, 1.0)
    assert len(heads.positions) == 1
    np.testing.assert_allclose(heads.positions[0], (2.0, 2.0), atol=0.3)


def test_a_head_at_the_border_is_found_by_its_width_across():
    heads = Clusters().heads(bells((-11.85, 3.1, 10)), GRID, 1.0)
    np.testing.assert_allclose(heads.positions, [(-11.85, 3.1)], atol=1e-6)
    heads = Clusters().heads(bells((3.1, 11.95, 10)), GRID, 1.0)
    np.testing.assert_allclose(heads.positions, [(3.1, 11.95)], atol=1e-6)
    in_the_corner = Clusters().heads(bells((-11.9, -11.9, 10)), GRID, 1.0)
    np.testing.assert_allclose(in_the_corner.positions, [(-11.75, -11.75)])
    centroid = Clusters(subvoxel="centroid").heads(bells((-11.9, -11.9, 10)), GRID, 1.0)
    np.testing.assert_allclose(centroid.positions, [(-11.75, -11.75)])


def test_sidelobes_are_no_heads():
    image = bells((-5.0, 3.0, 20), (4.0, -2.0, 3.0))
    assert len(Clusters(sidelobe=0.2).heads(image, GRID, 1.0).positions) == 1
    assert len(Clusters(sidelobe=0.1).heads(image, GRID, 1.0).positions) == 2


def test_one_persons_head_lies_within_5_cm():
    """One person of 20 dB, noise of .25 dB in each voxel, at beta = .5: one head, .05 m off on average."""
    rng = np.random.default_rng(0)
    W = EllipseWeights().sparse(radio_nodes(reference.border_nodes()), GRID).toarray()
    projector = RegularisedImage().projection(W, GRID)
    places = rng.uniform(-11, 11, (200, 2))
    errors = {True: [], False: []}
    for place in places:
        seen = bells((*place, 20), sd=0.5) + rng.normal(0, 0.25, len(GRID.centres))
        image = projector.image(W @ seen)
        for undivided in errors:
            heads = Clusters().heads(image, GRID, 0.5 * image.max(), projector.gain if undivided else None)
            assert len(heads.positions) == 1
            errors[undivided].append(math.dist(heads.positions[0], place))
    assert np.mean(errors[True]) < 0.03
    assert np.mean(errors[False]) < 0.06
    assert max(errors[True]) < 0.4


def test_bad_images_are_refused():
    with pytest.raises(DataError, match="must hold 2304 finite values"):
        Clusters().heads(np.zeros(5), GRID, 1.0)
    with pytest.raises(DataError, match="must hold 2304 finite values"):
        Clusters().heads(np.full(2304, np.nan), GRID, 1.0)
    with pytest.raises(DataError, match="threshold: is NaN"):
        Clusters().heads(np.zeros(2304), GRID, math.nan)
    with pytest.raises(DataError, match="positions: must be finite"):
        Clusters().label([[1.0, 2.0, 3.0]])


def test_threshold_follows_the_faintest_person():
    model = Threshold(alpha=0.9, beta=0.5, before=2.0)
    empty = np.array([[0.1, 3.0, -1.0], [1.0, 0.2, -5.0]])
    state = model.init(empty)
    assert state == (4.0, 2.0, pytest.approx(math.nan, nan_ok=True))
    assert model.step(state, [9.0], 0).level == 4.0  # a candidate alone sets nothing
    state = model.step(state, [30.0, 20.0], 2)
    assert state[::2] == (10.0, 20.0)
    state = model.step(state, [10.0, 50.0], 2)
    assert state[::2] == (pytest.approx(9.5), pytest.approx(19.0))  # .9 20 + .1 10
    assert model.step(state, [], 2) == state
    assert model.step(state, [], 0)[:2] == (4.0, 2.0)
    faint = model.step(model.init(empty), [1.0], 1)
    assert faint.level == 4.0
    assert Threshold(least=0).step(faint, [1.0], 1).level == 0.5
    assert Threshold(intensity="mean").init(empty).calibrated == pytest.approx(10.3 / 6)


def test_bad_calibrations_are_refused():
    with pytest.raises(DataError, match="images: must be finite, a row a frame"):
        Threshold().init(np.empty((0, 5)))
    with pytest.raises(DataError, match="images: must be finite, a row a frame"):
        Threshold().init(np.full((2, 5), np.nan))
    with pytest.raises(DataError, match="show no noise at all"):
        Threshold().init(np.zeros((3, 5)))
    with pytest.raises(DataError, match="intensities: one is not finite"):
        Threshold().step(Threshold().init(np.ones((1, 1))), [math.nan], 1)


def test_offsets_within_a_voxel_equal_their_twins():
    rng = np.random.default_rng(5)
    image = ndimage.gaussian_filter(rng.random((12, 15)), 0.8)  # bumps
    highest = ndimage.maximum_filter(image, 3) == image
    heads = [(row, column) for row, column in np.argwhere(highest) if 0 < row < 11 and 0 < column < 14]
    voxels = np.array([row * 15 + column for row, column in heads])
    assert len(heads) > 1
    expected = [reference.centroid(image, row, column, 2, 0.3) for row, column in heads]
    np.testing.assert_allclose(_blob_kernels.centroid_offsets(image, voxels, 2, 0.3), expected, atol=1e-12)
    expected = [reference.gaussian_peak(image, row, column) for row, column in heads]
    np.testing.assert_allclose(_blob_kernels.gaussian_offsets(image, voxels), expected, atol=1e-9)
