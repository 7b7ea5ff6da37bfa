"""A radar's recording from its plots to its report: what it shows of the radar, its tracks, its files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path

from elusive.errors import DataError, ParameterError
from elusive.io import RadarSource, atomic_folder
from elusive.io.ais_reports import in_frame, read_ais_reports
from elusive.io.ship_truth import read_ship_truth
from elusive.results import TrackLog
from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar.ais import AisFusion
from elusive.systems.radar.first_pass import fitted
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.results import RadarOutcome, RadarRun
from elusive.systems.radar.righted import look_through
from elusive.systems.radar.setting import bind_all, charts_in, check_place, frame_of
from elusive.systems.radar.ships import ADDED
from elusive.systems.radar.track import track_radar
from elusive.tracking.reports import Report


def track_radar_recording(
    source: RadarSource,
    parameters: RadarTracking,
    out: Path | None,
    *,
    radar_lon_deg: float | None = None,
    radar_lat_deg: float | None = None,
    charts: Sequence[str | Path] = (),
    truth: str | Path | None = None,
    truth_mmsi: int | None = None,
    cutoff_m: float | None = None,
    ais: str | Path | None = None,
    on_scan: Callable[[int], None] | None = None,
) -> RadarOutcome:
    """Track ships through a recording and write ``tracks.csv``, ``tracks.geojson``, ``result.nc`` and a report.

    ``report.html``, ``report.png`` and ``config.yaml``, which repeats the run, stand beside them. Nothing is left in
    ``out`` if the recording cannot be used.

    Parameters
    ----------
    source
        From :func:`elusive.io.open_radar_plots`. It is read twice, a long one up to eleven times.
    parameters
        What to do.
    out
        Folder for the results; None writes nothing.
    radar_lon_deg, radar_lat_deg
        The origin of places, WGS 84: where the radar stands, if it rests. None: that of the source; where that has
        none, tracks are in metres east and north of the radar alone, without ``tracks.geojson``.
    charts
        S-57 base cells, GeoJSON or shapefiles; without one ships may be anywhere.
    truth
        Where ships truly were, see :func:`~elusive.io.ship_truth.read_ship_truth`; scores only.
    truth_mmsi
        The only ship to read, where that is an AIS log.
    cutoff_m
        Distance up to which a track can stand for a ship, and c of GOSPA; None: 50 m.
    ais
        What ships report, see :func:`~elusive.io.ais_reports.read_ais_reports`; fused with the tracks.
    on_scan
        Called with the number of scans done.

    Raises
    ------
    DataError
        If a chart, a plot or the truth cannot be used, or no plot falls on a chart.
    ParameterError
        If it is told how a chart is used and none is given, the radar's place is needed and not known, or a ship of
        the truth is chosen and there is none.
    """
    if truth is None and (truth_mmsi is not None or cutoff_m is not None):
        name = "truth_mmsi" if truth_mmsi is not None else "cutoff_m"
        raise ParameterError(f"{name}: has no meaning without a truth; give --truth, or leave it out.")
    given = None if radar_lon_deg is None or radar_lat_deg is None else (radar_lon_deg, radar_lat_deg)
    frame = frame_of(source, given, "charts" if charts else "ais" if ais is not None else "")
    around, outline = charts_in(parameters, charts, frame)
    scans, seen = look_through(source, parameters.radar, outline, _looked_through(on_scan, source))
    check_place(source.name, seen, around)
    known = None
    if truth is not None:
        known = read_ship_truth(truth, frame, midnight_unix_s=source.since_1970(), mmsi=truth_mmsi)
    fusion = None
    if ais is not None:
        told = read_ais_reports(ais, source.since_1970())
        assert frame is not None
        near = in_frame(told, frame, str(ais))
        fusion = AisFusion([Report(one.time_s, one.mmsi, place, velocity) for one, place, velocity in near])
    parameters, seen = fitted(parameters, scans, seen, around, outline)
    sensor, tracker, around = bind_all(parameters, seen, around, outline)
    with nullcontext() if out is None else atomic_folder(out) as folder:
        table = None if folder is None else folder / "tracks.csv"
        with TrackLog(tracker.state_names, "m", ADDED, path=table) as log:
            run = RadarRun(parameters, sensor, around, seen, log, fusion)
            try:
                for number, step in enumerate(track_radar(scans, tracker, parameters, around, None, fusion), 1):
                    run.append(step)
                    if on_scan is not None:
                        on_scan(number)
            except DataError as error:
                text = str(error)
                raise DataError(text if text.startswith(source.name) else f"{source.name}: {text}") from None
        outcome = run.outcome(source, known, cutoff_m)
        if folder is not None:
            run.write(folder, outcome, parameters.to_yaml())
    return outcome


def _looked_through(on_scan: Callable[[int], None] | None, scans: Iterable[RadarScan]) -> Iterator[RadarScan]:
    """Yield scans that are only looked through: none is done yet, but a caller may want to stop."""
    for scan in scans:
        if on_scan is not None:
            on_scan(0)
        yield scan
