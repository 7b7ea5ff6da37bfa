"""`elusive track radar`: ships in a radar's plots, with charts that may be wrong by some metres."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from elusive.cli.fit import FittedOut, tell_fitted
from elusive.cli.given import accepts, parameters_of
from elusive.cli.live import Follow, HoldS, IdleS, To, check_live, feed_of, memory_of_run, run_live, sinks_of
from elusive.cli.recorded import SHIPS, Charts, cutoff_in, tell_run, truth_of
from elusive.cli.terminal import Config, Out, Strict, bar, check_scores
from elusive.errors import ParameterError
from elusive.geometry.local_frame import LocalFrame
from elusive.io import RadarSource, open_radar_plots
from elusive.io.ais_reports import GrowingReports
from elusive.io.arrivals import fed
from elusive.io.asterix_live import is_asterix
from elusive.io.radar_plots import follow_radar_plots
from elusive.io.sinks.opening import is_geographic
from elusive.systems.radar.fit import charted, fit_radar
from elusive.systems.radar.live import LIVE_FILES, follow_radar
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.results import LOCATED
from elusive.systems.radar.run import track_radar_recording
from elusive.systems.radar.setting import frame_of

TABLE, FILES = "tracks.csv", ("result.nc", "report.html", "report.png", "checks.json", "config.yaml")
Latitude = Annotated[
    float | None,
    typer.Option(
        "--radar-lat-deg", help="Latitude of the radar, WGS 84, where the plots do not tell it: for charts and degrees."
    ),
]
Longitude = Annotated[float | None, typer.Option("--radar-lon-deg", help="Longitude of the radar, WGS 84.")]
OwnShipFile = Annotated[
    Path | None,
    typer.Option("--own-ship", help="Log of the radar's own ship: NMEA sentences, or .csv of time, lon_deg, lat_deg."),
]
Rotation = Annotated[
    float | None,
    typer.Option(
        "--rotation-s", help="Period of the antenna; else plots of equal times are a scan, or the period is estimated."
    ),
]
RadarCode = Annotated[
    tuple[int, int] | None, typer.Option("--radar-code", help="SAC and SIC, in an ASTERIX file of several radars.")
]


@accepts(RadarTracking)
def track_radar_command(
    plots: Annotated[
        str,
        typer.Argument(
            help="Plots: .csv of time_s (or ISO time), range_m (or _km, _nmi), bearing_deg, perhaps doppler_mps and "
            "own_lon_deg, own_lat_deg of the radar; or ASTERIX CAT048, raw or pcap."
        ),
    ],
    out: Out,
    given: dict[str, Any],
    radar_lat: Latitude = None,
    radar_lon: Longitude = None,
    own_ship: OwnShipFile = None,
    chart: Charts = None,
    config: Config = None,
    truth: Annotated[Path | None, truth_of("ships", SHIPS)] = None,
    truth_cutoff: Annotated[float | None, cutoff_in("m", "50")] = None,
    truth_mmsi: Annotated[int | None, typer.Option("--truth-mmsi", help="The only ship to read of an AIS log.")] = None,
    ais: Annotated[
        Path | None,
        typer.Option(
            "--ais",
            help="What ships report, fused with their tracks: .csv of time_s or time, mmsi, lon_deg, lat_deg, sog_mps "
            "or sog_kn, cog_deg; or a log of AIVDM sentences.",
        ),
    ] = None,
    rotation_s: Rotation = None,
    radar_code: RadarCode = None,
    follow: Follow = False,
    to: To = None,
    idle_s: IdleS = None,
    hold_s: HoldS = None,
    strict: Strict = False,
) -> None:
    """Track ships through a radar's plots, with charts that may be wrong by some metres."""
    parameters = parameters_of(RadarTracking, given, config)
    feed = feed_of(plots, follow, idle_s, hold_s)
    check_live(feed is not None, idle_s, truth, strict=strict)
    check_scores(truth, truth_cutoff=truth_cutoff, truth_mmsi=truth_mmsi)
    asking = (
        ("--chart", bool(chart)),
        ("--ais", ais is not None),
        *((f"--to {one}", is_geographic(one)) for one in to or ()),
    )
    needs_place = next((name for name, asked in asking if asked), "")
    if feed is not None:
        place = _place(radar_lat, radar_lon)
        if own_ship is not None or (radar_code is not None and not is_asterix(plots)):
            raise ParameterError(
                "follow: a live table takes the radar's own way from its columns: neither --own-ship nor --radar-code."
            )
        if place is None and needs_place:
            raise ParameterError(
                f"{needs_place}: needs the radar's place, which a live table does not tell at first; give "
                "--radar-lat-deg and --radar-lon-deg."
            )
        sinks = sinks_of(to, "radar", "m", place if to else None, live=True)
        scans = follow_radar_plots(plots, feed, rotation_s=rotation_s, place_deg=place, radar=radar_code)
        coming, memory = fed(scans, feed), memory_of_run()
        frame = None if place is None else LocalFrame.at(*place)
        told = None if ais is None or frame is None else GrowingReports(ais, frame, feed)
        run = partial(follow_radar, coming, parameters, out, frame, charts=chart or (), ais=told, memory=memory)
        run_live(coming, run, out, LIVE_FILES, sinks)
        return
    source = _opened(Path(plots), rotation_s, radar_code, radar_lat, radar_lon, own_ship)
    frame_of(source, None, needs_place)
    sinks = sinks_of(to, "radar", "m", source.place_deg if to else None, live=False)
    with bar("scans", None) as advance:
        outcome = track_radar_recording(
            source, parameters, out, charts=chart or (), truth=truth, truth_mmsi=truth_mmsi, cutoff_m=truth_cutoff,
            ais=ais, on_scan=advance,
        )  # fmt: skip
    tracked = outcome.tracked
    files = [TABLE, *([LOCATED] if tracked.lonlat is not None else []), *FILES]
    tell_run(
        outcome, (tracked.title, tracked.rows), out, files, sinks, strict=strict, verdict=tracked.verdict,
        tracks=(tracked.header, tracked.tracks),
    )  # fmt: skip


def fit_radar_command(
    plots: Annotated[Path, typer.Argument(help="Plots, as `elusive track radar` takes them.")],
    radar_lat: Latitude = None,
    radar_lon: Longitude = None,
    own_ship: OwnShipFile = None,
    out: FittedOut = None,
    chart: Annotated[
        list[Path] | None,
        typer.Option("--chart", help="Charts whose islets, rocks, beacons, landmarks (points) echo: for biases."),
    ] = None,
    rotation_s: Rotation = None,
    radar_code: RadarCode = None,
) -> None:
    """Fit a radar's errors, detection, false alarms and, with a chart, biases to a recording without labels."""
    source = _opened(plots, rotation_s, radar_code, radar_lat, radar_lon, own_ship)
    frame = frame_of(source, None, "--chart" if chart else "")
    known, water = charted(chart, frame) if chart and frame is not None else (None, None)
    fitted = fit_radar(source, source.name, known, water)
    tell_fitted("radar", source.name, fitted, out)


def _opened(
    plots: Path, rotation_s: float | None, radar: tuple[int, int] | None, lat_deg: float | None, lon_deg: float | None,
    own_ship: Path | None,
) -> RadarSource:  # fmt: skip
    """Open the plots about the radar's place, if that is given."""
    place = _place(lat_deg, lon_deg)
    return open_radar_plots(plots, rotation_s=rotation_s, radar=radar, place_deg=place, own_ship=own_ship)


def _place(lat_deg: float | None, lon_deg: float | None) -> tuple[float, float] | None:
    """Return longitude and latitude, if they are given."""
    if (lat_deg is None) != (lon_deg is None):
        lacking = "--radar-lat-deg" if lat_deg is None else "--radar-lon-deg"
        raise ParameterError(f"{lacking}: is not given, and the other is; give both, or neither.")
    return None if lat_deg is None or lon_deg is None else (lon_deg, lat_deg)
