"""A live run's lines and latencies."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io.arrivals import Arrivals
from elusive.io.sinks.formats import json_line
from elusive.results import TrackLog
from elusive.results.latency import Latencies
from elusive.results.live import follow_live, live_folder
from elusive.tracking.track import Step, Track


def steps(coming, stop=math.inf):
    for time_s in coming:
        if time_s >= stop:
            raise DataError("the frame cannot be used.")
        covariance = np.diag([4.0, np.nan, 9.0, np.nan])
        track = Track(3, "confirmed", 0.5, np.array([1.0, np.nan, 2.0, 0.25]), covariance, extra={"snr_db": -math.inf})
        yield Step(time_s, None, None, (track,))


def test_a_step_is_in_the_file_when_it_is_told(tmp_path):
    coming, told = Arrivals([0.0, 1.0]), []
    with (
        live_folder(tmp_path / "out", "seed: 1\n") as folder,
        TrackLog(("x", "vx", "y", "vy"), "px", ("snr_db",), path=folder / "tracks.csv") as log,
    ):

        def on_step(live):
            assert len((folder / "tracks.csv").read_text().splitlines()) == len(told) + 2
            told.append(json.loads(json_line(live.record)))

        end = follow_live(steps(coming), coming, log, on_step, extra=lambda step: {"existence": 0.5})
    track = {"track": 3, "status": "confirmed", "existence": 0.5, "x_px": 1.0, "y_px": 2.0, "vx_pxps": None,
             "vy_pxps": 0.25, "sd_x_px": 2.0, "sd_y_px": 3.0, "correlation_xy": 0.0, "snr_db": None}  # fmt: skip
    assert [line["tracks"] for line in told] == [[track], [track]]
    assert [line["time_s"] for line in told] == [0.0, 1.0]
    assert {"time_s", "unix_s", "latency_ms", "dropped", "existence", "tracks"} == told[0].keys()
    assert (end.steps, end.dropped, end.fault) == (2, 0, None)
    assert (tmp_path / "out" / "config.yaml").read_text() == "seed: 1\n"


def test_a_later_fault_ends_the_run_and_an_early_one_is_raised(tmp_path):
    for stop, expected in ((3.0, 3), (0.0, 0)):
        coming = Arrivals([0.0, 1.0, 2.0, 3.0, 4.0])
        log, told = TrackLog(("x", "vx", "y", "vy"), "px", ("snr_db",)), []
        if not expected:
            with pytest.raises(DataError, match="cannot be used"):
                follow_live(steps(coming, stop), coming, log, told.append)
            continue
        end = follow_live(steps(coming, stop), coming, log, told.append)
        assert len(told) == end.steps == expected
        assert end.fault == "the frame cannot be used."


def test_quantiles_of_latencies_are_those_of_all():
    taken = np.random.default_rng(2).lognormal(-4, 1, 5000)
    latencies = Latencies()
    for one in taken.tolist():
        latencies.add(one)
    for share in (0.5, 0.95):
        assert latencies.quantile_s(share) == pytest.approx(np.quantile(taken, share), rel=0.02)  # a bin is 2 % wide
    assert (latencies.first_s, latencies.longest_s) == (taken[0], taken.max())
    assert latencies.record()["longest"] == pytest.approx(1e3 * taken.max(), rel=1e-3)
    assert math.isnan(Latencies().quantile_s(0.5))
    assert Latencies().record() == {}
