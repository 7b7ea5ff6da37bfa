"""The command line: `elusive track`, `demo`, `reproduce`, `campaign`. It calls pipelines and experiments, no more."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

import elusive
from elusive.campaign import CampaignConfig, make_executor, resolve, run_campaign
from elusive.campaign import Progress as CampaignProgress
from elusive.errors import ElusiveError
from elusive.experiments.amrouche2018.figures import FIGURES
from elusive.experiments.amrouche2018.reproduce import DEFAULT_TRIALS, reproduce
from elusive.experiments.amrouche2018.trial import SCENARIO as AMROUCHE2018
from elusive.experiments.demo import run_demo
from elusive.io import open_frames, read_truth
from elusive.model import read_yaml
from elusive.options import accepts, nested
from elusive.pipelines.images import ImageTracking, track_recording

BAD_INPUT = 2
SCENARIOS = {"amrouche2018": AMROUCHE2018}

console = Console(stderr=True)
_interrupted = threading.Event()
app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, help=elusive.__doc__)
track_app = typer.Typer(no_args_is_help=True, help="Find and track what is in a recording.")
reproduce_app = typer.Typer(no_args_is_help=True, help="Reproduce a paper's figures and tables.")
app.add_typer(track_app, name="track")
app.add_typer(reproduce_app, name="reproduce")

Out = Annotated[Path, typer.Option("--out", help="Folder for the results; made if need be.")]
Workers = Annotated[int | None, typer.Option("--workers", min=1, help="Processes to share the trials among.")]
Scheduler = Annotated[str | None, typer.Option("--scheduler", help="Address of a Dask scheduler, tcp://host:8786.")]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command; a fault of the input is one sentence and exit code 2, Ctrl-C is 130."""
    _interrupted.clear()
    previous = signal.signal(signal.SIGINT, _interrupt)
    try:
        app(args=arguments, standalone_mode=True)
    except ElusiveError as error:
        console.print(f"[bold red]Error:[/] {escape(str(error))}", highlight=False, soft_wrap=True)
        sys.exit(BAD_INPUT)
    finally:
        signal.signal(signal.SIGINT, previous)


def _interrupt(signum: int, frame: FrameType | None) -> None:
    """Note a first Ctrl-C for the next frame or trial to heed: amid a compilation it would end as a traceback."""
    if _interrupted.is_set():
        raise KeyboardInterrupt
    _interrupted.set()


def _heed_interrupt() -> None:
    if _interrupted.is_set():
        console.print("Interrupted.")
        raise KeyboardInterrupt


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


@track_app.command("images")
@accepts(ImageTracking)
def track_images_command(
    source: Annotated[
        str,
        typer.Argument(
            help="Folder or glob of PNG/TIFF, multi-page TIFF, .npy, .npz, HDF5 (file.h5::/name), GIF, video."
        ),
    ],
    out: Out,
    given: dict[str, Any],
    config: Annotated[Path | None, typer.Option("--config", help="YAML file with any of the parameters below.")] = None,
    truth: Annotated[
        Path | None, typer.Option("--truth", help="File with 'x y' a frame, 0-based; only scores.")
    ] = None,
    truth_one_based: Annotated[bool, typer.Option(help="The truth counts pixels from 1.")] = False,
    rate_hz: Annotated[float | None, typer.Option("--rate-hz", help="Frames a second; else from the file.")] = None,
    start: Annotated[int, typer.Option(help="First frame to use, from 0.")] = 0,
    stop: Annotated[int | None, typer.Option(help="Frame before which to stop.")] = None,
) -> None:
    """Track a target too faint to threshold through a sequence of frames."""
    parameters = ImageTracking(**nested(ImageTracking, given, read_yaml(config) if config else {}))
    places = None if truth is None else read_truth(truth, one_based=truth_one_based)
    frames = open_frames(source, start=start, stop=stop, rate_hz=rate_hz)
    with _bar("frames", frames.length) as advance:
        outcome = track_recording(frames, parameters, out, truth=places, on_frame=advance)
    _show(outcome.tracked.title, ("", ""), outcome.tracked.rows)
    console.print(f"Written to {out}: tracks.csv, tracks_mot.csv, result.nc, report.html, report.png, config.yaml")


@app.command("demo")
def demo_command(
    out: Out = Path("demo"),
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 1,
) -> None:
    """Draw a target too weak to see and find it: the quickest way to know what this does."""
    with _bar("frames", None) as advance:
        result = run_demo(out, seed=seed, on_frame=advance)
    _show("At the same rate of false alarms", result.header, result.rows)
    console.print(f"Written to {out}: tracks.csv, result.nc, report.html (open it), report.png")


@reproduce_app.command("amrouche2018")
def reproduce_amrouche2018_command(
    out: Out,
    targets: Annotated[list[str] | None, typer.Argument(help=f"Some of {', '.join(FIGURES)}; all by default.")] = None,
    trials: Annotated[int, typer.Option(min=2, help="Monte Carlo trials a cell.")] = DEFAULT_TRIALS,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 2018,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Figures 2 to 8 and the Monte Carlo table: track-before-detect of a weak target."""
    with make_executor(workers, scheduler) as executor, _campaign_bar() as report:
        cells = reproduce(out, targets or (), trials=trials, seed=seed, executor=executor, on_progress=report)
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
    _show(f"{trials} trials", ("scenario", "filter", "P, frames 10-24", "P, frames 26-27", "RMSE [cells]"), rows)
    console.print(f"Written to {out}: summary.csv and figures")


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
    with make_executor(workers, scheduler) as executor, _campaign_bar() as report:
        run_campaign(scenario, configuration, out, executor=executor, on_progress=report)
    console.print(f"Written to {out}")


@contextmanager
def _bar(what: str, total: int | None) -> Iterator[Callable[[int], None]]:
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(what, total=total)

        def advance(done: int) -> None:
            _heed_interrupt()
            progress.update(task, completed=done)

        yield advance


@contextmanager
def _campaign_bar() -> Iterator[Callable[[CampaignProgress], None]]:
    columns = (TextColumn("trials"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
        task = progress.add_task("", total=None)

        def report(state: CampaignProgress) -> None:
            _heed_interrupt()
            left = "" if state.remaining_s is None else f"{state.remaining_s:.0f} s left"
            progress.update(task, completed=state.done, total=state.total, description=left)

        yield report


def _show(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    table = Table(title=title, title_justify="left", show_header=any(header), title_style="bold")
    for number, name in enumerate(header):
        table.add_column(name, justify="left" if number == 0 else "right")
    for row in rows:
        table.add_row(*row)
    Console().print(table)
