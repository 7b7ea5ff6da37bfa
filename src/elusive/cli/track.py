"""`elusive track`: find and track what is in a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from elusive.cli.terminal import Config, Out, bar, console, show
from elusive.io import open_frames, open_radar_plots, open_signal, read_signal_truth, read_truth
from elusive.model import read_yaml
from elusive.options import accepts, nested
from elusive.pipelines.images import ImageTracking, track_recording
from elusive.pipelines.radar import RadarTracking, track_radar_recording
from elusive.pipelines.signals import SignalTracking, track_signal_recording

app = typer.Typer(no_args_is_help=True, help="Find and track what is in a recording.")


@app.command("images")
@accepts(ImageTracking)
def track_images_command(
    source: Annotated[
        str,
        typer.Argument(
            help="Folder or glob of PNG/TIFF, multi-page TIFF, .npy, .npz, HDF5 (file.h5::/name), GIF, video."
        ),
    ],
    out: Out,
    given: dict[str, Any],
    config: Config = None,
    truth: Annotated[
        Path | None, typer.Option("--truth", help="File with 'x y' a frame, 0-based; only scores.")
    ] = None,
    truth_one_based: Annotated[bool, typer.Option(help="The truth counts pixels from 1.")] = False,
    rate_hz: Annotated[float | None, typer.Option("--rate-hz", help="Frames a second; else from the file.")] = None,
    start: Annotated[int, typer.Option(help="First frame to use, from 0.")] = 0,
    stop: Annotated[int | None, typer.Option(help="Frame before which to stop.")] = None,
) -> None:
    """Track a target too faint to threshold through a sequence of frames."""
    parameters = ImageTracking(**nested(ImageTracking, given, read_yaml(config) if config else {}))
    places = None if truth is None else read_truth(truth, one_based=truth_one_based)
    frames = open_frames(source, start=start, stop=stop, rate_hz=rate_hz)
    with bar("frames", frames.length) as advance:
        outcome = track_recording(frames, parameters, out, truth=places, on_frame=advance)
    show(outcome.tracked.title, ("", ""), outcome.tracked.rows)
    console.print(f"Written to {out}: tracks.csv, tracks_mot.csv, result.nc, report.html, report.png, config.yaml")


@app.command("signal")
@accepts(SignalTracking)
def track_signal_command(
    recording: Annotated[
        Path,
        typer.Argument(help="Array (time, sample) as .npy, .csv or .txt; or a long recording: .wav, one column, 1-D."),
    ],
    out: Out,
    given: dict[str, Any],
    config: Config = None,
    truth: Annotated[
        Path | None, typer.Option("--truth", help="File with the place of each object a frame, 0-based; only scores.")
    ] = None,
    rate_hz: Annotated[float | None, typer.Option("--rate-hz", help="Frames a second; else from the file.")] = None,
    frame_samples: Annotated[
        int | None, typer.Option(help="Samples of a frame, of a long recording. [default: 1200]")
    ] = None,
    hop_samples: Annotated[
        int | None, typer.Option(help="Samples from a frame's start to the next. [default: a frame's]")
    ] = None,
    channel: Annotated[int | None, typer.Option(help="Channel of a .wav file, from 0.")] = None,
    start: Annotated[int, typer.Option(help="First frame to use, from 0.")] = 0,
    stop: Annotated[int | None, typer.Option(help="Frame before which to stop.")] = None,
) -> None:
    """Track objects that differ from a signal's noise only in their statistics."""
    parameters = SignalTracking(**nested(SignalTracking, given, read_yaml(config) if config else {}))
    places = None if truth is None else read_signal_truth(truth)
    frames = open_signal(
        recording, frame_samples=frame_samples, hop_samples=hop_samples, channel=channel, start=start, stop=stop,
        rate_hz=rate_hz,
    )  # fmt: skip
    with bar("frames", frames.length) as advance:
        outcome = track_signal_recording(frames, parameters, out, truth=places, on_frame=advance)
    tracked = outcome.tracked
    console.print(escape(tracked.verdict), highlight=False)
    if tracked.tracks:
        show("Tracks", [name.partition(" [")[0] for name in tracked.header], tracked.tracks)
    show(tracked.title, ("", ""), tracked.rows)
    console.print(f"Written to {out}: tracks.csv, result.nc, report.html, report.png, config.yaml")


@app.command("radar")
@accepts(RadarTracking)
def track_radar_command(
    plots: Annotated[
        Path,
        typer.Argument(
            help="Plots: .csv of time_s, range_m, bearing_deg, perhaps doppler_mps; or ASTERIX CAT048, raw or pcap."
        ),
    ],
    radar_lat: Annotated[float, typer.Option("--radar-lat", help="Latitude of the radar, WGS 84, in degrees.")],
    radar_lon: Annotated[float, typer.Option("--radar-lon", help="Longitude of the radar, WGS 84, in degrees.")],
    out: Out,
    given: dict[str, Any],
    chart: Annotated[
        list[Path] | None,
        typer.Option("--chart", help="S-57 base cells (.000), GeoJSON or shapefiles of land, one or several."),
    ] = None,
    config: Config = None,
    truth: Annotated[
        Path | None,
        typer.Option("--truth", help="Where a ship truly was: .csv of time_s, lon_deg, lat_deg or x_m, y_m; AIS log."),
    ] = None,
    truth_mmsi: Annotated[int | None, typer.Option("--truth-mmsi", help="The ship, in an AIS log of several.")] = None,
    rotation_s: Annotated[
        float | None, typer.Option("--rotation-s", help="Period of the antenna; else plots of equal times are a scan.")
    ] = None,
    radar_code: Annotated[
        tuple[int, int] | None, typer.Option("--radar-code", help="SAC and SIC, in an ASTERIX file of several radars.")
    ] = None,
) -> None:
    """Track ships through a radar's plots, with charts that may be wrong by some metres."""
    parameters = RadarTracking(**nested(RadarTracking, given, read_yaml(config) if config else {}))
    source = open_radar_plots(plots, rotation_s=rotation_s, radar=radar_code)
    with bar("scans", None) as advance:
        outcome = track_radar_recording(
            source, parameters, out, radar_lon_deg=radar_lon, radar_lat_deg=radar_lat, charts=chart or (),
            truth=truth, truth_mmsi=truth_mmsi, on_scan=advance,
        )  # fmt: skip
    tracked = outcome.tracked
    console.print(escape(tracked.verdict), highlight=False)
    if tracked.tracks:
        show("Tracks", [name.partition(" [")[0] for name in tracked.header], tracked.tracks)
    show(tracked.title, ("", ""), tracked.rows)
    console.print(f"Written to {out}: tracks.csv, tracks.geojson, result.nc, report.html, report.png, config.yaml")
