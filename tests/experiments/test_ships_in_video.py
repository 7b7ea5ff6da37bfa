"""Ships of several SNR near a coast and off it: where they are put, and what is counted as found."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.errors import ParameterError
from elusive.experiments.ships_in_video.reproduce import ships_in_video, summarise
from elusive.experiments.ships_in_video.trial import PLACES, SCENARIO, WAYS, ShipsInVideo, score, ships_of
from elusive.sensors.radar_video import RadarVideo
from elusive.systems.video.simulate import START_S, VideoSimulation, coastline
from elusive.tracking.track import Track


def test_ships_keep_to_their_distance_from_the_true_shore():
    parameters, simulation = ShipsInVideo(), VideoSimulation(ships=0)
    for seed in range(5):
        rng = np.random.default_rng(seed)
        coast = coastline(simulation.radar, simulation, rng)
        ships = ships_of(parameters, simulation, coast, rng)
        assert ships.shape == (12, 4)
        times = np.linspace(0, 100, 101)
        off = shore_distances(coast.true, ships, times)
        assert (off[:6].min(axis=1) < 31).all()  # measured north, where a shore that slopes is nearer
        assert (off[:6].min(axis=1) > 10).all()
        assert (off[6:].min(axis=1) > 300).all()


def shore_distances(land, ships, times):
    import shapely

    places = ships[:, None, [0, 2]] + times[:, None] * ships[:, None, [1, 3]]
    return shapely.distance(land, shapely.points(places))


def test_a_track_is_a_ships_or_one_too_many():
    ships = np.array([[1000.0, 5.0, 0.0, 0.0], [-2000.0, 0.0, 0.0, 0.0]])

    def track(number, x, y, status="confirmed"):
        return Track(number, status, 1.0, np.array([x, 0.0, y, 0.0]), np.eye(4))

    def steps():
        for turn in range(4):
            first = track(1, 1000 + 12.5 * turn, 30.0)
            yield START_S + 2.5 * turn, (first, track(2, 0, 3000), track(3, -2000, 0, "tentative"))

    found, others = score(steps(), ships, RadarVideo(), 4)
    np.testing.assert_array_equal(found, [1.0, 0.0])
    assert others == 1


def test_a_table_holds_means_over_recordings(tmp_path):
    import xarray as xr

    found = np.zeros((1, 4, len(WAYS), len(PLACES), 6))
    found[0, :2, 1, 0, 3] = 1.0
    others = ("shape", "trial", "way"), np.ones((1, 4, 4))
    both = {"found": (("shape", "trial", *SCENARIO.dims["found"]), found), "others": others}
    results = xr.Dataset(both, coords={"shape": [0.5]})
    rows = summarise(results)
    assert len(rows) == len(WAYS) * len(PLACES) * 6
    (row,) = [row for row in rows if row.found]
    assert (row.way, row.place, row.snr_db) == (WAYS[1], PLACES[0], 8.0)
    assert (row.found, row.found_error, row.others) == (0.5, pytest.approx(math.sqrt(1 / 3) / 2), 1.0)
    with pytest.raises(ParameterError):
        ships_in_video(tmp_path, shapes=(1.0, 1.0))
