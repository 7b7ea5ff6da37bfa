"""`elusive track bearings`: emitters by what is heard of them at a few places."""

from __future__ import annotations

import signal
import statistics
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.markup import escape

from elusive.cli.terminal import Config, Out, Strict, bar, console, known_truth, show, tell_findings, tell_written
from elusive.contracts import X, Y
from elusive.errors import ParameterError
from elusive.io.bearings import open_bearings, read_sensors
from elusive.model import read_yaml
from elusive.options import accepts, nested
from elusive.systems.bearings.parameters import BearingTracking, usual_filter
from elusive.systems.bearings.run import LiveFix, follow_bearings, track_bearings_recording
from elusive.systems.bearings.track import Emitter
from elusive.tracking.track import Track

LATENCIES = 10_000  # kept
HEARD = "time_s, sensor, azimuth_deg (from north); elevation_deg, emitter, arrival_s if there are; - is stdin."


@accepts(BearingTracking)
def track_bearings_command(
    bearings: Annotated[str, typer.Argument(help=f"What is heard: .csv of {HEARD}")],
    sensors: Annotated[
        Path, typer.Option("--sensors", help="Where the sensors stand: .csv of sensor, x_m, y_m, perhaps z_m.")
    ],
    out: Out,
    given: dict[str, Any],
    config: Config = None,
    truth: Annotated[
        Path | None,
        typer.Option("--truth", help="Where emitters truly are: .csv of time_s, track, x_m, y_m, perhaps z_m. Scores."),
    ] = None,
    truth_cutoff: Annotated[
        float | None,
        typer.Option(
            "--truth-cutoff-m",
            help="Scores: further off is missed; c of GOSPA; by default a tenth of the distance between sensors.",
        ),
    ] = None,
    follow: Annotated[
        bool, typer.Option("--follow", help="Track live: read lines as they come, write the track as it goes.")
    ] = False,
    idle_s: Annotated[
        float | None, typer.Option("--idle-s", help="With --follow: end after so many seconds without a line.")
    ] = None,
    strict: Strict = False,
) -> None:
    """Track fast emitters by the directions from which they are heard, or one by when it is heard."""
    parameters = _tracking(given, read_yaml(config) if config else {}, live=follow)
    if idle_s is not None and not follow:
        raise ParameterError("--idle-s: has no meaning without --follow; leave it out.")
    if strict and follow:
        raise ParameterError("--strict: has no meaning with --follow; check a recording once it is whole.")
    if follow and truth is not None:
        raise ParameterError("--truth: has no meaning with --follow; score a recording once it is whole.")
    known = known_truth(truth, "m", cutoff=truth_cutoff)
    source = open_bearings(bearings, read_sensors(sensors), follow=follow, idle_s=idle_s)
    if follow:
        _live(lambda report: follow_bearings(source, parameters, out, report), out)
        return
    with bar("times", None) as advance:
        outcome = track_bearings_recording(source, parameters, out, truth=known, cutoff_m=truth_cutoff, on_time=advance)
    _warn(outcome.remarks)
    console.print(escape(outcome.verdict), highlight=False)
    show(outcome.tracked.title, ("", ""), outcome.table)
    tell_written(
        out, ("report.html", "report.png", "tracks.csv", "result.nc", "checks.json", "config.yaml"), outcome.scored
    )
    tell_findings(outcome.findings, strict=strict)


def _tracking(given: dict[str, Any], base: dict[str, Any], *, live: bool) -> BearingTracking:
    """Return the parameters, by the usual filter where none is chosen; who chooses one follows one emitter."""
    emitters = base.get("emitters", {})
    kind = given.get("emitters") or (emitters.get("kind") if isinstance(emitters, dict) else None)
    if given.get("filter") is not None:
        if kind == "several":
            raise ParameterError(
                f"--filter {given['filter']}: is of one emitter; leave it out with --emitters several."
            )
        base = {**base, "emitters": {"kind": "one"}}
    flt, motion = base.get("filter", {}), base.get("motion", {})
    if isinstance(flt, dict) and "kind" not in flt and given.get("filter") is None:
        kind = given.get("motion") or (motion.get("kind") if isinstance(motion, dict) else None)
        base = {**base, "filter": {"kind": usual_filter(kind, live=live), **flt}}
    return BearingTracking(**nested(BearingTracking, given, base))


def _warn(remarks: tuple[str, ...]) -> None:
    for remark in remarks:
        console.print(f"[yellow]{escape(remark)}[/]", highlight=False, soft_wrap=True)


def _place(track: Track) -> str:
    (east, north), sd = track.mean[[X, Y]], np.sqrt(np.diag(track.covariance)[[X, Y]])
    return f"{track.track}: {east:.1f} m east, {north:.1f} m north (± {sd[0]:.2g}, {sd[1]:.2g})"


def _live(run: Callable[[Callable[[LiveFix], None]], None], out: Path) -> None:
    """Say the track as it goes, and the latency at the end, which is Ctrl-C's or the bearings'."""
    times, tracking = 0, False
    latencies_s = deque[float](maxlen=LATENCIES)

    def report(fix: LiveFix) -> None:
        nonlocal times, tracking
        _warn(fix.remarks)
        times += 1
        latencies_s.append(fix.latency_s)
        step = fix.step
        if not isinstance(step.state, Emitter):
            sure = [track for track in step.tracks if track.status == "confirmed"]
            if sure or tracking:
                console.print(f"{step.time_s:g} s: {'; '.join(map(_place, sure)) or 'no emitter'}", highlight=False)
            tracking = bool(sure)
            return
        if step.state.started:
            x, y = (step.state.state_names.index(name) for name in "xy")
            (east, north), sd = step.state.mean[[x, y]], np.sqrt(np.diag(step.state.covariance)[[x, y]])
            place = f"{east:.1f} m east, {north:.1f} m north (± {sd[0]:.2g}, {sd[1]:.2g})"
            console.print(f"{step.time_s:g} s: {place}", highlight=False)
        elif not tracking:
            console.print(f"{step.time_s:g} s: no place is known yet", highlight=False)
        tracking = step.state.started

    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        run(report)
    except KeyboardInterrupt:
        console.print("Interrupted.")
    if times:
        words = f"{1e3 * statistics.median(latencies_s):.2f} ms in the median, {1e3 * max(latencies_s):.1f} ms at most"
        console.print(f"{times} times; from a time's bearings to its row {words}.", highlight=False)
        console.print(f"Written to {out}: tracks.csv, config.yaml")
