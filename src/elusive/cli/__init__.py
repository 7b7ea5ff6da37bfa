"""The command line: `elusive track`, `locate`, `fit`, `chart`, `simulate`, `reproduce` and others; pipelines do it."""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

import elusive
from elusive.campaign import CampaignConfig, make_executor, resolve, run_campaign
from elusive.cli import reproduce, simulate, track
from elusive.cli.bearings import track_bearings_command
from elusive.cli.charts import chart_command
from elusive.cli.links import fit_app, track_links_command
from elusive.cli.locate import locate_command
from elusive.cli.terminal import Out, Scheduler, Workers, bar, campaign_bar, console, interrupt, interrupted, show
from elusive.cli.workbench import scene_command, workbench_command
from elusive.errors import ElusiveError
from elusive.experiments.amrouche2018.trial import SCENARIO as AMROUCHE2018
from elusive.experiments.demo import run_demo
from elusive.experiments.jiang2024.trial import SCENARIO as JIANG2024
from elusive.experiments.mazurek2013.trial import SCENARIO as MAZUREK2013
from elusive.experiments.mendieta2017.trial import SCENARIO as MENDIETA2017

BAD_INPUT = 2
CHARTS = (".000", ".geojson", ".json", ".shp")
SCENARIOS = {
    "amrouche2018": AMROUCHE2018,
    "jiang2024": JIANG2024,
    "mazurek2013": MAZUREK2013,
    "mendieta2017": MENDIETA2017,
}

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, help=elusive.__doc__)
track.app.command("links")(track_links_command)
track.app.command("bearings")(track_bearings_command)
app.add_typer(track.app, name="track")
app.add_typer(fit_app, name="fit")
app.command("chart")(chart_command)
app.command("locate")(locate_command)
app.add_typer(simulate.app, name="simulate")
app.add_typer(reproduce.app, name="reproduce")
app.command("workbench")(workbench_command)
app.command("scene")(scene_command)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command; a fault of the input is one sentence and exit code 2, Ctrl-C is 130."""
    interrupted.clear()
    previous = signal.signal(signal.SIGINT, interrupt)
    try:
        app(args=_spread(sys.argv[1:] if arguments is None else arguments), standalone_mode=True)
    except ElusiveError as error:
        console.print(f"[bold red]Error:[/] {escape(str(error))}", highlight=False, soft_wrap=True)
        sys.exit(BAD_INPUT)
    finally:
        signal.signal(signal.SIGINT, previous)


def _spread(arguments: Sequence[str]) -> list[str]:
    """Write ``--chart A B`` as ``--chart A --chart B``, as an option takes one value; charts have known endings."""
    spread: list[str] = []
    among_charts = False
    for argument in arguments:
        is_chart = Path(argument).suffix.lower() in CHARTS
        if among_charts and is_chart and spread[-1] != "--chart":
            spread.append("--chart")
        among_charts = argument == "--chart" or (among_charts and (is_chart or spread[-1] == "--chart"))
        spread.append(argument)
    return spread


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"elusive {elusive.__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Detect and track what is too faint, too noise-like, too fast or too poorly charted for detect-then-track."""


@app.command("demo")
def demo_command(
    out: Out = Path("demo"),
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 1,
) -> None:
    """Draw a target too weak to see and find it: the quickest way to know what this does."""
    with bar("frames", None) as advance:
        result = run_demo(out, seed=seed, on_frame=advance)
    show("At the same rate of false alarms", result.header, result.rows)
    console.print(f"Written to {out}: tracks.csv, result.nc, report.html (open it), report.png")


@app.command("campaign")
def campaign_command(
    config: Annotated[Path, typer.Argument(help="YAML file: scenario, parameters, grid, trials, seed.")],
    out: Annotated[Path, typer.Option("--out", help="Zarr store for the results; a killed campaign goes on in it.")],
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Run a scenario over a grid of parameters and many trials; killed and started again, it goes on."""
    configuration = CampaignConfig.from_yaml(config)
    scenario = resolve(configuration.scenario, SCENARIOS)
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        run_campaign(scenario, configuration, out, executor=executor, on_progress=report)
    console.print(f"Written to {out}")
