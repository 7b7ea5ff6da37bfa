"""A batch of tracks: each is what the filter gives of it alone."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.track_batch import filter_tracks
from elusive.sensors.arrival_times import ArrivalTimeSensors
from elusive.sensors.bearing_sets import BearingSet
from tests.filters.gaussian.bearing_scenes import FLAT, PLACES, PROBLEMS, recorded

TRACKS = 4


def dense(sets, sensors=3):
    """Azimuths and elevations, a row a time."""
    azimuth, elevation = (np.full((len(sets), sensors), np.nan) for _ in range(2))
    for k, each in enumerate(sets):
        azimuth[k, each.sensor], elevation[k, each.sensor] = each.azimuth_rad, each.elevation_rad
    return azimuth, elevation


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("name", ["cv", "ctrv", "height", "bias"])
def test_each_track_is_what_it_is_alone(name, smooth):
    filter = ExtendedKalmanFilter(**PROBLEMS[name])
    rng = np.random.default_rng(0)
    parts = [recorded(PROBLEMS[name], steps=10, seed=seed) for seed in range(TRACKS)]
    times = parts[0][0]
    angles = [dense([s._replace(time_s=t) for s, t in zip(sets, times, strict=True)]) for _, _, sets in parts]
    azimuth, elevation = (np.array(part) for part in zip(*angles, strict=True))
    azimuth[rng.random(azimuth.shape) < 0.2] = np.nan
    # at first one sensor alone: the start takes several times
    azimuth[1, :3, 1:] = np.nan
    found = filter_tracks(filter, times, azimuth, elevation, smooth=smooth)
    for track in range(TRACKS):
        sets = []
        for t, round_, up in zip(times, azimuth[track], elevation[track], strict=True):
            seen = np.flatnonzero(np.isfinite(round_))
            sets.append(BearingSet(float(t), seen, round_[seen], up[seen]))
        alone = filter.track(sets, smooth=smooth)
        assert found.started[track] == alone.started
        deviation = np.sqrt(np.diagonal(alone.covariances, axis1=1, axis2=2))
        # the rest of the turns' noise aside, the sums are the same in another order
        assert (np.abs(found.states[track] - alone.states) < 1e-6 * deviation).all()
        scale = deviation[:, :, None] * deviation[:, None]
        np.testing.assert_allclose(found.covariances[track] / scale, alone.covariances / scale, atol=1e-6)
    assert found.started[1] >= 3


def test_refused():
    filter = ExtendedKalmanFilter(**PROBLEMS["cv"])
    times, azimuth = np.arange(3.0), np.ones((2, 3, 3))
    for changes, sentence in (
        ({"azimuth_rad": azimuth[0]}, r"have shapes \(3, 3\) and"),
        ({"azimuth_rad": azimuth[:, :, :2]}, r"give \(3 times, 3 sensors\) a track"),
        ({"elevation_rad": azimuth[:1]}, "have shapes"),
        ({"times_s": times[::-1]}, "must be finite and increase"),
        ({"azimuth_rad": azimuth * np.inf}, "one is infinite"),
        ({"azimuth_rad": azimuth * np.array([1.0, np.nan])[:, None, None]}, "track 1 has no bearing"),
    ):
        with pytest.raises(DataError, match=sentence):
            filter_tracks(filter, **({"times_s": times, "azimuth_rad": azimuth} | changes))
    arrivals = ExtendedKalmanFilter(motion=filter.motion, sensor=ArrivalTimeSensors(positions_m=PLACES))
    with pytest.raises(DataError, match=r"a batch is of bearings alone, .* and this has ArrivalTimeSensors"):
        filter_tracks(arrivals, times, azimuth)
    assert FLAT.dimensions == 2
