"""From radar video, before any threshold, to tracks of ships, with charts that are known to be imprecise."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.charts import HardWater, Water
from elusive.charts.charted_area import ChartedArea, lay_charts, read_charts
from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io.atomic import atomic_folder
from elusive.io.radar_video import RadarVideoSource
from elusive.io.ship_truth import read_ship_truth
from elusive.results import TrackLog
from elusive.sensors.radar_video import RadarVideo
from elusive.systems.video.about_tracks import NOTHING
from elusive.systems.video.echoes import sea_deviation
from elusive.systems.video.long_echoes import with_middles
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.results import ADDED, VideoOutcome, VideoRun
from elusive.systems.video.start import VideoStart, start_of
from elusive.systems.video.turns import Heard, heard, turns_of, water_map
from elusive.tracking.evidence_maps import EvidenceState, EvidenceTracker
from elusive.tracking.memory import Memory
from elusive.tracking.track import Step

WET = 0.5  # P(water) from which a cell's clutter is the sea's
UNIX_S = 1e8  # a time from here on counts from 1970


class VideoState(NamedTuple):
    """Belief after a turn, and what it came from."""

    belief: EvidenceState
    heard: Heard


def track_video(
    turns: Iterable[Heard],
    tracker: EvidenceTracker,
    seed: int = 0,
    frame: LocalFrame | None = None,
    memory: Memory | None = None,
) -> Iterator[Step]:
    """Track ships through turns of evidence, lazily; a live stream and a file are the same.

    Parameters
    ----------
    turns
        From :func:`elusive.systems.video.turns.heard`.
    tracker
        What follows them: :meth:`VideoTracking.bind`.
    seed
        Root of all random numbers.
    frame
        What a track's longitude and latitude are known from.
    memory
        Where the state is kept; a full one is gone on from, and the turns that it knows are left out by ``heard``.

    Yields
    ------
    Step
        After each turn; its measurement is the turn's evidence, its state a :class:`VideoState`.
    """
    memory = memory or Memory()
    rng = np.random.default_rng(seed)
    sensor = tracker.sensor
    assert isinstance(sensor, RadarVideo)
    belief, rng, learnt = memory.held or (tracker.init(rng), rng, None)
    about = NOTHING if learnt is None else learnt.about
    for one in turns:
        deviation = sea_deviation(one.turn)
        one = one._replace(turn=with_middles(one.turn, sensor, deviation))
        belief = tracker.step(belief, one.turn.time_s, one.turn, rng)
        about, tracks = about.after(belief.tracks, one.turn, sensor, deviation)
        one = one._replace(learnt=one.learnt._replace(about=about))
        memory.keep(one.turn.time_s, belief, rng, one.learnt)
        if frame is not None and tracks:
            lonlat = frame.to_lonlat(np.array([track.mean[[X, Y]] for track in tracks])).tolist()
            tracks = tuple(
                track._replace(extra={**track.extra, "lon_deg": lon, "lat_deg": lat})
                for track, (lon, lat) in zip(tracks, lonlat, strict=True)
            )
        yield Step(one.turn.time_s, one.turn, VideoState(belief, one), tracks)


class Laid(NamedTuple):
    """What a chart says of a recording's cells."""

    charted: ChartedArea | None
    water: Water | None
    map_at: Callable[[tuple[float, float]], Array] | None  # P(water) of every cell
    open_water: Callable[[tuple[float, float]], NDArray[np.bool_]] | None


def lay(
    start: VideoStart, charts: Sequence[str | Path], parameters: VideoTracking
) -> tuple[EvidenceTracker, Laid]:  # fmt: skip
    """Lay charts under a radar, whose place is known then, and return the tracker.

    Raises
    ------
    DataError
        If a chart cannot be read, or nothing that the radar sees is charted.
    """
    if not charts:
        return parameters.bind(start.sensor, None)[0], Laid(None, None, None, None)
    assert start.frame is not None
    charted = lay_charts(read_charts(*charts), parameters.charted, start.frame)
    known = HardWater().bind(charted.coast).known(start.sensor.places().reshape(-1, 2))
    if not known.any():
        raise DataError(
            f"chart: nothing within {start.sensor.range_m[-1]:.0f} m of longitude {start.frame.lon_deg:g}, latitude "
            f"{start.frame.lat_deg:g} is charted; check the radar's place and the charts."
        )
    tracker, water = parameters.bind(start.sensor, charted.coast)
    assert water is not None
    map_at = water_map(start.sensor, water.probability)
    return tracker, Laid(charted, water, map_at, lambda place: map_at(place) >= WET)


def track_video_recording(
    source: RadarVideoSource,
    parameters: VideoTracking,
    out: Path | None,
    *,
    radar_lon_deg: float | None = None,
    radar_lat_deg: float | None = None,
    charts: Sequence[str | Path] = (),
    truth: str | Path | None = None,
    ais: Path | None = None,
    cutoff_m: float | None = None,
    needs_place: str = "",
    on_start: Callable[[str], None] = lambda sentence: None,
    on_turn: Callable[[int], None] | None = None,
) -> VideoOutcome:
    """Track ships through a recording and write ``tracks.csv``, ``resting.csv``, ``result.nc`` and a report.

    ``tracks.geojson`` (where the radar's place is known), ``report.html``, ``report.png``, ``checks.json`` and
    ``config.yaml``, which repeats the run, stand beside them. Nothing is left in ``out`` if the recording cannot be
    used. A file's spokes stream: what is held is a turn's cells, and those of the turns that clutter is learnt from.

    Parameters
    ----------
    source
        From :func:`elusive.io.radar_video.open_radar_video`.
    parameters
        What to do.
    out
        Folder for the results; None writes nothing.
    radar_lon_deg, radar_lat_deg
        The radar's place, WGS 84; None: that of the recording, which may move.
    charts
        S-57 base cells, GeoJSON or shapefiles.
    truth
        Where ships truly were, see :func:`~elusive.io.ship_truth.read_ship_truth`; scores only.
    ais
        What ships report, see :func:`~elusive.io.ais_reports.read_ais_reports`, to hold against the tracks; None: what
        a capture holds itself.
    cutoff_m
        Distance up to which a track can stand for a ship, and c of GOSPA; None: 100 m.
    needs_place
        What else needs to know where the radar is, if anything, for the sentence that it does not.
    on_start
        Called with a sentence on the memory that is needed, before it is taken.
    on_turn
        Called with the number of turns done.

    Raises
    ------
    DataError
        If the recording, a chart or the truth cannot be used.
    ParameterError
        If the parameters do not fit the recording.
    """
    start = start_of(source, parameters, radar_lon_deg, radar_lat_deg, needs_place or ("chart" if charts else ""))
    on_start(start.sentence)
    tracker, laid = lay(start, charts, parameters)
    counts: Counter[str] = Counter()
    moves = radar_lon_deg is None
    turns = turns_of(source, start, parameters.azimuth_bias_deg, counts, moves=moves)
    steps = track_video(
        heard(turns, parameters.clutter, parameters.learning_turns, laid.open_water, on_turn), tracker,
        parameters.seed, start.frame,
    )  # fmt: skip
    with nullcontext() if out is None else atomic_folder(out) as folder:
        added = ADDED if start.frame is not None else ADDED[:-2]
        with TrackLog(
            tracker.state_names, "m", added=added, path=None if folder is None else folder / "tracks.csv"
        ) as log:
            run = VideoRun(parameters, start, laid.charted, laid.water, log)
            for step in steps:
                run.append(step)
            known = None
            if truth is not None:
                epoch = 0.0 if float(log.times_s[0]) > UNIX_S else float("nan")
                known = read_ship_truth(truth, start.frame, midnight_unix_s=epoch)
            outcome = run.outcome(source, counts, known, cutoff_m, laid.map_at, ais)
        if folder is not None:
            run.write(folder, outcome, parameters.to_yaml())
    return outcome
