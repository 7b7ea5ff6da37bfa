"""`elusive track radar`: ships in a radar's plots, with charts that may be wrong by some metres."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from elusive.cli.fit import FittedOut, tell_fitted
from elusive.cli.terminal import Config, Out, Strict, bar, console, show, show_run, tell_findings, tell_written
from elusive.errors import ParameterError
from elusive.geometry.local_frame import LocalFrame
from elusive.io import open_radar_plots
from elusive.model import read_yaml
from elusive.options import accepts, nested
from elusive.systems.radar.fit import charted, fit_radar
from elusive.systems.radar.track import RadarTracking, track_radar_recording


@accepts(RadarTracking)
def track_radar_command(
    plots: Annotated[
        Path,
        typer.Argument(
            help="Plots: .csv of time_s (or ISO time), range_m (or _km, _nmi), bearing_deg, perhaps doppler_mps; or "
            "ASTERIX CAT048, raw or pcap."
        ),
    ],
    radar_lat: Annotated[float, typer.Option("--radar-lat-deg", help="Latitude of the radar, WGS 84, in degrees.")],
    radar_lon: Annotated[float, typer.Option("--radar-lon-deg", help="Longitude of the radar, WGS 84, in degrees.")],
    out: Out,
    given: dict[str, Any],
    chart: Annotated[
        list[Path] | None,
        typer.Option("--chart", help="S-57 base cells (.000), GeoJSON or shapefiles of land, one or several."),
    ] = None,
    config: Config = None,
    truth: Annotated[
        Path | None,
        typer.Option(
            "--truth",
            help="Where ships truly are: .csv of time_s, track, x_m, y_m or lon_deg, lat_deg; AIS log. Scores.",
        ),
    ] = None,
    truth_cutoff: Annotated[
        float | None,
        typer.Option("--truth-cutoff-m", help="Scores: further off is missed; c of GOSPA; by default 50."),
    ] = None,
    truth_mmsi: Annotated[int | None, typer.Option("--truth-mmsi", help="The only ship to read of an AIS log.")] = None,
    rotation_s: Annotated[
        float | None,
        typer.Option(
            "--rotation-s",
            help="Period of the antenna; else plots of equal times are a scan, or the period is estimated.",
        ),
    ] = None,
    radar_code: Annotated[
        tuple[int, int] | None, typer.Option("--radar-code", help="SAC and SIC, in an ASTERIX file of several radars.")
    ] = None,
    strict: Strict = False,
) -> None:
    """Track ships through a radar's plots, with charts that may be wrong by some metres."""
    parameters = RadarTracking(**nested(RadarTracking, given, read_yaml(config) if config else {}))
    source = open_radar_plots(plots, rotation_s=rotation_s, radar=radar_code)
    with bar("scans", None) as advance:
        outcome = track_radar_recording(
            source, parameters, out, radar_lon_deg=radar_lon, radar_lat_deg=radar_lat, charts=chart or (),
            truth=truth, truth_mmsi=truth_mmsi, cutoff_m=truth_cutoff, on_scan=advance,
        )  # fmt: skip
    tracked = outcome.tracked
    console.print(escape(tracked.verdict), highlight=False)
    if tracked.tracks:
        show("Tracks", [name.partition(" [")[0] for name in tracked.header], tracked.tracks)
    show_run(tracked.title, tracked.rows, outcome.findings)
    files = ("tracks.csv", "tracks.geojson", "result.nc", "report.html", "report.png", "checks.json", "config.yaml")
    tell_written(out, files, outcome.scored)
    tell_findings(outcome.findings, strict=strict)


def fit_radar_command(
    plots: Annotated[Path, typer.Argument(help="Plots, as `elusive track radar` takes them.")],
    radar_lat: Annotated[
        float | None, typer.Option("--radar-lat-deg", help="Latitude of the radar, for biases against charts.")
    ] = None,
    radar_lon: Annotated[
        float | None, typer.Option("--radar-lon-deg", help="Longitude of the radar, for biases against charts.")
    ] = None,
    out: FittedOut = None,
    chart: Annotated[
        list[Path] | None,
        typer.Option("--chart", help="Charts whose rocks and islets, drawn as points, echo: for biases."),
    ] = None,
    rotation_s: Annotated[float | None, typer.Option("--rotation-s", help="Period of the antenna.")] = None,
    radar_code: Annotated[
        tuple[int, int] | None, typer.Option("--radar-code", help="SAC and SIC, in an ASTERIX file of several radars.")
    ] = None,
) -> None:
    """Fit a radar's errors, detection, false alarms and, with a chart, biases to a recording without labels."""
    known, water = None, None
    if chart:
        if radar_lat is None or radar_lon is None:
            raise ParameterError("chart: biases need the radar's place; give --radar-lat-deg and --radar-lon-deg.")
        known, water = charted(chart, LocalFrame.at(radar_lon, radar_lat))
    source = open_radar_plots(plots, rotation_s=rotation_s, radar=radar_code)
    fitted = fit_radar(source, source.name, known, water)
    tell_fitted("radar", source.name, [value.cells for value in fitted.values], fitted.to_yaml(), out)
