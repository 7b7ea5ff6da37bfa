"""Headings that are told late while the radar's ship turns: how late is found, and ships are where they are."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from elusive.cli import main
from elusive.results import read_tracks_csv
from elusive.sensors.radar_scans import RadarPlot, scan_of
from elusive.systems.radar.late_headings import Headings, righted
from elusive.systems.radar.live import follow_radar
from elusive.systems.radar.parameters import RadarTracking
from tests.systems.test_flat import Coming

TURN_S, SCANS, RANGE_SD_M, BEARING_SD, DETECTED, ALARMS, FURTHEST_M = 2.5, 72, 10.0, 3e-3, 0.9, 3, 8000.0
TIMES = np.arange(-10.0, 200.0, 0.1)


def heading(time_s, yaw=0.0):
    """Straight on, and every 60 s to either side by 60 degrees in 20 s; ``yaw`` [rad] about it in waves."""
    turns = np.clip((np.asarray(time_s)[..., None] - np.array([20.0, 80.0, 140.0])) / 20, 0, 1)
    return turns @ np.radians([60.0, -60.0, 60.0]) + yaw * np.sin(np.asarray(time_s))


def own(time_s, yaw):
    way = np.cumsum(0.6 * np.stack([np.sin(heading(TIMES, yaw)), np.cos(heading(TIMES, yaw))]), axis=1)
    return np.stack([np.interp(time_s, TIMES, one) for one in way], axis=-1)


def sailed(rng):
    """Five ships' places and velocities, ``(5, 2)`` each."""
    angle = rng.uniform(0, 2 * np.pi, 5)
    return rng.uniform(-3500, 3500, (5, 2)), 6.0 * np.column_stack([np.sin(angle), np.cos(angle)])


def recorded(seed, late_s=0.0, yaw=0.0):
    """The antenna's plots and the radar's places at them, with headings of ``late_s`` before; and the ships."""
    rng = np.random.default_rng([seed, 15])
    place, way = sailed(rng)
    lines = []
    for turn in range(SCANS):
        at = place + way * turn * TURN_S - own(turn * TURN_S, yaw)
        # when an antenna that turns against the bow passes
        times = turn * TURN_S + TURN_S * ((np.arctan2(*at.T) - heading(turn * TURN_S, yaw)) / (2 * np.pi) % 1)
        off = place + way * times[:, None] - own(times, yaw)
        bow = np.arctan2(*off.T) - heading(times, yaw)
        seen = (rng.random(5) < DETECTED) & (np.hypot(*off.T) < FURTHEST_M)
        far = np.append(np.hypot(*off.T)[seen], FURTHEST_M * np.sqrt(rng.random(ALARMS)))
        angle = np.append(bow[seen], rng.uniform(0, 2 * np.pi, ALARMS)) % (2 * np.pi)
        times = np.append(times[seen], turn * TURN_S + TURN_S * angle[-ALARMS:] / (2 * np.pi))
        errors = rng.normal(0, 1, (2, len(far)))
        rows = [times, np.abs(far + RANGE_SD_M * errors[0]), (angle + BEARING_SD * errors[1]) % (2 * np.pi)]
        rows += [*own(times, yaw).T, heading(times - late_s, yaw)]
        lines += np.array(rows).T.tolist()
    return sorted(lines), place, way


def scans(lines):
    """Scans of a recording's plots, a turn each."""
    found = []
    for turn in range(SCANS):
        plots = [
            RadarPlot(t, r, (b + h) % (2 * np.pi), math.nan, h) for t, r, b, _, _, h in lines if t // TURN_S == turn
        ]
        here = [line[3:5] for line in lines if line[0] // TURN_S == turn]
        x, y = np.mean(here, axis=0).tolist()
        scan = scan_of(float(np.mean([plot.time_s for plot in plots])), plots)
        found.append(scan._replace(own=scan.own._replace(x_m=x, y_m=y)))
    return found


@pytest.mark.parametrize("late_s", [0.5, 1.5, -0.8])
def test_how_late_they_are_is_found(late_s):
    gathered, taken = Headings(), scans(recorded(1, late_s)[0])
    for scan in taken:
        gathered.add(scan)
    late = gathered.late
    assert abs(late.late_s - late_s) < 3 * late.error_s + 0.05  # what is tried is .1 s apart
    right = scans(recorded(1)[0])
    for scan, as_it_was in zip(taken, right, strict=True):
        now = righted(scan, gathered.course, late_s)
        off = (now.bearing_rad - as_it_was.bearing_rad + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(off).max() < np.radians(3.0) * 0.5  # where a turn begins, and it turns between two plots


@pytest.mark.thorough
@pytest.mark.parametrize("yaw", [0.0, 0.06])
def test_right_headings_are_left_alone(yaw):
    for seed in range(3):
        gathered = Headings()
        for scan in scans(recorded(seed, yaw=yaw)[0]):
            gathered.add(scan)
        assert gathered.turns > 10
        assert gathered.late.late_s == 0.0


def test_without_headings_nothing_is_said():
    gathered = Headings()
    for scan in scans(recorded(1, 1.0)[0]):
        gathered.add(scan._replace(heading_rad=None))
    assert gathered.late.late_s == 0.0
    assert gathered.course.shape == (2, 0)


def wrong(tracks, place, way):
    """Rows of confirmed tracks that are surer than .9 and farther from every ship than 100 m."""
    count = 0
    for rows in tracks.confirmed().values():
        truth = place + way * rows["time_s"][:, None, None]
        off = np.hypot(*(rows["position"][:, None] - truth).transpose(2, 0, 1)).min(axis=1)
        count += int(((off > 100) & (rows["existence"] > 0.9)).sum())
    return count


def test_ships_are_where_they_are_while_the_radars_ship_turns(tmp_path, capsys):
    """Headings a second late: 144 to 240 sure rows in recordings like this were of no ship, and a remark alone."""
    lines, place, way = recorded(2, 1.0)
    header = "time_s,range_m,relative_bearing_deg,own_x_m,own_y_m,heading_deg"
    cells = (
        f"{t:.3f},{r:.1f},{np.degrees(b):.3f},{x:.1f},{y:.1f},{np.degrees(h) % 360:.2f}" for t, r, b, x, y, h in lines
    )
    (tmp_path / "plots.csv").write_text("\n".join([header, *cells]))
    with pytest.raises(SystemExit) as ended:
        main(["track", "radar", str(tmp_path / "plots.csv"), "--particles", "500", "--out", str(tmp_path / "out")])
    assert not ended.value.code, capsys.readouterr()
    (finding,) = (row for row in json.loads((tmp_path / "out/checks.json").read_text()) if not row["holds"])
    assert finding["name"] == "radar.headings"
    assert finding["seen"] == pytest.approx(1.0, abs=0.25)
    assert f"Headings are {finding['seen']:.2g} s late" in finding["sentence"]
    assert wrong(read_tracks_csv(tmp_path / "out/tracks.csv"), place, way) == 0


def test_live_it_is_learnt(tmp_path):
    lines, place, way = recorded(3, 1.0)
    parameters = RadarTracking(particles=300, radar={"max_range_m": FURTHEST_M})
    follow_radar(Coming(iter(scans(lines))), parameters, tmp_path, None, lambda step: None)
    (row,) = (row for row in json.loads((tmp_path / "checks.json").read_text()) if row["name"] == "radar.headings")
    assert row["seen"] == pytest.approx(1.0, abs=0.3)
    tracks = read_tracks_csv(tmp_path / "tracks.csv").confirmed()
    last = np.array([rows["position"][-1] for rows in tracks.values() if rows["time_s"][-1] > (SCANS - 2) * TURN_S])
    truth = place + way * SCANS * TURN_S
    assert np.hypot(*(last[:, None] - truth).transpose(2, 0, 1)).min(axis=1).max() < 100.0


@pytest.mark.parametrize("seed", range(2))
def test_before_a_coast_of_many_echoes_right_headings_are_left_alone(seed: int) -> None:
    """Its echoes make triples with each other, more by some headings than by others."""
    rng = np.random.default_rng([seed, 16])
    coast = np.column_stack([rng.uniform(-2500, 2500, 40), 4000 + 80 * np.abs(rng.normal(size=40))])
    often, (place, way), headings = rng.uniform(0.2, 0.95, 40), sailed(rng), Headings()
    for time_s in np.arange(SCANS) * TURN_S:
        here = own(time_s, 0.0)
        off = np.concatenate([coast[rng.random(40) < often], (place + way * time_s)[rng.random(5) < DETECTED]]) - here
        far = np.hypot(*off.T) + rng.normal(0, RANGE_SD_M, len(off))
        bearing = (np.arctan2(*off.T) + rng.normal(0, BEARING_SD, len(off))) % (2 * np.pi)
        bow = float(heading(time_s))
        plots = [RadarPlot(time_s, r, b, math.nan, bow) for r, b in zip(far.tolist(), bearing.tolist(), strict=True)]
        scan = scan_of(float(time_s), plots)
        headings.add(scan._replace(own=scan.own._replace(x_m=float(here[0]), y_m=float(here[1]))))
    assert headings.turns > 20
    assert not headings.late.late_s
