"""`elusive reproduce`: a paper's figures and tables."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from elusive.campaign import make_executor
from elusive.cli.terminal import Out, Scheduler, Workers, campaign_bar, console, show
from elusive.experiments.amrouche2018.figures import FIGURES
from elusive.experiments.amrouche2018.reproduce import DEFAULT_TRIALS
from elusive.experiments.amrouche2018.reproduce import reproduce as reproduce_amrouche2018
from elusive.experiments.bootsveld2012.reproduce import DEFAULT_TRIALS as BOOTSVELD2012_TRIALS
from elusive.experiments.bootsveld2012.reproduce import TARGETS as BOOTSVELD2012_TARGETS
from elusive.experiments.bootsveld2012.reproduce import Settings as Bootsveld2012Settings
from elusive.experiments.bootsveld2012.reproduce import reproduce as reproduce_bootsveld2012
from elusive.experiments.bootsveld2012.trial import Estimate
from elusive.experiments.jiang2024.reproduce import DEFAULT_TRIALS as JIANG2024_TRIALS
from elusive.experiments.jiang2024.reproduce import TARGETS as JIANG2024_TARGETS
from elusive.experiments.jiang2024.reproduce import reproduce as reproduce_jiang2024
from elusive.experiments.mazurek2013.reproduce import TARGETS as MAZUREK2013_TARGETS
from elusive.experiments.mazurek2013.reproduce import reproduce as reproduce_mazurek2013
from elusive.experiments.mendieta2017.reproduce import DEFAULT_TRIALS as MENDIETA2017_TRIALS
from elusive.experiments.mendieta2017.reproduce import TARGETS as MENDIETA2017_TARGETS
from elusive.experiments.mendieta2017.reproduce import reproduce as reproduce_mendieta2017
from elusive.experiments.mendieta2017.scenario import METHODS as MENDIETA2017_METHODS
from elusive.experiments.mendieta2017.scenario import MethodName

app = typer.Typer(no_args_is_help=True, help="Reproduce a paper's figures and tables.")


@app.command("amrouche2018")
def reproduce_amrouche2018_command(
    out: Out,
    targets: Annotated[list[str] | None, typer.Argument(help=f"Some of {', '.join(FIGURES)}; all by default.")] = None,
    trials: Annotated[int, typer.Option(min=2, help="Monte Carlo trials a cell.")] = DEFAULT_TRIALS,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 2018,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Figures 2 to 8 and the Monte Carlo table: track-before-detect of a weak target."""
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        cells = reproduce_amrouche2018(
            out, targets or (), trials=trials, seed=seed, executor=executor, on_progress=report
        )
    rows = [
        (
            f"{c.motion} {c.snr_db:g} dB",
            c.filter,
            f"{c.existence_10_24:.3f}",
            f"{c.existence_26_27:.3f}",
            f"{c.rmse_10_24:.2f}",
        )
        for c in cells
    ]
    show(f"{trials} trials", ("scenario", "filter", "P, frames 10-24", "P, frames 26-27", "RMSE [cells]"), rows)
    console.print(f"Written to {out}: summary.csv and figures")


@app.command("mazurek2013")
def reproduce_mazurek2013_command(
    out: Out,
    targets: Annotated[
        list[str] | None, typer.Argument(help=f"Some of {', '.join(MAZUREK2013_TARGETS)}; all by default.")
    ] = None,
    trials: Annotated[
        int | None, typer.Option(min=2, help="Cases of a figure (1000 by default) and of a point of the table (200).")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 2013,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Figures 3 to 8 and a table with check values: noise objects through four statistics."""
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        done = reproduce_mazurek2013(
            out, targets or (), trials=trials, seed=seed, executor=executor, on_progress=report
        )
    if done.cells:
        rows = [
            (
                f"size {c.object_size}, {c.statistic}, window {c.window}, {c.smoothing:g}",
                f"{c.background_sigma:g}",
                f"{c.mean_error:.1f} ± {c.standard_error:.1f}",
                c.check,
            )
            for c in done.cells
        ]
        show("Mean distance error", ("search", "background", "error, samples", "check"), rows)
    written = [*(f"{name}.csv, {name}.png" for name in done.curves), *(["table.csv"] if done.cells else [])]
    console.print(f"Written to {out}: {', '.join(written)}")


@app.command("bootsveld2012")
def reproduce_bootsveld2012_command(
    out: Out,
    targets: Annotated[
        list[str] | None,
        typer.Argument(help=f"Some of {', '.join(BOOTSVELD2012_TARGETS)}; all by default."),
    ] = None,
    trials: Annotated[int, typer.Option(min=2, help="Monte Carlo runs of a trial.")] = BOOTSVELD2012_TRIALS,
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
    settings = Bootsveld2012Settings(trials, seed, estimate, sigma_m, range_m, particles, shoreline, fine, coarse)
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        done = reproduce_bootsveld2012(out, targets or (), settings, executor=executor, on_progress=report)
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
    console.print(f"Written to {out}: {', '.join(done.written)}")


@app.command("mendieta2017")
def reproduce_mendieta2017_command(
    out: Out,
    targets: Annotated[
        list[str] | None, typer.Argument(help=f"Some of {', '.join(MENDIETA2017_TARGETS)}; all by default.")
    ] = None,
    method: Annotated[
        list[str] | None,
        typer.Option(help=f"{', '.join(MENDIETA2017_METHODS)}; give it again for more. \\[default: all]"),
    ] = None,
    trials: Annotated[int, typer.Option(min=2, help="Runs of each point.")] = MENDIETA2017_TRIALS,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 2017,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Chapter 4: people without devices in a radio network, the thesis's tracker and others."""
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        done = reproduce_mendieta2017(
            out, targets or (), methods=cast(list[MethodName], method or []), trials=trials, seed=seed,
            executor=executor, on_progress=report,
        )  # fmt: skip
    points: dict[tuple[str, str, float, str], dict[str, Any]] = {}
    for cell in done.cells:
        point = cell.experiment, cell.value, cell.awgn_db, MENDIETA2017_METHODS[cell.method]
        points.setdefault(point, {})[cell.score] = cell
    shown = [
        (
            f"{experiment}, {value}, AWGN {awgn_db:g} dB, {method}",
            f"{of['mota'].mean:.3f} ± {of['mota'].standard_error:.3f}",
            *(f"{of[count].mean:.1f}" for count in ("misses", "false_positives", "mismatches", "targets")),
        )
        for (experiment, value, awgn_db, method), of in points.items()
    ]
    show(f"{trials} runs", ("experiment and tracker", "MOTA", "missed", "false", "mismatched", "of"), shown)
    console.print(f"Written to {out}: {', '.join(done.written)}")


@app.command("jiang2024")
def reproduce_jiang2024_command(
    out: Out,
    targets: Annotated[
        list[str] | None, typer.Argument(help=f"Some of {', '.join(JIANG2024_TARGETS)}; all by default.")
    ] = None,
    trials: Annotated[int, typer.Option(min=2, help="Runs of each motion and noise.")] = JIANG2024_TRIALS,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 2024,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Table I and figures 2 to 4: a fast emitter from bearings, by factor graphs and others."""
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        done = reproduce_jiang2024(out, targets or (), trials=trials, seed=seed, executor=executor, on_progress=report)
    rows = [
        (
            f"{c.motion} {c.sigma_deg:g} degrees, {c.filter}",
            f"{c.rmse_m:.3g} ± {c.standard_error:.2g}",
            "" if math.isnan(c.paper_m) else f"{c.paper_m:.2f}",
            f"{c.bound_m:.3g}",
            f"{c.nees:.2f}",
        )
        for c in done.cells
    ]
    if rows:
        show(f"{trials} runs", ("flight and filter", "RMSE [m]", "paper", "bound", "NEES, right is 2"), rows)
    console.print(f"Written to {out}: {', '.join(done.written)}")
