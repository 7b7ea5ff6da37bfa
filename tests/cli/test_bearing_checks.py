"""What `elusive track bearings` and `elusive locate` say of wrong inputs, and that they are silent of right ones."""

from __future__ import annotations

import csv
import json
import math

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.metrics.consistency import squared_deviations
from elusive.results import read_tracks_csv
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearings import BearingSensors
from elusive.systems.bearings.checks import track_findings
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.simulate import BearingSimulation
from elusive.systems.bearings.track import track
from tests.cli.test_bearings import run
from tests.filters.gaussian.test_range_bank import SIGMA_DEG as OWN_SIGMA_DEG
from tests.filters.gaussian.test_range_bank import past
from tests.longer import longer
from tests.systems.bearings.crowd import PLACES, crowd

SIGMA_DEG = 2.0
FILTERS = ("map", "iekf", "fixed-lag")
HOW = (*FILTERS, "labelled", "follow")
RIGHT = BearingSimulation()
SITES_M = np.array([(site.x_m, site.y_m) for site in RIGHT.sites])


def flown(seed):
    """The bearings of a flight."""
    flight, sensors = RIGHT.flight(), RIGHT.placed_sensors
    return sensors.simulate(flight.states, flight.times_s, np.random.default_rng([seed, 0]))


def erring(seed, turned_deg=0.0, late=0):
    """The second sensor has another north, or a clock that is so many times late."""
    sets = flown(seed)
    for k in reversed(range(len(sets))):
        second, before = sets[k].sensor == 1, sets[max(k - late, 0)]
        azimuth = sets[k].azimuth_rad + np.deg2rad(turned_deg) * second
        if late and (before.sensor == 1).any():
            azimuth[second] = before.azimuth_rad[before.sensor == 1][0]
        sets[k] = sets[k]._replace(azimuth_rad=azimuth)
    return sets


def imprecise(seed, times=5.0):
    """The second sensor's bearings scatter so many times as far as was told."""
    rng = np.random.default_rng([seed, 8])
    more = np.deg2rad(SIGMA_DEG) * math.sqrt(times**2 - 1)
    return [
        one._replace(azimuth_rad=one.azimuth_rad + (one.sensor == 1) * rng.normal(0, more, len(one.sensor)))
        for one in flown(seed)
    ]


def second(seed):
    """The bearings of another emitter at the same times."""
    flight, sensors = RIGHT.flight(), RIGHT.placed_sensors
    other = flight.states.copy()
    other[:, 0], other[:, 2] = 30 - other[::-1, 0], 60 - other[:, 2]
    return sensors.simulate(other, flight.times_s, np.random.default_rng([seed, 5]))


def two_alternating(seed):
    """Two emitters, each heard at every second time."""
    return [one if k % 2 else two for k, (one, two) in enumerate(zip(flown(seed), second(seed), strict=True))]


def two_at_random(seed):
    """Two emitters, of which each sensor hears one or the other at each time."""
    rng = np.random.default_rng([seed, 7])
    return [
        one._replace(azimuth_rad=np.where(rng.random(len(one.sensor)) < 0.5, one.azimuth_rad, two.azimuth_rad))
        for one, two in zip(flown(seed), second(seed), strict=True)
    ]


def resting(seed, place=(30.0, 35.0), velocity=(0.0, 0.0), sigma_deg=SIGMA_DEG):
    """Bearings of an emitter that stands still, or does not."""
    times = np.arange(12.0)
    states = np.zeros((12, 4))
    states[:, 0], states[:, 2] = place[0] + velocity[0] * times, place[1] + velocity[1] * times
    sensors = BearingSensors(positions_m=[(x, y, 0) for x, y in SITES_M], sigma_deg=sigma_deg)
    return sensors.simulate(states, times, np.random.default_rng([seed, 9]))


def mathematical(sets):
    """Azimuths anticlockwise from east."""
    return [one._replace(azimuth_rad=np.pi / 2 - one.azimuth_rad) for one in sets]


def radians(sets, lowest):
    """The numbers of the file are radians, from 0 or from -pi."""
    return [one._replace(azimuth_rad=np.deg2rad((one.azimuth_rad - lowest) % (2 * np.pi) + lowest)) for one in sets]


def written(folder, sets, places=SITES_M, label=None):
    """Write bearings.csv and sensors.csv; return what the command takes."""
    folder.mkdir(exist_ok=True)
    with (folder / "bearings.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time_s", "sensor", "azimuth_deg", *(["emitter"] if label else [])])
        for one in sets:
            for sensor, azimuth in zip(one.sensor.tolist(), np.rad2deg(one.azimuth_rad).tolist(), strict=True):
                turned = (azimuth + 180) % 360 - 180
                writer.writerow([one.time_s, sensor + 1, f"{turned:.9g}", *([label] if label else [])])
    rows = [f"{number},{x:.9g},{y:.9g}" for number, (x, y) in enumerate(np.array(places)[:, :2], start=1)]
    (folder / "sensors.csv").write_text("\n".join(["sensor,x_m,y_m", *rows]) + "\n")
    return folder / "bearings.csv", "--sensors", folder / "sensors.csv"


def failing(out):
    """The findings that do not hold, by name."""
    return {row["name"]: row for row in json.loads((out / "checks.json").read_text()) if not row["holds"]}


def turning(seed, interval_s=12.0):
    """An emitter of 12 m/s that turns by 1.5 to 2.6 rad at once, again and again."""
    rng, times = np.random.default_rng([seed, 6]), 0.5 * np.arange(120)
    states, heading = np.zeros((120, 4)), 1.0
    states[0, [0, 2]] = -20.0, 20.0
    for k in range(120):
        heading += rng.uniform(1.5, 2.6) if k and times[k] % interval_s == 0 else 0.0
        states[k, 1], states[k, 3] = 12 * math.sin(heading), 12 * math.cos(heading)
        if k:
            states[k, [0, 2]] = states[k - 1, [0, 2]] + 0.5 * states[k - 1, [1, 3]]
    sensors = BearingSensors(positions_m=[(x, y, 0) for x, y in SITES_M], sigma_deg=SIGMA_DEG / 2)
    return sensors.simulate(states, times, np.random.default_rng([seed, 7]))


def stuck(seed):
    """From half of the flight on the second sensor reports what it last heard."""
    sets = flown(seed)
    half = len(sets) // 2
    last = sets[half].azimuth_rad[sets[half].sensor == 1]
    return sets[:half] + [
        one._replace(azimuth_rad=np.where(one.sensor == 1, last, one.azimuth_rad)) for one in sets[half:]
    ]


def whole_seconds(sets):
    """Times without their digits, so that two readings of a sensor stand under one."""
    return [one._replace(time_s=math.floor(one.time_s)) for one in sets]


def mirrored(seed):
    """The second sensor counts its azimuths the other way round."""
    return [
        one._replace(azimuth_rad=np.where(one.sensor == 1, -one.azimuth_rad, one.azimuth_rad)) for one in flown(seed)
    ]


def from_a_bow(sets, mean_deg, swing_deg):
    """The second sensor tells its azimuths from a bow, which swings or does not."""
    return [
        one._replace(
            azimuth_rad=one.azimuth_rad
            - (one.sensor == 1) * np.deg2rad(mean_deg + swing_deg * math.sin(one.time_s / 10.0))
        )
        for one in sets
    ]


WRONG = {
    "one time": (
        lambda seed: [one._replace(time_s=0.0) for one in flown(seed)],
        SITES_M,
        SIGMA_DEG,
        "one and the same time",
    ),
    "from a bow": (
        lambda seed: from_a_bow(flown(seed), 30.0, 0.0),
        SITES_M,
        SIGMA_DEG,
        "of sensor 2",
    ),
    "swinging": (
        lambda seed: from_a_bow(flown(seed), 30.0, 20.0),
        SITES_M,
        SIGMA_DEG,
        "of sensor 2",  # over so short a time its north may as well drift
    ),
    "two emitters": (two_alternating, SITES_M, SIGMA_DEG, "more than one emitter"),
    "mathematical": (lambda seed: mathematical(flown(seed)), SITES_M, SIGMA_DEG, "anticlockwise from east"),
    "radians": (lambda seed: radians(flown(seed), 0.0), SITES_M, SIGMA_DEG, "if the azimuths are read in radians"),
    "radians to pi": (lambda seed: radians(flown(seed), -np.pi), SITES_M, SIGMA_DEG, "read in radians"),
    "swapped": (flown, SITES_M[:, ::-1], SIGMA_DEG, "x and y exchanged"),
    "degrees": (flown, SITES_M / 1.1e5 + (5.1, 53.2), SIGMA_DEG, "longitudes and latitudes"),
    "too sure": (flown, SITES_M, SIGMA_DEG / 10, "they fit with a deviation of"),
    "too sure by four": (flown, SITES_M, SIGMA_DEG / 4, "they fit with a deviation of"),  # two short tracks explain it
    "two at random": (two_at_random, SITES_M, SIGMA_DEG, "more than one emitter"),
    "north": (lambda seed: erring(seed, turned_deg=12.0), SITES_M, SIGMA_DEG, "azimuths of sensor 2 are"),
    "clock": (lambda seed: erring(seed, late=3), SITES_M, SIGMA_DEG, "sensor 2"),
    "imprecise": (imprecise, SITES_M, SIGMA_DEG, "sensor 2 reports lies"),
    "turning": (turning, SITES_M, SIGMA_DEG / 2, "turns harder than the motion allows"),
    "stuck": (stuck, SITES_M, SIGMA_DEG, "Sensor 2 reports exactly what it has just reported"),
    "doubled": (lambda seed: [one for one in flown(seed) for _ in range(2)], SITES_M, SIGMA_DEG, "lines stand twice"),
    "rounded times": (lambda seed: whole_seconds(flown(seed)), SITES_M, SIGMA_DEG, "times are rounded"),
    "mirrored": (mirrored, SITES_M, SIGMA_DEG, "as the others fit without it"),
    "elsewhere": (flown, np.add(SITES_M, [(0, 0), (25, -10), (0, 0)]), SIGMA_DEG, "sensor 2 stands"),
    "exchanged": (flown, SITES_M[[1, 0, 2]], SIGMA_DEG, "are exchanged"),
}


@pytest.mark.parametrize(
    "name",
    longer(
        WRONG,
        "elsewhere",
        "from a bow",
        "too sure by four",
        "two at random",
        "swinging",
        "clock",
        "too sure",
        "imprecise",
        "exchanged",
        "swapped",
        "mathematical",
        "radians",
        "mirrored",
    ),
)
@pytest.mark.parametrize("how", longer(HOW, *HOW[1:]))
def test_a_wrong_input_is_named(tmp_path, capsys, name, how):
    draw, places, sigma_deg, sentence = WRONG[name]
    given = written(tmp_path / "in", draw(3), places, "fox" if how == "labelled" else None)
    told = ("--q", 1) if name in ("turning", "rounded times") else ()  # a power that is found covers them
    more = {"labelled": ("--strict",), "follow": ("--follow", "--idle-s", "0")}.get(how, ("--filter", how, "--strict"))
    code, said = run(capsys, *given, "--sigma-deg", sigma_deg, *told, *more, "--out", tmp_path / "out")
    assert code == (0 if how == "follow" else 3), said
    found = failing(tmp_path / "out")
    if (name, how) == ("doubled", "follow"):  # live a line that comes again is left out, and counted
        assert "repeated" in said
        return
    if (name, how) == ("one time", "follow"):  # nothing came before: they may as well be of many emitters
        assert "Emitters: several" in said
        return
    assert any(row["grave"] for row in found.values())
    if (name, how) == ("clock", "follow"):  # norths are learnt meanwhile, and what is left has another cause
        return
    assert sentence in " ".join(row["sentence"] for row in found.values())
    assert sentence in said
    assert "sure to" not in said
    assert ("bearings.uneven" in found) <= (not name.startswith("too sure"))  # all sensors alike


@pytest.mark.parametrize("seed", longer([20, 22, 24], 22, 24))
def test_a_sensor_that_stands_elsewhere_errs_as_what_wanders(tmp_path, capsys, seed):
    """The same misplacement, taken for norths that are off, left 3 to 7 of 64 rows sure and wrong."""
    places = np.add(SITES_M, [(0, 0), (15, 0), (0, 0)])
    code, said = run(capsys, *written(tmp_path / "in", flown(seed), places), "--out", tmp_path / "out")
    assert code == 0, said
    said = " ".join(row["sentence"] for row in failing(tmp_path / "out").values())
    assert "sensor 2 stands" in said or "errors wander" in said
    rows = read_tracks_csv(tmp_path / "out/tracks.csv").rows
    off = RIGHT.flight().states[: len(rows)][:, [0, 2]] - rows["position"]
    assert (squared_deviations(off, rows["covariance"]) < 18.42).all()  # 99.99 %


@pytest.mark.parametrize("recordings", longer((3, 20), 20))
@pytest.mark.parametrize("how", longer(FILTERS, *FILTERS[1:]))
def test_a_right_input_has_no_finding(how, recordings):
    """Recordings with strays and sharp corners: nothing grave, at most one remark in twenty."""
    places = np.column_stack([SITES_M, np.zeros(3)])
    sites, remarks = SensorSites(("1", "2", "3"), places), 0
    parameters = BearingTracking(sigma_deg=SIGMA_DEG, filter={"kind": how}, emitters={"kind": "one"})
    for seed in range(recordings):
        steps = list(track(flown(seed), parameters, sites, live=how != "map"))
        failed = [one for one in track_findings(steps, parameters, sites) if not one.holds]
        assert not any(one.grave for one in failed), failed
        remarks += len(failed)
    assert remarks <= 1


@pytest.mark.parametrize("how", FILTERS)
def test_measurements_of_one_time_are_to_be_one(how):
    """In Python they may be given as several: they are refused, where a path of as many times has no row for each."""
    sites = SensorSites(("1", "2", "3"), np.column_stack([SITES_M, np.zeros(3)]))
    parameters = BearingTracking(sigma_deg=SIGMA_DEG, filter={"kind": how})
    with pytest.raises(DataError, match="measurement 1, of 0 s, is not later than the one before"):
        list(track([one for one in flown(3) for _ in range(2)], parameters, sites, live=how != "map"))


UNLABELLED = {
    "mathematical": (mathematical, PLACES, 1.0, ("anticlockwise from east", "come again", "ghosts")),
    "degrees": (list, np.array(PLACES)[:, :2] / 1.1e5 + (5.1, 53.2), 1.0, ("longitudes and latitudes",)),
    "too sure": (list, PLACES, 0.1, ("is left with a deviation of",)),
}


@pytest.mark.parametrize("name", longer(UNLABELLED, *UNLABELLED))
def test_a_wrong_input_of_several_emitters_is_named(tmp_path, capsys, name):
    change, places, sigma_deg, sentences = UNLABELLED[name]
    heard = crowd(15, 2, times=40, false=1.0)[1]
    given = written(tmp_path / "in", change(heard), places)
    code, said = run(capsys, *given, "--sigma-deg", sigma_deg, "--emitters", "several", "--out", tmp_path / "out")
    assert code == 0, said
    assert any(row["grave"] for row in failing(tmp_path / "out").values())
    assert any(sentence in said for sentence in sentences), said


@pytest.mark.thorough
def test_right_inputs_of_several_emitters_have_no_finding(tmp_path, capsys):
    remarks = 0
    for seed in range(20):
        given = written(tmp_path / f"in{seed}", crowd(seed, 2 + 3 * (seed % 2), false=1.0)[1], PLACES)
        code, said = run(capsys, *given, "--sigma-deg", 1, "--emitters", "several", "--out", tmp_path / f"out{seed}")
        assert code == 0, said
        remarks += len(failing(tmp_path / f"out{seed}"))
    assert remarks <= 1


def test_of_a_lone_receiver_it_is_said_what_a_wrong_heading_would_do():
    _, places, _, sets = past(1)
    sites = SensorSites(("own",), places.mean(axis=0)[None])
    parameters = BearingTracking(sigma_deg=OWN_SIGMA_DEG)
    paths = {}
    for off_deg in (0.0, OWN_SIGMA_DEG, -OWN_SIGMA_DEG):
        turned = [one._replace(azimuth_rad=one.azimuth_rad + np.deg2rad(off_deg)) for one in sets]
        paths[off_deg] = list(track(turned, parameters, sites))
    (found,) = [one for one in track_findings(paths[0.0], parameters, sites) if one.name == "bearings.receiver"]
    means, (spreads, *_) = (
        [np.array([part(step.tracks[0]) for step in steps]) for steps in paths.values()]
        for part in (lambda of: of.mean[[0, 2]], lambda of: of.covariance[np.ix_([0, 2], [0, 2])])
    )
    squares = [np.einsum("ki,kij,kj->k", way - means[0], np.linalg.inv(spreads), way - means[0]) for way in means[1:]]
    assert found.seen == pytest.approx(max(np.sqrt(np.mean(square) / 2) for square in squares), rel=1e-6)
    assert not found.grave
    assert not found.holds


def of_two_sensors(sets):
    """What the first two sensors hear."""
    kept = [(one, one.sensor < 2) for one in sets]
    return [one._replace(**{name: getattr(one, name)[rows] for name in ("sensor", "azimuth_rad", "elevation_rad")})
            for one, rows in kept]  # fmt: skip


@pytest.mark.parametrize(("emitters", "moving", "seed"), longer([(5, False, 16), (2, True, 13)], (5, False, 16)))
def test_ghosts_of_two_sensors_share_their_existence(tmp_path, capsys, emitters, moving, seed):
    """Emitters that rest cross in any set of pairs; of two that move, the paths tell."""
    speed = {} if moving else {"speed_mps": 1e-3, "q": 1e-4}
    heard = crowd(seed, emitters, false=0.5, times=40, **speed)[1]
    given = written(tmp_path / "in", of_two_sensors(heard), PLACES[:2])
    code, said = run(capsys, *given, "--sigma-deg", 1, "--emitters", "several", "--out", tmp_path / "out")
    assert code == 0, said
    assert ("bearings.pairings" in failing(tmp_path / "out")) != moving
    existence = read_tracks_csv(tmp_path / "out" / "tracks.csv").rows
    last = existence["existence"][existence["step"] == existence["step"].max()]
    assert (last < 0.9).sum() >= 3 if not moving else (last > 0.9).sum() == emitters


def both(seed):
    """Two emitters that rest, each heard at every second time."""
    pairs = zip(resting(seed), resting(seed + 50, (-40.0, 20.0)), strict=True)
    return [one if k % 2 else two for k, (one, two) in enumerate(pairs)]


PLACE = {
    "moves": (lambda seed: resting(seed, velocity=(-4.0, 1.0)), SITES_M, "moves"),
    "two emitters": (both, SITES_M, "two emitters"),
    "mathematical": (lambda seed: mathematical(resting(seed)), SITES_M, "anticlockwise from east"),
    "swapped": (resting, SITES_M[:, ::-1], "x and y exchanged"),
    "degrees": (resting, SITES_M / 1.1e5 + (5.1, 53.2), "longitudes and latitudes"),
    "too sure": (lambda seed: resting(seed, sigma_deg=10 * SIGMA_DEG), SITES_M, "as of a deviation of"),
}


@pytest.mark.parametrize(
    ("name", "told"),
    [
        *((name, True) for name in PLACE),
        *(pytest.param(name, False, marks=pytest.mark.thorough) for name in PLACE if name != "too sure"),
    ],
)
def test_a_wrong_place_is_named(tmp_path, capsys, name, told):
    draw, places, sentence = PLACE[name]
    given = written(tmp_path / "in", draw(3), places)
    more = ("--sigma-deg", SIGMA_DEG) if told else ()
    code, said = run(capsys, *given, *more, "--out", tmp_path / "out", command=("locate",))
    if code == 0:
        assert any(row["grave"] for row in failing(tmp_path / "out").values())
        assert sentence in said, said
    else:
        assert code == 2  # a refusal that says where to look
        assert "check the azimuths and the sensors' places" in said, said


def test_right_places_have_no_finding(tmp_path, capsys):
    for seed in range(20):
        given = written(tmp_path / f"in{seed}", resting(seed))
        more = ("--sigma-deg", SIGMA_DEG) if seed % 2 else ()
        code, said = run(capsys, *given, *more, "--strict", command=("locate",))
        assert code == 0, said
        assert "bearings." not in said
