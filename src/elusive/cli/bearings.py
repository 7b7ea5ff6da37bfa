"""`elusive track bearings`: emitters by what is heard of them at a few places."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from elusive.cli.fit import FittedOut, tell_fitted
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
    send_recording,
    sinks_of,
    tell,
)
from elusive.cli.terminal import (
    Config,
    Out,
    Strict,
    bar,
    check_scores,
    console,
    known_truth,
    show_run,
    tell_findings,
    tell_written,
)
from elusive.errors import ParameterError
from elusive.io.arrivals import Arrivals, fed
from elusive.io.bearings import BearingSource, open_bearings, read_sensors
from elusive.io.sinks import Sinks
from elusive.model import read_yaml
from elusive.options import accepts, nested
from elusive.results.live import LiveEnd, LiveStep
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.parameters import BearingTracking, usual_filter
from elusive.systems.bearings.run import LIVE_FILES, follow_bearings, track_bearings_recording

HEARD = "time_s (or ISO time), sensor, azimuth_deg (from north); elevation_deg, emitter, arrival_s, x_m, y_m perhaps."

SENSORS = (
    "Where sensors stand: .csv of sensor, x_m, y_m, perhaps z_m, or lon_deg, lat_deg; not if the bearings tell it."
)


@accepts(BearingTracking)
def track_bearings_command(
    bearings: Annotated[str, typer.Argument(help=f"What is heard: .csv of {HEARD} Live: -, tcp://, udp://, mqtt://.")],
    out: Out,
    given: dict[str, Any],
    sensors: Annotated[Path | None, typer.Option("--sensors", help=SENSORS)] = None,
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
    follow: Follow = False,
    to: To = None,
    origin: Origin = None,
    y_axis_deg: YAxis = None,
    idle_s: IdleS = None,
    hold_s: HoldS = None,
    strict: Strict = False,
) -> None:
    """Track fast emitters by the directions from which they are heard, or one by when it is heard."""
    feed = feed_of(bearings, follow, idle_s, hold_s)
    parameters = _tracking(given, read_yaml(config) if config else {}, live=feed is not None)
    check_live(feed is not None, idle_s, truth, strict=strict)
    check_scores(truth, truth_cutoff=truth_cutoff)
    known = known_truth(truth, "m", cutoff=truth_cutoff)
    source = open_bearings(bearings, None if sensors is None else read_sensors(sensors), feed=feed)
    sinks = sinks_of(to, "bearings", "m", origin, y_axis_deg, live=feed is not None)
    if feed is not None:
        _live(source, fed(source, feed), parameters, out, sinks)
        return
    with bar("times", None) as advance:
        outcome = track_bearings_recording(source, parameters, out, truth=known, cutoff_m=truth_cutoff, on_time=advance)
    for remark in outcome.remarks:
        tell(remark)
    console.print(escape(outcome.verdict), highlight=False)
    show_run(outcome.tracked.title, outcome.table, outcome.findings)
    geographic = () if source.sites.frame is None else ("tracks.geojson",)
    files = ("report.html", "report.png", "tracks.csv", *geographic, "result.nc", "checks.json", "config.yaml")
    tell_written(out, files, outcome.scored)
    send_recording(sinks, out)
    tell_findings(outcome.findings, strict=strict)


def fit_bearings_command(
    bearings: Annotated[str, typer.Argument(help=f"What is heard of one emitter: .csv of {HEARD}")],
    sensors: Annotated[Path | None, typer.Option("--sensors", help=SENSORS)] = None,
    out: FittedOut = None,
) -> None:
    """Fit the deviation of bearings and an emitter's manoeuvres to a recording; then: track bearings --config."""
    from elusive.systems.bearings.fit import fit_bearings  # loads an optimiser, which tracking does not need

    source = open_bearings(bearings, None if sensors is None else read_sensors(sensors))
    heard = list(source)
    fitted = fit_bearings(heard, source.sites)
    tell_fitted("bearings", source.name, [value.cells for value in fitted.values], fitted.to_yaml(), out)


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


def _live(
    source: BearingSource, coming: Arrivals[PlaceSet], parameters: BearingTracking, out: Path, sinks: Sinks
) -> None:
    """Track emitters as their bearings come."""
    heeded = list[str]()

    def run(told: Callable[[LiveStep], None]) -> LiveEnd:
        def step(live: LiveStep, remarks: tuple[str, ...]) -> None:
            heeded[:] = remarks
            told(live)

        end, findings = follow_bearings(coming, source.sites, parameters, out, step, memory_of_run())
        tell_findings(findings, strict=False)
        return end

    run_live(coming, run, out, LIVE_FILES, lambda live: tuple(heeded), sinks=sinks)
