"""Voxels and link weights: against NumPy and the counts of the thesis's network."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import DataError, ParameterError
from elusive.geometry.areas import Area
from elusive.preprocess.link_weights import EllipseWeights, coverage
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.radio_network import RadioNodes, radio_nodes
from tests.reference import tomography as reference

NODES = radio_nodes(reference.border_nodes())
GRID = VoxelGrid(x0=-12, x1=12, y0=-12, y1=12)


def test_counts_of_the_thesiss_network():
    W = EllipseWeights().sparse(NODES, GRID).toarray()
    assert W.shape == (820, 2304)
    assert np.count_nonzero(W) / 820 == pytest.approx(156.8, abs=0.05)
    held = coverage(W)
    assert (held.min(), np.median(held), held.max()) == (0, 57, 72)
    off_line = EllipseWeights(on_line=2.0).sparse(NODES, GRID).toarray()
    assert np.count_nonzero(off_line != W) == 26_016
    assert (W[W > 0].min(), off_line.max()) == (pytest.approx(0.5608, abs=1e-4), pytest.approx(2.1457, abs=1e-4))
    assert W.max() == pytest.approx(2.4477, abs=1e-4)  # beside its nodes, on the line
    equality = EllipseWeights(line_of_sight="equality").sparse(NODES, GRID).toarray()
    assert np.count_nonzero(equality != off_line) == 250


@pytest.mark.parametrize("weighting", ["distance", "binary", "inverse-root"])
@pytest.mark.parametrize("line_of_sight", ["band", "equality"])
def test_weights_equal_numpys(weighting, line_of_sight):
    rng = np.random.default_rng(1)
    nodes = radio_nodes(np.vstack([rng.uniform(-3, 9, (9, 2)), [[1.25, 1.25], [1.25, 4.75], [4.25, 4.25]]]))
    grid = VoxelGrid(x0=0, x1=6, y0=1, y1=5.5)
    band = 0.25 if line_of_sight == "band" else None
    expected = reference.ellipse_weights(nodes.positions_m, grid.centres, 0.4, 1.5, 3.0, band, weighting)
    model = EllipseWeights(weighting=weighting, excess_m=0.4, off_line=1.5, on_line=3.0, line_of_sight=line_of_sight)
    np.testing.assert_allclose(model.sparse(nodes, grid).toarray(), expected, rtol=1e-13)
    np.testing.assert_array_equal(coverage(model.sparse(nodes, grid)), np.count_nonzero(expected, axis=0))


def test_voxels_in_order():
    grid = VoxelGrid(x0=-1, x1=2.2, y0=0, y1=1, voxel_m=0.5)
    assert grid.shape == (2, 7)
    np.testing.assert_allclose(grid.centres[[0, 6, 7]], [(-0.75, 0.25), (2.25, 0.25), (-0.75, 0.75)])
    assert VoxelGrid(x0=0, x1=0.3, y0=0, y1=0.7, voxel_m=0.1).shape == (7, 3)  # 0.3 / 0.1 is less than 3, or more
    np.testing.assert_allclose(GRID.centres, reference.voxel_centres(-12, 12, -12, 12, 0.5))


def test_an_area_of_any_shape_masks_voxels():
    corner = Area(corners_m=((0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)))
    grid = VoxelGrid.over(corner)
    assert grid.shape == (8, 8)
    np.testing.assert_array_equal(grid.inside, ~(grid.centres > 2).all(axis=1))
    nodes = radio_nodes(np.array([(0, 0), (4, 4), (0, 4), (4, 0)]))
    whole = EllipseWeights().sparse(nodes, VoxelGrid(x0=0, x1=4, y0=0, y1=4)).toarray()
    np.testing.assert_array_equal(EllipseWeights().sparse(nodes, grid).toarray(), np.where(grid.inside, whole, 0.0))


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"x1": -12}, "there is no area; give the lower bound first"),
        ({"voxel_m": 0.01}, "makes 5760000 voxels, more than 1000000; give larger ones"),
        ({"voxel_m": -1}, "VoxelGrid.voxel_m: must be greater than 0"),
        ({"area": Area.rectangle(13, 14, 13, 14)}, "holds no voxel's centre"),
    ],
)
def test_bad_grids_are_refused(given, sentence):
    with pytest.raises(ParameterError, match=sentence):
        VoxelGrid(**({"x0": -12, "x1": 12, "y0": -12, "y1": 12} | given))


def test_bad_networks_are_refused():
    with pytest.raises(DataError, match="stand in one place"):
        EllipseWeights().sparse(RadioNodes(("a", "b"), np.zeros((2, 2))), GRID).toarray()
    with pytest.raises(DataError, match="no link passes any voxel"):
        EllipseWeights().sparse(radio_nodes(np.array([(100.0, 0.0), (100.0, 5.0)])), GRID).toarray()
    with pytest.raises(ParameterError, match=r"EllipseWeights.excess_m: must be greater than 0"):
        EllipseWeights(excess_m=0)
