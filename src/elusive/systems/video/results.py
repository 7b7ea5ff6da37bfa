"""What tracking radar video came to: tracks, what lies still, findings, and what a report shows."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from elusive.charts import Water
from elusive.charts.charted_area import ChartedArea
from elusive.checks import Finding
from elusive.contracts import Array
from elusive.io.radar_video import RadarVideoSource
from elusive.io.truth import Truth
from elusive.results import CONFIRMED, Scored, TrackLog, scored, write_geojson, write_recording
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.systems.video.ais import compare_ais, reports_beside
from elusive.systems.video.checks import Judged
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.report import Shown, VideoPath, VideoTracked, video_report
from elusive.systems.video.resting import Resting, resting_of, write_resting
from elusive.systems.video.start import VideoStart
from elusive.tracking.track import Step

FILES = ("tracks.csv", "resting.csv", "result.nc", "report.html", "report.png", "checks.json", "config.yaml")
LOCATED = "tracks.geojson"  # among them where the radar's place is known
ADDED = ("moves", "allowed", "level_db", "lon_deg", "lat_deg")
CUTOFF_M = 100.0
SHOWN = 60  # turns that a report plays
SIDE, ROWS, COLUMNS = 240, 180, 200  # of its pictures
STEPS_DB = 6  # shades of a decibel


class VideoOutcome(NamedTuple):
    """What a run came to."""

    log: TrackLog
    tracked: VideoTracked
    resting: tuple[Resting, ...]
    scored: Scored | None
    findings: tuple[Finding, ...]


class VideoRun:
    """Takes the steps of a recording and writes what they came to.

    Parameters
    ----------
    parameters, start, charted, water, log
        Of the run.
    """

    def __init__(
        self, parameters: VideoTracking, start: VideoStart, charted: ChartedArea | None, water: Water | None,
        log: TrackLog,
    ) -> None:  # fmt: skip
        self._parameters, self._start, self._charted, self._water, self._log = parameters, start, charted, water, log
        self._judged = Judged(start.sensor)
        self._places: list[tuple[float, float]] = []
        self._kept: list[tuple[float, NDArray[np.uint8], NDArray[np.uint8]]] = []
        self._stride = 1
        self._steps = 0
        self._last: Step | None = None
        self._raster = _Raster(start.sensor)

    def append(self, step: Step) -> None:
        """Take in a turn's result."""
        self._log.append(step)
        turn: EvidenceTurn = step.measurement
        self._judged.add(step.state.heard, step.tracks)
        self._places.append(turn.place)
        if self._steps % self._stride == 0:
            self._kept.append((step.time_s, *self._raster.pictures(step.state.heard.power)))
            if len(self._kept) > 2 * SHOWN:  # each second turn from now on
                self._kept, self._stride = self._kept[::2], 2 * self._stride
        self._steps += 1
        self._last = step

    def outcome(
        self, source: RadarVideoSource, counts: Counter[str], truth: Truth | None, cutoff_m: float | None,
        water_at: Callable[[tuple[float, float]], Array] | None, ais: Path | None = None,
    ) -> VideoOutcome:  # fmt: skip
        """Return the tracks, what lies still, what was checked, and what the report shows.

        Raises
        ------
        DataError
            If the truth is of other times.
        """
        assert self._last is not None
        turn: EvidenceTurn = self._last.measurement
        clutter, sensor = self._last.state.heard.clutter, self._start.sensor
        allowed = None if water_at is None else water_at(turn.place)
        resting = resting_of(sensor, clutter, allowed, turn.place)
        registration, findings = self._judged.findings(counts, self._start, self._water, self._parameters)
        times = self._log.times_s
        ships = None
        if self._start.frame is not None and (reports := reports_beside(source.name, ais, times)):
            ships = compare_ais(
                reports, self._start.frame, self._log, np.array(self._places), sensor, clutter.fixed
            )  # fmt: skip
            findings = (*findings, ships.finding())
        scores = None
        if truth is not None:
            places = truth.aligned(times)[..., :2]
            off = places - np.array(self._places)[:, None]
            far = np.hypot(off[..., 0], off[..., 1]) > sensor.range_m[-1]
            scores = scored(self._log, np.where(far[..., None], np.nan, places), cutoff_m or CUTOFF_M)
        paths = [
            VideoPath(
                number, np.asarray(rows["time_s"]), rows["position"], rows["velocity"],
                np.sqrt(np.diagonal(rows["covariance"], axis1=1, axis2=2))[:, :2], rows["covariance"][:, 0, 1],
                rows["status"] == CONFIRMED, rows["existence"],
                np.asarray(rows["added"][:, self._log.columns.added.index("level_db")]),
            )
            for number, rows in self._log.confirmed().items()
        ]  # fmt: skip
        land = [] if self._charted is None else self._charted.coast.land.each
        shapes = self._parameters.clutter.shape_of(clutter.counts)
        shapes = shapes[np.isfinite(shapes)]
        tail = (
            f"power's exponent {np.median(shapes):.2f}; 1 is Rayleigh clutter, less is spiky"
            if len(shapes)
            else "too few cells"
        )
        rows = [
            ("Ships under way", f"{len(paths)} tracks"),
            ("Turns", str(self._steps) + self._each()),
            (
                "Cells of a turn",
                f"{sensor.shape[0]} x {sensor.shape[1]}, of {sensor.cell_m:.3g} m; a beam of {sensor.beam_deg:.2g} "
                f"degrees, a pulse of {2 * sensor.cell_m:.2g} m",
            ),
            ("Clutter's tail", tail),
            ("Fixed echoes", f"{100 * clutter.fixed.mean():.1f} % of the cells; {len(resting)} that are no land"),
            *([] if registration is None else registration.rows()),
            *([] if ships is None else ships.rows()),
            *([(remark, "") for remark in source.remarks()]),
            *([] if scores is None else scores.lines()),
        ]
        reach = float(sensor.range_m[-1])
        kept = self._kept
        tracked = VideoTracked(
            Path(source.name).name or source.name, _verdict(paths, len(resting)), times, paths, land, truth, rows,
            Shown(
                np.array([one[0] for one in kept]), np.array([one[1] for one in kept]),
                np.array([one[2] for one in kept]), reach, turn.place,
            ),
            [one.place for one in resting], None if self._start.frame is None else self._start.frame.to_lonlat, scores,
        )  # fmt: skip
        return VideoOutcome(self._log, tracked, resting, scores, findings)

    def write(self, folder: Path, outcome: VideoOutcome, config: str) -> None:
        """Write everything into a folder but the table, which the log writes."""
        if self._start.frame is not None:
            write_geojson(folder / LOCATED, self._log, self._start.frame.to_lonlat)
        write_resting(folder / "resting.csv", outcome.resting)
        title = outcome.tracked.title
        write_recording(folder, self._log, outcome.findings, outcome.scored, title=title, config=config)
        video_report(outcome.tracked, outcome.findings).write(folder)

    def _each(self) -> str:
        times = self._log.times_s
        return f", of {np.median(np.diff(times)):.2f} s" if len(times) > 1 else ""


class _Raster:
    """Pictures of a turn: a plan, north up, and range over azimuth."""

    def __init__(self, sensor: RadarVideo) -> None:
        rows, columns = sensor.shape
        edge = float(sensor.range_m[-1])
        middle = (np.arange(SIDE) + 0.5) * 2 * edge / SIDE - edge
        x, y = np.meshgrid(middle, middle)
        row = np.round((np.arctan2(x, y) - sensor.grid[2]) / sensor.grid[2]).astype(np.int64) % rows
        column = np.round((np.hypot(x, y) - sensor.grid[0]) / sensor.grid[1]).astype(np.int64)
        self._seen = (column >= 0) & (column < columns)
        self._row, self._column = row, np.clip(column, 0, columns - 1)
        self._tall, self._wide = -(-rows // ROWS), -(-columns // COLUMNS)
        self._size = min(max(1, 2 * columns // SIDE) // 2 * 2 + 1, 9)
        self._low = math.nan

    def pictures(self, power: NDArray[np.float32]) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Return both, of decibels over the median of the first turn."""
        level = 10 * np.log10(np.maximum(np.nan_to_num(power), 1e-12))
        if math.isnan(self._low):
            self._low = float(np.median(level))
        found = np.clip((level - self._low) * STEPS_DB, 0, 255).astype(np.uint8)
        rows, columns = found.shape
        strong = ndimage.maximum_filter(found, (1, self._size), mode="nearest")
        plan = np.where(self._seen, strong[self._row, self._column], 0).astype(np.uint8)
        padded = np.zeros((-(-rows // self._tall) * self._tall, -(-columns // self._wide) * self._wide), np.uint8)
        padded[:rows, :columns] = found
        scan = padded.reshape(-1, self._tall, padded.shape[1] // self._wide, self._wide).max(axis=(1, 3))
        return plan, np.ascontiguousarray(scan)


def _verdict(paths: Sequence[VideoPath], resting: int) -> str:
    still = f" {resting} echoes that do not move are no charted land: see resting.csv." if resting else ""
    if not paths:
        return f"No ship under way was found.{still}"
    ships = "One ship" if len(paths) == 1 else f"{len(paths)} ships"
    return f"{ships} under way {'was' if len(paths) == 1 else 'were'} found.{still}"
