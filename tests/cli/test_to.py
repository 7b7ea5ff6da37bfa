"""`--to` of a recording: each of its steps, those without a track too, to files and not to screens."""

from __future__ import annotations

import json

import numpy as np
import pytest

from elusive.cli import main
from elusive.cli.live import send_recording, sinks_of
from elusive.errors import ParameterError
from elusive.results import TrackLog, write_result, write_tracks_csv
from elusive.tracking.track import Step, Track


@pytest.mark.parametrize(("epoch_s", "clock"), [(0.0, None), (1.75e9, 1.75e9)])
def test_each_step_of_a_recording_is_sent_and_no_clock_is_made_up(tmp_path, epoch_s, clock):
    log = TrackLog(("x", "vx", "y", "vy"), "m")
    for k in range(6):
        track = Track(1, "confirmed", 0.9, np.array([k, 1.0, 2.0, 0.0]), np.eye(4))
        log.append(Step(epoch_s + k, None, None, (track,) if k in (1, 2) else ()))
    write_tracks_csv(tmp_path / "tracks.csv", log)
    write_result(tmp_path / "result.nc", log, title="room", config="")
    told = tmp_path / "told"
    names = [f"ndjson:{told}", f"geojson:{tmp_path / 'map'}"]
    send_recording(sinks_of(names, "links", "m", (8.5, 47.4), live=False), tmp_path)
    lines = [json.loads(line) for line in told.read_text().splitlines()]
    assert [line["time_s"] - epoch_s for line in lines] == list(range(6))
    assert [len(line["tracks"]) for line in lines] == [0, 1, 1, 0, 0, 0]
    assert [line["ended"] for line in lines] == [[], [], [], [1], [], []]  # when it did, not with the next track
    assert lines[2]["tracks"][0]["x_m"] == 2.0
    on_map = [json.loads(line) for line in (tmp_path / "map").read_text().splitlines()]
    assert [line["unix_s"] for line in on_map] == [None if clock is None else clock + k for k in range(6)]


@pytest.mark.parametrize(
    ("name", "instead"),
    [
        ("nmea+udp://127.0.0.1:10110", "play it with elusive replay"),
        ("cot+tcp://127.0.0.1:8087", "play it with elusive replay"),
        ("mqtt://127.0.0.1/site", "play it with elusive replay"),
        ("mot:told.txt", "tracks_mot.csv has it"),
    ],
)
def test_a_recording_does_not_go_to_who_shows_what_is_there_now(name, instead):
    with pytest.raises(ParameterError, match=instead):
        sinks_of([name], "images", "px", live=False)


@pytest.mark.parametrize(
    "words",
    [
        "images frames --follow --truth-cutoff-px 3",
        "links log.csv --nodes nodes.csv --follow --truth-cutoff-m 3",
        "bearings bearings.csv --follow --truth-cutoff-m 3",
        "radar plots.csv --follow --truth-cutoff-m 3",
        "radar plots.csv --follow --truth-mmsi 123456789",
        "video video.npz --truth-cutoff-m 3",
    ],
)
def test_what_is_for_scores_alone_is_refused_without_a_truth(words, tmp_path, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["track", *words.split(), "--out", str(tmp_path / "out")])
    assert ended.value.code == 2
    assert ": has no meaning without --truth; give that, or leave it out." in " ".join(capsys.readouterr().err.split())
