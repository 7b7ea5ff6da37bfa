"""A log's results written as the frames go: equal to all of them held in memory, bounded, whole or not at all."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io.link_logs import open_link_log
from elusive.io.placed_files import read_nodes
from elusive.results import read_tracks_csv, score
from elusive.systems.links import results
from elusive.systems.links.results import EVENTS_KEPT, LinkRun
from elusive.systems.links.run import track_links_recording
from elusive.systems.links.track import LinkTracking
from elusive.tracking.people import TrackEvent
from tests.systems.links.link_day import CALIBRATION, NODES, RATE_HZ, REMARKS, step_of, steps, truth
from tests.walked_room import EMPTY, changed, write_room

FRAMES = 2100


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folder of the tables, what the run came to, and each frame's step."""
    folder = tmp_path_factory.mktemp("made")
    held = list(steps(FRAMES))
    with LinkRun("x/log.csv", NODES, LinkTracking(), truth(FRAMES / RATE_HZ), folder) as run:
        for step in held:
            run.append(step)
    return folder, run, run.outcome(), held


def test_tables_are_those_of_all_steps(made):
    folder, run, _, held = made
    assert (folder / "tracks.csv").read_text() == run.log.csv_text()
    assert len(read_tracks_csv(folder / "tracks.csv").rows) == sum(len(step.tracks) for step in held)
    with (folder / "events.csv").open() as file:
        header, *lines = csv.reader(file)
    assert header == ["time_s", "track", "event", "x_m", "y_m"]
    events = [event for step in held for event in step.state.events]
    assert [(float(t), int(n), what, (float(x), float(y))) for t, n, what, x, y in lines] == events
    assert run.events_text() == (folder / "events.csv").read_text()


def test_scores_leave_out_the_calibration(made):
    _, run, outcome, held = made
    places = truth(FRAMES / RATE_HZ).at([step.time_s for step in held])
    places[:CALIBRATION] = np.nan
    said = dict(outcome.tracked.rows)
    found, more = (score(run.log, places, 2.0, statuses) for statuses in (["confirmed"], ["confirmed", "candidate"]))
    assert found.mismatches > 1
    assert said["MOTA"].startswith(f"{found.mota:.3f}: {found.misses} misses")
    assert said["With candidates"].startswith(f"MOTA {more.mota:.3f}, IDF1 {more.identity.idf1:.3f}, GOSPA")


def test_tracks_are_told_as_recounted_from_all_steps(made):
    _, _, outcome, held = made
    by_track = {}
    for step in held:
        for one in step.tracks:
            if one.status != "deleted":
                by_track.setdefault(one.track, []).append((step.time_s, one))
    expected = []
    for number, rows in by_track.items():
        sure = [(time_s, one) for time_s, one in rows if one.status == "confirmed"]
        if sure:
            walked = np.hypot(*np.diff([one.mean[[0, 2]] for _, one in sure], axis=0).T).sum()
            expected.append((
                str(number), f"{rows[0][0]:.1f}", f"{rows[-1][0]:.1f}", f"{sure[0][0]:.1f}", f"{walked:.1f}",
                f"{np.mean([one.existence for _, one in sure]):.2f}",
            ))  # fmt: skip
    assert outcome.tracked.tracks == expected
    said = dict(outcome.tracked.rows)
    assert said["Frames"] == f"{FRAMES}, of them {CALIBRATION} for calibration; one each 0.25 s"
    assert said["Candidates never confirmed"] == str(len(by_track) - len(expected))
    people = [sum(one.status == "confirmed" for one in step.tracks) for step in held]
    share = 100 * np.mean(np.array(people) > 0)
    assert outcome.verdict == (
        f"At most {max(people)} people at a time, in {len(expected)} tracks; somebody was there in {share:.0f} % of "
        "the frames."
    )
    assert outcome.tracked.people.tolist() == people
    assert outcome.remarks == REMARKS


def test_a_long_log_is_thinned_for_the_report(made, monkeypatch):
    _, run, whole, _ = made
    monkeypatch.setattr(results, "FRAMES_AT_MOST", 600)
    thin = run.outcome().tracked
    np.testing.assert_array_equal(thin.times_s, whole.tracked.times_s[::4])
    assert thin.calibrated == CALIBRATION / 4
    for path, full in zip(thin.paths, whole.tracked.paths, strict=True):
        kept = full.frames % 4 == 0
        np.testing.assert_array_equal(path.frames, full.frames[kept] // 4)
        np.testing.assert_array_equal(path.places, full.places[kept])


def test_of_very_many_events_the_report_has_the_latest(made):
    *_, held = made
    with LinkRun("log", NODES, LinkTracking()) as run:
        for step in [*held[:CALIBRATION], *held[CALIBRATION + 40 : CALIBRATION + 60]]:
            run.append(step)
        last, cloud = step.time_s, np.zeros((1, 4))
        for frame in range(EVENTS_KEPT + 10):
            event = TrackEvent(last + frame, 1 if frame % 2 else 10**6, "near", (0.0, 0.0))  # of nobody confirmed
            run.append(step_of(last + frame, [], [event], cloud))
        tracked = run.outcome().tracked
    assert [one.time_s for one in tracked.events] == [last + frame for frame in range(10, EVENTS_KEPT + 10)]
    assert tracked.unlisted == 10 + sum(len(step.state.events) for step in held[CALIBRATION + 40 : CALIBRATION + 60])


def test_where_nothing_can_be_written(tmp_path):
    (tmp_path / "events.csv").mkdir()
    with pytest.raises(DataError, match="cannot be written"):
        LinkRun("log", NODES, LinkTracking(), folder=tmp_path)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "tracks.csv").symlink_to("/dev/full")
    *_, step = steps(CALIBRATION + 1)
    said = r"cannot be written \(No space left on device\); check space"
    run = LinkRun("log", NODES, LinkTracking(), folder=tmp_path / "full")
    with pytest.raises(DataError, match=said), run:  # noqa: PT012
        while True:
            run.append(step)


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
                open_link_log(str(log), nodes), nodes, LinkTracking(calibration_frames=EMPTY, fit_frames=0), out,
                on_frame=on_frame,
            )  # fmt: skip
    assert len(done) > 2 * EMPTY + 20
    assert not (tmp_path / "new").exists()
    assert [path.name for path in earlier.iterdir()] == ["tracks.csv"]
    assert (earlier / "tracks.csv").read_text() == "precious"
    assert {path.name for path in tmp_path.iterdir()} <= {"earlier", "changed.csv"}
