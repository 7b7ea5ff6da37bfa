"""A radar's plots as they come, tracked live: each scan's rows stand in the file before the next is taken."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import chain, islice
from pathlib import Path

from elusive.checks import write_checks
from elusive.errors import DataError, ParameterError
from elusive.geometry.local_frame import LocalFrame
from elusive.io.ais_reports import GrowingReports
from elusive.io.arrivals import Coming
from elusive.results import TrackLog
from elusive.results.live import LiveEnd, LiveStep, finished, follow_live, live_folder
from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar.ais import AisFusion
from elusive.systems.radar.checks import findings_of, in_view, innovation, plot_errors
from elusive.systems.radar.ground import ground_finding
from elusive.systems.radar.kept import ConstraintsKept
from elusive.systems.radar.learnt import LOOK, TELLING, Learnt
from elusive.systems.radar.lives import lasting_finding
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.setting import bind_all, charts_in, check_place
from elusive.systems.radar.ships import ADDED
from elusive.systems.radar.survey import survey
from elusive.systems.radar.track import track_radar
from elusive.systems.radar.turned import Turns
from elusive.systems.radar.wakes import wakes_finding
from elusive.tracking.detections import DetectionTracker
from elusive.tracking.memory import Memory
from elusive.tracking.reports import Report
from elusive.tracking.track import Step

DOPPLER_MPS = 40.0  # of ships, where none is given
LATEST = 2000  # innovations by which a run is checked
LIVE_FILES = ("tracks.csv", "checks.json", "config.yaml")


def follow_radar(
    coming: Coming[RadarScan],
    parameters: RadarTracking,
    out: Path,
    frame: LocalFrame | None,
    on_step: Callable[[LiveStep], None],
    *,
    charts: Sequence[str | Path] = (),
    ais: GrowingReports | None = None,
    memory: Memory | None = None,
) -> LiveEnd:
    """Track ships while their plots come: a scan's rows stand in the file before the next is taken.

    A scan is complete when a later plot comes. The first ten scans are waited for where something of the radar is not
    told, which is found in them and learnt from then on, where it is not told whether ships are hulls, and with a
    chart, of which they show the land in view; ten more where too few plots follow each other in them to show a
    radar's errors, and forty in all where plots come in bunches: ships leave a place, and surf or rain stay. From where
    headings are known to be late on, each scan is waited for until those are told that its ship had.

    Parameters
    ----------
    coming
        :class:`~elusive.io.arrivals.Arrivals` of :func:`~elusive.io.radar_plots.follow_radar_plots`.
    parameters
        What to do; the greatest range must be given.
    out
        Folder for LIVE_FILES.
    frame
        Its origin is that of places; None, without charts: they are metres from the radar alone.
    on_step
        Called after each scan.
    charts
        As :func:`~elusive.systems.radar.track.track_radar_recording` takes them.
    ais
        What ships report meanwhile, fused with the tracks.
    memory
        Where the tracker keeps its state; the names that ships reported are learned anew.

    Returns
    -------
    LiveEnd
        How it ended, and what was checked, of the latest innovations.

    Raises
    ------
    ParameterError
        If no greatest range is given, or it is told how a chart is used and there is none.
    DataError
        If a chart or the first scans cannot be used, or the folder holds an earlier run's tracks.
    """
    if parameters.radar.max_range_m is None:
        raise ParameterError("max_range_m: a live run cannot look at all plots first; give --max-range-m.")
    around, outline = charts_in(parameters, charts, frame)
    memory = memory or Memory()
    heard, begins = memory.new(coming), memory.held is None
    radar = parameters.radar
    looked = charts or radar.untold or radar.unplaced or parameters.extent is None
    first = list(islice(heard, LOOK if looked else 1)) if begins else []
    if begins and not first:
        raise DataError("no scan came.")
    if begins:
        seen = survey(first, outline)
        if seen.errors is None and {"range_sd_m", "bearing_sd_mrad"} & set(radar.untold):
            first += islice(heard, LOOK)
            seen = survey(first, outline)
        if seen.hulls and parameters.extent is None and radar.false_alarm_patches is None:
            first += islice(heard, TELLING - len(first))
            seen = survey(first, outline)
        seen = seen._replace(max_doppler_mps=max(DOPPLER_MPS, seen.max_doppler_mps))
        check_place("live", seen, around)
        memory.first = Learnt(parameters, first, seen, around, outline)
    known: Learnt = memory.first
    sensor, tracker, around = bind_all(known.parameters, known.seen, around, outline)
    innovations, kept, turns = deque[float](maxlen=LATEST), ConstraintsKept(), Turns(sensor)

    def reported() -> list[Report]:
        assert ais is not None
        return [Report(one.time_s, one.mmsi, place, velocity) for one, place, velocity in ais.since()]

    fusion = None if ais is None else AisFusion(more=reported)

    def learn(step: Step) -> tuple[DetectionTracker, RadarTracking]:
        nonlocal sensor, tracker
        if known.add(step, sensor, around.water):
            sensor, tracker, _ = bind_all(known.parameters, known.seen, around, outline)
        return tracker, known.parameters

    def steps() -> Iterator[Step]:
        coming_right = known.headings.righted(chain(first, heard), lambda: plot_errors(known.seen, sensor))
        for step in track_radar(coming_right, tracker, known.parameters, around, memory, fusion, learn):
            turns.add(step.measurement)
            beliefs = {target.life.track: target for target in step.state.belief.targets}
            sure = [beliefs[track.track] for track in step.tracks if track.status == "confirmed"]
            seen_now = [target for target in sure if in_view(target, step.measurement, sensor)]
            innovations.extend(innovation(target, step.measurement, sensor) for target in seen_now)
            there = {track.track for track in step.tracks}
            kept.add({target.life.track or 0: target.allowed for target in sure}, there)
            yield step

    with (
        live_folder(out, parameters.to_yaml()) as folder,
        TrackLog(tracker.state_names, "m", ADDED, path=folder / "tracks.csv", live=True, keeps=False) as log,
    ):
        end = follow_live(steps(), coming, log, on_step)
        seen = known.headings.seen(known.seen, *plot_errors(known.seen, sensor))
        findings = findings_of(seen, sensor, around.water, innovations, known.counts.bunches)
        findings += (known.counts.finding(sensor, around.water, known.seen.way[:, 1:]),)
        findings += (turns.finding,)
        told = known.parameters.radar
        findings += lasting_finding(told.false_alarm_lives or ()), wakes_finding(told.false_alarm_wakes or ())
        findings += (ground_finding(told.false_alarm_ground or ()),)
        findings += (kept.finding(),) if parameters.constraints else ()
        findings += () if fusion is None else (fusion.finding(),)
        return finished(end._replace(findings=findings), log, partial(write_checks, folder, findings))
