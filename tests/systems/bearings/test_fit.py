"""What `elusive fit bearings` finds of simulated flights, and of a drone whose noise is not told."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from elusive.errors import DataError
from elusive.io.bearings import open_bearings
from elusive.io.sensor_files import read_sensors
from elusive.io.truth import read_truth
from elusive.motion import ConstantVelocity
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearings import BearingSensors
from elusive.systems.bearings.fit import fit_bearings
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.track import track
from tests.bearing_flight import write_flight
from tests.cli.test_bearings import run
from tests.recordings import DATA

PLACES = ((0.0, 0.0, 0.0), (70.0, 12.0, 0.0), (-60.0, 81.0, 0.0))
SITES = SensorSites(("a", "b", "c"), np.array(PLACES))
SIGMA_DEG, Q = 0.8, 0.5


def flown(seed, times=150):
    rng, state = np.random.default_rng(seed), np.array([[20.0, 3.0, 30.0, 2.0]])
    path = [state[0]]
    for _ in range(times - 1):
        state = ConstantVelocity(q=Q).propagate(state, 0.5, rng)
        path.append(state[0])
    sensors = BearingSensors(positions_m=PLACES, sigma_deg=SIGMA_DEG)
    return sensors.simulate(np.array(path), 0.5 * np.arange(times), rng)


def test_deviation_and_manoeuvres_are_found():
    found = fit_bearings(flown(0), SITES)
    sigma, q, *_ = found.values
    assert float(sigma.value) == pytest.approx(SIGMA_DEG, abs=max(4 * sigma.deviation, 0.15 * SIGMA_DEG))
    assert np.log(float(q.value) / Q) == pytest.approx(0, abs=4 * q.deviation / float(q.value))
    assert yaml.safe_load(found.to_yaml()) == found.tree


def test_the_command_writes_what_track_takes(tmp_path, capsys):
    flight = write_flight(tmp_path / "flight")
    given = (flight / "bearings.csv", "--sensors", flight / "sensors.csv")
    code, said = run(capsys, *given, "--out", tmp_path / "fitted.yaml", command=("fit", "bearings"))
    assert code == 0, said
    assert "--sigma-deg" in said
    code, said = run(capsys, *given, "--config", tmp_path / "fitted.yaml", "--out", tmp_path / "out", "--strict")
    assert code == 0, said


def test_one_sensor_tells_no_deviation():
    alone = [times._replace(sensor=times.sensor[:1], azimuth_rad=times.azimuth_rad[:1],
                            elevation_rad=times.elevation_rad[:1]) for times in flown(0, 20)]  # fmt: skip
    with pytest.raises(DataError, match="all bearings are of one sensor"):
        fit_bearings(alone, SITES)


@pytest.mark.thorough
def test_a_drone_whose_noise_is_not_told():
    """Its cameras' errors persist: ellipsoids hold 85 to 98 % all the same, fitted and by default."""
    folder = DATA / "bearings" / "drone3"
    if not folder.is_dir():
        pytest.skip(f"{folder}: no such recording")
    source = open_bearings(folder / "bearings.csv", read_sensors(folder / "sensors.csv"))
    heard = list(source)
    true = read_truth(folder / "truth.csv", "m").aligned(np.array([times.time_s for times in heard]))[:, 0]
    for parameters in (BearingTracking(**fit_bearings(heard, source.sites).tree), BearingTracking()):
        steps = list(track(heard, parameters, source.sites))
        off = np.array([step.tracks[0].mean[[0, 2, 4]] for step in steps]) - true
        spread = np.array([step.tracks[0].covariance[np.ix_([0, 2, 4], [0, 2, 4])] for step in steps])
        known = np.isfinite(off).all(axis=1)
        squared = np.einsum("ki,kij,kj->k", off[known], np.linalg.inv(spread[known]), off[known])
        assert 0.85 <= np.mean(squared < 7.815) <= 0.98
