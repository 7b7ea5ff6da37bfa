"""`elusive track links`: people without devices, tracked through the log of a radio network."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from elusive.cli.terminal import Config, Out, bar, console, show
from elusive.errors import ParameterError
from elusive.io._link_formats import LAYOUTS
from elusive.io.areas import Area, read_area
from elusive.io.link_logs import open_link_log
from elusive.io.people_truth import read_people_truth
from elusive.io.radio_network import read_nodes
from elusive.model import read_yaml
from elusive.options import accepts, nested
from elusive.pipelines.link_runs import LiveFrame, follow_links, track_links_recording
from elusive.pipelines.links import LinkTracking


@accepts(LinkTracking)
def track_links_command(
    log: Annotated[
        str, typer.Argument(help="Log of levels in dBm: wide or long .csv, .npy, listenx text; - is standard input.")
    ],
    nodes: Annotated[Path, typer.Option("--nodes", help="Where the nodes stand: .csv of node, x_m, y_m.")],
    out: Out,
    given: dict[str, Any],
    config: Config = None,
    area: Annotated[
        tuple[float, float, float, float] | None,
        typer.Option("--area", help="X0 X1 Y0 Y1: the rectangle in which people can be [m]. [default: the nodes']"),
    ] = None,
    area_file: Annotated[
        Path | None, typer.Option("--area-file", help="Polygon in which people can be: a corner a line, x and y [m].")
    ] = None,
    truth: Annotated[
        Path | None, typer.Option("--truth", help="Where people truly were: .csv of time_s, person, x_m, y_m; scores.")
    ] = None,
    layout: Annotated[
        str | None, typer.Option("--layout", help=f"Of numbers without a header: {', '.join(LAYOUTS)}.")
    ] = None,
    period_s: Annotated[
        float | None, typer.Option("--period-s", help="Of a long log: readings of so many seconds are a frame.")
    ] = None,
    follow: Annotated[
        bool, typer.Option("--follow", help="Track live: read lines as they come, write tracks as they go.")
    ] = False,
    idle_s: Annotated[
        float | None, typer.Option("--idle-s", help="With --follow: end after so many seconds without a line.")
    ] = None,
) -> None:
    """Track people who carry no device through a network of radios."""
    parameters = LinkTracking(**nested(LinkTracking, given, read_yaml(config) if config else {}))
    if area is not None and area_file is not None:
        raise ParameterError("--area-file: --area is given too; give one of them.")
    if area is not None:
        parameters = parameters.replace(area=Area.rectangle(*area))
    if area_file is not None:
        parameters = parameters.replace(area=read_area(area_file))
    if idle_s is not None and not follow:
        raise ParameterError("--idle-s: has no meaning without --follow; leave it out.")
    network = read_nodes(nodes)
    source = open_link_log(log, network, layout=layout, period_s=period_s, follow=follow, idle_s=idle_s)
    if follow:
        if truth is not None:
            raise ParameterError("--truth: has no meaning with --follow; score a log once it is whole.")
        _live(lambda told: follow_links(source, network, parameters, out, told), out)
        return
    known = None if truth is None else read_people_truth(truth)
    with bar("frames", None) as advance:
        outcome = track_links_recording(source, network, parameters, out, truth=known, on_frame=advance)
    for remark in outcome.remarks:
        console.print(f"[yellow]{escape(remark)}[/]", highlight=False, soft_wrap=True)
    console.print(escape(outcome.verdict), highlight=False)
    if outcome.tracks:
        show("Tracks", outcome.header, outcome.tracks)
    show(outcome.title, ("", ""), outcome.table)
    console.print(f"Written to {out}: report.html, report.png, tracks.csv, events.csv, result.nc, config.yaml")


def _live(run: Any, out: Path) -> None:
    """Tell events as they come, and the latency at the end, which is Ctrl-C's or the log's."""
    frames, total_s, worst_s = 0, 0.0, 0.0

    def told(frame: LiveFrame) -> None:
        nonlocal frames, total_s, worst_s
        remarks = frame.result.remarks if not frames else ()
        for remark in remarks:
            console.print(f"[yellow]{escape(remark)}[/]", highlight=False, soft_wrap=True)
        frames, total_s, worst_s = frames + 1, total_s + frame.latency_s, max(worst_s, frame.latency_s)
        for event in frame.result.events:
            x, y = event.position
            where = f"track {event.track} {event.what} at {x:.2f}, {y:.2f} m"
            console.print(f"{frame.result.time_s:.1f} s: {where}", highlight=False)

    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        run(told)
    except KeyboardInterrupt:
        console.print("Interrupted.")
    if frames:
        words = f"{1e3 * total_s / frames:.1f} ms on average, {1e3 * worst_s:.1f} ms at most"
        console.print(f"{frames} frames; from a frame to its tracks {words}.", highlight=False)
    console.print(f"Written to {out}: tracks.csv, events.csv, config.yaml")
