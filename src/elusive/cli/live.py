"""A live run in a terminal: a line of JSON for each step, Ctrl-C, how it ended."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.markup import escape

from elusive.cli import serving
from elusive.cli.seen import Seeing, Sites
from elusive.cli.terminal import console, ended_softly, say, tell_findings
from elusive.errors import ParameterError
from elusive.geometry.local_frame import LocalFrame
from elusive.io.arrivals import Coming
from elusive.io.sinks import Ground, Sinks, open_sinks
from elusive.io.sinks.formats import json_line
from elusive.io.sinks.standard_output import StandardOutput
from elusive.io.sources import Feed, is_address
from elusive.io.sources.lines import comes_once
from elusive.options import SHOWN
from elusive.report.clock import moment
from elusive.results.live import LiveEnd, LiveStep
from elusive.tracking.memory import Memory

FAILED = 2
OF_NOW = ("nmea", "cot", "mqtt", "mqtts", "mot")  # sinks that a recording is not sent to
Follow = Annotated[
    bool, typer.Option("--follow", help="Track live: a line of JSON to standard output as each measurement comes.")
]
IdleS = Annotated[
    float | None, typer.Option("--idle-s", help="With --follow: end after so many seconds without anything new.")
]
HoldS = Annotated[
    float | None,
    typer.Option(
        "--hold-s",
        min=0.0,
        help="With --follow: hold measurements for so long, by their own times, for late ones. [default: 0]",
    ),
]
To = Annotated[
    list[str] | None,
    typer.Option(
        "--to",
        help="Where tracks go too, several times: ndjson:FILE, geojson:FILE, nmea+udp://HOST:PORT, "
        "cot+udp://HOST:PORT, cot+tcp://HOST:PORT, mqtt://HOST/SITE, mot:FILE; - is standard output. "
        "A recording goes to ndjson and geojson only, every step at once when it has been tracked.",
    ),
]
Origin = Annotated[
    tuple[float, float] | None,
    typer.Option("--origin", help="LON LAT of x = y = 0, WGS 84 in degrees: for --to with places on Earth."),
]
YAxis = Annotated[
    float | None, typer.Option("--y-axis-deg", help="With --origin: where y points, clockwise from north. [default: 0]")
]


def sinks_of(
    to: list[str] | None,
    system: str,
    unit: str,
    origin: tuple[float, float] | None = None,
    y_axis_deg: float | None = None,
    *,
    live: bool,
    located: bool = False,
) -> Sinks:
    """Open the sinks that were asked for; ``located``: the tracks say longitude and latitude themselves.

    Those that show what is there now are refused for a recording.

    Raises
    ------
    ParameterError
        If a place is given that nothing needs, or a sink is of what is live.
    DataError
        If a sink has no meaning, or does not fit the tracks.
    """
    if y_axis_deg is not None and origin is None:
        raise ParameterError("--y-axis-deg: has no meaning without --origin; give that, or leave it out.")
    ground = None
    if origin is not None:
        if not to:
            raise ParameterError("--origin: has no meaning without --to; leave it out.")
        ground = Ground(LocalFrame.at(*origin), math.radians(y_axis_deg or 0.0))
    for name in () if live else to or ():
        form = name.partition(":")[0].partition("+")[0].lower()
        if form in OF_NOW and (form != "mot" or unit == "px"):  # else it means nothing, as is said below
            instead = "tracks_mot.csv has it" if form == "mot" else "play it with elusive replay, and take --follow"
            raise ParameterError(
                f"--to {name}: shows what is there now, which a recording does not tell; {instead}, or take ndjson."
            )
    return open_sinks(to or (), system=system, unit=unit, ground=ground, say=tell, located=located)


def send_recording(sinks: Sinks, folder: Path) -> None:
    """Send a recording's steps, those without a track too, from the folder of its results."""
    if not sinks.each:
        return
    import h5netcdf  # type: ignore[import-untyped]

    from elusive.results.log import read_tracks_csv  # loads what live runs do not need here

    log = read_tracks_csv(folder / "tracks.csv")
    with h5netcdf.File(folder / "result.nc", "r") as file:  # the table lacks the steps without a track
        times_s = np.unique(file["step_time"][:])
    rows = log.rows
    ends = np.searchsorted(rows["time_s"], times_s, side="right").tolist()
    for time_s, start, end in zip(times_s.tolist(), [0, *ends], ends, strict=False):
        cells = log.columns.cells(rows[start:end])
        sinks.tell(
            {"time_s": time_s, "tracks": [dict(zip(log.columns.names[1:], row[1:], strict=True)) for row in cells]}
        )
    sinks.close()


def feed_of(source: str, follow: bool, idle_s: float | None, hold_s: float | None = None) -> Feed | None:
    """Return how a source is followed, told on the terminal; None where it is a recording.

    Raises
    ------
    ParameterError
        If an option has no meaning for a recording.
    """
    if not follow and not is_address(source):
        if hold_s is not None:
            raise ParameterError("--hold-s: has no meaning without --follow; leave it out.")
        return None
    memory = memory_of_run()
    return Feed(
        idle_s, hold_s or 0.0, tell, known_s=memory.time_s, passed_s=memory.time_s + memory.elapsed_s,
        again=not comes_once(source),
    )  # fmt: skip


def memory_of_run() -> Memory:
    """Return what a tracker goes on from, where it is served and was before; else nothing."""
    return Memory() if serving.now is None else serving.now.memory


def tell(sentence: str) -> None:
    """Say something on the terminal that is to be heeded."""
    if serving.now is not None:
        serving.now.heed(sentence)
    with suppress(OSError):  # its disk is full, too
        console.print(f"[yellow]{escape(sentence)}[/]", highlight=False, soft_wrap=True)


def check_live(follow: bool, idle_s: float | None, truth: Path | None, *, strict: bool = False) -> None:
    """Refuse options that mean nothing live, or nothing of a recording.

    Raises
    ------
    ParameterError
        If one is given.
    """
    if idle_s is not None and not follow:
        raise ParameterError("--idle-s: has no meaning without --follow; leave it out.")
    if strict and follow:
        raise ParameterError("--strict: has no meaning with --follow; check a recording once it is whole.")
    if follow and truth is not None:
        raise ParameterError("--truth: has no meaning with --follow; score a recording once it is whole.")


def run_live(
    coming: Coming[Any],
    run: Callable[[Callable[[LiveStep], None]], LiveEnd],
    out: Path,
    files: tuple[str, ...],
    sinks: Sinks,
    *,
    strict: bool = False,
    sites: Sites | None = None,
) -> None:
    """Run until the source ends, fails, or Ctrl-C is pressed, each step's line told as it is known.

    Parameters
    ----------
    coming
        The source.
    run
        Follows it, and calls what it is given after each step.
    out, files
        Folder of the results, and what stands in it then.
    sinks
        Where tracks go besides.
    strict
        End with 3 where a finding is grave.
    sites
        Where the sensors stand, for who draws what is told.

    Raises
    ------
    DataError
        If the source fails before the first step.
    """
    seeing, lines = Seeing(sites), StandardOutput(tell)

    def told(live: LiveStep) -> None:
        for remark in live.remarks:
            tell(remark)
        if serving.now is not None and not serving.now.is_new(live):
            return
        if "gap_s" in live.record:
            tell(f"{moment(live.record['time_s'])}: nothing came in the {live.record['gap_s']:g} s before.")
        send = sinks.prepared(live.record)
        if serving.now is not None:
            if said := serving.now.keep(live.record, sinks.state):
                tell(said)
            serving.now.show(live, seeing)
        send()
        seen = {"seen": seeing(live.step.measurement)} if SHOWN in os.environ else {}
        if not sinks.own_stdout:
            lines.send(json_line(live.record | seen).encode() + b"\n")
        if lines.closed:
            coming.stop()

    if serving.now is not None:
        serving.now.begin(coming, sinks, seeing.first)
    if SHOWN in os.environ:
        lines.send(json_line(seeing.first).encode() + b"\n")
    with closing(sinks), ended_softly(coming.stop) as interrupted:
        end = run(told)
    for remark in end.remarks:
        tell(remark)
    written = [name for name in files if (out / name).exists()]
    why = "interrupted" if interrupted.is_set() else "source ended" if end.fault is None else "source failed"
    if not sinks.own_stdout:
        lines.send(json_line(end.record(ended=why, files=written)).encode() + b"\n")
    if interrupted.is_set():
        say("Interrupted.")
    dropped = f", {end.dropped} more dropped, for newer ones came faster than they could be tracked" * bool(end.dropped)
    met = ", ".join(f"{count} {what}" for what, count in end.counts.items() if count)
    say(f"{end.steps} tracked{dropped}; {end.latencies.words}.")
    if met:
        say(f"Met on the way: {met}.")
    say(f"Written to {out}: {', '.join(written)}")
    faults = (*end.unwritten, *([] if end.fault is None else [end.fault]))
    tell_findings(end.findings, strict=strict and not faults)
    for fault in faults:
        console.print(f"[bold red]Error:[/] {escape(fault)}", highlight=False, soft_wrap=True)
    if faults:
        raise typer.Exit(FAILED)
