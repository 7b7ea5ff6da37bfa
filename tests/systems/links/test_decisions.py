"""Binary sensors end to end: one bit a link, fused, heads one by one, tracks."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.metrics import clear_mot, sightings, sightings_of
from elusive.systems.links.decisions import DecisionMethod
from elusive.systems.links.simulate import LinkSimulation
from elusive.systems.links.track import LinkTracking, track

SIMULATION = LinkSimulation()
CHAIN = DecisionMethod(decisions={"bit_error_rate": 0.001}).bind(SIMULATION.bind().nodes, SIMULATION.walks.area)


def crossing() -> np.ndarray:
    """Two people who walk through the middle of the area, 6 m apart where they are nearest."""
    way = np.linspace(-10, 10, 30)
    return np.stack([np.column_stack([way, np.full(30, 3.0)]), np.column_stack([-way, np.full(30, -3.0)])], axis=1)


def changes(places: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    network, radiation = SIMULATION.bind(), SIMULATION.radiation
    return np.array([radiation.links(radiation.image(p, network.grid, rng), network.weights, rng) for p in places])


def test_two_people_are_tracked_by_one_bit_a_link() -> None:
    rng = np.random.default_rng(0)
    state = CHAIN.init(changes(np.full((20, 1, 2), np.nan), rng), rng)
    assert state.threshold.level >= 2 * math.log(2304)
    truth, rows = crossing(), []
    for frame, change in enumerate(changes(truth, rng)):
        state = CHAIN.step(state, frame, change, rng)
        rows += [(frame, one.track, *one.mean[[0, 2]]) for one in state.tracks if one.status == "confirmed"]
    table = np.array(rows)
    found = clear_mot(sightings_of(truth), sightings(table[:, 0], table[:, 1], table[:, 2:]), 2.0, 30)
    assert found.misses[5:].sum() <= 2
    assert found.false_positives.sum() <= 2
    assert found.mismatches.sum() <= 1
    assert found.motp < 1.0


def test_an_empty_area_and_silent_links_show_nobody() -> None:
    rng = np.random.default_rng(1)
    empty = changes(np.full((40, 1, 2), np.nan), rng)
    state = CHAIN.init(empty[:20], rng)
    for time_s, change in enumerate(empty[20:]):
        state = CHAIN.step(state, time_s, change, rng)
        assert state.tracks == ()
    state = CHAIN.step(state, 20, np.full(820, np.nan), rng)
    assert state.tracks == ()
    assert not state.image.any()


def test_a_log_is_tracked_by_one_decision_a_link() -> None:
    """Two people in a log of levels: each link tests its own change, and the rest is as for decisions themselves."""
    simulation = SIMULATION.replace(
        calibration_steps=20, radiation=SIMULATION.radiation.replace(amplitude_db=3.0, voxel_noise_db=0.05)
    )
    truth = crossing()
    parameters = LinkTracking(
        method={"kind": "binary", "decisions": {"signal_db": 3.0}}, area=simulation.walks.area, change={"empty_s": None}
    )
    nodes = simulation.bind().nodes
    results = list(track(simulation.frames(simulation.images(truth)), nodes, parameters))
    assert len(results) == 50
    places = [(k, one.track, *one.mean[[0, 2]]) for k, r in enumerate(results[20:]) for one in r.tracks
              if one.status == "confirmed"]  # fmt: skip
    table = np.array(places)
    found = clear_mot(sightings_of(truth), sightings(table[:, 0], table[:, 1], table[:, 2:]), 2.0, 30)
    assert found.mota > 0.8
    assert found.motp < 1.0
    assert (
        "Method",
        "one decision a link, ratios of 0.5 m voxels, tracker 'hungarian', kalman",
    ) in parameters.described(nodes)


def test_what_does_not_fit_is_refused() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(DataError, match="calibration: has no frame"):
        CHAIN.init(np.empty((0, 820)), rng)
    with pytest.raises(DataError, match="links"):
        CHAIN.step(CHAIN.init(rng.normal(size=(5, 820)), rng), 0.0, np.zeros(7), rng)
