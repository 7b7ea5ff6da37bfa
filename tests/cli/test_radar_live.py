"""`elusive track radar --follow`: the same tracks as of the whole recording, a line a scan; what lacks is refused."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.cli.test_radar import Run
from tests.cli.test_radar_moving import columns_deg, columns_m, turning
from tests.longer import longer
from tests.systems.radar.test_headings import sailed as late_headings

PLACE = ["--radar-lat-deg", "53.9", "--radar-lon-deg", "10.2"]
TOLD = ["--range-sd-m", "10", "--detection-probability", "0.9", "--false-alarms", "1"]  # live nothing is found
LIMITS = [*TOLD, "--max-range-m", "5000", "--max-doppler-mps", "60", "--bearing-sd-mrad", "3", "--particles", "300"]
TRACK = ["track", "radar", "plots.csv", "--knowledge", "none", *PLACE, *LIMITS]
EVEN = """
radar: {false_alarm_shares: [1.0], false_alarm_sectors: [1.0], false_alarm_patches: [], false_alarm_lives: [],
  false_alarm_ground: []}
"""
LIVE = ["--follow", "--idle-s", "0.3"]


def tracks(folder: Path, name: str) -> list[str]:
    return (folder / name / "tracks.csv").read_text().splitlines()


@pytest.mark.parametrize(
    ("write", "more"),
    longer([(columns_deg, []), (turning, ["--rotation-s", "2.5"])], (turning, ["--rotation-s", "2.5"])),
)
def test_live_tracks_are_those_of_the_recording(
    elusive_in: Run, tmp_path: Path, capfd: pytest.CaptureFixture[str], write, more: list[str]
) -> None:  # fmt: skip
    write(tmp_path)
    (tmp_path / "even.yaml").write_text(EVEN)
    more = [*more, "--config", "even.yaml"]
    code, said = elusive_in(*TRACK, *more, *LIVE, "--to", "ndjson:told", "--out", "live")
    assert code == 0, said
    code, again = elusive_in(*TRACK, *more, "--out", "whole")
    assert code == 0, again
    assert tracks(tmp_path, "live") == tracks(tmp_path, "whole")
    records = [json.loads(line) for line in (tmp_path / "told").read_text().splitlines()]
    steps = [record for record in records if "latency_ms" in record and "time_s" in record]
    assert len(steps) >= 72
    assert f"{len(steps)} tracked" in said
    assert (tmp_path / "live/checks.json").is_file()


def test_plots_may_come_on_standard_input(elusive_in: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    columns_m(tmp_path)
    octets = (tmp_path / "plots.csv").read_bytes()
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(octets + b"nonsense\n")))
    code, said = elusive_in("track", "radar", "-", *TRACK[3:], "--follow", "--out", "live")
    assert code == 0, said
    assert len(tracks(tmp_path, "live")) > 100
    assert "1 spoilt" in said


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (TRACK[:3], "--max-range-m"),
        ([*TRACK[:3], *LIMITS, "--chart", "coast.geojson"], "--chart: needs the radar's place"),
        ([*TRACK[:3], *LIMITS, "--to", "geojson:-"], "--radar-lat-deg"),
        ([*TRACK, "--truth", "truth.csv"], "--truth: has no meaning with --follow"),
    ],
)
def test_what_a_live_run_lacks_is_said(elusive_in: Run, tmp_path: Path, arguments: list[str], told: str) -> None:
    columns_m(tmp_path)
    code, said = elusive_in(*arguments, *LIVE, "--out", "live")
    assert code == 2, said
    assert told in said


def test_plots_with_times_of_their_own_need_the_antennas_period(elusive_in: Run, tmp_path: Path) -> None:
    turning(tmp_path)
    code, said = elusive_in(*TRACK, *LIVE, "--out", "live")
    assert code == 2, said
    assert "give --rotation-s" in said


def test_headings_that_are_late_are_put_right_while_plots_come(elusive_in: Run, tmp_path: Path) -> None:
    rows = ["time_s,range_m,relative_bearing_deg,heading_deg,own_x_m,own_y_m"]
    for scan in late_headings(2.0, ships=3, alarms=0)[:36]:
        bows = scan.heading_rad if scan.heading_rad is not None else np.zeros(scan.detections)
        for far, bearing, bow in zip(scan.range_m, np.degrees(scan.bearing_rad), np.degrees(bows), strict=True):
            rows.append(f"{scan.time_s},{far},{(bearing - bow) % 360},{bow % 360},{scan.own.x_m},{scan.own.y_m}")
    (tmp_path / "plots.csv").write_text("\n".join(rows))
    (tmp_path / "even.yaml").write_text(EVEN)
    told = [*TOLD, "--bearing-sd-mrad", "2", "--max-range-m", "7500", "--particles", "100", "--extent", "point"]
    code, said = elusive_in(*TRACK[:3], *told, "--config", "even.yaml", *LIVE, "--out", "live")
    assert code == 0, said
    checks = {one["name"]: one for one in json.loads((tmp_path / "live/checks.json").read_text())}
    assert not checks["radar.headings"]["holds"]
    assert "are taken with the headings that it had then, from" in checks["radar.headings"]["sentence"]
