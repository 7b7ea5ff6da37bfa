"""`elusive track video --follow`: over loopback as of the whole recording, to sinks too; what lacks is refused."""

from __future__ import annotations

import json
import socket
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from elusive.io.replay import replay
from elusive.results.log import read_tracks_csv
from tests.brokers import free_port
from tests.cli.test_radar import Run
from tests.systems.test_video import SIMULATION, SMALL, simulate_video

TOLD = ["--beam-deg", "6", "--pulse-m", "40", "--learning-turns", "4"]


@pytest.fixture
def capture(tmp_path: Path) -> Path:
    radar = {**SMALL, "bits": 8, "gain": 3.0}
    simulate_video(
        SIMULATION.replace(turns=14, write="asterix", radar=radar, coast_north_m=None), tmp_path / "sea"
    )  # fmt: skip
    return tmp_path / "sea" / "video.pcap"


def test_video_over_the_network_gives_the_recordings_tracks(
    elusive_in: Run, tmp_path: Path, capture: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    code, said = elusive_in("track", "video", "sea/video.pcap", *TOLD, "--out", "whole")
    assert code == 0, said
    port = free_port(socket.SOCK_DGRAM)

    def play() -> None:
        while True:  # until somebody listens
            with socket.socket(type=socket.SOCK_DGRAM) as ear:
                try:
                    ear.bind(("127.0.0.1", port))
                except OSError:
                    break
            time.sleep(0.02)
        replay(capture, f"udp://127.0.0.1:{port}", 15.0, print)

    player = threading.Thread(target=play)
    player.start()
    code, said = elusive_in(
        "track", "video", f"udp://127.0.0.1:{port}", *TOLD, "--follow", "--idle-s", "3", "--to", "geojson:told",
        "--out", "live",
    )  # fmt: skip
    player.join()
    assert code == 0, said
    whole, live = (read_tracks_csv(tmp_path / name / "tracks.csv") for name in ("whole", "live"))
    sure = [log.rows[log.rows["status"] == 1] for log in (whole, live)]
    assert len(sure[0])
    last = [rows["position"][rows["time_s"] == rows["time_s"].max()] for rows in sure]
    apart = np.linalg.norm(last[0][:, None] - last[1], axis=-1)
    assert apart.min(axis=1).max() < 60.0  # a few spokes may be lost on the way
    places = [json.loads(line)["features"] for line in (tmp_path / "told").read_text().splitlines()]
    assert any(place["geometry"]["coordinates"] for place in places[-1])
    assert {"tracks.csv", "resting.csv", "checks.json"} <= {path.name for path in (tmp_path / "live").iterdir()}


@pytest.mark.thorough
def test_a_file_may_be_followed(elusive_in: Run, tmp_path: Path, capture: Path) -> None:
    for more, out in (([], "whole"), (["--follow"], "live")):
        code, said = elusive_in("track", "video", "sea/video.pcap", *TOLD, *more, "--out", out)
        assert code == 0, said
    assert (tmp_path / "live/tracks.csv").read_text() == (tmp_path / "whole/tracks.csv").read_text()
    assert (tmp_path / "live/resting.csv").read_text() == (tmp_path / "whole/resting.csv").read_text()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--follow", "--truth", "truth.csv"], "--truth: has no meaning with --follow"),
        (["--idle-s", "1"], "--idle-s: has no meaning without --follow"),
        (["--to", "mot:file"], "MOTChallenge needs pixels"),
    ],
)
def test_what_has_no_meaning_is_said(
    elusive_in: Run, capture: Path, arguments: list[str], told: str
) -> None:  # fmt: skip
    code, said = elusive_in("track", "video", "sea/video.pcap", *arguments, "--out", "live")
    assert code == 2, said
    assert told in said


def test_silence_is_said(elusive_in: Run) -> None:
    where = f"udp://127.0.0.1:{free_port(socket.SOCK_DGRAM)}"
    code, said = elusive_in("track", "video", where, "--idle-s", "0.3", "--follow", "--out", "live")
    assert code == 2, said
    assert "nothing came" in said
