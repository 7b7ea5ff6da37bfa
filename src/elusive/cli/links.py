"""`elusive track links` and `fit links`: people without devices, in the log of a radio network."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from elusive.cli.given import accepts, nested, parameters_of
from elusive.cli.live import (
    Follow,
    HoldS,
    IdleS,
    Origin,
    To,
    YAxis,
    check_live,
    feed_of,
    memory_of_run,
    run_live,
    sinks_of,
    tell,
)
from elusive.cli.recorded import cutoff_in, tell_run, truth_of
from elusive.cli.terminal import Config, Out, Strict, bar, check_scores, known_truth, say, show
from elusive.errors import ParameterError
from elusive.geometry.areas import Area
from elusive.io._link_formats import LAYOUTS
from elusive.io.arrivals import fed
from elusive.io.link_logs import MISSING_ABOVE_DBM, open_link_log
from elusive.io.placed_files import read_area, read_nodes
from elusive.model import read_yaml
from elusive.systems.links.fit import HEADER, LinkFitting, fit_link_log
from elusive.systems.links.run import FILES, LIVE_FILES, follow_links, track_links_recording
from elusive.systems.links.track import LinkTracking

Log = Annotated[
    str,
    typer.Argument(
        help="Log of levels in dBm: wide or long .csv, .npy, listenx text; - is standard input; live: tcp://, udp://, mqtt://."
    ),
]
Nodes = Annotated[Path, typer.Option("--nodes", help="Where the nodes stand: .csv of node, x_m, y_m.")]
Rectangle = Annotated[
    tuple[float, float, float, float] | None,
    typer.Option("--area", help="X0 X1 Y0 Y1: the rectangle in which people can be [m]. [default: the nodes']"),
]
Polygon = Annotated[
    Path | None, typer.Option("--area-file", help="Polygon in which people can be: a corner a line, x and y [m].")
]
Layout = Annotated[str | None, typer.Option("--layout", help=f"Of numbers without a header: {', '.join(LAYOUTS)}.")]
Period = Annotated[
    float | None, typer.Option("--period-s", help="Of a long log: readings of so many seconds are a frame.")
]

Missing = Annotated[
    float, typer.Option("--missing-above-dbm", help="A reading above this means that nothing was heard [dBm].")
]

Empty = Annotated[
    str | None,
    typer.Option("--empty", help="Recording of the empty room, in the log's form: calibrates instead of first frames."),
]


@accepts(LinkTracking)
def track_links_command(
    log: Log,
    nodes: Nodes,
    out: Out,
    given: dict[str, Any],
    config: Config = None,
    area: Rectangle = None,
    area_file: Polygon = None,
    truth: Annotated[Path | None, truth_of("people", ".csv of time_s, track, x_m, y_m")] = None,
    truth_cutoff: Annotated[float | None, cutoff_in("m", "2")] = None,
    layout: Layout = None,
    period_s: Period = None,
    missing_above_dbm: Missing = MISSING_ABOVE_DBM,
    empty: Empty = None,
    follow: Follow = False,
    to: To = None,
    origin: Origin = None,
    y_axis_deg: YAxis = None,
    idle_s: IdleS = None,
    hold_s: HoldS = None,
    strict: Strict = False,
) -> None:
    """Track people who carry no device through a network of radios."""
    parameters = parameters_of(LinkTracking, given, config)
    parameters = _within(parameters, area, area_file)
    feed = feed_of(log, follow, idle_s, hold_s)
    check_live(feed is not None, idle_s, truth, strict=strict)
    check_scores(truth, truth_cutoff=truth_cutoff)
    network = read_nodes(nodes)
    sinks = sinks_of(to, "links", "m", origin, y_axis_deg, live=feed is not None)
    read = partial(open_link_log, nodes=network, layout=layout, period_s=period_s, missing_above_dbm=missing_above_dbm)
    source = read(log, feed=feed)
    if empty is not None:
        if feed is not None:
            raise ParameterError("--empty: calibrates a recorded log; begin a live one with the room empty.")
        source, frames = source.after(read(empty))
        parameters = parameters.replace(calibration_frames=frames)
    if feed is not None:
        frames = parameters.calibration_frames
        say(f"Calibrating on the first {frames} frames, with nobody inside. Ctrl-C ends.")
        coming = fed(source, feed)
        run = partial(follow_links, coming, network, parameters, out, memory=memory_of_run())
        run_live(coming, run, out, LIVE_FILES, sinks, sites=network)
        return
    known = known_truth(truth, "m", cutoff=truth_cutoff)
    with bar("frames", None) as advance:
        outcome = track_links_recording(
            source, network, parameters, out, truth=known, cutoff_m=truth_cutoff, on_frame=advance
        )
    tracked = outcome.tracked
    tell_run(
        outcome, (tracked.title, tracked.rows), out, FILES, sinks, strict=strict, verdict=outcome.verdict,
        remarks=outcome.remarks, tracks=(tracked.header, tracked.tracks),
    )  # fmt: skip


@accepts(LinkFitting)
def fit_links_command(
    log: Log,
    nodes: Nodes,
    out: Annotated[
        Path, typer.Option("--out", help="Configuration to write, .yaml; or a folder, for the constants' tables too.")
    ],
    given: dict[str, Any],
    start: Annotated[
        Path | None,
        typer.Option("--start", help="Configuration of `track links` to start from; all else in it is kept."),
    ] = None,
    calibration_frames: Annotated[
        int | None, typer.Option(help="First frames, in which nobody is there. [default: as for track links]")
    ] = None,
    area: Rectangle = None,
    area_file: Polygon = None,
    config: Config = None,
    layout: Layout = None,
    period_s: Period = None,
    missing_above_dbm: Missing = MISSING_ABOVE_DBM,
    empty: Empty = None,
) -> None:
    """Fit how people change the links to a log that one person walks through; then: track links --config."""
    fitting = parameters_of(LinkFitting, given, config)
    tracking = LinkTracking(**nested(LinkTracking, {}, read_yaml(start) if start else {}))
    if calibration_frames is not None:
        tracking = tracking.replace(calibration_frames=calibration_frames)
    tracking = _within(tracking, area, area_file)
    network = read_nodes(nodes)
    read = partial(open_link_log, nodes=network, layout=layout, period_s=period_s, missing_above_dbm=missing_above_dbm)
    source = read(log)
    if empty is not None:
        source, frames = source.after(read(empty))
        tracking = tracking.replace(calibration_frames=frames)
    with bar("iterations", fitting.iterations) as advance:
        fitted = fit_link_log(source, network, tracking, fitting, out, on_iteration=advance)
    for remark in fitted.remarks:
        tell(remark)
    show("Constants", HEADER, [tuple(map(escape, row)) for row in fitted.constants])
    show(source.name, ("", ""), fitted.rows)
    say(f"Written to {out}; use it with: elusive track links ... --config")


def _within(parameters: LinkTracking, area: tuple[float, ...] | None, file: Path | None) -> LinkTracking:
    """Return the parameters with the area that was given, if one was."""
    if area is not None and file is not None:
        raise ParameterError("--area-file: --area is given too; give one of them.")
    if area is not None:
        return parameters.replace(area=Area.rectangle(*area))
    return parameters if file is None else parameters.replace(area=read_area(file))
