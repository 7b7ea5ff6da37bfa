"""Ships of several echoes through the command line: simulated, tracked as hulls without being told so, and checked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from elusive.io import write_radar_plots_csv
from elusive.results import STATUSES, read_tracks_csv
from tests.cli.test_radar import RADAR, Run, lonlat
from tests.cli.test_radar_checks import failing
from tests.tracking.test_extended_scan import POINT, sailed

SEEN = ["--bearing-sd-mrad", "2", "--false-alarms", "2"]
FEW = ["--particles", "1000"]
TRACK = ["track", "radar", "plots.csv", *RADAR, *SEEN, *FEW, "--knowledge", "none", "--out", "out"]


def routes(folder: Path, *ways: tuple[tuple[float, float], tuple[float, float]]) -> list[str]:
    for number, way in enumerate(ways):
        rows = [f"{lon},{lat}" for lon, lat in lonlat(*way)]
        (folder / f"{number}.csv").write_text("\n".join(["lon_deg,lat_deg", *rows]))
    return [part for number in range(len(ways)) for part in ("--route", f"{number}.csv")]


@pytest.mark.thorough
def test_a_long_ship_is_a_hull_and_two_small_ones_beside_each_other_stay_two(elusive_in: Run, tmp_path: Path) -> None:
    ways = routes(
        tmp_path, ((-500, 3400), (300, 3400)), ((-500, 2000), (300, 2000)), ((-500, 1940), (300, 1940))
    )  # fmt: skip
    lengths = ["--ship-length-m", "200", "--ship-length-m", "0", "--interval-s", "2.5", "--max-range-m", "6000"]
    sim = ["simulate", "radar", *ways, *lengths, *RADAR, *SEEN, "--detection-probability", ".9", "--out", "."]
    code, said = elusive_in(*sim, "--doppler-probability", "0")
    assert code == 0, said
    code, said = elusive_in(*TRACK, "--truth", "truth.csv", "--strict")
    assert code == 0, said
    assert failing(tmp_path) == set()
    assert "hulls, along which plots lie" in said
    log = read_tracks_csv(tmp_path / "out/tracks.csv")
    last = log.rows[log.rows["time_s"] == log.times_s[-1]]
    sure = last[last["status"] == STATUSES.index("confirmed")]
    length, sd, breadth = (
        sure["added"][:, log.columns.added.index(name)] for name in ("length_m", "sd_length_m", "breadth_m")
    )
    order = np.argsort(length)
    assert len(order) == 3
    assert (length[order[:2]] < 40).all()
    assert length[order[2]] == pytest.approx(200, abs=3 * max(sd[order[2]], 8.0))
    assert breadth[order[2]] == pytest.approx(length[order[2]] / 6.5, rel=0.01)
    code, said = elusive_in(*TRACK, "--extent", "point", "--strict")
    assert code == 3, said
    assert "radar.bunches" in failing(tmp_path)
    assert "Give --extent hull." in said
    code, said = elusive_in(*sim[:-2], "--ship-length-m", "3", "--ship-length-m", "4", "--out", "no")
    assert code != 0
    assert "ship_length_m: tells 4 lengths of 3 ships" in said


def test_hulls_have_no_meaning_at_anchor(elusive_in: Run, tmp_path: Path) -> None:
    (tmp_path / "plots.csv").write_text("time_s,range_m,bearing_deg\n0,1000,5\n")
    code, said = elusive_in(*TRACK, "--extent", "hull", "--motion", "anchoring")
    assert code != 0
    assert "at anchor is nowhere" in said


@pytest.mark.thorough
def test_two_ships_in_line_stay_two_and_nothing_is_told_of_hulls(elusive_in: Run, tmp_path: Path) -> None:
    ends = [(-80.0, 0.0), (80.0, 0.0)]
    ships = [((-500.0, 3000.0), (7.0, 0.0), ends, 0.9), ((2000.0, -2000.0), (-4.0, 0.0), POINT, 0.9)]
    write_radar_plots_csv(tmp_path / "plots.csv", sailed(ships, np.random.default_rng(4)))
    code, said = elusive_in(*TRACK, "--extent", "hull")
    assert code == 0, said
    log = read_tracks_csv(tmp_path / "out/tracks.csv")
    last = log.rows[log.rows["time_s"] == log.times_s[-1]]
    assert (last["status"] == STATUSES.index("confirmed")).sum() == 3
    assert "radar.hull-ends" not in failing(tmp_path)
