"""Live runs that begin or end where the system takes no more: what is lacking is told, and no line is cut."""

from __future__ import annotations

import json
import os
import signal
from contextlib import contextmanager

import numpy as np
import pytest
from PIL import Image

from elusive.cli import main
from elusive.errors import DataError
from elusive.results import read_tracks_csv
from elusive.results.live import live_folder
from tests.json_lines import json_lines

resource = pytest.importorskip("resource", reason="no limits of that kind on Windows")
FRAMES = 40


@contextmanager
def files_of_at_most(octets):
    """The system refuses to let any file grow beyond so much, whoever writes it."""
    before, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (octets, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)


def test_what_cannot_be_written_at_the_end_is_told_and_all_else_is_there(tmp_path, capsys):
    rows, columns = np.mgrid[:32, :56]
    rng, frames = np.random.default_rng(3), tmp_path / "frames"
    frames.mkdir()
    for k in range(FRAMES):
        spot = 30 * np.exp(-((rows - 12) ** 2 + (columns - 6 - k) ** 2) / 2)
        Image.fromarray(np.rint(rng.normal(100, 3, rows.shape) + spot).astype(np.uint8)).save(frames / f"f{k:02d}.png")
    known = ("--sensor", "white", "--noise-sigma", "3", "--pedestal", "100", "--psf-sigma", "1", "--filter", "single")
    words = ["track", "images", str(frames), *known, "--rate-hz", "10", "--follow", "--idle-s", "0.2", "--out"]
    with pytest.raises(SystemExit):  # whatever is compiled is kept in files of its own
        main([*words, str(tmp_path / "before")])
    out, _ = tmp_path / "out", capsys.readouterr()
    with files_of_at_most(4096), pytest.raises(SystemExit) as ended:
        main([*words, str(out)])
    assert ended.value.code == 2
    said = capsys.readouterr()
    lines, summary = json_lines(said.out)
    assert len(lines) == FRAMES
    err = " ".join(said.err.split())
    assert f"{FRAMES} tracked" in err
    assert err.count("tracks.csv: cannot be written to (File too large)") == 1
    told = [(line["time_s"], track["track"]) for line in lines for track in line["tracks"]]
    log = read_tracks_csv(out / "tracks.csv")  # no line is cut
    there = list(zip(log.rows["time_s"].tolist(), log.rows["track"].tolist(), strict=True))
    assert 0 < len(there) < len(told)
    assert there == told[: len(there)]
    assert f"tracks.csv: its last {len(told) - len(there)} lines could not be written" in err
    assert "result.nc: cannot be written (" in err
    assert len(summary["unwritten"]) == 2
    assert summary["files"] == ["tracks.csv", "checks.json", "config.yaml"]
    assert sorted(path.name for path in out.iterdir()) == ["checks.json", "config.yaml", "tracks.csv"]
    assert json.loads((out / "checks.json").read_text())


@pytest.mark.parametrize("existed", [True, False])
def test_a_run_is_not_begun_where_nothing_can_be_written(tmp_path, existed):
    out = tmp_path / "out"
    if existed:
        out.mkdir()
    with (
        files_of_at_most(0),
        pytest.raises(DataError, match=r"config\.yaml: cannot be written \(File too large\)"),
        live_folder(out, "seed: 1\n"),
    ):
        raise AssertionError
    assert out.exists() == existed  # as it was
    assert not existed or not os.listdir(out)
