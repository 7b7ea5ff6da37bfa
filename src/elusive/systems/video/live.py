"""Radar video as it comes, tracked live: each turn's rows stand in the file before the next is taken."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import chain
from pathlib import Path

from elusive.checks.files import write_checks
from elusive.io.arrivals import Coming
from elusive.results import TrackLog
from elusive.results.live import LiveEnd, LiveStep, finished, follow_live, live_folder
from elusive.sensors.echo_extent import first_turn
from elusive.sensors.spokes import Spokes
from elusive.systems.video.checks import Judged
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.resting import resting_of, write_resting
from elusive.systems.video.results import ADDED
from elusive.systems.video.start import VideoStart, start_of
from elusive.systems.video.track import lay, track_video
from elusive.systems.video.turns import heard, turns_of
from elusive.tracking.memory import Memory
from elusive.tracking.track import Step

LIVE_FILES = ("tracks.csv", "resting.csv", "checks.json", "config.yaml")


def follow_video(
    coming: Coming[Spokes],
    parameters: VideoTracking,
    out: Path,
    on_step: Callable[[LiveStep], None],
    *,
    radar_lon_deg: float | None = None,
    radar_lat_deg: float | None = None,
    charts: Sequence[str | Path] = (),
    needs_place: str = "",
    memory: Memory | None = None,
) -> LiveEnd:
    """Track ships while a radar's video comes: a turn's rows stand in the file before the next is taken.

    The first turns are waited for, from which clutter is learnt; they are tracked in then. It ends, and ``video.scale``
    says so, where the radar's range scale changes for good.

    Parameters
    ----------
    coming
        :class:`~elusive.io.arrivals.Arrivals` of :func:`~elusive.io.radar_video.open_radar_video`.
    parameters
        What to do.
    out
        Folder for LIVE_FILES; what lies still and what was checked are written when the source has ended.
    on_step
        Called after each turn.
    radar_lon_deg, radar_lat_deg, charts, needs_place
        As :func:`~elusive.systems.video.track.track_video_recording` takes them.
    memory
        Where the tracker, and what is known of clutter, are kept; a full one is gone on from.

    Returns
    -------
    LiveEnd
        How it ended, and what was checked.

    Raises
    ------
    DataError
        If a chart or the first turns cannot be used, or the folder holds an earlier run's tracks.
    ParameterError
        If the parameters do not fit what comes.
    """
    spokes, memory = iter(coming), memory or Memory()
    first = first_turn(spokes) if memory.held is None else []
    start: VideoStart = memory.first
    if memory.held is None:
        start = start_of(first, parameters, radar_lon_deg, radar_lat_deg, needs_place or ("chart" if charts else ""))
        memory.first = start
    tracker, laid = lay(start, charts, parameters)
    counts, judged = Counter[str](), Judged(start.sensor)
    turns = turns_of(
        chain(first, spokes), start, parameters.azimuth_bias_deg, counts, moves=radar_lon_deg is None,
        live=True,
    )  # fmt: skip
    last: Step | None = None

    def steps() -> Iterator[Step]:
        nonlocal last
        tracked = heard(turns, parameters.clutter, parameters.learning_turns, laid.open_water, memory=memory)
        for last in track_video(tracked, tracker, parameters.seed, start.frame, memory):
            judged.add(last.state.heard, last.tracks)
            yield last

    with (
        live_folder(out, parameters.to_yaml()) as folder,
        TrackLog(
            tracker.state_names, "m", ADDED if start.frame is not None else ADDED[:-2], path=folder / "tracks.csv",
            live=True, keeps=False,
        ) as log,
    ):  # fmt: skip
        end = follow_live(steps(), coming, log, on_step)
        if last is None:  # gone on with, and nothing came
            return finished(end, log)
        place = last.measurement.place
        water = None if laid.map_at is None else laid.map_at(place)
        findings = judged.findings(counts, start, laid.water, parameters)[1]
        resting = resting_of(start.sensor, last.state.heard.clutter, water, place)
        return finished(
            end._replace(findings=findings), log, partial(write_resting, folder / "resting.csv", resting),
            partial(write_checks, folder, findings),
        )  # fmt: skip
