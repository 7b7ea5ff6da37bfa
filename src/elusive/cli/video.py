"""`elusive track video` and `elusive plots`: ships in radar video, before any threshold or by way of plots."""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from elusive.cli.given import accepts, parameters_of
from elusive.cli.live import Follow, IdleS, To, check_live, feed_of, memory_of_run, run_live, sinks_of, tell
from elusive.cli.recorded import SHIPS, Charts, cutoff_in, tell_run, truth_of
from elusive.cli.terminal import Config, Out, Strict, bar, check_scores, say
from elusive.errors import ParameterError
from elusive.io.arrivals import fed
from elusive.io.radar_video import open_radar_video
from elusive.io.sinks.opening import is_geographic
from elusive.results.live import LiveEnd, LiveStep
from elusive.systems.video.live import LIVE_FILES, follow_video
from elusive.systems.video.parameters import PlotFinding, VideoTracking
from elusive.systems.video.plots import write_video_plots
from elusive.systems.video.results import FILES, LOCATED
from elusive.systems.video.track import track_video_recording

Video = Annotated[
    str,
    typer.Argument(
        help="Radar video: ASTERIX category 240 (raw or pcap), a capture of a Navico 4G or HALO, or arrays (.npz, "
        "netCDF)."
    ),
]
LiveVideo = Annotated[
    str,
    typer.Argument(
        help="Radar video: ASTERIX category 240 (raw or pcap), a capture of a Navico 4G or HALO, or arrays (.npz, "
        "netCDF); live: udp://HOST:PORT of its packets, with a comma and that of NMEA sentences after it, or -."
    ),
]
FromBow = Annotated[
    bool, typer.Option("--from-bow", help="Azimuths of category 240 count from the bow: the heading is added.")
]
Latitude = Annotated[
    float | None,
    typer.Option("--radar-lat-deg", help="Latitude of the radar, WGS 84; \\[default: the recording's]."),
]
Longitude = Annotated[
    float | None,
    typer.Option("--radar-lon-deg", help="Longitude of the radar, WGS 84; \\[default: the recording's]."),
]
Which = Annotated[str | None, typer.Option("--radar", help="Which radar, where the source holds several.")]
Rotation = Annotated[float | None, typer.Option("--rotation-s", help="Period of the antenna, of spokes without times.")]


@accepts(VideoTracking)
def track_video_command(
    video: LiveVideo,
    out: Out,
    given: dict[str, Any],
    chart: Charts = None,
    radar_lat: Latitude = None,
    radar_lon: Longitude = None,
    which: Which = None,
    rotation_s: Rotation = None,
    from_bow: FromBow = False,
    config: Config = None,
    truth: Annotated[Path | None, truth_of("ships", SHIPS)] = None,
    truth_cutoff: Annotated[float | None, cutoff_in("m", "100")] = None,
    ais: Annotated[
        Path | None,
        typer.Option("--ais", help="Reports of ships, to hold against the tracks: a log of AIS, or a table."),
    ] = None,
    follow: Follow = False,
    to: To = None,
    idle_s: IdleS = None,
    strict: Strict = False,
) -> None:
    """Track ships in radar video, before any threshold, with charts that may be wrong by some metres."""
    parameters = parameters_of(VideoTracking, given, config)
    feed = feed_of(video, follow, idle_s)
    check_live(feed is not None, idle_s, truth, strict=strict)
    check_scores(truth, truth_cutoff=truth_cutoff)
    if feed is not None and ais is not None:
        raise ParameterError("ais: is held against recordings, not live video; leave --ais or --follow out.")
    source = open_radar_video(video, radar=which, rotation_s=rotation_s, from_bow=from_bow, feed=feed)
    sinks = sinks_of(to, "video", "m", live=feed is not None, located=True)
    geographic = next((f"--to {name}" for name in to or () if is_geographic(name)), "")
    setting: dict[str, Any] = {
        "radar_lon_deg": radar_lon, "radar_lat_deg": radar_lat, "charts": chart or (), "needs_place": geographic,
    }  # fmt: skip
    if feed is not None:
        coming, memory = fed(source, feed), memory_of_run()

        def run(told: Callable[[LiveStep], None]) -> LiveEnd:
            end = follow_video(coming, parameters, out, told, memory=memory, **setting)
            for remark in source.remarks():
                tell(remark)
            return end

        run_live(coming, run, out, LIVE_FILES, sinks)
        return
    with bar("turns", None) as advance:
        outcome = track_video_recording(
            source,
            parameters,
            out,
            truth=truth,
            ais=ais,
            cutoff_m=truth_cutoff,
            on_start=say,
            on_turn=advance,
            **setting,
        )
    tracked = outcome.tracked
    files = [*FILES, *([LOCATED] if tracked.lonlat is not None else [])]
    tell_run(
        outcome, (tracked.title, tracked.rows), out, files, sinks, strict=strict, verdict=tracked.verdict,
        tracks=(tracked.header, tracked.lines if tracked.paths else ()),
    )  # fmt: skip


@accepts(PlotFinding)
def plots_command(
    video: Video,
    out: Annotated[Path, typer.Option("--out", help="File to write: .csv, which elusive track radar reads.")],
    given: dict[str, Any],
    chart: Charts = None,
    radar_lat: Latitude = None,
    radar_lon: Longitude = None,
    which: Which = None,
    rotation_s: Rotation = None,
    from_bow: FromBow = False,
    config: Config = None,
) -> None:
    """Find plots in radar video: a threshold on its clutter map, land left out."""
    parameters = parameters_of(PlotFinding, given, config)
    source = open_radar_video(video, radar=which, rotation_s=rotation_s, from_bow=from_bow)
    with bar("turns", None) as advance:
        found = write_video_plots(
            source, parameters, out, radar_lon_deg=radar_lon, radar_lat_deg=radar_lat, charts=chart or (),
            on_start=say, on_turn=advance,
        )  # fmt: skip
    mean = found.plots / max(found.turns, 1)
    say(f"Written to {out}: {found.plots} plots of {found.turns} turns, {mean:.1f} a turn.")
    lon, lat = found.lonlat_deg or (math.nan, math.nan)
    place = "--radar-lat-deg LAT --radar-lon-deg LON" if math.isnan(lon) else (
        f"--radar-lat-deg {lat:.6g} --radar-lon-deg {lon:.6g}"
    )  # fmt: skip
    charts = " ".join(f"--chart {shlex.quote(str(path))}" for path in chart or ()) or "--knowledge none"
    command = (
        f"elusive track radar {shlex.quote(str(out))} {place} {charts} --false-alarms {parameters.false_alarms:g} "
        f"--range-sd-m {found.deviations[0]:.3g} --bearing-sd-mrad {1000 * found.deviations[1]:.3g}"
    )
    say(f"To track: {command} --out tracks")
