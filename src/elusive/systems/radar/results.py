"""What tracking a radar's recording came to: its tracks over time, their table, and what the report shows."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.charts import Water
from elusive.charts.biased import CoastBias
from elusive.charts.charted_area import ChartedArea
from elusive.contracts import VX, VY, Array, X, Y
from elusive.filters.particle.coast_error import anchored_probability, coast_bias
from elusive.filters.particle.particle_map import map_estimate
from elusive.geometry.local_frame import LocalFrame
from elusive.io import RadarSource, TrackRow, write_geojson, write_netcdf, write_tracks_csv
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar.parameters import RadarSurvey, RadarTracking
from elusive.systems.radar.report import (
    RadarKeeper,
    RadarPath,
    RadarTracked,
    chart_map,
    write_radar_html,
    write_radar_png,
)
from elusive.systems.radar.summary import RadarPoint, bias_row, header, line_of, remarks, rows_of, verdict
from elusive.systems.radar.truth import Truth
from elusive.tracking.radar_claims import plot_places
from elusive.tracking.radar_tracks import RadarTrack, RadarTracks

SHOWN_CELL = 1 / 3  # of the coast's deviation
NODES = np.array([-2.02018287, -0.95857246, 0.0, 0.95857246, 2.02018287]) * math.sqrt(2)  # Gauss-Hermite
SHARES = np.array([0.01995324, 0.39361932, 0.94530872, 0.39361932, 0.01995324]) / math.sqrt(math.pi)


class Surroundings(NamedTuple):
    """Where a recording was made."""

    frame: LocalFrame  # its origin is the radar's place
    charted: ChartedArea | None
    water: Water | None  # as the chart is used; None where it is not


class RadarOutcome(NamedTuple):
    """What a tracked recording came to."""

    rows: list[TrackRow]
    tracked: RadarTracked
    truth: Truth  # empty where it is not known


class RadarRun:
    """Gathers results over a recording, in memory that grows with the tracks."""

    def __init__(self, parameters: RadarTracking, sensor: RadarSensor, around: Surroundings, seen: RadarSurvey) -> None:
        self._parameters, self._sensor, self._around, self._seen = parameters, sensor, around, seen
        self._keeper = RadarKeeper()
        self._times: list[float] = []
        self._likeliest: list[float] = []  # greatest existence of what is no candidate yet
        self._tracks: dict[int, list[RadarPoint]] = {}
        self._bias: CoastBias | None = None  # of the chart, as it is known by now
        self._mode_rng = np.random.default_rng([parameters.seed, 1])  # estimates do not change what is tracked

    def offer(self, scan: RadarScan, tracks: RadarTracks) -> None:
        """Take in one more scan's result."""
        self._times.append(scan.time_s)
        self._keeper.scan(scan.time_s, plot_places(scan, self._sensor)[0])
        self._bias = None if tracks.filter is None else coast_bias(tracks.filter.knowledge)
        begun = [track.existence for track in tracks.tracks if track.life.track is None]
        self._likeliest.append(max(begun, default=0.0))
        for track in tracks.tracks:
            if track.life.track is None or track.life.status is None:
                continue
            place = self._place(track, tracks)
            point = RadarPoint(
                len(self._times) - 1, track.life.status, track.existence, place, track.state.covariance,
                track.state.log_evidence, track.state.allowed, track.state.forbidden, self._on_water(track),
                self._anchored(track, tracks),
            )  # fmt: skip
            self._tracks.setdefault(track.life.track, []).append(point)
            state = track.state
            water = math.nan if self._around.water is None else min(state.allowed, self._water_at(place[[X, Y]]))
            mode = place if self._parameters.estimate == "map" else None
            self._keeper.offer(
                track.life.track,
                water,
                lambda s=state, m=mode: (s.particles, s.weights, s.mean, m),  # type: ignore[misc]
            )

    def _place(self, track: RadarTrack, tracks: RadarTracks) -> Array:
        if self._parameters.estimate == "mean" or track.before is track.state or tracks.filter is None:
            return track.state.mean
        return map_estimate(tracks.filter, track.before, track.state, track.seen, self._mode_rng)

    def _water_at(self, place: Array) -> float:
        assert self._around.water is not None
        return float(self._around.water.probability(place[None])[0])

    def _on_water(self, track: RadarTrack) -> float:
        """P(water) where the plot nearest to a track says that it is, over the plot's error; NaN without either."""
        water = self._around.water
        if water is None or not len(track.seen.range_m):
            return math.nan
        places, errors = plot_places(track.seen, self._sensor)
        nearest = int(np.argmin(np.hypot(*(places - track.state.mean[[X, Y]]).T)))
        root = np.linalg.cholesky(errors[nearest])
        grid = np.stack(np.meshgrid(NODES, NODES, indexing="ij"), axis=-1).reshape(-1, 2)
        at = places[nearest] + grid @ root.T
        return float(np.outer(SHARES, SHARES).ravel() @ water.probability(at))

    def _anchored(self, track: RadarTrack, tracks: RadarTracks) -> float:
        names = () if tracks.filter is None else tracks.filter.state_names
        share = anchored_probability(names, track.state.particles, track.state.weights)
        return math.nan if share is None else share

    def outcome(self, source: RadarSource, truth: Truth) -> RadarOutcome:
        """Return the table and what the report shows."""
        times = np.array(self._times)
        confirmed = {n: points for n, points in self._tracks.items() if any(p.status == "confirmed" for p in points)}
        paths = [self._path(number, points, times) for number, points in confirmed.items()]
        lines = [line_of(path, confirmed[path.track], truth or None) for path in paths]
        tracked = RadarTracked(
            title=Path(source.name).name or source.name,
            verdict=" ".join([verdict(paths), *remarks(paths, confirmed)]),
            times_s=times,
            plots=self._keeper.plots,
            paths=paths,
            clouds=self._keeper.clouds,
            truth=next(iter(truth.values())) if len(truth) == 1 else None,
            rows=[
                *rows_of(self._parameters, self._sensor, self._around.charted, self._seen, source.counts),
                *([] if self._bias is None else [bias_row(self._bias)]),
                ("Candidates never confirmed", f"{len(self._tracks) - len(paths)}"),
            ],
            header=header(bool(truth)),
            tracks=lines,
            lonlat=self._around.frame.to_lonlat,
            estimate="MAP" if self._parameters.estimate == "map" else "mean",
        )
        return RadarOutcome(list(self._rows()), self._charted(tracked), truth)

    def _charted(self, tracked: RadarTracked) -> RadarTracked:
        charted, water = self._around.charted, self._around.water
        if charted is None:
            return tracked
        rings = [
            charted.coast.land.vertices[a:b]
            for a, b in zip(charted.coast.land.starts[:-1], charted.coast.land.starts[1:], strict=True)
        ]
        shading = None
        if water is not None:
            shading = lambda places: np.where(water.known(places), water.probability(places), np.nan)  # noqa: E731
        cell_m = SHOWN_CELL * float(charted.coast.sigma_m.min())
        return tracked._replace(chart=chart_map(rings, shading, tracked, cell_m))

    def _path(self, number: int, points: list[RadarPoint], times: Array) -> RadarPath:
        means = np.array([point.place for point in points])
        covariances = np.array([point.covariance for point in points])
        return RadarPath(
            number,
            times[[point.scan for point in points]],
            means[:, [X, Y]],
            means[:, [VX, VY]],
            np.sqrt(covariances[:, [X, Y], [X, Y]]),
            np.array([point.status == "confirmed" for point in points]),
            np.array([point.forbidden for point in points]),
            covariances[:, X, Y],
            None if self._around.water is None else np.array([point.allowed for point in points]),
        )

    def write(self, folder: Path, outcome: RadarOutcome, config: str) -> None:
        """Write everything into a folder."""
        tracked = outcome.tracked
        write_tracks_csv(folder / "tracks.csv", outcome.rows, unit="m")
        write_geojson(folder / "tracks.geojson", (row for row in outcome.rows if row.status != "none"))
        self._write_dataset(folder / "result.nc", tracked.title, config)
        (folder / "config.yaml").write_text(config, encoding="utf-8")
        write_radar_png(folder / "report.png", tracked)
        write_radar_html(folder / "report.html", tracked)

    def _write_dataset(self, path: Path, title: str, config: str) -> None:
        """Write a row a track and scan, and what each says of chart and evidence."""
        import xarray as xr

        points = [(number, point) for number, track in self._tracks.items() for point in track]
        means = np.array([point.place[:4] for _, point in points]).reshape(-1, 4)
        covariances = np.array([point.covariance[:4, :4] for _, point in points]).reshape(-1, 4, 4)
        names, units = ["x", "vx", "y", "vy"], "m, m/s, m, m/s east and north of the radar"
        frame = self._around.frame
        dataset = xr.Dataset(
            {
                "track": ("row", np.array([number for number, _ in points], np.int64)),
                "status": ("row", np.array([point.status for _, point in points], dtype="U9")),
                "existence": ("row", np.array([point.existence for _, point in points], np.float64)),
                "state": (("row", "component"), means, {"units": units}),
                "covariance": (("row", "component", "component_"), covariances),
                "log_evidence": ("row", np.array([point.log_evidence for _, point in points], np.float64)),
                "allowed": ("row", np.array([point.allowed for _, point in points], np.float64)),
                "map_left_out": ("row", np.array([point.forbidden for _, point in points], np.int8)),
                "at_anchor": ("row", np.array([point.anchored for _, point in points], np.float64)),
                "plot_on_water": ("row", np.array([point.on_water for _, point in points], np.float64)),
            },
            coords={
                "time": ("row", np.array(self._times)[[point.scan for _, point in points]], {"units": "s"}),
                "component": names,
                "component_": names,
            },
            attrs={
                "title": title,
                "radar_lon_deg": frame.lon_deg,
                "radar_lat_deg": frame.lat_deg,
                "config": config,
            },
        )
        write_netcdf(path, dataset)

    def _rows(self) -> Iterator[TrackRow]:
        """Yield the table, scan by scan; a scan without a track has one row."""
        by_scan: dict[int, list[TrackRow]] = {}
        points = [(number, point) for number, track in sorted(self._tracks.items()) for point in track]
        places = np.array([point.place[[X, Y]] for _, point in points]).reshape(-1, 2)
        for (number, point), (lon, lat) in zip(points, self._around.frame.to_lonlat(places), strict=True):
            x, vx, y, vy = point.place[:4]
            sd_x, sd_y = np.sqrt(point.covariance[[X, Y], [X, Y]])
            row = TrackRow(
                self._times[point.scan], number, point.status, point.existence,
                *map(float, (x, y, vx, vy, sd_x, sd_y, lon, lat)),
            )  # fmt: skip
            by_scan.setdefault(point.scan, []).append(row)
        for scan, time_s in enumerate(self._times):
            yield from by_scan.get(scan, [TrackRow(time_s, None, "none", self._likeliest[scan])])
