"""`elusive track bearings`: emitters by what is heard of them at a few places."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from elusive.cli.fit import FittedOut, tell_fitted
from elusive.cli.given import accepts, nested
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
)
from elusive.cli.recorded import cutoff_in, tell_run, truth_of
from elusive.cli.terminal import Config, Out, Strict, bar, check_scores, known_truth
from elusive.errors import ParameterError
from elusive.io.arrivals import fed
from elusive.io.bearings import open_bearings
from elusive.io.sensor_files import read_sensors
from elusive.model import read_yaml
from elusive.systems.bearings.parameters import BearingTracking, usual_filter
from elusive.systems.bearings.run import LIVE_FILES, follow_bearings, track_bearings_recording

HEARD = "time_s (or ISO time), sensor, azimuth_deg (from north); elevation_deg, emitter, arrival_s, x_m, y_m perhaps."

SENSORS = (
    "Where sensors stand: .csv of sensor, x_m, y_m, perhaps z_m, or lon_deg, lat_deg; or .geojson. Not if the bearings "
    "tell it."
)


@accepts(BearingTracking)
def track_bearings_command(
    bearings: Annotated[str, typer.Argument(help=f"What is heard: .csv of {HEARD} Live: -, tcp://, udp://, mqtt://.")],
    out: Out,
    given: dict[str, Any],
    sensors: Annotated[Path | None, typer.Option("--sensors", help=SENSORS)] = None,
    config: Config = None,
    truth: Annotated[Path | None, truth_of("emitters", ".csv of time_s, track, x_m, y_m, perhaps z_m")] = None,
    truth_cutoff: Annotated[float | None, cutoff_in("m", "a tenth of the distance between sensors")] = None,
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
        coming = fed(source, feed)
        run = partial(follow_bearings, coming, source.sites, parameters, out, memory=memory_of_run())
        run_live(coming, run, out, LIVE_FILES, sinks, sites=source.sites)
        return
    with bar("times", None) as advance:
        outcome = track_bearings_recording(source, parameters, out, truth=known, cutoff_m=truth_cutoff, on_time=advance)
    geographic = () if source.sites.frame is None else ("tracks.geojson",)
    files = ("report.html", "report.png", "tracks.csv", *geographic, "result.nc", "checks.json", "config.yaml")
    tell_run(
        outcome, (outcome.tracked.title, outcome.table), out, files, sinks, strict=strict, verdict=outcome.verdict,
        remarks=outcome.remarks,
    )  # fmt: skip


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
    tell_fitted("bearings", source.name, fitted, out)


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
