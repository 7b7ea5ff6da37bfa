"""What tracking a radar's recording came to: its tracks over time, their files, and what the report shows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.charts.biased import CoastBias
from elusive.checks import Finding
from elusive.contracts import Array, X, Y
from elusive.filters.particle.coast_error import coast_bias
from elusive.io import RadarSource, Truth
from elusive.report.clock import Clock
from elusive.results import CONFIRMED, DELETED, Scored, TrackLog, scored, write_geojson, write_recording
from elusive.results.spool import Records
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_hulls import HullRadar
from elusive.systems.radar.ais import AisFusion
from elusive.systems.radar.checks import findings_of, in_view, innovation, plot_errors
from elusive.systems.radar.company import company_findings
from elusive.systems.radar.copies import Sightings, copies_finding
from elusive.systems.radar.counted import Counts
from elusive.systems.radar.ground import ground_finding
from elusive.systems.radar.kept import ConstraintsKept
from elusive.systems.radar.lives import SURE, lasting_finding
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.report import (
    RadarKeeper,
    RadarPath,
    RadarTracked,
    chart_map,
    radar_report,
)
from elusive.systems.radar.second_time import second_time_finding
from elusive.systems.radar.ships import Surroundings
from elusive.systems.radar.summary import bias_row, header, line_of, remarks, run_facts, verdict
from elusive.systems.radar.survey import RadarSurvey
from elusive.systems.radar.turned import Turns
from elusive.systems.radar.wakes import wakes_finding
from elusive.tracking.track import Step

SHOWN_CELL = 1 / 3  # of the coast's deviation
CUTOFF_M = 50.0  # some deviations of a ship's track, and less than ships keep apart
LOCATED = "tracks.geojson"  # written where the radar's place is known


class RadarOutcome(NamedTuple):
    """What a tracked recording came to."""

    log: TrackLog
    tracked: RadarTracked
    scored: Scored | None  # None without a truth
    findings: tuple[Finding, ...] = ()


class RadarRun:
    """Takes the steps of a recording and writes what they came to.

    Parameters
    ----------
    parameters, sensor, around, seen
        Of the run.
    log
        Of its tracks.
    ais
        What ships report; None: nothing is known.
    """

    def __init__(
        self,
        parameters: RadarTracking,
        sensor: RadarSensor,
        around: Surroundings,
        seen: RadarSurvey,
        log: TrackLog,
        ais: AisFusion | None = None,
    ) -> None:
        self._parameters, self._sensor, self._around, self._seen = parameters, sensor, around, seen
        self._log, self._keeper = log, RadarKeeper()
        self._bias: CoastBias | None = None  # of the chart, as it is known by now
        self._innovations: list[float] = []  # of confirmed tracks
        self._counts, self._ais = Counts(), ais
        self._kept = ConstraintsKept()
        self._sightings, self._turns = Sightings(), Turns(sensor)

    def append(self, step: Step) -> None:
        """Take in a scan's result."""
        self._log.append(step)
        self._turns.add(step.measurement)
        self._keeper.scan(step.time_s, self._sensor.places(step.measurement)[0])
        self._counts.add(step, self._sensor, self._around.water, self._parameters.radar)
        self._bias = coast_bias(step.state.belief.knowledge)
        beliefs = {target.life.track: target for target in step.state.belief.targets}
        sure = {track.track for track in step.tracks if track.status == "confirmed"}
        self._sightings.add(step.measurement, [beliefs[number] for number in sorted(sure)], self._sensor)
        self._kept.add({number: beliefs[number].allowed for number in sure}, {track.track for track in step.tracks})
        for track in step.tracks:
            state, water = beliefs[track.track], self._around.water
            if track.track in sure and in_view(state, step.measurement, self._sensor):
                self._innovations.append(innovation(state, step.measurement, self._sensor))
            least = math.nan
            if water is not None:
                least = min(state.allowed, float(water.probability(track.mean[None, [X, Y]])[0]))
            mode = track.mean if self._parameters.estimate == "map" else None
            self._keeper.offer(
                track.track,
                least,
                lambda s=state, m=mode: (s.particles, s.weights, s.mean, m),  # type: ignore[misc]
            )

    def outcome(self, source: RadarSource, truth: Truth | None, cutoff_m: float | None = None) -> RadarOutcome:
        """Return the tracks and what the report shows.

        Raises
        ------
        DataError
            If the truth is of other times.
        """
        times_s = self._log.times_s
        clock = Clock.of(times_s)
        scores = (
            None
            if truth is None
            else scored(self._log, truth.aligned(times_s)[..., :2], CUTOFF_M if cutoff_m is None else cutoff_m)
        )
        confirmed = self._log.confirmed()
        paths = {number: self._path(number, rows) for number, rows in confirmed.items()}
        said = [
            sentence
            for number, rows in confirmed.items()
            for sentence in remarks(paths[number], self._added(rows, "at_anchor"), self._added(rows, "plot_on_water"))
        ]
        tracks = self._log.by_track()
        stand = sum(float(self._added(rows, "stands").max()) > SURE for n, rows in tracks if n not in paths)
        tracked = RadarTracked(
            title=Path(source.name).name or source.name,
            verdict=" ".join([verdict(list(paths.values()), stand), *said]),
            times_s=times_s,
            plots=self._keeper.plots,
            paths=list(paths.values()),
            clouds=self._keeper.clouds,
            truth=truth,
            rows=[
                *run_facts(self._parameters, self._sensor, self._around.charted, self._seen, source),
                *([] if self._bias is None else [bias_row(self._bias)]),
                *([] if self._ais is None else self._ais.rows()),
                (
                    "Candidates never confirmed",
                    f"{len(tracks.numbers) - len(paths)}{f', of which {stand} stand' if stand else ''}",
                ),
                *([] if scores is None else scores.lines()),
            ],
            header=header(clock, truth is not None, hulls=isinstance(self._sensor, HullRadar)),
            tracks=[
                line_of(paths[n], bool(rows["status"][-1] == DELETED), truth, clock) for n, rows in confirmed.items()
            ],
            lonlat=None if self._around.frame is None else self._around.frame.to_lonlat,
            estimate="MAP" if self._parameters.estimate == "map" else "mean",
            scored=scores,
            way=self._seen.way,
        )
        found = findings_of(
            self._seen, self._sensor, self._around.water, self._innovations, self._counts.bunches, source
        )
        found += (self._counts.finding(self._sensor, self._around.water, self._seen.way[:, 1:]),)
        found += (self._turns.finding,)
        seen, told = self._seen, self._parameters.radar
        found += lasting_finding(told.false_alarm_lives or ()), wakes_finding(told.false_alarm_wakes or ())
        found += (ground_finding(told.false_alarm_ground or ()),)
        found += company_findings(tracked.paths, times_s, seen.way)
        if len(seen.way) == 1:
            sightings, errors = self._sightings.of, plot_errors(seen, self._sensor)
            found += copies_finding(sightings, *errors), second_time_finding(sightings, seen.max_range_m, *errors)
        found += (self._kept.finding(),) if self._parameters.constraints else ()
        found += () if self._ais is None else (self._ais.finding(),)
        return RadarOutcome(self._log, self._charted(tracked), scores, found)

    def write(self, folder: Path, outcome: RadarOutcome, config: str) -> None:
        """Write everything into a folder but the table, which the log writes."""
        frame, tracked = self._around.frame, outcome.tracked
        place: Mapping[str, tuple[tuple[str, ...], Array, Mapping[str, str]]] = {}
        if frame is not None:
            write_geojson(folder / LOCATED, self._log, frame.to_lonlat)
            place = {
                f"radar_{name}_deg": ((), np.array(degrees), {"units": f"degrees_{way}", "long_name": "of the origin"})
                for name, degrees, way in (("lon", frame.lon_deg, "east"), ("lat", frame.lat_deg, "north"))
            }
        write_recording(
            folder, self._log, outcome.findings, outcome.scored, title=tracked.title, config=config, more=place
        )
        radar_report(tracked, outcome.findings).write(folder)

    def _added(self, rows: Records, name: str) -> Array:
        return np.asarray(rows["added"][:, self._log.columns.added.index(name)])

    def _path(self, number: int, rows: Records) -> RadarPath:
        return RadarPath(
            number, np.asarray(rows["time_s"]), rows["position"], rows["velocity"],
            np.sqrt(np.diagonal(rows["covariance"], axis1=1, axis2=2)), rows["status"] == CONFIRMED,
            self._added(rows, "map_left_out") > 0, rows["covariance"][:, 0, 1],
            None if self._around.water is None else self._added(rows, "allowed"), rows["existence"],
            np.column_stack([self._added(rows, name) for name in ("length_m", "sd_length_m")])
            if isinstance(self._sensor, HullRadar) else None, self._added(rows, "moves"),
        )  # fmt: skip

    def _charted(self, tracked: RadarTracked) -> RadarTracked:
        charted, water = self._around.charted, self._around.water
        if charted is None:
            return tracked
        land = charted.coast.land
        shading = None
        if water is not None:
            shading = lambda places: np.where(water.known(places), water.probability(places), np.nan)  # noqa: E731
        cell_m = SHOWN_CELL * float(charted.coast.sigma_m.min())
        return tracked._replace(chart=chart_map(land.each, shading, tracked, cell_m))
