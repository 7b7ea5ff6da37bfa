"""A log of tracks: exact columns, files that read back, memory that does not grow, contradictions refused."""

import errno
import math
import os

import numpy as np
import pytest

from elusive.errors import DataError, ParameterError
from elusive.io import added_file
from elusive.results import TrackLog, read_tracks_csv, write_tracks_csv
from elusive.results.spool import Spool
from elusive.tracking import Step, Track

FLAT = ("x", "vx", "y", "vy")
HEAD = "time_s,track,status,existence,x_{u},y_{u},vx_{u}ps,vy_{u}ps,sd_x_{u},sd_y_{u},correlation_xy"
UNKNOWN = np.full((4, 4), np.nan)


def track(number=1, mean=(10.5, 1.0, 20.25, -1.0), covariance=UNKNOWN, status="confirmed", existence=0.875, **rest):
    return Track(number, status, existence, np.array(mean), covariance, **rest)


def correlated():
    covariance = np.diag([4.0, 1.0, 9.0, 1.0])
    covariance[0, 2] = covariance[2, 0] = 3.0
    return covariance


def log_of(*steps, names=FLAT, unit="px", **arguments):
    log = TrackLog(names, unit, **arguments)
    for time_s, *tracks in steps:
        log.append(Step(time_s, None, None, tuple(tracks)))
    return log


@pytest.mark.parametrize("unit", ["px", "m"])
def test_the_text_is_exactly_this(tmp_path, unit):
    with TrackLog(FLAT, unit, ("score", "intensity_db"), path=tmp_path / "tracks.csv") as log:
        log.append(Step(0.0, None, None, ()))  # a time without a track has no row
        log.append(Step(0.04, None, None, (track(covariance=correlated(), extra={"intensity_db": 3.5}),)))
        log.append(Step(0.08, None, None, (track(2, status="deleted", existence=math.nan, score=-4.5),)))
    assert (tmp_path / "tracks.csv").read_bytes().decode() == (
        f"{HEAD.format(u=unit).replace('mps', 'mps')},score,intensity_db\n"
        "0.04,1,confirmed,0.875,10.5,20.25,1.0,-1.0,2.0,3.0,0.5,,3.5\n"
        "0.08,2,deleted,,10.5,20.25,1.0,-1.0,,,,-4.5,\n"
    )
    assert log.csv_text() == (tmp_path / "tracks.csv").read_text()
    np.testing.assert_array_equal(log.times_s, [0.0, 0.04, 0.08])
    np.testing.assert_array_equal(log.rows["step"], [1, 2])


def test_a_line_has_no_y_and_a_space_has_its_heights_last():
    line = log_of((0.0, track(mean=(3.0, 0.5), covariance=np.eye(2))), names=("x", "vx"), unit="samples")
    assert line.csv_text() == (
        "time_s,track,status,existence,x_samples,vx_samplesps,sd_x_samples\n0.0,1,confirmed,0.875,3.0,0.5,1.0\n"
    )
    solid = TrackLog(("x", "vx", "y", "vy", "z", "vz", "bias"), "m", ("turn_radps",))
    assert ",".join(solid.columns.names) == HEAD.format(u="m") + ",z_m,vz_mps,sd_z_m,turn_radps"
    solid.append(Step(0.0, None, None, (track(mean=np.arange(7.0), covariance=np.diag(np.arange(7.0) ** 2)),)))
    assert solid.csv_text().splitlines()[1] == "0.0,1,confirmed,0.875,0.0,2.0,1.0,3.0,0.0,2.0,,4.0,5.0,4.0,"


def test_an_empty_log_is_a_head(tmp_path):
    with TrackLog(FLAT, "px", path=tmp_path / "t.csv") as log:
        pass
    assert (tmp_path / "t.csv").read_text() == HEAD.format(u="px") + "\n"
    assert len(log.rows) == len(log.steps) == len(log.by_track().numbers) == len(list(log.by_track())) == 0
    read = read_tracks_csv(tmp_path / "t.csv")
    assert len(read.steps) == 0
    assert read.columns == log.columns


@pytest.mark.parametrize(
    ("names", "unit", "added"),
    [
        (("x", "vx"), "samples", ("score",)),
        (FLAT, "px", ()),
        (("x", "vx", "y", "vy", "z", "vz"), "m", ("a_m", "lon_deg")),
    ],
)
def test_a_table_reads_back(tmp_path, names, unit, added):
    rng = np.random.default_rng(3)
    log = TrackLog(names, unit, added)
    for step in range(40):
        tracks = []
        for number in rng.permutation(5)[: rng.integers(4)] + 1:
            root = rng.normal(size=(len(names), len(names)))
            known = root @ root.T if rng.random() < 0.7 else np.full((len(names), len(names)), np.nan)
            extra = {name: rng.normal() for name in added if name != "score"}
            status = ("candidate", "confirmed", "deleted")[rng.integers(3)]
            tracks.append(Track(number, status, rng.random(), rng.normal(size=len(names)), known, rng.normal(), extra))
        log.append(Step(0.1 * step, None, None, tuple(tracks)))
    write_tracks_csv(tmp_path / "t.csv", log)
    read = read_tracks_csv(tmp_path / "t.csv")
    assert read.columns == log.columns
    for name in ("time_s", "track", "status", "existence", "position", "velocity", "added"):
        np.testing.assert_array_equal(read.rows[name], log.rows[name], err_msg=name)
    plane = (slice(None), slice(2), slice(2))  # heights have a deviation alone
    np.testing.assert_allclose(read.rows["covariance"][plane], log.rows["covariance"][plane], rtol=1e-12)


def test_memory_does_not_grow_with_the_steps(tmp_path):
    """Counted in records, not timed: what stands in memory is what one block holds."""
    spool = Spool(np.dtype([("track", np.int64), ("value", np.float64)]), tmp_path, at_once=16)
    rng = np.random.default_rng(1)
    everything = np.zeros(200_000, spool.dtype)
    everything["track"], everything["value"] = np.cumsum(rng.random(200_000) < 0.001) * rng.integers(1, 3, 200_000), 7
    everything["value"] = np.arange(200_000)
    for part in np.array_split(everything, 999):
        spool.extend(part)
        assert spool._newest.nbytes == 16 * spool.dtype.itemsize
    assert len(spool) == 200_000
    assert isinstance(spool.records(), np.memmap)
    np.testing.assert_array_equal(spool.records(), everything)
    spool.extend(everything[:3])  # what comes after it was looked at is kept too
    assert len(spool.records()) == 200_003
    numbers, sizes = np.unique(spool.records()["track"], return_counts=True)
    ordered = spool.sorted_by("track", numbers, sizes)
    assert isinstance(ordered, np.memmap)
    together = np.concatenate([everything, everything[:3]])
    np.testing.assert_array_equal(ordered, together[np.argsort(together["track"], kind="stable")])
    assert list(tmp_path.iterdir()) == []  # the files have no name: nothing is left behind


def test_a_log_in_a_file_is_the_log_in_memory(tmp_path):
    short = TrackLog(FLAT, "px")
    with TrackLog(FLAT, "px", path=tmp_path / "a.csv") as long:
        fill(long, short, tmp_path)
    assert (tmp_path / "a.csv").read_text() == short.csv_text() == long.csv_text()
    for (number, rows), (same, others) in zip(long.by_track(), short.by_track(), strict=True):
        assert number == same
        np.testing.assert_array_equal(rows["position"], others["position"])
    assert dict(short.by_track())[3]["time_s"].tolist() == [41, 42, 43, 45, 46, 47, 49]


def fill(long, short, tmp_path):
    long._rows, long._steps = (Spool(one.dtype, tmp_path, 8) for one in (long._rows, long._steps))
    for k in range(50):
        step = Step(float(k), None, None, tuple(track(n, mean=(k, 1.0, n, 0.0)) for n in (1 + k // 20, 7) if k % 4))
        long.append(step)
        short.append(step)


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"number": 0}, "its number is below 1"),
        ({"existence": 1.5}, "has the existence 1.5; a probability is from 0 to 1"),
        ({"mean": (1.0, 2.0)}, r"has a mean of shape \(2,\)"),
        ({"mean": (1, 0, np.nan, 0)}, "has no finite place"),
        ({"mean": (1.0, np.inf, 0, 0)}, "has no finite place"),
        ({"covariance": -np.eye(4)}, "has a negative variance"),
        ({"extra": {"depth_m": 1.0}}, "has depth_m, which the log was not told of"),
    ],
)
def test_a_track_that_contradicts_itself_is_refused(wrong, sentence):
    with pytest.raises(DataError, match=f"at 2 s: {sentence}"):
        log_of((2.0, track(**wrong)))


def test_time_that_runs_backwards_and_numbers_that_are_twice_are_refused():
    with pytest.raises(DataError, match=r"tracks at 1\.0 s: come after those at 2 s"):
        log_of((2.0,), (1.0,))
    with pytest.raises(DataError, match="a number is there twice"):
        log_of((2.0, track(1), track(1)))
    with pytest.raises(DataError, match="tracks at nan s"):
        log_of((math.nan,))


@pytest.mark.parametrize(("names", "unit"), [(FLAT, "ft"), (("y", "vy"), "m")])
def test_what_makes_no_table_is_refused(names, unit):
    with pytest.raises(ParameterError):
        TrackLog(names, unit)


ROW = "0.5,1,confirmed,0.9,1,2,3,4,5,6,0"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "line 1: the columns are 'missing'; tracks have time_s,"),
        ("a,b\n", "line 1: the columns are 'a,b'; tracks have time_s,"),
        ("{head}\n0,1\n", "line 2: has 2 cells for 11 columns"),
        ("{head}\n{row}\n" + ROW.replace("0.9", "high") + "\n", "line 3, column existence: 'high' is no number"),
        (
            "{head}\n" + ROW.replace("confirmed", "sure") + "\n",
            "line 2: needs a finite time_s, .* candidate, confirmed, deleted",
        ),
        ("{head}\n" + ROW.replace("0.5,1,", "0.5,-1,") + "\n", "line 2: needs a finite time_s"),
        ("{head}\n" + ROW.replace("0.9", "1.9") + "\n", "has the existence 1.9"),
        ('{head}\n"\n', "is not CSV"),
    ],
)
def test_a_spoilt_table_is_refused_with_its_line(tmp_path, text, sentence):
    (tmp_path / "t.csv").write_text(text.format(head=HEAD.format(u="m"), row=ROW))
    with pytest.raises(DataError, match=sentence):
        read_tracks_csv(tmp_path / "t.csv")


@pytest.mark.parametrize("cut", [1, 3, len(ROW) - 1, len(ROW)])
def test_a_line_that_was_being_written_when_the_run_was_killed_is_left_out(tmp_path, cut):
    (tmp_path / "t.csv").write_text(f"{HEAD.format(u='m')}\n{ROW}\n1{ROW[:cut]}")
    assert read_tracks_csv(tmp_path / "t.csv").rows["time_s"].tolist() == [0.5]


def test_what_cannot_be_written_is_said(tmp_path):
    with pytest.raises(DataError, match="cannot be written"):
        TrackLog(FLAT, "px", path=tmp_path / "no" / "t.csv")


def test_a_log_on_a_full_disk_says_so(tmp_path):
    (tmp_path / "tracks.csv").symlink_to("/dev/full")
    with pytest.raises(DataError, match=r"tracks\.csv: cannot be written \(No space left on device\)"):  # noqa: PT012, SIM117
        with TrackLog(FLAT, "px", path=tmp_path / "tracks.csv") as log:
            log.append(Step(0.0, None, None, (track(),)))
            with pytest.raises(DataError, match="No space left"):
                log.flush()


def test_a_live_log_goes_on_while_the_disk_is_full(tmp_path, monkeypatch):
    """Its file holds all in the end; what could not be kept beside it is left out as whole steps, and said."""
    full = []
    write, make_room = os.write, Spool.make_room

    def writing(descriptor, octets):
        if full:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(descriptor, octets)

    def room(spool, count):
        if full:
            raise DataError("tracks: cannot be kept (No space left on device); check space on the disk.")
        make_room(spool, count)

    monkeypatch.setattr(os, "write", writing)
    monkeypatch.setattr(Spool, "make_room", room)
    monkeypatch.setattr(added_file, "AGAIN_S", 0.0)
    said = []
    with TrackLog(FLAT, "px", path=tmp_path / "t.csv", live=True) as log:
        for k in range(9):
            full[:] = [1] if 3 <= k < 6 else []
            log.append(Step(float(k), None, None, (track(),)))
            log.flush()
            said.append(len(log.said()))
    assert said == [0, 0, 0, 2, 0, 0, 2, 0, 0]
    rows = (tmp_path / "t.csv").read_text().splitlines()[1:]
    assert [row.split(",")[0] for row in rows] == [f"{k}.0" for k in range(9)]
    assert log.times_s.tolist() == [0, 1, 2, 6, 7, 8]
    assert log.rows["step"].tolist() == [0, 1, 2, 3, 4, 5]


def test_a_live_log_may_keep_nothing_beside_its_file(tmp_path):
    with TrackLog(FLAT, "px", path=tmp_path / "t.csv", live=True, keeps=False) as log:
        log.append(Step(0.0, None, None, (track(),)))
        assert len(log.latest) == 1
    assert len(log.rows) == len(log.steps) == 0
    assert len((tmp_path / "t.csv").read_text().splitlines()) == 2


def test_a_spool_whose_disk_was_full_in_the_middle_of_a_write_is_whole(tmp_path):
    spool = Spool(np.dtype([("track", np.int64)]), tmp_path, at_once=4)
    everything = np.arange(40, dtype=np.int64).view(spool.dtype)
    for k in range(len(everything)):
        spool.extend(everything[k : k + 1])
        if k == 20:
            spool._file.seek(0, 2)
            spool._file.write(b"a part")  # before the system refused the rest
    np.testing.assert_array_equal(spool.records()["track"], everything["track"])
