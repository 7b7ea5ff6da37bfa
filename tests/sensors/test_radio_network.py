"""Nodes of a radio network from text, and the numbering of its links."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io.placed_files import read_nodes
from elusive.sensors.radio_network import directed_links_of, links_of, radio_nodes, undirected_of


def saved(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "nodes.csv"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("node,x_m,y_m\na,0,1.5\nb-2,-3e1,4\n", ("a", "b-2")),
        ("y_m;node;x_m\n1.5;a;0\n\n# a remark\n4;b-2;-30\n", ("a", "b-2")),
        ("0 1.5\n-30.0\t4\n", ("0", "1")),
        ("0.0, 1.5\n-30, 4\n", ("0", "1")),
    ],
)
def test_nodes_are_read_in_any_of_the_forms(tmp_path, text, names):
    nodes = read_nodes(saved(tmp_path, text))
    assert nodes.names == names
    np.testing.assert_array_equal(nodes.positions_m, [[0, 1.5], [-30, 4]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("node,x_m,y_m\na,0,1\nb,0.0,1.0\n", "nodes a and b stand in one place"),
        ("node,x_m,y_m\na,0,1\na,0,2\n", "name each once"),
        ("node,x_m,y_m\na,0,1\n", "holds 1 nodes"),
        ("", "holds 0 nodes"),
        ("node,x_m,y_m\na,0,nan\nb,1,1\n", r"line 2, column y_m: 'nan' is no number"),
        ("node,x_m,y_m\na,0,here\nb,1,1\n", r"line 2, column y_m: 'here' is no number"),
        ("node;x_m;y_m\na;0,5,1;1\nb;1;1\n", r"line 2, column x_m: '0,5,1' is no number"),
        ("node,x_m,y_m,z_m\na,0,1,2\nb,1,1,2\n", "name them node,x_m,y_m"),
        ("0 1\n1 2 3\n", r"line 2: has 3 cells, not 2"),
    ],
)
def test_faulty_nodes_are_refused(tmp_path, text, said):
    with pytest.raises(DataError, match=said):
        read_nodes(saved(tmp_path, text))


@pytest.mark.parametrize("positions", [np.zeros((3, 3)), np.zeros(4), [[0.0, 1.0], [np.inf, 2.0]]])
def test_faulty_positions_are_refused(positions):
    with pytest.raises(DataError, match="nodes"):
        radio_nodes(np.asarray(positions, dtype=float))


@pytest.mark.parametrize("size", [2, 3, 7, 41])
def test_links_are_numbered_as_written_down(size):
    pairs = [(i, j) for i in range(size) for j in range(i + 1, size)]
    assert list(map(tuple, links_of(size).tolist())) == pairs
    directed = directed_links_of(size)
    for number, (tx, rx) in enumerate(directed.tolist()):
        assert number == tx * (size - 1) + (rx if rx < tx else rx - 1)
    assert len(directed) == size * (size - 1)
    assert [pairs[k] for k in undirected_of(size)] == [tuple(sorted(pair)) for pair in directed.tolist()]
