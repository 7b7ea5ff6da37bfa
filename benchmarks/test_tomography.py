"""Radio tomography: the thesis's network and a large one, beside the thesis's formulas in NumPy.

Seconds are those of processor time, of all threads summed: what one core takes.
"""

from __future__ import annotations

import time

import numpy as np
import pytest
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import pdist

from elusive.geometry.areas import Area
from elusive.preprocess.blobs import Clusters
from elusive.preprocess.factored_projector import FactoredProjector
from elusive.preprocess.link_weights import EllipseWeights
from elusive.preprocess.tomography import RegularisedImage
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.radio_network import links_of, radio_nodes
from tests.reference import tomography as reference

RNG = np.random.default_rng(0)
GRID = VoxelGrid(x0=-12, x1=12, y0=-12, y1=12)
FRAMES = 200


def network(nodes):
    return radio_nodes(reference.border_nodes(nodes))


def changes(weights, grid, people):
    """Changes of all links in frames with people of 20 dB at random places, and noise."""
    low, high = grid.centres.min(axis=0) + 1, grid.centres.max(axis=0) - 1
    seen = RNG.normal(0, 0.25, (FRAMES, len(grid.centres)))
    for image in seen:
        for place in RNG.uniform(low, high, (people, 2)):
            image += 20 * np.exp(-2 * ((grid.centres - place) ** 2).sum(axis=1))
    return seen @ weights.T if isinstance(weights, np.ndarray) else (weights @ seen.T).T


def frames_a_second(step, frames, rounds=5):
    """Most frames a second of processor time, over rounds."""
    step(frames[0])
    best = 0.0
    for _ in range(rounds):
        start = time.process_time()
        for frame in frames:
            step(frame)
        best = max(best, len(frames) / (time.process_time() - start))
    return best


def numpy_heads(image, centres, threshold, width=2.0):
    """Eqs. 3.18-3.21 as written: what exceeds the threshold, its clusters by SciPy, and each one's brightest voxel."""
    bright = np.flatnonzero(image > threshold)
    if len(bright) < 2:
        return centres[bright]
    labels = fcluster(linkage(pdist(centres[bright]), "average"), width, criterion="distance")
    return np.array([centres[bright[labels == k][image[bright[labels == k]].argmax()]] for k in np.unique(labels)])


@pytest.mark.parametrize("people", [1, 10])
def test_frames_of_the_thesiss_network(benchmark, report, people):
    W = EllipseWeights().sparse(network(41), GRID).toarray()
    projector, clusters = RegularisedImage().projection(W, GRID), Clusters()
    written = RegularisedImage(precision="double", equalised="none").projection(W, GRID).matrix
    frames = changes(W, GRID, people)

    def ours(change):
        return clusters.heads(projector.image(change), GRID, 10.0, projector.gain)

    mine = frames_a_second(ours, frames)
    twin = frames_a_second(lambda change: numpy_heads(written @ change, GRID.centres, 4.0), frames)
    what = f"41 sensors, 2304 voxels, {people} people, changes to heads"
    report(f"{what}: frames/s of a core", mine, 700)
    report(f"{what}: against NumPy and SciPy", mine / twin, 1)
    benchmark(ours, frames[0])


def test_a_file_of_images(benchmark, best_of, report):
    W = EllipseWeights().sparse(network(41), GRID).toarray()
    projector = RegularisedImage().projection(W, GRID)
    frames = changes(W, GRID, 1)
    at_once, one_by_one = best_of(
        lambda: projector.images(frames), lambda: [projector.image(change) for change in frames]
    )
    report(f"{FRAMES} images of 41 sensors at once, against one by one", one_by_one / at_once, 2)
    benchmark(projector.images, frames)


def test_setting_up(benchmark, best_of, report):
    """Links by links and voxels by voxels, against eq. 3.16 as written, with the inverse of the covariance."""
    W = EllipseWeights().sparse(network(41), GRID).toarray()

    def written():
        return reference.projection(W, np.linalg.inv(reference.covariance(GRID.centres, 0.25, 3.0)))

    def ours(system):
        model = RegularisedImage(system=system, equalised="none", precision="double")
        return lambda: model.projection(W, GRID)

    woodbury, primal, twin = best_of(ours("links"), ours("voxels"), written, rounds=3)
    np.testing.assert_allclose(ours("links")().matrix, written(), rtol=0, atol=1e-10)
    report("set-up of 41 sensors, 2304 voxels, links by links: against eq. 3.16 as written", twin / woodbury, 5)
    report("set-up of 41 sensors, 2304 voxels, voxels by voxels: against eq. 3.16 as written", twin / primal, 1)
    benchmark.pedantic(ours("links"), rounds=3)


def test_a_large_network(benchmark, report):
    """200 sensors, 19 900 links, 10 000 voxels: in NumPy the weights alone would fill 1.6 GB."""
    area = Area.rectangle(0, 50, 0, 50)
    nodes = radio_nodes(np.array([area.on_border(0.3 + k)[0] for k in range(200)]))
    grid = VoxelGrid(x0=0, x1=50, y0=0, y1=50)
    small = EllipseWeights().sparse(network(3), GRID)
    FactoredProjector(small, GRID, RegularisedImage().prior, False, True).noise_response()  # compiles

    def set_up():
        W = EllipseWeights().sparse(nodes, grid)
        return W, RegularisedImage().projection(W, grid)

    start, began = time.process_time(), time.perf_counter()
    W, projector = set_up()
    taken, waited = time.process_time() - start, time.perf_counter() - began
    report("200 sensors, 10 000 voxels: set-ups in 10 s of a core", 10 / taken, 1)
    report("200 sensors, 10 000 voxels: set-ups in 10 s of waiting", 10 / waited, 1)
    frames = changes(W, grid, 5)[:20]
    clusters = Clusters()

    def ours(change):
        return clusters.heads(projector.image(change), grid, 10.0, projector.gain)

    report("200 sensors, 10 000 voxels, changes to heads: frames/s of a core", frames_a_second(ours, frames, 2), 10)
    failed = frames[0].copy()
    failed[(links_of(200) == 7).any(axis=1)] = np.nan
    report("200 sensors, 10 000 voxels, one failed: frames/s of a core", frames_a_second(ours, [failed], 2), 1)
    benchmark(ours, frames[0])
