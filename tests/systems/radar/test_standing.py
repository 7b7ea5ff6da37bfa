"""Land that no chart names: tracks that stand where plots come all along are no sure ships."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar.ground import Fixed
from elusive.systems.radar.ground_echoes import GroundEchoes
from elusive.systems.radar.moving import Ways
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.standing import as_standing
from elusive.systems.radar.summary import verdict
from elusive.systems.radar.track import track_radar
from elusive.tracking.track import Track
from tests.systems.radar.test_ground import SENSOR, sailed
from tests.systems.radar.test_lives import shown

PLACE = ((1000.0, 0.0, 100.0, 100.0, 0.0, 0.6),)  # a plot in six of ten scans
STILL = GroundEchoes.of(SENSOR, PLACE)


def islets(rng, n=10):
    """Groups of echoes 60 m across, far from each other, each echo seen in its own share of the scans."""
    places = np.array([[-2500.0 + 500 * k, 1500.0 * (-1) ** k] for k in range(n)])
    echoes = (places[:, None] + rng.uniform(-30, 30, (n, 4, 2))).reshape(-1, 2)
    return echoes, rng.uniform(0.3, 0.9, len(echoes))


def scan_at(places):
    places = np.array(places).reshape(-1, 2)
    far, bearing = np.hypot(*places.T), np.arctan2(*places.T)
    return RadarScan(0.0, np.zeros(len(far)), far, bearing, np.full(len(far), np.nan))


@pytest.mark.parametrize("moving", [True, False])
def test_islets_stand_and_are_no_ground_and_ships_do_not(moving):
    rng = np.random.default_rng(2)
    echoes, often = islets(rng)
    ships = [[-1500.0, 5.0, -500.0, 0.0], [1500.0, -1.5, 300.0, 0.0]]
    scans, _ = sailed(rng, 60, echoes, often, ships, moving)
    fixed = Fixed.of(SENSOR, scans)
    for scan in scans:
        fixed.add(scan, SENSOR.places(scan)[0])
    ground, every = fixed.standing(SENSOR)
    assert ground == ()
    places = np.array(every)[:, :2]
    off = np.hypot(*(echoes[:, None] - places).transpose(2, 0, 1))
    assert (off.min(axis=1) < 40).mean() > 0.9
    assert (off.min(axis=0) < 80).mean() > 0.95


def test_plots_come_as_often_as_at_their_place():
    """At the place of one echo as often as it is seen; Gaussian beside it, by its spread and the plot's error."""
    off = np.array([0.0, 20.0, 500.0])
    scan = scan_at(np.column_stack([1000 + off, 0 * off]))
    wide = 100.0 + SENSOR.range_sd_m**2
    assert STILL.often(scan) == pytest.approx(0.6 * np.exp(-0.5 * off**2 / wide), rel=1e-3, abs=1e-9)


def ways(stands):
    """Of a track that stands with a probability."""
    share = np.array([[stands, 0.0, 0.0, 1 - stands, 0.0]])
    return Ways(share, np.zeros((1, 3, 4)), np.zeros((1, 3, 4, 4)))


@pytest.mark.parametrize("told", [True, False])
def test_what_goes_on_is_a_ship_and_what_stays_where_plots_come_is_an_echo(told):
    """A ship that anchors where no plots come is at rest, and is none; where nothing is told, nothing stands."""
    rng, found = np.random.default_rng(4), {}
    sensor = SENSOR.replace(detection_probability=0.95, false_alarms=0.1)
    radar = {"standing_echoes": PLACE if told else ()}
    parameters = RadarTracking(particles=200, radar=radar)
    scans = []
    for k in range(50):
        time_s = 2.5 * k
        states = [[-500 + 5 * time_s, 5.0, 600.0, 0.0], [1000.0 + 5 * math.sin(k), 0.0, 0.0, 0.0]]
        states += [[-1000.0, 0.0, -900 + 6 * min(time_s, 40.0), 6.0 * (time_s < 40)]]
        scans.append(sensor.simulate(np.array(states), rng, time_s=time_s))
    for step in track_radar(scans, parameters.bind(sensor, None), parameters):
        for track in step.tracks:
            x, y = track.mean[[0, 2]]
            off = {"ship": abs(y - 600), "echo": abs(x - 1000) + abs(y), "anchors": abs(x + 1000) + abs(y + 660)}
            name = min(off, key=off.__getitem__)
            found.setdefault(name if off[name] < 100 else "none", []).append(
                [track.extra["stands"], track.extra["moves"]]
            )
    ship, echo, anchors = (np.array(found[name]) for name in ("ship", "echo", "anchors"))
    assert (ship[4:, 0] < 0.1).all()
    assert ship[-1, 1] > 0.99
    assert anchors[-1, 0] < 0.1
    assert anchors[-1, 1] < 0.1
    assert echo[-1, 1] < 0.01
    assert echo[-1, 0] > 0.99 if told else not echo[:, 0].any()


def test_what_stands_is_as_likely_a_ship_as_not_unless_ais_names_it():
    """Beside others a candidate alone."""
    shares = {1: (0.95, False), 2: (0.01, False), 3: (0.95, False), 4: (0.95, True)}
    stands = {k: ways(share) for k, (share, _) in shares.items()}
    places = {k: np.array([9000.0 * alone, 0.0, 1010.0, 0.0]) for k, (_, alone) in shares.items()}
    tracks = [Track(k, "confirmed", 1.0, place, np.eye(4)) for k, place in places.items()]
    tracks[2] = tracks[2]._replace(extra={"mmsi": 211000000.0})
    others = GroundEchoes.of(
        SENSOR, tuple((x, y, 100.0, 100.0, 0.0, 0.5) for x, y in ((0.0, 1400.0), (9000.0, 1010.0)))
    )
    echo, ship, named, lone = as_standing(tracks, stands, others)
    assert (echo.status, echo.existence, echo.extra["stands"]) == ("candidate", pytest.approx(0.525), 0.95)
    assert (lone.status, lone.existence) == ("confirmed", echo.existence)
    assert (ship.status, ship.existence) == ("confirmed", pytest.approx(0.995))
    assert (named.status, named.existence) == ("confirmed", 1.0)
    (gone,) = as_standing([tracks[0]._replace(status="deleted")], stands, others)
    assert gone.status == "deleted"
    assert [one.existence for one in as_standing(tracks, stands, None)] == [1.0] * 4


def test_what_stands_alone_has_no_other_place_near():
    cells = tuple((x, 0.0, 100.0, 100.0, 0.0, 0.5) for x in (1000.0, 1030.0, 1400.0, 4000.0))
    echoes = GroundEchoes.of(SENSOR, cells)
    assert not echoes.alone(np.array([1010.0, 0.0]), 25.0 * np.eye(2))
    assert echoes.alone(np.array([4010.0, 0.0]), 25.0 * np.eye(2))
    assert GroundEchoes.of(SENSOR, cells[:2]).alone(np.array([1010.0, 0.0]), 25.0 * np.eye(2))


def test_the_verdict_counts_candidates_that_stand():
    where = "where plots come all along: land, buoys or ships at rest."
    assert verdict([], 1) == f"No ship under way was found. 1 candidate stands {where}"
    assert verdict([], 2) == f"No ship under way was found. 2 candidates stand {where}"
    assert "stand" not in verdict([])


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(2))
def test_islets_without_a_chart_are_no_sure_ships(seed):
    rng = np.random.default_rng([seed, 9])
    ships = [[-1500.0, 5.0, -500.0, 0.0], [1500.0, -6.0, 400.0, 0.0], [500.0, 0.0, -1500.0, 2.0]]
    scans, truth = sailed(rng, 60, *islets(rng), ships, moving=False)
    before, _ = shown(scans, truth, RadarTracking(particles=200, radar={"standing_echoes": ()}))
    wrong, found = shown(scans, truth, RadarTracking(particles=200))
    assert wrong < before / 20
    assert found > 0.9
