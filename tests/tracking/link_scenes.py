"""Networks and people to test the filters on the links on: simulated, and the recorded log where it is there."""

from __future__ import annotations

import numpy as np

from elusive.sensors.linear_links import LinkRadiation
from elusive.sensors.link_shadowing import LinkShadowing
from elusive.sensors.radio_network import links_of, radio_nodes
from tests import recordings

DATA = recordings.DATA / "rti" / "basement"


def border(nodes, half):
    """Nodes along the border of a square."""
    places = []
    for way in 8 * half * np.arange(nodes) / nodes:
        side, d = divmod(way, 2 * half)
        places.append([(-half + d, -half), (half, -half + d), (half - d, half), (-half, half - d)][int(side)])
    return radio_nodes(np.array(places))


def linear_links(nodes=20, half=6.0, voxel=0.5, model=None):
    """Links whose weight is one where the excess path is below .2 m."""
    network = border(nodes, half)
    axis = np.arange(-half + voxel / 2, half, voxel)
    x, y = np.meshgrid(axis, axis)
    centres = np.column_stack([x.ravel(), y.ravel()])
    first, second = network.positions_m[links_of(nodes)].transpose(1, 0, 2)
    around = sum(np.linalg.norm(end[:, None] - centres, axis=2) for end in (first, second))
    weights = (around - np.linalg.norm(first - second, axis=1)[:, None] < 0.2).astype(float)
    return (LinkRadiation() if model is None else model).links(weights, (-half, half, -half, half), voxel)


def shadowed_links(seed=0, nodes=10, half=4.0, channels=4, model=None):
    """Links of a square room with deep fades and strong ones."""
    rng = np.random.default_rng(seed)
    mean = rng.normal(-70, 8, (nodes * (nodes - 1), channels))
    variance = rng.gamma(1.0, 0.5, mean.shape)
    return (LinkShadowing() if model is None else model).links(border(nodes, half), mean, variance)


def states_of(places):
    """States of people who stand at the places; NaN rows are nobody."""
    there = places[np.isfinite(places[:, 0])]
    return np.column_stack([there[:, 0], np.zeros(len(there)), there[:, 1], np.zeros(len(there))])


def simulated(sensor, paths, rng):
    """Yield a measurement for each frame of the paths ``(T, people, 2)``."""
    return [sensor.simulate(states_of(places), rng) for places in paths]
