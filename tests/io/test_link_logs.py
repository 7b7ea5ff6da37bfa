"""Logs of a radio network: every form gives the same frames, lazily; each fault is named."""

from __future__ import annotations

import io
import os
import re
import sys
import threading
import time
import tracemalloc
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io.link_logs import open_link_log
from elusive.io.placed_files import read_nodes
from elusive.io.sources import Feed
from elusive.sensors.radio_network import directed_links_of, radio_nodes
from tests import recordings
from tests.processes import HUNG_S

DATA = recordings.DATA / "rti" / "basement"
NODES = radio_nodes(np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]]), ("a", "b", "c-1"))
PAIRS = [(NODES.names[tx], NODES.names[rx]) for tx, rx in directed_links_of(3).tolist()]
TIMES = np.array([0.5, 1.0, 2.25])
LEVELS = np.random.default_rng(0).integers(-90, -40, (3, 6, 2)).astype(float)
LEVELS[1, 2, 0] = LEVELS[2, 5, 1] = np.nan
CHANNELS = ("11", "26")


def cell(value, missing=""):
    return missing if np.isnan(value) else f"{value:g}"


def wide(missing="", order=slice(None)):
    names = [f"{tx}-{rx}-{channel}" for tx, rx in PAIRS for channel in CHANNELS]
    rows = [",".join(["time_s", *names[order]])]
    for t, frame in zip(TIMES, LEVELS, strict=True):
        rows.append(",".join([str(t), *[cell(value, missing) for value in frame.ravel()][order]]))
    return "\n".join(rows) + "\n"


def long(delimiter=",", missing="nan"):
    rows = [delimiter.join(["time_s", "tx", "rx", "channel", "rss_dbm"])]
    for t, frame in zip(TIMES, LEVELS, strict=True):
        for (tx, rx), levels in zip(PAIRS, frame, strict=True):
            for channel, level in zip(CHANNELS, levels, strict=True):
                rows.append(delimiter.join([str(t), tx, rx, channel, cell(level, missing)]))
    return "\n".join(rows) + "\n"


def plain(order, delimiter=","):
    """Numbers alone: all links of each channel or all channels of each link."""
    rows = []
    for t, frame in zip(TIMES, LEVELS, strict=True):
        numbers = (frame.T if order == "channel-link" else frame).ravel()
        rows.append(delimiter.join([str(t), *[cell(value, "nan") for value in numbers]]))
    return "# no header\n" + "\n".join(rows) + "\n"


def listenx():
    return "".join(
        " ".join([*[cell(value, "127") for value in frame.T.ravel()], f"{1000 * t:g}"]) + " \n"
        for t, frame in zip(TIMES, LEVELS, strict=True)
    )


def saved(tmp_path: Path, text: str, name: str = "log.csv") -> Path:
    path = tmp_path / name
    path.write_text(text)
    return path


def check(log, channels=CHANNELS):
    assert log.channels == channels
    frames = list(log)
    np.testing.assert_allclose([frame.time_s for frame in frames], TIMES, rtol=1e-12)
    for frame, levels in zip(frames, LEVELS, strict=True):
        np.testing.assert_array_equal(frame.rss_dbm, levels)


@pytest.mark.parametrize(
    ("text", "layout", "channels"),
    [
        (wide(), None, CHANNELS),
        (wide("127", slice(None)), None, CHANNELS),
        (long(), None, CHANNELS),
        (long(";", ""), None, CHANNELS),
        (plain("channel-link"), "channel-link", ("0", "1")),
        (plain("link-channel", ";"), "link-channel", ("0", "1")),
        (listenx(), None, ("0", "1")),
        (listenx(), "listenx", ("0", "1")),
    ],
)
def test_every_form_gives_the_same_frames_again_and_again(tmp_path, text, layout, channels, monkeypatch):
    log = open_link_log(saved(tmp_path, text), NODES, layout=layout)
    check(log, channels)
    check(log, channels)
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(text.encode())))
    check(open_link_log("-", NODES, layout=layout), channels)


def test_columns_may_stand_in_any_order_and_links_be_left_out(tmp_path):
    backwards = open_link_log(saved(tmp_path, wide(order=slice(None, None, -1))), NODES)
    assert backwards.channels == CHANNELS[::-1]
    np.testing.assert_array_equal([frame.rss_dbm for frame in backwards], LEVELS[:, :, ::-1])
    one = list(open_link_log(saved(tmp_path, "c-1-a,time_s\n-50,1\n"), NODES))
    assert one[0].rss_dbm.shape == (6, 1)
    assert np.flatnonzero(np.isfinite(one[0].rss_dbm)).tolist() == [PAIRS.index(("c-1", "a"))]


@pytest.mark.parametrize("layout", ["channel-link", "link-channel"])
def test_an_array_is_read_by_its_layout(tmp_path, layout):
    frames = LEVELS.transpose(0, 2, 1) if layout == "channel-link" else LEVELS
    np.save(tmp_path / "log.npy", np.column_stack([TIMES, frames.reshape(3, -1)]))
    check(open_link_log(tmp_path / "log.npy", NODES, layout=layout), ("0", "1"))


def test_readings_of_a_period_are_a_frame_and_are_averaged(tmp_path):
    text = "time_s,tx,rx,channel,rss_dbm\n0,a,b,1,-50\n.1,a,b,1,-60\n.3,b,a,2,-70\n1.2,a,b,1,127\n1.5,b,a,1,-40\n"
    first, second = open_link_log(saved(tmp_path, text), NODES, channels=("1", "2"), period_s=1.0)
    assert (first.time_s, second.time_s) == (0.3, 1.5)
    np.testing.assert_array_equal(first.rss_dbm[[0, 2]], [[-55, np.nan], [np.nan, -70]])
    np.testing.assert_array_equal(second.rss_dbm[[0, 2]], [[np.nan, np.nan], [-40, np.nan]])


def test_a_growing_file_is_followed_line_by_line(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("")
    text = long()
    parts = [text[:30], text[30:211], text[211:]]

    def write():
        for part in parts:
            time.sleep(0.05)
            with path.open("a") as file:
                file.write(part)

    writer = threading.Thread(target=write)
    writer.start()
    try:
        frames = iter(open_link_log(path, NODES, feed=Feed()))
        np.testing.assert_array_equal(next(frames).rss_dbm, LEVELS[0])
        # the second comes as soon as the third begins: this file is never idle
        np.testing.assert_array_equal(next(frames).rss_dbm, LEVELS[1])
    finally:
        writer.join()
    frames = iter(open_link_log(path, NODES, feed=Feed(idle_s=0.1)))
    assert len(list(frames)) == len(LEVELS)


def test_a_followed_file_that_gets_shorter_is_read_from_its_start_again(tmp_path):
    path, said = saved(tmp_path, wide()), []
    feed = Feed(idle_s=HUNG_S, say=said.append)
    frames = iter(open_link_log(path, NODES, feed=feed))
    for _ in TIMES:
        next(frames)
    header, first, *_ = wide().splitlines()
    cells = first.split(",")
    path.write_text(f"{header}\n" + ",".join(["10", *cells[1:]]) + "\n")
    assert next(frames).time_s == 10
    assert feed.counts == {"restarted": 1}
    assert "got shorter" in said[0]


@pytest.mark.skipif(os.name == "nt", reason="Windows replaces no open file")
def test_a_followed_file_that_another_takes_the_place_of_is_left_for_that(tmp_path):
    path, said = saved(tmp_path, wide()), []
    feed = Feed(idle_s=HUNG_S, say=said.append)
    frames = iter(open_link_log(path, NODES, feed=feed))
    for _ in TIMES:
        next(frames)
    header, first, *_ = wide().splitlines()
    beside = tmp_path / "beside"
    later = [",".join([f"{10 + k}", *first.split(",")[1:]]) for k in range(len(TIMES) + 2)]
    beside.write_text("\n".join([header, *later]) + "\n")  # longer than the one that was read
    beside.replace(path)
    assert [next(frames).time_s for _ in later] == [10 + k for k in range(len(later))]
    assert feed.counts == {"restarted": 1}
    assert "is another file now" in said[0]


def test_what_comes_late_twice_or_spoilt_is_left_out_and_counted(tmp_path):
    path, said = tmp_path / "log.csv", []
    path.write_text(
        HEADER + "1,a,b,1,-50\n1,a,b,1,-51\n2,a,b,1,-52\n1.5,a,b,1,-60\n2,a,x,1,-1\n3,a,b,1,low\n4,a,b,1,-53\n"
    )
    feed = Feed(idle_s=0.0, say=said.append)
    frames = list(open_link_log(path, NODES, feed=feed))
    assert [frame.time_s for frame in frames] == [1, 2, 4]
    assert [np.nanmax(frame.rss_dbm) for frame in frames] == [-50, -52, -53]
    assert feed.counts == {"repeated": 1, "late": 1, "spoilt": 2}
    assert len(said) == 4


def test_what_is_late_finds_its_place_where_it_is_held_for(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(HEADER + "".join(f"{time_s},a,b,1,-50\n" for time_s in (1, 3, 2, 5, 4, 6.5, 3.5)))
    feed = Feed(idle_s=0.0, hold_s=1.0)
    assert [frame.time_s for frame in open_link_log(path, NODES, feed=feed)] == [1, 2, 3, 4, 5, 6.5]
    assert feed.counts == {"late": 1}


HEADER = "time_s,tx,rx,channel,rss_dbm\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty"),
        ("\n# only a remark\n", "is empty"),
        (HEADER, "holds no frame"),
        ("time_s,a-b-1\n1,127\n2,\n", "has no reading: every one is missing"),
        ("time_s,a-b-1\n1,-50\n1,-50\n", r"line 3: the time is 1 s after 1 s"),
        ("time_s,a-b-1\n2,-50\n1,-50\n", "times must go forwards"),
        ("time_s,a-b-1\n1,low\n", r"line 2, column 2: 'low' is no number"),
        ("time_s,a-b-1\n1,inf\n", "is no finite number"),
        ("time_s,a-b-1\nnan,-50\n", "is no finite number"),
        ("time_s,a-b-1\n1,-50,-60\n", r"line 2: has 3 cells, not 2"),
        ("time_s,a-d-1\n1,-50\n", "column 'a-d-1' is no link of the nodes a, b, c-1"),
        ("time_s,a-a-1\n1,-50\n", "is no link"),
        ("time_s,a-b-1,a-b-1\n1,-50,-50\n", "two with one name"),
        ("time_s,time_s,a-b-1\n1,1,-50\n", "one column must be named time_s"),
        ("time_s\n1\n", "with one name or none"),
        ("1,2,3,4,5,6,7\n", "say with layout"),
        ("-1 -2 -3 -4 -5 1000\n", "no multiple of the 6 directed links of 3 nodes"),
        ("-1 -2 -3 -4 -5 -6 1000\n-1 -2 -3 -4 -5 2000\n", r"line 2: has 6 cells, not 7"),
        (HEADER + "1,a,z,1,-50\n", "column rx: node 'z' is not in the list of nodes"),
        (HEADER + "1,a,a,1,-50\n", "hears itself"),
        (HEADER + "1,a,b,1\n", "has 4 cells"),
        (HEADER + "now,a,b,1,-50\n", "column time_s: 'now' is no number"),
        (HEADER + "1,a,b,1,-50\n1,a,b,1,-51\n", "has a reading at 1 s already"),
        (HEADER + "1,a,b,1,-50\n2,a,b,2,-51\n", "channel '2' is not one of 1"),
        (HEADER + "2,a,b,1,-50\n1,a,b,1,-51\n", "times must go forwards"),
        (HEADER + '1,a,b,1,"-50,5"\n', "cells"),
        ("time_s;a-b-1\n1;-5x,5\n", "column 2: '-5x,5' is no number"),
    ],
)
def test_faulty_logs_are_refused(tmp_path, text, said):
    with pytest.raises(DataError, match=said):
        list(open_link_log(saved(tmp_path, text), NODES))


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        (wide(), {"layout": "sideways"}, "is unknown; choose one of"),
        (wide(), {"layout": "listenx"}, "names the columns itself"),
        (wide(), {"period_s": 1.0}, "are for a log with a reading a line"),
        (long(), {"period_s": -1.0}, "must be a positive time"),
    ],
)
def test_arguments_that_do_not_fit_are_refused(tmp_path, text, options, said):
    with pytest.raises(DataError, match=said):
        open_link_log(saved(tmp_path, text), NODES, **options)


def test_files_that_are_no_log_are_refused(tmp_path):
    for path, said in [(tmp_path, "is a folder"), (tmp_path / "none.csv", "there is no such file")]:
        with pytest.raises(DataError, match=said):
            open_link_log(path, NODES)
    (tmp_path / "bytes.csv").write_bytes(b"time_s,a-b\n1,\xff\n")
    with pytest.raises(DataError, match="line 2: is not text"):
        list(open_link_log(tmp_path / "bytes.csv", NODES))
    np.save(tmp_path / "log.npy", np.zeros((2, 7)))
    with pytest.raises(DataError, match="give layout"):
        open_link_log(tmp_path / "log.npy", NODES)
    np.save(tmp_path / "cube.npy", np.zeros((2, 7, 1)))
    with pytest.raises(DataError, match="must be one array of numbers"):
        open_link_log(tmp_path / "cube.npy", NODES, layout="listenx")
    (tmp_path / "text.npy").write_text("no array")
    with pytest.raises(DataError, match="is no NumPy array"):
        open_link_log(tmp_path / "text.npy", NODES, layout="listenx")
    np.save(tmp_path / "holes.npy", np.full((1, 7), np.nan))
    with pytest.raises(DataError, match="no time"):
        list(open_link_log(tmp_path / "holes.npy", NODES, layout="link-channel"))


def test_snapshots_of_a_matrix_and_rows_of_receivers_are_the_same_frames(tmp_path, monkeypatch):
    """One channel, all nodes; what a node hears of itself is not read; with a node that tells nothing for a sweep."""
    size, rng = len(NODES.names), np.random.default_rng(0)
    heard = np.round(rng.normal(-60, 5, (4, size, size)))  # of [sender, receiver]
    links = directed_links_of(size)
    expected = heard[:, links[:, 0], links[:, 1]]
    matrix = "\n".join(",".join([f"{k}", *map(str, frame.ravel())]) for k, frame in enumerate(heard))
    rows = [
        ",".join(
            [NODES.names[rx], *("" if tx == rx else str(heard[k, tx, rx]) for tx in range(size)), f"{k + rx / 100}"]
        )
        for k in range(len(heard))
        for rx in range(size)
    ]
    frames = list(open_link_log(saved(tmp_path, matrix), NODES, layout="matrix"))
    np.testing.assert_array_equal([frame.rss_dbm[:, 0] for frame in frames], expected)
    np.save(tmp_path / "log.npy", np.column_stack([np.arange(4.0), heard.reshape(4, -1)]))
    frames = list(open_link_log(tmp_path / "log.npy", NODES, layout="matrix"))
    np.testing.assert_array_equal([frame.rss_dbm[:, 0] for frame in frames], expected)

    text = "\n".join([*rows[: 2 * size], *rows[2 * size + 1 :]])  # the first node is silent in the third sweep
    expected[2, links[:, 1] == 0] = np.nan
    log = open_link_log(saved(tmp_path, text), NODES, layout="receiver")
    for again in (log, log):
        frames = list(again)
        np.testing.assert_array_equal([frame.rss_dbm[:, 0] for frame in frames], expected)
        np.testing.assert_allclose([frame.time_s for frame in frames], np.arange(4) + (size - 1) / 100)
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(text.encode())))
    assert len(list(open_link_log("-", NODES, layout="receiver"))) == 4


@pytest.mark.parametrize(
    ("text", "layout", "said"),
    [
        ("n9" + ",-50" * len(NODES.names) + ",0\n", "receiver", "is not in the list of nodes"),
        (NODES.names[0] + ",-50" * (len(NODES.names) + 1) + ",0\n", "receiver", "a level of each of the"),
        (NODES.names[0] + ",-50" * len(NODES.names) + ",now\n", "receiver", "column of the time: 'now' is no number"),
        ("0" + ",-50" * len(NODES.names) ** 2 + "\n", "channel-link", "as layout='matrix' it would fit"),
        ("0" + ",-50" * (len(NODES.names) ** 2 - 1) + "\n", "matrix", "pairs of"),
        ("0" + ",55,60,45" * len(NODES.names) ** 2 + "\n", "matrix", "has no reading"),
    ],
)
def test_matrices_and_rows_that_are_wrong_are_refused(tmp_path, text, layout, said):
    with pytest.raises(DataError, match=re.escape(said)):
        list(open_link_log(saved(tmp_path, text), NODES, layout=layout))


def test_a_long_log_takes_no_more_memory_than_a_short_one(tmp_path):
    peaks = []
    for frames in (500, 5000):
        rows = "".join(f"{k},-50,-60\n" for k in range(frames))
        path = saved(tmp_path, "time_s,a-b-1,b-a-1\n" + rows, f"{frames}.csv")
        tracemalloc.start()
        assert sum(1 for _ in open_link_log(path, NODES)) == frames
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.5 * peaks[0]


@pytest.mark.skipif(not DATA.exists(), reason=f"needs the radio log under {DATA}")
def test_the_recorded_log_is_read_as_its_notes_say():
    nodes = read_nodes(DATA / "sensor_coords_basement_m.txt")
    frames = list(open_link_log(DATA / "basement_listenx_out_1.txt", nodes))
    levels = np.array([frame.rss_dbm for frame in frames])
    assert levels.shape == (642, 90, 8)
    assert 0.05 < np.isnan(levels).mean() < 0.07
    assert np.median(np.diff([frame.time_s for frame in frames])) == pytest.approx(0.63, abs=0.01)
    table = np.loadtxt(DATA / "basement_listenx_out_1.txt")
    assert levels[7, 3 * 9 + 5, 6] == table[7, 6 * 90 + 3 * 9 + 5]
