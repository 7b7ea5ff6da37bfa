"""`elusive track bearings`: one emitter, tracked through its bearings at a few places."""

from __future__ import annotations

import signal
import statistics
from collections import deque
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from elusive.cli.terminal import Config, Out, bar, console, show
from elusive.errors import ParameterError
from elusive.io.bearings import open_bearings, read_sensors
from elusive.io.path_truth import read_path_truth
from elusive.model import read_yaml
from elusive.options import accepts, nested
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.run import LiveFix, follow_bearings, track_bearings_recording

LATENCIES = 10_000  # kept


@accepts(BearingTracking)
def track_bearings_command(
    bearings: Annotated[
        str,
        typer.Argument(
            help="Bearings: .csv of time_s, sensor, azimuth_deg (from north), perhaps elevation_deg; - is stdin."
        ),
    ],
    sensors: Annotated[
        Path, typer.Option("--sensors", help="Where the sensors stand: .csv of sensor, x_m, y_m, perhaps z_m.")
    ],
    out: Out,
    given: dict[str, Any],
    config: Config = None,
    truth: Annotated[
        Path | None, typer.Option("--truth", help="Where it truly was: .csv of time_s, x_m, y_m, perhaps z_m; scores.")
    ] = None,
    follow: Annotated[
        bool, typer.Option("--follow", help="Track live: read lines as they come, write the track as it goes.")
    ] = False,
    idle_s: Annotated[
        float | None, typer.Option("--idle-s", help="With --follow: end after so many seconds without a line.")
    ] = None,
) -> None:
    """Track a fast emitter by the directions from which it is heard."""
    parameters = BearingTracking(**nested(BearingTracking, given, read_yaml(config) if config else {}))
    if idle_s is not None and not follow:
        raise ParameterError("--idle-s: has no meaning without --follow; leave it out.")
    if follow and truth is not None:
        raise ParameterError("--truth: has no meaning with --follow; score a recording once it is whole.")
    sites = read_sensors(sensors)
    known = None if truth is None else read_path_truth(truth)
    source = open_bearings(bearings, sites, follow=follow, idle_s=idle_s)
    if follow:
        _live(lambda told: follow_bearings(source, sites, parameters, out, told), out)
        return
    with bar("times", None) as advance:
        outcome = track_bearings_recording(source, sites, parameters, out, truth=known, on_time=advance)
    _warn(outcome.remarks)
    console.print(escape(outcome.verdict), highlight=False)
    show(outcome.tracked.title, ("", ""), outcome.table)
    heights = ", heights.csv" if outcome.tracked.heights is not None else ""
    console.print(f"Written to {out}: report.html, report.png, tracks.csv{heights}, result.nc, config.yaml")


def _warn(remarks: tuple[str, ...]) -> None:
    for remark in remarks:
        console.print(f"[yellow]{escape(remark)}[/]", highlight=False, soft_wrap=True)


def _live(run: Any, out: Path) -> None:
    """Tell the track as it goes, and the latency at the end, which is Ctrl-C's or the bearings'."""
    times, tracking = 0, False
    latencies_s = deque[float](maxlen=LATENCIES)

    def told(fix: LiveFix) -> None:
        nonlocal times, tracking
        _warn(fix.remarks)
        times += 1
        latencies_s.append(fix.latency_s)
        row = fix.row
        if row.status == "confirmed":
            place = f"{row.x:.1f} m east, {row.y:.1f} m north (± {row.sd_x:.2g}, {row.sd_y:.2g})"
            console.print(f"{row.time_s:g} s: {place}, {fix.sensors} sensors", highlight=False)
        elif not tracking:
            console.print(f"{row.time_s:g} s: no place is told yet", highlight=False)
        tracking = row.status == "confirmed"

    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        run(told)
    except KeyboardInterrupt:
        console.print("Interrupted.")
    if times:
        words = f"{1e3 * statistics.median(latencies_s):.2f} ms in the median, {1e3 * max(latencies_s):.1f} ms at most"
        console.print(f"{times} times; from a time's bearings to its row {words}.", highlight=False)
        console.print(f"Written to {out}: tracks.csv, config.yaml")
