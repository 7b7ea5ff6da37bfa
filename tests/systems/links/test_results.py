"""A log's results written as the frames go: equal to all of them held in memory, bounded, whole or not at all."""

from __future__ import annotations

import csv

import numpy as np
import pytest
import xarray as xr

from elusive.errors import DataError
from elusive.io import read_tracks_csv, write_tracks_csv
from elusive.io.link_logs import open_link_log
from elusive.io.node_files import read_nodes
from elusive.metrics import clear_mot, gospa, identity, sightings, sightings_of
from elusive.systems.links.results import EVENTS_KEPT, LinkRun
from elusive.systems.links.run import track_links_recording
from elusive.systems.links.scores import FRAMES_AT_ONCE
from elusive.systems.links.tables import ROWS_AT_ONCE, LinkDataset, LinkTables, rows_of
from elusive.systems.links.track import LinkTracking
from elusive.tracking.people import Event
from tests.systems.links.link_day import CALIBRATION, NODES, PERIOD, RATE_HZ, results, truth
from tests.walked_room import EMPTY, changed, write_room

FRAMES = 3 * FRAMES_AT_ONCE + 100


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folder of the tables, what the run came to, and each frame's result and rows."""
    folder = tmp_path_factory.mktemp("made")
    run = LinkRun("x/log.csv", NODES, LinkTracking().area_of(NODES), truth(FRAMES / RATE_HZ))
    dataset, held = LinkDataset(folder / "result.nc", "log.csv", "all: 1"), []
    with LinkTables(folder) as tables:
        for frame, result in enumerate(results(FRAMES)):
            rows = rows_of(result)
            tables.append(result, rows)
            dataset.append(rows)
            run.offer(result, rows, calibrating=frame < CALIBRATION)
            held.append((result, rows))
    dataset.flush()
    return folder, run.outcome([]), held


def test_tables_are_those_of_all_rows_at_once(made, tmp_path):
    folder, _, held = made
    write_tracks_csv(tmp_path / "tracks.csv", [row for _, rows in held for row in rows], unit="m")
    assert (folder / "tracks.csv").read_bytes() == (tmp_path / "tracks.csv").read_bytes()
    with (folder / "events.csv").open() as file:
        header, *lines = csv.reader(file)
    assert header == ["time_s", "track", "event", "x_m", "y_m"]
    events = [(result.time_s, event) for result, _ in held for event in result.events]
    assert lines == [
        [f"{at:.3f}", str(one.track), one.what, *(f"{value:.3f}" for value in one.position)] for at, one in events
    ]


def test_the_dataset_is_that_of_all_rows_at_once(made, tmp_path):
    folder, _, held = made
    rows = [row for _, rows in held for row in rows if row.track is not None]
    assert len(rows) > ROWS_AT_ONCE + 1
    whole = xr.Dataset(
        {
            "track": ("row", [row.track for row in rows]),
            "status": ("row", [row.status for row in rows]),
            "existence": ("row", [row.existence for row in rows]),
            "state": (("row", "component"), [row[4:8] for row in rows], {"units": "m, m/s, m, m/s"}),
            "deviation": (("row", "axis"), [row[8:10] for row in rows], {"units": "m"}),
        },
        {"time": ("row", [row.time_s for row in rows], {"units": "s"}), "axis": ["x", "y"]},
        {"title": "log.csv", "config": "all: 1"},
    ).assign_coords(component=["x", "y", "vx", "vy"])  # the order of a row of the table
    found = xr.load_dataset(folder / "result.nc")
    assert found.component.values.tolist() == ["x", "vx", "y", "vy"]
    xr.testing.assert_identical(found.sel(component=["x", "y", "vx", "vy"]), whole)
    again = LinkDataset(tmp_path / "again.nc", "log.csv", "all: 1")
    for _, some in held:
        again.append(some)
    again.flush()
    again.flush()  # nothing more to write
    assert (tmp_path / "again.nc").read_bytes() == (folder / "result.nc").read_bytes()


def test_a_dataset_without_a_track(tmp_path):
    dataset = LinkDataset(tmp_path / "result.nc", "log", "")
    for result in results(CALIBRATION):
        dataset.append(rows_of(result))
    dataset.flush()
    assert xr.load_dataset(tmp_path / "result.nc").sizes == {"row": 0, "component": 4, "axis": 2}


def test_scores_are_those_of_the_whole_log_at_once(made):
    _, outcome, held = made
    places = truth(FRAMES / RATE_HZ).at([result.time_s for result, _ in held])
    places[:CALIBRATION] = np.nan
    true, said = sightings_of(places), dict(outcome.table)
    assert FRAMES_AT_ONCE % PERIOD == 0  # tracks change as a new piece begins
    for words, statuses in (("", {"confirmed"}), (", candidates too", {"confirmed", "candidate"})):
        rows = [(frame, row) for frame, (_, rows) in enumerate(held) for row in rows if row.status in statuses]
        found = sightings(
            [frame for frame, _ in rows], [row.track for _, row in rows], [(row.x, row.y) for _, row in rows]
        )
        mot, agreed = clear_mot(true, found, 2.0, FRAMES), identity(true, found, 2.0)
        assert mot.mismatches.sum() > 5
        assert said[f"MOTA{words}"] == (
            f"{mot.mota:.3f}: {mot.misses.sum()} misses, {mot.false_positives.sum()} false, "
            f"{mot.mismatches.sum()} mismatches of {mot.targets.sum()}"
        )
        assert said[f"Deviation{words}"].startswith(f"{mot.motp:.2f} m mean, {mot.max_deviation:.2f} m greatest")
        far = gospa(true, found, 2.0, 2.0, FRAMES).distance.mean()
        assert said[f"IDF1, GOSPA{words}"] == f"{agreed.idf1:.3f}, {far:.2f} m"


def test_tracks_are_told_as_recounted_from_all_rows(made):
    _, outcome, held = made
    by_track = {}
    for _, rows in held:
        for row in rows:
            if row.status in ("candidate", "confirmed"):
                by_track.setdefault(row.track, []).append(row)
    expected = []
    for number, rows in by_track.items():
        sure = [row for row in rows if row.status == "confirmed"]
        if sure:
            walked = np.hypot(*np.diff([(row.x, row.y) for row in sure], axis=0).T).sum()
            expected.append((
                str(number), f"{rows[0].time_s:.1f}", f"{rows[-1].time_s:.1f}", f"{sure[0].time_s:.1f}",
                f"{walked:.1f}", f"{np.mean([row.existence for row in sure]):.2f}",
            ))  # fmt: skip
    assert outcome.tracks == expected
    said = dict(outcome.table)
    assert said["Frames"] == f"{FRAMES}, of them {CALIBRATION} for calibration; one each 0.25 s"
    assert said["Candidates never confirmed"] == str(len(by_track) - len(expected))
    people = [sum(row.status == "confirmed" for row in rows) for _, rows in held]
    share = 100 * np.mean(np.array(people) > 0)
    assert outcome.verdict == (
        f"At most {max(people)} people at a time, in {len(expected)} tracks; somebody was there in {share:.0f} % of "
        "the frames."
    )
    assert outcome.tracked.people.tolist() == people
    assert outcome.remarks == ("The room was not quite empty.",)


def test_of_very_many_events_the_report_has_the_latest():
    run, frames = LinkRun("log", NODES, LinkTracking().area_of(NODES)), CALIBRATION + 10 + EVENTS_KEPT
    for frame, result in enumerate(results(frames)):
        event = Event(frame, 1 if frame % 2 else 10**6, "near", (0.0, 0.0))  # every second one of nobody confirmed
        run.offer(result._replace(events=(event,)), rows_of(result), calibrating=frame < CALIBRATION)
    tracked = run.outcome([]).tracked
    assert [one.time_s for one in tracked.events] == [frame / RATE_HZ for frame in range(frames - EVENTS_KEPT, frames)]
    assert tracked.unlisted == (CALIBRATION + 10) // 2


def test_a_row_that_contradicts_itself_is_refused(tmp_path):
    *_, result = results(CALIBRATION + 1)
    with LinkTables(tmp_path) as tables:
        tables.append(result, rows_of(result))
        before = len(rows_of(result))
        wrong = result._replace(tracks=[result.tracks[0]._replace(existence=1.5)])
        with pytest.raises(DataError, match=rf"tracks\.csv: row {before + 1} of the tracks has the existence 1\.5"):
            tables.append(wrong, rows_of(wrong))
    assert len(read_tracks_csv(tmp_path / "tracks.csv", unit="m")) == before


def test_a_full_disk_is_told(tmp_path):
    (tmp_path / "tracks.csv").symlink_to("/dev/full")
    *_, result = results(CALIBRATION + 1)
    said = r"cannot be written \(No space left on device\); check space"
    with pytest.raises(DataError, match=said), LinkTables(tmp_path) as tables:  # noqa: PT012
        while True:
            tables.append(result, rows_of(result))


def test_where_nothing_can_be_written(tmp_path):
    (tmp_path / "events.csv").mkdir()
    with pytest.raises(DataError, match="cannot be written"):
        LinkTables(tmp_path)
    dataset = LinkDataset(tmp_path / "nowhere" / "result.nc", "log", "")
    with pytest.raises(DataError, match="there is no folder"):
        dataset.append([])


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    return write_room(tmp_path_factory.mktemp("room"))


def spoilt(lines):
    return [*lines[:-2], "oops" + lines[-2][lines[-2].index(",") :], lines[-1]]


@pytest.mark.parametrize("why", ["interrupted", "spoilt"])
def test_nothing_is_left_of_a_log_that_is_not_tracked_to_its_end(room, tmp_path, why):
    """Neither of a new folder nor in one with an earlier run's files."""
    log = changed(room, tmp_path, spoilt) if why == "spoilt" else room / "log.csv"
    nodes, earlier = read_nodes(room / "nodes.csv"), tmp_path / "earlier"
    earlier.mkdir()
    (earlier / "tracks.csv").write_text("precious")
    done = []

    def on_frame(number):
        done.append(number)
        if why == "interrupted" and number == EMPTY + 12:
            raise KeyboardInterrupt

    for out in (tmp_path / "new", earlier):
        with pytest.raises(KeyboardInterrupt if why == "interrupted" else DataError):
            track_links_recording(
                open_link_log(str(log), nodes), nodes, LinkTracking(calibration_frames=EMPTY), out, on_frame=on_frame
            )
    assert len(done) > 2 * EMPTY + 20
    assert not (tmp_path / "new").exists()
    assert [path.name for path in earlier.iterdir()] == ["tracks.csv"]
    assert (earlier / "tracks.csv").read_text() == "precious"
    assert {path.name for path in tmp_path.iterdir()} <= {"earlier", "changed.csv"}
