"""`elusive reproduce bootsveld2012`: ships near imprecisely charted coasts."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from elusive.campaign import make_executor
from elusive.cli.terminal import Out, Scheduler, Workers, campaign_bar, say, show
from elusive.experiments.bootsveld2012.reproduce import DEFAULT_TRIALS, TARGETS, Settings, reproduce
from elusive.experiments.bootsveld2012.trial import Estimate


def reproduce_bootsveld2012_command(
    out: Out,
    targets: Annotated[
        list[str] | None,
        typer.Argument(help=f"Some of {', '.join(TARGETS)}; all by default."),
    ] = None,
    trials: Annotated[int, typer.Option(min=2, help="Monte Carlo runs of a trial.")] = DEFAULT_TRIALS,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 2012,
    estimate: Annotated[
        Estimate,
        typer.Option(help="What is read from a belief: its mean, the MAP particle, the mode of each coordinate."),
    ] = "marginal",
    sigma_m: Annotated[
        float | None, typer.Option(help="Deviation of the charted coast; 7 in the canal and 5 at the port by default.")
    ] = None,
    range_m: Annotated[
        float | None, typer.Option(help="Of the ship; by default 10 000 as the canal begins and 5000 at the port.")
    ] = None,
    particles: Annotated[int, typer.Option(min=1, help="Particles of each filter.")] = 6000,
    shoreline: Annotated[
        Path | None,
        typer.Option(help="GeoJSON or shapefile of land for Port Fourchon; a synthetic delta by default."),
    ] = None,
    fine: Annotated[
        Path | None, typer.Option(help="For imprecise: the chart along whose coast the ship goes, taken for the truth.")
    ] = None,
    coarse: Annotated[Path | None, typer.Option(help="For imprecise: the chart that the filters have.")] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Ships near imprecisely charted coasts: a canal, Port Fourchon, and what each method costs."""
    settings = Settings(trials, seed, estimate, sigma_m, range_m, particles, shoreline, fine, coarse)
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        done = reproduce(out, targets or (), settings, executor=executor, on_progress=report)
    if done.summaries:
        rows = [
            (
                f"{s.way}, {s.method}",
                f"{s.rmse_m:.2f} ± {s.standard_error_m:.2f}",
                f"{100 * s.inside:.1f} %",
                f"{100 * s.left_out:.1f} %",
            )
            for s in done.summaries
        ]
        header = ("trial and filter", "RMSE [m]", "ship in the filter's 99 %", "map left out")
        show(f"{trials} runs, estimate: {estimate}", header, rows)
    if done.phases:
        checks = [
            (
                f"t = {p.time_s} s, {p.inland_m:.1f} m inland, {p.method}",
                f"{p.bias_m:.2f} ± {p.standard_error_m:.2f}",
                f"{p.check_m:g}",
            )
            for p in done.phases
        ]
        show("Trial B at 5 km, bias of x", ("phase", "bias [m]", "check"), checks)
    if done.run_times:
        times = [
            (t.method, f"{t.prepare_s:.3g}", f"{t.run_s:.3g}", f"{t.chart_s:.3g}", f"{t.megabytes:.3g}", t.thesis)
            for t in done.run_times
        ]
        named = ("method", "prepare [s]", "run [s]", "for the chart [s]", "memory [MB]", "thesis")
        show("One run at the port", named, times)
    if done.imprecise:
        at_charts = [
            (
                f"{r.offset_m:g} m off, radar {r.range_m}, {r.knowledge} {r.sigma} {r.coast_error}".rstrip(),
                f"{r.rmse_m:.2f} ± {r.rmse_error_m:.2f}",
                f"{r.lost} of {r.runs}",
            )
            for r in done.imprecise
        ]
        show(
            "A ship along the fine chart's coast, tracked with the coarse one",
            ("filter", "RMSE [m]", "lost"),
            at_charts,
        )
    say(f"Written to {out}: {', '.join(done.written)}")
